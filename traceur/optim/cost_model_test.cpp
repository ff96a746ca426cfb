#include "traceur/optim/cost_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/random.h"
#include "traceur/optim/cma_c.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/test_functions.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;

/// (n x count) of a standard normal distribution.
MatrixXd normal(int n, int count, std::uint64_t seed) {
  Random random(seed);
  MatrixXd X(n, count);
  for (double& x : X.reshaped()) x = random.normal();
  return X;
}

std::vector<double> costsOf(const MatrixXd& X, double (*f)(double)) {
  std::vector<double> costs;
  for (const auto& x : X.colwise()) costs.push_back(f(x.squaredNorm()));
  return costs;
}

/// Two trials: shares 1/4 and 3/4, targets -1 and 1, and the equations can be solved by hand.
TEST(CostModel, OfTwoTrialsIsWhatIsComputedByHand) {
  MatrixXd X(1, 2);
  X << 0, 2;
  const CostModel model(X, {7, 9}, {.width = 1, .noise = 0.5});
  const double k = std::exp(-2);
  const double diagonal = 1.25;
  const VectorXd x = VectorXd::Constant(1, 0.5);
  const double a = std::exp(-0.125);
  const double b = std::exp(-1.125);
  const CostModel::Prediction p = model.predict(x);
  EXPECT_NEAR(p.mean, (b - a) / (diagonal - k), 1e-14);
  const double explained =
      (diagonal * (a * a + b * b) - 2 * k * a * b) / (diagonal * diagonal - k * k);
  EXPECT_NEAR(p.deviation, std::sqrt(1 - explained), 1e-14);
}

TEST(CostModel, KnowsNothingFarAway) {
  const MatrixXd X = normal(3, 20, 1);
  const CostModel model(X, costsOf(X, [](double r) { return r; }), {});
  const CostModel::Prediction p = model.predict(VectorXd::Constant(3, 100));
  EXPECT_EQ(p.mean, 0);
  EXPECT_EQ(p.deviation, 1);
}

/// Only ranks count, to the bit.
TEST(CostModel, DoesNotSeeIncreasingFunctionsOfCosts) {
  const MatrixXd X = normal(3, 20, 2);
  const CostModel a(X, costsOf(X, [](double r) { return r; }), {.width = 2});
  const CostModel b(X, costsOf(X, [](double r) { return -1e9 / (r + 1); }), {.width = 2});
  const VectorXd x = normal(3, 1, 3);
  EXPECT_EQ(a.predict(x).mean, b.predict(x).mean);
  EXPECT_NE(a.predict(x).mean, 0);
}

TEST(CostModel, EqualCostsPromiseNothing) {
  const MatrixXd X = normal(3, 20, 4);
  const CostModel model(X, std::vector<double>(20, 5.0), {});
  EXPECT_EQ(model.predict(X.col(0)).mean, 0);
  EXPECT_LT(model.predict(X.col(0)).deviation, 0.2);
}

TEST(CostModel, StandsTheSameTrialTwice) {
  const MatrixXd X = MatrixXd::Ones(2, 3);
  const CostModel model(X, {1, 2, 3}, {});
  EXPECT_TRUE(std::isfinite(model.predict(VectorXd::Ones(2)).mean));
}

/// Of a bowl, it ranks points it has not seen.
TEST(CostModel, TellsTheBetterOfTwoPoints) {
  const MatrixXd X = normal(4, 60, 5);
  const CostModel model(X, costsOf(X, [](double r) { return r; }), {.width = 2});
  const MatrixXd fresh = normal(4, 200, 6);
  int right = 0;
  for (int i = 0; i < 200; i += 2) {
    const VectorXd a = fresh.col(i);
    const VectorXd b = fresh.col(i + 1);
    right += (model.predict(a).mean < model.predict(b).mean) == (a.squaredNorm() < b.squaredNorm());
  }
  EXPECT_GE(right, 85);
}

/// Trials until the cost is 1e-6, in the mean of 20 seeds.
double trialsOn(double (*f)(const VectorXd&), bool model) {
  const FunctionProblem problem(4, f);
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const CmaCOptions plain{.cma = {.x0 = VectorXd::Constant(4, 0.3), .seed = seed}};
    CmaC cma(model ? modelCmaC(plain) : plain);
    const Summary found = minimise(problem, cma, {.budget = 10000, .target = 1e-6});
    EXPECT_EQ(found.end, End::kTarget);
    sum += found.progress.evaluations;
  }
  return sum / 20;
}

/// Where the cost is smooth, a model saves a good part of the trials.
TEST(CostModel, SavesTrials) {
  const double on_sphere = trialsOn(&sphere, true) / trialsOn(&sphere, false);
  const double in_a_valley = trialsOn(&rosenbrock, true) / trialsOn(&rosenbrock, false);
  EXPECT_LT(on_sphere, 0.75) << on_sphere;
  EXPECT_LT(in_a_valley, 0.9) << in_a_valley;
}

}  // namespace
}  // namespace traceur::optim
