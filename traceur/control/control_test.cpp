#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "traceur/control/expression.h"
#include "traceur/control/signals.h"
#include "traceur/control/stable_pd.h"
#include "traceur/control/virtual_force.h"
#include "traceur/core/error.h"

namespace traceur::control {
namespace {

using sim::JointLimit;
using sim::Vector3d;

std::shared_ptr<const sim::Model> bioloid(double time_step = 0.001) {
  static const auto kRobot =
      std::make_shared<const sim::Robot>(sim::Robot::fromFile("models/bioloid-gp/robot.toml"));
  return sim::Model::fromScene({.robot = kRobot, .time_step = time_step});
}

/// Holds the stand pose for a second; returns the largest joint speed in the last tenth.
double holdStill(const std::shared_ptr<const sim::Model>& model, sim::World& world, double kp,
                 double kd) {
  const sim::State start = model->stateOf(model->robot()->poses.at("stand"));
  world.reset(start);
  StablePd pd(model, std::vector<sim::JointGain>(model->joints().size(), {kp, kd}));
  const JointTarget target = targetOf(*model, start);
  sim::Torque command;
  VectorXd tau(model->nv());
  double fastest = 0;
  const int steps = static_cast<int>(std::lround(1 / model->timeStep()));
  for (int i = 0; i < steps; ++i) {
    tau.setZero();
    pd.addTorque(world.snapshot(), target, tau);
    toMotors(*model, tau, command);
    world.step(command);
    if (i > 0.9 * steps) {
      fastest = std::max(fastest, world.snapshot().v().tail(model->nv() - 6).cwiseAbs().maxCoeff());
    }
  }
  return world.diverged() ? INFINITY : fastest;
}

TEST(StablePd, HoldsStiffGainsWithoutRinging) {
  for (const double time_step : {0.001, 0.002}) {
    const auto model = bioloid(time_step);
    sim::World world(model);
    EXPECT_LT(holdStill(model, world, 60, 3), 0.01) << time_step;
    EXPECT_LT(holdStill(model, world, 60, 0.3), 0.01) << time_step;
    EXPECT_LT(holdStill(model, world, 200, 20), 0.01) << time_step;
  }
}

TEST(StablePd, AStandingRobotPressesWithItsWeightUnderItsCom) {
  const auto model = bioloid();
  sim::World world(model);
  holdStill(model, world, 60, 3);
  const sim::Snapshot& s = world.snapshot();
  double fz = 0;
  for (const sim::Contact& c : s.contacts()) {
    fz += model->isStatic(c.body_a) ? c.f_WC.z() : -c.f_WC.z();
  }
  EXPECT_NEAR(fz, model->mass() * 9.81, 1e-3);
  ASSERT_TRUE(s.cop());
  EXPECT_NEAR((*s.cop() - s.com()).head<2>().norm(), 0, 1e-4);
}

/// In flight every force of a step is known before it, so the prediction is what comes about, also
/// where a virtual force asks its share.
TEST(StablePd, PredictsTheAccelerationOfTheStep) {
  const auto robot = bioloid();
  std::string mjcf = robot->mjcf();
  const std::string damping = "damping=\"0.1\"";  // the engine's is implicit, too; a few per cent
  for (size_t at; (at = mjcf.find(damping)) != std::string::npos;) mjcf.erase(at, damping.size());
  const auto model = sim::Model::fromMjcf(mjcf);
  ASSERT_EQ(model->joints().size(), robot->joints().size());
  sim::World world(model);
  sim::State start = robot->stateOf(robot->robot()->poses.at("crouch"));
  start.q[2] += 1;
  start.v.tail(model->nv() - 6).setLinSpaced(-0.6, 0.4);
  world.reset(start);
  constexpr double kp = 60;
  constexpr double kd = 3;
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  StablePd pd(model, std::vector<sim::JointGain>(model->joints().size(), {kp, kd}));
  for (sim::JointLimit& l : pd.limits()) l.torque = l.speed = kNone;
  JointTarget target = targetOf(*model, start);
  target.q[0] += 0.1;
  const sim::Snapshot& s = world.snapshot();
  VectorXd tau = VectorXd::Zero(model->nv());
  VirtualForce{model->body("l_foot"), Vector3d::Zero(), Vector3d(0, 0, -20)}.addTorque(s, tau);
  const VectorXd asked = tau;
  const VectorXd q = s.q();
  const VectorXd v = s.v();
  pd.addTorque(s, target, tau);
  sim::Torque command;
  toMotors(*model, tau, command);
  const double dt = model->timeStep();
  world.step(command);
  for (size_t i = 0; i < model->joints().size(); ++i) {
    const sim::Joint& j = model->joints()[i];
    const double next = world.snapshot().v()[j.v];
    EXPECT_NEAR(tau[j.v] - asked[j.v],
                -kp * (q[j.q] + dt * v[j.v] - target.q[static_cast<Eigen::Index>(i)]) - kd * next,
                1e-6)
        << j.name;
  }
}

TEST(StablePd, NeverAsksMoreThanTheLimit) {
  const auto model = bioloid();
  sim::World world(model);
  world.reset(model->initialState());
  StablePd pd = defaultController(model);
  JointTarget far{VectorXd::Constant(16, 2.0)};
  VectorXd tau = VectorXd::Zero(model->nv());
  pd.addTorque(world.snapshot(), far, tau);
  EXPECT_EQ(tau.head<6>().norm(), 0);
  EXPECT_NEAR(tau.tail(16).cwiseAbs().maxCoeff(), 0.6, 1e-12);
}

TEST(StablePd, ClampsTheSumOrItsOwnPartOnce) {
  const auto model = bioloid();
  sim::World world(model);
  world.reset(model->initialState());
  StablePd pd = defaultController(model);
  const JointTarget far{VectorXd::Constant(16, 2.0)};  // asks for all of 0.6 N·m
  const int d = model->joints()[0].v;
  const auto torque = [&](StablePd::Clamp clamp) {
    VectorXd tau = VectorXd::Zero(model->nv());
    tau[d] = -0.5;
    pd.addTorque(world.snapshot(), far, tau, clamp);
    return tau[d];
  };
  EXPECT_NEAR(torque(StablePd::Clamp::kSum), 0.6, 1e-12);
  EXPECT_NEAR(torque(StablePd::Clamp::kOwn), 0.1, 1e-12);
}

/// Two hinges on a floating trunk; a motor turns the second only.
std::shared_ptr<const sim::Model> halfActuated() {
  return sim::Model::fromMjcf(R"(<mujoco><worldbody><body name="trunk" pos="0 0 2"><freejoint/>
    <geom type="box" size=".1 .1 .1" mass="2"/>
    <body name="a" pos=".2 0 0"><joint name="a" axis="0 1 0"/>
      <geom type="box" size=".1 .05 .05" mass="1"/>
      <body name="b" pos=".2 0 0"><joint name="b" axis="0 1 0"/>
        <geom type="box" size=".1 .05 .05" mass="1"/></body></body></body></worldbody>
    <actuator><position joint="a"/><motor joint="b"/></actuator></mujoco>)");
}

TEST(StablePd, CountsWhatMotorsExertAndNothingElse) {
  const auto model = halfActuated();
  ASSERT_EQ(model->joint("a").motor, -1);
  sim::World world(model);
  world.reset(model->initialState());
  StablePd pd(model, {{0, 0}, {50, 2}});
  const JointTarget target{VectorXd::Constant(2, 0.3)};
  const auto added = [&](const char* joint, double held) {
    VectorXd tau = VectorXd::Zero(model->nv());
    tau[model->joint(joint).v] = held;
    pd.addTorque(world.snapshot(), target, tau);
    return tau[model->joint("b").v] - (joint[0] == 'b' ? held : 0);
  };
  EXPECT_EQ(added("a", 5), added("a", 0));
  EXPECT_LT(added("b", 5), added("b", 0) - 1e-6);  // it helps already

  // Commands of what is no plain motor stay nothing.
  sim::Torque command{VectorXd::Constant(2, 9)};
  toMotors(*model, VectorXd::Constant(model->nv(), 3), command);
  EXPECT_EQ(command.tau, VectorXd(Eigen::Vector2d(0, 3)));
  // Without a robot's file there are no gains.
  StablePd none = defaultController(model);
  ASSERT_EQ(none.gains().size(), 2U);
  for (const sim::JointGain& g : none.gains()) EXPECT_EQ(g.kp + g.kd, 0);
}

TEST(StablePd, LimitsEachJointByItsOwnSpeedAndTorque) {
  const auto model = bioloid();
  sim::World world(model);
  sim::State state = model->initialState();
  state.q[2] += 1;
  for (const sim::Joint& j : model->joints()) state.v[j.v] = j.v % 2 == 0 ? 11.4 : 0;
  world.reset(state);
  StablePd pd = defaultController(model);
  for (size_t i = 0; i < 16; ++i) {
    pd.limits()[i].torque = 0.1 + 0.01 * static_cast<double>(i);
    pd.gains()[i] = {1000, 0.1};
  }
  for (const auto clamp : {StablePd::Clamp::kSum, StablePd::Clamp::kOwn}) {
    VectorXd tau = VectorXd::Zero(model->nv());
    pd.addTorque(world.snapshot(), {VectorXd::Constant(16, 9)}, tau, clamp);
    for (size_t i = 0; i < 16; ++i) {
      const int d = model->joints()[i].v;  // half of it at 19/20 of 12 rad/s
      EXPECT_NEAR(tau[d], (d % 2 == 0 ? 0.5 : 1) * (0.1 + 0.01 * static_cast<double>(i)), 1e-12);
    }
  }
}

TEST(StablePd, ByDefaultHasTheRobotsGainsWhereItSaysThem) {
  sim::Robot robot = sim::Robot::fromFile("models/bioloid-gp/robot.toml");
  robot.gains = {{"l_shin", {7, 0.5}}, {"r_hand", {3, 0.25}}};
  const auto model =
      sim::Model::fromScene({.robot = std::make_shared<const sim::Robot>(std::move(robot))});
  StablePd pd = defaultController(model);
  for (size_t i = 0; i < model->joints().size(); ++i) {
    const std::string& name = model->joints()[i].name;
    EXPECT_EQ(pd.gains()[i].kp, name == "l_shin" ? 7 : name == "r_hand" ? 3 : 0) << name;
    EXPECT_EQ(pd.gains()[i].kd, name == "l_shin" ? 0.5 : name == "r_hand" ? 0.25 : 0) << name;
    EXPECT_EQ(pd.limits()[i].torque, 0.6);
  }
}

TEST(LimitedTorque, IsOddAndFadesOnlyNearTheSpeedLimit) {
  const JointLimit limit{2, 10, -1, 1};
  const JointLimit weak{0.05, 10, -1, 1};
  for (const double side : {1.0, -1.0}) {
    EXPECT_EQ(limitedTorque(5 * side, 5 * side, limit), 2 * side);
    EXPECT_EQ(limitedTorque(5 * side, 8.99 * side, limit), 2 * side);
    EXPECT_NEAR(limitedTorque(5 * side, 9.75 * side, limit), 0.5 * side, 1e-12);
    EXPECT_EQ(limitedTorque(5 * side, 10 * side, limit), 0);
    EXPECT_EQ(limitedTorque(5 * side, -9.75 * side, limit), 2 * side);
    EXPECT_EQ(limitedTorque(0.3 * side, 9.75 * side, limit), 0.3 * side);
    EXPECT_NEAR(limitedTorque(0.06 * side, 9.5 * side, weak), 0.025 * side, 1e-12);
  }
}

TEST(LimitedTorque, ClampsFadesAndNeverReducesBraking) {
  const JointLimit limit{2, 10, -1, 1};
  EXPECT_EQ(limitedTorque(5, 0, limit), 2);
  EXPECT_EQ(limitedTorque(-5, 0, limit), -2);
  EXPECT_EQ(limitedTorque(1.5, 8.9, limit), 1.5);
  EXPECT_NEAR(limitedTorque(5, 9.5, limit), 1, 1e-12);
  EXPECT_EQ(limitedTorque(5, 12, limit), 0);
  EXPECT_EQ(limitedTorque(-5, 12, limit), -2);
  const JointLimit none{INFINITY, INFINITY, -1, 1};
  EXPECT_EQ(limitedTorque(5e9, 1e9, none), 5e9);
  const JointLimit fast{INFINITY, 10, -1, 1};  // a speed limit alone
  EXPECT_EQ(limitedTorque(5, 12, fast), 0);
  EXPECT_EQ(limitedTorque(-5, 12, fast), -5);
}

TEST(ToMotors, DropsTheRootAndOnlyTheRoot) {
  const auto model = bioloid();
  sim::Torque command;
  toMotors(*model, VectorXd::LinSpaced(model->nv(), 0, model->nv() - 1), command);
  ASSERT_EQ(command.tau.size(), 16);
  for (const sim::Joint& j : model->joints()) EXPECT_EQ(command.tau[j.motor], j.v);
}

TEST(VirtualForce, PushesTheRobotUpWhenTheFeetPushDown) {
  const auto model = bioloid();
  sim::World world(model);
  world.reset(model->stateOf(model->robot()->poses.at("crouch")));
  const auto height_after = [&](double force) {
    world.reset(model->stateOf(model->robot()->poses.at("crouch")));
    sim::Torque command;
    VectorXd tau(model->nv());
    for (int i = 0; i < 60; ++i) {
      tau.setZero();
      for (const char* foot : {"l_foot", "r_foot"}) {
        VirtualForce{model->body(foot), Vector3d::Zero(), {0, 0, -force}}.addTorque(
            world.snapshot(), tau);
      }
      toMotors(*model, tau, command);
      world.step(command);
    }
    return world.snapshot().com().z();
  };
  EXPECT_GT(height_after(30), height_after(0) + 0.01);
}

TEST(Expression, ComputesWithNamesThatHoldDots) {
  double x = 3;
  double v = -1;
  const Expression e("2 * com.x + abs(com_velocity.x) - pi * 0",
                     [&](const std::string& name) { return name == "com.x" ? &x : &v; });
  EXPECT_EQ(e.value(), 7);
  x = 4;
  EXPECT_EQ(e.value(), 9);
  const Expression both("com.x > 3 && com_velocity.x < 0",
                        [&](const std::string& name) { return name == "com.x" ? &x : &v; });
  EXPECT_TRUE(both.holds());
  v = NAN;
  EXPECT_FALSE(both.holds());
  const Expression bare("com_velocity.x", [&](const std::string&) { return &v; });
  EXPECT_FALSE(bare.holds());
  v = 2;
  EXPECT_TRUE(bare.holds());
}

TEST(Expression, RefusesWhatItCannotMean) {
  const auto lookup = [](const std::string&) -> const double* { return nullptr; };
  const auto message = [&](const std::string& text) -> std::string {
    try {
      Expression e(text, lookup);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(message("x + 1").find("nothing is named \"x\""), std::string::npos);
  for (const char* assigns : {"time = 3", "=3", "time =", "1 + time =3"}) {
    EXPECT_NE(message(assigns).find("did you mean '=='"), std::string::npos) << assigns;
  }
  EXPECT_NE(message("1 > 0,5").find("expected one value, got 2"), std::string::npos);
  EXPECT_EQ(message("max(1, 2)"), "accepted");
  std::string endless = "0";  // longer than muParser takes
  while (endless.size() < 30000) endless += " + 0";
  EXPECT_NE(message(endless), "accepted");
  for (const char* bad : {"1 +", "(2", "2 2", "", "foo(3)", "* 3"}) {
    EXPECT_NE(message(bad), "accepted") << bad;
  }
  EXPECT_EQ(message("1 <= 2"), "accepted");
}

TEST(Expression, ComplaintsEndWithTheirLastWord) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      Expression::namesIn(text);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  for (const char* bad : {"1 +", "(2", "2 2", "foo(3)", "* 3", "", "1 +\n"}) {
    const std::string said = message(bad);
    EXPECT_TRUE(said.starts_with(std::string("\"") + bad + "\": ")) << said;
    EXPECT_EQ(said.find_last_not_of(" \n"), said.size() - 1) << said;
  }
  EXPECT_EQ(message("1" + std::string(9'999, ' ')), "accepted");
  EXPECT_EQ(message("1" + std::string(10'000, ' ')),
            "an expression of 10001 characters: expected at most 10000");
  for (const char* compares : {"a==1", "1<=a", "a>=1", "a!=1", "a<1"}) {
    EXPECT_EQ(message(compares), "accepted") << compares;
  }
}

TEST(Expression, HoldsWhereItIsNeitherZeroNorNoNumber) {
  for (const auto& [value, holds] : {std::pair(0.0, false),
                                     {-0.0, false},
                                     {NAN, false},
                                     {1e-300, true},
                                     {-2.0, true},
                                     {INFINITY, true}}) {
    EXPECT_EQ(Expression(value).holds(), holds) << value;
  }
}

TEST(Expression, ANameIsWhatMayBeLookedUp) {
  for (const char* name : {"x", "com.x", "_a", "a2", "A.b_c", "joint.l_hip"}) {
    EXPECT_TRUE(Expression::isName(name)) << name;
  }
  for (const char* name :
       {"", "2x", "0a", "9", ".a", "a b", "a-b", "a,b", "ü", "max", "atan2", "pi"}) {
    EXPECT_FALSE(Expression::isName(name)) << name;
  }
  EXPECT_EQ(Expression::namesIn("b.z * max(a, 2) - pi + b.z"),
            std::vector<std::string>({"a", "b.z"}));
}

TEST(Expression, KnowsItsFunctionsAndConstants) {
  const auto value = [](const std::string& text) {
    return Expression(text, [](const std::string&) -> const double* { return nullptr; }).value();
  };
  EXPECT_EQ(value("pi"), M_PI);
  EXPECT_EQ(value("atan2(-1, 2)"), std::atan2(-1, 2));
  EXPECT_EQ(value("2 == 2"), 1);
  EXPECT_EQ(value("2 != 2"), 0);
  EXPECT_EQ(value("1 >= 2"), 0);
  EXPECT_EQ(Expression(2.5).value(), 2.5);
}

TEST(Signals, ReadWhatTheSnapshotSays) {
  const auto model = bioloid();
  sim::World world(model);
  sim::State s = model->stateOf(model->robot()->poses.at("stand"));
  s.v[2] = -0.1;
  world.reset(s);
  for (int i = 0; i < 3; ++i) world.step({VectorXd::Zero(16)});
  Signals signals(model);
  const double* com = signals.find("com.z");
  const double* vx = signals.find("com_velocity.x");
  const double* feet = signals.find("contact.feet");
  const double* any = signals.find("contact.robot");
  const double* force = signals.find("contact_force.feet");
  const double* knee = signals.find("joint.l_shin");
  const double* torso = signals.find("body.torso.z");
  const double* pitch = signals.find("root.pitch");
  ASSERT_TRUE(com && vx && feet && any && force && knee && torso && pitch);
  EXPECT_EQ(signals.find("com.z"), com);
  signals.update(world.snapshot());
  EXPECT_EQ(*com, world.snapshot().com().z());
  EXPECT_NEAR(*vx, world.snapshot().comVelocity().x(), 1e-12);
  EXPECT_GT(*feet, 0);
  EXPECT_EQ(*any, *feet);
  EXPECT_GT(*force, 0);
  EXPECT_NEAR(*knee, -0.2, 1e-2);
  EXPECT_EQ(*torso, world.snapshot().bodyPosition(model->root()).z());
  EXPECT_NEAR(*pitch, 0, 1e-2);
}

TEST(Signals, HaveUnits) {
  const Signals signals(bioloid());
  const std::pair<const char*, const char*> units[] = {{"time", "s"},
                                                       {"com.z", "m"},
                                                       {"com_velocity.x", "m/s"},
                                                       {"angular_momentum.y", "kg·m²/s"},
                                                       {"cop.x", "m"},
                                                       {"root.pitch", "rad"},
                                                       {"body.torso.z", "m"},
                                                       {"body_velocity.torso.z", "m/s"},
                                                       {"joint.l_shin", "rad"},
                                                       {"joint_velocity.l_shin", "rad/s"},
                                                       {"contact.feet", ""},
                                                       {"contact_force.feet", "N"},
                                                       {"impulse.feet", "N·s"},
                                                       {"torque.l_shin", "N·m"},
                                                       {"joint.thigh", "rad"},
                                                       {"point.left_toe.x", "m"},
                                                       {"attitude.torso.yaw", "rad"},
                                                       {"body.tail.z", ""},
                                                       {"2 * com.z", ""}};
  for (const auto& [name, unit] : units) EXPECT_EQ(signals.unitOf(name), unit) << name;
}

TEST(Signals, OfARobotInFlightAreWhatTheirNamesSay) {
  const auto model = bioloid();
  const double angles[] = {0.4, -0.7, 1.1};  // roll, pitch, yaw
  const Eigen::Quaterniond attitude = Eigen::AngleAxisd(angles[2], Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(angles[1], Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(angles[0], Vector3d::UnitX());
  sim::State state = model->initialState();
  state.q[2] += 5;
  state.q.segment<4>(3) << attitude.w(), attitude.x(), attitude.y(), attitude.z();
  for (const sim::Joint& j : model->joints()) state.q[j.q] = 0.01 * j.v;
  state.v = VectorXd::LinSpaced(model->nv(), -1, 2);
  sim::World world(model);
  world.reset(state);
  Signals signals(model);
  const auto read = [&](const std::string& name) {
    const double* value = signals.find(name);
    signals.update(world.snapshot());
    return value ? *value : NAN;
  };
  EXPECT_NEAR(read("root.roll"), angles[0], 1e-12);
  EXPECT_NEAR(read("root.pitch"), angles[1], 1e-12);
  EXPECT_NEAR(read("root.yaw"), angles[2], 1e-12);
  for (const sim::Joint& j : model->joints()) {
    EXPECT_EQ(read("joint." + j.name), state.q[j.q]) << j.name;
    EXPECT_EQ(read("joint_velocity." + j.name), state.v[j.v]) << j.name;
  }
  const sim::Snapshot& s = world.snapshot();
  const sim::BodyId hand = model->body("l_hand");
  const Vector3d p0 = s.bodyPosition(hand);
  const Vector3d v0 = s.bodyVelocity(hand);
  for (int axis = 0; axis < 3; ++axis) {
    const std::string part = std::string(".") + "xyz"[axis];
    EXPECT_EQ(read("com" + part), s.com()[axis]);
    EXPECT_EQ(read("com_velocity" + part), s.comVelocity()[axis]);
    EXPECT_EQ(read("angular_momentum" + part), s.angularMomentum()[axis]);
    EXPECT_EQ(read("body.l_hand" + part), p0[axis]);
    EXPECT_EQ(read("body_velocity.l_hand" + part), v0[axis]);
    EXPECT_TRUE(std::isnan(read("cop" + part)));
  }
  // A velocity is how a position changes.
  for (int i = 0; i < 3; ++i) world.step({VectorXd::Zero(model->nu())});
  EXPECT_NEAR(read("time"), 0.003, 1e-12);
  const Vector3d mean = (s.bodyPosition(hand) - p0) / s.time();
  EXPECT_LT((mean - v0).norm(), 0.05 * v0.norm());
}

TEST(Signals, CountSomersaultsOnThroughWholeTurns) {
  const auto model = bioloid();
  sim::World world(model);
  Signals signals(model);
  const double* turned = signals.find("somersault.root");
  const double* headed = signals.find("heading.root");
  const double* tilt = signals.find("tilt.root");
  const double* ahead = signals.find("com_velocity.forward");
  const double* left = signals.find("com_velocity.left");
  const double* spin = signals.find("spin.y");
  ASSERT_TRUE(turned && headed && tilt && ahead && left && spin);
  EXPECT_FALSE(signals.find("com.up"));
  EXPECT_FALSE(signals.find("cop_velocity.forward"));
  signals.begin();
  for (int k = 0; k <= 20; ++k) {
    sim::Pose pose;
    pose.root_rpy = {0, 0.5 * k, 0};
    sim::State state = model->stateOf(pose);
    world.reset(state);
    signals.update(world.snapshot());
    EXPECT_NEAR(*turned, 0.5 * k, 1e-9);
    EXPECT_NEAR(*headed, 0, 1e-9);
  }
  signals.begin();  // nothing is remembered
  signals.update(world.snapshot());
  EXPECT_NEAR(*turned, 10 - 4 * std::numbers::pi, 1e-9);
  sim::Pose pose;
  pose.root_rpy = {-0.2, 0, std::numbers::pi / 2};
  const sim::State state = model->launched(model->stateOf(pose), 1, {0.3, 2, 0}, {0.1, 0.7, -0.2});
  world.reset(state);
  signals.begin();
  signals.update(world.snapshot());
  EXPECT_NEAR(*tilt, 0.2, 1e-9);
  EXPECT_NEAR(*headed, std::numbers::pi / 2, 1e-9);
  EXPECT_NEAR(*ahead, 2, 1e-9);
  EXPECT_NEAR(*left, -0.3, 1e-9);
  EXPECT_NEAR(*spin, 0.7, 1e-9);
}

TEST(Signals, ContactForcesBearTheWeightOfWhatStands) {
  const auto model = bioloid();
  sim::World world(model);
  holdStill(model, world, 60, 3);
  Signals signals(model);
  const auto read = [&](const std::string& name) {
    const double* value = signals.find(name);
    signals.update(world.snapshot());
    return value ? *value : NAN;
  };
  const double weight = model->mass() * 9.81;
  EXPECT_NEAR(read("contact_force.robot"), weight, 1e-3);
  EXPECT_NEAR(read("contact_force.feet"), weight, 1e-3);
  EXPECT_NEAR(read("contact_force.l_foot") + read("contact_force.r_foot"), weight, 1e-3);
  EXPECT_GT(read("contact_force.l_foot"), weight / 4);
  EXPECT_EQ(read("contact_force.l_hand"), 0);
  const auto points = static_cast<double>(world.snapshot().contacts().size());
  EXPECT_EQ(read("contact.robot"), points);
  EXPECT_EQ(read("contact.l_foot") + read("contact.r_foot"), points);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(read(std::string("cop.") + "xyz"[axis]), (*world.snapshot().cop())[axis]);
  }
}

TEST(Signals, ContactsInsideTheRobotDoNotCount) {
  const auto model = bioloid();
  sim::World world(model);
  sim::State s = model->stateOf({});
  s.q[2] += 1;  // in the air, one shin through the other
  s.q[model->joint("l_hip").q] = 1.2;
  s.q[model->joint("r_hip").q] = -1.2;
  world.reset(s);
  world.step({VectorXd::Zero(16)});
  ASSERT_FALSE(world.snapshot().contacts().empty());
  ASSERT_FALSE(world.snapshot().touchesWorld());
  Signals signals(model);
  const double* feet = signals.find("contact.feet");
  const double* force = signals.find("contact_force.feet");
  std::vector<const double*> bodies;
  for (int b = 1; b < model->bodies(); ++b) {
    bodies.push_back(signals.find("contact." + model->bodyName({b})));
  }
  signals.update(world.snapshot());
  EXPECT_EQ(*feet, 0);
  EXPECT_EQ(*force, 0);
  for (const double* n : bodies) EXPECT_EQ(*n, 0);
}

TEST(Signals, APropsContactsWithTheRobotCount) {
  const auto robot =
      std::make_shared<const sim::Robot>(sim::Robot::fromFile("models/bioloid-gp/robot.toml"));
  sim::Prop ball{.name = "ball", .shape = sim::Prop::Shape::kBall, .mass = 0.1};
  ball.size.setConstant(0.05);
  ball.position = {0.12, 0, 0.2};
  const auto model = sim::Model::fromScene({.robot = robot, .ground = false, .props = {ball}});
  sim::World world(model);
  sim::State s = model->stateOf(robot->poses.at("stand"));
  s.v.tail(6)[0] = -3;
  world.reset(s);
  Signals signals(model);
  const double* touched = signals.find("contact.ball");
  const double* robots = signals.find("contact.robot");
  double most = 0;
  for (int i = 0; i < 100; ++i) {
    world.step({VectorXd::Zero(16)});
    signals.update(world.snapshot());
    EXPECT_EQ(*touched, *robots);
    most = std::max(most, *touched);
  }
  EXPECT_GT(most, 0);
}

TEST(Signals, AForceOnABodyIsWhatTheOthersExert) {
  const auto model = sim::Model::fromMjcf(R"(<mujoco><worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="lower" pos="0 0 .1"><freejoint/>
      <geom type="box" size=".2 .2 .1" mass="3"/></body>
    <body name="upper" pos="0 0 .3"><freejoint/>
      <geom type="box" size=".1 .1 .1" mass="2"/></body></worldbody></mujoco>)");
  sim::World world(model);
  for (int i = 0; i < 2000; ++i) world.step({VectorXd(0)});
  Signals signals(model);
  const auto read = [&](const std::string& name) {
    const double* value = signals.find(name);
    signals.update(world.snapshot());
    return value ? *value : NAN;
  };
  // What the ground bears and what lies on it.
  EXPECT_NEAR(read("contact_force.lower"), 3 * 9.81, 1e-2);
  EXPECT_NEAR(read("contact_force.upper"), 2 * 9.81, 1e-2);
  EXPECT_NEAR(read("contact_force.world"), -5 * 9.81, 1e-2);
  EXPECT_EQ(read("contact.lower"), 8);
  EXPECT_EQ(read("contact.upper"), 4);
  EXPECT_EQ(read("contact.robot"), 8);  // the first that floats
}

TEST(Signals, OffersTheNamesOfAllItKnows) {
  const auto model = bioloid();
  const std::vector<std::string> names = Signals(model).names();
  for (const sim::BodyId body : {sim::BodyId{1}, sim::BodyId{model->bodies() - 1}}) {
    const std::string name = model->bodyName(body);
    for (const std::string& signal :
         {"contact." + name, "contact_force." + name, "impulse." + name, "body." + name + ".x",
          "body_velocity." + name + ".z", "body_com." + name + ".y", "attitude." + name + ".yaw"}) {
      EXPECT_NE(std::find(names.begin(), names.end(), signal), names.end()) << signal;
    }
  }
  for (const char* signal : {"support.margin", "linear_momentum.y", "joint.thigh", "torque.l_shin",
                             "power.robot", "joint_force.r_heel", "point.left_toe.z",
                             "point_velocity.head.x", "body.feet.x", "contact.robot"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), signal), names.end()) << signal;
  }
}

TEST(Signals, OffersNamesAsExpressionsSpellThem) {
  Signals signals(sim::Model::fromMjcf(R"(<mujoco><worldbody><body name="left-foot"><freejoint/>
    <geom size=".1"/><body name="right_foot"><joint name="an ankle"/><geom size=".1"/></body>
    </body></worldbody></mujoco>)"));
  const std::vector<std::string> names = signals.names();
  const auto has = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  EXPECT_TRUE(has("body.right_foot.z"));
  EXPECT_TRUE(has("body.'left-foot'.z"));
  EXPECT_TRUE(has("joint.'an ankle'"));
  for (const std::string& name : names) {
    EXPECT_EQ(Expression::namesIn(name).size(), 1U) << name;
    EXPECT_NO_THROW(Expression(name, [&](const std::string& n) { return signals.find(n); }))
        << name;
  }
}

TEST(Expression, QuotesNameWhatIsNoName) {
  const double five = 5;
  const auto lookup = [&](const std::string& name) {
    return name == "joint.hip-l" ? &five : nullptr;
  };
  EXPECT_EQ(Expression("2 * joint.'hip-l' + 1", lookup).value(), 11);
  EXPECT_EQ(Expression("'joint.hip-l' - joint.'hip-l'", lookup).value(), 0);
  EXPECT_EQ(Expression::namesIn("a + b.'c d'.x"), (std::vector<std::string>{"a", "b.c d.x"}));
  EXPECT_EQ(Expression::spelled("joint.hip-l"), "joint.'hip-l'");
  EXPECT_EQ(Expression::spelled("joint.hip"), "joint.hip");
  EXPECT_THROW(Expression("joint.'hip", lookup), InputError);
  try {
    const Expression wrong("joint.'hip-r'", lookup);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("joint.hip-r"), std::string::npos) << e.what();
  }
}

TEST(Signals, TellWhatTheyAreDefinedAs) {
  const auto model = bioloid();
  sim::World world(model);
  world.watchJointForces(true);
  sim::State state = model->stateOf(model->robot()->poses.at("stand"));
  state.q[2] += 0.01;
  for (double& v : state.v) v = 0.1;
  Signals signals(model);
  EXPECT_FALSE(signals.readsJointForces());
  std::map<std::string, const double*> at;
  for (const char* name :
       {"linear_momentum.x", "body.feet.y", "body_com.torso.x", "body_velocity.feet.z",
        "attitude.l_foot.pitch", "point.left_toe.x", "point_velocity.left_toe.x", "joint.thigh",
        "joint.hip", "joint_velocity.hip", "joint_force.l_heel", "torque.l_shin", "power.l_shin",
        "power.robot", "support.margin", "support.x", "impulse.feet", "contact_force.feet"}) {
    at[name] = signals.find(name);
    ASSERT_TRUE(at[name]) << name;
  }
  EXPECT_TRUE(signals.readsJointForces());
  world.reset(state);
  signals.begin();
  signals.update(world.snapshot());
  EXPECT_TRUE(std::isnan(*at["support.margin"]));  // in the air
  EXPECT_TRUE(std::isnan(*at["support.x"]));
  StablePd pd = defaultController(model);
  const JointTarget target = targetOf(*model, state);
  VectorXd tau(model->nv());
  sim::Torque command;
  std::vector<double> forces;
  for (int i = 0; i < 700; ++i) {
    tau.setZero();
    pd.addTorque(world.snapshot(), target, tau);
    toMotors(*model, tau, command);
    world.step(command);
    signals.update(world.snapshot());
    forces.push_back(*at["contact_force.feet"]);
  }
  const sim::Snapshot& s = world.snapshot();
  const auto body = [&](const char* name) { return model->body(name); };
  const auto joint = [&](const char* name) { return model->joint(name); };
  EXPECT_EQ(*at["linear_momentum.x"], s.linearMomentum().x());
  EXPECT_EQ(*at["body.feet.y"],
            (s.bodyPosition(body("l_foot")).y() + s.bodyPosition(body("r_foot")).y()) / 2);
  EXPECT_EQ(*at["body_com.torso.x"], s.bodyCom(body("torso")).x());
  EXPECT_EQ(*at["body_velocity.feet.z"],
            (s.bodyVelocity(body("l_foot")).z() + s.bodyVelocity(body("r_foot")).z()) / 2);
  const Eigen::Matrix3d R = s.bodyRotation(body("l_foot"));
  EXPECT_NEAR(std::sin(*at["attitude.l_foot.pitch"]), -R(2, 0), 1e-12);
  EXPECT_EQ(*at["point.left_toe.x"], s.position(model->contactPoint("left_toe")).x());
  EXPECT_EQ(*at["point_velocity.left_toe.x"], s.velocity(model->contactPoint("left_toe")).x());
  EXPECT_EQ(*at["joint.thigh"], (s.q()[joint("l_thigh").q] + s.q()[joint("r_thigh").q]) / 2);
  EXPECT_EQ(*at["joint.hip"], (s.q()[joint("l_hip").q] - s.q()[joint("r_hip").q]) / 2);
  EXPECT_EQ(*at["joint_velocity.hip"], (s.v()[joint("l_hip").v] - s.v()[joint("r_hip").v]) / 2);
  EXPECT_EQ(*at["joint_force.l_heel"], s.jointForces().col(joint("l_heel").body.value).norm());
  EXPECT_GT(*at["joint_force.l_heel"], 3);
  const sim::Joint shin = joint("l_shin");
  EXPECT_EQ(*at["torque.l_shin"], command.tau[shin.motor]);
  EXPECT_EQ(*at["power.l_shin"], command.tau[shin.motor] * s.v()[shin.v]);
  double power = 0;
  for (const sim::Joint& j : model->joints()) {
    power += std::abs(command.tau[j.motor] * s.v()[j.v]);
  }
  EXPECT_NEAR(*at["power.robot"], power, 1e-15);
  double impulse = 0;
  for (size_t i = forces.size() - 10; i < forces.size(); ++i) impulse += 0.001 * forces[i];
  EXPECT_NEAR(*at["impulse.feet"], impulse, 1e-12);
  EXPECT_NEAR(impulse, 0.01 * model->mass() * 9.81, 0.02);  // it stands
  // Under the middle of the soles, of 97 mm each and some 60 mm apart.
  EXPECT_GT(*at["support.margin"], 0.02);
  EXPECT_LT(*at["support.margin"], 0.05);
  EXPECT_NEAR(*at["support.x"], *at["body.feet.y"] + s.cop()->x(), 0.02);
  signals.begin();
  signals.update(s);
  EXPECT_NEAR(*at["impulse.feet"], 0.001 * forces.back(), 1e-12);
}

TEST(Signals, TheMarginIsTheDistanceToTheNearestEdgeAndNegativeOutside) {
  // A box of 0.4 m by 0.2 m whose COM is 0.05 m from one of its long edges.
  const auto margin = [](double y) {
    const auto model = sim::Model::fromMjcf(fmt::format(
        R"(<mujoco><option timestep="0.001"/><worldbody><geom type="plane" size="1 1 1"/>
        <body name="box" pos="0 0 0.099"><freejoint/>
        <inertial pos="0 {} -0.09" mass="1" diaginertia="1 1 1"/>
        <geom type="box" size="0.2 0.1 0.1"/></body></worldbody></mujoco>)",
        y));
    sim::World world(model);
    Signals signals(model);
    const double* value = signals.find("support.margin");
    for (int i = 0; i < 30; ++i) world.step({VectorXd::Zero(0)});
    signals.update(world.snapshot());
    return *value;
  };
  EXPECT_NEAR(margin(0.05), 0.05, 2e-3);
  EXPECT_NEAR(margin(-0.02), 0.08, 2e-3);
  EXPECT_NEAR(margin(0.13), -0.03, 4e-3);
}

TEST(VirtualForce, WithItsReactionGivesTheRobotAsAWholeNothing) {
  const auto model = bioloid();
  sim::World world(model);
  world.reset(model->stateOf(model->robot()->poses.at("crouch")));
  const sim::Snapshot& s = world.snapshot();
  const std::vector<sim::BodyId> feet = {model->body("l_foot"), model->body("r_foot")};
  VirtualForce at_com;
  at_com.at_com = true;
  at_com.f = {3, -2, 8};
  for (const VirtualForce& force : {at_com, VirtualForce{.body = model->body("l_hand"),
                                            .p_BP = {0.05, 0, 0.01},
                                            .f = {1, 4, -2},
                                            .at_com = false,
                                            .moment = {0.1, -0.4, 0.2}}}) {
    VectorXd alone = VectorXd::Zero(model->nv());
    force.addTorque(s, alone);
    EXPECT_GT(alone.head<6>().norm(), 1);
    VectorXd both = alone;
    const std::vector<VirtualForce> against = reaction(s, force, feet);
    ASSERT_EQ(against.size(), 2U);
    for (const VirtualForce& r : against) r.addTorque(s, both);
    EXPECT_LT(both.head<6>().norm(), 1e-12);
    EXPECT_GT(both.tail(model->nv() - 6).norm(), 0.01);
  }
  EXPECT_TRUE(reaction(s, at_com, {}).empty());
}

TEST(Signals, EveryNameItOffersExistsAndOthersDoNot) {
  Signals signals(bioloid());
  for (const std::string& name : signals.names()) EXPECT_TRUE(signals.find(name)) << name;
  for (const char* name : {"com", "com.w", "com.{", "com_x", ".x", "contact.nose", "joint.knee",
                           "support.z", "point.toe.x", "attitude.nose.yaw", "torque.thigh",
                           "impulse.nose", "body.torso", "speed"}) {
    EXPECT_FALSE(signals.find(name)) << name;
  }
}

}  // namespace
}  // namespace traceur::control
