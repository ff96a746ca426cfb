// traceur learn: practise a skill.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/search.h"
#include "apps/cli/trained.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/printable.h"
#include "traceur/optim/all.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::cli {
namespace {

using skill::Skill;

struct Arguments {
  LearnOptions options;
  std::optional<double> task;
  std::optional<std::string> tasks;
  std::string out;
  int threads = 0;
  bool resume = false;
  bool quiet = false;
  bool json = false;
};

std::string defaultOut(const Skill& skill, const LearnOptions& o) {
  const std::string name = fileNamePart(skill.name);
  if (!o.tasks.empty()) return fmt::format("runs/{}-family-seed{}.run", name, o.seed);
  return fmt::format("runs/{}-{}-seed{}.run", name, o.task, o.seed);
}

/// Runs the best trial again, recorded, and stores it with what it did.
skill::Rollout record(RunFile& run, const std::shared_ptr<const Skill>& skill,
                      const optim::Summary& summary, double task) {
  sim::Recording recording;
  skill::Rollout r = skill::Runner(skill).run(summary.progress.best->x, task, &recording);
  run.putRecording("best", recording.encode());
  const bool says = !skill->task.achieved.empty();
  run.setMeta({{"stop", words(summary.stop)},
               {"achieved", says ? fmt::format("{}", r.achieved) : "-"},
               {"ended", r.ended},
               {"hash", fmt::format("{:016x}", r.hash)}});
  return r;
}

void report(const Arguments& a, const Skill& skill, const optim::Summary& summary,
            const skill::Rollout& r, const std::string& out) {
  const optim::Progress& p = summary.progress;
  const bool says = !skill.task.achieved.empty();  // what a trial did, in the task's unit
  const bool reached = !r.failed() && std::abs(r.achieved - a.options.task) <= skill.task.tolerance;
  if (a.json) {
    nlohmann::ordered_json j;
    j["skill"] = skill.name;
    j["task"] = a.options.task;
    j["achieved"] = says ? nlohmann::ordered_json(r.achieved) : nlohmann::ordered_json(nullptr);
    j["unit"] = skill.task.unit;
    j["reached"] = says ? nlohmann::ordered_json(reached) : nlohmann::ordered_json(nullptr);
    j["ended"] = r.ended;
    j["best_cost"] = p.best->evaluation.cost;
    j["evaluations"] = p.evaluations;
    j["diverged"] = p.failed;
    j["stop"] = summary.stop.reason;
    j["seed"] = a.options.seed;
    j["hash"] = fmt::format("{:016x}", r.hash);
    for (size_t i = 0; i < skill.parameters.size(); ++i) {
      j["parameters"][skill.parameters[i].name] = p.best->x[static_cast<Eigen::Index>(i)];
    }
    j["run"] = out;
    printJson(j);
    return;
  }
  if (a.quiet) return;
  const auto& t = skill.task;
  const std::string fails = r.failed() ? "the trial fails: " + r.ended : "";
  if (says) {
    print("{}: {} {:.4g} {}, asked {:.4g} {} ({})\n", skill.name, t.name, r.achieved, t.unit,
          a.options.task, t.unit,
          !fails.empty() ? fails
          : reached      ? "reached"
                         : "not within the tolerance yet");
  } else {
    const double target = skill.target_cost;
    print("{}: best cost {:.4g}{}{}\n", skill.name, p.best->evaluation.cost,
          std::isfinite(target) ? fmt::format(", target {:.4g}", target) : "",
          fails.empty() ? "" : " (" + fails + ")");
  }
  print("  {} trials, best cost {:.3g}, ended: {}\n", p.evaluations, p.best->evaluation.cost,
        words(summary.stop));
  print("  run file   {}\n  film       traceur render {}\n  figures    traceur plot {}\n", out, out,
        out);
}

void requireInRange(const Skill& skill, double task, const char* option) {
  if (task >= skill.task.min && task <= skill.task.max) return;
  throw InputError(fmt::format("{} {} {}: {} asks for {} within [{}, {}]", option, task,
                               skill.task.unit, skill.name, skill.task.name, skill.task.min,
                               skill.task.max));
}

void report(const Arguments& a, const Skill& skill, const optim::Summary& summary,
            const Eigen::VectorXd& tasks, const optim::Family& family, const std::string& out) {
  const optim::Progress& p = summary.progress;
  if (a.json) {
    nlohmann::ordered_json j{{"skill", skill.name},
                             {"tasks", std::vector<double>(tasks.begin(), tasks.end())},
                             {"unit", skill.task.unit},
                             {"cost", family.cost},
                             {"task_costs", family.task_costs},
                             {"evaluations", p.evaluations},
                             {"diverged", p.failed},
                             {"stop", summary.stop.reason},
                             {"seed", a.options.seed},
                             {"run", out}};
    printJson(j);
    return;
  }
  if (a.quiet) return;
  print("{}: a family over {} {:g} to {:g} {}, mean cost {:.3g}\n", skill.name, skill.task.name,
        tasks[0], tasks[tasks.size() - 1], skill.task.unit, family.cost);
  for (Eigen::Index i = 0; i < tasks.size(); ++i) {
    print("  {:<8.4g} cost {:.3g}\n", tasks[i], family.task_costs[i]);
  }
  print("  {} trials, ended: {}\n", p.evaluations, words(summary.stop));
  print("  run file   {}\n  perform    traceur perform {} --task {:g}\n", out, out,
        tasks[tasks.size() / 2]);
}

/// One skill for a range of tasks.
int learnFamily(const Arguments& a, const std::shared_ptr<const Skill>& skill,
                Interrupt& interrupt) {
  LearnOptions o = a.options;
  const Eigen::VectorXd tasks = toTasks(o.tasks, "--tasks");
  if (!(skill->task.min < skill->task.max)) {
    throw InputError(
        fmt::format("--tasks: {} has no [task] with a range to learn a family for", o.skill_file));
  }
  requireInRange(*skill, tasks[0], "--tasks");
  requireInRange(*skill, tasks[tasks.size() - 1], "--tasks");
  o.tasks = tasksText(tasks);
  const int control_points = controlPointsOf(o.curve, static_cast<int>(tasks.size()));
  const skill::SkillProblem problem(skill, tasks);
  const auto optimiser = optim::findOptimizer(o.optimiser, true)
                             .make(problem, {.seed = o.seed,
                                             .control_points = control_points,
                                             .lambda = o.population,
                                             .sigma = o.step_size,
                                             .x0 = skill->initialParameters()});
  const std::string out = a.out.empty() ? defaultOut(*skill, o) : a.out;
  const std::stop_token stop = interrupt.token();  // before there is a file that could be left
  RunFile run = openRun(out, toMeta(o, *skill), a.resume);
  const optim::Summary summary = search(run, problem, *optimiser,
                                        {.title = skill->name + " family",
                                         .threads = a.threads,
                                         .budget = o.budget,
                                         .target = skill->target_cost,
                                         .stop = stop,
                                         .quiet = a.quiet || a.json});
  run.setMeta({{"stop", words(summary.stop)}});
  const std::optional<optim::Family> family = optimiser->family();
  if (family) report(a, *skill, summary, tasks, *family, out);
  if (summary.end == optim::End::kInterrupted) {
    note("stopped; the same command with --resume goes on\n");
    return kInterrupted;
  }
  if (family) return kDone;
  const bool more = summary.end == optim::End::kBudget;
  note("traceur: no curve was run at all {} tasks in {} trials, ended: {}{}\n", tasks.size(),
       summary.progress.evaluations, words(summary.stop),
       more ? "; --resume with a larger --budget goes on" : "");
  return kFailed;
}

int learn(const Arguments& arguments) {
  Arguments a = arguments;
  LearnOptions& o = a.options;
  Interrupt interrupt;  // before any other thread
  const std::shared_ptr<const Skill> skill = Skill::fromFile(o.skill_file);
  const bool family = a.tasks.has_value();
  o.tasks = a.tasks.value_or("");
  if (family && !o.experience.empty()) {
    throw InputError("--experience: families do not learn from violated constraints");
  }
  if (family && a.task) throw InputError("--task is for one task, --tasks for a family");
  if (!family && !o.curve.empty()) throw InputError("--curve is for a family: expected --tasks");
  if (family && o.curve.empty()) o.curve = "linear";
  if (o.optimiser.empty()) o.optimiser = family ? "contextual" : "cma-es";
  if (o.population < 0) o.population = family ? 0 : kPopulation;
  if (family) return learnFamily(a, skill, interrupt);
  o.task = a.task.value_or(skill->task.initial);
  requireInRange(*skill, o.task, "--task");
  const std::string out = a.out.empty() ? defaultOut(*skill, o) : a.out;
  const skill::SkillProblem problem(skill, o.task);
  const RunFile::Meta meta = toMeta(o, *skill);
  const auto optimiser = optim::findOptimizer(o.optimiser, false)
                             .make(problem, {.seed = o.seed,
                                             .lambda = o.population,
                                             .sigma = o.step_size,
                                             .x0 = skill->initialParameters(),
                                             // A skill's cost says itself what a failure costs.
                                             .feasible_first = false,
                                             .experience = experienceOf(o.experience, o.optimiser,
                                                                        meta.at("parameters"),
                                                                        problem.constraints())});
  const std::stop_token stop = interrupt.token();  // before there is a file that could be left
  RunFile run = openRun(out, meta, a.resume);
  const optim::Summary summary =
      search(run, problem, *optimiser,
             {.title = fmt::format("{} {:g} {}", skill->name, o.task, skill->task.unit),
              .threads = a.threads,
              .budget = o.budget,
              .target = skill->target_cost,
              .stop = stop,
              .quiet = a.quiet || a.json});
  if (!summary.progress.best && summary.end == optim::End::kInterrupted) {
    note("traceur: stopped before the first generation was finished\n");
    return kInterrupted;
  }
  if (!summary.progress.best) {
    const optim::Progress& p = summary.progress;
    run.setMeta({{"stop", words(summary.stop)}});
    note("traceur: no trial gave a cost: {} of {} failed, ended: {}\n", p.failed, p.evaluations,
         words(summary.stop));
    return kFailed;
  }
  const skill::Rollout best = record(run, skill, summary, o.task);
  report(a, *skill, summary, best, out);
  if (summary.end != optim::End::kInterrupted) return kDone;
  note("stopped; the same command with --resume goes on\n");
  return kInterrupted;
}

}  // namespace

