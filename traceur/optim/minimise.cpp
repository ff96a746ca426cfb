#include "traceur/optim/minimise.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "traceur/core/error.h"
#include "traceur/optim/cost.h"

namespace traceur::optim {
namespace {

/// More threads than any machine has: a slip of the keyboard, not a wish.
constexpr int kMaxThreads = 4096;

void check(const MinimiseOptions& options) {
  if (options.budget < 1) {
    throw InputError(fmt::format("minimise: expected budget ≥ 1, got {}", options.budget));
  }
  if (options.threads < 0 || options.threads > kMaxThreads) {
    throw InputError(
        fmt::format("minimise: expected threads in [0, {}], got {}", kMaxThreads, options.threads));
  }
  if (std::isnan(options.target)) throw InputError("minimise: target is NaN");
}

void check(const Candidate& candidate, const VectorXd& lower, const VectorXd& upper) {
  if (candidate.x.size() != lower.size()) {
    throw InputError(fmt::format("minimise: the problem has {} variables, the optimiser {}",
                                 lower.size(), candidate.x.size()));
  }
  for (int i = 0; i < candidate.x.size(); ++i) {
    if (!(lower[i] <= candidate.x[i] && candidate.x[i] <= upper[i])) {
      throw InputError(fmt::format(
          "minimise: candidate {} has x[{}] = {}, outside the problem's bounds [{}, {}]; the "
          "optimiser was built with others",
          candidate.id, i, candidate.x[i], lower[i], upper[i]));
    }
  }
}

void check(const Evaluation& evaluation, size_t constraints, size_t tasks) {
  const size_t got = evaluation.violated.size();
  if (got != 0 && got != constraints) {
    throw InputError(fmt::format("minimise: the problem has {} constraints, a trial reports {}",
                                 constraints, got));
  }
  if (evaluation.meaningful() && evaluation.task_costs.size() != tasks) {
    throw InputError(fmt::format("minimise: the problem has {} tasks, a trial reports costs of {}",
                                 tasks, evaluation.task_costs.size()));
  }
}

/// The cost to hold against the target: the optimiser's own, or that of the best feasible trial.
std::optional<double> achieved(const Progress& progress, const Optimizer& optimizer) {
  if (std::optional<double> own = optimizer.achieved()) return own;
  if (progress.best && progress.best->evaluation.feasible()) return progress.best->evaluation.cost;
  return std::nullopt;
}

/// Why to end before another generation, if at all.
std::optional<std::pair<End, Stop>> ending(const Progress& progress, const Optimizer& optimizer,
                                           const MinimiseOptions& options) {
  const double used = progress.evaluations;
  const double budget = options.budget;
  if (const auto cost = achieved(progress, optimizer); cost && *cost <= options.target) {
    return {{End::kTarget, {"target", *cost, options.target}}};
  }
  if (options.stop.stop_requested()) {
    return {{End::kInterrupted, {"interrupted", used, budget}}};
  }
  if (std::optional<Stop> stop = optimizer.stopped()) return {{End::kOptimizer, std::move(*stop)}};
  if (progress.evaluations >= options.budget) return {{End::kBudget, {"budget", used, budget}}};
  return std::nullopt;
}

/// What broke down of a run's first trials.
class Beginning {
 public:
  /// May be called from several threads, once for each trial.
  void add(int number, const Broken& trial) {
    if (number >= kFirstTrials) return;
    if (number == 0) first_ = trial.what();
    ++broken_;
  }
  bool hopeless() const { return broken_ == kFirstTrials; }
  [[noreturn]] void fail() const {
    throw InputError(
        fmt::format("{}\n  none of the first {} trials could be run", first_, kFirstTrials));
  }

 private:
  std::string first_;
  std::atomic<int> broken_ = 0;
};

/// A problem that draws, in one of its rounds.
class Round : public Problem {
 public:
  Round(const Problem& all, int round) : all_(&all), round_(round) {}
  VectorXd lower() const override { return all_->lower(); }
  VectorXd upper() const override { return all_->upper(); }
  std::vector<std::string> constraints() const override { return all_->constraints(); }
  VectorXd tasks() const override { return all_->tasks(); }
  Evaluation evaluate(const VectorXd& x) const override { return all_->evaluateIn(round_, x); }

