#include "traceur/optim/minimise.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <mutex>
#include <thread>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

CmaEs sphereSearch(std::uint64_t seed = 1) {
  return CmaEs({.x0 = VectorXd::Constant(4, 1.5), .sigma = 0.5, .seed = seed});
}
const FunctionProblem kSphere(4, sphere);

/// A problem whose evaluate is whatever a test wants.
class Scripted : public Problem {
 public:
  using Script = std::function<Evaluation(const VectorXd&)>;
  explicit Scripted(Script script, std::vector<std::string> constraints = {})
      : script_(std::move(script)), constraints_(std::move(constraints)) {}
  VectorXd lower() const override { return VectorXd::Constant(4, -kInf); }
  VectorXd upper() const override { return VectorXd::Constant(4, kInf); }
  std::vector<std::string> constraints() const override { return constraints_; }
  Evaluation evaluate(const VectorXd& x) const override { return script_(x); }

 private:
  Script script_;
  std::vector<std::string> constraints_;
};

TEST(Minimise, ReachesTheTargetAndSaysSo) {
  CmaEs cma = sphereSearch();
  const Summary s = minimise(kSphere, cma, {.target = 1e-8});
  EXPECT_EQ(s.end, End::kTarget);
  EXPECT_EQ(s.stop.reason, "target");
  EXPECT_EQ(s.stop.value, s.progress.best->evaluation.cost);
  EXPECT_EQ(s.stop.limit, 1e-8);
  EXPECT_LE(s.progress.best->evaluation.cost, 1e-8);
  EXPECT_EQ(s.progress.best->evaluation.cost, sphere(s.progress.best->x));
  EXPECT_EQ(s.progress.evaluations, s.progress.generation * cma.constants().lambda);
}

/// A sphere about a point that every round moves.
class Drawing : public Problem {
 public:
  VectorXd lower() const override { return VectorXd::Constant(3, -5); }
  VectorXd upper() const override { return VectorXd::Constant(3, 5); }
  bool draws() const override { return true; }
  Evaluation evaluate(const VectorXd& x) const override { return evaluateIn(0, x); }
  Evaluation evaluateIn(int round, const VectorXd& x) const override {
    const double shift = round == 0 ? 0 : 0.5 * (Random(1, round).uniform() - 0.5);
    return {.cost = (x.array() - 1 - shift).matrix().squaredNorm()};
  }
};

TEST(Minimise, OfAProblemThatDrawsKeepsTheBestFavouriteOfOneRound) {
  const Drawing problem;
  const auto run = [&](int threads) {
    CmaEs cma({.x0 = VectorXd::Zero(3), .sigma = 1});
    return minimise(problem, cma, {.threads = threads, .budget = 600});
  };
  const Summary s = run(1);
  ASSERT_TRUE(s.progress.best);
  // All in the round 0: the cost is that of its own point.
  EXPECT_EQ(s.progress.best->evaluation.cost, problem.evaluate(s.progress.best->x).cost);
  EXPECT_LT(s.progress.best->evaluation.cost, 0.1);
  const Summary other = run(2);
  EXPECT_EQ(other.progress.best->x, s.progress.best->x);
}

TEST(Minimise, FinishesTheGenerationThatUsesUpTheBudget) {
  for (const int budget : {1, 8, 9, 20}) {
    CmaEs cma = sphereSearch();  // λ = 8
    const Summary s = minimise(kSphere, cma, {.budget = budget});
    EXPECT_EQ(s.end, End::kBudget);
    EXPECT_EQ(s.progress.evaluations, (budget + 7) / 8 * 8);
    EXPECT_EQ(s.stop.reason, "budget");
    EXPECT_EQ(s.stop.value, s.progress.evaluations);
    EXPECT_EQ(s.stop.limit, budget);
  }
}

