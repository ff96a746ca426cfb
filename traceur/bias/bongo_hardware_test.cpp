#include "traceur/bias/bongo_hardware.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/bias/faulty_bongo_board.h"
#include "traceur/bias/test_states.h"
#include "traceur/core/random.h"

namespace traceur::bias {
namespace {

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
  EXPECT_FALSE(hardware.boardOnWheel());  // but on the ground
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

/// Each part made large in turn, so that its share of the motion is.
TEST(BongoHardware, EveryPartWeighsWhatTheModelSays) {
  const auto with = [](auto change) {
    BongoParameters p;
    change(p);
    return p;
  };
  const BongoParameters boards[] = {
      with([](auto& p) { p.wheel_density = 2e4; }),
      with([](auto& p) { p.board_mass = 40, p.board_length = 1; }),
      with([](auto& p) { p.leg_mass = 60; }),
      with([](auto& p) { p.leg_mass = 60, p.pelvis_mass = 1, p.leg_length = 0.7; }),
      with([](auto& p) { p.pelvis_length = 0.4, p.pelvis_mass = 30; }),
      with([](auto& p) { p.thickness = 0.2, p.board_length = 0.3, p.board_mass = 60; })};
  for (const BongoParameters& p : boards) {
    BongoHardware hardware(p, {});
    BongoBoard model(p);
    hardware.reset(tilted(0.02));
    model.reset(tilted(0.02));
    for (int i = 0; i < 150; ++i) {
      hardware.step(torque(10));
      model.step(torque(10));
    }
    const VectorXd d = hardware.trueState() - model.state();
    EXPECT_LT(d.norm(), 0.01 * model.state().norm()) << &p - boards;
  }
}

TEST(BongoHardware, EveryFaultThatTheModelHasIsAsLargeThere) {
  struct Case {
    BongoFaults faults;
    BongoModelFaults model;
  };
  const Case cases[] = {{{.delay = 0.02}, {.delay = 0.02}},
                        {{.coulomb_friction = 8}, {.coulomb_friction = 8}},
                        {{.viscous_friction = 20}, {.viscous_friction = 20}},
                        {{.com_offset = 0.01}, {.com_offset = 0.01}},
                        {{.com_offset = 0.06}, {.com_offset = 0.06}}};
  for (const Case& c : cases) {
    const bool heavy =
        c.faults.com_offset > 0.05;  // its inertia counts, which the model leaves out
    BongoHardware hardware({}, c.faults);
    FaultyBongoBoard model({}, c.model);
    BongoBoard faultless;
    for (Plant* plant : std::initializer_list<Plant*>{&hardware, &model, &faultless}) {
      plant->reset(tilted(0.02));
      for (int i = 0; i < (heavy ? 60 : 100); ++i)
        plant->step(torque(i < 50 ? 10 : -5));  // no falls
    }
    const double fault = (model.state() - faultless.state()).norm();
    const double missed = (hardware.trueState() - model.state()).norm();
    EXPECT_LT(missed, (heavy ? 0.4 : 0.05) * fault) << &c - cases;
  }
}

TEST(BongoHardware, ReadsAndActsThroughItsFaults) {
  const VectorXd x0 = tilted(0.02);
  BongoHardware sound({}, {});
  BongoHardware weak({}, {.torque_gain = 0.5});
  BongoHardware late({}, {.delay = 0.003});
  const auto begin = [&](BongoHardware& hardware) {
    hardware.reset(x0);
    for (int i = 0; i < 3; ++i) hardware.step(torque(0));
  };
  for (int episode = 0; episode < 2; ++episode) {  // of the first, nothing is left in the second
    begin(sound);
    late.reset(x0);
    for (int i = 0; i < 3; ++i) late.step(torque(40 + i));
    EXPECT_EQ(late.trueState(), sound.trueState());
    for (int i = 0; i < 3; ++i) {
      sound.step(torque(40 + i));
      late.step(torque(90));
    }
    EXPECT_EQ(late.trueState(), sound.trueState());
  }
  begin(sound);
  begin(weak);
  sound.step(torque(20));
  weak.step(torque(40));
  EXPECT_EQ(weak.trueState(), sound.trueState());

  BongoHardware coarse({}, {.encoder_step = 0.01});
  VectorXd moving(6);
  moving << .053, -.0312, .0446, .5, -.3, .2;
  coarse.reset(moving);
  const VectorXd d = coarse.state() - coarse.trueState();
  for (int i = 0; i < 3; ++i) {
    const double steps = coarse.state()[i] / 0.01;
    EXPECT_NEAR(steps, std::round(steps), 1e-9) << i;
    EXPECT_LE(std::abs(d[i]), 0.005 + 1e-12);
    EXPECT_GT(std::abs(d[i]), 0);
  }
  EXPECT_EQ(d.tail(3), VectorXd(VectorXd::Zero(3)));
}

/// What a seed gave once it gives for ever: noise is of (seed, episode, step), the readings' and
/// the torque's of two streams.
TEST(BongoHardware, NoiseOfASeedStaysWhatItIs) {
  static constexpr std::uint64_t kSeed = 9;
  BongoHardware sound({}, {});
  BongoHardware pushed({}, {.torque_variance = 4}, kSeed);
  BongoHardware blurred({}, {.rate_variance = 0.25}, kSeed);
  BongoHardware all({}, {.angle_variance = 0.01, .rate_variance = 0.25}, kSeed);
  for (std::uint64_t episode = 1; episode <= 2; ++episode) {
    for (BongoHardware* hardware : {&sound, &pushed, &blurred, &all}) hardware->reset(tilted(0.02));
    for (std::uint64_t step = 0; step < 3; ++step) {
      Random of_rates(kSeed, episode, 2 * step);
      Random of_all(kSeed, episode, 2 * step);
      for (int i = 0; i < 6; ++i) {
        const VectorXd& truth = blurred.trueState();
        EXPECT_EQ(blurred.state()[i], truth[i] + (i < 3 ? 0 : 0.5 * of_rates.normal())) << i;
        EXPECT_EQ(all.state()[i], truth[i] + (i < 3 ? 0.1 : 0.5) * of_all.normal()) << i;
      }
      Random of_torque(kSeed, episode, 2 * step + 1);
      sound.step(torque(5 + 2 * of_torque.normal()));
      pushed.step(torque(5));
      blurred.step(torque(5));
      all.step(torque(5));
      EXPECT_EQ(pushed.trueState(), sound.trueState());
    }
  }
}

TEST(BongoHardware, StandsOnItsWheelByAGapAndStandsUprightFromTheFirst) {
  for (const double tilt : {0.2, -0.2}) {
    BongoHardware hardware({}, {});
    hardware.reset(tilted(tilt));
    EXPECT_NEAR(hardware.boardHeight(), boardHeight({}, tilted(tilt)) + 2e-4, 1e-6);  // two gaps
    EXPECT_FALSE(hardware.boardOnWheel());  // they have not touched yet
  }
  BongoHardware hardware({}, {}, 1, 0.002);  // no reset
  EXPECT_EQ(hardware.timeStep(), 0.002);
  for (int i = 0; i < 25; ++i) hardware.step(torque(0));
  EXPECT_LT(hardware.trueState().norm(), 1e-3);
  EXPECT_NEAR(hardware.boardHeight(), 0.1, 3e-4);
  EXPECT_TRUE(hardware.boardOnWheel());
  BongoBoard model({}, 0.002);
  hardware.reset(tilted(0.02));
  model.reset(tilted(0.02));
  for (int i = 0; i < 75; ++i) {
    hardware.step(torque(5));
    model.step(torque(5));
  }
  EXPECT_LT((hardware.trueState() - model.state()).norm(), 0.03 * model.state().norm());
}

TEST(BongoHardware, SlipsWhereThereIsNoFriction) {
  const auto after = [](const BongoFaults& faults) {
    BongoHardware hardware({}, faults);
    hardware.reset(tilted(0.02));
    for (int i = 0; i < 100; ++i) hardware.step(torque(20));
    return VectorXd(hardware.trueState());
  };
  const VectorXd rolled = after({});
  for (const double enough : {0.4, 0.9}) {
    EXPECT_LT((after({.ground_friction = enough, .board_friction = enough}) - rolled).norm(), 1e-3);
  }
  EXPECT_GT((after({.ground_friction = 0.02}) - rolled).norm(), 0.05 * rolled.norm());
  EXPECT_GT((after({.board_friction = 0.02}) - rolled).norm(), 0.05 * rolled.norm());
}

}  // namespace
}  // namespace traceur::bias
