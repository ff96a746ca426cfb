#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "traceur/flight/planner.h"
#include "traceur/sim/model.h"

namespace traceur::flight {
namespace {

constexpr double kPi = std::numbers::pi;

Matrix3d pitched(double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix();
}

TEST(Turned, AboutAPrincipalAxisIsTheAngleThatMomentumAndInertiaGive) {
  const Matrix3d I = Vector3d(2, 4, 3).asDiagonal();
  const Matrix3d R = turned(Matrix3d::Identity(), {0, 6, 0}, I, 0.7);
  EXPECT_LT((R - pitched(1.5 * 0.7)).norm(), 1e-12);
  // An inertia that grows evenly from 2 to 4: the angle is L ∫ dt / I.
  const auto still = [](double about_y) {
    return Changing{Vector3d(2, about_y, 3).asDiagonal(), Vector3d::Zero()};
  };
  const PoseChange grows(still(2), still(3), still(4));
  const Matrix3d grown = turned(Matrix3d::Identity(), {0, 6, 0}, grows, 0.5);
  const double angle = 6 * 0.5 / 2 * std::log(2);
  EXPECT_LT((grown - pitched(angle)).norm(), 4e-3);
  for (const double none : {0., -1.}) {
    EXPECT_EQ(turned(R, {0, 6, 0}, I, none), R);
    EXPECT_EQ(turned(R, {0, 6, 0}, grows, none), R);
  }
}

TEST(Turned, OfARigidBodyKeepsItsEnergy) {
  const Matrix3d I = Vector3d(9, 10, 1.2).asDiagonal();
  const Vector3d L(20, 60, 4);
  const auto energy = [&](const Matrix3d& R) {
    return 0.5 * L.dot(R * I.inverse() * R.transpose() * L);
  };
  const Matrix3d start = pitched(0.4);
  const Matrix3d end = turned(start, L, I, 1);
  EXPECT_NEAR(energy(end) / energy(start), 1, 0.01);
  EXPECT_NEAR(end.determinant(), 1, 1e-9);
}

TEST(Turned, ByAChangeOfPoseIsTheSameHoweverLongItTakes) {
  // A wheel of 1 kg m² in a body of 4 that turns by 2 rad: all of it by -1/5 of that.
  const Changing turning{Vector3d(3, 5, 3).asDiagonal(), Vector3d(0, 1 * 2, 0)};
  const PoseChange wheel(turning, turning, turning);
  for (const double time : {0.01, 0.1, 3.}) {
    const Matrix3d R = turned(pitched(0.3), Vector3d::Zero(), wheel, time);
    EXPECT_LT((R - pitched(0.3 - 2 / 5.)).norm(), 1e-12);
  }
  // Momentum adds what it turns the whole by.
  const Matrix3d both = turned(pitched(0.3), {0, 6, 0}, wheel, 0.5);
  EXPECT_LT((both - pitched(0.3 - 2 / 5. + 6 / 5. * 0.5)).norm(), 1e-12);
}

TEST(Turn, IsWhatDiversCount) {
  EXPECT_NEAR(sim::Turn::of(pitched(2.5)).somersault, 2.5, 1e-12);
  EXPECT_NEAR(sim::Turn::of(pitched(-1)).somersault, -1, 1e-12);
  const Matrix3d yaw = Eigen::AngleAxisd(0.7, Vector3d::UnitZ()).toRotationMatrix();
  const Matrix3d roll = Eigen::AngleAxisd(-0.2, Vector3d::UnitX()).toRotationMatrix();
  const sim::Turn all = sim::Turn::of(yaw * roll * pitched(3));
  EXPECT_NEAR(all.heading, 0.7, 1e-12);  // upside down, too
  EXPECT_NEAR(all.tilt, 0.2, 1e-12);
  EXPECT_NEAR(all.somersault, 3, 1e-12);
  // To its left.
  EXPECT_NEAR(sim::Turn::of(roll).tilt, 0.2, 1e-12);
}

std::shared_ptr<const sim::Model> flyer() {
  // A trunk with two arms that swing up, which makes it harder to turn forward.
  return sim::Model::fromMjcf(R"(
<mujoco><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<geom type="plane" size="9 9 1"/>
<body name="trunk" pos="0 0 5"><freejoint/><geom type="box" size=".1 .15 .3" mass="10"/>
 <body name="left" pos="0 .2 .25"><joint name="left" axis="0 -1 0" range="-3 3" limited="true"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.8" size=".04" mass="3"/></body>
 <body name="right" pos="0 -.2 .25"><joint name="right" axis="0 -1 0" range="-3 3" limited="true"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.8" size=".04" mass="3"/></body>
</body></worldbody>
<actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>)");
}

TEST(FlightPoses, AreUnlikeEachOther) {
  const auto model = flyer();
  sim::World world(model);
  const VectorXd down = VectorXd::Zero(2);
  const FlightPose pose = flightPose(world, down);
  EXPECT_LT((pose.inertia - pose.inertia.transpose()).norm(), 1e-12);
  // About the left axis: parts about their own centres and those about the whole's.
  EXPECT_GT(pose.inertia(1, 1), 10 * (0.04 + 0.36) / 12);
  const auto poses = unlikePoses(model, down, 5);
  ASSERT_EQ(poses.size(), 5U);
  EXPECT_EQ(poses[0].joints, down);
  double before = INFINITY;
  for (size_t i = 1; i < poses.size(); ++i) {
    double nearest = INFINITY;
    for (size_t j = 0; j < i; ++j) {
      nearest = std::min(nearest, (poses[i].inertia - poses[j].inertia).norm());
    }
    EXPECT_LE(nearest, before);  // what comes later is nearer to what is there
    EXPECT_GT(nearest, 0);
    before = nearest;
  }
  EXPECT_EQ(unlikePoses(model, down, 5)[4].joints, poses[4].joints);
  EXPECT_NE(unlikePoses(model, down, 5, 2)[4].joints, poses[4].joints);
}

TEST(FlightPlanner, KnowsWhenItComesDown) {
  const auto model = flyer();
  FlightPlanner planner(model, {});
  planner.landIn(VectorXd::Zero(2));
  sim::World world(model);
  sim::State state = model->initialState();
  state.v[2] = 1;
  world.reset(state);
  const FlightPlan plan = planner.plan(
      world.snapshot(), [](auto&) { return 0; }, 0.5);
  EXPECT_EQ(plan.pose, -1);
  // Upright its arms reach 0.59 below the trunk's middle, the lowest it has.
  const double fall = plan.touch_down.time;
  EXPECT_NEAR(5 + fall - 9.81 / 2 * fall * fall, 0.5 + 0.59, 1e-3);
  EXPECT_NEAR(plan.touch_down.velocity.z(), 1 - 9.81 * fall, 1e-9);
  EXPECT_NEAR(plan.cost, 0, 1e-12);
}

TEST(FlightPlanner, ReachesWithPosesWhatNoneReaches) {
  const auto model = flyer();
  sim::World world(model);
  const VectorXd up = VectorXd::Constant(2, 2.9);
  const VectorXd down = VectorXd::Zero(2);
  FlightPlanner without(model, {});
  FlightPlanner with(model, {flightPose(world, up), flightPose(world, down)});
  without.landIn(down);
  with.landIn(down);
  sim::State state = model->initialState();
  state.v[4] = 3;
  world.reset(state);
  const auto rigid = without.plan(
      world.snapshot(), [](auto&) { return 0; }, 0);
  const double turned = rigid.touch_down.turn.somersault;
  EXPECT_NEAR(std::remainder(turned - 3 * rigid.touch_down.time, 2 * kPi), 0, 0.05);
  // Arms that are up for a while turn it less far.
  const auto wanted = [&](const TouchDown&) { return turned - 0.3; };
  const FlightPlan plan = with.plan(world.snapshot(), wanted, 0);
  EXPECT_LT(plan.cost, 1e-3);
  EXPECT_GT(without.plan(world.snapshot(), wanted, 0).cost, 0.08);
  EXPECT_EQ(plan.pose, 0);
  EXPECT_GT(plan.hold, FlightPlanner::kSwitch);
  EXPECT_LT(plan.hold, plan.touch_down.time);
  // The other pose alone is no help.
  EXPECT_GT(with.plan(world.snapshot(), wanted, 0, 1).cost, 0.05);
  EXPECT_EQ(with.plan(world.snapshot(), wanted, 0, -1).pose, -1);
}

TEST(FlightPlanner, ForeseesWhatSwingingLimbsDoToTheTrunk) {
  const auto model = flyer();
  sim::World world(model);
  FlightPlanner planner(model, {});
  // Both arms; and one, which tilts and heads the trunk, too.
  for (const Eigen::Vector2d& to : {Eigen::Vector2d(1.5, 1.5), Eigen::Vector2d(2, 0)}) {
    planner.landIn(to);
    sim::State state = model->initialState();
    state.v[4] = 0.5;
    world.reset(state);
    const FlightPlan plan = planner.plan(
        world.snapshot(), [](auto&) { return 1.3; }, 0);  // when it comes down
    while (world.snapshot().time() < plan.touch_down.time) {
      const double since = world.snapshot().time() - FlightPlanner::kLag;
      const bool swings = since > 0 && since < FlightPlanner::kSwitch;
      const double s = std::clamp(since / FlightPlanner::kSwitch, 0., 1.);
      sim::Torque torque{VectorXd::Zero(2)};
      for (int i = 0; i < 2; ++i) {
        const sim::Joint& joint = model->joints()[static_cast<size_t>(i)];
        const double rate = swings ? to[i] / FlightPlanner::kSwitch : 0;
        torque.tau[joint.motor] = 2000 * (s * to[i] - world.snapshot().q()[joint.q]) +
                                  60 * (rate - world.snapshot().v()[joint.v]);
      }
      world.step(torque);
    }
    const sim::Turn turn = sim::Turn::of(world.snapshot().bodyRotation(model->root()));
    const double rigid = 0.5 * plan.touch_down.time;
    EXPECT_GT(std::abs(turn.somersault - rigid), 0.2);  // what the arms did
    EXPECT_NEAR(turn.somersault, plan.touch_down.turn.somersault, 0.04);
    EXPECT_NEAR(turn.tilt, plan.touch_down.turn.tilt, 0.04);
    EXPECT_NEAR(turn.heading, plan.touch_down.turn.heading, 0.04);
  }
}

}  // namespace
}  // namespace traceur::flight
