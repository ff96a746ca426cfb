// The simulator held against analytic truth.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

#include "traceur/core/random.h"
#include "traceur/core/sanitized.h"
#include "traceur/core/test_folder.h"
#include "traceur/sim/recording.h"
#include "traceur/sim/world.h"

namespace traceur::sim {
namespace {

constexpr double kG = 9.81;

std::shared_ptr<const Robot> bioloid() {
  static const auto kRobot =
      std::make_shared<const Robot>(Robot::fromFile("models/bioloid-gp/robot.toml"));
  return kRobot;
}

Torque none(const Model& model) {
  return {VectorXd::Zero(model.nu())};
}

/// A robot thrown into the air, all joints moving.
State thrown(const Model& model) {
  Random random(7);
  State s = model.initialState();
  for (const Joint& j : model.joints()) s.q[j.q] += random.uniform(-0.3, 0.3);
  for (double& v : s.v) v = random.uniform(-1, 1);
  s.q[2] += 5;
  return s;
}

std::shared_ptr<const Model> inSpace(double time_step, double gravity) {
  Scene scene{.robot = bioloid(), .ground = false, .time_step = time_step};
  scene.gravity = {0, 0, -gravity};
  return Model::fromScene(scene);
}

std::shared_ptr<const Model> onGround(std::vector<Prop> props = {}) {
  return Model::fromScene({.robot = bioloid(), .props = std::move(props)});
}

std::shared_ptr<const Model> props(std::vector<Prop> list, double time_step = 0.001) {
  return Model::fromScene({.props = std::move(list), .time_step = time_step});
}

/// A file of this process's tests.
std::string file(const std::string& name) {
  static const TestFolder kFolder;
  return kFolder / name;
}

/// A model file of a test, as a robot.
std::shared_ptr<const Robot> robotOf(const std::string& name, const std::string& mjcf,
                                     const std::string& toml = "") {
  std::ofstream(file(name + ".xml")) << mjcf;
  if (toml.empty()) {
    return std::make_shared<const Robot>(Robot::fromFile(file(name + ".xml")));
  }
  std::ofstream(file(name + ".toml"))
      << "name = \"" << name << "\"\nmodel = \"" << name << ".xml\"\n"
      << toml;
  return std::make_shared<const Robot>(Robot::fromFile(file(name + ".toml")));
}

TEST(World, PlacingARobotPutsItWhereAResetDoes) {
  const auto model = onGround();
  State pose = thrown(*model);
  pose.q[2] = 0.1;  // among contacts
  World reset(model);
  World placed(model);
  reset.reset(pose);
  ASSERT_FALSE(reset.snapshot().contacts().empty());
  placed.reset(pose);  // its contacts must not stay
  placed.place(model->initialState());
  placed.place(pose);
  const Snapshot& a = reset.snapshot();
  const Snapshot& b = placed.snapshot();
  EXPECT_EQ(a.q(), b.q());
  EXPECT_EQ(a.com(), b.com());
  EXPECT_TRUE(b.contacts().empty());
  Matrix3Xd J = Matrix3Xd::Zero(3, model->nv());
  Matrix3Xd K = J;
  for (int i = 0; i < model->bodies(); ++i) {
    const BodyId body{i};
    EXPECT_EQ(a.bodyPosition(body), b.bodyPosition(body));
    EXPECT_EQ(a.bodyRotation(body), b.bodyRotation(body));
    a.pointJacobian(body, Vector3d(0.1, 0, 0), J);
    b.pointJacobian(body, Vector3d(0.1, 0, 0), K);
    EXPECT_EQ(J, K);
  }
  a.comJacobian(J);
  b.comJacobian(K);
  EXPECT_EQ(J, K);
}

TEST(FreeFall, BallFollowsTheParabola) {
  Prop ball{.name = "ball", .shape = Prop::Shape::kBall, .position = {0, 0, 10}, .mass = 1};
  const auto model = props({ball});
  World world(model);
  State s = world.state();
  s.v.head<3>() << 3, -2, 1;
  world.reset(s);
  const int n = 500;
  for (int i = 0; i < n; ++i) world.step(none(*model));
  const double t = n * 0.001;
  EXPECT_NEAR(world.snapshot().com().x(), 3 * t, 1e-12);
  EXPECT_NEAR(world.snapshot().comVelocity().z(), 1 - kG * t, 1e-12);
  // Semi-implicit Euler lies exactly g·t·Δt/2 below the parabola.
  EXPECT_NEAR(world.snapshot().com().z(), 10 + t - kG * t * t / 2 - kG * t * 0.001 / 2, 1e-12);
}

TEST(FreeFall, BallDroppedOnTheGroundRestsOnItAndWeighsItsWeight) {
  Prop ball{.name = "ball",
            .shape = Prop::Shape::kBall,
            .size = Vector3d::Constant(0.05),
            .position = {0, 0, 0.2},
            .mass = 2};
  const auto model = props({ball});
  World world(model);
  for (int i = 0; i < 3000; ++i) world.step(none(*model));
  EXPECT_NEAR(world.snapshot().com().z(), 0.05, 1e-3);
  ASSERT_EQ(world.snapshot().contacts().size(), 1u);
  EXPECT_NEAR(world.snapshot().contacts()[0].f_WC.z(), 2 * kG, 1e-4);
  EXPECT_EQ(model->bodyName(world.snapshot().contacts()[0].body_b), "ball");
}

TEST(FreeFall, BallIsThrownBackByWhatIsLittleDamped) {
  Prop ball{.name = "ball",
            .shape = Prop::Shape::kBall,
            .size = Vector3d::Constant(0.05),
            .position = {0, 0, 1.05},
            .mass = 2};
  const auto rises = [&](double ratio) {  // after it has touched [m]
    ball.material = {.compliance = 0.3, .damping_ratio = ratio};
    const auto model = Model::fromScene({.ground_material = ball.material, .props = {ball}});
    World world(model);
    double highest = 0;
    bool touched = false;
    for (int i = 0; i < 1200; ++i) {
      world.step(none(*model));
      touched = touched || !world.snapshot().contacts().empty();
      if (touched) highest = std::max(highest, world.snapshot().com().z() - 0.05);
    }
    return highest;
  };
  EXPECT_LT(rises(1), 0.1);
  EXPECT_GT(rises(0.1), 0.3);
  EXPECT_GT(rises(0.05), rises(0.1));
  EXPECT_LT(rises(0.05), 1);  // nothing is won
}

TEST(Flight, LinearMomentumOfAnArticulatedBodyIsKeptTo1e9) {
  const auto model = inSpace(0.001, 0);
  World world(model);
  world.reset(thrown(*model));
  const Vector3d before = world.snapshot().linearMomentum();
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    world.step(none(*model));
    worst = std::max(worst, (world.snapshot().linearMomentum() - before).norm());
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(Flight, WhatHangsOnTheWorldDoesNotFall) {
  const auto model = Model::fromMjcf(R"(<mujoco><worldbody>
    <body name="trunk" pos="0 0 1"><freejoint/><geom size="0.1" mass="1"/></body>
    </worldbody><equality><weld body1="trunk"/></equality></mujoco>)");
  World world(model);
  for (int i = 0; i < 500; ++i) world.step(none(*model));
  EXPECT_NEAR(world.snapshot().com().z(), 1, 0.01);
}

TEST(Flight, RootIsShiftedByTheEnginesOwnVelocitiesBitByBit) {
  const auto model = Model::fromMjcf(R"(<mujoco><option timestep=".002"/><worldbody>
    <body pos="0 0 9"><freejoint/><geom size=".1 .2 .3" type="box"/>
      <body pos=".3 0 0"><joint type="ball"/><geom size=".1" pos=".1 0 0"/>
        <body pos=".3 0 0"><joint type="hinge" axis="1 2 3"/><joint type="slide" axis="0 1 1"/>
          <geom size=".1" pos="0 .1 0"/></body></body>
      <body pos="-.3 0 0"><geom size=".1"/></body></body>
    </worldbody></mujoco>)");
  World world(model);
  const auto* m = model->raw();
  State state = world.state();
  for (int i = 0; i < m->nv; ++i) state.v[i] = std::sin(1 + 2. * i);
  world.reset(state);
  mjData* const d = mj_makeData(m);
  std::copy_n(state.v.data(), m->nv, d->qvel);
  mj_forward(m, d);
  const auto velocity = [&] {
    mj_subtreeVel(m, d);
    return Vector3d(Eigen::Map<const Vector3d>(d->subtree_linvel + 3));
  };
  for (int i = 0; i < 200; ++i) {
    const Vector3d before = velocity();
    mj_step2(m, d);
    mj_fwdPosition(m, d);
    mj_comVel(m, d);
    const Vector3d g(m->opt.gravity[0], m->opt.gravity[1], m->opt.gravity[2]);
    Eigen::Map<Vector3d>(d->qvel) += before + g * m->opt.timestep - velocity();
    mj_fwdVelocity(m, d);
    world.step({VectorXd::Zero(m->nu)});
    ASSERT_EQ(world.state().v, Eigen::Map<const VectorXd>(d->qvel, m->nv)) << i;
    ASSERT_EQ(world.state().q, Eigen::Map<const VectorXd>(d->qpos, m->nq)) << i;
  }
  mj_deleteData(d);
}

TEST(Flight, GravityChangesLinearMomentumByWeightTimesTime) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  world.reset(thrown(*model));
  const Vector3d before = world.snapshot().linearMomentum();
  for (int i = 0; i < 400; ++i) world.step(none(*model));
  const Vector3d expected = before + model->mass() * Vector3d(0, 0, -kG) * 0.4;
  EXPECT_LT((world.snapshot().linearMomentum() - expected).norm(), 1e-9);
}

TEST(Flight, AngularMomentumDriftShrinksWithTheStep) {
  // Semi-implicit Euler is of first order: half the step, half the drift.
  const auto drift = [](double time_step) {
    const auto model = inSpace(time_step, 0);
    World world(model);
    world.reset(thrown(*model));
    const Vector3d before = world.snapshot().angularMomentum();
    const int n = static_cast<int>(std::lround(0.3 / time_step));
    for (int i = 0; i < n; ++i) world.step(none(*model));
    return (world.snapshot().angularMomentum() - before).norm() / before.norm();
  };
  const double coarse = drift(0.002);
  const double fine = drift(0.0005);
  EXPECT_LT(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 4, 0.4);
}

TEST(RigidBody, TorqueFreeSymmetricTopPrecessesAtItsClosedFormRate) {
  // A box with Ixx = Iyy: in the body's frame the angular velocity turns about z at the rate
  // (Izz - Ixx)/Ixx · ω_z [Goldstein2002, §5.6].
  Scene scene{.ground = false,
              .props = {{.name = "top", .size = {0.1, 0.1, 0.3}, .position = {0, 0, 5}, .mass = 3}},
              .time_step = 0.0005};
  scene.gravity.setZero();
  const auto model = Model::fromScene(scene);
  World world(model);
  State s = world.state();
  s.v.tail<3>() << 0.5, 0, 8;
  world.reset(s);
  const double Ixx = 3.0 / 3 * (0.1 * 0.1 + 0.3 * 0.3);
  const double Izz = 3.0 / 3 * (0.1 * 0.1 + 0.1 * 0.1);
  const double rate = (Izz - Ixx) / Ixx * 8;
  const int n = 1000;
  for (int i = 0; i < n; ++i) world.step({VectorXd(0)});
  const double t = n * 0.0005;
  const auto v = world.snapshot().v();
  EXPECT_NEAR(v[3], 0.5 * std::cos(rate * t), 5e-3);
  EXPECT_NEAR(v[4], 0.5 * std::sin(rate * t), 5e-3);
  EXPECT_NEAR(v[5], 8, 1e-3);
}

TEST(Snapshot, AngularMomentumIsInertiaTimesAngularVelocity) {
  Scene scene{.ground = false, .props = {{.name = "box", .size = {0.1, 0.2, 0.3}, .mass = 6}}};
  const auto model = Model::fromScene(scene);
  World world(model);
  State s = world.state();
  s.v << 1, 2, 3, 0.3, -0.5, 0.7;  // it moves, too: about the COM that must not matter
  world.reset(s);
  const Vector3d I(6.0 / 3 * (0.04 + 0.09), 6.0 / 3 * (0.01 + 0.09), 6.0 / 3 * (0.01 + 0.04));
  const Vector3d expected = I.cwiseProduct(s.v.tail<3>());
  EXPECT_LT((world.snapshot().angularMomentum() - expected).norm(), 1e-12);
  EXPECT_LT((world.snapshot().linearMomentum() - Vector3d(6, 12, 18)).norm(), 1e-12);
}

TEST(Ground, SupportPolygonIsTheHullOfBothSoles) {
  const auto model = onGround();
  World world(model);
  world.reset(model->stateOf(bioloid()->poses.at("stand")));
  EXPECT_FALSE(world.snapshot().touchesWorld());  // exactly on the ground, pressing nowhere yet
  for (int i = 0; i < 5; ++i) world.step(none(*model));
  EXPECT_TRUE(world.snapshot().touchesWorld());
  const std::vector<Vector2d> polygon = world.snapshot().supportPolygon();
  ASSERT_GE(polygon.size(), 4u);
  double area = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  EXPECT_NEAR(area, 0.097 * 0.128, 0.0005);  // soles 97 mm long, 128 mm across both
}

TEST(Ground, AStackOfBoxesPressesWithItsWeightWhereItStands) {
  const auto model =
      props({{.name = "lower", .size = {0.2, 0.2, 0.1}, .position = {1, 2, 0.1}, .mass = 5}});
  World world(model);
  for (int i = 0; i < 1000; ++i) world.step({VectorXd(0)});
  ASSERT_TRUE(world.snapshot().cop());
  EXPECT_NEAR(((*world.snapshot().cop()).head<2>() - Vector2d(1, 2)).norm(), 0, 1e-6);
  double fz = 0;
  for (const Contact& c : world.snapshot().contacts()) fz += c.f_WC.z();
  EXPECT_NEAR(fz, 5 * kG, 1e-5);
  EXPECT_EQ(world.snapshot().supportPolygon().size(), 4u);
}

/// Holds the forces of the step just taken against Newton and Euler for every free box of a model
/// without joints: m·Δv = Δt·(m·g + Σf) and I·Δω = Δt·(Σ(p - c)×f - ω×I·ω), exact for one step of
/// semi-implicit Euler.
void expectContactsExplainTheStep(World& world, const Vector3d& gravity) {
  const Model& model = world.model();
  const auto* m = model.raw();
  const Snapshot& s = world.snapshot();
  const State before = world.state();
  std::vector<Vector3d> com;
  std::vector<Matrix3d> R;
  for (int b = 0; b < model.bodies(); ++b) {
    com.push_back(s.bodyCom({b}));
    R.push_back(s.bodyRotation({b}));
  }
  world.step(none(model));
  const double dt = model.timeStep();
  for (int b = 1; b < model.bodies(); ++b) {
    const int v = m->body_dofadr[b];
    const Vector3d I(m->body_inertia[3 * b], m->body_inertia[3 * b + 1],
                     m->body_inertia[3 * b + 2]);
    const Vector3d w = before.v.segment<3>(v + 3);
    Vector3d force = m->body_mass[b] * gravity;
    Vector3d moment = -w.cross(I.cwiseProduct(w));  // body axes
    for (const Contact& c : s.contacts()) {
      EXPECT_GE(c.f_WC.dot(c.normal), -1e-9);
      EXPECT_NEAR(c.normal.norm(), 1, 1e-12);
      const double sign = (c.body_b.value == b) - (c.body_a.value == b);
      force += sign * c.f_WC;
      moment += R[b].transpose() * (c.p_WC - com[b]).cross(sign * c.f_WC);
    }
    const VectorXd change = world.state().v - before.v;
    EXPECT_LT((m->body_mass[b] * change.segment<3>(v) - dt * force).norm(),
              1e-9 * (1 + force.norm()));
    EXPECT_LT((I.cwiseProduct(change.segment<3>(v + 3)) - dt * moment).norm(),
              1e-9 * (1 + moment.norm()));
  }
}

TEST(Ground, ContactForcesAreWhatMovesABoxThatTumblesOverAnother) {
  const auto model =
      props({{.name = "lower", .size = {0.2, 0.3, 0.1}, .position = {0, 0, 0.1}, .mass = 5},
             {.name = "upper", .size = {0.1, 0.15, 0.07}, .position = {0.1, 0.2, 0.5}, .mass = 2}});
  World world(model);
  State s = world.state();
  s.v.segment<6>(6) << 0.8, -1.1, -1, 3, -2, 4;
  world.reset(s);
  size_t together = 0;
  for (int i = 0; i < 600; ++i) {
    expectContactsExplainTheStep(world, {0, 0, -kG});
    for (const Contact& c : world.snapshot().contacts()) {
      together += !model->isStatic(c.body_a) && !model->isStatic(c.body_b);
    }
  }
  EXPECT_GT(together, 5u);
}

TEST(Ground, ABoxAtRestOnASlopeIsHeldByFrictionAndPressesDownhill) {
  const Vector3d gravity(1.5, -2.5, -9);
  Prop box{.name = "box", .size = {0.1, 0.1, 0.05}, .position = {1, 2, 0.05}, .mass = 3};
  Scene scene{.props = {box}};
  scene.gravity = gravity;
  const auto model = Model::fromScene(scene);
  World world(model);
  for (int i = 0; i < 2000; ++i) world.step(none(*model));
  Vector3d force = Vector3d::Zero();
  for (const Contact& c : world.snapshot().contacts()) force += c.f_WC;
  EXPECT_LT((force + 3 * gravity).norm(), 1e-3);
  // The line of weight through the COM meets the ground at the centre of pressure.
  const Vector3d com = world.snapshot().com();
  const Vector3d cop = com + gravity * (com.z() / -gravity.z());
  ASSERT_TRUE(world.snapshot().cop());
  EXPECT_LT((*world.snapshot().cop() - cop).norm(), 1e-3);
}

TEST(Ground, FrictionHoldsABoxBelowItsConeAndLetsItSlideAbove) {
  for (const double slope : {0.25, 0.35}) {  // tan; friction 0.3
    Prop box{.name = "box", .size = {0.1, 0.1, 0.05}, .position = {0, 0, 0.05}, .mass = 1};
    box.material.friction = 0.3;
    Scene scene{.ground_material = {.friction = 0.3}, .props = {box}};
    const double angle = std::atan(slope);
    scene.gravity = {kG * std::sin(angle), 0, -kG * std::cos(angle)};
    const auto model = Model::fromScene(scene);
    World world(model);
    for (int i = 0; i < 1000; ++i) world.step({VectorXd(0)});
    const double v = world.snapshot().comVelocity().x();
    if (slope < 0.3) {
      EXPECT_LT(v, 0.01);
    } else {
      EXPECT_NEAR(v, kG * (std::sin(angle) - 0.3 * std::cos(angle)), 0.05);
    }
  }
}

TEST(Jacobians, AgreeWithFiniteDifferences) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  const State s = thrown(*model);
  world.reset(s);
  const BodyId hand = model->body("l_hand");
  const Vector3d p_BP(0.03, -0.01, 0.02);
  Matrix3Xd J(3, model->nv());
  Matrix3Xd J_com(3, model->nv());
  world.snapshot().pointJacobian(hand, p_BP, J);
  world.snapshot().comJacobian(J_com);
  EXPECT_LT((J_com * s.v - world.snapshot().comVelocity()).norm(), 1e-12);
  const auto point = [&](const State& at) {
    world.reset(at);
    const Snapshot& w = world.snapshot();
    return std::pair(Vector3d(w.bodyPosition(hand) + w.bodyRotation(hand) * p_BP), w.com());
  };
  const double h = 1e-6;
  for (int i = 0; i < model->nv(); ++i) {
    // Translation and hinges; the quaternion's three columns are checked through J·v above.
    if (i >= 3 && i < 6) continue;
    State plus = s;
    State minus = s;
    const int q = i < 3 ? i : i + 1;
    plus.q[q] += h;
    minus.q[q] -= h;
    const auto [p1, c1] = point(plus);
    const auto [p0, c0] = point(minus);
    EXPECT_LT(((p1 - p0) / (2 * h) - J.col(i)).norm(), 1e-8) << "dof " << i;
    EXPECT_LT(((c1 - c0) / (2 * h) - J_com.col(i)).norm(), 1e-8) << "dof " << i;
  }
}

TEST(Jacobians, PointForceDoesTheWorkOfTheForce) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  const State s = thrown(*model);
  world.reset(s);
  const BodyId foot = model->body("r_foot");
  const Vector3d p_BP(0.02, 0.01, -0.03);
  const Vector3d f(3, -4, 5);
  VectorXd tau = VectorXd::Constant(model->nv(), 0.5);
  world.snapshot().addPointForce(foot, p_BP, f, tau);
  Matrix3Xd J(3, model->nv());
  world.snapshot().pointJacobian(foot, p_BP, J);
  EXPECT_NEAR((tau.array() - 0.5).matrix().dot(s.v), f.dot(J * s.v), 1e-12);
}

