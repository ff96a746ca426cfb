#include "traceur/control/actuation.h"

#include <gtest/gtest.h>

namespace traceur::control {
namespace {

/// A rod of 1 kg m² about a hinge, its tip 1 m from it, in space; a motor of at most 50 N m.
std::shared_ptr<const sim::Model> rod() {
  static const auto kModel = sim::Model::fromMjcf(R"(<mujoco>
    <option timestep="0.001" gravity="0 0 0" integrator="Euler"/>
    <worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
    <actuator><motor name="hinge" joint="hinge" gear="1"/></actuator></mujoco>)");
  return kModel;
}

struct HingeBench {
  sim::World world{rod()};
  Actuation actuation;
  Command command;
  sim::Torque torque;

  HingeBench() : actuation(limited()) {
    world.reset({0, VectorXd::Zero(1), VectorXd::Zero(1)});
    command.target.q = VectorXd::Constant(1, 0.1);
  }
  static StablePd limited() {
    StablePd pd(rod(), {{.kp = 100, .kd = 1000}});
    pd.limits()[0].torque = 50;
    return pd;
  }
  double operator()() {
    actuation.torque(world.snapshot(), command, torque);
    return torque.tau[0];
  }
};

/// By hand: (1 + kd Δt) v̇ = τ₀ + kp (0.1 - 0), τ = kp 0.1 - kd Δt v̇.
double pd(double expected) {
  return 10 - 1 * (expected + 10) / 2;
}

TEST(Actuation, GainsAreTheRobotsTimesTheCommandsFactors) {
  HingeBench b;
  EXPECT_NEAR(b(), pd(0), 1e-9);
  b.command.stiffness = VectorXd::Constant(1, 0.5);
  EXPECT_NEAR(b(), 5 - 5.0 / 2, 1e-9);
  b.command.damping = VectorXd::Zero(1);
  EXPECT_NEAR(b(), 5, 1e-9);
  b.command.stiffness.setZero();
  EXPECT_EQ(b(), 0);  // limp
  b.command.stiffness.resize(0);
  b.command.damping.resize(0);
  EXPECT_NEAR(b(), pd(0), 1e-9);  // nothing of it stays
}

TEST(Actuation, ForcesAreExpectedOrNotAndLimitedOrNot) {
  HingeBench b;
  // 30 N m about the hinge: at 1 m along -z about +y pushes x; both as forces on the rod's body.
  b.command.forces = {{.body = rod()->body("rod"), .p_BP = {0, 0, 1}, .f = {30, 0, 0}}};
  EXPECT_NEAR(b(), 30 + pd(30), 1e-9);
  b.command.expected = false;
  EXPECT_NEAR(b(), 30 + pd(0), 1e-9);
  b.command.forces[0].f.x() = 70;
  EXPECT_EQ(b(), 50);  // both together
  b.command.expected = true;
  EXPECT_EQ(b(), 70 + pd(70) > 50 ? 50 : 70 + pd(70));
  b.command.limited = false;
  EXPECT_NEAR(b(), 70 + pd(70), 1e-9);
  b.command.expected = false;
  EXPECT_NEAR(b(), 70 + pd(0), 1e-9);
  b.command.target.q[0] = 10;  // the PD's own share is always limited
  EXPECT_NEAR(b(), 70 + 50, 1e-9);
}

TEST(Actuation, AnIntegralGainHoldsAgainstAConstantForce) {
  // The tip 1 m along -z, pushed by 5 N along x: a moment of 5 N m that PD alone gives way to.
  const auto settled = [](double ki, double force) {
    sim::World world(rod());
    StablePd gains(rod(), {{.kp = 100, .kd = 20, .ki = ki}});
    gains.limits()[0].torque = 50;
    Actuation actuation(std::move(gains));
    world.reset({0, VectorXd::Zero(1), VectorXd::Zero(1)});
    Command command;
    command.target.q = VectorXd::Zero(1);
    sim::Torque torque;
    world.push(world.model().body("rod"), sim::Vector3d::Zero(), {0, force, 0});
    for (int i = 0; i < 20000; ++i) {
      actuation.torque(world.snapshot(), command, torque);
      world.step(torque);
    }
    return std::pair(world.state().q[0], actuation.integral()[0]);
  };
  EXPECT_NEAR(settled(0, 5).first, 0.05, 1e-6);
  EXPECT_EQ(settled(0, 5).second, 0);
  const auto [q, integral] = settled(100, 5);
  EXPECT_NEAR(q, 0, 1e-6);
  EXPECT_NEAR(100 * integral, -5, 1e-3);
  // Against more than the motor has, it does not wind up.
  EXPECT_EQ(100 * settled(100, 500).second, -50);
}

TEST(Actuation, AnIntegralIsOfItsTrialAndFollowsTheStiffness) {
  Actuation actuation(StablePd(rod(), {{.kp = 0, .kd = 0, .ki = 10}}));
  sim::World world(rod());
  world.reset({0, VectorXd::Zero(1), VectorXd::Zero(1)});
  Command command;
  command.target.q = VectorXd::Constant(1, 2);
  sim::Torque torque;
  actuation.torque(world.snapshot(), command, torque);
  EXPECT_DOUBLE_EQ(torque.tau[0], 10 * 0.002);
  command.stiffness = VectorXd::Constant(1, 0.5);
  actuation.torque(world.snapshot(), command, torque);
  EXPECT_DOUBLE_EQ(torque.tau[0], 5 * 0.004);
  const VectorXd so_far = actuation.integral();
  actuation.begin();
  EXPECT_EQ(actuation.integral()[0], 0);
  actuation.begin(so_far);
  EXPECT_EQ(actuation.integral(), so_far);
}

}  // namespace
}  // namespace traceur::control
