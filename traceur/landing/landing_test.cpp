#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/landing/falls.h"

namespace traceur::landing {
namespace {

/// The person, limp, dropped on its feet; or held in a pose.
std::shared_ptr<const skill::Skill> dropped(const char* stiffness, double height, double pitch) {
  return skill::Skill::fromText(fmt::format(R"(
name = "dropped"
robot = "human"
horizon = 8
[conditions]
height = {{ range = [0, 9], default = {} }}
forward = {{ range = [-9, 9], default = 0 }}
pitch_rate = {{ range = [-9, 9], default = 0 }}
miss = {{ range = [-1, 1], default = 0 }}
[parameters]
a = {{ range = [0, 1] }}
[start]
com_height = "height"
velocity = ["forward", 0, 0]
pitch = "{} + miss"
[start.pose]
base = "stand"
[[phase]]
name = "fall"
pose = {{ base = "stand" }}
stiffness = {}
damping = {}
[[objective]]
name = "none"
cost = 0
)",
                                            height, pitch, stiffness, stiffness),
                                "skills/human/test.toml");
}

Fall fall(const std::shared_ptr<const skill::Skill>& skill) {
  const std::vector<VectorXd> one = {skill->initialConditions()};
  return fallAll(skill, skill->initialParameters(), one, 1).front();
}

TEST(Judge, OfARagdollSaysWhatItBears) {
  const auto skill = dropped("0", 2.4, 0.1);
  const Fall f = fall(skill);
  ASSERT_TRUE(f.verdict.touch_down);
  // From 2.4 m until the soles, 0.9 m below, are on the ground.
  EXPECT_NEAR(*f.verdict.touch_down, std::sqrt(2 * (2.4 - 0.9) / 9.81), 0.02);
  EXPECT_NEAR(f.verdict.touch_down_speed, 9.81 * *f.verdict.touch_down, 0.2);
  EXPECT_NEAR(f.verdict.touch_down_somersault, 0.1, 0.05);
  EXPECT_FALSE(f.verdict.rolled);
  EXPECT_FALSE(f.verdict.stands());
  EXPECT_FALSE(f.verdict.safe());
  EXPECT_EQ(f.rollout.ended, "does not stand");
  EXPECT_NEAR(f.rollout.time, *f.verdict.touch_down + Judge::kPatience, 0.002);
  const int neck = skill->model->body("head").value;
  EXPECT_GT(f.verdict.stress[neck], 3.9 * 9.81);  // more than the head weighs
  EXPECT_LT(f.verdict.stress[neck], 1e5);
}

TEST(Judge, DoesNotTakeStandingForALanding) {
  const Fall f = fall(dropped("1", 0.92, 0));
  ASSERT_TRUE(f.verdict.touch_down);
  EXPECT_FALSE(f.verdict.rolled);
  EXPECT_FALSE(f.verdict.stands());
  EXPECT_EQ(f.verdict.head_force, 0);
}

TEST(Falls, AreDrawnByTheirNumberAndCountedOnAnyThreads) {
  const auto skill = dropped("0", 2.4, 0.1);
  const FallSet& set = findFallSet("easy");
  const auto all = drawFalls(*skill, set, 3, 5);
  EXPECT_EQ(drawFalls(*skill, set, 2, 5)[1], all[1]);
  EXPECT_NE(all[0], all[1]);
  EXPECT_NE(drawFalls(*skill, set, 1, 6)[0], all[0]);
  for (const VectorXd& one : all) {
    EXPECT_GE(one[0], 2.2);
    EXPECT_LE(one[0], 3.2);
  }
  const auto a = fallAll(skill, skill->initialParameters(), all, 1);
  const auto b = fallAll(skill, skill->initialParameters(), all, 2);
  for (size_t k = 0; k < all.size(); ++k) EXPECT_EQ(a[k].rollout.hash, b[k].rollout.hash);
  EXPECT_THROW(findFallSet("esy"), InputError);
  EXPECT_THROW(drawFalls(*skill, findFallSet("m2"), 1, 1), InputError);  // it knows no yaw
}

TEST(Share, HasWilsonsInterval) {
  const Share s{97, 100};
  EXPECT_NEAR(s.value(), 0.97, 1e-12);
  EXPECT_NEAR(s.low(), 0.9155, 5e-4);  // of the published tables
  EXPECT_NEAR(s.high(), 0.9897, 5e-4);
  EXPECT_EQ(Share({0, 10}).low(), 0);
  EXPECT_NEAR(Share({0, 10}).high(), 0.2775, 5e-4);
}

}  // namespace
}  // namespace traceur::landing