TEST(SolveInertia, InvertsTheMassMatrixPlusADiagonal) {
  // M·v by finite differences of what a torque does: M v̇ = τ - bias, so M⁻¹ must reproduce the
  // engine's own acceleration.
  const auto model = inSpace(1e-5, kG);
  World world(model);
  const State s = thrown(*model);
  world.reset(s);
  VectorXd b(model->nv());
  world.snapshot().externalForce(b);
  Torque torque{VectorXd::LinSpaced(model->nu(), -0.3, 0.3)};
  for (const Joint& j : model->joints()) b[j.v] += torque.tau[j.motor];
  // Euler's own implicit joint damping is 0.1·Δt on the hinges.
  VectorXd d = VectorXd::Zero(model->nv());
  for (const Joint& j : model->joints()) d[j.v] = 0.1 * 1e-5;
  world.snapshot().solveInertia(d, b);
  world.step(torque);
  const VectorXd vdot = (world.state().v - s.v) / 1e-5;
  EXPECT_LT((vdot - b).tail(model->nv() - 6).norm() / b.norm(), 1e-6);
}

TEST(World, EqualResetsGiveEqualBitsAlsoInAUsedWorld) {
  const auto model = onGround();
  const State start = model->stateOf(bioloid()->poses.at("crouch"));
  const auto run = [&](World& world) {
    world.reset(start);
    for (int i = 0; i < 300; ++i) world.step(none(*model));
    return world.state();
  };
  World used(model);
  used.push(model->root(), {30, 0, 0});
  for (int i = 0; i < 77; ++i) used.step(none(*model));
  World fresh(model);
  const State a = run(used);
  const State b = run(fresh);
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.v, b.v);
}

