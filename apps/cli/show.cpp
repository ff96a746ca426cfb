// traceur show: what a run is and what it found.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/verbs.h"
#include "traceur/core/hash.h"
#include "traceur/core/text.h"
#include "traceur/practice/run.h"
#include "traceur/practice/tasks.h"

namespace traceur::cli {
namespace {

using Json = nlohmann::ordered_json;
using practice::Run;

/// How many trials violated each constraint that any violated.
Json violations(const std::vector<TrialRow>& trials) {
  Json counts = Json::object();
  for (const TrialRow& t : trials) {
    for (const std::string& name : split(t.violated, ',')) {
      counts[name] = counts.value(name, 0) + 1;
    }
  }
  return counts;
}

std::string hashOf(const std::vector<TrialRow>& trials) {
  Hash all;
  for (const TrialRow& t : trials) {
    all.add(t.x);
    all.add({&t.cost, 1});
    all.add(t.violated);
  }
  return fmt::format("{:016x}", all.value());
}

/// What was asked.
Json asked(const practice::RunMeta& m) {
  const practice::SearchOptions& s = m.search;
  const bool family = s.tasks.size() > 0;
  Json j;
  const auto say = [&](const char* key, const std::string& text) {
    if (!text.empty()) j[key] = text;
  };
  j["verb"] = m.skill ? "learn" : "minimise";
  if (m.skill) {
    say("skill", m.skill->name);
    say("skill_file", m.skill->file);
    if (!family) j["task"] = m.skill->task;
  } else {
    say("command", m.command->command);
  }
  say("tasks", practice::tasksText(s.tasks));
  if (m.skill) say("task_unit", m.skill->task_unit);
  say("curve", s.curve);
  j["seed"] = s.seed;
  j["budget"] = s.budget;
  say("optimiser", s.optimiser);
  say("experience", s.experience);
  say("from", s.from);
  j["population"] = s.population;
  j["step_size"] = s.step_size;
  say("traceur", m.traceur);
  if (m.skill) say("engine", m.skill->engine);
  return j;
}

/// What came of it, once it has ended.
void tell(Json& j, const practice::Outcome& o) {
  if (!o.ended.empty()) {
    j["achieved"] = o.achieved ? numberOrNull(*o.achieved) : Json();
    j["ended"] = o.ended;
    j["hash"] = fmt::format("{:016x}", o.hash);
  }
  j["reached"] = boolOrNull(o.reached);
  j["stop"] = o.stop;
  if (!o.objectives.empty()) j["objectives"] = toJson(o.objectives);
  if (!o.measures.empty()) j["measures"] = toJson(o.measures);
}

Json summaryOf(const Run& run) {
  const std::vector<TrialRow> trials = run.file().trials();
  const optim::Progress p = run.progress();
  Json j = asked(run.meta());
  j["trials_hash"] = hashOf(trials);
  j["evaluations"] = p.evaluations;
  j["generations"] = p.generation;
  j["diverged"] = p.failed;
  if (const Json violated = violations(trials); !violated.empty()) j["violated"] = violated;
  if (const auto family = run.family()) {
    j["cost"] = numberOrNull(family->first.cost);
    const Eigen::VectorXd& tasks = run.meta().search.tasks;
    for (Eigen::Index i = 0; i < tasks.size(); ++i) {
      j["task_costs"][fmt::format("{:g}", tasks[i])] = numberOrNull(family->first.task_costs[i]);
    }
  } else if (p.best && !run.isFamily()) {
    j["best_cost"] = p.best->evaluation.cost;
    j["parameters"] = toJson(run.meta().parameters, p.best->x);
  }
  if (const auto outcome = run.outcome()) tell(j, *outcome);
  return j;
}

int show(const std::string& file, bool json) {
  const Run run = Run::open(file);
  const Json j = summaryOf(run);
  const std::optional<practice::Outcome> outcome = run.outcome();
  const ExitCode code = exitCode(outcome ? outcome->reached : std::nullopt);
  if (json) {
    printJson(j);
    return code;
  }
  for (const auto& [key, value] : j.items()) {
    if (value.is_null()) continue;
    if (!value.is_object()) {
      print("{:<14} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
      continue;
    }
    print("{}\n", key);
    for (const auto& [name, number] : value.items()) print("  {:<24} {}\n", name, number.dump());
  }
  if (!outcome) print("cut off: {} … --resume finishes it\n", j["verb"].get<std::string>());
  return code;
}

}  // namespace

void addShow(CLI::App& program, int& exit_code) {
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* verb = program.add_subcommand("show", "Summarise a run file.");
  verb->add_option("RUN", *file, "Run file")->required();
  verb->add_flag("--json", *json, "As one JSON object");
  verb->footer(
      "Example:\n"
      "  traceur show runs/jump-0.05-seed1.run\n"
      "Exit code: 0 done, 2 wrong use, 3 what was asked is not reached.");
  verb->callback([file, json, &exit_code] { exit_code = show(*file, *json); });
}

}  // namespace traceur::cli
