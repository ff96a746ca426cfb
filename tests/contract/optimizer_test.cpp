// What every optimiser promises (traceur/optim/optimizer.h), checked for all that are registered.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "tests/contract/crafted_state.h"
#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/all.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/test_functions.h"

namespace traceur::optim {

/// How GoogleTest names a subject.
void PrintTo(const OptimizerEntry& entry,  // NOLINT(readability-identifier-naming)
             std::ostream* out) {
  *out << entry.name;
}

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

/// A problem whose trial is scored for three tasks: moved by the task along the first variable.
class WithTasks : public Problem {
 public:
  explicit WithTasks(const Problem& problem) : problem_(problem) {}
  VectorXd lower() const override { return problem_.lower(); }
  VectorXd upper() const override { return problem_.upper(); }
  VectorXd tasks() const override { return VectorXd::LinSpaced(3, 0, 0.2); }
  std::vector<std::string> constraints() const override { return problem_.constraints(); }
  Evaluation evaluate(const VectorXd& x) const override {
    Evaluation e = problem_.evaluate(x);
    e.cost = 0;
    for (const double task : tasks()) {
      const VectorXd moved = x - task * VectorXd::Unit(x.size(), 0);
      e.task_costs.push_back(problem_.evaluate(moved).cost);
      e.cost += e.task_costs.back() / 3;
    }
    return e;
  }

 private:
  const Problem& problem_;
};

/// A box with a constraint, a region where trials fail, and costs that tie now and then.
class Mixed : public Problem {
 public:
  VectorXd lower() const override { return VectorXd::Constant(4, -2); }
  VectorXd upper() const override { return VectorXd::Constant(4, 3); }
  std::vector<std::string> constraints() const override { return {"wall", "never"}; }
  Evaluation evaluate(const VectorXd& x) const override {
    if (x[1] > 2.2) return {.cost = NAN};
    return {.cost = std::max(rosenbrock(x), 0.01), .violated = {x[0] < -1, false}};
  }
};

FunctionProblem boxed(int n, FunctionProblem::Function f) {
  return {VectorXd::Constant(n, -2), VectorXd::Constant(n, 3), std::move(f)};
}

class OptimizerContract : public testing::TestWithParam<OptimizerEntry> {
 protected:
  std::unique_ptr<Optimizer> make(const Problem& problem, const CommonOptions& options = {}) const {
    return GetParam().make(problem, options);
  }

  /// The problem itself, or scored for tasks where the subject learns families.
  const Problem& suited(const Problem& problem) {
    if (!GetParam().learns_families) return problem;
    wrapped_.push_back(std::make_unique<WithTasks>(problem));
    return *wrapped_.back();
  }

  /// A trial of that cost, for every task if there are tasks.
  Evaluation costing(double cost) const {
    return {.cost = cost,
            .task_costs = std::vector<double>(GetParam().learns_families ? 3 : 0, cost)};
  }

  /// One generation, told in the order of ids.
  static void step(const Problem& problem, Optimizer& optimizer) {
    for (const Candidate& c : optimizer.ask()) optimizer.tell(c.id, problem.evaluate(c.x));
  }