TEST(World, PushChangesMomentumByForceTimesTime) {
  const auto model = inSpace(0.001, 0);
  World world(model);
  world.reset(model->initialState());
  world.push(model->root(), {5, 0, 0});
  for (int i = 0; i < 100; ++i) world.step(none(*model));
  EXPECT_NEAR(world.snapshot().linearMomentum().x(), 0.5, 1e-3);
}

TEST(World, APushIsAmongTheExternalForces) {
  const auto model = inSpace(0.001, 0);
  World world(model);
  world.reset(model->initialState());
  VectorXd before(model->nv());
  VectorXd after(model->nv());
  world.snapshot().externalForce(before);
  world.push(model->root(), {5, 0, 0});
  world.snapshot().externalForce(after);
  EXPECT_NEAR((after - before)[0], 5, 1e-12);
}

TEST(World, PushesOfSeveralBodiesDoTheWorkOfTheirForces) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  const State state = thrown(*model);
  world.reset(state);
  const Snapshot& s = world.snapshot();
  VectorXd before(model->nv());
  VectorXd after(model->nv());
  s.externalForce(before);
  double power = 0;
  Matrix3Xd J(3, model->nv());
  for (const auto& [name, f] :
       {std::pair("l_hand", Vector3d(3, -4, 5)), std::pair("r_foot", Vector3d(-1, 7, 2))}) {
    const BodyId body = model->body(name);
    world.push(body, f);
    const Vector3d p_BCm =
        s.bodyRotation(body).transpose() * (s.bodyCom(body) - s.bodyPosition(body));
    s.pointJacobian(body, p_BCm, J);
    power += f.dot(J * state.v);
  }
  s.externalForce(after);
  EXPECT_NEAR((after - before).dot(state.v), power, 1e-12);
}

TEST(World, JointForceOfAHangingChainIsTheWeightBelow) {
  const auto model = Model::fromMjcf(R"(<mujoco><worldbody>
    <body name="upper" pos="0 0 2"><joint axis="0 0 1"/><geom type="box" size=".1 .1 .1" mass="3"/>
      <body name="lower" pos="0 0 -.5"><joint axis="0 0 1"/><geom type="box" size=".1 .1 .1" mass="2"/>
      </body></body></worldbody></mujoco>)");
  World world(model);
  world.watchJointForces(true);
  world.step(none(*model));
  const Matrix3Xd& f = world.snapshot().jointForces();
  EXPECT_NEAR((f.col(model->body("upper").value) - Vector3d(0, 0, 5 * kG)).norm(), 0, 1e-9);
  EXPECT_NEAR((f.col(model->body("lower").value) - Vector3d(0, 0, 2 * kG)).norm(), 0, 1e-9);
}

TEST(World, ADivergedSimulationSaysSoAndRecoversByReset) {
  const auto model = onGround();
  World world(model);
  State s = model->initialState();
  s.v.setConstant(1e12);
  world.reset(s);
  for (int i = 0; i < 5; ++i) world.step(none(*model));
  EXPECT_TRUE(world.diverged());
  world.reset(model->initialState());
  EXPECT_FALSE(world.diverged());
}

TEST(World, WrongStatesAreRefused) {
  const auto model = onGround();
  World world(model);
  State s = model->initialState();
  s.q.conservativeResize(3);
  try {
    world.reset(s);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "World::reset: expected q(23), v(22), got q(3), v(22)");
  }
  s = model->initialState();
  s.v[3] = std::nan("");
  EXPECT_THROW(world.reset(s), InputError);
}

TEST(Scene, WallAndRailStandWhereTheyAreAsked) {
  const auto model = onGround({wall("wall", {1, 0, 0}, M_PI, 2, 1.5),
                               rail("rail", {0.5, -0.5, 0.3}, {0.5, 0.5, 0.3}, 0.02)});
  World world(model);
  const Snapshot& s = world.snapshot();
  EXPECT_NEAR(s.bodyPosition(model->body("wall")).x(), 1.1, 1e-9);  // its face at x = 1 looks at -x
  EXPECT_NEAR(s.bodyPosition(model->body("wall")).z(), 0.75, 1e-9);
  const Vector3d axis = s.bodyRotation(model->body("rail")).col(2);
  EXPECT_NEAR(std::abs(axis.y()), 1, 1e-9);
  EXPECT_TRUE(model->isStatic(model->body("rail")));
}

TEST(Model, NamesThePropThatARobotReachesInto) {
  const auto reached = [](double height, double depth) {
    const auto model = onGround({{.name = "far", .size = {.1, .1, .1}, .position = {2, 0, .1}},
                                 {.name = "step", .size = {.3, .3, .05}, .position = {0, 0, .05}}});
    State s = model->stateOf({});  // with its lowest point on the ground
    s.q[2] += height;
    const auto body = model->bodyReachedInto(s, depth);
    return body ? model->bodyName(*body) : "";
  };
  EXPECT_EQ(reached(0.09, 0.005), "step");
  EXPECT_EQ(reached(0.09, 0.015), "");
  EXPECT_EQ(reached(0.11, 0.001), "");
  // Not what it reaches of itself.
  const auto model = onGround();
  State s = model->stateOf({});
  s.q[2] += 1;
  s.q[model->joint("l_hip").q] = 1.2;
  s.q[model->joint("r_hip").q] = -1.2;
  EXPECT_FALSE(model->bodyReachedInto(s, 0.001));
}

