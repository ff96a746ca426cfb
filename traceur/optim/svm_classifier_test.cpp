#include "traceur/optim/svm_classifier.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace traceur::optim