 private:
  std::vector<std::unique_ptr<Problem>> wrapped_;
};

INSTANTIATE_TEST_SUITE_P(All, OptimizerContract, testing::ValuesIn(allOptimizers()),
                         [](const auto& entry) {
                           std::string name = entry.param.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(OptimizerContract, SolvesTheSphereAndRosenbrock) {
  for (const bool box : {true, false}) {
    const FunctionProblem plain_easy = box ? boxed(5, sphere) : FunctionProblem(5, sphere);
    const FunctionProblem plain_hard = box ? boxed(5, rosenbrock) : FunctionProblem(5, rosenbrock);
    const Problem& easy = suited(plain_easy);
    const Problem& hard = suited(plain_hard);
    int solved = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const auto a = make(easy, {.seed = seed, .x0 = VectorXd::Constant(5, 1.7)});
      const int share = GetParam().learns_families ? 6 : 1;  // a curve has more to find
      EXPECT_EQ(minimise(easy, *a, {.budget = 5000 * share, .target = 1e-8}).end, End::kTarget);
      const auto b = make(hard, {.seed = seed, .x0 = VectorXd::Constant(5, 0.3)});
      solved += minimise(hard, *b, {.budget = 30000 * share, .target = 1e-8}).end == End::kTarget;
    }
    EXPECT_GE(solved, 3);
  }
}

TEST_P(OptimizerContract, AskIsIdempotentAndInsideTheBounds) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem, {.sigma = 1});
  std::vector<std::uint64_t> seen;
  for (int g = 0; g < 30; ++g) {
    const std::vector<Candidate> first = optimizer->ask();
    const std::vector<Candidate> again = optimizer->ask();
    ASSERT_EQ(first.size(), again.size());
    ASSERT_FALSE(first.empty());
    for (size_t k = 0; k < first.size(); ++k) {
      EXPECT_EQ(first[k].id, again[k].id);
      EXPECT_EQ(first[k].x, again[k].x);
      EXPECT_TRUE((first[k].x.array() >= -2).all() && (first[k].x.array() <= 3).all());
      EXPECT_EQ(std::find(seen.begin(), seen.end(), first[k].id), seen.end()) << "id reused";
      seen.push_back(first[k].id);
    }
    step(problem, *optimizer);
  }
}

TEST_P(OptimizerContract, EqualSeedsGiveEqualRunsAndOthersOtherOnes) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto a = make(problem, {.seed = 5});
  const auto b = make(problem, {.seed = 5});
  const auto c = make(problem, {.seed = 6});
  for (int g = 0; g < 25; ++g) {
    step(problem, *a);
    step(problem, *b);
    step(problem, *c);
  }
  EXPECT_EQ(a->save(), b->save());
  EXPECT_NE(a->ask()[0].x, c->ask()[0].x);
}

TEST_P(OptimizerContract, OtherInstancesDoNotMatter) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto alone = make(problem);
  for (int g = 0; g < 25; ++g) step(problem, *alone);

  const auto a = make(problem);
  const auto b = make(problem, {.seed = 77, .lambda = 13});
  for (int g = 0; g < 25; ++g) {
    const std::vector<Candidate> mine = a->ask();
    step(problem, *b);
    for (const Candidate& c : mine) {
      a->tell(c.id, problem.evaluate(c.x));
      b->ask();
    }
    const auto passing = make(problem, {.seed = 3});
    step(problem, *passing);
  }
  EXPECT_EQ(a->save(), alone->save());
}

TEST_P(OptimizerContract, ThreadsDoNotMatter) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  std::string states[2];
  for (const int threads : {1, 2}) {
    const auto optimizer = make(problem);
    minimise(problem, *optimizer, {.threads = threads, .budget = 600});
    states[threads - 1] = optimizer->save();
  }
  EXPECT_EQ(states[0], states[1]);
}

TEST_P(OptimizerContract, TellsMayComeInAnyOrder) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto ordered = make(problem);
  const auto shuffled = make(problem);
  Random random(4);
  for (int g = 0; g < 25; ++g) {
    step(problem, *ordered);
    std::vector<Candidate> candidates = shuffled->ask();
    for (size_t i = candidates.size(); i > 1; --i) {
      std::swap(candidates[i - 1], candidates[random.below(i)]);
    }
    for (const Candidate& c : candidates) shuffled->tell(c.id, problem.evaluate(c.x));
  }
  EXPECT_EQ(shuffled->save(), ordered->save());
}

TEST_P(OptimizerContract, ResumesFromAnyPointToTheSameBits) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto whole = make(problem);
  for (int g = 0; g < 12; ++g) step(problem, *whole);

  // Saved and restored into a fresh instance after every single tell, in a scattered order.
  auto current = make(problem);
  for (int g = 0; g < 12; ++g) {
    std::vector<Candidate> left = current->ask();
    while (!left.empty()) {
      const Candidate c = left[left.size() * 2 / 3];
      current->tell(c.id, problem.evaluate(c.x));
      const std::string state = current->save();
      auto next = make(problem);
      next->restore(state);
      EXPECT_EQ(next->save(), state);
      current = std::move(next);
      if (left.size() == 1) break;
      left = current->ask();
    }
  }
  EXPECT_EQ(current->save(), whole->save());
}

