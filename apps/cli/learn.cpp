// traceur learn: practise a skill.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/practice/learn.h"
#include "traceur/practice/tasks.h"

namespace traceur::cli {
namespace {

using Json = nlohmann::ordered_json;
using practice::Learned;
using practice::SearchOptions;
using skill::Skill;

/// What is not given is as practice::learningOptions says.
struct LearnArguments {
  std::string skill_file;
  std::optional<double> task;
  std::optional<std::string> tasks;
  std::optional<std::string> curve;
  std::optional<std::string> optimiser;
  std::optional<int> population;
  std::optional<int> draws;
  SearchOptions search = practice::learningOptions();
  std::string out;
  int threads = 0;
  bool resume = false;
  bool quiet = false;
  bool json = false;
};

SearchOptions optionsOf(const LearnArguments& a) {
  SearchOptions o = a.search;
  if (a.tasks) {
    const SearchOptions family = practice::learningOptions(practice::toTasks(*a.tasks, "--tasks"));
    o.tasks = family.tasks;
    o.curve = family.curve;
    o.optimiser = family.optimiser;
    o.population = family.population;
  }
  if (a.tasks && a.task) throw InputError("--task is for one task, --tasks for a family");
  o.curve = a.curve.value_or(o.curve);
  o.optimiser = a.optimiser.value_or(o.optimiser);
  o.population = a.population.value_or(o.population);
  return o;
}

std::string defaultOut(const Skill& skill, double task, const SearchOptions& o) {
  const std::string name = fileNamePart(skill.name);
  if (o.tasks.size() > 0) return fmt::format("runs/{}-family-seed{}.run", name, o.seed);
  return fmt::format("runs/{}-{}-seed{}.run", name, task, o.seed);
}

/// What is told of one task and of a family alike.
Json searchJson(const Learned& l, const SearchOptions& o, const std::string& out) {
  const optim::Progress& p = l.summary.progress;
  Json j{{"evaluations", p.evaluations},
         {"diverged", p.failed},
         {"stop", l.summary.stop.reason},
         {"seed", o.seed},
         {"run", out}};
  if (l.beginning) j["from"] = {{"run", o.from}, {"taken", l.beginning->taken}};
  return j;
}

void tellBeginning(const Learned& l, const SearchOptions& o) {
  if (!l.beginning) return;
  print("  began at   {} of {}{}\n", join(l.beginning->taken), o.from,
        l.beginning->moved.empty()
            ? ""
            : fmt::format(" ({} moved into the range here)", join(l.beginning->moved)));
}

void report(const LearnArguments& a, const Skill& skill, double task, const SearchOptions& o,
            const Learned& l, const std::string& out) {
  const optim::Trial& best = *l.summary.progress.best;
  const skill::Rollout& r = *l.best;
  const auto& t = skill.task;
  if (a.json) {
    Json j{{"skill", skill.name},
           {"task", task},
           {"achieved", t.achieved.empty() ? Json() : numberOrNull(r.achieved)},
           {"unit", t.unit},
           {"reached", boolOrNull(l.reached)},
           {"ended", r.ended},
           {"best_cost", best.evaluation.cost},
           {"objectives", toJson(practice::objectivesOf(skill, r))},
           {"measures", toJson(practice::measuresOf(skill, r))},
           {"hash", fmt::format("{:016x}", r.hash)}};
    for (size_t i = 0; i < skill.parameters.size(); ++i) {
      j["parameters"][skill.parameters[i].name] = best.x[static_cast<Eigen::Index>(i)];
    }
    j.update(searchJson(l, o, out));
    printJson(j);
    return;
  }
  if (a.quiet) return;
  const std::string fails = r.failed() ? "the trial fails: " + r.ended : "";
  if (l.reached) {
    print("{}: {} {:.4g} {}, asked {:.4g} {} ({})\n", skill.name, t.name, r.achieved, t.unit, task,
          t.unit,
          !fails.empty() ? fails
          : *l.reached   ? "reached"
                         : "not within the tolerance yet");
  } else {
    const double target = skill.target_cost;
    print("{}: best cost {:.4g}{}{}\n", skill.name, best.evaluation.cost,
          std::isfinite(target) ? fmt::format(", target {:.4g}", target) : "",
          fails.empty() ? "" : " (" + fails + ")");
  }
  print("  {} trials, best cost {:.3g}, ended: {}\n", l.summary.progress.evaluations,
        best.evaluation.cost, practice::words(l.summary.stop));
  tellBeginning(l, o);
  print("  run file   {}\n  film       traceur render {}\n  figures    traceur plot {}\n", out, out,
        out);
}

void reportFamily(const LearnArguments& a, const Skill& skill, const SearchOptions& o,
                  const Learned& l, const std::string& out) {
  const Eigen::VectorXd& tasks = o.tasks;
  if (a.json) {
    Json j{{"skill", skill.name},
           {"tasks", std::vector<double>(tasks.begin(), tasks.end())},
           {"unit", skill.task.unit},
           {"cost", l.family->cost},
           {"task_costs", l.family->task_costs},
           {"reached", boolOrNull(l.reached)}};
    j.update(searchJson(l, o, out));
    printJson(j);
    return;
  }
  if (a.quiet) return;
  print("{}: a family over {} {:g} to {:g} {}, mean cost {:.3g}{}\n", skill.name, skill.task.name,
        tasks[0], tasks[tasks.size() - 1], skill.task.unit, l.family->cost,
        l.reached == false ? fmt::format(" (target {:g} not reached yet)", skill.target_cost) : "");
  for (Eigen::Index i = 0; i < tasks.size(); ++i) {
    print("  {:<8.4g} cost {:.3g}\n", tasks[i], l.family->task_costs[i]);
  }
  print("  {} trials, ended: {}\n", l.summary.progress.evaluations,
        practice::words(l.summary.stop));
  tellBeginning(l, o);
  print("  run file   {}\n  perform    traceur perform {} --task {:g}\n", out, out,
        tasks[tasks.size() / 2]);
}

/// Why nothing was found.
void tellNothing(const Learned& l, const SearchOptions& o) {
  const optim::Progress& p = l.summary.progress;
  if (l.summary.end == optim::End::kInterrupted && !p.best) {
    return note("traceur: stopped before the first generation was finished\n");
  }
  if (l.summary.end == optim::End::kInterrupted) return;
  if (o.tasks.size() == 0) {
    return note("traceur: no trial gave a cost: {} of {} failed, ended: {}\n", p.failed,
                p.evaluations, practice::words(l.summary.stop));
  }
  const bool more = l.summary.end == optim::End::kBudget;
  note("traceur: no curve was run at all {} tasks in {} trials, ended: {}{}\n", o.tasks.size(),
       p.evaluations, practice::words(l.summary.stop),
       more ? "; --resume with a larger --budget goes on" : "");
}

int learn(const LearnArguments& a) {
  Interrupt interrupt;  // before any other thread
  const std::shared_ptr<const Skill> skill = Skill::fromFile(a.skill_file);
  SearchOptions o = optionsOf(a);
  const bool any_drawn = !skill->conditions.empty() && o.tasks.size() == 0;
  o.draws = a.draws.value_or(any_drawn ? practice::kDraws : 0);
  const bool family = o.tasks.size() > 0;
  const double task = a.task.value_or(skill->task.initial);
  const std::string out = a.out.empty() ? defaultOut(*skill, task, o) : a.out;
  SearchLine line(family ? skill->name + " family"
                         : fmt::format("{} {:g} {}", skill->name, task, skill->task.unit),
                  o.budget, family, a.quiet || a.json);
  const Learned l =
      practice::learn(skill, task, o, out, a.resume,
                      {.threads = a.threads,
                       .stop = interrupt.token(),  // before there is a file that could be left
                       .on_generation = [&](const auto& p, const auto& f) { line.show(p, f); }});
  line.end();
  const bool found = l.best || l.family;
  if (l.best) report(a, *skill, task, o, l, out);
  if (l.family) reportFamily(a, *skill, o, l, out);
  if (!found) tellNothing(l, o);
  if (l.summary.end == optim::End::kInterrupted) {
    if (l.summary.progress.best) note("stopped; the same command with --resume goes on\n");
    return kInterrupted;
  }
  return found ? exitCode(l.reached) : kFailed;
}

}  // namespace

void addLearn(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<LearnArguments>();
  CLI::App* verb = program.add_subcommand(
      "learn", "Practise a skill: search its parameters until the motion does what it asks.");
  SearchOptions& o = a->search;
  verb->add_option("SKILL", a->skill_file, "Skill file (TOML)")->required();
  verb->add_option("--task", a->task,
                   "What to ask for, in the skill's own unit; default: the file's");
  verb->add_option(
      "--tasks", a->tasks,
      "FIRST:LAST:COUNT: learn a family, one curve of parameters for a range of tasks");
  verb->add_option("--curve", a->curve, "Of a family: linear (default) or cubic")
      ->check(CLI::IsMember({"linear", "cubic"}));
  verb->add_option("--seed", o.seed, "Equal seeds give equal runs")
      ->check(isSeed())
      ->capture_default_str();
  verb->add_option("--budget", o.budget, "Trials in all; the last generation is finished")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  verb->add_option(
          "--population", a->population,
          fmt::format("Trials per generation; default: {}, of a family the optimiser's own",
                      practice::kPopulation))
      ->check(CLI::Range(2, 100'000));
  verb->add_option("--step-size", o.step_size,
                   "First standard deviation, as a fraction of each parameter's range")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  verb->add_option("--optimiser", a->optimiser,
                   "Which search, see below; default: cma-es, of a family contextual");
  verb->add_option("--experience", o.experience,
                   "A run file whose failures teach the optimiser cma-c where not to try");
  verb->add_option("--draws", a->draws,
                   fmt::format("Of a skill with [conditions]: how many drawn ones each trial is "
                               "tried in; 0: its default ones alone; default: {}",
                               practice::kDraws))
      ->check(CLI::Range(0, 1000));
  verb->add_option("--given", o.given,
                   "NAME=VALUE or NAME=MIN:MAX: other [conditions] to practise under, as "
                   "height=2:6. One for each")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--from", o.from,
                   "A run file whose best parameters the search begins at, by their names");
  verb->add_option(
          "--only", o.only,
          "Parameters to search, patterns as a shell has, \"squat_*\"; the others stay where "
          "they begin. Default: all")
      ->delimiter(',');
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option(
      "--out", a->out,
      "Run file; default: runs/SKILL-TASK-seedN.run, of a family runs/SKILL-family-seedN.run");
  verb->add_flag("--resume", a->resume, "Go on with the run file if it is there");
  verb->add_flag("--quiet", a->quiet, "Print nothing but errors");
  verb->add_flag("--json", a->json, "Print one JSON object at the end");
  verb->footer(
      optimisersHelp() +
      "Examples:\n"
      "  traceur learn skills/bioloid-gp/jump.toml\n"
      "  traceur learn skills/bioloid-gp/jump.toml --task 0.07 --seed 3 --out runs/high.run\n"
      "  traceur learn skills/bioloid-gp/jump.toml --resume        # after Ctrl-C\n"
      "  traceur learn skills/bioloid-gp/jump.toml --tasks 0.03:0.08:6 --budget 3000\n"
      "Exit code: 0 done, 1 failed, 2 wrong use, 3 what was asked is not reached yet, 130 stopped "
      "by "
      "Ctrl-C.");
  verb->callback([a, &exit_code] { exit_code = learn(*a); });
}

}  // namespace traceur::cli