TEST(Minimise, PassesOnTheOptimisersOwnReason) {
  CmaEs cma = sphereSearch();
  const Summary s = minimise(kSphere, cma, {.budget = 1000000});
  EXPECT_EQ(s.end, End::kOptimizer);
  EXPECT_EQ(s.stop.reason, cma.stopped()->reason);
  EXPECT_LT(s.stop.value, s.stop.limit);
}

TEST(Minimise, GivesEqualBitsForAnyNumberOfThreads) {
  // Trials that last unequally long, so that the threads interleave differently every time.
  const Scripted uneven(
      [](const VectorXd& x) {
        volatile double sink = 0;
        const int rounds = static_cast<int>(std::abs(x[0]) * 1000) % 5000;
        for (int i = 0; i < rounds; ++i) sink = sink + 1;
        if (x[1] > 1.4) return Evaluation{.cost = NAN};
        return Evaluation{.cost = rosenbrock(x), .violated = {x[2] < -0.5}};
      },
      {"c"});
  std::string states[4];
  double costs[4];
  for (int threads = 1; threads <= 4; ++threads) {
    CmaEs cma = sphereSearch(9);
    const Summary s = minimise(uneven, cma, {.threads = threads, .budget = 1200});
    states[threads - 1] = cma.save();
    costs[threads - 1] = s.progress.best->evaluation.cost;
    EXPECT_GT(s.progress.failed, 0);
  }
  for (int i = 1; i < 4; ++i) {
    EXPECT_EQ(states[i], states[0]);
    EXPECT_EQ(costs[i], costs[0]);
  }
}

/// Each trial in a process of its own, the last one first, all before the first is taken: what an
/// evaluator may do.
class InProcesses : public Evaluator {
 public:
  void evaluate(const Problem& problem, std::span<const Candidate> candidates,
                const Take& take) override {
    std::vector<Evaluation> said(candidates.size());
    for (size_t i = candidates.size(); i-- > 0;) {
      int ends[2];
      ASSERT_EQ(pipe(ends), 0);
      const pid_t child = fork();
      if (child == 0) {
        const Evaluation e = problem.evaluate(candidates[i].x);
        const double words[] = {e.cost, e.failed ? 1.0 : 0.0, e.violated[0] ? 1.0 : 0.0};
        _exit(write(ends[1], words, sizeof words) == sizeof words ? 0 : 1);
      }
      double words[3] = {};
      close(ends[1]);
      ASSERT_EQ(read(ends[0], words, sizeof words), static_cast<ssize_t>(sizeof words));
      close(ends[0]);
      ASSERT_EQ(waitpid(child, nullptr, 0), child);
      said[i] = {.cost = words[0], .violated = {words[2] != 0}, .failed = words[1] != 0};
    }
    for (size_t i = candidates.size(); i-- > 0;) {
      take(static_cast<int>(i), [&] { return said[i]; });
    }
  }
};

TEST(Minimise, GivesEqualBitsWhoeverRunsTheTrials) {
  std::atomic<int> here = 0;
  const Scripted problem(
      [&](const VectorXd& x) {
        ++here;
        if (x[1] > 1.4) return Evaluation{.cost = NAN, .violated = {false}};
        return Evaluation{.cost = rosenbrock(x), .violated = {x[2] < -0.5}};
      },
      {"c"});
  CmaEs threads = sphereSearch(9);
  const Summary expected = minimise(problem, threads, {.threads = 2, .budget = 160});
  EXPECT_EQ(here.exchange(0), 160);
  CmaEs processes = sphereSearch(9);
  InProcesses evaluator;
  const Summary got = minimise(problem, processes, {.evaluator = &evaluator, .budget = 160});
  EXPECT_EQ(here, 0);
  EXPECT_EQ(processes.save(), threads.save());
  EXPECT_EQ(got.progress.best->x, expected.progress.best->x);
  EXPECT_EQ(got.progress.failed, expected.progress.failed);
  EXPECT_GT(got.progress.failed, 0);
}