 private:
  const Problem* all_;
  int round_;
};

}  // namespace

Summary minimise(const Problem& problem, Optimizer& optimizer, const MinimiseOptions& options,
                 const Progress& start) {
  check(options);
  const VectorXd lower = problem.lower();
  const VectorXd upper = problem.upper();
  checkBounds("minimise", lower, upper, static_cast<int>(lower.size()));
  const size_t constraints = problem.constraints().size();
  const size_t tasks = problem.tasks().size();

  std::optional<ThreadEvaluator> threads;
  Evaluator& evaluator = options.evaluator ? *options.evaluator : threads.emplace(options.threads);
  Progress progress = start;
  std::vector<Trial> trials;
  Beginning beginning;
  while (true) {
    if (auto end = ending(progress, optimizer, options)) {
      return {std::move(progress), end->first, std::move(end->second)};
    }
    const std::vector<Candidate> candidates = optimizer.ask();
    if (candidates.empty()) {
      return {std::move(progress), End::kOptimizer, {"no candidates", 0, 1}};
    }
    for (const Candidate& c : candidates) check(c, lower, upper);

    trials.resize(candidates.size());
    std::atomic<int> run = 0;
    const Round round(problem, 1 + progress.generation / kRoundGenerations);
    const Problem& now = problem.draws() ? round : problem;
    evaluator.evaluate(now, candidates, [&](int i, const Evaluator::Result& result) {
      if (options.stop.stop_requested() || beginning.hopeless()) return;
      Trial& trial = trials[i];
      trial.x = candidates[i].x;
      try {
        trial.evaluation = result();
      } catch (const Abandoned&) {
        if (options.stop.stop_requested()) return;
        throw;  // nobody asked it to
      } catch (const Broken& broken) {
        if (!options.on_broken) throw;
        options.on_broken(broken);
        beginning.add(progress.evaluations + i, broken);
        trial.evaluation = {.failed = true};
      }
      check(trial.evaluation, constraints, tasks);
      Evaluation& e = trial.evaluation;
      if (!e.meaningful()) {
        // Of several tasks, what it says of one may still count.
        e.failed = e.failed || std::none_of(e.task_costs.begin(), e.task_costs.end(), isCost);
        e.cost = std::numeric_limits<double>::infinity();
      }
      ++run;
    });
    if (beginning.hopeless()) beginning.fail();
    if (run < static_cast<int>(candidates.size())) continue;  // asked to end: drop what is there

    for (size_t i = 0; i < trials.size(); ++i) {
      const Trial& trial = trials[i];
      if (trial.evaluation.failed) {
        ++progress.failed;
      } else if (!problem.draws() && trial.evaluation.meaningful() &&
                 (!progress.best || better(trial.evaluation, progress.best->evaluation))) {
        progress.best = trial;
      }
      optimizer.tell(candidates[i].id, trial.evaluation);
    }
    progress.evaluations += static_cast<int>(trials.size());
    ++progress.generation;
    if (problem.draws() && progress.generation % kRoundGenerations == 1) {
      const auto least = std::min_element(
          trials.begin(), trials.end(),
          [](const Trial& a, const Trial& b) { return better(a.evaluation, b.evaluation); });
      const Candidate favourite{0, optimizer.favourite().value_or(least->x)};
      evaluator.evaluate(problem, {&favourite, 1}, [&](int, const Evaluator::Result& result) {
        Trial trial{favourite.x, result()};
        if (!trial.evaluation.meaningful()) return;
        // Not by better(): where failing is a share of the falls, its cost says what it is worth.
        if (progress.best && trial.evaluation.cost >= progress.best->evaluation.cost) return;
        progress.best = std::move(trial);
      });
    }
    if (options.on_generation) options.on_generation({progress, trials, optimizer});
  }
}

}  // namespace traceur::optim