TEST(Model, TheRobotsRootIsOfTheTreeWithMostFreedom) {
  const auto root = [](const std::string& bodies) {
    const auto model = Model::fromMjcf("<mujoco><worldbody>" + bodies + "</worldbody></mujoco>");
    return std::pair(model->root().value, model->rootDofs());
  };
  const std::string fixed = "<body><geom size='.1'/></body>";
  const std::string hinged = "<body pos='1 0 0'><joint/><geom size='.1'/></body>";
  const std::string floating = "<body pos='0 1 0'><freejoint/><geom size='.1'/></body>";
  EXPECT_EQ(root(fixed + hinged + floating + floating), std::pair(3, 6));
  EXPECT_EQ(root(floating + hinged), std::pair(1, 6));
  EXPECT_EQ(root(fixed + hinged), std::pair(2, 0));
  EXPECT_EQ(root(fixed + fixed), std::pair(1, 0));
  // A ball beside a robot, which itself floats.
  const std::string robot =
      "<body><freejoint/><geom size='.1'/><body pos='1 0 0'><joint/><geom "
      "size='.1'/></body></body>";
  EXPECT_EQ(root(floating + robot), std::pair(2, 6));
  EXPECT_EQ(root(robot + floating), std::pair(1, 6));
  EXPECT_EQ(root(hinged), std::pair(1, 0));
  EXPECT_EQ(root("<geom size='.1'/>"), std::pair(0, 0));
}

TEST(Model, StandsOnItsLowestPointWhateverItsShape) {
  // Each turned so that no axis is the vertical; heights by geometry.
  const double c = std::cos(0.4);
  const double n = std::sin(0.4);
  const std::pair<const char*, double> shapes[] = {
      {"type='sphere' size='.3'", .3},
      {"type='box' size='.1 .2 .3'", .2 * n + .3 * c},
      {"type='capsule' size='.1 .3'", .1 + .3 * c},
      {"type='cylinder' size='.1 .3'", .1 * n + .3 * c},
      {"type='ellipsoid' size='.1 .2 .3'", std::hypot(.2 * n, .3 * c)}};
  for (const auto& [shape, height] : shapes) {
    const auto model = Model::fromMjcf(
        "<mujoco><worldbody><body><freejoint/><geom type='sphere' size='.01' pos='0 0 2'/>"
        "<geom pos='.3 .2 .7' euler='22.9183118 0 0' " +
        std::string(shape) + "/></body></worldbody></mujoco>");
    EXPECT_NEAR(model->stateOf({}).q[2], height - .7, 1e-6) << shape;
  }
  // A mesh by its vertices.
  const Vector3d corners[] = {{-.1, -.2, -.3}, {.4, -.1, -.2}, {.05, .5, -.25}, {.1, .15, .6}};
  std::string vertices;
  double lowest = 0;
  for (const Vector3d& v : corners) {
    vertices += fmt::format("{} {} {} ", v.x(), v.y(), v.z());
    lowest = std::min(lowest, n * v.y() + c * v.z());
  }
  const auto model = Model::fromMjcf("<mujoco><asset><mesh name='m' vertex='" + vertices +
                                     "'/></asset><worldbody><body><freejoint/><geom type='mesh' "
                                     "mesh='m' pos='.3 .2 .7' euler='22.9183118 0 0'/>"
                                     "</body></worldbody></mujoco>");
  EXPECT_NEAR(model->stateOf({}).q[2], -lowest - .7, 1e-6);
}

