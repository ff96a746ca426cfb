#include "traceur/reproduce/constrained_anchors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::reproduce {
namespace {

TEST(AnchorProblem, BestKnownPointsAreFeasibleAndBest) {
  const Eigen::Vector2d g06(14.0950000000000006, 0.8429607892154795668);
  const Eigen::Vector2d g24(2.32952019747762, 3.17849307411774);
  EXPECT_NEAR(AnchorProblem(2).evaluate(g06).cost, anchors()[2].best, 1e-6);
  EXPECT_NEAR(AnchorProblem(3).evaluate(g24).cost, anchors()[3].best, 1e-6);
  EXPECT_TRUE(AnchorProblem(0).evaluate(Eigen::Vector2d(1, 1)).feasible());
  EXPECT_EQ(AnchorProblem(0).evaluate(Eigen::Vector2d(1, 1)).cost, anchors()[0].best);
  EXPECT_FALSE(AnchorProblem(4).evaluate(Eigen::VectorXd::Constant(5, 0.5)).feasible());
  EXPECT_THROW(AnchorProblem(6), InputError);
}

TEST(RunAnchor, CmaCSolvesThemWithFewInfeasibleTrials) {
  for (const int anchor : {0, 2, 3, 4}) {
    const AnchorOutcome o = runAnchor(anchor, 3, 1);
    EXPECT_TRUE(o.solved) << anchors()[anchor].name;
    EXPECT_LT(o.infeasible, o.rollouts / 2);
    EXPECT_EQ(o.rollouts, runAnchor(anchor, 3, 1).rollouts);
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
  EXPECT_THROW(runAnchor(0, 9, 1), InputError);
  const AnchorOutcome capped = runAnchor(2, 0, 1);
  EXPECT_FALSE(capped.solved);
  EXPECT_EQ(capped.rollouts, kAnchorCap);
}

}  // namespace
}  // namespace traceur::reproduce