TEST_P(OptimizerContract, RestoredStateIsToldWithoutBeingAsked) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto a = make(problem);
  for (int g = 0; g < 3; ++g) step(problem, *a);
  const std::vector<Candidate> open = a->ask();
  const auto b = make(problem);
  b->restore(a->save());
  for (const Candidate& c : open) {
    a->tell(c.id, problem.evaluate(c.x));
    b->tell(c.id, problem.evaluate(c.x));
  }
  EXPECT_EQ(a->save(), b->save());
}

TEST_P(OptimizerContract, RestoreReplacesWhateverWasThere) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto a = make(problem);
  for (int g = 0; g < 3; ++g) step(problem, *a);
  a->tell(a->ask().back().id, costing(3));
  // One that is elsewhere, has asked, and has been told some of it.
  const auto b = make(problem);
  for (int g = 0; g < 8; ++g) step(problem, *b);
  b->tell(b->ask()[0].id, costing(1));
  b->ask();
  b->restore(a->save());
  EXPECT_EQ(b->save(), a->save());
  const std::vector<Candidate> expected = a->ask();
  const std::vector<Candidate> found = b->ask();
  ASSERT_EQ(found.size(), expected.size());
  for (size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].id, expected[k].id);
    EXPECT_EQ(found[k].x, expected[k].x);
  }
}

TEST_P(OptimizerContract, RestoreRefusesForeignTextAndChangesNothing) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem);
  for (int g = 0; g < 3; ++g) step(problem, *optimizer);
  optimizer->tell(optimizer->ask().back().id, costing(3));
  const std::string own = optimizer->save();
  const FunctionProblem plain_wider = boxed(6, sphere);
  const Problem& wider = suited(plain_wider);
  for (const std::string& text :
       {std::string(), std::string("{}"), own.substr(0, own.size() - 1), own + '\0',
        make(wider)->save(), make(problem, {.seed = 1234})->save()}) {
    EXPECT_THROW(optimizer->restore(text), InputError);
    EXPECT_EQ(optimizer->save(), own);
  }
}

TEST_P(OptimizerContract, TellRefusesUnknownIdsAndChangesNothing) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem);
  const std::vector<Candidate> old = optimizer->ask();
  step(problem, *optimizer);
  const std::vector<Candidate> now = optimizer->ask();
  optimizer->tell(now[0].id, costing(1));
  const std::string before = optimizer->save();
  for (const std::uint64_t id : {old[0].id, now[0].id, now.back().id + 2, UINT64_MAX}) {
    EXPECT_THROW(optimizer->tell(id, {.cost = 0}), InputError) << id;
    EXPECT_EQ(optimizer->save(), before);
  }
}

TEST_P(OptimizerContract, AllFailedGenerationsEndInAReportedStop) {
  const Mixed plain;
  const Problem& problem = suited(plain);
  for (const bool from_the_start : {true, false}) {
    const auto optimizer = make(problem);
    if (!from_the_start) {
      for (int g = 0; g < 10; ++g) step(problem, *optimizer);
    }
    int generations = 0;
    while (!optimizer->stopped() && generations < 1000) {
      for (const Candidate& c : optimizer->ask()) {
        EXPECT_TRUE(c.x.allFinite());
        optimizer->tell(c.id, {.failed = true});
      }
      ++generations;
    }
    ASSERT_TRUE(optimizer->stopped());
    EXPECT_GT(generations, 1);
    EXPECT_FALSE(optimizer->stopped()->reason.empty());
    EXPECT_TRUE(std::isfinite(optimizer->stopped()->value));
    // It can still go on, from a state that is whole.
    for (int g = 0; g < 5; ++g) step(problem, *optimizer);
    for (const Candidate& c : optimizer->ask()) EXPECT_TRUE(c.x.allFinite());
  }
}

