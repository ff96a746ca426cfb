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
  EXPECT_LT(again.trials, 200);  // it stops where it is good
  EXPECT_LE(again.cost, 0.01);
  EXPECT_EQ(searchPolicy(bowl, low, high, {.good = bowl(far), .warm = far}).trials, 1);
  // One that lies outside begins at the bounds.
  VectorXd outside(3);
  outside << -5, 0.3, 7;
  const FoundPolicy clipped = searchPolicy(bowl, low, high, {.direct = 0, .warm = outside});
  EXPECT_EQ(clipped.parameters, Eigen::Vector3d(-1, 0.3, 2));
}

TEST(PolicySearch, SurvivesNaNAndRefusesBadBounds) {
  const VectorXd low = VectorXd::Constant(2, -1), high = VectorXd::Constant(2, 1);
  const auto broken = [](const VectorXd& x) { return x[0] < 0 ? NAN : bowl(x); };
  EXPECT_LT(searchPolicy(broken, low, high, {.direct = 200, .polish = 200}).cost, 0.01);
  EXPECT_THROW(searchPolicy(bowl, high, low, {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, VectorXd::Constant(2, INFINITY), {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, high, {.warm = VectorXd::Zero(3)}), InputError);
  EXPECT_THROW(searchPolicy(bowl, VectorXd(0), VectorXd(0), {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, VectorXd::Ones(3), {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, VectorXd::Constant(2, -INFINITY), high, {}), InputError);
  EXPECT_THROW(searchPolicy(bowl, low, Eigen::Vector2d(1, -1), {}), InputError);
  // What is no cost is never the best, but the first of equals is, be they infinite.
  const auto bottomless = [](const VectorXd& x) {
    return x[0] < 0 ? -std::numeric_limits<double>::infinity() : bowl(x);
  };
  EXPECT_GE(searchPolicy(bottomless, low, high, {.direct = 50}).cost, 0);
  for (const double cost : {1.0, std::numeric_limits<double>::infinity()}) {
    const auto plain = [&](const VectorXd&) { return cost; };
    const FoundPolicy first = searchPolicy(plain, low, 2 * high, {.direct = 20});
    EXPECT_EQ(first.cost, cost);
    EXPECT_EQ(first.parameters, Eigen::Vector2d(0.5, 0.5));
  }
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
  EXPECT_EQ(trials, 30);
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

TEST(PolicySearch, PolishesInRoundsUntilItSucceeds) {
  const VectorXd low = Eigen::Vector2d(-1, 10), high = Eigen::Vector2d(3, 10.5);
  std::vector<VectorXd> asked;
  const auto cost = [&](const VectorXd& x) {
    asked.push_back(x);
    return std::pow(x[0], 4) + std::pow(x[1] - 10.1, 2);
  };
  const VectorXd warm = Eigen::Vector2d(2, 10.4);
  PolicySearchOptions o{.direct = 0, .polish = 30, .success = -1, .rounds = 1, .seed = 7};
  o.warm = warm;
  const FoundPolicy once = searchPolicy(cost, low, high, o);
  EXPECT_EQ(once.trials, 31);
  // A round is a search of its own from the best, with a seed far from other searches'.
  PolicySearchOptions second = o;
  second.warm = once.parameters;
  second.seed = 7 + 1'000'003;
  const FoundPolicy twice = searchPolicy(cost, low, high, second);
  o.rounds = 2;
  const FoundPolicy both = searchPolicy(cost, low, high, o);
  EXPECT_EQ(both.trials, 61);
  EXPECT_EQ(both.parameters, twice.parameters);
  o.rounds = 3;
  o.success = both.cost;  // success is less than this
  EXPECT_EQ(searchPolicy(cost, low, high, o).trials, 91);
  o.success = std::nextafter(both.cost, 1);
  EXPECT_EQ(searchPolicy(cost, low, high, o).trials, 61);
  o.polish = 0;
  EXPECT_EQ(searchPolicy(cost, low, high, o).trials, 1);
  o.polish = 1;  // a generation
  EXPECT_GT(searchPolicy(cost, low, high, o).trials, 1);

  // Its first steps are the fraction of each range, from what is known or else from the middle.
  for (const bool known : {true, false}) {
    PolicySearchOptions near{.direct = 0, .polish = 6, .polish_step = 0.01};
    if (known) near.warm = warm;
    asked.clear();
    searchPolicy(cost, low, high, near);
    const VectorXd from = known ? warm : VectorXd(Eigen::Vector2d(1, 10.25));
    for (int i = 0; i < 2; ++i) {
      double farthest = 0;
      for (const VectorXd& x : asked) farthest = std::max(farthest, std::abs(x[i] - from[i]));
      const double step = 0.01 * (high[i] - low[i]);
      EXPECT_GT(farthest, 0.5 * step) << i;
      EXPECT_LT(farthest, 4 * step) << i;
    }
  }
  // Nothing leaves the bounds.
  asked.clear();
  const FoundPolicy wide =
      searchPolicy(cost, low, high, {.direct = 20, .polish = 60, .polish_step = 1});
  EXPECT_TRUE(std::isfinite(wide.cost));
  for (const VectorXd& x : asked) {
    EXPECT_TRUE((x.array() >= low.array()).all() && (x.array() <= high.array()).all());
  }
}

TEST(PolicySearch, AskedToStopItEndsAfterTheTrialUnderWay) {
  const VectorXd high = VectorXd::Ones(3);
  for (const int last : {1, 8, 120}) {  // of DIRECT, and of the polish after it
    std::stop_source stop;
    int trials = 0;
    const auto cost = [&](const VectorXd& x) {
      if (++trials == last) stop.request_stop();
      return x.squaredNorm();
    };
    const FoundPolicy found =
        searchPolicy(cost, -high, 2 * high,
                     {.direct = 60, .polish = 500, .success = -1, .stop = stop.get_token()});
    EXPECT_EQ(found.trials, last);
    EXPECT_EQ(trials, last);
  }
}

}  // namespace
}  // namespace traceur::bias
