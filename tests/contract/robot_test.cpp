// What every robot under models/ must hold, by being there.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "traceur/control/stable_pd.h"
#include "traceur/sim/world.h"

namespace traceur {
namespace {

namespace fs = std::filesystem;
using sim::Contact;
using sim::Joint;
using sim::Robot;
using sim::State;
using sim::Vector3d;

std::vector<std::string> allRobots() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator("models")) {
    if (fs::exists(entry.path() / "robot.toml")) names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class RobotContract : public testing::TestWithParam<std::string> {
 protected:
  RobotContract()
      : robot(std::make_shared<const Robot>(
            Robot::fromFile(fs::path("models") / GetParam() / "robot.toml"))),
        model(sim::Model::fromScene({.robot = robot})) {}

  std::shared_ptr<const Robot> robot;
  std::shared_ptr<const sim::Model> model;
};

/// Top of the robot above the ground: where a plane coming down would first touch.
double height(const sim::Model& model) {
  // The robot upside down, put on the ground, says how far its top is from its root.
  sim::Pose flipped;
  flipped.root_rpy = {M_PI, 0, 0};
  return model.stateOf({}).q[2] + model.stateOf(flipped).q[2];
}

TEST_P(RobotContract, HasItsPublishedFigures) {
  ASSERT_TRUE(robot->published) << "robot.toml: [published] is what it is known by";
  const sim::PublishedFigures& p = *robot->published;
  EXPECT_NEAR(model->mass(), p.mass, 0.005 * p.mass);
  EXPECT_NEAR(height(*model), p.height, 0.02 * p.height);
  EXPECT_EQ(static_cast<int>(model->joints().size()), p.joints);
  EXPECT_EQ(model->rootDofs(), 6);
  EXPECT_EQ(model->nv(), p.joints + 6);
  EXPECT_EQ(model->nu(), p.joints);
  sim::World world(model);
  world.reset(model->stateOf({}));
  EXPECT_NEAR(world.snapshot().com().z(), p.com_height, 0.02 * p.height);
}

TEST_P(RobotContract, EveryJointHasLimitsGainsAndAMotor) {
  for (const Joint& j : model->joints()) {
    EXPECT_GE(j.motor, 0) << j.name;
    EXPECT_TRUE(std::isfinite(j.limit.torque) && j.limit.torque > 0) << j.name;
    EXPECT_TRUE(std::isfinite(j.limit.speed) && j.limit.speed > 0) << j.name;
    EXPECT_LT(j.limit.min, j.limit.max) << j.name;
    ASSERT_TRUE(robot->gains.contains(j.name)) << j.name;
    EXPECT_GT(robot->gains.at(j.name).kp, 0) << j.name;
  }
  for (const auto& [name, pose] : robot->poses) {
    for (const auto& [joint, angle] : pose.joints) {
      EXPECT_GE(angle, model->joint(joint).limit.min) << name << " " << joint;
      EXPECT_LE(angle, model->joint(joint).limit.max) << name << " " << joint;
    }
  }
}

TEST_P(RobotContract, LeftMirrorsRight) {
  ASSERT_FALSE(robot->mirrored.empty());
  sim::World world(model);
  double angle = 0.05;
  sim::Pose pose;
  for (const auto& [name, pair] : robot->mirrored) {
    pose.joints[pair.left] = angle;
    pose.joints[pair.right] = pair.sign * angle;
    angle = 0.4 - angle;  // no two neighbours alike
  }
  world.reset(model->stateOf(pose));
  const sim::Snapshot& s = world.snapshot();
  // The robot's trunk may carry asymmetric parts of a few grams; its limbs may not.
  EXPECT_NEAR(s.com().y(), 0, 1e-3 * robot->published->height);
  for (const auto& [name, pair] : robot->mirrored) {
    const auto left = model->joint(pair.left);
    const auto right = model->joint(pair.right);
    EXPECT_NEAR(left.limit.torque, right.limit.torque, 1e-9) << name;
    EXPECT_NEAR(pair.sign > 0 ? left.limit.min : -left.limit.max, right.limit.min, 1e-9) << name;
  }
  for (const auto& [name, bodies] : robot->limbs) {
    if (!name.starts_with("left_")) continue;
    const std::string other = "right_" + name.substr(5);
    ASSERT_TRUE(robot->limbs.contains(other)) << name;
    ASSERT_EQ(robot->limbs.at(other).size(), bodies.size()) << name;
    for (size_t i = 0; i < bodies.size(); ++i) {
      const sim::BodyId l = model->body(bodies[i]);
      const sim::BodyId r = model->body(robot->limbs.at(other)[i]);
      const Vector3d mirrored = s.bodyCom(r).cwiseProduct(Vector3d(1, -1, 1));
      EXPECT_LT((s.bodyCom(l) - mirrored).norm(), 2e-3 * robot->published->height) << bodies[i];
      EXPECT_NEAR(model->bodyMass(l), model->bodyMass(r), 1e-9) << bodies[i];
    }
  }
  for (const auto& [name, point] : robot->contacts) {
    if (!name.starts_with("left_")) continue;
    const std::string other = "right_" + name.substr(5);
    ASSERT_TRUE(robot->contacts.contains(other)) << name;
    const Vector3d mirrored = robot->contacts.at(other).p_BP.cwiseProduct(Vector3d(1, -1, 1));
    EXPECT_LT((point.p_BP - mirrored).norm(), 2e-3 * robot->published->height) << name;
  }
}

TEST_P(RobotContract, NoPosePenetratesTheGroundOrTheRobot) {
  sim::World world(model);
  for (const auto& [name, pose] : robot->poses) {
    world.reset(model->stateOf(pose));
    double fz = 0;
    for (const Contact& c : world.snapshot().contacts()) {
      EXPECT_NE(model->isStatic(c.body_a), model->isStatic(c.body_b))
          << name << ": " << model->bodyName(c.body_a) << " touches " << model->bodyName(c.body_b);
      fz += c.f_WC.z();
    }
    // Touching without depth, the ground gives at most the weight that leans on it.
    EXPECT_LE(fz, 1.01 * model->mass() * 9.81) << name;
  }
}

TEST_P(RobotContract, StandsFiveSecondsWithoutDriftingACentimetre) {
  ASSERT_TRUE(robot->poses.contains("stand"));
  for (const double time_step : {0.001, 0.002}) {
    const auto m = sim::Model::fromScene({.robot = robot, .time_step = time_step});
    sim::World world(m);
    const State start = m->stateOf(robot->poses.at("stand"));
    world.reset(start);
    control::StablePd pd = control::defaultController(m);
    const control::JointTarget target = control::targetOf(*m, start);
    const Vector3d com = world.snapshot().com();
    sim::Torque command;
    Eigen::VectorXd tau(m->nv());
    double drift = 0;
    double fastest = 0;
    const int steps = static_cast<int>(std::lround(5 / time_step));
    for (int i = 0; i < steps; ++i) {
      tau.setZero();
      pd.addTorque(world.snapshot(), target, tau);
      control::toMotors(*m, tau, command);
      world.step(command);
      drift = std::max(drift, (world.snapshot().com() - com).norm());
      if (2 * i > steps) {
        fastest = std::max(fastest, world.snapshot().v().cwiseAbs().maxCoeff());
      }
    }
    EXPECT_FALSE(world.diverged());
    EXPECT_LT(drift, 0.01) << "at " << time_step << " s";
    EXPECT_LT(fastest, 0.02) << "it vibrates at " << time_step << " s";
    for (const Contact& c : world.snapshot().contacts()) {
      const auto& feet = robot->bodies.at("feet");
      const std::string body = m->bodyName(m->isStatic(c.body_a) ? c.body_b : c.body_a);
      EXPECT_NE(std::find(feet.begin(), feet.end(), body), feet.end()) << body;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, RobotContract, testing::ValuesIn(allRobots()),
                         [](const auto& tested) {
                           std::string name = tested.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace traceur
