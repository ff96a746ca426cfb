// What files and scenes say, and what becomes of it: robots, models, recordings.
#include "traceur/sim/model.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/sim/recording.h"
#include "traceur/sim/test_files.h"
#include "traceur/sim/world.h"

namespace traceur::sim {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

template <class Do>
std::string complaint(const Do& of) {
  try {
    of();
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

std::string mjcf(const std::string& bodies, const std::string& more = "") {
  return "<mujoco><worldbody>" + bodies + "</worldbody>" + more + "</mujoco>";
}

const char* const kArms = R"(<body name="trunk"><freejoint name="root"/><geom size=".1" mass="2"/>
  <body name="left" pos="0 .3 0"><joint name="l" axis="1 0 0"/><geom size=".1"/></body>
  <body name="right" pos="0 -.3 0"><joint name="r" axis="1 0 0"/><geom size=".1"/></body></body>)";

// ------------------------------------------------------------------------------------------ robots

TEST(Robot, EveryKeyIsReadIntoItsPlace) {
  file("full/arms.xml", mjcf(kArms));
  const std::string path = file("full/robot.toml", R"(
name = "full"
description = "all there is"
model = "arms.xml"
mass_scale = 1.25
published = { mass = 3, height = 0.5, com_height = 0.25, joints = 2, source = "a book" }
mirrored.arm = { left = "l", right = "r", sign = -1 }
mirrored.same = { left = "l", right = "r" }
limits.arm = { torque = 2, speed = 3, angle = [-0.5, 1.5] }
gains.arm = { kp = 7, kd = 0.5 }
limbs.both = ["left", "right"]
bodies.trunk = ["trunk"]
contacts.tip = { body = "left", at = [0.1, 0.2, 0.3] }
[poses]
up = { arm = 0.25, root = { roll = 0.1, pitch = 0.2, yaw = 0.3 } }
even = { same = 0.5, root = { pitch = -0.1 } }
)");
  const Robot r = Robot::fromFile(path);
  EXPECT_EQ(r.name, "full");
  EXPECT_EQ(r.description, "all there is");
  EXPECT_TRUE(r.file.is_absolute());
  EXPECT_EQ(r.file.filename(), "arms.xml");
  EXPECT_EQ(r.toml, path);
  EXPECT_EQ(r.mass_scale, 1.25);
  ASSERT_TRUE(r.published);
  EXPECT_EQ((std::vector<double>{r.published->mass, r.published->height, r.published->com_height}),
            (std::vector<double>{3, 0.5, 0.25}));
  EXPECT_EQ(r.published->joints, 2);
  EXPECT_EQ(r.published->source, "a book");
  const JointLimit& left = r.limits.at("l");
  EXPECT_EQ((std::vector<double>{left.torque, left.speed, left.min, left.max}),
            (std::vector<double>{2, 3, -0.5, 1.5}));
  const JointLimit& right = r.limits.at("r");
  EXPECT_EQ((std::vector<double>{right.torque, right.speed, right.min, right.max}),
            (std::vector<double>{2, 3, -1.5, 0.5}));
  for (const char* joint : {"l", "r"}) {
    EXPECT_EQ(r.gains.at(joint).kp, 7);
    EXPECT_EQ(r.gains.at(joint).kd, 0.5);
  }
  EXPECT_EQ(r.limbs.at("both"), std::vector<std::string>({"left", "right"}));
  EXPECT_EQ(r.bodies.at("trunk"), std::vector<std::string>({"trunk"}));
  EXPECT_EQ(r.contacts.at("tip").body, "left");
  EXPECT_EQ(r.contacts.at("tip").p_BP, Vector3d(0.1, 0.2, 0.3));
  const Pose& up = r.poses.at("up");
  EXPECT_EQ(up.root_rpy, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(up.joints, (std::map<std::string, double>{{"l", 0.25}, {"r", -0.25}}));
  const Pose& even = r.poses.at("even");
  EXPECT_EQ(even.root_rpy, Vector3d(0, -0.1, 0));
  EXPECT_EQ(even.joints, (std::map<std::string, double>{{"l", 0.5}, {"r", 0.5}}));
  const std::vector<SignedJoint> alone = r.jointsNamed("l");
  ASSERT_EQ(alone.size(), 1U);
  EXPECT_EQ(alone[0].joint, "l");
  EXPECT_EQ(alone[0].sign, 1);
  // What is not said.
  const Robot bare = Robot::fromFile(file("full/bare.toml", "name = \"b\"\nmodel = \"arms.xml\""));
  EXPECT_EQ(bare.mass_scale, 1);
  EXPECT_FALSE(bare.published);
  EXPECT_EQ(bare.description, "");
  const Robot mute = Robot::fromFile(file("full/mute.xml", mjcf(kArms)));
  EXPECT_EQ(mute.name, "mute");
  EXPECT_EQ(mute.toml, "");
}

TEST(Robot, NumbersEndWhereTheySay) {
  file("edges/arms.xml", mjcf(kArms));
  const auto with = [](const std::string& line) {
    return complaint([&] {
      Robot::fromFile(file("edges/robot.toml", "name = \"e\"\nmodel = \"arms.xml\"\n" + line));
    });
  };
  for (const char* good :
       {"", "mass_scale = 1e-9", "limits.l = { torque = inf, speed = 1e-9, angle = [0, 1e-9] }",
        "limits.l = { torque = 1e-9, speed = inf, angle = [-1, 0] }",
        "gains.l = { kp = 0, kd = 0 }", "mirrored.a = { left = \"l\", right = \"r\", sign = 1 }"}) {
    EXPECT_EQ(with(good), "accepted");
  }
  for (const auto& [bad, said] :
       {std::pair("mass_scale = 0", "expected a factor > 0"),
        {"mass_scale = -1", "expected a factor > 0"},
        {"limits.l = { torque = 0, speed = 1, angle = [0, 1] }", "\"torque\": expected a positive"},
        {"limits.l = { torque = 1, speed = 0, angle = [0, 1] }", "\"speed\": expected a positive"},
        {"limits.l = { torque = 1, speed = 1, angle = [1, 1] }", "min < max"},
        {"limits.l = { torque = 1, speed = 1, angle = [0, 1], x = 1 }", "x"},
        {"gains.l = { kp = -0.1, kd = 0 }", "\"kp\": expected"},
        {"gains.l = { kp = 0, kd = -0.1 }", "\"kd\": expected"},
        {"mirrored.a = { left = \"l\", right = \"r\", sign = 0 }", "expected 1 or -1"},
        {"mirrored.a = { left = \"l\", right = \"r\", sgn = 1 }", "Did you mean \"sign\"?"},
        {"contacts.tip = { body = \"left\", at = [0, 0, 0], on = 1 }", "on"},
        {"contacts.tip = { body = \"left\", at = [0, 0] }", "at"},
        {"poses.up = { root = { rol = 1 } }", "Did you mean \"roll\"?"},
        {"published = { mass = 3, height = 1, com_height = 1, joints = 2, source = \"\", x = 1 }",
         "x"}}) {
    expectIn(with(bad), said);
  }
  expectIn(complaint([] {
             Robot::fromFile(file("edges/lost.toml", "name = \"e\"\nmodel = \"lost.xml\"\n"));
           }),
           "\"model\": no file ");
}

TEST(Robot, AUrdfsLimitsAreThoseThatMeanSomething) {
  const auto joint = [](const char* name, const char* type, const char* limit) {
    return fmt::format("<joint name='{}' {}>{}</joint>", name, type, limit);
  };
  const Robot r = Robot::fromFile(
      file("limits.urdf",
           "<robot name='x'>" + joint("fixed", "type='fixed'", "<limit effort='1' velocity='1'/>") +
               joint("bare", "type='revolute'", "") +
               joint("wheel", "type='continuous'", "<limit effort='3' velocity='4'/>") +
               joint("loose", "type='revolute'", "<limit lower='-1' upper='2'/>") +
               joint("plain", "", "<limit effort='5' velocity='6' lower='-3' upper='-2'/>") +
               "<joint><limit effort='1'/></joint></robot>"));
  ASSERT_EQ(r.limits.size(), 3U);
  const auto limit = [&](const char* name) {
    const JointLimit& l = r.limits.at(name);
    return std::vector<double>{l.torque, l.speed, l.min, l.max};
  };
  EXPECT_EQ(limit("wheel"), (std::vector<double>{3, 4, -kNone, kNone}));
  EXPECT_EQ(limit("loose"), (std::vector<double>{kNone, kNone, -1, 2}));
  EXPECT_EQ(limit("plain"), (std::vector<double>{5, 6, -3, -2}));
  // Of others there is nothing to read.
  EXPECT_TRUE(Robot::fromFile(file("other.xml", "<mujoco>" + joint("a", "", "<limit effort='1'/>") +
                                                    "</mujoco>"))
                  .limits.empty());
  EXPECT_TRUE(Robot::fromFile(file("nothing.xml", "<!-- later -->")).limits.empty());
}

TEST(Robot, RollPitchAndYawAreAboutFixedAxes) {
  const double a = 0.3, b = -0.5, c = 1.2;
  const Eigen::Matrix3d R = rotationOf({a, b, c}).toRotationMatrix();
  Eigen::Matrix3d expected;
  expected << std::cos(c) * std::cos(b),
      std::cos(c) * std::sin(b) * std::sin(a) - std::sin(c) * std::cos(a),
      std::cos(c) * std::sin(b) * std::cos(a) + std::sin(c) * std::sin(a),
      std::sin(c) * std::cos(b),
      std::sin(c) * std::sin(b) * std::sin(a) + std::cos(c) * std::cos(a),
      std::sin(c) * std::sin(b) * std::cos(a) - std::cos(c) * std::sin(a), -std::sin(b),
      std::cos(b) * std::sin(a), std::cos(b) * std::cos(a);
  EXPECT_LT((R - expected).norm(), 1e-12);
}

// ------------------------------------------------------------------------------------------ models

TEST(Model, EveryNameOfARobotsFileMustMeanSomething) {
  file("names/arms.xml", mjcf(kArms));
  const auto with = [](const std::string& lines) {
    return complaint([&] {
      Model::fromScene({.robot = robotOf(file("names/robot.toml",
                                              "name = \"n\"\nmodel = \"arms.xml\"\n" + lines))});
    });
  };
  EXPECT_EQ(with("limits.l = { torque = 1, speed = 1, angle = [0, 1] }\nbodies.b = [\"left\"]"),
            "accepted");
  for (const auto& [wrong, said] :
       {std::pair("mirrored.m = { left = \"x1\", right = \"r\" }", "no joint named \"x1\""),
        {"mirrored.m = { left = \"l\", right = \"x2\" }", "no joint named \"x2\""},
        {"limits.x3 = { torque = 1, speed = 1, angle = [0, 1] }", "no joint named \"x3\""},
        {"gains.x4 = { kp = 1, kd = 1 }", "no joint named \"x4\""},
        {"contacts.x = { body = \"x5\", at = [0, 0, 0] }", "no body named \"x5\""},
        {"limbs.b = [\"left\", \"x6\"]", "no body named \"x6\""},
        {"bodies.b = [\"x7\", \"left\"]", "no body named \"x7\""},
        {"poses.p = { x8 = 1 }", "no joint named \"x8\""}}) {
    expectIn(with(wrong), said);
    expectIn(with(wrong), "robot.toml");
  }
}

TEST(Model, NamesItsBodiesAndJoints) {
  const auto model = Model::fromMjcf(mjcf(R"(<body><freejoint/><geom size=".1"/>
    <body name="shin" pos="0 0 .3"><joint type="ball"/><geom size=".1" mass="3"/>
      <body name="foot" pos="0 0 .3"><joint name="heel" range="-10 20" limited="true"/>
        <joint type="slide" axis="1 0 0"/><geom size=".1"/></body></body></body>)",
                                          "<actuator><motor joint='heel'/></actuator>"));
  EXPECT_EQ(model->body("world"), BodyId{0});
  EXPECT_EQ(model->body("foot"), BodyId{3});
  EXPECT_EQ(model->bodyName({0}), "world");
  EXPECT_EQ(model->bodyName({1}), "body 1");
  EXPECT_EQ(model->parent({3}), BodyId{2});
  EXPECT_EQ(model->parent({1}), BodyId{0});
  EXPECT_EQ(model->bodyMass({2}), 3);
  for (const char* name : {"world", "shin", "foot"}) {
    EXPECT_EQ(complaint([&] { model->body(std::string(name) + "x"); }),
              fmt::format("no body named \"{0}x\". Did you mean \"{0}\"?", name));
  }
  EXPECT_EQ(complaint([&] { model->joint("heal"); }),
            "no joint named \"heal\". Did you mean \"heel\"?");
  for (const int b : {1, 2, 3}) EXPECT_TRUE(model->isRobot({b}));
  for (const int b : {-1, 0, 4}) EXPECT_FALSE(model->isRobot({b}));
  EXPECT_TRUE(model->isStatic({0}));
  EXPECT_FALSE(model->isStatic({1}));
  EXPECT_EQ(model->ballJoints(), std::vector<std::string>{"joint 1"});
  // Hinges and slides alone, with the model's limits.
  ASSERT_EQ(model->joints().size(), 2U);
  const Joint& heel = model->joint("heel");
  const Joint& slide = model->joints()[1];
  EXPECT_EQ(slide.name, "joint 3");
  EXPECT_FALSE(heel.slides);
  EXPECT_TRUE(slide.slides);
  EXPECT_EQ((std::vector<int>{heel.q, heel.v, heel.motor, slide.q, slide.v, slide.motor}),
            (std::vector<int>{11, 9, 0, 12, 10, -1}));
  const double degree = M_PI / 180;
  EXPECT_NEAR(heel.limit.min, -10 * degree, 1e-9);
  EXPECT_NEAR(heel.limit.max, 20 * degree, 1e-9);
  EXPECT_EQ(heel.limit.torque, kNone);
  EXPECT_EQ(heel.limit.speed, kNone);
  EXPECT_EQ(slide.limit.min, -kNone);
  EXPECT_EQ(slide.limit.max, kNone);
  EXPECT_EQ(model->initialState().v, VectorXd(VectorXd::Zero(model->nv())));
  EXPECT_NO_THROW(Model::fromMjcf("<mujoco/>"));
}

TEST(Model, OnlyACommandInNewtonMetresIsAMotor) {
  // The second actuator; the first would mislead who reads the wrong one's numbers.
  const auto motor = [](const std::string& actuator) {
    return Model::fromMjcf(mjcf(kArms, "<actuator><general joint='l' gear='100' gainprm='3'/>" +
                                           actuator + "</actuator>"))
        ->joint("r")
        .motor;
  };
  EXPECT_EQ(motor("<motor joint='r'/>"), 1);
  EXPECT_EQ(motor("<general joint='r'/>"), 1);
  for (const char* other :
       {"<motor joint='r' gear='2'/>", "<general joint='r' dyntype='integrator'/>",
        "<general joint='r' gainprm='2'/>", "<general joint='r' gaintype='user'/>",
        "<general joint='r' biastype='affine'/>", "<motor jointinparent='r'/>",
        "<motor joint='r' ctrllimited='true' ctrlrange='-1 1'/>",
        "<motor joint='r' forcelimited='true' forcerange='-1 1'/>", "<motor joint='l'/>"}) {
    EXPECT_EQ(motor(other), -1) << other;
  }
}

TEST(Model, GravityAloneMovesWhatFloatsFree) {
  const auto alone = [](const std::string& root, const std::string& more = "",
                        const std::string& before = "") {
    return Model::fromMjcf(mjcf(before + "<body name='trunk'>" + root +
                                    "<geom size='.1'/><body pos='1 0 0'><joint name='j' "
                                    "damping='1' stiffness='1'/><geom size='.1'/></body></body>",
                                more))
        ->gravityAlone();
  };
  EXPECT_TRUE(alone("<freejoint/>"));
  // A damped hinge beside it is none of its own.
  EXPECT_TRUE(
      alone("<freejoint/>", "",
            "<body pos='0 0 3'><joint damping='1' stiffness='1'/><geom size='.1'/></body>"));
  EXPECT_FALSE(alone(""));
  EXPECT_FALSE(alone("<joint type='free' damping='1'/>"));
  EXPECT_FALSE(alone("<joint type='free' stiffness='1'/>"));
  for (const char* more : {"<equality><weld body1='trunk'/></equality>",
                           "<tendon><fixed><joint joint='j' coef='1'/></fixed></tendon>",
                           "<option density='1.2'/>", "<option viscosity='1e-5'/>"}) {
    EXPECT_FALSE(alone("<freejoint/>", more)) << more;
  }
}

TEST(Model, StandsOnItsLowestPointHoweverItIsTurned) {
  const auto height = [&](const std::string& geoms, const std::string& more = "",
                          const std::string& before = "") {
    const auto model =
        Model::fromMjcf(mjcf(before + "<body pos='3 4 5'><freejoint/>" + geoms + "</body>", more));
    const State s = model->stateOf({});
    const int root = before.empty() ? 0 : 1;
    EXPECT_EQ(s.q.segment<2>(root), Eigen::Vector2d::Zero());
    EXPECT_EQ(s.q.segment<4>(root + 3), Eigen::Vector4d(1, 0, 0, 0));
    return s.q[root + 2];
  };
  const Vector3d corners[] = {{-.1, -.2, -.3}, {.4, -.1, -.2}, {.05, .5, -.25}, {.1, .15, .6}};
  std::string vertices;
  for (const Vector3d& v : corners) vertices += fmt::format("{} {} {} ", v.x(), v.y(), v.z());
  const std::string mesh = "<asset><mesh name='m' vertex='" + vertices + "'/></asset>";
  for (const Eigen::Vector2d& angles :
       {Eigen::Vector2d(0.4, 0.7), {2.5, -0.6}, {-1.2, 0.3}, {0.2, 1.8}, {1.5, 0.2}}) {
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(angles[0], Vector3d::UnitX()) *
                               Eigen::AngleAxisd(angles[1], Vector3d::UnitY()))
                                  .toRotationMatrix();
    const Vector3d up = R.row(2);  // the vertical in the geom's axes
    const std::string turned = fmt::format("pos='.3 .2 .7' euler='{} {} 0'", angles[0] * 180 / M_PI,
                                           angles[1] * 180 / M_PI);
    double lowest = kNone;
    for (const Vector3d& v : corners) lowest = std::min(lowest, up.dot(v));
    const Vector3d a = up.cwiseAbs();
    const std::pair<const char*, double> shapes[] = {
        {"type='sphere' size='.3'", .3},
        {"type='box' size='.1 .2 .3'", a.dot(Vector3d(.1, .2, .3))},
        {"type='capsule' size='.1 .3'", .1 + .3 * a.z()},
        {"type='cylinder' size='.1 .3'", .1 * std::hypot(a.x(), a.y()) + .3 * a.z()},
        {"type='ellipsoid' size='.1 .2 .3'", a.cwiseProduct(Vector3d(.1, .2, .3)).norm()},
        {"type='mesh' mesh='m'", -lowest}};
    for (const auto& [shape, below] : shapes) {
      EXPECT_NEAR(height(fmt::format("<geom {} {}/>", turned, shape), mesh), below - .7, 1e-6)
          << shape << " " << angles.transpose();
    }
  }
  // What touches one way or the other counts, and only that.
  const std::string ball = "<geom size='.1'/>";
  EXPECT_NEAR(height(ball + "<geom size='.1' pos='0 0 -1' contype='0'/>"), 1.1, 1e-9);
  EXPECT_NEAR(height(ball + "<geom size='.1' pos='0 0 -1' conaffinity='0'/>"), 1.1, 1e-9);
  EXPECT_NEAR(height(ball + "<geom size='.1' pos='0 0 -1' contype='0' conaffinity='0'/>"), .1,
              1e-9);
  EXPECT_EQ(height("<geom size='.1' contype='0' conaffinity='0'/>"), 0);
  // Others may be lower, and come before.
  EXPECT_NEAR(height(ball, "",
                     "<body pos='0 0 -7'><joint/><geom size='.1'/></body>"
                     "<geom type='plane' size='1 1 1' pos='0 0 -9'/>"),
              .1, 1e-9);
}

TEST(Model, WhatIsOnlySeenIsLeftOutAndItsMassIsNot) {
  const auto ball = [](const std::string& compiler, const std::string& seen) {
    return Model::fromMjcf(
        "<mujoco>" + compiler +
        "<worldbody><body><freejoint/><geom size='.1' mass='2'/><geom contype='0' "
        "conaffinity='0' " +
        seen + "/></body></worldbody></mujoco>");
  };
  const auto plain = ball("", "size='.05' mass='0'");
  EXPECT_EQ(plain->raw()->ngeom, 1);
  EXPECT_NEAR(plain->mass(), 2, 1e-12);
  const auto heavy = ball("", "size='.05' pos='.3 0 0' mass='1'");
  EXPECT_EQ(heavy->raw()->ngeom, 1);
  EXPECT_NEAR(heavy->mass(), 3, 1e-12);
  EXPECT_NEAR(heavy->raw()->body_ipos[3], 0.1, 1e-12);  // where both balance
  EXPECT_NEAR(ball("<compiler settotalmass='6'/>", "size='.05' mass='1'")->mass(), 6, 1e-12);
  const auto all = ball("<compiler inertiafromgeom='true'/>", "size='.05' mass='1'");
  EXPECT_EQ(all->raw()->ngeom, 2);  // where it would change the inertia, it stays
  EXPECT_NEAR(all->mass(), 3, 1e-12);
}

TEST(Model, OfPropsAloneTheFirstStandsInForARobot) {
  const Prop box{.name = "box", .size = {.1, .1, .1}, .position = {1, 0, .1}, .mass = 1};
  const auto one = Model::fromScene({.props = {box}});
  EXPECT_EQ(one->rootDofs(), 6);
  EXPECT_EQ(one->bodyName(one->root()), "box");
  EXPECT_EQ(engineVersion(), std::string("MuJoCo ") + mj_versionString());
  // Reaching into the ground, or a box that lies in it.
  State s = one->initialState();
  s.q[2] = 0.05;
  ASSERT_TRUE(one->bodyReachedInto(s, 0.01));
  EXPECT_EQ(one->bodyReachedInto(s, 0.01)->value, 0);
  EXPECT_FALSE(one->bodyReachedInto(s, 0.06));
}

// -------------------------------------------------------------------------------------- recordings

TEST(Recording, TheSmallestThereIsComesBack) {
  Recording r;
  r.mjcf = std::string(100, 'm');
  EXPECT_EQ(Recording::decode(r.encode()).mjcf, r.mjcf);
  r.phases.resize(50);
  EXPECT_EQ(Recording::decode(r.encode()).phases.size(), 50U);
  r.frames.resize(500);
  r.frames[7].phase = 3;
  const Recording frames = Recording::decode(r.encode());
  ASSERT_EQ(frames.frames.size(), 500U);
  EXPECT_EQ(frames.frames[7].phase, 3);
  r.frames.resize(1);
  r.frames[0].contacts.resize(200);
  EXPECT_EQ(Recording::decode(r.encode()).frames[0].contacts.size(), 200U);
  r.frames[0].contacts.clear();
  r.frames[0].state.q = r.frames[0].torque = VectorXd::LinSpaced(300, 1, 2);
  EXPECT_EQ(Recording::decode(r.encode()).frames[0].torque, r.frames[0].torque);
}

TEST(Recording, EveryFieldComesBack) {
  Recording r{"text", {"a", "", "c"}, {}};
  for (int i = 0; i < 2; ++i) {
    const double x = 100 * i;
    Frame f{{x + 1, VectorXd::Constant(3, x + 2), VectorXd::Constant(2, x + 3)},
            {x + 4, x + 5, x + 6},
            {x + 7, x + 8, x + 9},
            2 * i,
            VectorXd::Constant(4, x + 10),
            {}};
    for (int c = 0; c < 2; ++c) {
      f.contacts.push_back({{c},
                            {c + 5},
                            Vector3d::Constant(x + c + 11),
                            Vector3d::Constant(x + c + 21),
                            Vector3d::Constant(x + c + 31)});
    }
    r.frames.push_back(f);
  }
  const Recording back = Recording::decode(r.encode());
  EXPECT_EQ(back.mjcf, r.mjcf);
  EXPECT_EQ(back.phases, r.phases);
  ASSERT_EQ(back.frames.size(), 2U);
  for (int i = 0; i < 2; ++i) {
    const Frame& is = back.frames[i];
    const Frame& should = r.frames[i];
    EXPECT_EQ(is.state.time, should.state.time);
    EXPECT_EQ(is.state.q, should.state.q);
    EXPECT_EQ(is.state.v, should.state.v);
    EXPECT_EQ(is.com, should.com);
    EXPECT_EQ(is.com_velocity, should.com_velocity);
    EXPECT_EQ(is.phase, should.phase);
    EXPECT_EQ(is.torque, should.torque);
    ASSERT_EQ(is.contacts.size(), 2U);
    for (int c = 0; c < 2; ++c) {
      EXPECT_EQ(is.contacts[c].body_a, should.contacts[c].body_a);
      EXPECT_EQ(is.contacts[c].body_b, should.contacts[c].body_b);
      EXPECT_EQ(is.contacts[c].p_WC, should.contacts[c].p_WC);
      EXPECT_EQ(is.contacts[c].normal, should.contacts[c].normal);
      EXPECT_EQ(is.contacts[c].f_WC, should.contacts[c].f_WC);
    }
  }
}

TEST(Recording, SaysWhatIsWrongWithItsBytes) {
  Recording r;
  r.frames.resize(1);
  r.frames[0].phase = -1;
  r.frames[0].contacts.resize(1);
  r.frames[0].contacts[0].body_a.value = std::numeric_limits<int>::max();
  const std::string bytes = r.encode();
  const Recording back = Recording::decode(bytes);
  EXPECT_EQ(back.frames[0].phase, -1);
  EXPECT_EQ(back.frames[0].contacts[0].body_a.value, std::numeric_limits<int>::max());
  const auto said = [](const std::string& of) { return complaint([&] { Recording::decode(of); }); };
  const size_t magic = 4 + std::strlen("traceur-recording");
  const std::string stranger = "recording: these bytes are not a Traceur recording";
  const std::string early = "recording: the bytes end early or hold impossible sizes";
  EXPECT_EQ(said(""), stranger);
  EXPECT_EQ(said(bytes.substr(0, magic - 1)), stranger);
  EXPECT_EQ(said(bytes.substr(0, magic)), early);
  std::string other = bytes;
  other[6] = 'x';
  EXPECT_EQ(said(other), stranger);
  other = bytes;
  other[magic] = 9;
  EXPECT_EQ(said(other), "recording: version 9, this program reads 1 to 2");
  for (size_t cut = magic; cut < bytes.size(); ++cut) EXPECT_EQ(said(bytes.substr(0, cut)), early);
  // A vector of two where three numbers belong: the COM, behind time and two empty vectors.
  other = bytes;
  const size_t com = magic + 4 + 4 + 4 + 4 + 8 + 4 + 4;
  ASSERT_EQ(other[com], 3);
  other[com] = 2;
  other.erase(com + 4, 8);
  EXPECT_EQ(said(other), early);
}

}  // namespace
}  // namespace traceur::sim
