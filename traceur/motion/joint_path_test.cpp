#include "traceur/motion/joint_path.h"

#include <gtest/gtest.h>

namespace traceur::motion {
namespace {

control::JointTarget target(double a, double b) {
  return {Eigen::Vector2d(a, b)};
}

TEST(JointPath, LeadsEvenlyThroughItsTargets) {
  const JointPath path(target(0, 1), {target(1, 1), target(1, 5)}, 0.4);
  const auto expect = [&](double t, double a, double b) {
    EXPECT_NEAR(path.at(t).q[0], a, 1e-12) << t;
    EXPECT_NEAR(path.at(t).q[1], b, 1e-12) << t;
  };
  expect(-1, 0, 1);
  expect(0, 0, 1);
  expect(0.1, 0.5, 1);
  expect(0.2, 1, 1);
  expect(0.3, 1, 3);
  expect(0.4, 1, 5);
  expect(9, 1, 5);
  EXPECT_FALSE(path.over(0.39));
  EXPECT_TRUE(path.over(0.4));
  EXPECT_EQ(path.end().q, target(1, 5).q);
}

TEST(JointPath, WithoutADurationIsThereAtOnce) {
  JointPath path(target(0, 0), {target(1, 1), target(2, 3)}, 0);
  EXPECT_EQ(path.at(0).q, target(2, 3).q);
  EXPECT_TRUE(path.over(0));
  path.end() = target(4, 4);
  EXPECT_EQ(path.at(0).q, target(4, 4).q);
  EXPECT_TRUE(JointPath().empty());
  EXPECT_FALSE(path.empty());
}

}  // namespace
}  // namespace traceur::motion