TEST(Scene, MistakesInPropsAndSurfacesNameThem) {
  const auto message = [](const Scene& scene) -> std::string {
    try {
      Model::fromScene(scene);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  const Prop good{.name = "box", .size = {.1, .1, .1}, .position = {1, 0, .1}, .mass = 1};
  const auto with = [&](const auto& change) {
    Prop p = good;
    change(p);
    return message({.robot = bioloid(), .props = {p}});
  };
  EXPECT_EQ(with([](Prop&) {}), "accepted");
  for (const char* name : {"ground", "l_foot", ""}) {
    EXPECT_NE(with([&](Prop& p) { p.name = name; }).find(fmt::format("prop \"{}\": ", name)),
              std::string::npos)
        << name;
  }
  EXPECT_NE(message({.props = {good, good}}).find("has this name"), std::string::npos);
  EXPECT_NE(with([](Prop& p) { p.size.y() = 0; }).find("expected lengths > 0"), std::string::npos);
  EXPECT_NE(with([](Prop& p) { p.mass = -1; }).find("mass -1 kg"), std::string::npos);
  EXPECT_NE(with([](Prop& p) { p.material.compliance = 0.001; }).find("twice the time step, 0.002"),
            std::string::npos);
  EXPECT_NE(message({.time_step = 0.003}).find("the ground: compliance 0.004 s"),
            std::string::npos);
}

TEST(Scene, TheGroundHoldsWhateverTheRobotsDefaultsAre) {
  const auto robot = robotOf("ghost", R"(<mujoco><default><geom contype="0" conaffinity="0"/>
    <default class="solid"><geom contype="1" conaffinity="1"/></default></default>
    <worldbody><body pos="0 0 .2"><freejoint/><geom class="solid" size=".1"/></body></worldbody></mujoco>)");
  const auto model = Model::fromScene({.robot = robot});
  World world(model);
  for (int i = 0; i < 1000; ++i) world.step(none(*model));
  EXPECT_NEAR(world.snapshot().com().z(), 0.1, 1e-3);
}

TEST(Robot, MistakesNameTheFileTheyStandIn) {
  const char* arm = R"(<mujoco><worldbody><body name="arm"><joint name="turn" axis="0 1 0"/>
    <geom size=".1"/></body></worldbody></mujoco>)";
  const auto message = [](const auto& read) -> std::string {
    try {
      read();
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  const auto with = [&](const std::string& toml) {
    return message([&] { Model::fromScene({.robot = robotOf("named", arm, toml)}); });
  };
  EXPECT_EQ(with("gains.turn = { kp = 1, kd = 1 }"), "accepted");
  EXPECT_NE(with("gains.trun = { kp = 1, kd = 1 }").find("named.toml: no joint"),
            std::string::npos);
  EXPECT_NE(with("gains.turn = { kp = -1, kd = 1 }").find("named.toml:3:21: \"kp\": expected"),
            std::string::npos)
      << with("gains.turn = { kp = -1, kd = 1 }");
  std::ofstream(file("bare.toml")) << "names = \"bare\"\n";
  const std::string bare = message([] { Robot::fromFile(file("bare.toml")); });
  for (const char* words : {"\"model\" is missing", "Did you mean \"name\"?"}) {
    EXPECT_NE(bare.find(words), std::string::npos) << bare;
  }
  for (const char* nowhere : {"nowhere.xml", "nowhere.urdf", "nowhere.toml"}) {
    const std::string missing = message([&] { Robot::fromFile(file(nowhere)); });
    EXPECT_NE(missing.find(std::string(nowhere) + ": cannot be read"), std::string::npos)
        << missing;
  }
  std::ofstream(file("empty.xml")) << "<!-- later -->";
  const auto includes = robotOf("includes", "<mujoco><include file=\"empty.xml\"/></mujoco>");
  EXPECT_NE(message([&] { Model::fromScene({.robot = includes}); }).find("empty.xml: expected"),
            std::string::npos);
}

TEST(World, ComVelocityIsTheEnginesBitByBit) {
  const Prop ball{.name = "ball", .shape = Prop::Shape::kBall, .position = {.3, 0, 3}, .mass = 2};
  World world(onGround({ball}));  // falls beside it
  const auto* m = world.model().raw();
  for (int i = 0; i < 400; ++i) {
    world.step({VectorXd::Constant(m->nu, 0.3 * std::sin(0.05 * i))});
    const Vector3d ours = world.snapshot().comVelocity();
    mj_subtreeVel(m, world.raw());
    const mjtNum* theirs = world.raw()->subtree_linvel + 3 * world.model().root().value;
    EXPECT_EQ(ours, Vector3d(theirs[0], theirs[1], theirs[2])) << i;
  }
}

TEST(Model, StepsWithoutWhatIsOnlySeenUnlessItWeighs) {
  const auto text = [](const char* inertial) {
    return fmt::format(R"(<mujoco><worldbody><body><freejoint/>{}
      <geom size=".1"/><geom size=".2" contype="0" conaffinity="0"/></body></worldbody></mujoco>)",
                       inertial);
  };
  const std::string says = text(R"(<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>)");
  const auto lean = Model::fromMjcf(says);
  EXPECT_EQ(lean->raw()->ngeom, 1);
  EXPECT_EQ(lean->mass(), 2);
  EXPECT_EQ(lean->mjcf(), says);
  const auto whole = Model::fromMjcf(text(""));
  EXPECT_NEAR(whole->mass(), 1000 * 4 / 3. * M_PI * (1e-3 + 8e-3), 1e-9);
}

TEST(Scene, HasRoomForTheContactsOfItsProps) {
  std::vector<Prop> boxes(36);
  for (int i = 0; i < 36; ++i) {
    const auto [row, column] = std::div(i, 6);
    boxes[i] = {.name = fmt::format("box{}", i),
                .size = {.1, .1, .1},
                .position = {1 + .3 * column, .3 * row, .1},
                .mass = 1};
  }
  const auto model = onGround(boxes);
  World world(model);
  for (int i = 0; i < 300; ++i) world.step(none(*model));
  EXPECT_FALSE(world.overflowed());
  for (const Prop& p : boxes) {
    EXPECT_NEAR(world.snapshot().bodyPosition(model->body(p.name)).z(), .1, 1e-3) << p.name;
  }
}

TEST(World, WhatIsReadIsOfTheStateItIsIn) {
  // Also what is computed once and kept, and the time.
  const auto model = inSpace(0.001, kG);
  World used(model);
  State state = thrown(*model);
  const auto expect_fresh = [&] {
    World fresh(model);
    fresh.reset(used.state());
    EXPECT_EQ(used.snapshot().comVelocity(), fresh.snapshot().comVelocity());
    EXPECT_EQ(used.snapshot().angularMomentum(), fresh.snapshot().angularMomentum());
    EXPECT_EQ(used.snapshot().time(), fresh.snapshot().time());
  };
  expect_fresh();
  state.time = 5;
  used.reset(state);
  EXPECT_EQ(used.snapshot().time(), 5);
  EXPECT_EQ(used.state().time, 5);
  expect_fresh();
  state.v *= 2;
  used.reset(state);
  expect_fresh();
  used.step(none(*model));
  EXPECT_NEAR(used.snapshot().time(), 5.001, 1e-9);
  expect_fresh();
  state.time = 7;
  used.place(state);
  EXPECT_EQ(used.snapshot().time(), 7);
  EXPECT_EQ(used.snapshot().jointForces().cols(), 0);
}

TEST(World, APushEndsWithItsReset) {
  const auto model = inSpace(0.001, kG);
  World used(model);
  World fresh(model);
  const State start = thrown(*model);
  used.push(model->root(), {30, 0, 0}, {0, 1, 0});
  used.step(none(*model));
  for (World* world : {&used, &fresh}) {
    world->reset(start);
    for (int i = 0; i < 20; ++i) world->step(none(*model));
  }
  EXPECT_EQ(used.state().q, fresh.state().q);
  EXPECT_EQ(used.state().v, fresh.state().v);
}

TEST(World, AMomentTurnsWhatItActsOn) {
  Scene scene{.ground = false,
              .props = {{.name = "box", .size = {.1, .2, .3}, .rpy = {0.3, -0.4, 0.5}, .mass = 6}}};
  scene.gravity.setZero();
  const auto model = Model::fromScene(scene);
  World world(model);
  const Vector3d moment(1, -2, 3);
  const Vector3d force(4, 5, -6);
  world.push(model->root(), force, moment);
  VectorXd tau(6);
  world.snapshot().externalForce(tau);
  const Matrix3d R = world.snapshot().bodyRotation(model->root());
  EXPECT_LT((tau.head<3>() - force).norm(), 1e-12);
  EXPECT_LT((tau.tail<3>() - R.transpose() * moment).norm(), 1e-12);
  world.step(none(*model));
  EXPECT_LT((world.snapshot().angularMomentum() - 0.001 * moment).norm(), 1e-6);
  EXPECT_LT((world.snapshot().linearMomentum() - 0.001 * force).norm(), 1e-9);
}

TEST(Snapshot, EveryBodyMovesAndIsPushedByItsJacobian) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  const State state = thrown(*model);
  world.reset(state);
  const Snapshot& s = world.snapshot();
  const auto* m = model->raw();
  Matrix3Xd J(3, model->nv());
  VectorXd none_pushed(model->nv());
  s.externalForce(none_pushed);
  for (int b = 1; b < model->bodies(); ++b) {
    s.pointJacobian({b}, Vector3d::Zero(), J);
    EXPECT_LT((J * state.v - s.bodyVelocity({b})).norm(), 1e-12);
    const Vector3d p_BCm(m->body_ipos[3 * b], m->body_ipos[3 * b + 1], m->body_ipos[3 * b + 2]);
    const Vector3d com = s.bodyPosition({b}) + s.bodyRotation({b}) * p_BCm;
    EXPECT_LT((com - s.bodyCom({b})).norm(), 1e-12);
    const Vector3d f(1, -2, b);
    world.push({b}, f);
    VectorXd tau(model->nv());
    s.externalForce(tau);
    world.push({b}, Vector3d::Zero());
    s.pointJacobian({b}, p_BCm, J);
    EXPECT_LT((tau - none_pushed - J.transpose() * f).norm(), 1e-11) << b;
  }
}

TEST(Flight, IsOfTheRobotWhateverLiesBesideIt) {
  const Prop box{.name = "box", .size = {.1, .1, .1}, .position = {1, 0, .0999}, .mass = 5};
  const auto model = onGround({box});
  World world(model);
  State s = thrown(*model);
  s.v.tail(6).setZero();
  world.reset(s);
  const Vector3d before = world.snapshot().linearMomentum();
  for (int i = 0; i < 100; ++i) {
    world.step(none(*model));
    EXPECT_FALSE(world.snapshot().touchesWorld());
  }
  EXPECT_FALSE(world.snapshot().contacts().empty());  // the box's
  EXPECT_FALSE(world.snapshot().cop());
  EXPECT_TRUE(world.snapshot().supportPolygon().empty());
  const Vector3d expected = before + model->mass() * Vector3d(0, 0, -kG) * 0.1;
  EXPECT_LT((world.snapshot().linearMomentum() - expected).norm(), 1e-9);
}

/// Stands on small balls under a plate, at these places.
std::vector<Vector2d> supportOn(const std::vector<Vector2d>& feet) {
  std::string text =
      "<mujoco><worldbody><geom type='plane' size='0 0 1'/><body pos='0 0 .0099'>"
      "<freejoint/><geom type='box' size='1 1 .01' pos='0 0 1' mass='9'/>";
  for (const Vector2d& p : feet) {
    text += fmt::format("<geom size='.01' mass='.1' pos='{} {} 0'/>", p.x(), p.y());
  }
  const auto model = Model::fromMjcf(text + "</body></worldbody></mujoco>");
  World world(model);
  world.step(none(*model));
  EXPECT_EQ(world.snapshot().contacts().size(), feet.size());
  return world.snapshot().supportPolygon();
}

TEST(Ground, SupportIsTheHullOfWhateverStands) {
  using Points = std::vector<Vector2d>;
  const auto expect_hull = [](const Points& feet, const Points& hull) {
    const Points is = supportOn(feet);
    ASSERT_EQ(is.size(), hull.size());
    for (size_t i = 0; i < hull.size(); ++i) EXPECT_LT((is[i] - hull[i]).norm(), 1e-6) << i;
  };
  // Counter-clockwise from the left, below; what lies within or on an edge is no corner.
  expect_hull({{.25, .5}, {-.25, .5}, {0, .125}, {-.25, -.5}, {.25, -.5}, {.25, 0}, {-.25, .125}},
              {{-.25, -.5}, {.25, -.5}, {.25, .5}, {-.25, .5}});
  expect_hull({{.5, 0}, {0, .25}, {-.5, 0}, {0, -.25}, {.0625, .0625}},
              {{-.5, 0}, {0, -.25}, {.5, 0}, {0, .25}});
  expect_hull({{0, .25}, {.5, 0}, {-.5, 0}}, {{-.5, 0}, {.5, 0}, {0, .25}});
  expect_hull({{.5, 0}, {-.5, .25}}, {{-.5, .25}, {.5, 0}});
  expect_hull({{.125, .25}}, {{.125, .25}});
}

TEST(Ground, AWallIsPressedWhereItIsTouched) {
  // A box that rises along a wall: friction pulls it down.
  const auto model = Model::fromMjcf(R"(<mujoco><worldbody>
    <geom type="box" pos="1 0 1" size=".1 1 1"/>
    <body name="box" pos=".795 0 1"><freejoint/><geom type="box" size=".1 .1 .1" mass="3"/></body>
    </worldbody></mujoco>)");
  World world(model);
  State state = world.state();
  state.v.head<3>() << 1, 0, 1;
  world.reset(state);
  bool pressed = false;
  for (int i = 0; i < 20; ++i) {
    world.step(none(*model));
    const Snapshot& s = world.snapshot();
    double f = 0;
    for (const Contact& c : s.contacts()) f += std::abs(c.f_WC.x());
    if (f == 0) continue;
    pressed = true;
    ASSERT_TRUE(s.cop()) << i;
    EXPECT_NEAR(s.cop()->x(), 0.9, 0.01);
    EXPECT_LT(std::abs(s.cop()->z() - s.com().z()), 0.11);
  }
  EXPECT_TRUE(pressed);
}

TEST(Ground, OnlyWhatIsFixedSupports) {
  // A plate that carries a box beside its middle, on a pedestal.
  const auto model = Model::fromMjcf(R"(<mujoco><worldbody>
    <body name="plate" pos="0 0 .55"><freejoint/>
      <geom type="box" size=".3 .3 .05" mass="3"/></body>
    <body name="box" pos=".15 0 .65"><freejoint/>
      <geom type="box" size=".05 .05 .05" mass="1"/></body>
    <body name="pedestal" pos="0 0 .25"><geom type="box" size=".2 .2 .25"/></body>
    </worldbody></mujoco>)");
  World world(model);
  for (int i = 0; i < 2000; ++i) world.step(none(*model));
  const Snapshot& s = world.snapshot();
  bool first = false;  // the robot is a contact's first body, too
  for (const Contact& c : s.contacts()) first = first || model->isStatic(c.body_b);
  EXPECT_TRUE(first);
  ASSERT_TRUE(s.cop());
  EXPECT_LT((*s.cop() - Vector3d(.15 / 4, 0, .5)).norm(), 2e-3);
  for (const Vector2d& p : s.supportPolygon()) {
    EXPECT_NEAR(p.cwiseAbs().minCoeff(), .2, 1e-3);
  }
  EXPECT_EQ(s.supportPolygon().size(), 4U);
}

TEST(Ground, WhatIsOnlyNearDoesNotPress) {
  const auto model = Model::fromMjcf(R"(<mujoco><worldbody>
    <geom type="plane" size="0 0 1" gap=".1"/>
    <body pos="0 0 .15"><freejoint/><geom size=".1" gap=".1"/></body>
    </worldbody></mujoco>)");
  World world(model);
  EXPECT_GT(world.raw()->ncon, 0);
  EXPECT_TRUE(world.snapshot().contacts().empty());
  const double before = world.snapshot().com().z();
  for (int i = 0; i < 50; ++i) world.step(none(*model));
  EXPECT_NEAR(world.snapshot().comVelocity().z(), -kG * 0.1, 1e-9);
  EXPECT_LT(world.snapshot().com().z(), before);
}

TEST(World, SaysWhatOfAStateIsWrong) {
  const auto model = onGround();
  World world(model);
  const auto said = [&](const State& s, bool place) -> std::string {
    try {
      place ? world.place(s) : world.reset(s);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  State s = model->initialState();
  EXPECT_EQ(said(s, true), "accepted");
  s.v.conservativeResize(3);
  EXPECT_EQ(said(s, true), "World::place: expected q(23), v(22), got q(23), v(3)");
  s = model->initialState();
  s.q[7] = INFINITY;
  EXPECT_EQ(said(s, false), "World::reset: q and v must be finite, got NaN or infinity");
}

TEST(World, DivergesByWhateverIsNoNumber) {
  const auto model = inSpace(0.001, kG);
  World world(model);
  EXPECT_FALSE(world.diverged());
  EXPECT_FALSE(world.overflowed());
  Torque torque = none(*model);
  torque.tau[3] = NAN;
  world.step(torque);
  world.step(torque);
  EXPECT_TRUE(world.diverged());
  State s = model->initialState();
  s.q[0] = 1e11;
  world.reset(s);
  EXPECT_FALSE(world.diverged());
  world.step(none(*model));
  EXPECT_TRUE(world.diverged());
  s = model->initialState();
  s.v[0] = 1e11;
  world.reset(s);
  world.step(none(*model));
  EXPECT_TRUE(world.diverged());
}

TEST(World, SaysThatThereWereTooManyContacts) {
  std::string boxes;
  for (int i = 0; i < 20; ++i) {
    boxes +=
        fmt::format("<body pos='{} 0 2'><freejoint/><geom type='box' size='.1 .1 .1'/></body>", i);
  }
  // The engine makes room as it goes, within the memory that a file says. Too little for the
  // contacts, for their constraints, for what solves them (an error, not a warning), and enough.
  for (const int memory : {20, 80, 120, 400}) {
    SCOPED_TRACE(memory);
    const auto model = Model::fromMjcf(
        fmt::format("<mujoco><size memory='{}K'/><worldbody><geom type='plane' size='0 0 1'/>{}"
                    "</worldbody></mujoco>",
                    memory, boxes));
    World world(model);
    const State high = model->initialState();
    State low = high;
    for (int i = 0; i < 20; ++i) low.q[7 * i + 2] = .0999;
    world.reset(low);
    for (int i = 0; i < 3; ++i) world.step(none(*model));
    EXPECT_EQ(world.overflowed(), memory < 400);
    EXPECT_FALSE(world.diverged());
    world.reset(high);
    EXPECT_FALSE(world.overflowed());
    for (int i = 0; i < 700; ++i) world.step(none(*model));  // they have fallen
    EXPECT_EQ(world.overflowed(), memory < 400);
  }
}

TEST(Ground, PressureAndSupportAreTheRobotsAlone) {
  const Prop box{.name = "box", .size = {.1, .1, .1}, .position = {1, 0, .1}, .mass = 50};
  const auto supported = [](const std::shared_ptr<const Model>& model) {
    World world(model);
    world.reset(model->stateOf(bioloid()->poses.at("stand")));
    for (int i = 0; i < 20; ++i) world.step(none(*model));
    return std::pair(world.snapshot().cop(), world.snapshot().supportPolygon().size());
  };
  const auto [cop, corners] = supported(onGround({box}));
  const auto [alone, alone_corners] = supported(onGround());
  ASSERT_TRUE(cop && alone);
  EXPECT_NEAR((*cop - *alone).norm(), 0, 1e-9);
  EXPECT_EQ(corners, alone_corners);
}

TEST(Scene, SofterGroundSinksDeeper) {
  const auto depth = [](double compliance) {
    Prop ball{.name = "ball",
              .shape = Prop::Shape::kBall,
              .size = Vector3d::Constant(0.05),
              .position = {0, 0, 0.05},
              .mass = 5};
    ball.material.compliance = compliance;
    Scene scene{.ground_material = {.compliance = compliance}, .props = {ball}};
    const auto model = Model::fromScene(scene);
    World world(model);
    State s = world.state();
    s.v[2] = -2;
    world.reset(s);
    double lowest = 1;
    for (int i = 0; i < 200; ++i) {
      world.step({VectorXd(0)});
      lowest = std::min(lowest, world.snapshot().com().z());
    }
    return 0.05 - lowest;
  };
  EXPECT_GT(depth(0.02), 2 * depth(0.004));
}

TEST(Model, UnknownNamesAreRefusedWithASuggestion) {
  const auto model = onGround();
  try {
    model->body("l_fot");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "no body named \"l_fot\". Did you mean \"l_foot\"?");
  }
  EXPECT_THROW(model->joint("knee"), InputError);
}

TEST(Model, UrdfFloatsAndKeepsItsLimits) {
  const std::string path = file("pendulum.urdf");
  std::ofstream(path) << R"(<robot name="two">
    <link name="base"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
    <link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="swing" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="2" effort="7" velocity="3"/></joint>
    <link name="tip"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="weld" type="fixed"><parent link="arm"/><child link="tip"/>
      <limit effort="7" velocity="3"/></joint></robot>)";
  const auto robot = std::make_shared<const Robot>(Robot::fromFile(path));
  const auto model = Model::fromScene({.robot = robot});
  EXPECT_EQ(model->rootDofs(), 6);
  EXPECT_NEAR(model->mass(), 4, 1e-12);
  ASSERT_EQ(model->joints().size(), 1u);
  EXPECT_EQ(model->nu(), 1);
  const JointLimit& limit = model->joint("swing").limit;
  EXPECT_EQ(limit.torque, 7);
  EXPECT_EQ(limit.speed, 3);
  EXPECT_EQ(limit.max, 2);
  const State s = model->stateOf({});
  EXPECT_NEAR(s.q[2], 0.1, 1e-9);  // the box's lower face on the ground
}

/// Two arms that turn and a third that slides, on a floating trunk, between two parts of a file.
std::string armed(const std::string& more, const std::string& before = "") {
  return "<mujoco>" + before +
         R"(<worldbody><body name="trunk" pos="0 0 1"><freejoint/>
      <geom type="box" size=".1 .1 .1" mass="2"/>
      <body name="a" pos=".2 0 0"><joint name="a" axis="0 1 0"/><geom type="box" size=".1 .1 .1" mass="1"/></body>
      <body name="b" pos="-.2 0 0"><joint name="b" axis="0 1 0"/><geom type="box" size=".1 .1 .1" mass="1"/></body>
      <body name="c" pos="0 .2 0"><joint name="c" type="slide" axis="0 1 0"/><geom type="box" size=".1 .1 .1" mass="1"/></body>
    </body></worldbody>)" +
         more + "</mujoco>";
}

