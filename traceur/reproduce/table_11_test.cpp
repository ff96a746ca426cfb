#include "traceur/reproduce/table_11.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "traceur/core/random.h"
#include "traceur/optim/minimise.h"

namespace traceur::reproduce {
namespace {

using optim::VectorXd;

/// The optimum of a task, where the sphere is 0: found from the values of f² about it.
VectorXd optimum(int n, std::uint64_t seed, int task = 0) {
  const auto problem = table11Problem({"", Function::kSphere, n}, seed);
  const auto square = [&](const VectorXd& x) {
    const double f = problem->evaluate(x).task_costs[task];
    return f * f;
  };
  VectorXd a(n);
  for (int i = 0; i < n; ++i) {
    a[i] = (square(-VectorXd::Unit(n, i)) - square(VectorXd::Unit(n, i))) / 4;
  }
  return a;
}

TEST(Table11, TheOptimaAreWhereTheyWere) {
  ASSERT_EQ(table11().size(), 10u);
  for (const Table11Row& row : table11()) {
    for (const std::uint64_t seed : {1, 2}) {
      const VectorXd a = optimum(row.n, seed);
      EXPECT_LE(a.cwiseAbs().maxCoeff(), 0.5);
      EXPECT_GT(a.maxCoeff() - a.minCoeff(), 0.1);
      const double floor = row.function != Function::kSchwefel ? 0
                           : row.n == 5                        ? 0.001658
                                                               : 0.003481;
      EXPECT_NEAR(table11Problem(row, seed)->evaluate(a).task_costs[0], floor, 1e-6) << row.name;
    }
  }
  EXPECT_NE(optimum(5, 1), optimum(5, 2));
}

TEST(Table11, TheOptimaLieOnASegment) {
  const VectorXd a = optimum(10, 1, 0);
  const VectorXd way = optimum(10, 1, 5) - a;
  EXPECT_LE(way.cwiseAbs().maxCoeff(), 0.1 + 1e-12);
  EXPECT_GT(way.maxCoeff(), 0.01);
  EXPECT_LT(way.minCoeff(), -0.01);
  for (int task = 1; task < 5; ++task) {
    EXPECT_LT((optimum(10, 1, task) - a - task / 5.0 * way).norm(), 1e-12);
  }
  const auto problem = table11Problem(table11()[1], 1);
  EXPECT_EQ(problem->tasks(), VectorXd::LinSpaced(6, 0, 1));
  EXPECT_EQ(problem->dimension(), 10);
  EXPECT_TRUE((problem->lower().array() == -INFINITY).all());
  EXPECT_TRUE((problem->upper().array() == INFINITY).all());
}

/// Term by term as the header has it, near the optima and far beyond ±1.
TEST(Table11, FunctionsAreThoseOfTheHeader) {
  static constexpr double kPi = std::numbers::pi;
  const auto value = [](Function function, const VectorXd& d, double w) {
    const int n = static_cast<int>(d.size());
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      if (function == Function::kSphere) sum += d[i] * d[i];
      if (function == Function::kBentCigar) sum += (i == 0 ? 2e-7 : 0.2) * d[i] * d[i];
      if (function == Function::kWeierstrass) {
        const double z = (0.1 + 0.9 * w) * d[i];
        for (int k = 0; k <= 20; ++k) {
          const double power = std::pow(3, k);
          sum += 0.1 * std::pow(2, -k) * (std::cos(2 * kPi * power * (z + 0.5)) + 1);
        }
      }
      if (function == Function::kSchwefel) {
        const double z = 200 * d[i] + 420.9687462275036;
        const double size = std::abs(z);
        if (size <= 500) {
          sum += z * std::sin(std::sqrt(size));
        } else {
          const double mirrored = 500 - std::fmod(size, 500);
          sum += (z < 0 ? -mirrored : mirrored) * std::sin(std::sqrt(mirrored));
          sum -= std::pow(size - 500, 2) / (1e4 * n);
        }
      }
    }
    if (function == Function::kSphere) return std::sqrt(sum);
    if (function != Function::kSchwefel) return sum;
    return 1e-3 * std::max(0.0, 418.9829 * n * n - 418.9 * n * (n - 1) - sum);
  };
  Random random(4);
  for (const Function function :
       {Function::kSphere, Function::kBentCigar, Function::kWeierstrass, Function::kSchwefel}) {
    const auto problem = table11Problem({"", function, 5}, 1);
    for (const double far : {0.05, 0.5, 2.0, 8.0}) {
      VectorXd x(5);
      for (double& v : x) v = random.uniform(-far, far);
      const optim::Evaluation e = problem->evaluate(x);
      ASSERT_EQ(e.task_costs.size(), 6U);
      double outside = 0;
      for (const double v : x) outside += 0.1 * std::pow(std::max(0.0, std::abs(v) - 1), 2);
      if (function == Function::kSphere) outside = 0;
      double mean = 0;
      for (int task = 0; task < 6; ++task) {
        const double expected = value(function, x - optimum(5, 1, task), task / 5.0) + outside;
        EXPECT_NEAR(e.task_costs[task], expected, 1e-8 * (1 + expected))
            << static_cast<int>(function) << ' ' << far;
        mean += expected / 6;
      }
      EXPECT_NEAR(e.cost, mean, 1e-8 * (1 + mean));
    }
  }
}

TEST(Table11, RowsAreAsTheyAreCalled) {
  for (const Table11Row& row : table11()) {
    const size_t dash = row.name.rfind('-');
    EXPECT_EQ(std::stoi(row.name.substr(dash + 1)), row.n);
    const std::string function = row.name.substr(0, dash);
    EXPECT_EQ(row.unimodal, function == "sphere" || function == "bent-cigar");
    EXPECT_EQ(row.function, function == "sphere"        ? Function::kSphere
                            : function == "bent-cigar"  ? Function::kBentCigar
                            : function == "weierstrass" ? Function::kWeierstrass
                                                        : Function::kSchwefel);
    EXPECT_EQ(table11Budget(row), row.unimodal ? 30000 : 20000);
  }
}

/// The Schwefel's least is above the threshold. A generation is 96 trials, which divide no budget.
TEST(Table11, AUnimodalRunThatDoesNotArriveCountsItsBudget) {
  Table11Row row{"", Function::kSchwefel, 5, false};
  const Table11Outcome other = runTable11(row, Algorithm::kCma, 1);
  EXPECT_FALSE(other.reached);
  EXPECT_EQ(other.evaluations, 20064);
  EXPECT_GT(other.cost, 0.0016);
  row.unimodal = true;
  const Table11Outcome counted = runTable11(row, Algorithm::kCma, 1);
  EXPECT_FALSE(counted.reached);
  EXPECT_EQ(counted.evaluations, 30000);
  EXPECT_LE(counted.cost, other.cost);
}

TEST(Table11, FunctionsHaveTheirShape) {
  const auto at = [](Function function, const VectorXd& d, int task = 0) {
    const int n = static_cast<int>(d.size());
    return table11Problem({"", function, n}, 1)->evaluate(optimum(n, 1, task) + d).task_costs[task];
  };
  EXPECT_NEAR(at(Function::kSphere, VectorXd{{0.3, 0, 0, 0.4}}), 0.5, 1e-12);
  EXPECT_NEAR(at(Function::kBentCigar, VectorXd{{0.2, 0.1, 0, 0}}), 2e-7 * 0.04 + 0.2 * 0.01,
              1e-12);
  EXPECT_NEAR(at(Function::kSchwefel, VectorXd{{0.001, 0, 0, 0, 0}}), 0.001658, 1e-4);
  EXPECT_GT(at(Function::kSchwefel, VectorXd{{-0.5, 0, 0, 0, 0}}), 0.02);
  // At w = 1, z = d; a third turns the first term by 2π/3 off its peak, and all others fully.
  EXPECT_NEAR(at(Function::kWeierstrass, VectorXd{{1.0 / 3, 0}}, 5), 0.15, 1e-6);
}

TEST(Table11, RunsReachTheThresholdAndRepeat) {
  const Table11Row& row = table11()[3];
  for (const Algorithm algorithm : {Algorithm::kCurve, Algorithm::kCma}) {
    const Table11Outcome one = runTable11(row, algorithm, 1);
    const Table11Outcome same = runTable11(row, algorithm, 1);
    EXPECT_TRUE(one.reached);
    EXPECT_LE(one.cost, kTable11Threshold);
    EXPECT_EQ(one.evaluations, same.evaluations);
    EXPECT_EQ(one.cost, same.cost);
    EXPECT_NE(one.evaluations, runTable11(row, algorithm, 2).evaluations);
    const double printed = algorithm == Algorithm::kCurve ? row.curve : row.cma;
    EXPECT_GT(one.evaluations, printed / 3);
    EXPECT_LT(one.evaluations, printed * 3);
  }
}

}  // namespace
}  // namespace traceur::reproduce
