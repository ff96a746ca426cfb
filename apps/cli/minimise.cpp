// traceur minimise: search the arguments of a function that another program computes.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/external_problem.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/core/text.h"
#include "traceur/practice/search.h"
#include "traceur/practice/tasks.h"

namespace traceur::cli {
namespace {

/// What happens to a trial that the command breaks down on: "fail" it, or "stop" the search.
constexpr const char* kOnCrash = "fail";

struct MinimiseArguments {
  std::vector<std::string> variables;
  std::vector<std::string> constraints;
  std::vector<std::string> command;
  std::string tasks;
  std::string curve;
  std::string optimiser;
  std::uint64_t seed = 1;
  int budget = 10000;
  int population = 0;
  double step_size = 0.3;
  double target = -kInfinity;
  int threads = 0;
  std::string out;
  std::string experience;
  std::string on_crash;  // "": as the run has it, else kOnCrash
  bool resume = false;
  bool quiet = false;
  bool json = false;
};

/// NAME=MIN:MAX or NAME=MIN:MAX:START
ParamSpec toVariable(const std::string& text) {
  const std::string where = "--var " + text;
  const size_t equals = text.find('=');
  const std::vector<std::string> parts =
      split(equals == std::string::npos ? "" : text.substr(equals + 1), ':');
  if (equals == 0 || parts.size() < 2 || parts.size() > 3 || text.back() == ':') {
    throw InputError(fmt::format("{}: expected NAME=MIN:MAX or NAME=MIN:MAX:START", where));
  }
  ParamSpec p;
  p.name = text.substr(0, equals);
  p.min = toNumber(parts[0], where);
  p.max = toNumber(parts[1], where);
  if (!(p.min < p.max))
    throw InputError(fmt::format("{}: {} is not below {}", where, p.min, p.max));
  p.initial = parts.size() == 3                              ? toNumber(parts[2], where)
              : std::isfinite(p.max - p.min)                 ? p.min + (p.max - p.min) / 2
              : std::isfinite(p.min) && std::isfinite(p.max) ? p.min / 2 + p.max / 2
              : std::isfinite(p.min)                         ? p.min + 1
              : std::isfinite(p.max)                         ? p.max - 1
                                                             : 0;
  if (!(p.initial >= p.min && p.initial <= p.max)) {
    throw InputError(
        fmt::format("{}: START {} is outside [{}, {}]", where, p.initial, p.min, p.max));
  }
  return p;
}

ExternalFunction toFunction(const MinimiseArguments& a) {
  ExternalFunction f;
  f.command = a.command;
  for (const std::string& text : a.variables) f.variables.push_back(toVariable(text));
  f.constraints = a.constraints;
  std::vector<std::string> names;
  for (const ParamSpec& p : f.variables) names.push_back(p.name);
  for (const std::string& name : f.constraints) {  // words of an answer, and of the run file's list
    if (name.empty() || name.find_first_of(", \t\r\n") != std::string::npos) {
      throw InputError(
          fmt::format("--constraint \"{}\": expected a word without spaces and commas", name));
    }
  }
  for (const auto* list : {&names, &f.constraints}) {
    std::vector<std::string> sorted = *list;
    std::sort(sorted.begin(), sorted.end());
    if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
        twice != sorted.end()) {
      throw InputError(fmt::format("\"{}\" is named twice", *twice));
    }
  }
  if (!a.tasks.empty()) f.tasks = practice::toTasks(a.tasks, "--tasks");
  return f;
}

practice::RunMeta toMeta(const MinimiseArguments& a, const ExternalFunction& f) {
  return {.search = {.seed = a.seed,
                     .budget = a.budget,
                     .optimiser = a.optimiser,
                     .population = a.population,
                     .step_size = a.step_size,
                     .tasks = f.tasks,
                     .curve = a.curve,
                     .experience = a.experience},
          .parameters = f.variables,
          .constraints = f.constraints,
          .command = practice::CommandInRun{.command = join(a.command, " "),
                                            .variables = join(a.variables, ", ")}};
}

void report(const MinimiseArguments& a, const ExternalFunction& f, const optim::Summary& summary,
            const optim::Optimizer& optimiser, const std::string& out) {
  const optim::Progress& p = summary.progress;
  nlohmann::ordered_json j;
  if (f.tasks.size() > 0) {
    if (const std::optional<optim::Family> best = optimiser.family()) {
      j["best_cost"] = best->cost;
      const Eigen::VectorXd& tasks = f.tasks;
      for (Eigen::Index i = 0; i < tasks.size(); ++i) {
        const double w =
            tasks.size() == 1 ? 0 : (tasks[i] - tasks[0]) / (tasks.tail(1)[0] - tasks[0]);
        j["tasks"].push_back({{"task", tasks[i]},
                              {"cost", best->task_costs[i]},
                              {"x", toJson(f.variables, best->curve.at(w))}});
      }
    }
  } else {
    j["best_cost"] = p.best->evaluation.cost;
    j["feasible"] = p.best->evaluation.feasible();
    j["x"] = toJson(f.variables, p.best->x);
  }
  j["evaluations"] = p.evaluations;
  j["failed"] = p.failed;
  j["stop"] = summary.stop.reason;
  j["stop_value"] = summary.stop.value;
  j["stop_limit"] = summary.stop.limit;
  j["run"] = out;
  if (a.json) {
    printJson(j);
    return;
  }
  if (a.quiet) return;
  if (j.contains("x")) {
    for (const auto& [name, value] : j["x"].items()) print("{:<16} {}\n", name, value.dump());
  }
  if (j.contains("tasks")) {
    for (const auto& task : j["tasks"]) {
      print("task {:<8g} cost {:<12.5g}", task["task"].get<double>(), task["cost"].get<double>());
      for (const auto& [name, value] : task["x"].items()) {
        print("  {} {:.6g}", name, value.get<double>());
      }
      print("\n");
    }
  }
  constexpr double none = std::numeric_limits<double>::quiet_NaN();  // NAN would be a float
  print("cost {:.6g}{}  {} trials, {} failed, ended: {}\nrun file {}\n", j.value("best_cost", none),
        j.value("feasible", true) ? "" : " (violates a constraint)", p.evaluations, p.failed,
        practice::words(summary.stop), out);
}

/// Tells of the first trial that broke down, and counts them.
class Breakdowns {
 public:
  void add(const optim::Broken& trial) {
    if (count_++ > 0) return;
    complain(fmt::format(
        "{}\nThis trial counts as failed, and the command is started anew; others like it are not "
        "told one by one. --on-crash stop ends the search instead.",
        trial.what()));
  }
  void tell() const {
    if (count_ > 1) note("traceur: {} trials broke down and failed\n", count_.load());
  }