TEST(Minimise, PassesOnWhatAnEvaluatorsTrialThrows) {
  class Throws : public Evaluator {
   public:
    void evaluate(const Problem& /*problem*/, std::span<const Candidate> candidates,
                  const Take& take) override {
      for (size_t i = 0; i < candidates.size(); ++i) {
        take(static_cast<int>(i), [&]() -> Evaluation { throw Broken("elsewhere"); });
      }
    }
  };
  Throws evaluator;
  CmaEs cma = sphereSearch();
  EXPECT_THROW(minimise(kSphere, cma, {.evaluator = &evaluator}), Broken);
  int broken = 0;
  const auto count = [&](const Broken&) { ++broken; };
  EXPECT_THROW(minimise(kSphere, cma, {.evaluator = &evaluator, .on_broken = count}), InputError);
  EXPECT_EQ(broken, kFirstTrials);
}

TEST(Minimise, UsesTheThreadsItIsGiven) {
  std::mutex mutex;
  std::vector<std::thread::id> seen;
  const Scripted slow([&](const VectorXd& x) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    const std::lock_guard lock(mutex);
    if (std::find(seen.begin(), seen.end(), std::this_thread::get_id()) == seen.end()) {
      seen.push_back(std::this_thread::get_id());
    }
    return Evaluation{.cost = sphere(x)};
  });
  CmaEs cma = sphereSearch();
  minimise(slow, cma, {.threads = 3, .budget = 24});
  EXPECT_EQ(seen.size(), 3);
}

TEST(Minimise, CountsTrialsWithoutAMeaningfulCostAndNeverCallsOneBest) {
  const Scripted half([](const VectorXd& x) {
    if (x[0] > 1.5) return Evaluation{.cost = NAN};
    if (x[0] > 1.3) return Evaluation{};
    if (x[0] > 1.2) return Evaluation{.cost = -1e9, .failed = true};
    return Evaluation{.cost = sphere(x)};
  });
  CmaEs cma = sphereSearch();
  int failed = 0;
  const Summary s = minimise(half, cma, {.budget = 80, .on_generation = [&](const Generation& g) {
                                           for (const Trial& t : g.trials) {
                                             failed += t.evaluation.failed;
                                             EXPECT_EQ(t.evaluation.failed, t.x[0] > 1.2);
                                             EXPECT_FALSE(std::isnan(t.evaluation.cost));
                                           }
                                           EXPECT_EQ(g.progress.failed, failed);
                                         }});
  EXPECT_GT(failed, 0);
  EXPECT_EQ(s.progress.failed, failed);
  EXPECT_LE(s.progress.best->x[0], 1.2);

  CmaEs hopeless = sphereSearch();
  const Scripted all([](const VectorXd&) { return Evaluation{.failed = true}; });
  const Summary none = minimise(all, hopeless, {});
  EXPECT_FALSE(none.progress.best.has_value());
  EXPECT_EQ(none.progress.failed, none.progress.evaluations);
  EXPECT_EQ(none.end, End::kOptimizer);
  EXPECT_EQ(none.stop.reason, "tolallfailed");
}

TEST(Minimise, BestIsFeasibleFirstAndTheTargetAsksForFeasibility) {
  // The first trials are cheap enough but on the wrong side of the wall; beyond it the far side is
  // dearer than where they began.
  const Scripted wall(
      [](const VectorXd& x) {
        const double cost = x[0] < 1 ? 1 - x[0] : 2 + sphere(x - VectorXd::Unit(4, 0) * 2);
        return Evaluation{.cost = cost, .violated = {x[0] < 1}};
      },
      {"wall"});
  CmaEs cma({.x0 = VectorXd::Unit(4, 0) * 0.5, .sigma = 0.05});
  int infeasible_generations = 0;
  const Summary s = minimise(wall, cma, {.target = 2.5, .on_generation = [&](const Generation& g) {
                                           infeasible_generations +=
                                               !g.progress.best->evaluation.feasible();
                                         }});
  EXPECT_GT(infeasible_generations, 2);
  EXPECT_EQ(s.end, End::kTarget);
  EXPECT_TRUE(s.progress.best->evaluation.feasible());
  EXPECT_GE(s.progress.best->x[0], 1);
  EXPECT_GE(s.progress.best->evaluation.cost, 2);
}

