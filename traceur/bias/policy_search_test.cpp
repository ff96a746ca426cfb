#include "traceur/bias/policy_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/bias/balance.h"
#include "traceur/core/error.h"

namespace traceur::bias {
namespace {

double bowl(const VectorXd& x) {
  return (x - VectorXd::Constant(x.size(), 0.3)).squaredNorm();
}

TEST(PolicySearch, FindsABowlWithAndWithoutPolish) {
  const VectorXd low = VectorXd::Constant(3, -1), high = VectorXd::Constant(3, 2);
  const FoundPolicy coarse = searchPolicy(bowl, low, high, {.direct = 300});
  EXPECT_LE(coarse.trials, 400);  // DIRECT finishes what it divides
  EXPECT_LT(coarse.cost, 0.01);
  const FoundPolicy fine = searchPolicy(bowl, low, high, {.direct = 300, .polish = 600});
  EXPECT_LT(fine.cost, 1e-6);
  EXPECT_EQ(fine.parameters,
            searchPolicy(bowl, low, high, {.direct = 300, .polish = 600}).parameters);
  EXPECT_DOUBLE_EQ(bowl(fine.parameters), fine.cost);
}

TEST(PolicySearch, AGoodWarmStartNeedsNoDirect) {
  const VectorXd low = VectorXd::Constant(3, -1), high = VectorXd::Constant(3, 2);
  const VectorXd near = VectorXd::Constant(3, 0.31);
  EXPECT_EQ(searchPolicy(bowl, low, high, {.good = 0.01, .warm = near}).trials, 1);
  const VectorXd far = VectorXd::Constant(3, -0.9);
  const FoundPolicy again = searchPolicy(bowl, low, high, {.good = 0.01, .warm = far});
  EXPECT_GT(again.trials, 1);
  EXPECT_LE(again.cost, 0.01);
}

TEST(PolicySearch, SurvivesNaNAndRefusesBadBounds) {
  const VectorXd low = VectorXd::Constant(2, -1), high = VectorXd::Constant(2, 1);
  const auto broken = [](const VectorXd& x) { return x[0] < 0 ? NAN : bowl(x); };
  EXPECT_LT(searchPolicy(broken, low, high, {.direct = 200, .polish = 200}).cost, 0.01);
  EXPECT_THROW(searchPolicy(bowl, high, low, {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, VectorXd::Constant(2, INFINITY), {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, high, {.warm = VectorXd::Zero(3)}), InputError);
}

/// DIRECT runs out of room for its boxes there.
TEST(PolicySearch, SurvivesAPlain) {
  const VectorXd high = VectorXd::Ones(5);
  const auto plain = [](const VectorXd& x) { return x[0] > 0.99 ? 0.0 : 1.0; };
  const FoundPolicy found = searchPolicy(plain, -high, high, {.direct = 1000});
  EXPECT_EQ(found.parameters.size(), 5);
  EXPECT_GT(found.trials, 100);
}

TEST(PolicySearch, PassesOnWhatATrialThrows) {
  const VectorXd high = VectorXd::Ones(3);
  int trials = 0;
  const auto broken = [&](const VectorXd& x) {
    if (++trials == 30) throw InputError("no such machine");
    return x.squaredNorm();
  };
  EXPECT_THROW(searchPolicy(broken, -high, high, {.direct = 200}), InputError);
}

TEST(PolicySearch, BalancesTheBoard) {
  BongoBoard board;
  VectorXd x0 = VectorXd::Zero(6);
  x0[1] = 0.25 * M_PI / 180;
  const auto cost = [&](const VectorXd& p) {
    return balance(board, {}, BalancePolicy::of(p), x0).cost;
  };
  const VectorXd bound = VectorXd::Constant(5, BalancePolicy::kBound);
  const FoundPolicy found = searchPolicy(cost, -bound, bound, {.good = 50, .polish = 60});
  EXPECT_LT(found.cost, 10);
  EXPECT_LE(found.trials, 1100);
}

}  // namespace
}  // namespace traceur::bias