 private:
  std::atomic<int> count_ = 0;
};

int minimise(const MinimiseArguments& arguments) {
  MinimiseArguments a = arguments;
  Interrupt interrupt;  // before any other thread
  const ExternalFunction function = toFunction(a);
  if (function.tasks.size() > 0 && !a.experience.empty()) {
    throw InputError("--experience: families do not learn from violated constraints");
  }
  if (a.optimiser.empty()) a.optimiser = function.tasks.size() > 0 ? "contextual" : "cma-c";
  if (function.tasks.size() == 0 && !a.curve.empty()) {
    throw InputError("--curve is for a family: expected --tasks");
  }
  if (function.tasks.size() > 0 && a.curve.empty()) a.curve = "linear";
  ExternalProblem problem(function);
  const practice::RunMeta meta = toMeta(a, function);
  const auto optimiser =
      practice::optimiserFor(problem, initialOf(function.variables), meta.search, true);
  const std::string out = a.out.empty() ? fmt::format("runs/minimise-seed{}.run", a.seed) : a.out;
  const std::stop_token stop = interrupt.token();  // before there is a file that could be left
  practice::Run run = practice::Run::begin(out, meta, a.resume);
  if (a.on_crash.empty()) a.on_crash = run.file().meta("on_crash").value_or(kOnCrash);
  run.file().setMeta({{"on_crash", a.on_crash}});
  const bool goes_on = a.on_crash != "stop";
  problem.secondChance(goes_on);
  problem.heed(stop);
  Breakdowns breakdowns;
  const std::function<void(const optim::Broken&)> on_broken = [&](const optim::Broken& trial) {
    breakdowns.add(trial);
  };
  SearchLine line(a.optimiser, a.budget, function.tasks.size() > 0, a.quiet || a.json);
  const optim::Summary summary =
      practice::search(run, problem, *optimiser, a.target,
                       {.threads = a.threads,
                        .stop = stop,
                        .on_generation = [&](const auto& p, const auto& f) { line.show(p, f); },
                        .on_broken = goes_on ? on_broken : nullptr});
  line.end();
  breakdowns.tell();
  run.setOutcome({.stop = practice::words(summary.stop)});
  const bool family = function.tasks.size() > 0;
  const bool found = family ? optimiser->family().has_value() : summary.progress.best.has_value();
  if (!found && summary.end == optim::End::kInterrupted) {
    note("stopped; the same command with --resume goes on\n");
    return kInterrupted;
  }
  if (!found) {
    const optim::Progress& p = summary.progress;
    const std::string what =
        family && p.failed < p.evaluations
            ? fmt::format("no curve was run at all {} tasks in {} trials", function.tasks.size(),
                          p.evaluations)
            : fmt::format("no trial gave a cost: {} of {} failed", p.failed, p.evaluations);
    note("traceur: {}, ended: {}\n", what, practice::words(summary.stop));
    return kFailed;
  }
  report(a, function, summary, *optimiser, out);
  if (summary.end != optim::End::kInterrupted) return kDone;
  note("stopped; the same command with --resume goes on\n");
  return kInterrupted;
}

}  // namespace