TEST(Model, AFilesOwnJointActuatorsBecomeMotorsOfOneNewtonMetre) {
  const auto model = Model::fromScene(
      {.robot =
           robotOf("geared", armed(R"(<actuator><motor name="a" joint="a" gear="100"/>
          <position name="b" joint="b" kp="50" ctrlrange="-1 1" ctrllimited="true"/></actuator>
          <sensor><actuatorfrc actuator="b"/></sensor>
          <keyframe><key qpos="0 0 1 1 0 0 0 0 0 0" ctrl="0 0"/></keyframe>)",
                                   R"(<default><general gear="7"/><motor gear="9"/></default>)")),
       .ground = false});
  EXPECT_EQ(model->nu(), 2);
  EXPECT_EQ(model->joint("c").motor, -1);  // what nothing drives stays passive
  for (const char* name : {"a", "b"}) {
    World world(model);
    Torque torque = none(*model);
    const Joint& joint = model->joint(name);
    ASSERT_GE(joint.motor, 0) << name;
    torque.tau[joint.motor] = 2.5;
    VectorXd force(model->nv());
    world.snapshot().externalForce(force);
    force[joint.v] += 2.5;
    world.snapshot().solveInertia(VectorXd::Zero(model->nv()), force);
    world.step(torque);
    const VectorXd vdot = world.state().v / model->timeStep();
    EXPECT_NEAR(vdot[joint.v], force[joint.v], 1e-6 * std::abs(force[joint.v])) << name;
  }
}

TEST(Model, AnActuatorThatIsNoPlainMotorIsNotOneInAForeignScene) {
  const auto model = Model::fromMjcf(armed(
      R"(<actuator><motor joint="a" gear="100"/><position joint="b"/><motor joint="c"/></actuator>)"));
  EXPECT_EQ(model->joint("a").motor, -1);
  EXPECT_EQ(model->joint("b").motor, -1);
  EXPECT_EQ(model->joint("c").motor, 2);
}

TEST(Model, ASlidesLimitIsInMetresAndAHingesInRadians) {
  const std::string limits =
      "[limits]\na = { torque = 1, speed = 1, angle = [-0.5, 0.5] }\n"
      "c = { torque = 1, speed = 1, angle = [-0.5, 0.5] }\n";
  for (const char* compiler : {"", "<compiler angle='radian'/>"}) {
    const auto model = Model::fromScene({.robot = robotOf("slide", armed("", compiler), limits)});
    // The composed text must say it, not only the limits beside it.
    const auto again = Model::fromMjcf(model->mjcf());
    EXPECT_NEAR(again->joint("a").limit.max, 0.5, 1e-6) << compiler;
    EXPECT_NEAR(again->joint("c").limit.max, 0.5, 1e-6) << compiler;
    EXPECT_TRUE(again->joint("c").slides);
    EXPECT_FALSE(again->joint("a").slides);
  }
}

