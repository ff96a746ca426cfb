// Where shapes end, what joints carry, and what a file says of poses.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>

#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/sim/world.h"

namespace traceur::sim {
namespace {

Vector3d someDirection(Random& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

/// A point of a shape's surface in its own axes, of half sizes s.
Vector3d surfacePoint(const std::string& shape, const Vector3d& s, Random& random) {
  const Vector3d u = someDirection(random);
  if (shape == "sphere") return s[0] * u;
  if (shape == "ellipsoid") return s.cwiseProduct(u);
  if (shape == "box") return s.cwiseProduct(u / u.cwiseAbs().maxCoeff());
  const double along = s[1] * (2 * random.uniform() - 1);
  const Vector3d ring = s[0] * Vector3d(u.x(), u.y(), 0).normalized();
  if (shape == "cylinder") return ring + Vector3d(0, 0, u.z() > 0 ? s[1] : -s[1]);
  return random.uniform() < 0.5 ? Vector3d(ring + Vector3d(0, 0, along))
                                : Vector3d(s[0] * u + Vector3d(0, 0, u.z() > 0 ? s[1] : -s[1]));
}

TEST(FarthestPoint, NoPointOfTheSurfaceIsFartherAndSomeAreAsFar) {
  Random random(7);
  const Vector3d size(0.3, 0.2, 0.1);
  for (const std::string shape : {"sphere", "capsule", "cylinder", "ellipsoid", "box"}) {
    const auto model = Model::fromMjcf(fmt::format(
        R"(<mujoco><worldbody><body name="b" pos="1 2 3" euler="30 40 50"><freejoint/>
           <geom type="{}" size=".3 .2 .1" pos=".1 .2 .3" euler="10 60 20" mass="1"/></body></worldbody></mujoco>)",
        shape));
    World world(model);
    const BodyId body = model->body("b");
    const auto euler = [](double x, double y, double z) {
      const auto turn = [](double degrees, const Vector3d& axis) {
        return Eigen::AngleAxisd(degrees * M_PI / 180, axis);
      };
      return Eigen::Quaterniond(turn(x, Vector3d::UnitX()) * turn(y, Vector3d::UnitY()) *
                                turn(z, Vector3d::UnitZ()));
    };
    for (int trial = 0; trial < 10; ++trial) {
      const Vector3d u = someDirection(random);
      const auto point = world.snapshot().farthestPoint(body, u);
      ASSERT_TRUE(point) << shape;
      double most = -1e9;
      for (int i = 0; i < 20000; ++i) {
        const Vector3d p =
            Vector3d(1, 2, 3) +
            euler(30, 40, 50) *
                (Vector3d(0.1, 0.2, 0.3) + euler(10, 60, 20) * surfacePoint(shape, size, random));
        most = std::max(most, u.dot(p));
      }
      EXPECT_LE(most, u.dot(*point) + 1e-9) << shape;
      EXPECT_GE(most, u.dot(*point) - 0.02) << shape;
    }
  }
}

TEST(FarthestPoint, WhatTouchesNothingHasNone) {
  const auto model = Model::fromMjcf(
      R"(<mujoco><worldbody><body name="b"><freejoint/><geom size=".1" contype="0" conaffinity="0" mass="1"/>
         </body></worldbody></mujoco>)");
  World world(model);
  EXPECT_FALSE(world.snapshot().farthestPoint(model->body("b"), Vector3d::UnitX()));
}

TEST(JointInertia, IsThatOfWhatHangsOnItWithItsMotor) {
  const auto model = Model::fromMjcf(
      R"(<mujoco><worldbody><body name="b"><joint name="j" axis="0 1 0" armature=".25"/>
         <geom type="sphere" size=".1" pos="0 0 -2" mass="3"/>
         <body pos="0 0 -1"><joint name="k" axis="0 1 0"/><geom type="sphere" size=".1" mass="2"/></body>
         </body></worldbody></mujoco>)");
  World world(model);
  const double ball = 0.4 * 0.1 * 0.1;  // 2/5 r²
  EXPECT_NEAR(world.snapshot().jointInertia(model->joint("j")),
              0.25 + 3 * (4 + ball) + 2 * (1 + ball), 1e-9);
  EXPECT_NEAR(world.snapshot().jointInertia(model->joint("k")), 2 * ball, 1e-9);
  EXPECT_EQ(world.snapshot().jointAxis(model->joint("k")), Vector3d::UnitY());
  EXPECT_EQ(world.snapshot().jointAnchor(model->joint("k")), Vector3d(0, 0, -1));
  EXPECT_TRUE(model->hangsOn(model->bodyOf(model->joint("k")), model->body("b")));
  EXPECT_FALSE(model->hangsOn(model->body("b"), model->bodyOf(model->joint("k"))));
}

TEST(Rotation, AnglesComeBack) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Vector3d rpy(6 * random.uniform() - 3, 3 * random.uniform() - 1.5,
                       6 * random.uniform() - 3);
    EXPECT_LT((rpyOf(rotationOf(rpy)) - rpy).norm(), 1e-9);
  }
}

TEST(KeyPoses, AreThoseOfTheFileByName) {
  const TestFolder folder;
  std::ofstream(folder / "keys.xml")
      << R"(<mujoco model="two"><worldbody><body name="b" pos="0 0 1"><freejoint/>
    <geom size=".1" mass="1"/><body><joint name="j" axis="0 1 0"/><geom size=".1" mass="1"/></body></body></worldbody>
    <keyframe><key name="bent" qpos="0 0 1 0.8775825619 0 0.4794255386 0 .5"/><key qpos="0 0 1 1 0 0 0 0"/></keyframe>
    </mujoco>)";
  const Robot robot = Robot::fromFile(folder / "keys.xml");
  const auto poses = keyPoses(robot);
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses.at("bent").joints.at("j"), 0.5);
  EXPECT_LT((poses.at("bent").root_rpy - Vector3d(0, 1, 0)).norm(), 1e-8);
  EXPECT_TRUE(poses.at("key 1").joints.empty());
  EXPECT_EQ(Model::fromScene({.robot = std::make_shared<const Robot>(robot)})->name(), "two");
}

TEST(Limits, WithoutAnglesAreTheFiles) {
  const TestFolder folder;
  std::ofstream(folder / "limit.xml")
      << R"(<mujoco><compiler angle="radian"/><worldbody><body name="b"><freejoint/><geom size=".1" mass="1"/>
    <body><joint name="j" axis="0 1 0" range="-1 2"/><geom size=".1" mass="1"/></body></body></worldbody></mujoco>)";
  std::ofstream(folder / "robot.toml")
      << "name = \"r\"\nmodel = \"limit.xml\"\nlimits.j = { torque = 3, speed = 4 }\n";
  const auto robot = std::make_shared<const Robot>(Robot::fromFile(folder / "robot.toml"));
  const JointLimit limit = Model::fromScene({.robot = robot})->joint("j").limit;
  EXPECT_EQ(limit.torque, 3);
  EXPECT_EQ(limit.speed, 4);
  EXPECT_EQ(limit.min, -1);
  EXPECT_EQ(limit.max, 2);
}

}  // namespace
}  // namespace traceur::sim
