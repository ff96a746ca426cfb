// traceur show: what a run is and what it found.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/family_run.h"
#include "apps/cli/output.h"
#include "apps/cli/trained.h"
#include "apps/cli/verbs.h"
#include "traceur/core/hash.h"
#include "traceur/core/text.h"

namespace traceur::cli {
namespace {

/// The constraints' names, as far as trials violated them.
std::vector<std::string> violatedNames(const std::vector<TrialRow>& trials) {
  std::vector<std::string> names;
  for (const TrialRow& t : trials) {
    for (const std::string& name : split(t.violated, ',')) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

int show(const std::string& file, bool json) {
  const RunFile run = RunFile::open(file, false);
  const std::vector<TrialRow> trials = run.trials();
  const std::vector<std::string> names = violatedNames(trials);
  const optim::Progress p = progressOf(run, names);
  const auto meta = [&](const char* key) {
    const std::string value = run.meta(key).value_or("");
    return value.empty() ? "-" : value;
  };
  nlohmann::ordered_json j;
  for (const char* key :
       {"verb",       "skill",      "skill_file", "command", "task",   "tasks",  "task_unit",
        "curve",      "achieved",   "ended",      "stop",    "seed",   "budget", "optimiser",
        "experience", "population", "step_size",  "traceur", "engine", "hash"}) {
    const auto value = run.meta(key);
    const bool one_task =
        std::string_view(key) == "task" && !run.meta("tasks").value_or("").empty();
    if (value && !value->empty() && !one_task) j[key] = *value;
  }
  Hash all;
  for (const TrialRow& t : trials) {
    all.add(t.x);
    all.add({&t.cost, 1});
    all.add(t.violated);
  }
  j["trials_hash"] = fmt::format("{:016x}", all.value());
  j["evaluations"] = p.evaluations;
  j["generations"] = p.generation;
  j["diverged"] = p.failed;
  for (const std::string& name : names) {
    int count = 0;
    for (const TrialRow& t : trials) count += violates(t, name);
    j["violated"][name] = count;
  }
  if (run.meta("family")) {
    const StoredFamily family = storedFamily(run);
    j["cost"] = family.family.cost;
    for (Eigen::Index i = 0; i < family.tasks.size(); ++i) {
      j["task_costs"][fmt::format("{:g}", family.tasks[i])] = family.family.task_costs[i];
    }
  } else if (p.best && meta("tasks") == "-") {
    j["best_cost"] = p.best->evaluation.cost;
    const std::string parameters = meta("parameters");
    Eigen::Index i = 0;
    for (size_t from = 0; from < parameters.size() && i < p.best->x.size(); ++i) {
      const size_t to = std::min(parameters.find(", ", from), parameters.size());
      j["parameters"][parameters.substr(from, to - from)] = p.best->x[i];
      from = to + 2;
    }
  }
  if (json) {
    printJson(j);
    return kDone;
  }
  for (const auto& [key, value] : j.items()) {
    if (!value.is_object()) {
      print("{:<14} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
      continue;
    }
    print("{}\n", key);
    for (const auto& [name, number] : value.items()) print("  {:<24} {}\n", name, number.dump());
  }
  if (!run.meta("stop")) {
    print("cut off: {} … --resume finishes it\n", meta("verb"));
  }
  return kDone;
}

}  // namespace

void addShow(CLI::App& program, int& exit_code) {
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* verb = program.add_subcommand("show", "Summarise a run file.");
  verb->add_option("RUN", *file, "Run file")->required();
  verb->add_flag("--json", *json, "As one JSON object");
  verb->footer("Example:\n  traceur show runs/jump-0.05-seed1.run");
  verb->callback([file, json, &exit_code] { exit_code = show(*file, *json); });
}

}  // namespace traceur::cli
