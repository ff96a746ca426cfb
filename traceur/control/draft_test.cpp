// What is drafted of a robot of which nothing is known but its model.
#include "traceur/control/draft.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"

namespace traceur::control {
namespace {

namespace fs = std::filesystem;

using sim::Robot;
using sim::Vector3d;

const TestFolder& folder() {
  static const TestFolder kFolder;
  return kFolder;
}

std::string written(const std::string& name, const std::string& text) {
  std::ofstream(folder() / name, std::ios::binary) << text;
  return folder() / name;
}

Draft draftOf(const fs::path& file) {
  return draftRobot(Robot::fromFile(file));
}

/// The robot that the draft's text says, read by who reads any.
Robot readBack(const Draft& draft) {
  return Robot::fromFile(written("back.toml", tomlOf(draft, folder() / "")));
}

void expectEqual(const Robot& a, const Robot& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.description, b.description);
  EXPECT_TRUE(fs::equivalent(a.file, b.file));
  EXPECT_EQ(a.limbs, b.limbs);
  EXPECT_EQ(a.bodies, b.bodies);
  ASSERT_EQ(a.mirrored.size(), b.mirrored.size());
  for (const auto& [name, pair] : a.mirrored) {
    ASSERT_TRUE(b.mirrored.contains(name)) << name;
    EXPECT_EQ(pair.left, b.mirrored.at(name).left) << name;
    EXPECT_EQ(pair.right, b.mirrored.at(name).right) << name;
    EXPECT_EQ(pair.sign, b.mirrored.at(name).sign) << name;
  }
  ASSERT_EQ(a.limits.size(), b.limits.size());
  for (const auto& [name, limit] : a.limits) {
    ASSERT_TRUE(b.limits.contains(name)) << name;
    const sim::JointLimit& other = b.limits.at(name);
    EXPECT_EQ(limit.torque, other.torque) << name;
    EXPECT_EQ(limit.speed, other.speed) << name;
    EXPECT_EQ(limit.min, other.min) << name;
    EXPECT_EQ(limit.max, other.max) << name;
  }
  ASSERT_EQ(a.gains.size(), b.gains.size());
  for (const auto& [name, gain] : a.gains) {
    ASSERT_TRUE(b.gains.contains(name)) << name;
    EXPECT_EQ(gain.kp, b.gains.at(name).kp) << name;
    EXPECT_EQ(gain.kd, b.gains.at(name).kd) << name;
  }
  ASSERT_EQ(a.contacts.size(), b.contacts.size());
  for (const auto& [name, point] : a.contacts) {
    ASSERT_TRUE(b.contacts.contains(name)) << name;
    EXPECT_EQ(point.body, b.contacts.at(name).body) << name;
    EXPECT_EQ(point.p_BP, b.contacts.at(name).p_BP) << name;
  }
  for (const auto& [name, pose] : a.poses) {
    ASSERT_TRUE(b.poses.contains(name)) << name;
    EXPECT_EQ(pose.root_rpy, b.poses.at(name).root_rpy) << name;
    EXPECT_EQ(pose.joints, b.poses.at(name).joints) << name;
  }
}

std::string replaced(std::string text, const std::string& word, const std::string& by) {
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + by.size())) {
    text.replace(at, word.size(), by);
  }
  return text;
}

/// A leg of hip, knee and ankle across the sagittal plane, and a foot.
/// @param y  of the hip [m]
std::string leg(const std::string& side, double y, const std::string& knee = "0 1 0") {
  return fmt::format(
      R"(<body name="{0}thigh" pos="0 {1} -.1"><joint name="{0}hip" axis="0 1 0" range="-2 2"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.3" size=".04" mass="2"/>
    <body name="{0}shin" pos="0 0 -.3"><joint name="{0}knee" axis="{2}" range="-2 2"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.25" size=".03" mass="1"/>
      <body name="{0}foot" pos="0 0 -.3"><joint name="{0}ankle" axis="0 1 0" range="-1 1"/>
        <geom type="box" size=".1 .05 .01" pos=".03 0 -.03" mass=".5"/></body></body></body>)",
      side, y, knee);
}

std::string biped(const std::string& legs, const std::string& more = "",
                  const std::string& name = "b", const std::string& base = "<freejoint/>") {
  return fmt::format(R"(<mujoco model="{}"><compiler angle="radian"/><worldbody>
    <body name="pelvis" pos="0 0 1">{}<geom type="box" size=".08 .12 .15" pos="0 0 .1" mass="10"/>{}</body>
    </worldbody>{}</mujoco>)",
                     name, base, legs, more);
}

const std::string kLegs = leg("left_", 0.1) + leg("right_", -0.1);

class OurRobots : public testing::TestWithParam<const char*> {
 protected:
  fs::path at = fs::path("models") / GetParam();
  Robot by_hand = Robot::fromFile(at / "robot.toml");
  Draft draft = draftOf(at / "robot.xml");
};