TEST(Minimise, ReportsEachToldGenerationOnceInOrder) {
  CmaEs cma = sphereSearch();
  int calls = 0;
  const Summary s = minimise(
      kSphere, cma, {.budget = 80, .on_generation = [&](const Generation& g) {
                       EXPECT_EQ(g.progress.generation, ++calls);
                       EXPECT_EQ(g.progress.evaluations, 8 * calls);
                       ASSERT_EQ(g.trials.size(), 8);
                       CmaEs copy = sphereSearch();
                       copy.restore(g.optimizer.save());
                       EXPECT_EQ(copy.state().generation, static_cast<std::uint64_t>(calls));
                     }});
  EXPECT_EQ(calls, 10);
  EXPECT_EQ(s.progress.generation, 10);
}

TEST(Minimise, ResumesToTheSameBits) {
  CmaEs whole = sphereSearch();
  const Summary uninterrupted = minimise(kSphere, whole, {.budget = 400});

  CmaEs first = sphereSearch();
  const Summary part = minimise(kSphere, first, {.budget = 160});
  CmaEs second = sphereSearch();
  second.restore(first.save());
  const Summary rest = minimise(kSphere, second, {.budget = 400}, part.progress);
  EXPECT_EQ(second.save(), whole.save());
  EXPECT_EQ(rest.progress.evaluations, uninterrupted.progress.evaluations);
  EXPECT_EQ(rest.progress.generation, uninterrupted.progress.generation);
  EXPECT_EQ(rest.progress.best->x, uninterrupted.progress.best->x);
}

TEST(Minimise, ResumedInTheMiddleOfAGenerationRunsOnlyWhatIsLeft) {
  CmaEs whole = sphereSearch();
  minimise(kSphere, whole, {.budget = 80});

  CmaEs cma = sphereSearch();
  const Summary part = minimise(kSphere, cma, {.budget = 40});
  const std::vector<Candidate> open = cma.ask();
  for (const int k : {6, 1, 3}) cma.tell(open[k].id, kSphere.evaluate(open[k].x));
  Progress progress = part.progress;
  progress.evaluations += 3;
  size_t first_size = 0;
  const Summary s = minimise(kSphere, cma,
                             {.budget = 80,
                              .on_generation =
                                  [&](const Generation& g) {
                                    if (first_size == 0) first_size = g.trials.size();
                                  }},
                             progress);
  EXPECT_EQ(first_size, 5);
  EXPECT_EQ(s.progress.evaluations, 80);
  EXPECT_EQ(cma.save(), whole.save());
}

TEST(Minimise, DropsTheUnfinishedGenerationWhenAskedToEnd) {
  CmaEs reference = sphereSearch();
  const Summary three = minimise(kSphere, reference, {.budget = 24});  // generations of 8

  std::stop_source stop;
  std::atomic<int> trials = 0;
  const Scripted interrupted([&](const VectorXd& x) {
    if (++trials == 28) stop.request_stop();  // in the middle of the fourth
    return Evaluation{.cost = sphere(x)};
  });
  CmaEs cma = sphereSearch();
  const Summary s = minimise(interrupted, cma, {.stop = stop.get_token()});
  EXPECT_EQ(s.end, End::kInterrupted);
  EXPECT_EQ(s.stop.reason, "interrupted");
  EXPECT_EQ(s.stop.value, 24);
  EXPECT_EQ(s.progress.evaluations, 24);
  EXPECT_EQ(s.progress.generation, 3);
  EXPECT_EQ(trials, 28);  // the rest of the generation was not started
  EXPECT_EQ(cma.save(), reference.save());

  // Carried on from there, as if nothing had happened.
  minimise(kSphere, reference, {.budget = 80}, three.progress);
  minimise(kSphere, cma, {.budget = 80}, s.progress);
  EXPECT_EQ(cma.save(), reference.save());
}

