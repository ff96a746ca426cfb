#include "traceur/bias/balance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/bias/bongo_hardware.h"
#include "traceur/bias/test_states.h"

namespace traceur::bias {
namespace {

/// A gain that balances, found by others for the same model.
BalancePolicy known() {
  BalancePolicy policy;
  policy.h << 10201.5, 3656.9, -2913.9, -2.8, -1870.3;
  policy.from_wheel = false;
  return policy;
}

TEST(Balance, AKnownPolicyCostsWhatItIsKnownToCost) {
  BongoBoard board;
  const Episode small = balance(board, {}, known(), tilted(0.00436));
  EXPECT_FALSE(small.failed()) << small.failure;
  EXPECT_EQ(small.steps, 5000);
  EXPECT_NEAR(small.cost, 1.08, 0.01);
  EXPECT_NEAR(balance(board, {}, known(), tilted(0.0175)).cost, 18.0, 0.2);
  const Episode large = balance(board, {}, known(), tilted(0.035));
  EXPECT_EQ(large.failure, "rate");
  EXPECT_NEAR(large.steps, 112, 1);
  EXPECT_GT(large.cost, 200 * (5000 - 113));
}

TEST(Balance, HoldsOnTheHardwareThatIsAsTheModelSays) {
  BongoHardware hardware({}, {});
  RunLog log;
  const Episode e = balance(hardware, {}, known(), tilted(0.00436), {}, {}, &log);
  EXPECT_FALSE(e.failed()) << e.failure << " after " << e.steps;
  EXPECT_EQ(log.steps(), 5000);
  EXPECT_EQ(log.x.cols(), 5001);
  EXPECT_LE(log.u.cwiseAbs().maxCoeff(), 100);
}

TEST(Balance, EndsWhereItFailsAndSaysWhy) {
  BongoBoard board;
  BalancePolicy idle;
  RunLog log;
  const Episode e = balance(board, {}, idle, tilted(0.02), {}, {}, &log);
  EXPECT_TRUE(e.failed());
  EXPECT_EQ(log.steps(), e.steps);
  const BalanceLimits limits;
  BongoBoard::State x = BongoBoard::State::Zero();
  EXPECT_EQ(limits.failure({}, x), "");
  x[2] = 0.6;
  EXPECT_EQ(limits.failure({}, x), "body angle");
  x[2] = -0.3;
  x[0] = 0.4;
  EXPECT_EQ(limits.failure({}, x), "board angle");
  x << 0, 0, 0, 4, 3, 0;
  EXPECT_EQ(limits.failure({}, x), "rate");
  x << 2, -2, 1, 0, 0, 0;
  EXPECT_EQ(limits.failure({}, x), "body angle");
  x << 3.2, -3.2, 0.1, 0, 0, 0;
  EXPECT_EQ(limits.failure({}, x), "distance");
  x << 2.1, -2.1, 0, 0, 0, 0;
  x[2] = 0.1;
  EXPECT_EQ(limits.failure({}, x), "");  // 10.5 cm from where it began
  // Off its middle the board touches the ground at a smaller angle.
  x << -2.28, 2, 0.2, 0, 0, 0;
  EXPECT_EQ(limits.failure({}, x), "board on the ground");
  EXPECT_NEAR(boardHeight({}, x), poseOf({}, x).board.y() - 0.3 * std::sin(0.28), 1e-12);
  x << 2.28, -2, -0.2, 0, 0, 0;
  EXPECT_EQ(limits.failure({}, x), "board on the ground");
  x << 0.2, 0, -0.2, 0, 0, 0;
  EXPECT_EQ(limits.failure({}, x), "");
  x[0] = NAN;
  EXPECT_NE(limits.failure({}, x), "");
}

TEST(Balance, TheTorqueIsEachGainTimesWhatItIsOf) {
  const BongoParameters board;
  BongoBoard::State x;
  x << .2, -.1, .15, 1, -2, .5;
  for (const bool from_wheel : {false, true}) {
    const auto place = [&](double time) {
      BongoBoard::State at = x;
      at.head<3>() += time * x.tail<3>();
      const BongoPose pose = poseOf(board, at);
      return pose.pelvis.x() - (from_wheel ? pose.wheel.x() : 0);
    };
    const double h = 1e-6;
    const double speed = (place(h) - place(-h)) / (2 * h);
    const double of[] = {place(0), speed, x[2], x[5], x[0] + x[1]};
    BalancePolicy policy;
    policy.from_wheel = from_wheel;
    for (int i = 0; i < BalancePolicy::kParameters; ++i) {
      policy.h.setZero();
      policy.h[i] = 3;
      EXPECT_NEAR(policy.torque(board, x), 3 * of[i], 1e-7) << i;
      policy.h[i] = std::copysign(1e6, of[i]);
      EXPECT_EQ(policy.torque(board, x), policy.most_torque);
      policy.h[i] *= -1;
      EXPECT_EQ(policy.torque(board, x), -policy.most_torque);
    }
  }
}

TEST(Balance, AnEpisodesCostIsThatOfItsLog) {
  BongoBoard::State each;
  each << 1, 2, -3, 4, -5, 6;
  EXPECT_DOUBLE_EQ((BalanceCost{.angle = 7, .rate = 0.3}.of(each)), 7 * 14 + 0.3 * 77);
  const BalanceCost cost{.steps = 300};
  for (const double tilt : {0.00436, -0.035}) {  // it holds; it does not
    BongoBoard board;
    RunLog log;
    const Episode e = balance(board, {}, known(), tilted(tilt), cost, {}, &log);
    ASSERT_EQ(log.steps(), e.steps);
    EXPECT_EQ(e.failed(), e.steps < 300);
    EXPECT_EQ(log.time_step, board.timeStep());
    EXPECT_EQ(VectorXd(log.x.col(0)), tilted(tilt));
    double farthest = 0;
    double effort = 0;
    for (int t = 0; t < e.steps; ++t) {
      const BongoBoard::State x = log.x.col(t);
      farthest = std::max(farthest, cost.of(x));
      effort += cost.torque * log.u(0, t) * log.u(0, t);
      EXPECT_EQ(log.u(0, t), known().torque({}, x));
      EXPECT_EQ(BongoBoard::State(log.x.col(t + 1)), board.stepped(x, log.u(0, t)));
    }
    EXPECT_NEAR(e.cost, cost.failure * (300 - e.steps) + farthest + effort, 1e-9 * e.cost);
  }
}

TEST(Balance, ParametersMapToGainsOddlyAndSmoothly) {
  VectorXd p(5);
  p << 0, 1, -1, 2, -10;
  const BalancePolicy policy = BalancePolicy::of(p);
  EXPECT_EQ(policy.h[0], 0);
  EXPECT_DOUBLE_EQ(policy.h[1], std::exp(1) - 1);
  EXPECT_DOUBLE_EQ(policy.h[2], -policy.h[1]);
  EXPECT_NEAR(policy.h[4], -22025.47, 0.01);
}

TEST(Balance, ALimitItselfIsWithinAndWhatIsBeyondItIsNot) {
  BalanceLimits limits;
  const auto failure = [&](std::initializer_list<double> x) {
    const BongoBoard::State state(x.begin());
    EXPECT_EQ(limits.failure({}, -state), limits.failure({}, state));  // left as right
    return limits.failure({}, state);
  };
  EXPECT_EQ(failure({0, 0, 0.5, 0, 0, 0}), "");
  EXPECT_EQ(failure({0, 0, 0.501, 0, 0, 0}), "body angle");
  EXPECT_EQ(failure({0.125, 0.125, 0.25, 0, 0, 0}), "");
  EXPECT_EQ(failure({0.125, 0.125, 0.251, 0, 0, 0}), "body angle");
  EXPECT_EQ(failure({0, 0.3, 0, 0, 0, 0}), "");
  EXPECT_EQ(failure({0, 0.301, 0, 0, 0, 0}), "board angle");
  EXPECT_EQ(failure({0.15, 0.151, -0.2, 0, 0, 0}), "board angle");
  for (const double rate : {6.2, 6.201}) {
    const std::string expected = rate > 6.2 ? "rate" : "";
    EXPECT_EQ(failure({0, 0, 0, rate, -2, 0}), expected);  // the wheel alone
    EXPECT_EQ(failure({0, 0, 0, -2, rate, 0}), expected);  // the board alone
    EXPECT_EQ(failure({0, 0, 0, rate - 2, 2, 0}), expected);
  }
  EXPECT_EQ(failure({2.125, -2.125, 0.25, 0, 0, 0}), "");
  EXPECT_EQ(failure({2.125, -2.125, 0.251, 0, 0, 0}), "distance");
  BongoBoard::State low;
  low << 0, 0.25, 0, 0, 0, 0;
  limits.board_height = boardHeight({}, low);
  EXPECT_EQ(limits.failure({}, low), "");
  limits.board_height += 1e-9;
  EXPECT_EQ(limits.failure({}, low), "board on the ground");
}

}  // namespace
}  // namespace traceur::bias
