#include "traceur/reproduce/constrained_anchors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"

namespace traceur::reproduce {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

TEST(AnchorProblem, BestKnownPointsAreFeasibleAndBest) {
  const Vector2d g06(14.0950000000000006, 0.8429607892154795668);
  const Vector2d g24(2.32952019747762, 3.17849307411774);
  EXPECT_NEAR(AnchorProblem(2).evaluate(g06).cost, anchors()[2].best, 1e-6);
  EXPECT_NEAR(AnchorProblem(3).evaluate(g24).cost, anchors()[3].best, 1e-6);
  EXPECT_TRUE(AnchorProblem(0).evaluate(Vector2d(1, 1)).feasible());
  EXPECT_EQ(AnchorProblem(0).evaluate(Vector2d(1, 1)).cost, anchors()[0].best);
  EXPECT_FALSE(AnchorProblem(4).evaluate(VectorXd::Constant(5, 0.5)).feasible());
  EXPECT_THROW(AnchorProblem(6), InputError);
  EXPECT_THROW(AnchorProblem(-1), InputError);
}

/// The boundaries written otherwise: a little to either side only this constraint's answer changes.
TEST(AnchorProblem, ConstraintsChangeAtTheirCurvesAlone) {
  const auto changes = [](int anchor, const VectorXd& kept, const VectorXd& violated,
                          size_t which) {
    const AnchorProblem problem(anchor);
    ASSERT_EQ(problem.evaluate(kept).violated.size(), problem.constraints().size());
    EXPECT_FALSE(problem.evaluate(kept).violated[which]) << kept.transpose();
    EXPECT_TRUE(problem.evaluate(violated).violated[which]) << violated.transpose();
  };
  static constexpr double kLittle = 1e-9;
  for (const double turn : {-3.0, -2.0, -1.0, 0.0, 0.7, 1.6, 2.9}) {
    const Vector2d out(std::cos(turn), std::sin(turn));
    const Vector2d first(5, 5), second(6, 5);
    changes(2, first + (10 + kLittle) * out, first + (10 - kLittle) * out, 0);
    changes(2, second + (9.1 - kLittle) * out, second + (9.1 + kLittle) * out, 1);
    changes(4, (1 - kLittle) * VectorXd::Unit(5, 3), (1 + kLittle) * VectorXd::Unit(5, 3), 0);
  }
  for (const double a : {0.0, 0.5, 1.0, 1.7, 2.0, 2.5, 3.0}) {
    const double first = 2 * std::pow(a * (a - 2), 2) + 2;
    const double second = 4 * std::pow((a - 1) * (a - 3), 2);
    changes(3, Vector2d(a, first - kLittle), Vector2d(a, first + kLittle), 0);
    changes(3, Vector2d(a, second - kLittle), Vector2d(a, second + kLittle), 1);
  }
  const VectorXd plane = VectorXd::LinSpaced(10, -1, 3);  // of sum 10
  changes(1, plane.array() + kLittle, plane.array() - kLittle, 0);
}

TEST(AnchorProblem, CostsAndBoundsAreThePublishedOnes) {
  EXPECT_DOUBLE_EQ(AnchorProblem(1).evaluate(VectorXd::LinSpaced(10, 1, 10)).cost, 385);
  EXPECT_DOUBLE_EQ(AnchorProblem(2).evaluate(Vector2d(12, 23)).cost, 8 + 27);
  EXPECT_DOUBLE_EQ(AnchorProblem(3).evaluate(Vector2d(1, 0.5)).cost, -1.5);
  EXPECT_DOUBLE_EQ(AnchorProblem(5).evaluate(VectorXd::LinSpaced(20, 0.25, 5)).cost, -0.25);
  EXPECT_EQ(AnchorProblem(2).lower(), Vector2d(13, 0));
  EXPECT_EQ(AnchorProblem(2).upper(), Vector2d(100, 100));
  EXPECT_EQ(AnchorProblem(3).lower(), Vector2d(0, 0));
  EXPECT_EQ(AnchorProblem(3).upper(), Vector2d(3, 4));
  EXPECT_EQ(AnchorProblem(0).lower(), Vector2d::Constant(-kInfinity));
  EXPECT_EQ(AnchorProblem(4).upper(), VectorXd::Constant(5, kInfinity));
  EXPECT_EQ(AnchorProblem(2).constraints().size(), 2U);
  for (int i = 0; i < static_cast<int>(anchors().size()); ++i) {
    EXPECT_EQ(anchors()[i].start.size(), anchors()[i].n);
    EXPECT_EQ(AnchorProblem(i).dimension(), anchors()[i].n);
  }
  EXPECT_EQ(anchors()[5].best, AnchorProblem(5).evaluate(VectorXd::Unit(20, 0)).cost);
}

TEST(RunAnchor, CmaCSolvesThemWithFewInfeasibleTrials) {
  for (const int anchor : {0, 2, 3, 4}) {
    const AnchorOutcome o = runAnchor(anchor, 3, 1);
    EXPECT_TRUE(o.solved) << anchors()[anchor].name;
    EXPECT_LT(o.infeasible, o.rollouts / 2);
    EXPECT_EQ(o.rollouts, runAnchor(anchor, 3, 1).rollouts);
    EXPECT_LE(o.gap, 1e-6 * std::max(1.0, std::abs(anchors()[anchor].best)));
    EXPECT_GT(o.gap, -1e-8);
  }
}

TEST(RunAnchor, TheOnePlusOneIsNotStuckOnATangent) {
  for (const int anchor : {0, 1, 4}) EXPECT_TRUE(runAnchor(anchor, 2, 1).solved);
}

TEST(RunAnchor, ResamplingCountsWhatItRejects) {
  const AnchorOutcome o = runAnchor(0, 0, 1);
  EXPECT_TRUE(o.solved);
  EXPECT_GT(o.infeasible, 20);
  EXPECT_LT(o.infeasible, o.rollouts / 2);
  EXPECT_THROW(runAnchor(0, static_cast<int>(anchorAlgorithms().size()), 1), InputError);
  EXPECT_THROW(runAnchor(0, -1, 1), InputError);
  const AnchorOutcome capped = runAnchor(2, 0, 1);
  EXPECT_FALSE(capped.solved);
  EXPECT_EQ(capped.rollouts, 20000);
  EXPECT_GT(capped.gap, 1e-6 * std::abs(anchors()[2].best));
  EXPECT_LT(capped.infeasible, capped.rollouts);
}

}  // namespace
}  // namespace traceur::reproduce
