#include "traceur/reproduce/table_11.h"

#include <gtest/gtest.h>

#include <cmath>

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
      const double floor = row.function != Function::kSchwefel ? 0
                           : row.n == 5                        ? 0.001658
                                                               : 0.003481;
      EXPECT_NEAR(table11Problem(row, seed)->evaluate(a).task_costs[0], floor, 1e-6) << row.name;
    }
  }
  EXPECT_NE(optimum(5, 1), optimum(5, 2));
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
