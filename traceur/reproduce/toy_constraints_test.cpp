#include "traceur/reproduce/toy_constraints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

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

TEST(ToyProblem, EachConstraintHasItsOwnEdges) {
  struct Place {
    Vector2d x;
    bool beyond, below_diagonal, outside_l;
  };
  // With x + y < 7.5 below the diagonal.
  const Place places[] = {{{4, 3.5}, false, false, false},     {{4.001, 3.5}, true, false, false},
                          {{3.5, 4}, false, false, false},     {{3.5, 4.001}, true, false, false},
                          {{4, 4}, false, false, false},       {{3.999, 3.5}, false, true, false},
                          {{3.5, 3.999}, false, true, false},  {{3, 3.5}, false, true, false},
                          {{2.999, 3.75}, false, true, true},  {{3.5, 3}, false, true, false},
                          {{3.75, 2.999}, false, true, true},  {{3.499, 3.5}, false, true, false},
                          {{3.499, 3.499}, false, true, true}, {{3.5, 3.499}, false, true, false},
                          {{3.25, 3.25}, false, true, true},   {{-5, 4.001}, true, true, true},
                          {{4.001, 2.999}, true, true, true},  {{5, 5}, true, false, false},
                          {{2.999, 3.999}, false, true, true}, {{4, 2.999}, false, true, true}};
  const ToyProblem triangle(toyRows()[0], 1);
  const ToyProblem l(toyRows()[9], 1);
  for (const Place& p : places) {
    SCOPED_TRACE(p.x.transpose());
    EXPECT_EQ(triangle.evaluate(p.x).violated, (std::vector{p.beyond, p.below_diagonal}));
    EXPECT_EQ(l.evaluate(p.x).violated, (std::vector{p.beyond, p.outside_l}));
  }
  EXPECT_EQ(triangle.constraints(), (std::vector<std::string>{"beyond 4", "below diagonal"}));
  EXPECT_EQ(l.constraints(), (std::vector<std::string>{"beyond 4", "outside L"}));
  EXPECT_EQ(triangle.lower(), Vector2d::Constant(-std::numeric_limits<double>::infinity()));
  EXPECT_EQ(triangle.upper(), Vector2d::Constant(std::numeric_limits<double>::infinity()));
}

/// sin a + sin b = 2 sin((a+b)/2) cos((a-b)/2), at the height and the frequency of the row's name.
TEST(ToyProblem, UndulatesAsItsNameSays) {
  for (const ToyRow& row : toyRows()) {
    const ToyProblem problem(row, 1);
    const Vector2d optimum = row.optimum();
    EXPECT_EQ(optimum, row.name == "Toy3" ? Vector2d(3.1, 3.6) : Vector2d(3.9, 3.9));
    EXPECT_NEAR(problem.smoothCost(optimum + Vector2d(-3, 4)), 2.5, 1e-12);
    if (row.noise == ToyRow::Noise::kRandom) continue;
    double k = 2, w = 10;  // Toy3's
    EXPECT_EQ(std::sscanf(row.name.c_str(), "Toy2 k=%lf w=%lf", &k, &w),
              row.name == "Toy3" ? 0 : 2);
    Random random(3);
    for (int i = 0; i < 20; ++i) {
      const Vector2d x(random.uniform(-5, 5), random.uniform(-5, 5));
      EXPECT_NEAR(problem.evaluate(x).cost - problem.smoothCost(x),
                  2 * k * std::abs(std::sin(w * x[0]) * std::cos(w * x[1])), 1e-12)
          << row.name;
    }
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
  double feasible = 0, most = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vector2d y(random.uniform(3.75, 4), random.uniform(3.75, 4));
    const double noise = one.evaluate(y).cost - one.smoothCost(y);
    feasible += noise / 2000;
    most = std::max(most, noise);
  }
  EXPECT_NEAR(feasible, 0.025, 0.001);
  EXPECT_LE(most, 0.05);
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
  EXPECT_THROW(runToy(-1, 0, 1), InputError);
  EXPECT_THROW(runToy(0, static_cast<int>(toyAlgorithms().size()), 1), InputError);
  EXPECT_THROW(runToy(0, -1, 1), InputError);
}

/// The rule by which runs end, held against all their trials.
TEST(RunToy, EndsByItsRule) {
  int missed = 0;
  for (const int row : {0, 1, 9}) {
    const ToyProblem problem(toyRows()[row], 2);
    const Vector2d optimum = toyRows()[row].optimum();
    for (int algorithm = 0; algorithm < static_cast<int>(toyAlgorithms().size()); ++algorithm) {
      SCOPED_TRACE(toyRows()[row].name + " " + toyAlgorithms()[algorithm].name);
      const int generation = toyAlgorithms()[algorithm].name == "(1+1)-CMA-ES" ? 1 : 8;
      std::vector<bool> close, reached;
      int infeasible = 0;
      const auto see = [&](const optim::Candidate& c, const optim::Evaluation& e) {
        EXPECT_EQ(e.cost, problem.evaluate(c.x).cost);
        close.push_back((c.x - optimum).norm() <= 0.5);
        reached.push_back(e.feasible() && problem.smoothCost(c.x) < 0.002);
        infeasible += !e.feasible();
      };
      const ToyOutcome collapsed = runToy(row, algorithm, 2, ToyStop::kCollapsed, see).first;
      size_t end =
          generation;  // of the first generation with eight close trials in a row behind it
      const auto eight_close = [&] {
        for (size_t i = 1; i <= 8; ++i) {
          if (i > end || !close[end - i]) return false;
        }
        return true;
      };
      while (end < close.size() && !eight_close()) end += generation;
      EXPECT_EQ(close.size(), end);
      EXPECT_NE(eight_close(), collapsed.missed);
      EXPECT_EQ(collapsed.evaluations, static_cast<int>(close.size()));
      EXPECT_EQ(collapsed.infeasible, infeasible);
      missed += collapsed.missed;

      reached.clear();
      const ToyOutcome first = runToy(row, algorithm, 2, ToyStop::kReached, see).first;
      const auto hit = std::find(reached.begin(), reached.end(), true);
      EXPECT_EQ(first.missed, hit == reached.end());
      EXPECT_EQ(first.evaluations, static_cast<int>(reached.size()));
      EXPECT_TRUE(first.missed ? first.evaluations == 2000 : hit == reached.end() - 1);
      missed += first.missed;
    }
  }
  EXPECT_GT(missed, 0);
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
