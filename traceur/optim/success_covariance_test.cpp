#include "traceur/optim/success_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "traceur/core/random.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd normal(Random& random, int n) {
  VectorXd v(n);
  for (double& x : v) x = random.normal();
  return v;
}

TEST(SuccessConstants, AreThePublishedOnes) {
  const SuccessConstants c = successConstants(10);
  EXPECT_EQ(c.d, 6);
  EXPECT_DOUBLE_EQ(c.p_target, 2.0 / 11);
  EXPECT_DOUBLE_EQ(c.c_p, 1.0 / 12);
  EXPECT_DOUBLE_EQ(c.c_c, 1.0 / 6);
  EXPECT_DOUBLE_EQ(c.c_cov, 2.0 / 106);
  EXPECT_EQ(c.p_threshold, 0.44);
}

TEST(SuccessConstants, TheStepRestsAtTheTargetRate) {
  const SuccessConstants c = successConstants(3);
  EXPECT_EQ(stepFactor(c, c.p_target), 1);
  EXPECT_DOUBLE_EQ(stepFactor(c, 1), std::exp(1 / c.d));
  EXPECT_DOUBLE_EQ(stepFactor(c, 0), std::exp(-2.0 / 9 / c.d));
  EXPECT_DOUBLE_EQ(updateSuccessRate(c, 0.5, true), 0.5 + 0.5 / 12);
  EXPECT_DOUBLE_EQ(updateSuccessRate(c, 0.5, false), 0.5 - 0.5 / 12);
}

TEST(UpdateCholesky, AddsAndTakesAway) {
  Random random(1);
  for (const int n : {1, 2, 7}) {
    MatrixXd A(n, n);
    for (double& x : A.reshaped()) x = random.normal();
    const MatrixXd C = A * A.transpose() + MatrixXd::Identity(n, n);
    for (const double a : {0.0, 0.3, 5.0, -0.05}) {
      const VectorXd v = normal(random, n);
      MatrixXd L = C.llt().matrixL();
      ASSERT_TRUE(updateCholesky(L, v, a));
      EXPECT_LE((L * L.transpose() - C - a * v * v.transpose()).norm(), 1e-12 * C.norm());
      EXPECT_GT(L.diagonal().minCoeff(), 0);
    }
  }
}

TEST(UpdateCholesky, RefusesWhatWouldNotBePositiveDefinite) {
  MatrixXd L = MatrixXd::Identity(3, 3);
  const VectorXd v = VectorXd::Ones(3);
  EXPECT_FALSE(updateCholesky(L, v, -1.0 / 3));
  EXPECT_FALSE(updateCholesky(L, v, -2));
  EXPECT_FALSE(updateCholesky(L, v, NAN));
  EXPECT_EQ(L, MatrixXd::Identity(3, 3));
}

TEST(SuccessCovariance, LearnsAsTheEquationsSay) {
  const int n = 5;
  const SuccessConstants c = successConstants(n);
  SuccessCovariance learned(n);
  VectorXd p_c = VectorXd::Zero(n);
  MatrixXd C = MatrixXd::Identity(n, n);
  Random random(2);
  for (int g = 0; g < 60; ++g) {
    const VectorXd y = normal(random, n);
    // At the threshold itself the path stalls.
    const double p = g % 3 == 0 ? 0.44 : g % 3 == 1 ? 0.9 : 0.1;
    learned.learn(c, y, p);
    if (p < 0.44) {
      p_c = (1 - c.c_c) * p_c + std::sqrt(c.c_c * (2 - c.c_c)) * y;
      C = (1 - c.c_cov) * C + c.c_cov * p_c * p_c.transpose();
    } else {
      // The decay is 1 - c_cov + c_cov c_c (2-c_c), and not (1 - c_cov) (1 + c_c (2-c_c)), as one
      // implementation has it; C keeps its size when the path stalls for long.
      p_c = (1 - c.c_c) * p_c;
      C = (1 - c.c_cov) * C + c.c_cov * (p_c * p_c.transpose() + c.c_c * (2 - c.c_c) * C);
    }
    ASSERT_LE((learned.p_c - p_c).norm(), 1e-12);
    ASSERT_LE((learned.covariance() - C).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace traceur::optim