TEST_P(OurRobots, PairsAndSignsAreThoseFoundByHand) {
  ASSERT_EQ(draft.robot.mirrored.size(), by_hand.mirrored.size());
  for (const auto& [name, pair] : by_hand.mirrored) {
    ASSERT_TRUE(draft.robot.mirrored.contains(name)) << name;
    const sim::MirroredPair& found = draft.robot.mirrored.at(name);
    EXPECT_EQ(found.left, pair.left) << name;
    EXPECT_EQ(found.right, pair.right) << name;
    EXPECT_EQ(found.sign, pair.sign) << name;
  }
}

TEST_P(OurRobots, LimbsFeetAndSolesAreThoseFoundByHand) {
  for (const char* limb : {"left_leg", "right_leg", "left_arm", "right_arm"}) {
    EXPECT_EQ(draft.robot.limbs.at(limb), by_hand.limbs.at(limb)) << limb;
  }
  for (const char* group : {"feet", "hands", "legs", "arms"}) {
    EXPECT_EQ(draft.robot.bodies.at(group), by_hand.bodies.at(group)) << group;
  }
  for (const std::string end : {"left_toe", "right_toe", "left_heel", "right_heel"}) {
    const sim::ContactPoint& outer = draft.robot.contacts.at(end + "_outer");
    const sim::ContactPoint& inner = draft.robot.contacts.at(end + "_inner");
    const sim::ContactPoint& middle = by_hand.contacts.at(end);
    EXPECT_EQ(outer.body, middle.body);
    EXPECT_LT(((outer.p_BP + inner.p_BP) / 2 - middle.p_BP).norm(), 2e-3) << end;
    const double side = end.starts_with("left") ? 1 : -1;
    EXPECT_GT(side * (outer.p_BP.y() - inner.p_BP.y()), 0.02) << end;
  }
}

TEST_P(OurRobots, StandsAsWrittenWithTheRobotsDefaultController) {
  EXPECT_TRUE(draft.standing.stands);
  const auto robot = std::make_shared<const Robot>(readBack(draft));
  const auto model = sim::Model::fromScene({.robot = robot, .time_step = 0.002});
  sim::World world(model);
  const sim::State start = model->stateOf(robot->poses.at("stand"));
  world.reset(start);
  StablePd pd = defaultController(model);
  const JointTarget target = targetOf(*model, start);
  const Vector3d com = world.snapshot().com();
  sim::Torque command;
  VectorXd tau(model->nv());
  for (int i = 0; i < 1500; ++i) {  // 3 s
    tau.setZero();
    pd.addTorque(world.snapshot(), target, tau);
    toMotors(*model, tau, command);
    world.step(command);
  }
  EXPECT_LT((world.snapshot().com() - com).norm(), 0.02 * com.z());
  EXPECT_LT(world.snapshot().v().cwiseAbs().maxCoeff(), 0.05);
}

TEST_P(OurRobots, TheTextSaysAllOfTheDraft) {
  expectEqual(draft.robot, readBack(draft));
}

INSTANTIATE_TEST_SUITE_P(Models, OurRobots, testing::Values("atlas", "bioloid-gp"),
                         [](const auto& tested) { return replaced(tested.param, "-", "_"); });

TEST(Draft, SignsFollowTheAxesAndWrongNamesAreNoPairs) {
  const auto signs = [](const std::string& legs) {
    const Draft draft = draftOf(written("signs.xml", biped(legs)));
    return draft.robot.mirrored;
  };
  EXPECT_EQ(signs(kLegs).at("knee").sign, 1);
  // The right knee's axis points the other way: the same bend is the opposite angle.
  EXPECT_EQ(signs(leg("left_", 0.1) + leg("right_", -0.1, "0 -1 0")).at("knee").sign, -1);
  // About x, left and right turn opposite ways for equal motions; about y and z see the robots.
  EXPECT_EQ(signs(leg("left_", 0.1, "1 0 0") + leg("right_", -0.1, "1 0 0")).at("knee").sign, -1);
  // An axis askew is no mirror image, whatever its name.
  EXPECT_FALSE(signs(leg("left_", 0.1) + leg("right_", -0.1, "0 1 1")).contains("knee"));
  const Draft askew =
      draftOf(written("askew.xml", biped(leg("left_", 0.1) + leg("right_", -0.1, "0 1 1"))));
  ASSERT_FALSE(askew.doubts.empty());
  EXPECT_TRUE(std::any_of(askew.doubts.begin(), askew.doubts.end(), [](const std::string& d) {
    return d.find("left_knee and right_knee") != std::string::npos;
  }));
}

TEST(Draft, SidesAreSaidInManyWaysOrOnlyByPlace) {
  for (const auto& [left, right] : std::vector<std::pair<std::string, std::string>>{
           {"left_", "right_"}, {"Left", "Right"}, {"L_", "R_"}, {"l", "r"}, {"a_", "b_"}}) {
    const Draft draft = draftOf(written("sides.xml", biped(leg(left, 0.1) + leg(right, -0.1))));
    ASSERT_EQ(draft.robot.mirrored.size(), 3U) << left;
    EXPECT_EQ(draft.robot.limbs.size(), 2U) << left;
    for (const auto& [name, pair] : draft.robot.mirrored) {
      EXPECT_TRUE(pair.left.starts_with(left)) << name;
      EXPECT_TRUE(pair.right.starts_with(right)) << name;
      EXPECT_EQ(pair.left.substr(left.size()), pair.right.substr(right.size())) << name;
    }
    EXPECT_TRUE(draft.standing.stands) << left;
    expectEqual(draft.robot, readBack(draft));
  }
}

