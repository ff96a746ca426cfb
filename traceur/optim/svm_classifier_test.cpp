#include "traceur/optim/svm_classifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/random.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(SvmClassifier, LearnsADisc) {
  Random random(3);
  const int count = 200;
  MatrixXd X(2, count);
  std::vector<bool> inside(count);
  for (int k = 0; k < count; ++k) {
    X.col(k) << random.uniform(-2, 2), random.uniform(-2, 2);
    inside[k] = X.col(k).norm() < 1;
  }
  const SvmClassifier svm(X, inside, {.gamma = 1, .C = 100});
  int right = 0;
  for (int k = 0; k < 1000; ++k) {
    const Eigen::Vector2d x(random.uniform(-2, 2), random.uniform(-2, 2));
    right += (svm.decision(x) > 0) == (x.norm() < 1);
  }
  EXPECT_GT(right, 950);
  EXPECT_LT(svm.supportVectors(), count / 2);
}

TEST(SvmClassifier, TheSignDoesNotDependOnWhichLabelCameFirst) {
  MatrixXd X(1, 2);
  X << 0, 1;
  const SvmClassifier a(X, {true, false}, {});
  const SvmClassifier b(X, {false, true}, {});
  const VectorXd left = VectorXd::Constant(1, -0.2);
  EXPECT_GT(a.decision(left), 0);
  EXPECT_LT(b.decision(left), 0);
  EXPECT_NEAR(a.decision(left), -b.decision(left), 1e-9);
}

TEST(SvmClassifier, BalanceLetsTheRareLabelCount) {
  // One good point among 30 bad ones, all close by: unbalanced, the majority has its way.
  MatrixXd X(1, 31);
  std::vector<bool> inside(31, false);
  for (int k = 0; k < 31; ++k) X(0, k) = 0.02 * k;
  inside[15] = true;
  const SvmClassifier balanced(X, inside, {.gamma = 1, .C = 1, .balanced = true});
  const SvmClassifier plain(X, inside, {.gamma = 1, .C = 1, .balanced = false});
  EXPECT_GT(balanced.decision(X.col(15)), plain.decision(X.col(15)));
  EXPECT_LT(plain.decision(X.col(15)), 0);
}

TEST(SvmClassifier, CopesWithContradictionsAndDuplicates) {
  const MatrixXd X = MatrixXd::Zero(3, 8);
  const SvmClassifier svm(X, {true, false, true, false, true, false, true, false}, {.C = 100});
  EXPECT_TRUE(std::isfinite(svm.decision(VectorXd::Zero(3))));
}

TEST(SvmClassifier, OfFewPointsIsTheOneThatCanBeWrittenDown) {
  const double gamma = 0.4;
  const auto kernel = [&](const VectorXd& a, const VectorXd& b) {
    return std::exp(-gamma * (a - b).squaredNorm());
  };
  MatrixXd X(2, 2);
  X << 0, 1, 0.5, -1;
  const VectorXd away{{0.3, 0.4}};
  const double apart = kernel(X.col(0), X.col(1));
  const double difference = kernel(away, X.col(0)) - kernel(away, X.col(1));
  // One of each: both weigh 1/(1 - k), or C if that is less, and the boundary lies in the middle.
  for (const double C : {0.7, 100.0}) {
    const SvmClassifier svm(X, {true, false}, {.gamma = gamma, .C = C, .balanced = false});
    EXPECT_NEAR(svm.decision(away), std::min(C, 1 / (1 - apart)) * difference, 1e-2);
    EXPECT_NEAR(svm.decision((X.col(0) + X.col(1)) / 2), 0, 1e-9);
    EXPECT_EQ(svm.supportVectors(), 2);
  }
  // Two equal ones against one, all at what they may weigh: balanced, C count / (2 its label's).
  MatrixXd three(2, 3);
  three << X.col(0), X.col(1), X.col(1);
  for (const bool first : {true, false}) {
    const SvmClassifier plain(three, {first, !first, !first},
                              {.gamma = gamma, .C = 0.1, .balanced = false});
    const SvmClassifier balanced(three, {first, !first, !first},
                                 {.gamma = gamma, .C = 0.1, .balanced = true});
    const double sign = first ? 1 : -1;
    EXPECT_NEAR(plain.decision(away) - plain.decision(X.col(1)),
                sign * 0.1 * (difference + 1 - apart), 1e-9);
    EXPECT_NEAR(balanced.decision(away) - balanced.decision(X.col(1)),
                sign * 0.15 * (difference + 1 - apart), 1e-9);
  }
}

}  // namespace
}  // namespace traceur::optim
