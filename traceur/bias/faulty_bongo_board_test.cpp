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

TEST(FaultyBongoBoard, AnswersWithTheTorqueOfItsTime) {
  const VectorXd x0 = bongoStart(0.01, 0.02);
  const std::vector<double> asked = {40, -30, 7, 90, -11, 25, 60};
  // 1.25 steps: three quarters of the torque of a step ago, a quarter of the one before it.
  FaultyBongoBoard late({}, {.delay = 0.00125});
  for (int episode = 0; episode < 2; ++episode) {  // nothing of the first is left in the second
    BongoBoard model;
    late.reset(x0);
    model.reset(x0);
    double last = 0, before = 0;
    for (const double u : asked) {
      late.step(VectorXd::Constant(1, u));
      model.step(VectorXd::Constant(1, 0.75 * last + 0.25 * before));
      EXPECT_LT((late.state() - model.state()).norm(), 1e-12);
      before = last;
      last = u;
    }
  }
  // Of a past shorter than the delay, what is missing was nothing.
  FaultyBongoBoard later({}, {.delay = 0.003});
  const auto answer = [&](const VectorXd& past) {
    later.reset(x0);
    later.setPast(past);
    later.step(VectorXd::Constant(1, 90));
    return VectorXd(later.state());
  };
  BongoBoard model;
  const auto moved = [&](double u) { return VectorXd(model.stepped(x0, u)); };
  EXPECT_EQ(answer(Eigen::Vector3d(30, 7, 8)), moved(30));
  EXPECT_EQ(answer(Eigen::Vector2d(7, 8)), moved(0));
  EXPECT_EQ(answer(VectorXd(0)), moved(0));
}

TEST(FaultyBongoBoard, FaultsActAsTheirFormulasSay) {
  const BongoBoard model;
  const VectorXd none = VectorXd::Zero(1);
  BongoBoard::State x;
  x << .1, .2, -.15, .4, -.3, 0;
  const auto stepped = [&](const BongoModelFaults& faults, double rate) {
    FaultyBongoBoard board({}, faults);
    x[5] = rate;
    board.reset(x);
    board.step(none);
    return BongoBoard::State(board.state());
  };
  // Dry friction is all there from 1e-3 + 3e-3 per N·m on [rad/s] and grows evenly until then.
  for (const double sign : {1.0, -1.0}) {
    const auto expect = [&](const BongoModelFaults& faults, double rate, double friction) {
      const BongoBoard::State got = stepped(faults, sign * rate);
      EXPECT_LT((got - model.stepped(x, -sign * friction)).norm(), 1e-12) << rate;
    };
    expect({.coulomb_friction = 2}, 0.0035, 1);
    expect({.coulomb_friction = 2}, 0.007, 2);
    expect({.coulomb_friction = 2}, 0.5, 2);
    expect({.viscous_friction = 3}, 0.5, 1.5);
  }
  // The weight of an offset COM turns the board as far as it is level.
  BongoParameters p;
  p.inertia_scale = 1.1;
  FaultyBongoBoard offset(p, {.inertia_scale = 1.2, .com_offset = 0.01});
  p.inertia_scale = 1.1 * 1.2;
  offset.reset(x);
  offset.step(none);
  const double moment = -30 * p.inertia_scale * 9.81 * 0.01 * std::cos(0.3);
  EXPECT_LT((offset.state() - BongoBoard(p).stepped(x, 0, moment)).norm(), 1e-12);
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
  // What may not be used hides its windows, from their first reading to their last, and no others.
  logs[0].x.col(20).setConstant(NAN);   // the last of steps 0 to 20
  logs[0].x.col(80).setConstant(NAN);   // the first of the third window
  logs[1].x.col(130).setConstant(NAN);  // within one
  logs[1].x.col(30).setConstant(NAN);   // between two
  const BongoModelFaults found =
      identify(logs, {}, bongoBias(BongoMethod::kIdentify), bongoKeeps({}));
  EXPECT_NEAR(found.inertia_scale, faults.inertia_scale, 0.03);
  EXPECT_NEAR(found.delay, faults.delay, 0.0005);
  EXPECT_NEAR(found.coulomb_friction, faults.coulomb_friction, 0.3);
  EXPECT_NEAR(found.com_offset, faults.com_offset, 0.0005);
  EXPECT_EQ(identify({}, {}, bongoBias(BongoMethod::kIdentify), bongoKeeps({})).delay, 0);
}

TEST(FaultyBongoBoard, FaultsAreLookedForWithinTheirBounds) {
  const auto found = [](const BongoModelFaults& faults) {
    FaultyBongoBoard board({}, faults);
    RunLog log{0.001, MatrixXd(6, 301), MatrixXd(1, 300)};
    board.reset(bongoStart(0.01, -0.01));
    log.x.col(0) = board.state();
    for (int t = 0; t < 300; ++t) {
      log.u(0, t) = 60 * std::sin(0.08 * t);
      board.step(log.u.col(t));
      log.x.col(t + 1) = board.state();
    }
    return identify({log}, {}, bongoBias(BongoMethod::kIdentify),
                    [](const VectorXd&) { return true; });
  };
  EXPECT_NEAR(found({.inertia_scale = 0.3}).inertia_scale, 0.5, 1e-6);
  EXPECT_NEAR(found({.inertia_scale = 2.5}).inertia_scale, 2, 1e-6);
  EXPECT_NEAR(found({.delay = 0.03}).delay, 0.02, 1e-6);
  const double rubbed = found({.coulomb_friction = 30}).coulomb_friction;
  EXPECT_GT(rubbed, 19.1);
  EXPECT_LE(rubbed, 20);
  EXPECT_NEAR(found({.viscous_friction = 40}).viscous_friction, 20, 1e-3);
  EXPECT_NEAR(found({.com_offset = 0.03}).com_offset, 0.02, 1e-6);
  EXPECT_NEAR(found({.com_offset = -0.03}).com_offset, -0.02, 1e-6);
  const BongoModelFaults none = found({});
  EXPECT_NEAR(none.inertia_scale, 1, 1e-3);
  EXPECT_NEAR(none.delay, 0, 1e-5);
  EXPECT_NEAR(none.coulomb_friction, 0, 1e-2);
  EXPECT_NEAR(none.viscous_friction, 0, 1e-2);
  EXPECT_NEAR(none.com_offset, 0, 1e-5);
}

}  // namespace
}  // namespace traceur::bias