TEST(Draft, SoleIsLevelUnderTheCentreOfMassAndKneesAreBent) {
  const Draft draft = draftOf(written("bent.xml", biped(kLegs)));
  ASSERT_TRUE(draft.standing.stands);
  const sim::Pose& stand = draft.robot.poses.at("stand");
  EXPECT_NEAR(stand.joints.at("left_knee"), 0.25, 1e-9);
  sim::World world(draft.model);
  world.reset(draft.model->stateOf(stand));
  const sim::Snapshot& s = world.snapshot();
  const sim::BodyId foot = draft.model->body("left_foot");
  EXPECT_NEAR(s.bodyRotation(foot)(2, 2), 1, 1e-7);
  EXPECT_NEAR(s.com().x(), s.bodyPosition(foot).x() + 0.03, 1e-3);  // the foot's box is 3 cm ahead
}

TEST(Draft, AKeyFrameThatStandsIsTheStandAndOneThatLiesIsNot) {
  const std::string lies = R"(<key name="lies" qpos="0 0 1  .7071 0 .7071 0  0 0 0  0 0 0"/>)";
  const std::string crouches =
      R"(<key name="crouches" qpos="0 0 1  1 0 0 0  -.4 .6 -.2  -.4 .6 -.2"/>)";
  const auto with = [&](const std::string& keys) {
    return draftOf(written("keys.xml", biped(kLegs, "<keyframe>" + keys + "</keyframe>")));
  };
  EXPECT_EQ(with(lies).stand_is, draftOf(written("no_key.xml", biped(kLegs))).stand_is);
  const Draft draft = with(lies + crouches);
  EXPECT_NE(draft.stand_is.find("crouches"), std::string::npos) << draft.stand_is;
  EXPECT_NEAR(draft.robot.poses.at("stand").joints.at("right_knee"), 0.6, 1e-9);
  expectEqual(draft.robot, readBack(draft));
}

TEST(Draft, OneThatCannotStandIsSaidToFall) {
  Robot weak = Robot::fromFile(written("weak.xml", biped(kLegs)));
  for (const char* joint :
       {"left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle"}) {
    weak.limits[joint] = {0.01, 1, -2, 2};
  }
  const Draft draft = draftRobot(weak);
  EXPECT_FALSE(draft.standing.stands);
  EXPECT_LT(draft.standing.time, kHeld);
  EXPECT_NE(tomlOf(draft, folder() / "").find("does NOT stand"), std::string::npos);
  expectEqual(draft.robot, readBack(draft));
}

TEST(Draft, AFixedBaseHasNoStandAndAnEndlessJointNoAngles) {
  const std::string arm =
      R"(<body name="arm" pos="0 0 .3"><joint name="turns" axis="0 0 1" actuatorfrcrange="-3 3"/>
      <geom size=".1" mass="1"/></body>)";
  const Draft draft = draftOf(written("fixed.xml", biped(arm, "", "f", "")));
  EXPECT_TRUE(draft.robot.poses.empty());
  EXPECT_EQ(draft.robot.limits.at("turns").torque, 3);
  EXPECT_TRUE(std::isinf(draft.robot.limits.at("turns").max));
  expectEqual(draft.robot, readBack(draft));
}

TEST(Draft, NamesOfStrangersCannotBreakTheText) {
  // A quote, a line feed with a table's head after it, a backslash, and letters of another script.
  const std::string odd = "&quot;&#10;[poses]&#10;x = &apos;\\u0041\\ ✓ # ";
  const std::string plain = "\"\n[poses]\nx = '\\u0041\\ ✓ # ";
  const Draft draft =
      draftOf(written("odd.xml", biped(leg("left_" + odd, 0.1) + leg("right_" + odd, -0.1),
                                       "<keyframe><key name=\"" + odd +
                                           "\" qpos=\"0 0 1 1 0 0 0 0 0 0 0 0 0\"/></keyframe>",
                                       odd)));
  EXPECT_EQ(draft.robot.name, plain);
  EXPECT_NE(draft.stand_is.find("key frame"), std::string::npos) << draft.stand_is;
  EXPECT_TRUE(draft.robot.gains.contains("left_" + plain + "hip"));
  const Robot back = readBack(draft);
  expectEqual(draft.robot, back);
  EXPECT_NO_THROW(sim::Model::fromScene({.robot = std::make_shared<const Robot>(back)}));
}

TEST(Draft, ANameThatIsNotUtf8IsRefused) {
  Draft draft = draftOf(written("utf.xml", biped(kLegs)));
  draft.robot.name = "\xff";
  EXPECT_THROW(tomlOf(draft, folder() / ""), InputError);
}

}  // namespace
}  // namespace traceur::control