TEST(Minimise, EndsAtOnceWhenAskedBeforeItBegins) {
  std::stop_source stop;
  stop.request_stop();
  CmaEs cma = sphereSearch();
  const Summary s = minimise(kSphere, cma, {.stop = stop.get_token()});
  EXPECT_EQ(s.end, End::kInterrupted);
  EXPECT_EQ(s.progress.evaluations, 0);
}

TEST(Minimise, StopsBetweenGenerationsWhenTheCallbackAsks) {
  std::stop_source stop;
  CmaEs cma = sphereSearch();
  const Summary s =
      minimise(kSphere, cma, {.stop = stop.get_token(), .on_generation = [&](const Generation& g) {
                                if (g.progress.generation == 2) stop.request_stop();
                              }});
  EXPECT_EQ(s.end, End::kInterrupted);
  EXPECT_EQ(s.progress.generation, 2);
}

TEST(Minimise, LetsExceptionsThroughAndLeavesTheGenerationUntold) {
  for (const int threads : {1, 2}) {
    std::atomic<int> trials = 0;
    const Scripted breaks([&](const VectorXd& x) {
      if (++trials == 12) throw SystemError("the robot is on fire");
      return Evaluation{.cost = sphere(x)};
    });
    CmaEs cma = sphereSearch();
    EXPECT_THROW(minimise(breaks, cma, {.threads = threads}), SystemError);
    EXPECT_EQ(cma.state().generation, 1);
    EXPECT_EQ(cma.ask().size(), 8);
  }
}

TEST(Minimise, ATrialThatBreaksDownIsAFailedOneOrTheEnd) {
  const Scripted fragile([](const VectorXd& x) {
    if (x[0] > 1.5) throw Broken("boom");
    return Evaluation{.cost = sphere(x)};
  });
  const Scripted failing([](const VectorXd& x) {
    return x[0] > 1.5 ? Evaluation{.failed = true} : Evaluation{.cost = sphere(x)};
  });
  CmaEs honest = sphereSearch();
  const Summary expected = minimise(failing, honest, {.budget = 80});
  for (const int threads : {1, 3}) {
    CmaEs cma = sphereSearch();
    std::atomic<int> told = 0;
    const Summary s =
        minimise(fragile, cma,
                 {.threads = threads, .budget = 80, .on_broken = [&](const Broken&) { ++told; }});
    EXPECT_EQ(cma.save(), honest.save());
    EXPECT_EQ(s.progress.failed, expected.progress.failed);
    EXPECT_EQ(told, s.progress.failed);
    EXPECT_GT(told, 0);
  }
  CmaEs cma = sphereSearch();
  EXPECT_THROW(minimise(fragile, cma, {.budget = 80}), Broken);
}

TEST(Minimise, EndsWhenAllOfTheFirstTrialsBreakDown) {
  for (const int threads : {1, 4}) {
    std::mutex mutex;
    std::vector<double> asked;
    const Scripted never([&](const VectorXd& x) -> Evaluation {
      const std::scoped_lock lock(mutex);
      asked.push_back(x[0]);
      throw Broken("no such file");
    });
    CmaEs cma = sphereSearch();
    try {
      minimise(never, cma, {.threads = threads, .on_broken = [](const Broken&) {}});
      FAIL() << "it went on";
    } catch (const InputError& e) {
      EXPECT_STREQ(e.what(), "no such file\n  none of the first 10 trials could be run");
    }
    EXPECT_LE(asked.size(), threads == 1 ? 10U : 16U);  // λ = 8
  }
  // One of them could: the others are to be failed ones.
  std::atomic<int> trials = 0;
  const Scripted once([&](const VectorXd& x) {
    if (++trials != 10) throw Broken("boom");
    return Evaluation{.cost = sphere(x)};
  });
  CmaEs cma = sphereSearch();
  const Summary s = minimise(once, cma, {.budget = 32, .on_broken = [](const Broken&) {}});
  EXPECT_EQ(s.progress.failed, 31);
}