TEST_P(OptimizerContract, CopesWithWhatTrialsMaySay) {
  // NaN and infinite costs, constraints always or never violated, ties.
  const Mixed plain;
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem);
  Random random(12);
  for (int g = 0; g < 200; ++g) {
    for (const Candidate& c : optimizer->ask()) {
      ASSERT_TRUE(c.x.allFinite());
      const double costs[] = {NAN, kInf, -kInf, 0, 1, 1e300, -1e300, c.x[0]};
      Evaluation e{.cost = costs[random.below(8)],
                   .violated = {random.below(2) == 0, true},
                   .failed = random.below(10) == 0};
      for (int i = 0; i < problem.tasks().size(); ++i) {
        e.task_costs.push_back(costs[random.below(8)]);
      }
      optimizer->tell(c.id, e);
    }
    if (optimizer->stopped()) {
      EXPECT_FALSE(std::isnan(optimizer->stopped()->value));
    }
  }
}

TEST_P(OptimizerContract, MinusInfinityIsNoCost) {
  // A logarithm of 0 beside the best answer: whoever believed it would end there.
  const FunctionProblem plain =
      boxed(2, [](const VectorXd& x) { return x[0] > 1 ? -kInf : x[0] * x[0] + x[1] * x[1]; });
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem, {.x0 = VectorXd::Constant(2, 1.05)});
  const Summary s = minimise(problem, *optimizer, {.budget = 3000, .target = 1e-3});
  EXPECT_EQ(s.end, End::kTarget);
  EXPECT_TRUE(std::isfinite(s.stop.value));
  ASSERT_TRUE(s.progress.best);
  EXPECT_TRUE(std::isfinite(s.progress.best->evaluation.cost));
  EXPECT_GT(s.progress.failed, 0);
}

TEST_P(OptimizerContract, MinusInfinityOfOneTaskLeavesTheOthers) {
  if (!GetParam().learns_families) GTEST_SKIP() << "single trials";
  class OneTask : public WithTasks {
   public:
    using WithTasks::WithTasks;
    Evaluation evaluate(const VectorXd& x) const override {
      Evaluation e = WithTasks::evaluate(x);
      if (x[1] > 0.5) e.task_costs[1] = e.cost = -kInf;
      return e;
    }
  };
  const FunctionProblem plain = boxed(2, sphere);
  const OneTask problem(plain);
  const auto optimizer = make(problem);
  const Summary s = minimise(problem, *optimizer, {.budget = 6000, .target = 1e-3});
  EXPECT_EQ(s.end, End::kTarget);
  EXPECT_EQ(s.progress.failed, 0) << "it says something of two tasks";
  const auto best = optimizer->family();
  ASSERT_TRUE(best);
  for (const double cost : best->task_costs) EXPECT_TRUE(std::isfinite(cost));
}

/// A valley as narrow as numbers can tell, with a wall, and trials that fail.
class Valley : public FunctionProblem {
 public:
  Valley() : FunctionProblem(VectorXd::Constant(2, -2), VectorXd::Constant(2, 3), nullptr) {}
  std::vector<std::string> constraints() const override { return {"wall"}; }
  Evaluation evaluate(const VectorXd& x) const override {
    if (x[1] > 2.2) return {.failed = true};
    return {.cost = x[0] * x[0] + 1e20 * x[1] * x[1], .violated = {x[0] < 0.5}};
  }
};