TEST(Model, MassScaleReachesMassesHoweverTheFileSaysThem) {
  const std::string body =
      R"(<worldbody><body name="x" pos="0 0 1"><freejoint/>%</body></worldbody>)";
  const auto mjcf = [&](const std::string& before, const std::string& geom) {
    std::string text = body;
    return "<mujoco>" + before + text.replace(text.find('%'), 1, geom) + "</mujoco>";
  };
  const std::string sphere = R"(<geom size=".1"/>)";
  for (const std::string& text :
       {mjcf("", sphere), mjcf("", R"(<geom size=".1" mass="3"/>)"),
        mjcf("", R"(<geom size=".1" density="30"/>)"),
        mjcf(R"(<default><geom density="70"/></default>)", sphere),
        mjcf(R"(<default><default class="heavy"><geom mass="7"/></default></default>)",
             R"(<geom class="heavy" size=".1"/>)"),
        mjcf("", R"(<inertial pos="0 0 0" mass="3" diaginertia="1 2 2"/><geom size=".1"/>)")}) {
    const double one = Model::fromScene({.robot = robotOf("scaled", text)})->mass();
    const auto model = Model::fromScene({.robot = robotOf("scaled", text, "mass_scale = 1.5\n")});
    EXPECT_NEAR(model->mass(), 1.5 * one, 1e-9 * one) << text;
  }
  try {
    Model::fromScene({.robot = robotOf("total", mjcf("<compiler settotalmass='5'/>", sphere),
                                       "mass_scale = 1.5\n")});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("mass_scale 1.5 cannot be applied"), std::string::npos)
        << e.what();
  }
}

TEST(Model, ABoltedRobotStaysTheRobotBesideAFloatingProp) {
  const auto robot = robotOf("bolted", R"(<mujoco><worldbody><body name="arm" pos="0 0 1">
    <joint name="turn" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.4" size=".03"/>
    </body></worldbody></mujoco>)");
  const Prop box{.name = "box", .size = {.1, .1, .1}, .position = {1, 0, .1}, .mass = 1};
  const auto model = Model::fromScene({.robot = robot, .props = {box}});
  EXPECT_EQ(model->bodyName(model->root()), "arm");
  EXPECT_EQ(model->rootDofs(), 0);
  EXPECT_EQ(model->joints().size(), 1u);
  EXPECT_TRUE(model->isRobot(model->body("arm")));
  EXPECT_FALSE(model->isRobot(model->body("box")));
  EXPECT_FALSE(model->isRobot({0}));
  EXPECT_FALSE(model->isRobot({99}));
  const auto again = Model::fromMjcf(model->mjcf());  // as a recording does
  EXPECT_EQ(again->bodyName(again->root()), "arm");
}

TEST(Model, ARobotWithKeyFramesStandsBesideAFreeProp) {
  const auto robot = robotOf(
      "keyed", armed(R"(<keyframe><key name="up" qpos="0 0 1 1 0 0 0 0 0 0"/></keyframe>)"));
  const Prop ball{.name = "ball", .shape = Prop::Shape::kBall, .position = {1, 0, 1}, .mass = 1};
  EXPECT_EQ(Model::fromScene({.robot = robot, .props = {ball}})->nq(), 17);
}

