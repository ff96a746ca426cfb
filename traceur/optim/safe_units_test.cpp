// A search in a box of huge or tiny numbers is that of the same problem in an ordinary box.
#include "traceur/optim/safe_units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/optim/all.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

/// A bowl in variables of every kind, in their own units or in such that numbers are ordinary.
class BowlInUnits : public Problem {
 public:
  BowlInUnits(bool ordinary, bool family) : family_(family) {
    if (!ordinary) exponents_ = {0, 401, -500, 30, 40};
  }
  VectorXd lower() const override { return inUnits(VectorXd{{-1, -0.5, 0, 0x1p40, -kInf}}); }
  VectorXd upper() const override { return inUnits(VectorXd{{2, 0.5, 1, kInf, -0x1p40}}); }
  VectorXd tasks() const override {
    return family_ ? VectorXd(VectorXd::LinSpaced(3, 0, 1)) : VectorXd();
  }
  std::vector<std::string> constraints() const override { return {"wall"}; }
  Evaluation evaluate(const VectorXd& x) const override {
    // So near to a single bound that it folds there.
    const VectorXd least{{0.7, 0.2, 0.9, 0x1p40 + 0.1, -0x1p40 - 0.1}};
    VectorXd y = x;
    for (int i = 0; i < 5; ++i) y[i] = std::ldexp(x[i], -exponents_[i]) - least[i];
    Evaluation e{.cost = y.squaredNorm(), .violated = {y[0] + y[1] < -0.6}};
    for (const double task : tasks()) e.task_costs.push_back(e.cost + task * y[0]);
    return e;
  }
  VectorXd inUnits(VectorXd x) const {
    for (int i = 0; i < 5; ++i) x[i] = std::ldexp(x[i], exponents_[i]);
    return x;
  }

 private:
  bool family_;
  std::vector<int> exponents_ = {0, 0, 0, 0, 0};
};

/// @param each  called after every generation with the search in ordinary units, and the other
template <class Each>
void expectEqualSearches(const OptimizerEntry& entry, const CommonOptions& ordinary,
                         const CommonOptions& unusual, const Each& each) {
  const bool family = entry.learns_families;
  const BowlInUnits plain(true, family);
  const BowlInUnits far(false, family);
  const auto one = entry.make(plain, ordinary);
  auto other = entry.make(far, unusual);
  for (int g = 0; g < 40; ++g) {
    const std::vector<Candidate> expected = one->ask();
    const std::vector<Candidate> got = other->ask();
    ASSERT_EQ(got.size(), expected.size());
    for (size_t k = 0; k < got.size(); ++k) {
      EXPECT_EQ(got[k].id, expected[k].id);
      ASSERT_EQ(got[k].x, far.inUnits(expected[k].x)) << g;
      one->tell(expected[k].id, plain.evaluate(expected[k].x));
      other->tell(got[k].id, far.evaluate(got[k].x));
    }
    ASSERT_EQ(one->save(), other->save()) << g;
    EXPECT_EQ(one->stopped().has_value(), other->stopped().has_value());
    EXPECT_EQ(one->achieved(), other->achieved());
    each(*one, *other);
    if (g % 10 != 5) continue;
    const std::string state = other->save();
    other = entry.make(far, unusual);
    other->restore(state);
  }
}

TEST(SafeUnits, ChangeNothingButTheUnits) {
  const VectorXd x0{{0, 0.1, 0.5, 0x1p40 + 1, -0x1p40 - 1}};
  const BowlInUnits far(false, false);
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (entry.learns_families) continue;
    SCOPED_TRACE(entry.name);
    const auto none = [](const Optimizer&, const Optimizer&) {};
    expectEqualSearches(entry, {}, {}, none);
    const Evaluation left{.cost = 1, .violated = {true}};
    const Evaluation right{.cost = 1, .violated = {false}};
    const VectorXd beside = x0 + 0.3 * VectorXd::Unit(5, 1);
    expectEqualSearches(entry, {.x0 = x0, .experience = {{x0, right}, {beside, left}}},
                        {.x0 = far.inUnits(x0),
                         .experience = {{far.inUnits(x0), right}, {far.inUnits(beside), left}}},
                        none);
    EXPECT_THROW(entry.make(far, {.x0 = VectorXd::Zero(4)}), InputError);
  }
}

TEST(SafeUnits, OfAFamilyChangeNothingButTheUnits) {
  const VectorXd x0{{0, 0.1, 0.5, 0x1p40 + 1, -0x1p40 - 1}};
  const BowlInUnits far(false, true);
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (!entry.learns_families) continue;
    SCOPED_TRACE(entry.name);
    int curves = 0;
    const auto same_curve = [&](const Optimizer& one, const Optimizer& other) {
      const std::optional<Family> expected = one.family();
      const std::optional<Family> got = other.family();
      ASSERT_EQ(got.has_value(), expected.has_value());
      if (!got) return;
      ++curves;
      EXPECT_EQ(got->cost, expected->cost);
      EXPECT_EQ(got->task_costs, expected->task_costs);
      for (const double w : {0.0, 0.3, 1.0}) {
        ASSERT_EQ(got->curve.at(w), far.inUnits(expected->curve.at(w))) << w;
      }
    };
    expectEqualSearches(entry, {}, {}, same_curve);
    expectEqualSearches(entry, {.x0 = x0}, {.x0 = far.inUnits(x0)}, same_curve);
    EXPECT_GT(curves, 20);
    EXPECT_THROW(entry.make(far, {.x0 = VectorXd::Zero(4)}), InputError);
  }
}

TEST(SafeUnits, GiveNumbersWhereTheBoxHasNoEnd) {
  const FunctionProblem above(VectorXd::Constant(1, 1e308), VectorXd::Constant(1, kInf), sphere);
  const FunctionProblem below(VectorXd::Constant(1, -kInf), VectorXd::Constant(1, -1e308), sphere);
  for (const FunctionProblem& problem : {above, below}) {
    const auto optimizer = findOptimizer("cma-es").make(problem, {.sigma = 1e13});
    double largest = 0;
    for (const Candidate& c : optimizer->ask()) {
      EXPECT_TRUE(problem.lower()[0] <= c.x[0] && c.x[0] <= problem.upper()[0]);
      largest = std::max(largest, std::abs(c.x[0]));
    }
    EXPECT_EQ(largest, std::numeric_limits<double>::max());
  }
}

TEST(SafeUnits, RefuseBoundsThatAreNone) {
  const FunctionProblem reversed(VectorXd::Ones(2), VectorXd::Zero(2), sphere);
  for (const OptimizerEntry& entry : allOptimizers()) {
    EXPECT_THROW(entry.make(reversed, {}), InputError);
  }
}

}  // namespace
}  // namespace traceur::optim