/// Restores a state with one word after the other replaced by bad ones into what make makes, and
/// goes on from those that are accepted.
/// @param one_in  try so many of them
void tryCraftedStates(const Problem& problem, const std::string& state, int one_in,
                      const std::function<std::unique_ptr<Optimizer>()>& make) {
  int tried = 0;
  int refused = 0;
  const auto attempt = [&](size_t at, std::uint64_t word) {
    const std::unique_ptr<Optimizer> optimizer = make();
    ++tried;
    try {
      optimizer->restore(withWord(state, at, word));
    } catch (const InputError&) {
      ++refused;
      return;
    }
    tryGenerations(*optimizer, problem, 2);
    for (const Candidate& c : optimizer->ask()) ASSERT_TRUE(c.x.allFinite()) << at << " " << word;
  };
  // All bad words where a number begins, and one elsewhere: texts shift what follows them.
  const size_t first = state.find_last_of("abcdefghijklmnopqrstuvwxyz", 8 + 8 + 20) + 1;
  size_t turn = 0;
  for (size_t at = 0; at + 16 <= state.size(); ++at) {
    const bool begins = at % 8 == first % 8;
    for (size_t k = 0; k < std::size(kBadWords); ++k) {
      if (!begins && k != at % std::size(kBadWords)) continue;
      if (turn++ % one_in == 0) attempt(at, kBadWords[k]);
    }
  }
  EXPECT_GT(refused, tried / 4);
  EXPECT_LT(refused, tried) << "some words may be anything";
}

TEST_P(OptimizerContract, CraftedStatesAreRefusedOrUsable) {
  const Valley plain;
  const Problem& problem = suited(plain);
  const auto whole = make(problem, {.lambda = 4});
  for (int g = 0; g < 6; ++g) step(problem, *whole);
  whole->tell(whole->ask().back().id, costing(3));
  tryCraftedStates(problem, whole->save(), 1, [&] { return make(problem, {.lambda = 4}); });
}

TEST(CraftedStates, AreRefusedOrUsableOnceCmaEsHasMovedItsBasis) {
  const FunctionProblem problem =
      boxed(2, [](const VectorXd& x) { return x[0] * x[0] + 1e20 * x[1] * x[1]; });
  const auto make = [&] { return findOptimizer("cma-es").make(problem, {.lambda = 4}); };
  const auto whole = make();
  const CmaState& s = dynamic_cast<const CmaEs&>(*whole).state();
  for (int g = 0; g < 1000 && s.lengths.size() == 0; ++g) {
    for (const Candidate& c : whole->ask()) whole->tell(c.id, problem.evaluate(c.x));
  }
  ASSERT_GT(s.lengths.size(), 0);
  tryCraftedStates(problem, whole->save(), 3, make);
}

TEST_P(OptimizerContract, BoxesMayBeAsWideAsNumbersAre) {
  static constexpr double kMax = std::numeric_limits<double>::max();
  struct Box {
    double lower, upper;
  };
  const Box boxes[] = {{-1e300, 1e300}, {-kMax, kMax},   {-1.7e308, 1.7e308}, {0, kMax},
                       {-1e308, 1},     {1e300, 2e300},  {0, 5e-324},         {-1e-310, 1e-310},
                       {1e308, kInf},   {-kInf, -1e308}, {-kInf, 1e308},      {1, 1 + 1e-15}};
  for (const Box& box : boxes) {
    SCOPED_TRACE(box.lower);
    SCOPED_TRACE(box.upper);
    const FunctionProblem plain(VectorXd::Constant(2, box.lower), VectorXd::Constant(2, box.upper),
                                [](const VectorXd& x) { return x[0]; });
    class Linear : public FunctionProblem {
     public:
      using FunctionProblem::FunctionProblem;
      VectorXd tasks() const override { return VectorXd::LinSpaced(3, 0, 1); }
      Evaluation evaluate(const VectorXd& x) const override {
        return {.cost = x[0], .task_costs = {x[0], x[0], x[0]}};
      }
    };
    const Linear family(plain.lower(), plain.upper(), nullptr);
    const Problem& problem =
        GetParam().learns_families ? static_cast<const Problem&>(family) : plain;
    const auto optimizer = make(problem);
    const Summary s = minimise(problem, *optimizer, {.budget = 2500});
    EXPECT_FALSE(std::isnan(s.stop.value));
    ASSERT_TRUE(s.progress.best);
    EXPECT_EQ(s.progress.failed, 0);
    if (!std::isfinite(box.lower)) continue;
    const double half = box.upper / 2 - box.lower / 2;
    const double width = std::isfinite(half) ? half : std::abs(box.lower);
    EXPECT_LE(s.progress.best->x[0] / 2 - box.lower / 2, 1e-6 * width);
    for (const Candidate& c : optimizer->ask()) EXPECT_TRUE(c.x.allFinite());
  }
}