TEST(Minimise, AnAbandonedTrialDropsItsGeneration) {
  std::stop_source stop;
  std::atomic<int> trials = 0;
  const Scripted hangs([&](const VectorXd& x) {
    if (++trials == 12) {
      stop.request_stop();
      throw Abandoned("asked to stop");
    }
    return Evaluation{.cost = sphere(x)};
  });
  CmaEs reference = sphereSearch();
  minimise(kSphere, reference, {.budget = 8});
  CmaEs cma = sphereSearch();
  const Summary s = minimise(hangs, cma, {.stop = stop.get_token()});
  EXPECT_EQ(s.end, End::kInterrupted);
  EXPECT_EQ(s.progress.evaluations, 8);
  EXPECT_EQ(cma.save(), reference.save());
  const Scripted unasked([](const VectorXd&) -> Evaluation { throw Abandoned("why?"); });
  EXPECT_THROW(minimise(unasked, cma, {}), Abandoned);
}

TEST(Minimise, RefusesWrongInputWithOneClearMessage) {
  const auto message = [](const Problem& problem, Optimizer& optimizer,
                          const MinimiseOptions& options) {
    try {
      minimise(problem, optimizer, options);
      return std::string("nothing");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
  };
  CmaEs cma = sphereSearch();
  EXPECT_EQ(message(kSphere, cma, {.budget = 0}), "minimise: expected budget ≥ 1, got 0");
  EXPECT_EQ(message(kSphere, cma, {.threads = -1}),
            "minimise: expected threads in [0, 4096], got -1");
  EXPECT_EQ(message(kSphere, cma, {.target = NAN}), "minimise: target is NaN");
  const FunctionProblem reversed(VectorXd::Ones(4), VectorXd::Zero(4), sphere);
  EXPECT_EQ(message(reversed, cma, {}), "minimise: expected lower[0] < upper[0], got 1 and 0");
  const FunctionProblem other(3, sphere);
  EXPECT_EQ(message(other, cma, {}), "minimise: the problem has 3 variables, the optimiser 4");
  const FunctionProblem boxed(VectorXd::Constant(4, 50), VectorXd::Constant(4, 60), sphere);
  EXPECT_NE(message(boxed, cma, {}).find("outside the problem's bounds [50, 60]"),
            std::string::npos);
  const Scripted two(
      [](const VectorXd& x) {
        return Evaluation{.cost = sphere(x), .violated = {true, false}};
      },
      {"only one"});
  EXPECT_EQ(message(two, cma, {}), "minimise: the problem has 1 constraints, a trial reports 2");
  EXPECT_EQ(cma.state().generation, 0);
}

TEST(Minimise, AnInfinitelyGoodTrialHasFailed) {
  const Scripted log(
      [](const VectorXd& x) { return Evaluation{.cost = x[0] > 1 ? -kInf : sphere(x)}; });
  CmaEs cma = sphereSearch();
  std::vector<Trial> infinite;
  const auto keep = [&](const Generation& g) {
    for (const Trial& t : g.trials) {
      if (t.x[0] > 1) infinite.push_back(t);
    }
  };
  const Summary s = minimise(log, cma, {.budget = 60, .on_generation = keep});
  EXPECT_EQ(s.end, End::kBudget);
  ASSERT_FALSE(infinite.empty());
  EXPECT_EQ(s.progress.failed, static_cast<int>(infinite.size()));
  for (const Trial& t : infinite) EXPECT_EQ(t.evaluation.cost, kInf);
  ASSERT_TRUE(s.progress.best);
  EXPECT_LE(s.progress.best->x[0], 1);
}

/// Hands out what a test has written down, and remembers what it is told.
class Listed : public Optimizer {
 public:
  explicit Listed(std::vector<std::vector<Candidate>> generations)
      : generations_(std::move(generations)) {}
  std::vector<Candidate> ask() override {
    return at_ < generations_.size() ? generations_[at_] : std::vector<Candidate>();
  }
  void tell(std::uint64_t id, const Evaluation& evaluation) override {
    ids.push_back(id);
    told.push_back(evaluation);
    if (ids.size() % generations_[at_].size() == 0) ++at_;
  }
  std::optional<Stop> stopped() const override { return stop; }
  std::string save() const override { return {}; }
  void restore(std::string_view) override {}

  std::vector<std::uint64_t> ids;
  std::vector<Evaluation> told;
  std::optional<Stop> stop;

 private:
  std::vector<std::vector<Candidate>> generations_;
  size_t at_ = 0;
};

/// Of one variable in [0, 2] and two tasks: what a test says of each x.
class TwoTasks : public Problem {
 public:
  explicit TwoTasks(std::function<Evaluation(double)> says) : says_(std::move(says)) {}
  VectorXd lower() const override { return VectorXd::Zero(1); }
  VectorXd upper() const override { return VectorXd::Constant(1, 2); }
  VectorXd tasks() const override { return Eigen::Vector2d(0, 1); }
  std::vector<std::string> constraints() const override { return {"wall"}; }
  Evaluation evaluate(const VectorXd& x) const override { return says_(x[0]); }

 private:
  std::function<Evaluation(double)> says_;
};

std::vector<Candidate> at(std::initializer_list<double> places) {
  std::vector<Candidate> candidates;
  for (const double x : places) {
    candidates.push_back({7 + candidates.size(), VectorXd::Constant(1, x)});
  }
  return candidates;
}

TEST(Minimise, ATrialThatSaysSomethingOfOneTaskHasNotFailed) {
  const TwoTasks problem([](double x) -> Evaluation {
    if (x == 0) return {.cost = NAN, .task_costs = {-kInf, 3}};
    if (x == 0.25) return {.cost = NAN, .task_costs = {NAN, kInf}};
    if (x == 0.5) return {.cost = NAN};
    if (x == 0.75) return {.cost = 1, .failed = true, .task_costs = {1, 1}};
    return {.cost = 5, .violated = {x > 1.5}, .task_costs = {5, 5}};
  });
  Listed optimizer({at({0, 0.25, 0.5, 0.75, 1, 1.25, 2})});
  const Summary s = minimise(problem, optimizer, {});
  EXPECT_EQ(optimizer.ids, (std::vector<std::uint64_t>{7, 8, 9, 10, 11, 12, 13}));
  for (int k = 0; k < 7; ++k) {
    EXPECT_EQ(optimizer.told[k].failed, k > 0 && k < 4) << k;
    EXPECT_EQ(optimizer.told[k].cost, k < 4 ? kInf : 5) << k;
  }
  EXPECT_EQ(optimizer.told[0].task_costs[1], 3);
  EXPECT_EQ(s.progress.failed, 3);
  EXPECT_EQ(s.progress.evaluations, 7);
  EXPECT_EQ(s.progress.generation, 1);
  ASSERT_TRUE(s.progress.best);
  EXPECT_EQ(s.progress.best->x[0], 1);  // the first of equals
  EXPECT_EQ(s.end, End::kOptimizer);
  EXPECT_EQ(s.stop.reason, "no candidates");
  EXPECT_EQ(s.stop.value, 0);
  EXPECT_EQ(s.stop.limit, 1);
}

TEST(Minimise, OfSeveralReasonsToEndSaysTheFirst) {
  const TwoTasks problem([](double x) -> Evaluation { return {.cost = x, .task_costs = {x, x}}; });
  std::stop_source asked;
  asked.request_stop();
  const Trial best{VectorXd::Ones(1), {.cost = 1, .task_costs = {1, 1}}};
  const Progress used{.generation = 1, .evaluations = 9, .failed = 0, .best = best};
  const auto end = [&](double target, bool stop, bool over, int budget) {
    Listed optimizer({at({1, 2})});
    if (over) optimizer.stop = Stop{"tolx", 3, 4};
    return minimise(
        problem, optimizer,
        {.budget = budget, .target = target, .stop = stop ? asked.get_token() : std::stop_token{}},
        used);
  };
  EXPECT_EQ(end(1, true, true, 9).end, End::kTarget);  // the target itself is enough
  EXPECT_EQ(end(0.99, true, true, 9).end, End::kInterrupted);
  const Summary own = end(0.99, false, true, 9);
  EXPECT_EQ(own.end, End::kOptimizer);
  EXPECT_EQ(own.stop.value, 3);
  EXPECT_EQ(own.stop.limit, 4);
  EXPECT_EQ(end(0.99, false, false, 9).end, End::kBudget);
  EXPECT_EQ(end(0.99, false, false, 9).progress.evaluations, 9);
  EXPECT_EQ(end(0.99, false, false, 10).progress.evaluations, 11);
}

TEST(Minimise, SaysWhatDoesNotFitTheProblem) {
  const auto message = [](const Evaluation& e, double x) -> std::string {
    const TwoTasks problem([&](double) { return e; });
    Listed optimizer({at({1, x})});
    try {
      minimise(problem, optimizer, {});
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  const Evaluation good{.cost = 1, .task_costs = {1, 1}};
  EXPECT_EQ(message(good, 0), "");
  EXPECT_EQ(message(good, 2), "");
  const char* bounds = ", outside the problem's bounds [0, 2]; the optimiser was built with others";
  EXPECT_EQ(message(good, 2.5), std::string("minimise: candidate 8 has x[0] = 2.5") + bounds);
  EXPECT_EQ(message(good, -0.5), std::string("minimise: candidate 8 has x[0] = -0.5") + bounds);
  EXPECT_EQ(message({.cost = 1, .task_costs = {1}}, 0),
            "minimise: the problem has 2 tasks, a trial reports costs of 1");
  EXPECT_EQ(message({.cost = NAN, .task_costs = {1}}, 0), "");  // it says nothing
  EXPECT_EQ(message({.cost = 1, .violated = {true}, .task_costs = {1, 1}}, 0), "");
  EXPECT_EQ(message({.cost = 1, .violated = {true, true}, .task_costs = {1, 1}}, 0),
            "minimise: the problem has 1 constraints, a trial reports 2");

  Listed none({});
  const TwoTasks problem([](double) -> Evaluation { return {.cost = 1, .task_costs = {1, 1}}; });
  EXPECT_THROW(minimise(problem, none, {.threads = 4097}), InputError);
  EXPECT_NO_THROW(minimise(problem, none, {.threads = 0}));
}

TEST(Minimise, ARunGoneOnWithMayMeetAsManyBrokenTrialsAsItWill) {
  const Scripted never([](const VectorXd&) -> Evaluation { throw Broken("boom"); });
  for (const int before : {0, 1, 10}) {
    CmaEs cma = sphereSearch();
    const auto run = [&] {
      return minimise(never, cma, {.budget = before + 24, .on_broken = [](const Broken&) {}},
                      {.generation = 1, .evaluations = before, .failed = 0, .best = {}});
    };
    if (before == 0) {
      EXPECT_THROW(run(), InputError);
    } else {
      EXPECT_EQ(run().progress.failed, 24) << before;
    }
  }
}

}  // namespace
}  // namespace traceur::optim