void addMinimise(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<MinimiseArguments>();
  CLI::App* verb = program.add_subcommand(
      "minimise", "Search the arguments of a function that your own program computes.");
  verb->add_option(
          "COMMAND", a->command,
          "Program and arguments, after --. It reads a line of values, one for each --var, "
          "and answers with a line, flushed: the cost, then the names of violated constraints; or "
          "\"failed\". It ends with the search")
      ->required();
  // Options that may come again must not take the -- that follows: the command's would be ours.
  verb->add_option("--var", a->variables,
                   "NAME=MIN:MAX or NAME=MIN:MAX:START; bounds may be -inf, inf. One for each")
      ->required()
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--constraint", a->constraints, "A name the command may answer. One for each")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--tasks", a->tasks,
                   "FIRST:LAST:COUNT: the command answers with a cost for each of so many tasks, "
                   "and a curve of values is sought");
  verb->add_option("--curve", a->curve, "With --tasks: linear (default) or cubic")
      ->check(CLI::IsMember({"linear", "cubic"}));
  verb->add_option("--optimiser", a->optimiser,
                   "Which search, see below; default: cma-c, with --tasks contextual");
  verb->add_option("--budget", a->budget, "Trials in all; the last generation is finished")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  verb->add_option("--target", a->target, "Stop at a cost this low");
  verb->add_option("--population", a->population, "Trials per generation; 0: the default")
      ->check(CLI::Range(0, 100'000));
  verb->add_option("--step-size", a->step_size,
                   "First standard deviation, as a fraction of each range")
      ->check(CLI::Range(1e-12, 1e12))
      ->capture_default_str();
  verb->add_option("--seed", a->seed, "Equal seeds give equal runs")
      ->check(isSeed())
      ->capture_default_str();
  verb->add_option("--threads", a->threads,
                   "Commands at once; 0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--experience", a->experience,
                   "A run file whose trials teach cma-c where constraints are violated");
  verb->add_option("--on-crash", a->on_crash,
                   "Where the command ends, or answers what is no cost: fail this trial, start the "
                   "command anew and go on (default), or stop. --resume keeps the run's choice")
      ->check(CLI::IsMember({"fail", "stop"}));
  verb->add_option("--out", a->out, "Run file; default: runs/minimise-seedN.run");
  verb->add_flag("--resume", a->resume, "Go on with the run file if it is there");
  verb->add_flag("--quiet", a->quiet, "Print nothing but errors");
  verb->add_flag("--json", a->json, "Print one JSON object at the end");
  verb->footer(
      optimisersHelp() +
      "Examples:\n"
      "  traceur minimise --var x=-2:2 --var y=-2:2 --constraint outside -- "
      "python3 examples/disc.py\n"
      "  traceur minimise --var gain=0:10:1 --var delay=0:0.1 --constraint fell -- ./simulate.py\n"
      "Exit code: 0 done, 1 failed, 2 wrong use, 130 stopped by Ctrl-C.");
  verb->callback([a, &exit_code] { exit_code = minimise(*a); });
}

}  // namespace traceur::cli
