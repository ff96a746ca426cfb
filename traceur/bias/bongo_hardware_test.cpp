#include "traceur/bias/bongo_hardware.h"

#include <gtest/gtest.h>

#include <cmath>

namespace traceur::bias {
namespace {

VectorXd tilted(double ab) {
  VectorXd x = VectorXd::Zero(6);
  x[1] = ab;
  return x;
}

VectorXd torque(double u) {
  return VectorXd::Constant(1, u);
}

/// The differences of angles and of rates, each of the size of the model's own, after a time.
std::pair<double, double> differenceFromModel(const BongoFaults& faults, double seconds, double u) {
  BongoHardware hardware({}, faults);
  BongoBoard model;
  const VectorXd x0 = tilted(0.02);
  hardware.reset(x0);
  model.reset(x0);
  for (int i = 0; i < 1000 * seconds; ++i) {
    hardware.step(torque(u));
    model.step(torque(u));
  }
  const VectorXd d = hardware.trueState() - model.state();
  return {d.head(3).norm() / model.state().head(3).norm(),
          d.tail(3).norm() / model.state().tail(3).norm()};
}

TEST(BongoHardware, FallsAsTheModelDoes) {
  for (const double u : {0.0, 5.0, -5.0}) {
    const auto [angles, rates] = differenceFromModel({}, 0.2, u);
    EXPECT_LT(angles, 0.02) << u;
    EXPECT_LT(rates, 0.02) << u;
  }
  BongoHardware hardware({}, {});
  hardware.reset(tilted(0.02));
  for (int i = 0; i < 200; ++i) hardware.step(torque(0));
  EXPECT_TRUE(hardware.boardOnWheel());
  EXPECT_GT(hardware.boardHeight(), 0);
}

TEST(BongoHardware, TellsWhenTheBoardHasLeftTheWheel) {
  BongoHardware hardware({}, {});
  hardware.reset(tilted(0.02));
  int off = 0;
  for (int i = 0; i < 4000; ++i) {  // thrown about, it falls
    hardware.step(torque(i / 100 % 2 == 0 ? 100 : -100));
    off += !hardware.boardOnWheel();
  }
  EXPECT_GT(off, 0);
  EXPECT_LT(hardware.boardHeight(), 0.05);
}

TEST(BongoHardware, StartsMovingAsItIsTold) {
  VectorXd x(6);
  x << .05, -.03, .04, .5, -.3, .2;
  BongoHardware hardware({}, {});
  hardware.reset(x);
  EXPECT_LT((hardware.trueState() - x).cwiseAbs().maxCoeff(), 1e-6);
  BongoBoard model;
  model.reset(x);
  for (int i = 0; i < 50; ++i) {
    hardware.step(torque(2));
    model.step(torque(2));
  }
  EXPECT_LT((hardware.trueState() - model.state()).head(3).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(BongoHardware, EveryFaultMakesItAnotherMachine) {
  struct After {
    VectorXd truth, reading;
  };
  const auto after = [](const BongoFaults& faults) {
    BongoHardware hardware({}, faults, 3);
    hardware.reset(tilted(0.02));
    for (int i = 0; i < 150; ++i) hardware.step(torque(10 * std::sin(0.1 * i)));
    return After{hardware.trueState(), hardware.state()};
  };
  const VectorXd sound = after({}).truth;
  BongoFaults f;
  const auto differs = [&](const BongoFaults& faults) {
    return (after(faults).truth - sound).norm() > 1e-4;
  };
  EXPECT_FALSE(differs(f));
  f = {}, f.inertia_scale = 1.2;
  EXPECT_TRUE(differs(f));
  f = {}, f.torque_variance = 0.1;
  EXPECT_TRUE(differs(f));
  f = {}, f.delay = 0.005;
  EXPECT_TRUE(differs(f));
  f = {}, f.coulomb_friction = 2;
  EXPECT_TRUE(differs(f));
  f = {}, f.viscous_friction = 5;
  EXPECT_TRUE(differs(f));
  f = {}, f.com_offset = 0.002;
  EXPECT_TRUE(differs(f));
  f = {}, f.torque_gain = 0.8;
  EXPECT_TRUE(differs(f));
  // These change only what is read.
  f = {}, f.angle_variance = 1e-6, f.rate_variance = 1e-3, f.encoder_step = 0.01;
  EXPECT_FALSE(differs(f));
  const VectorXd read = after(f).reading;
  EXPECT_GT((read - sound).norm(), 1e-3);
  const double steps = read[0] / 0.01;
  EXPECT_NEAR(steps, std::round(steps), 1e-9);
}

TEST(BongoHardware, InertiaErrorIsThatOfTheModelsInertia) {
  BongoFaults heavy;
  heavy.inertia_scale = 1.2;
  BongoParameters p;
  p.inertia_scale = 1.2;
  BongoHardware hardware({}, heavy);
  BongoBoard model(p);
  hardware.reset(tilted(0.02));
  model.reset(tilted(0.02));
  for (int i = 0; i < 200; ++i) {
    hardware.step(torque(5));
    model.step(torque(5));
  }
  EXPECT_LT((hardware.trueState() - model.state()).norm(), 0.01 * model.state().norm());
}

TEST(BongoHardware, NoiseHasItsVarianceAndDependsOnSeedAndEpisodeAlone) {
  BongoFaults f;
  f.angle_variance = 4e-6;
  f.rate_variance = 4e-3;
  const auto run = [&](std::uint64_t seed, int episodes) {
    BongoHardware hardware({}, f, seed);
    std::vector<VectorXd> readings;
    for (int e = 0; e < episodes; ++e) {
      readings.clear();
      hardware.reset(tilted(0.01));
      for (int i = 0; i < 100; ++i) {
        hardware.step(torque(0));
        readings.push_back(hardware.state() - hardware.trueState());
      }
    }
    return readings;
  };
  const auto a = run(1, 1);
  EXPECT_EQ(a, run(1, 1));
  EXPECT_NE(a, run(2, 1));
  EXPECT_NE(a, run(1, 2));
  double angles = 0, rates = 0;
  for (const VectorXd& r : a) {
    angles += r.head(3).squaredNorm() / 300;
    rates += r.tail(3).squaredNorm() / 300;
  }
  EXPECT_NEAR(angles / 4e-6, 1, 0.35);
  EXPECT_NEAR(rates / 4e-3, 1, 0.35);
}

}  // namespace
}  // namespace traceur::bias