TEST_P(OptimizerContract, CostsMayBeAsLargeAsNumbersAre) {
  // Their differences and sums overflow.
  const FunctionProblem steep = boxed(2, [](const VectorXd& x) { return 1e300 * sphere(x); });
  const FunctionProblem signs =
      boxed(2, [](const VectorXd& x) { return 1.7e308 * std::tanh(x[0] + 1); });
  const auto a = make(suited(steep), {.x0 = VectorXd::Constant(2, 1.7)});
  EXPECT_EQ(minimise(suited(steep), *a, {.budget = 6000, .target = 1e290}).end, End::kTarget);
  const auto b = make(suited(signs), {.x0 = VectorXd::Constant(2, 1.7)});
  EXPECT_EQ(minimise(suited(signs), *b, {.budget = 6000, .target = -1e308}).end, End::kTarget);
}

TEST_P(OptimizerContract, AFamilyReachesATargetWithACurveNotWithATrial) {
  if (!GetParam().learns_families) GTEST_SKIP() << "single trials";
  const FunctionProblem plain = boxed(3, sphere);
  const Problem& problem = suited(plain);
  const auto optimizer = make(problem);
  EXPECT_EQ(minimise(problem, *optimizer, {.budget = 5000, .target = 1e6}).end, End::kTarget);
  EXPECT_TRUE(optimizer->family());
}

TEST_P(OptimizerContract, FindsTheFeasiblePart) {
  if (GetParam().learns_families) GTEST_SKIP() << "families rank by cost alone";
  // Feasible is a quarter of the box; the cost alone leads away from it.
  class Corner : public FunctionProblem {
   public:
    Corner() : FunctionProblem(VectorXd::Zero(2), VectorXd::Ones(2), nullptr) {}
    std::vector<std::string> constraints() const override { return {"left", "below"}; }
    Evaluation evaluate(const VectorXd& x) const override {
      return {.cost = x.sum(), .violated = {x[0] < 0.5, x[1] < 0.5}};
    }
  };
  const Corner problem;
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    const auto optimizer = make(problem, {.seed = seed});
    const Summary s = minimise(problem, *optimizer, {.budget = 1500, .target = 1.01});
    found += s.end == End::kTarget;
  }
  EXPECT_GE(found, 10);
}

TEST_P(OptimizerContract, RefusesWhatCannotBeUsed) {
  const FunctionProblem plain = boxed(3, sphere);
  const Problem& problem = suited(plain);
  EXPECT_THROW(make(problem, {.sigma = 0}), InputError);
  EXPECT_THROW(make(problem, {.sigma = NAN}), InputError);
  EXPECT_THROW(make(problem, {.lambda = -1}), InputError);
  EXPECT_THROW(make(problem, {.x0 = VectorXd::Zero(2)}), InputError);
  EXPECT_THROW(make(problem, {.x0 = VectorXd::Constant(3, NAN)}), InputError);
  EXPECT_THROW(make(problem, {.x0 = VectorXd::Constant(3, 10)}), InputError);
  const FunctionProblem reversed(VectorXd::Ones(3), VectorXd::Zero(3), sphere);
  EXPECT_THROW(make(suited(reversed)), InputError);
  const FunctionProblem unknown(VectorXd::Constant(3, NAN), VectorXd::Ones(3), sphere);
  EXPECT_THROW(make(suited(unknown)), InputError);
  if (GetParam().learns_families) {
    EXPECT_THROW(make(plain), InputError) << "no tasks";
  }
}

}  // namespace
}  // namespace traceur::optim
