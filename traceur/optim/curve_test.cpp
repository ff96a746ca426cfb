#include "traceur/optim/curve.h"

#include <gtest/gtest.h>

#include "traceur/core/random.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Curve, BernsteinWeightsSumToOneAndMeetTheEnds) {
  for (const int K : {1, 2, 4}) {
    for (const double w : {0.0, 0.3, 1.0}) EXPECT_NEAR(bernstein(K, w).sum(), 1, 1e-15);
    EXPECT_EQ(bernstein(K, 0)[0], 1);
    EXPECT_EQ(bernstein(K, 1)[K - 1], 1);
  }
  EXPECT_NEAR(bernstein(4, 0.25)[1], 3 * 0.25 * 0.75 * 0.75, 1e-15);
}

TEST(Curve, ACubicWithEvenControlPointsIsTheLine) {
  const MatrixXd ends{{1, 4}, {-2, 7}};
  MatrixXd even(2, 4);
  for (int k = 0; k < 4; ++k) even.col(k) = ends.col(0) + k / 3.0 * (ends.col(1) - ends.col(0));
  const Curve line{Curve::Kind::kBezier, ends};
  const Curve cubic{Curve::Kind::kBezier, even};
  for (double w = 0; w <= 1; w += 0.1) EXPECT_LT((line.at(w) - cubic.at(w)).norm(), 1e-14);
}

TEST(Curve, APolylineGoesThroughItsPointsAndStaysAtItsEnds) {
  const MatrixXd points{{0, 3, 1}};
  const Curve c{Curve::Kind::kPolyline, points};
  EXPECT_EQ(c.at(0)[0], 0);
  EXPECT_EQ(c.at(0.5)[0], 3);
  EXPECT_DOUBLE_EQ(c.at(0.75)[0], 2);
  EXPECT_EQ(c.at(1)[0], 1);
  EXPECT_EQ(c.at(7)[0], 1);
  EXPECT_EQ(c.at(-7)[0], 0);
  EXPECT_EQ((Curve{Curve::Kind::kPolyline, MatrixXd{{5}}}.at(0.4)[0]), 5);
}

TEST(Curve, StaysInsideItsBounds) {
  const VectorXd lower = VectorXd::Constant(2, -1);
  const VectorXd upper = VectorXd::Constant(2, 1);
  Random random(3);
  for (int t = 0; t < 100; ++t) {
    MatrixXd points(2, 4);
    for (double& p : points.reshaped()) p = random.uniform(-5, 5);
    const Curve c{Curve::Kind::kBezier, points, BoundFold(lower, upper, VectorXd::Ones(2))};
    for (double w = 0; w <= 1; w += 0.05) {
      EXPECT_TRUE((c.at(w).array().abs() <= 1).all());
    }
  }
}

TEST(Curve, OfATaskRoundedIsTheKnotThatWasRun) {
  const Curve c{Curve::Kind::kPolyline, MatrixXd{{0, 0.3, 1}, {7, 1.0 / 3, 5}}};
  for (const double off : {-1e-12, 0.0, 1e-12}) {
    EXPECT_EQ(c.at(0.5 + off), c.points.col(1)) << off;
    EXPECT_EQ(c.at(1 + off), c.points.col(2)) << off;
  }
  EXPECT_NE(c.at(0.5 + 1e-8), c.points.col(1));
  EXPECT_NEAR(c.at(0.25)[1], (7 + 1.0 / 3) / 2, 1e-15);
}

}  // namespace
}  // namespace traceur::optim