TEST(Model, BrokenFilesNameFileAndLine) {
  const auto message = [](const std::string& text, const std::string& name) {
    const std::string path = file(name);
    std::ofstream(path) << text;
    try {
      Model::fromScene({.robot = std::make_shared<const Robot>(Robot::fromFile(path))});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(message("<mujoco>\n<worldbody>\n</mujoco>", "a.xml").find("a.xml:2:"),
            std::string::npos);
  EXPECT_NE(message("<html/>", "b.xml").find("expected <mujoco>"), std::string::npos);
  EXPECT_NE(
      message("<mujoco><worldbody><body><geom typ='box'/></body></worldbody></mujoco>", "c.xml")
          .find("typ"),
      std::string::npos);
  EXPECT_NE(message("<mujoco><asset><mesh file='" + std::string(300, 'x') + "'/></asset></mujoco>",
                    "long.xml")
                .find("no such asset"),
            std::string::npos);
  EXPECT_NE(message("<mujoco><asset><mesh file='x.stl'/></asset></mujoco>", "d.xml")
                .find("no such asset"),
            std::string::npos);
}

TEST(Model, WhatAStrangersFileAsksForHasALimit) {
  const auto refusal = [](const std::string& name, const std::string& text) {
    const std::string path = file(name);
    std::ofstream(path) << text;
    try {
      Model::fromScene({.robot = std::make_shared<const Robot>(Robot::fromFile(path))});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const std::string ball = "<worldbody><body><freejoint/><geom size='.1'/></body></worldbody>";
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  std::string twice = "<mujoco>";
  for (int i = 0; i < 10; ++i) twice += "<include file='leaf.xml'/>\n";
  std::ofstream(file("leaf.xml")) << "<mujoco/>";
  has(refusal("twice.xml", twice + "</mujoco>"), "twice.xml:2: ");
  has(refusal("itself.xml", "<mujoco><include file='itself.xml'/></mujoco>"), "included twice");
  has(refusal("zero.xml", "<mujoco><include file='/dev/zero'/></mujoco>"), "got a device");
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<body>";
  has(refusal("deep.xml", "<mujoco><worldbody>" + deep), "deep.xml");
#if !defined(TRACEUR_SANITIZE_ADDRESS) && !defined(TRACEUR_SANITIZE_THREAD)
  // 6.4 GB
  const std::string field =
      "<asset><hfield name='h' nrow='40000' ncol='40000' size='1 1 1 1'/></asset>";
  EXPECT_NE(refusal("field.xml", "<mujoco>" + field + ball + "</mujoco>"), "accepted");
#endif
  EXPECT_EQ(refusal("ball.xml", "<mujoco>" + ball + "</mujoco>"), "accepted");
}

TEST(Robot, AMistakeInAPairsRowIsSaidOnce) {
  const std::string path = file("pair.toml");
  std::ofstream(path) << "name = \"x\"\nmodel = \"pair.toml\"\n"
                         "[mirrored]\nhip = { left = \"a\", right = \"b\", sign = -1 }\n"
                         "[limits]\nhip = { torque = -1, speed = 2, angle = [0, 1] }\n"
                         "[gains]\nhip = { kp = 1 }\n[poses]\nstand = { hip = \"x\" }\n";
  try {
    Robot::fromFile(path);
    FAIL();
  } catch (const InputError& e) {
    const std::string text = e.what();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2) << text;
  }
}

TEST(Robot, ReportsEveryMistakeAtOnce) {
  const std::string path = file("robot.toml");
  std::ofstream(path) << "name = \"x\"\nmodel = \"nowhere.xml\"\nmas_scale = 2\n"
                         "[mirrored]\nhip = { left = \"a\", right = \"b\", sign = 3 }\n"
                         "[limits]\nknee = { torque = -1, speed = 2, angle = [1, 0] }\n";
  try {
    Robot::fromFile(path);
    FAIL();
  } catch (const InputError& e) {
    const std::string text = e.what();
    EXPECT_NE(text.find(":2:9: \"model\": no file"), std::string::npos) << text;
    EXPECT_NE(text.find("Did you mean \"mass_scale\"?"), std::string::npos) << text;
    EXPECT_NE(text.find("expected 1 or -1"), std::string::npos) << text;
    EXPECT_NE(text.find("\"torque\": expected a positive"), std::string::npos) << text;
    EXPECT_NE(text.find("min < max"), std::string::npos) << text;
  }
}

TEST(Recording, BytesComeBackAndDamageIsRefused) {
  const auto model = onGround();
  World world(model);
  world.reset(model->stateOf({}));
  Recording r{model->mjcf(), {"one", "two"}, {}};
  for (int i = 0; i < 3; ++i) {
    world.step(none(*model));
    r.frames.push_back(frameOf(world.snapshot(), 1, VectorXd::Constant(16, i)));
    r.frames.back().joint_forces = VectorXd::LinSpaced(model->bodies(), i, i + 1);
  }
  const std::string bytes = r.encode();
  const Recording back = Recording::decode(bytes);
  EXPECT_EQ(back.encode(), bytes);
  EXPECT_EQ(back.frames[2].state.q, world.state().q);
  EXPECT_EQ(back.frames[2].joint_forces, r.frames[2].joint_forces);
  EXPECT_EQ(back.frames[2].contacts.size(), world.snapshot().contacts().size());
  EXPECT_NO_THROW(Model::fromMjcf(back.mjcf));
  for (const size_t cut : {size_t(0), size_t(3), size_t(30), bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_THROW(Recording::decode(std::string_view(bytes).substr(0, cut)), InputError) << cut;
  }
  // The first version had no joint forces; a later one is not known.
  const size_t version = 4 + std::string("traceur-recording").size();
  Recording old = r;
  old.frames.resize(1);
  old.frames[0].joint_forces.resize(0);
  std::string first = old.encode();
  first[version] = 1;
  first.resize(first.size() - 4);
  EXPECT_EQ(Recording::decode(first).frames[0].joint_forces.size(), 0);
  EXPECT_EQ(Recording::decode(first).frames[0].state.q, r.frames[0].state.q);
  for (const char other : {0, 3}) {
    first[version] = other;
    EXPECT_THROW(Recording::decode(first), InputError);
  }
  // The phase of the first frame, behind time, q, v, com and its velocity.
  const size_t phase = bytes.find(model->mjcf()) + model->mjcf().size() + 4 + 2 * (4 + 3) + 4 + 8 +
                       4 + 8 * model->nq() + 4 + 8 * model->nv() + 2 * (4 + 24);
  const auto with = [&](double x) {
    std::string changed = bytes;
    std::memcpy(changed.data() + phase, &x, sizeof x);
    return changed;
  };
  EXPECT_EQ(Recording::decode(with(0)).frames[0].phase, 0);
  for (const double x : {1e300, -2.0, 0.5, double{NAN}, 2147483648.0}) {
    EXPECT_THROW(Recording::decode(with(x)), InputError) << x;
  }
}

/// A robot that has come down on the ground, so that contacts press.
void comeDown(World& world) {
  State s = thrown(world.model());
  s.q[2] -= 4.9;
  world.reset(s);
  for (int i = 0; i < 400; ++i) world.step(none(world.model()));
}

TEST(World, ACheckpointGoesOnWithTheSameBitsInAnyWorld) {
  const auto model = onGround();
  World world(model);
  comeDown(world);
  ASSERT_FALSE(world.snapshot().contacts().empty());
  world.push(model->root(), {3, 0, 0});
  const Checkpoint c = world.save();
  EXPECT_FALSE(c.empty());
  EXPECT_TRUE(Checkpoint().empty());
  const auto onwards = [&](World& w) {
    for (int i = 0; i < 200; ++i) w.step(none(*model));
    return w.state();
  };
  const State end = onwards(world);
  World other(model);
  other.watchJointForces(true);
  other.restore(c);
  EXPECT_EQ(other.state().q, c.state().q);
  EXPECT_FALSE(other.snapshot().contacts().empty());
  const State again = onwards(other);
  EXPECT_EQ(again.q, end.q);
  EXPECT_EQ(again.v, end.v);
  world.restore(c);
  EXPECT_EQ(onwards(world).q, end.q);
  // What a reset does not keep: how the contacts pressed and that somebody pushed.
  world.reset(c.state());
  EXPECT_NE(onwards(world).q, end.q);
}

TEST(Model, LaunchesARobotAsARigidBody) {
  const auto model = inSpace(0.001, 0);
  World world(model);
  Pose pose = model->robot()->poses.at("crouch");
  const State ground = model->stateOf(pose);
  world.reset(ground);
  const double before = world.snapshot().com().z();
  const Vector3d velocity(0.3, -0.2, 1.5);
  const Vector3d spin(0.5, 2, -1);
  world.reset(model->launched(ground, 0.7, velocity, spin));
  const Snapshot& s = world.snapshot();
  EXPECT_NEAR(s.com().z(), before + 0.7, 1e-12);
  EXPECT_LT((s.comVelocity() - velocity).norm(), 1e-12);
  for (int b = 1; b < model->bodies(); ++b) {
    const Vector3d arm = s.bodyPosition({b}) - s.com();
    EXPECT_LT((s.bodyVelocity({b}) - velocity - spin.cross(arm)).norm(), 1e-12);
  }
}

TEST(Snapshot, APointMovesWithItsBody) {
  const auto model = inSpace(1e-5, 0);
  World world(model);
  world.reset(thrown(*model));
  const BodyPoint p = model->contactPoint("left_toe");
  EXPECT_EQ(p.body, model->body("l_foot"));
  EXPECT_EQ(p.p_BP, model->robot()->contacts.at("left_toe").p_BP);
  Matrix3Xd J = Matrix3Xd::Zero(3, model->nv());
  world.snapshot().pointJacobian(p.body, p.p_BP, J);
  EXPECT_LT((world.snapshot().velocity(p) - J * world.snapshot().v()).norm(), 1e-12);
  const Vector3d from = world.snapshot().position(p);
  const Vector3d v = world.snapshot().velocity(p);
  world.step(none(*model));
  EXPECT_LT(((world.snapshot().position(p) - from) / 1e-5 - v).norm(), 1e-3 * v.norm());
  try {
    model->contactPoint("left_to");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("left_toe"), std::string::npos) << e.what();
  }
}

TEST(Snapshot, AMomentIsThatOfTheRotationJacobian) {
  const auto model = inSpace(1e-5, 0);
  World world(model);
  world.reset(thrown(*model));
  const Snapshot& s = world.snapshot();
  const BodyId body = model->body("r_shin");
  Matrix3Xd J = Matrix3Xd::Zero(3, model->nv());
  s.rotationJacobian(body, J);
  const Vector3d moment(0.3, -2, 1);
  VectorXd tau = VectorXd::Ones(model->nv());
  s.addMoment(body, moment, tau);
  EXPECT_LT((tau - VectorXd::Ones(model->nv()) - J.transpose() * moment).norm(), 1e-12);
  // The body turns as J says.
  const Matrix3d R = s.bodyRotation(body);
  const Vector3d omega = J * s.v();
  world.step(none(*model));
  const Eigen::AngleAxisd turn(Matrix3d(world.snapshot().bodyRotation(body) * R.transpose()));
  EXPECT_LT((turn.angle() * turn.axis() / 1e-5 - omega).norm(), 1e-3 * omega.norm());
}

TEST(Snapshot, TheTorqueIsWhatMotorsWereTold) {
  const auto model = inSpace(0.001, 0);
  World world(model);
  EXPECT_TRUE(world.snapshot().torque().isZero(0));
  Torque t = none(*model);
  t.tau[3] = 0.25;
  world.step(t);
  EXPECT_EQ(VectorXd(world.snapshot().torque()), t.tau);
  world.reset(model->initialState());
  EXPECT_TRUE(world.snapshot().torque().isZero(0));
}

std::shared_ptr<const Model> restingBoxes(bool sleep) {
  std::vector<Prop> boxes;
  boxes.reserve(4);
  for (int i = 0; i < 4; ++i) {
    boxes.push_back({.name = "box " + std::to_string(i),
                     .size = Vector3d::Constant(0.05),
                     .position = {0.5 * (i + 1), 0, 0.05},
                     .mass = 1});
  }
  return Model::fromScene({.props = boxes, .props_sleep = sleep});
}

TEST(World, SleepingPropsRestAndStillPress) {
  const auto model = restingBoxes(true);
  World world(model);
  for (int i = 0; i < 4000; ++i) world.step(none(*model));
  ASSERT_EQ(world.raw()->ntree_awake, 0);
  const State still = world.state();
  std::map<int, double> pressed;  // by body: the vertical force on it
  for (const Contact& c : world.snapshot().contacts()) {
    pressed[c.body_b.value] += c.f_WC.z();
    pressed[c.body_a.value] -= c.f_WC.z();
  }
  for (int b = 1; b < model->bodies(); ++b) EXPECT_NEAR(pressed[b], kG, 0.1) << b;
  for (int i = 0; i < 100; ++i) world.step(none(*model));
  EXPECT_EQ(world.state().q, still.q);
  EXPECT_EQ(world.snapshot().contacts().size(), 4u * 4);
}

TEST(World, APushWakesWhatSleeps) {
  const auto pushed = [](bool sleep) {
    const auto model = restingBoxes(sleep);
    World world(model);
    for (int i = 0; i < 4000; ++i) world.step(none(*model));
    EXPECT_EQ(world.raw()->ntree_awake, sleep ? 0 : 4);
    world.push(model->body("box 0"), {30, 0, 0});
    for (int i = 0; i < 100; ++i) world.step(none(*model));
    const Snapshot& s = world.snapshot();
    return std::pair(s.bodyPosition(model->body("box 0")).x(),
                     s.bodyPosition(model->body("box 1")).x());
  };
  const auto [x, other] = pushed(true);
  const auto [awake_x, awake_other] = pushed(false);
  EXPECT_GT(x, 0.52);
  EXPECT_NEAR(x, awake_x, 2e-3);
  EXPECT_NEAR(other, awake_other, 1e-4);
  EXPECT_EQ(pushed(true), (std::pair{x, other}));  // equal trials have equal bits
}

TEST(World, ARobotNeverSleepsAndWakesWhatItTouches) {
  Prop box{
      .name = "box", .size = Vector3d::Constant(0.03), .position = {0.5, 0, 0.03}, .mass = 0.2};
  Scene scene{.robot = bioloid(), .props = {box}, .props_sleep = true};
  const auto model = Model::fromScene(scene);
  World world(model);
  State start = model->stateOf({});
  world.reset(start);
  for (int i = 0; i < 600; ++i) world.step(none(*model));
  EXPECT_EQ(world.raw()->ntree_awake, 1);  // the robot, limp on the ground by now or falling
  // Thrown onto the box, it wakes it.
  start = model->launched(model->stateOf({}), 0.1, {3, 0, 0}, Vector3d::Zero());
  world.reset(start);
  for (int i = 0; i < 800; ++i) world.step(none(*model));
  EXPECT_GT((world.snapshot().bodyPosition(model->body("box")) - box.position).norm(), 0.005);
}

TEST(World, KnowsWherePlacedBodiesPressOnEachOther) {
  Scene scene;
  scene.props = {{.name = "a", .size = {0.1, 0.1, 0.1}, .position = {0, 0, 5}, .mass = 1},
                 {.name = "b", .size = {0.1, 0.1, 0.1}, .position = {1, 0, 5}, .mass = 1}};
  const auto model = Model::fromScene(scene);
  World world(model);
  State apart = model->initialState();
  EXPECT_FALSE(world.placePressed(apart));
  State together = apart;
  model->putFree(together, model->body("b"), {0.15, 0, 5}, Vector3d::Zero());
  EXPECT_TRUE(world.placePressed(together));
  EXPECT_TRUE(world.snapshot().contacts().empty());  // as place() leaves it
  EXPECT_FALSE(world.placePressed(apart));
}

}  // namespace
}  // namespace traceur::sim