void addLearn(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.add_subcommand(
      "learn", "Practise a skill: search its parameters until the motion does what it asks.");
  LearnOptions& o = a->options;
  verb->add_option("SKILL", o.skill_file, "Skill file (TOML)")->required();
  verb->add_option("--task", a->task,
                   "What to ask for, in the skill's own unit; default: the file's");
  verb->add_option(
      "--tasks", a->tasks,
      "FIRST:LAST:COUNT: learn a family, one curve of parameters for a range of tasks");
  verb->add_option("--curve", o.curve, "Of a family: linear (default) or cubic")
      ->check(CLI::IsMember({"linear", "cubic"}));
  verb->add_option("--seed", o.seed, "Equal seeds give equal runs")
      ->check(isSeed())
      ->capture_default_str();
  verb->add_option("--budget", o.budget, "Trials in all; the last generation is finished")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  verb->add_option(
          "--population", o.population,
          fmt::format("Trials per generation; default: {}, of a family the optimiser's own",
                      kPopulation))
      ->check(CLI::Range(2, 100'000));
  verb->add_option("--step-size", o.step_size,
                   "First standard deviation, as a fraction of each parameter's range")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  verb->add_option("--optimiser", o.optimiser,
                   "Which search, see below; default: cma-es, of a family contextual");
  verb->add_option("--experience", o.experience,
                   "A run file whose failures teach the optimiser cma-c where not to try");
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
      "Exit code: 0 done, 1 failed, 2 wrong use, 130 stopped by Ctrl-C.");
  verb->callback([a, &exit_code] { exit_code = learn(*a); });
}

}  // namespace traceur::cli
