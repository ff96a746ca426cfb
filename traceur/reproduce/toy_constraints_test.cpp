#include "traceur/reproduce/toy_constraints.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/random.h"

namespace traceur::reproduce {
namespace {

using Eigen::Vector2d;

TEST(ToyProblem, FeasibleAreasAreThePrintedOnes) {
  // Area 25/(ratio + 1) of [0, 5]²; the L has 0.75.
  const double expected[] = {0.125, 0.5, 0.03125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.125, 0.75};
  for (size_t row = 0; row < toyRows().size(); ++row) {
    const ToyProblem problem(toyRows()[row], 1);
    Random random(row);
    int inside = 0;
    for (int k = 0; k < 20000; ++k) {
      inside += problem.evaluate(Vector2d(random.uniform(3, 4), random.uniform(3, 4))).feasible();
    }
    EXPECT_NEAR(inside / 20000.0, expected[row], 0.015) << toyRows()[row].name;
    EXPECT_TRUE(problem.evaluate(toyRows()[row].optimum()).feasible());
  }
}

TEST(ToyProblem, NoiseIsFreshForEveryPointAndPure) {
  const ToyProblem one(toyRows()[0], 1);
  const ToyProblem two(toyRows()[0], 2);
  const Vector2d x(0.5, 0.25);
  const Vector2d near(0.5 + 1e-12, 0.25);
  EXPECT_EQ(one.evaluate(x).cost, one.evaluate(x).cost);
  EXPECT_NE(one.evaluate(x).cost, two.evaluate(x).cost);
  EXPECT_GT(std::abs(one.evaluate(x).cost - one.evaluate(near).cost), 1e-6);
  double sum = 0;
  Random random(5);
  for (int k = 0; k < 2000; ++k) {
    const Vector2d y(random.uniform(-5, 5), random.uniform(-5, 3));
    const double noise = one.evaluate(y).cost - one.smoothCost(y);
    EXPECT_TRUE(noise >= 0 && noise < 2);
    sum += noise / 2000;
  }
  EXPECT_NEAR(sum, 1, 0.05);
}

TEST(RunToy, DependsOnItsArgumentsOnly) {
  for (size_t a = 0; a < toyAlgorithms().size(); ++a) {
    for (const ToyStop stop : {ToyStop::kCollapsed, ToyStop::kReached}) {
      const ToyOutcome one = runToy(1, static_cast<int>(a), 3, stop).first;
      const ToyOutcome two = runToy(1, static_cast<int>(a), 3, stop).first;
      EXPECT_EQ(one.evaluations, two.evaluations);
      EXPECT_LE(one.evaluations, kToyCap);
      EXPECT_EQ(one.missed, one.evaluations == kToyCap && one.missed);
    }
  }
  EXPECT_THROW(runToy(10, 0, 1), InputError);
  EXPECT_THROW(runToy(0, 99, 1), InputError);
}

TEST(RunToy, ClassifiersSaveMostTrials) {
  double plain = 0;
  double learned = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    plain += runToy(0, 0, seed).first.evaluations;
    learned += runToy(0, 2, seed).first.evaluations;
  }
  EXPECT_LT(learned, plain / 2);
}

}  // namespace
}  // namespace traceur::reproduce
