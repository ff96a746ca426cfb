#include "traceur/bias/faulty_bongo_board.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/bias/balance.h"
#include "traceur/bias/bongo_hardware.h"
#include "traceur/bias/bongo_learning.h"

namespace traceur::bias {
namespace {

BalancePolicy balancing() {
  BalancePolicy policy;
  policy.h << 920, 11, -155, -2, 50;
  return policy;
}

TEST(FaultyBongoBoard, WithoutFaultsIsTheModel) {
  BongoBoard model;
  FaultyBongoBoard same({}, {});
  const VectorXd x0 = bongoStart(0.002, 0.004);
  model.reset(x0);
  same.reset(x0);
  for (int t = 0; t < 100; ++t) {
    const VectorXd u = VectorXd::Constant(1, 50 * std::sin(0.1 * t));
    model.step(u);
    same.step(u);
    ASSERT_EQ(model.state(), same.state());
  }
}

TEST(FaultyBongoBoard, AnswersLate) {
  BongoBoard model;
  FaultyBongoBoard late({}, {.delay = 0.003});
  const VectorXd push = VectorXd::Constant(1, 30);
  const VectorXd none = VectorXd::Zero(1);
  late.reset(VectorXd::Zero(6));
  for (int t = 0; t < 3; ++t) {
    late.step(push);
    EXPECT_EQ(late.state(), VectorXd::Zero(6)) << t;
  }
  late.step(push);
  model.reset(VectorXd::Zero(6));
  model.step(push);
  EXPECT_EQ(late.state(), model.state());

  // Half a step more: the mean of two.
  FaultyBongoBoard between({}, {.delay = 0.0005});
  between.reset(VectorXd::Zero(6));
  between.step(push);
  model.reset(VectorXd::Zero(6));
  model.step(0.5 * push);
  EXPECT_EQ(between.state(), model.state());

  // A past that is told is the past that was.
  late.reset(VectorXd::Zero(6));
  Eigen::VectorXd past(4);
  past << 7, 30, 30, 30;
  late.setPast(past);
  late.step(none);
  model.reset(VectorXd::Zero(6));
  model.step(push);
  EXPECT_EQ(late.state(), model.state());
}

TEST(FaultyBongoBoard, FrictionTakesEnergyAndNeverGivesAny) {
  const BongoBoard model;
  for (const BongoModelFaults& faults :
       {BongoModelFaults{.coulomb_friction = 2}, BongoModelFaults{.viscous_friction = 5}}) {
    FaultyBongoBoard board({}, faults);
    board.reset(bongoStart(0.01, 0.02));
    double energy = model.energy(board.state());
    for (int t = 0; t < 300; ++t) {
      board.step(VectorXd::Zero(1));
      const double now = model.energy(board.state());
      EXPECT_LE(now, energy + 1e-9) << t;
      energy = now;
    }
  }
}

/// Box2D's robot with the pelvis's COM moved and this one fall alike.
TEST(FaultyBongoBoard, AnOffsetComFallsAsTheHardwareDoes) {
  BongoFaults faults;
  faults.com_offset = 0.01;
  BongoHardware hardware({}, faults);
  FaultyBongoBoard board({}, {.com_offset = 0.01});
  hardware.reset(VectorXd::Zero(6));
  board.reset(VectorXd::Zero(6));
  for (int t = 0; t < 150; ++t) {
    hardware.step(VectorXd::Zero(1));
    board.step(VectorXd::Zero(1));
  }
  EXPECT_GT(std::abs(board.state()[5]), 0.05);
  EXPECT_LT((board.state() - hardware.state()).norm(), 0.05 * hardware.state().norm());
}

TEST(FaultyBongoBoard, FaultsAreIdentifiedFromLogs) {
  const BongoModelFaults faults{
      .inertia_scale = 1.15, .delay = 0.004, .coulomb_friction = 1, .com_offset = 0.001};
  FaultyBongoBoard board({}, faults);
  std::vector<RunLog> logs(2);
  for (int i = 0; i < 2; ++i) {
    balance(board, {}, balancing(), bongoStart(0.002 * i, 0.004), {.steps = 1500}, {}, &logs[i]);
  }
  const BongoModelFaults found = identify(logs, {}, bongoBias(BongoMethod::kIdentify), bongoKeeps);
  EXPECT_NEAR(found.inertia_scale, faults.inertia_scale, 0.03);
  EXPECT_NEAR(found.delay, faults.delay, 0.0005);
  EXPECT_NEAR(found.coulomb_friction, faults.coulomb_friction, 0.3);
  EXPECT_NEAR(found.com_offset, faults.com_offset, 0.0005);
  EXPECT_EQ(identify({}, {}, bongoBias(BongoMethod::kIdentify), bongoKeeps).delay, 0);
}

}  // namespace
}  // namespace traceur::bias
