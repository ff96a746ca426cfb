// What a skill file can say, held against what the motion is by other means.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>
#include <tuple>

#include "traceur/core/error.h"
#include "traceur/core/run_file.h"
#include "traceur/core/test_folder.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"
#include "traceur/skill/skill_testing.h"

namespace traceur::skill {
namespace {

/// A skill of the BioloidGP that stands for `horizon` seconds, but for what is added; its first
/// phase lasts `first` seconds.
std::string standing(double horizon, const std::string& top, const std::string& rest,
                     const std::string& in_phase = "", const std::string& start = "",
                     double first = 0.1) {
  return fmt::format(R"_(
name = "standing"
robot = "bioloid-gp"
horizon = {}
{}
[task]
range = [0, 1]
default = 0.25
[parameters]
a = {{ range = [-1, 1], initial = 0.5 }}
[start]
{}
[start.pose]
base = "stand"
[[phase]]
name = "one"
until = "phase_time >= {}"
pose = {{ base = "stand" }}
{}
[[phase]]
name = "two"
pose = {{ base = "previous" }}
{}
[[objective]]
name = "none"
cost = 0
)_",
                     horizon, top, start, first, in_phase, rest);
}

Rollout run(const std::shared_ptr<const Skill>& skill, sim::Recording* recording = nullptr) {
  return Runner(skill).run(skill->initialParameters(), skill->task.initial, recording);
}

double measured(const Rollout& r, const Skill& skill, const std::string& name) {
  for (size_t i = 0; i < skill.measures.size(); ++i) {
    if (skill.measures[i].name == name) return r.measures[i];
  }
  ADD_FAILURE() << name;
  return 0;
}

constexpr const char* kConditions = R"_([conditions]
high = { unit = "m", range = [0.2, 1], default = 0.3, draw = [0.25, 0.5] }
fast = { range = [-1, 1], default = 0.5 }
[values]
twice = "2 * a * fast"
seen = "com.z + twice"
late = "phase_time + in.two"
)_";

TEST(SkillWords, ConditionsAndValuesAreNumbersLikeParameters) {
  const auto skill = fromText(standing(0.2, "", std::string(kConditions) + R"_([measures]
v = { of = "com_velocity.x", take = "first" }
z = { of = "com.z", take = "first" }
seen_first = { of = "seen", take = "first" }
late_last = { of = "late", take = "last" }
[[objective]]
name = "known"
cost = "twice + high"
)_",
                                       "", R"(com_height = "high"
velocity = ["twice", 0, 0])"));
  Runner runner(skill);
  const auto once = [&] { return runner.run(skill->initialParameters(), 0.25); };
  const Rollout r = once();
  EXPECT_NEAR(measured(r, *skill, "z"), 0.3, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "v"), 0.5, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "seen_first"), 0.8, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "late_last"), 0.1 + 1, 2e-3);
  EXPECT_NEAR(r.cost, 0.5 + 0.3, 1e-9);
  runner.under(Eigen::Vector2d(0.6, -1));
  const Rollout other = once();
  EXPECT_NEAR(measured(other, *skill, "z"), 0.6, 1e-9);
  EXPECT_NEAR(measured(other, *skill, "v"), -1, 1e-9);
  runner.under({});
  EXPECT_EQ(once().hash, r.hash);
  EXPECT_THROW(runner.under(Eigen::Vector3d(1, 2, 3)), InputError);
  EXPECT_THROW(runner.under(Eigen::Vector2d(1, std::nan(""))), InputError);
}

TEST(SkillWords, ConditionsAreDrawnEvenly) {
  const auto skill = fromText(standing(0.2, "", kConditions));
  const auto all = drawnConditions(*skill, 8, 1, 3);
  ASSERT_EQ(all.size(), 8U);
  for (const auto& [c, least, most] : {std::tuple{0, 0.25, 0.5}, std::tuple{1, -1.0, 1.0}}) {
    std::set<int> parts;  // one in each eighth of the range
    for (const VectorXd& one : all) {
      parts.insert(static_cast<int>(std::floor((one[c] - least) / (most - least) * 8)));
    }
    EXPECT_EQ(parts.size(), 8U);
    EXPECT_EQ(*parts.begin(), 0);
    EXPECT_EQ(*parts.rbegin(), 7);
  }
  EXPECT_EQ(drawnConditions(*skill, 8, 1, 3), all);
  EXPECT_NE(drawnConditions(*skill, 8, 1, 4), all);
  EXPECT_NE(drawnConditions(*skill, 8, 2, 3), all);
}

TEST(SkillWords, IsDrawnFromWhatIsGiven) {
  const auto skill = fromText(standing(0.2, "", kConditions));
  EXPECT_EQ(underGiven(skill, {}), skill);
  const auto under = underGiven(skill, {"high=0.6:0.7", "fast=0.5"});
  for (const VectorXd& one : drawnConditions(*under, 8, 1, 3)) {
    EXPECT_GE(one[0], 0.6);
    EXPECT_LE(one[0], 0.7);
    EXPECT_EQ(one[1], 0.5);
  }
  EXPECT_EQ(under->initialConditions()[0], 0.6);  // into the range
  EXPECT_EQ(skill->initialConditions()[0], 0.3);
  const auto said = [&](const std::string& given) {
    try {
      underGiven(skill, {given});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(said("high").find("NAME=VALUE"), std::string::npos);
  EXPECT_NE(said("hihg=0.5").find("Did you mean \"high\"?"), std::string::npos);
  for (const char* range : {"high=0.7:0.6", "high=0.1", "high=0.3:9", "high=nan", "high=:1"}) {
    EXPECT_NE(said(range).find(range), std::string::npos) << said(range);
  }
}

TEST(SkillWords, ATrialOfDrawnConditionsIsTheirMean) {
  const std::string rest = std::string(kConditions) + R"_([[failure]]
name = "low"
when = "high < 0.4"
[[objective]]
name = "known"
cost = "high + 10 * low"
)_";
  const auto skill = fromText(standing(0.05, "", rest));
  const SkillProblem problem(skill, 0.25, 4, 1);
  EXPECT_TRUE(problem.draws());
  double mean = 0;
  int low = 0;
  for (const VectorXd& one : drawnConditions(*skill, 4, 1, 2)) {
    low += one[0] < 0.4;
    mean += (one[0] + (one[0] < 0.4 ? 10 : 0)) / 4;
  }
  const optim::Evaluation e = problem.evaluateIn(2, skill->initialParameters());
  EXPECT_NEAR(e.cost, mean, 1e-12);
  EXPECT_EQ(e.violated[0], low > 2);
  EXPECT_NE(problem.evaluateIn(3, skill->initialParameters()).cost, e.cost);
  EXPECT_EQ(problem.evaluateIn(2, skill->initialParameters()).cost, e.cost);
  EXPECT_FALSE(SkillProblem(skill, 0.25).draws());
  EXPECT_THROW(SkillProblem(fromText(standing(1, "", "")), 0.25, 4, 1), InputError);
}

TEST(SkillWords, WrongConditionsAndValuesAreTold) {
  const auto said = [](const char* rest) { return mistakes(standing(0.2, "", rest)); };
  EXPECT_NE(said("[conditions]\nx = { range = [0, 1], draw = [0.5, 2] }")
                .find("\"draw\": expected [least, most] within \"range\", [0, 1]"),
            std::string::npos);
  EXPECT_NE(said("[conditions]\nx = { range = [0, 1], default = 2 }").find("default 2 is outside"),
            std::string::npos);
  EXPECT_NE(said("[conditions]\na = { range = [0, 1] }").find("have this name"), std::string::npos);
  EXPECT_NE(said("[values]\nx = \"y\"\ny = \"1\"").find("nothing here is named \"y\""),
            std::string::npos);
  // A value of signals is none of a start.
  EXPECT_NE(mistakes(standing(0.2, "", "[values]\nz = \"com.z\"", "", "height = \"z\""))
                .find("nothing here is named \"z\""),
            std::string::npos);
}

TEST(SkillWords, AStartLandsAsItIsToldTo) {
  const auto skill = fromText(standing(1, "", R"_([measures]
turned = { of = "somersault.root", take = "last", when = "time < 0.43" }
first = { of = "somersault.root", take = "first" }
)_",
                                       R"_(stiffness = 3)_", R"(height = 0.5
velocity = [0.2, 0.1, 1]
spin = [0, 1.5, 0]
lands = 0.3)"));
  const Rollout r = run(skill);
  EXPECT_NEAR(measured(r, *skill, "turned"), 0.3, 0.03);
  EXPECT_NEAR(measured(r, *skill, "first"), 0.3 - 1.5 * 0.435, 0.05);
  EXPECT_NE(mistakes(standing(1, "", "", "", "lands = 0.3\npitch = 1")).find("expected one of"),
            std::string::npos);
  // On a surface that is higher it has less time to turn.
  const auto higher = fromText(standing(
      0.1, "", "[measures]\nfirst = { of = \"somersault.root\", take = \"first\" }",
      "stiffness = 3",
      "height = 0.5\nvelocity = [0, 0, 0]\nspin = [0, 1.5, 0]\nlands = 0.3\nground = 0.3"));
  EXPECT_NEAR(measured(run(higher), *higher, "first"), 0.3 - 1.5 * std::sqrt(0.4 / 9.81), 0.03);
  EXPECT_NE(mistakes(standing(1, "", "", "", "ground = 1")).find("expected \"lands\" too"),
            std::string::npos);
}

TEST(SkillWords, AFlightArrivesAsItIsToldTo) {
  const auto flight = [](const std::string& in_phase) {
    return fromText(standing(1.2, "", R"_([measures]
turned = { of = "somersault.root", take = "last", when = "contact.robot == 0", during = ["one"] }
foreseen = { of = "touch_down.somersault", take = "last" }
first = { of = "touch_down.time", take = "first" }
left = { of = "touch_down.time", take = "last", during = ["one"] }
speed = { of = "touch_down.velocity.z", take = "last" }
)_",
                             in_phase, R"(height = 2.5
velocity = [0, 0, 0]
spin = [0, 2.0, 0]
pitch = -0.6)",
                             0.6));
  };
  // A robot that turns by 1.4 rad in 0.7 s.
  const auto skill = flight("[phase.flight]\nsomersault = 1.1");
  const Rollout r = run(skill);
  EXPECT_NEAR(measured(r, *skill, "first"), 0.71, 0.02);
  EXPECT_NEAR(measured(r, *skill, "left"), 0.11, 0.03);
  EXPECT_NEAR(measured(r, *skill, "speed"), -7.0, 0.2);
  const Rollout less = run(flight("[phase.flight]\nsomersault = 0.5"));
  EXPECT_GT(measured(r, *skill, "foreseen"), measured(less, *skill, "foreseen") + 0.2);
  EXPECT_EQ(run(flight("[phase.flight]\nsomersault = 0.5")).hash, less.hash);
  EXPECT_NE(mistakes(standing(1, "", "", "[phase.flight]")).find("\"somersault\": expected"),
            std::string::npos);
  EXPECT_NE(mistakes(standing(1, "", "", "[phase.flight]\nsomersault = 0\nposes = 1000"))
                .find("\"poses\": expected a whole number"),
            std::string::npos);
}

TEST(SkillWords, AForceMayFollowTheHeading) {
  // Turned to the left, forward is the world's y.
  const auto skill = fromText(standing(0.05, "", R"_([measures]
forward = { of = "com_velocity.forward", take = "last" }
y = { of = "com_velocity.y", take = "last" }
x = { of = "com_velocity.x", take = "last" }
)_",
                                       R"_(limited = false
[[phase.force]]
bodies = ["l_hand"]
frame = "heading"
force = [3, 0, 0])_",
                                       "height = 1\nyaw = 1.5707963"));
  sim::Recording film;
  const Rollout r = run(skill, &film);
  EXPECT_NEAR(measured(r, *skill, "forward"), measured(r, *skill, "y"), 1e-6);
  // The arm swings that way: it is told to by the shoulder's torque.
  EXPECT_GT(std::abs(film.frames.back().torque.lpNorm<Eigen::Infinity>()), 0);
  EXPECT_NE(mistakes(standing(1, "", "",
                              "[[phase.force]]\nbodies = [\"l_hand\"]\nforce = [1, 0, "
                              "0]\nframe = \"body\""))
                .find("expected one of world, cop to com, heading"),
            std::string::npos);
}

TEST(SkillWords, AStartInTheAirIsWhatItSays) {
  const auto skill = fromText(standing(0.1, "", R"_([measures]
z = { of = "com.z", take = "first" }
vx = { of = "com_velocity.x", take = "first" }
vz = { of = "com_velocity.z", take = "last" }
toe = { of = "min(point.left_toe.z, point.left_heel.z)", take = "first" }
pitch = { of = "root.pitch", take = "first" })_",
                                       "", R"_(height = "task"
velocity = ["a", 0, 1]
spin = [0, 0.4, 0]
pitch = 0.1)_"));
  const Rollout r = run(skill);
  EXPECT_NEAR(measured(r, *skill, "vx"), 0.5, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "vz"), 1 - 9.81 * 0.1, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "pitch"), 0.1, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "toe"), 0.25, 2e-3);  // the soles are its lowest parts
  // Of another task and other parameters.
  Runner runner(skill);
  VectorXd x(1);
  x << -0.3;
  const Rollout higher = runner.run(x, 0.5);
  EXPECT_NEAR(measured(higher, *skill, "z") - measured(r, *skill, "z"), 0.25, 1e-9);
  EXPECT_NEAR(measured(higher, *skill, "vx"), -0.3, 1e-9);
  EXPECT_TRUE(runner.motionDependsOnTask());
}

TEST(SkillWords, ConstantsStandForTheirValues) {
  const auto skill = fromText(standing(0.05, "", R"_([constants]
leg = 0.2
twice = "2 * leg"
[measures]
x = { of = "twice + leg", take = "last" })_",
                                       "", "height = \"twice\""));
  EXPECT_NEAR(measured(run(skill), *skill, "x"), 0.6, 1e-12);
  EXPECT_NE(mistakes(standing(0.05, "", "[constants]\nleg = \"a\"\n")).find("expected a number"),
            std::string::npos);
  EXPECT_NE(mistakes(standing(0.05, "", "[constants]\na = 1\n")).find("have this name"),
            std::string::npos);
}

TEST(SkillWords, GainsAreFactorsByPhaseAndJoint) {
  // A limp left elbow falls where the right one is held; in the next phase nothing is left of it.
  const auto skill = fromText(standing(0.9, "", R"_([measures]
limp = { of = "abs(joint.l_hand)", take = "max", during = ["one"] }
held = { of = "abs(joint.r_hand)", take = "max" }
late = { of = "abs(joint.l_hand)", take = "last" })_",
                                       R"_(stiffness = { all = 1, l_hand = 0 }
damping = { l_hand = "phase_time < 0.1 ? 1 : 0" })_",
                                       "", 0.5));
  const Rollout r = run(skill);
  EXPECT_GT(measured(r, *skill, "limp"), 0.03);
  EXPECT_LT(measured(r, *skill, "held"), 0.01);
  EXPECT_LT(measured(r, *skill, "late"), 0.01);
  const auto all = fromText(standing(0.8, "", R"_([measures]
sag = { of = "com.z", take = "last" })_",
                                     "stiffness = 0\ndamping = 0", "", 0.8));
  EXPECT_LT(measured(run(all), *all, "sag"), 0.15);  // it folds
}

TEST(SkillWords, ForcesFollowSignalsFramesAndContacts) {
  const auto skill = fromText(standing(0.02, "", R"_([measures]
hand = { of = "torque.l_shoulder", take = "last" })_",
                                       R"_(stiffness = 0
damping = 0
limited = false
[[phase.force]]
points = ["left_hand"]
force = [0, 0, "10 * phase_time"])_",
                                       "height = 0.2"));
  // Jᵀf by hand at the last step but one, whose torque the last one remembers.
  Runner runner(skill);
  const Rollout r = runner.run(skill->initialParameters(), 0.25);
  sim::World world(skill->model);
  world.restore(runner.ending().world);
  VectorXd tau = VectorXd::Zero(skill->model->nv());
  const sim::BodyPoint hand = skill->model->contactPoint("left_hand");
  world.snapshot().addPointForce(hand.body, hand.p_BP, {0, 0, 10 * 0.019}, tau);
  EXPECT_NEAR(measured(r, *skill, "hand"), tau[skill->model->joint("l_shoulder").v],
              2e-3 * std::abs(measured(r, *skill, "hand")));
  EXPECT_GT(std::abs(measured(r, *skill, "hand")), 1e-3);
}

/// The vertical velocity of the COM after `force` for 20 ms on one who stands with limp legs or, in
/// the air, flies.
double riseBy(const std::string& force, const std::string& start = "") {
  const auto skill =
      fromText(standing(0.06, "", R"_([measures]
v = { of = "com_velocity.z", take = "last" })_",
                        "stiffness = 0\ndamping = 0\nlimited = false\n" + force, start));
  return measured(run(skill), *skill, "v");
}

TEST(SkillWords, AForceOnlyPushesWhereSomethingTouches) {
  const std::string feet = "[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, -30]\n";
  EXPECT_GT(riseBy(feet), riseBy("") + 0.05);
  EXPECT_NEAR(riseBy(feet + "touching = true"),
              riseBy("[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, -15]\n"), 0.05);
  const std::string air = "height = 0.3";
  EXPECT_EQ(riseBy(feet + "touching = true", air), riseBy("", air));
  // On the COM, borne by the feet: the same push.
  const std::string com = "[[phase.force]]\ncom = true\nforce = [0, 0, 30]\nagainst = [\"feet\"]\n";
  EXPECT_GT(riseBy(com + "touching = true"), riseBy("") + 0.05);
  EXPECT_EQ(riseBy(com + "touching = true", air), riseBy("", air));
}

TEST(SkillWords, TheFrameFromTheCopToTheComLeansWithTheRobot) {
  // Standing, the frame's z is nearly the world's; nothing is exerted before there was a contact.
  const std::string world = "[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, -30]\n";
  const std::string frame = world + "frame = \"cop to com\"";
  EXPECT_NEAR(riseBy(frame), riseBy(world), 0.2 * riseBy(world));
  EXPECT_NE(riseBy(frame), riseBy(world));
  EXPECT_EQ(riseBy(frame, "height = 0.3"), riseBy("", "height = 0.3"));
}

TEST(SkillWords, APhaseThatBeginsInTheAirHasNoFrameFromTheCop) {
  // The first phase throws it up, in the second the ground is behind it.
  const std::string down =
      "\n[measures]\ndown = { of = \"contact.robot\", take = \"max\", during = [\"two\"] }\n";
  const auto hash = [&](const std::string& force) {
    const std::string throws = "[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, -200]\n";
    const auto skill =
        fromText(standing(0.07, "", force + down,
                          "stiffness = 0\ndamping = 0\nlimited = false\n" + throws, "", 0.05));
    const Rollout r = run(skill);
    EXPECT_EQ(measured(r, *skill, "down"), 0);
    return r.hash;
  };
  const std::string force = "[[phase.force]]\nbodies = [\"l_hand\"]\nforce = [0, 0, 20]\n";
  EXPECT_EQ(hash(force + "frame = \"cop to com\""), hash(""));
  EXPECT_NE(hash(force), hash(""));
}

TEST(SkillWords, AMomentTurnsItsBody) {
  const auto turned = [](const std::string& force) {
    const auto skill =
        fromText(standing(0.05, "", R"_([measures]
turn = { of = "joint.l_shoulder", take = "last" })_",
                          "stiffness = 0\ndamping = 0\nlimited = false\n" + force, "height = 0.3"));
    return measured(run(skill), *skill, "turn");
  };
  const double up = turned("[[phase.force]]\nbodies = [\"l_hand\"]\nmoment = [0, -0.2, 0]");
  const double down = turned("[[phase.force]]\nbodies = [\"l_hand\"]\nmoment = [0, 0.2, 0]");
  EXPECT_GT(std::abs(up - down), 0.1);
  EXPECT_LT((up - turned("")) * (down - turned("")), 0);
}

TEST(SkillWords, WhatIsReachedForIsReached) {
  const auto skill = fromText(standing(1.2, "", R"_([measures]
down = { of = "com.z", take = "last" }
first = { of = "com.z", take = "first" }
hands = { of = "body.l_hand.z - body.torso.z", take = "last" })_",
                                       R"_(blend = 0.4
[phase.reach]
hold = ["feet"]
joints = ["thigh", "shin", "heel", "shoulder"]
[[phase.reach.goal]]
of = "com"
x = "com.x"
z = "com.z - 0.02"
[[phase.reach.goal]]
of = "hands"
from = "torso"
z = -0.02)_",
                                       "", 0.6));
  const Rollout r = run(skill);
  EXPECT_NEAR(measured(r, *skill, "down"), measured(r, *skill, "first") - 0.02, 3e-3);
  EXPECT_NEAR(measured(r, *skill, "hands"), -0.02, 5e-3);
  EXPECT_FALSE(skill->phases[0].reach->joints.empty());
  EXPECT_EQ(skill->phases[0].reach->joints.size(), 8u);
}

TEST(SkillWords, AGoalThatMovesIsFollowedWhereItIsSolvedAnew) {
  const auto moved = [](const std::string& every) {
    const auto skill = fromText(standing(0.1, "", R"_([measures]
angle = { of = "joint.l_hand", take = "last" })_",
                                         every + R"_([[phase.reach.goal]]
of = "left_hand"
from = "torso"
z = "-0.05 + 0.5 * phase_time"
)_"));
    return measured(run(skill), *skill, "angle");
  };
  const double once = moved("[phase.reach]\njoints = [\"l_hand\"]\n");
  const double often = moved("[phase.reach]\njoints = [\"l_hand\"]\nevery = 0.005\n");
  EXPECT_GT(std::abs(often - once), 0.03);
}

TEST(SkillWords, PhasesThatEndCanBeNamed) {
  const auto skill = fromText(standing(0.4, "stop = \"ended.two\"", R"_(until = "phase_time >= 0.15"
[[phase]]
name = "three"
[measures]
at_end = { of = "time", take = "last", when = "ended.one" }
in_two = { of = "in.two", take = "integral" }
entered = { of = "time", take = "first", when = "in.two" })_"));
  const Rollout r = run(skill);
  EXPECT_EQ(r.ended, "stop");
  EXPECT_NEAR(r.time, 0.25, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "at_end"), 0.1, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "entered"), 0.1, 1e-9);
  EXPECT_NEAR(measured(r, *skill, "in_two"), 0.15, 1e-9);
  // A failure at a phase's end.
  const auto failing = fromText(standing(0.4, "", R"_([[failure]]
name = "late"
when = "ended.one && com.z < 1")_"));
  const Rollout failed = run(failing);
  EXPECT_EQ(failed.ended, "late");
  EXPECT_NEAR(failed.time, 0.1, 1e-9);
}

TEST(SkillWords, AFlightNoticesThatItWasPutElsewhere) {
  // 0.16 s before the ground, where nothing is planned any more otherwise.
  const auto skill = fromText(standing(0.7, "", R"_([measures]
left = { of = "touch_down.time", take = "first", when = "time > 0.58" }
somersault = { of = "touch_down.somersault", take = "first", when = "time > 0.58" }
)_",
                                       "[phase.flight]\nsomersault = 0", "height = 2.5", 1));
  const auto foreseen = [&](const motion::Drag& drag) {
    Runner runner(skill);
    runner.meddledWith({.drags = {drag}});
    const Rollout r = runner.run(skill->initialParameters(), 0.25);
    return std::pair(measured(r, *skill, "left"), measured(r, *skill, "somersault"));
  };
  const auto [left, somersault] = foreseen({.start = 5});
  EXPECT_NEAR(left, 0.13, 0.02);
  EXPECT_GT(foreseen({.start = 0.55, .by = {0, 0, 1}}).first, left + 0.1);
  const Eigen::AngleAxisd turn(0.8, Vector3d::UnitY());
  EXPECT_NEAR(foreseen({.start = 0.55, .turn = turn.toRotationMatrix()}).second, somersault + 0.8,
              0.2);
}

TEST(SkillWords, APhaseKnowsHowOftenItHasBegun) {
  const auto skill = fromText(standing(1, "", R"_(until = "phase_time >= 0.05"
[[phase.exit]]
when = "entered.one < 3 && phase_time >= 0.05"
then = "one"
[measures]
one = { of = "entered.one", take = "last" }
two = { of = "entered.two", take = "max" }
at_first = { of = "entered.one + 10 * entered.two", take = "first" }
last = { of = "time", take = "last", when = "ended.two" })_"));
  const Rollout r = run(skill);
  EXPECT_EQ(measured(r, *skill, "one"), 3);
  EXPECT_EQ(measured(r, *skill, "two"), 3);
  EXPECT_EQ(measured(r, *skill, "at_first"), 1);
  EXPECT_NEAR(measured(r, *skill, "last"), 3 * 0.15, 1e-9);
}

TEST(SkillWords, APushIsAForceForAWhile) {
  const auto skill = fromText(standing(0.1, "", R"_([[push]]
body = "torso"
force = ["10 * a", 0, 0]
start = 0.02
duration = 0.05
[measures]
v = { of = "com_velocity.x", take = "last" })_",
                                       "", "height = 1"));
  const Rollout r = run(skill);
  EXPECT_NEAR(measured(r, *skill, "v"), 5 * 0.05 / skill->model->mass(), 1e-3);
}

TEST(SkillWords, GainsAndLimitsMayDifferByJoint) {
  const auto skill = fromText(standing(0.05, "", R"_([controller]
kp = { all = 10, thigh = 20 }
kd = 1
ki = { l_shin = 3 }
torque_limit = { all = inf, heel = 0.4 })_"));
  control::StablePd pd = controllerOf(*skill);
  const auto& joints = skill->model->joints();
  for (size_t i = 0; i < joints.size(); ++i) {
    const bool thigh = joints[i].name.ends_with("thigh");
    EXPECT_EQ(pd.gains()[i].kp, thigh ? 20 : 10) << joints[i].name;
    EXPECT_EQ(pd.gains()[i].kd, 1);
    EXPECT_EQ(pd.gains()[i].ki, joints[i].name == "l_shin" ? 3 : 0);
    EXPECT_EQ(pd.limits()[i].torque,
              joints[i].name.ends_with("heel") ? 0.4 : std::numeric_limits<double>::infinity());
    EXPECT_EQ(pd.limits()[i].speed, 12);
  }
}

class Parts : public testing::Test {
 protected:
  TestFolder folder;
  std::string robot = std::filesystem::absolute("models/bioloid-gp/robot.toml").string();

  std::filesystem::path write(const std::string& name, std::string text) {
    const std::string from = "robot = \"bioloid-gp\"";
    text.replace(text.find(from), from.size(), "robot = \"" + robot + "\"");
    std::ofstream(folder / name) << text;
    return folder / name;
  }
  std::string chain(const std::string& rows, const std::string& rest = "", double horizon = 5) {
    return fmt::format(R"_(name = "chain"
robot = "bioloid-gp"
horizon = {}
{}
[parameters]
b = {{ range = [-1, 1], initial = 0.3 }}
[start.pose]
base = "stand"
{}
[[objective]]
name = "sum"
cost = "first.cost + 10 * second.cost"
)_",
                       horizon, "", rows + rest);
  }
  std::string part(const std::string& name, double horizon) {
    std::string text = standing(horizon, "", R"_([measures]
last = { of = "joint.l_shoulder", take = "last" }
start_z = { of = "com.z", take = "first" }
[[failure]]
name = "low"
when = "com.z < 0.1")_",
                                "blend = 0.05\n");
    text.replace(text.find("pose = { base = \"stand\" }"), 25,
                 "pose = { base = \"stand\", shoulder = \"a\" }");
    text.replace(text.find("cost = 0"), 8, "cost = \"last\"");
    text.replace(text.find("\"standing\""), 10, "\"" + name + "\"");
    return text;
  }
};

TEST_F(Parts, OneAfterAnotherMoveAsEachDoesFromTheOthersEnding) {
  write("first.toml", part("first", 0.3));
  write("second.toml", part("second", 0.2));
  const auto whole = Skill::fromFile(write("chain.toml", chain(R"_([[skill]]
file = "first.toml"
parameters = { a = "2 * b" }
[[skill]]
file = "second.toml"
parameters = { a = "-b" }
)_")));
  EXPECT_EQ(whole->phaseNames(),
            (std::vector<std::string>{"first.one", "first.two", "second.one", "second.two"}));
  sim::Recording film;
  Runner chained(whole);
  const Rollout r = chained.run(whole->initialParameters(), 0, &film);
  EXPECT_EQ(r.ended, "horizon");
  EXPECT_NEAR(r.time, 0.5, 1e-9);
  EXPECT_EQ(film.phases, whole->phaseNames());
  EXPECT_EQ(film.frames.back().phase, 3);
  // The same by hand.
  Runner first(whole->parts[0].skill);
  VectorXd x(1);
  x << 0.6;
  const Rollout one = first.run(x, whole->parts[0].skill->task.initial);
  const motion::Ending ending = first.ending();
  Runner second(whole->parts[1].skill);
  x << -0.3;
  const Rollout two = second.run(x, whole->parts[1].skill->task.initial, nullptr, {}, &ending);
  EXPECT_EQ(second.ending().world.state().q, chained.ending().world.state().q);
  EXPECT_EQ(second.ending().world.state().v, chained.ending().world.state().v);
  EXPECT_EQ(r.cost, one.cost + 10 * two.cost);
  EXPECT_GT(one.cost, 0.3);
  EXPECT_LT(two.cost, 0.1);
  // And again, in the same runner: nothing stays.
  EXPECT_EQ(chained.run(whole->initialParameters(), 0).hash, r.hash);
}

TEST_F(Parts, ASkillMayStartWhereAnothersTrialEnds) {
  write("first.toml", part("first", 0.3));
  std::string text = part("second", 0.2);
  text.replace(text.find("[start.pose]\nbase = \"stand\"\n"), 28, "");
  text.replace(text.find("[start]\n"), 8,
               "[start]\nafter = { file = \"first.toml\", parameters = { a = 0.6 } }\n");
  const auto after = Skill::fromFile(write("second.toml", text));
  Runner runner(after);
  const Rollout r = runner.run(after->initialParameters(), 0.25);
  Runner first(after->after->skill);
  VectorXd x(1);
  x << 0.6;
  first.run(x, 0.25);
  const motion::Ending ending = first.ending();
  Runner second(after);
  EXPECT_EQ(second.run(after->initialParameters(), 0.25, nullptr, {}, &ending).hash, r.hash);
  EXPECT_NE(run(fromText(part("alone", 0.2))).hash, r.hash);
  // What joints bore is known from the first moment on.
  std::string reads = text;
  reads.replace(reads.find("joint.l_shoulder\", take = \"last\""), 32,
                "joint_force.l_heel\", take = \"first\"");
  const auto bore = Skill::fromFile(write("bore.toml", reads));
  EXPECT_GT(measured(run(bore), *bore, "last"), 3);
  // One that fails is no start.
  text.replace(text.find("first.toml"), 10, "third.toml");
  std::string third = part("third", 0.3);
  third.replace(third.find("com.z < 0.1"), 11, "com.z < 1.0");
  write("third.toml", third);
  try {
    Runner failing(Skill::fromFile(write("second.toml", text)));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("ended with \"low\""), std::string::npos) << e.what();
  }
}

TEST_F(Parts, NothingIsLeftOfAnotherTrial) {
  write("first.toml", part("first", 0.3));
  write("second.toml", part("second", 0.2));
  const auto whole = Skill::fromFile(write("chain.toml", chain(R"_([[skill]]
file = "first.toml"
until = "phase_time > 0.15 || b > 0.9 && time > 0.02"
[[skill]]
file = "second.toml"
)_")));
  VectorXd quick(1);
  VectorXd slow(1);
  quick << 1;
  slow << 0.3;
  Runner fresh(whole);
  const Rollout once = fresh.run(slow, 0);
  EXPECT_NEAR(once.time, 0.251 + 0.2, 1e-9);  // of the phase "two", which began after 0.1 s
  Runner used(whole);
  used.run(quick, 0);
  EXPECT_EQ(used.run(slow, 0).hash, once.hash);
  // Of a part that is never reached the cost is what the file says, whoever ran before.
  std::string failing = part("first", 0.3);
  failing.replace(failing.find("com.z < 0.1"), 11, "time > 0.05");
  write("first.toml", failing);
  const auto cut = Skill::fromFile(write("cut.toml", chain(R"_([[skill]]
file = "first.toml"
[[skill]]
file = "second.toml"
otherwise = 7
)_")));
  EXPECT_NEAR(run(cut).cost, 70, 1);
  const auto unsaid = Skill::fromFile(write("cut.toml", chain(R"_([[skill]]
file = "first.toml"
[[skill]]
file = "second.toml"
)_")));
  EXPECT_TRUE(std::isnan(run(unsaid).cost));
}

TEST_F(Parts, LastAsLongAsTheyDoUnlessTheHorizonIsSaid) {
  write("first.toml", part("first", 0.3));
  std::string text = chain(
      "[[skill]]\nfile = \"first.toml\"\n[[skill]]\nname = \"second\"\nfile = \"first.toml\"\n");
  text.replace(text.find("horizon = 5"), 11, "");
  EXPECT_NEAR(Skill::fromFile(write("chain.toml", text))->horizon, 0.6, 1e-12);
}

TEST_F(Parts, ARunsBestTrialMayBeAPart) {
  const std::string first = write("first.toml", part("first", 0.3)).string();
  std::ifstream in(first);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  {
    RunFile run = RunFile::create(folder / "first.run",
                                  {{"skill_text", text}, {"skill_file", first}, {"task", "0.5"}});
    const std::vector<TrialRow> trials = {{0, 0, 0.1, false, "low", {0.9}},
                                          {0, 1, 0.3, false, "", {0.2}},
                                          {0, 2, 0.2, false, "", {0.7}},
                                          {0, 3, 0.0, true, "", {-0.5}}};
    run.appendGeneration(0, trials, "", {});
    RunFile::create(folder / "family.run",
                    {{"skill_text", text}, {"skill_file", first}, {"tasks", "0:1:3"}});
    RunFile::create(folder / "young.run", {{"skill_text", text}, {"skill_file", first}});
  }
  const auto with = [&](const std::string& file, const std::string& more) {
    return Skill::fromFile(
        write("chain.toml", chain("[[skill]]\nname = \"first\"\nfile = \"" + file + "\"\n" + more +
                                  "[[skill]]\nname = \"second\"\nfile = \"first.toml\"\n")));
  };
  const auto whole = with("first.run", "");
  EXPECT_EQ(whole->parts[0].parameters, std::vector<std::string>{"(0.7)"});  // feasible, and least
  EXPECT_EQ(whole->parts[0].task, "(0.5)");
  EXPECT_EQ(with("first.run", "task = 0.1\nparameters = { a = \"b\" }\n")->parts[0].parameters,
            std::vector<std::string>{"b"});
  for (const char* file : {"family.run", "young.run"}) EXPECT_THROW(with(file, ""), InputError);
}

TEST_F(Parts, APartThatFailsEndsTheTrialAndIsNamed) {
  write("first.toml", part("first", 0.3));
  std::string failing = part("second", 0.2);
  failing.replace(failing.find("com.z < 0.1"), 11, "time > 0.05");
  write("second.toml", failing);
  const auto whole = Skill::fromFile(write("chain.toml", chain(R"_([[skill]]
file = "first.toml"
[[skill]]
file = "second.toml"
)_")));
  const Rollout r = run(whole);
  EXPECT_EQ(r.ended, "second.low");
  EXPECT_NEAR(r.time, 0.351, 1e-9);
  ASSERT_EQ(whole->failures.size(), 2u);
  EXPECT_EQ(r.violated, (std::vector<bool>{false, true}));
  EXPECT_TRUE(r.failed());
}

TEST_F(Parts, APartMayBeEndedByTheWholeAndTheLastPhasesBeNamed) {
  write("first.toml", part("first", 3));
  write("second.toml", part("second", 0.2));
  const auto whole = Skill::fromFile(write("chain.toml", chain(R"_([[skill]]
file = "first.toml"
until = "in.first && time > 0.2"
[[skill]]
name = "second"
file = "second.toml"
)_",
                                                               R"_([measures]
handed = { of = "time", take = "last", when = "ended.first" }
later = { of = "time", take = "first", during = ["second"] }
inside = { of = "in.second.one", take = "integral" }
)_")));
  const Rollout r = run(whole);
  EXPECT_NEAR(measured(r, *whole, "handed"), 0.201, 1e-9);
  EXPECT_NEAR(measured(r, *whole, "later"), 0.201, 1e-9);
  EXPECT_NEAR(measured(r, *whole, "inside"), 0.1, 1e-9);
  EXPECT_NEAR(r.time, 0.401, 1e-9);
}

TEST_F(Parts, WhatCannotBeAPartIsSaid) {
  const auto said = [&](const std::string& rows) {
    try {
      Skill::fromFile(write("chain.toml", chain(rows)));
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  write("first.toml", part("first", 0.3));
  const std::string second = "[[skill]]\nname = \"second\"\nfile = \"first.toml\"\n";
  EXPECT_EQ(said("[[skill]]\nfile = \"first.toml\"\n" + second), "accepted");
  const auto expect = [&](const std::string& row, const std::string& words) {
    EXPECT_NE(said(row + second).find(words), std::string::npos) << said(row + second);
  };
  expect("[[skill]]\nfile = \"none.toml\"\n", "none.toml");
  expect("[[skill]]\nfile = \"chain.toml\"\nname = \"first\"\n", "is a part of itself");
  expect("[[skill]]\nfile = \"first.toml\"\nparameters = { c = 1 }\n", "c");
  expect("[[skill]]\nfile = \"first.toml\"\nname = \"second\"\n", "have this name");
  std::string other = part("first", 0.3);
  other.replace(other.find("[parameters]"), 0, "[controller]\nkp = 3\n");
  write("stiff.toml", other);
  expect("[[skill]]\nname = \"first\"\nfile = \"stiff.toml\"\n", "[controller]: expected that of");
  std::string quick = "time_step = 0.002\n" + part("first", 0.3);
  write("quick.toml", quick);
  expect("[[skill]]\nname = \"first\"\nfile = \"quick.toml\"\n", "\"time_step\": 0.002 s");
}

TEST(SkillWords, TheLastPhaseMayEndToo) {
  const auto skill =
      fromText(standing(0.4, "stop = \"ended.two\"", "until = \"phase_time >= 0.2\""));
  const Rollout r = run(skill);
  EXPECT_EQ(r.ended, "stop");
  EXPECT_NEAR(r.time, 0.3, 1e-9);
}

TEST(SkillWords, NumbersThatAreNoneMakeAFailedTrial) {
  const auto skill = fromText(standing(0.1, "", "", "", "height = \"sqrt(a - 0.2)\""));
  Runner runner(skill);
  VectorXd x(1);
  x << 0.1;
  const Rollout r = runner.run(x, 0.25);
  EXPECT_TRUE(r.diverged);
  EXPECT_EQ(r.ended, "diverged");
  EXPECT_FALSE(runner.run(skill->initialParameters(), 0.25).diverged);
  EXPECT_NE(mistakes(standing(0.1, "", "", "", "height = \"sqrt(a - 2)\"")).find("[start]"),
            std::string::npos);
  EXPECT_NE(mistakes(standing(0.1, "", "", "", "height = -0.1")).find("begins inside"),
            std::string::npos);
}

TEST(SkillWords, AFactorBelowZeroIsZero) {
  const auto end = [](const std::string& factor) {
    const auto skill = fromText(standing(0.3, "", "", "stiffness = \"" + factor + "\"", "", 0.3));
    Runner runner(skill);
    runner.run(skill->initialParameters(), 0.25);
    return runner.ending().world.state().q;
  };
  EXPECT_EQ(end("1 - phase_time / 0.1"), end("max(0, 1 - phase_time / 0.1)"));
}

TEST_F(Parts, NamesWithOtherSignsAreQuotedAndThatIsTold) {
  std::ofstream(folder / "bot.xml") << R"_(<mujoco><worldbody><body pos="0 0 1"><freejoint/>
    <geom size=".1"/><body name="leg-l"><joint name="hip-l"/><geom size=".1"/></body></body>
    </worldbody></mujoco>)_";
  const auto with = [&](const std::string& signal) {
    std::string text =
        "name = \"x\"\nrobot = \"bioloid-gp\"\nhorizon = 0.1\n[parameters]\n"
        "a = { range = [0, 1] }\n[[phase]]\nname = \"p\"\n[measures]\n"
        "m = { of = \"" +
        signal +
        "\", take = \"last\" }\n"
        "[[objective]]\nname = \"m\"\ncost = \"m\"\n";
    robot = (folder / "bot.xml").string();
    return Skill::fromFile(write("quoted.toml", text));
  };
  EXPECT_NO_THROW(with("joint.'hip-l' + body.'leg-l'.z"));
  try {
    with("2 * joint.hip-l");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("\"joint.'hip-l'\"? Signs other"), std::string::npos)
        << e.what();
  }
}

TEST(SkillWords, EachMistakeIsSaid) {
  const auto expect = [](const std::string& text, const std::string& words) {
    EXPECT_NE(mistakes(text).find(words), std::string::npos) << words << "\n" << mistakes(text);
  };
  const auto phase = [&](const std::string& text, const std::string& words) {
    expect(standing(1, "", "", text), words);
  };
  phase("[[phase.force]]\ncom = false\nforce = [0, 0, 1]", "\"bodies\" is missing");
  phase("[[phase.force]]\ncom = true\ntouching = true\nforce = [0, 0, 1]", "\"against\" with it");
  phase("[[phase.force]]\nbodies = []\nforce = [0, 0, 1]", "at least one body");
  phase("[[phase.reach.goal]]\nof = \"feet\"\nroll = 0", "expected one body");
  phase("[[phase.reach.goal]]\nof = \"torso\"\nfrom = \"com\"\nroll = 0", "expected x, y, z");
  phase("stiffness = { thihg = 1 }", "Did you mean \"thigh\"?");
  phase("damping = [1]", "expected a number or an expression");
  phase("[[phase.force]]\nbodies = [\"feet\"]\npoints = [\"head\"]\nforce = [0, 0, 1]",
        "expected one of \"bodies\", \"points\" and \"com\"");
  phase("[[phase.force]]\npoints = [\"hed\"]\nforce = [0, 0, 1]", "Did you mean \"head\"?");
  phase("[[phase.force]]\ncom = true\nmoment = [0, 0, 1]", "a moment is on a body");
  phase("[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, 1]\nframe = \"cop\"",
        "expected one of world, cop to com, heading");
  phase("[[phase.force]]\nbodies = [\"feet\"]\nforce = [0, 0, 1]\nagainst = [\"foot\"]",
        "no body named \"foot\"");
  phase("[phase.reach]\nhold = [\"feet\"]", "expected at least one goal");
  phase("[[phase.reach.goal]]\nof = \"com\"", "expected where it should be");
  phase("[[phase.reach.goal]]\nof = \"com\"\nroll = 0", "expected one body");
  phase("[[phase.reach.goal]]\nof = \"comm\"\nx = 0", "expected \"com\", a contact point");
  phase("[phase.reach]\nevery = -1\n[[phase.reach.goal]]\nof = \"com\"\nx = 0",
        "expected seconds >= 0");
  expect(standing(1, "", "[[push]]\nbody = \"torso\"\nforce = [1, 0, 0]"),
         "\"start\": expected when");
  expect(standing(1, "", "[[push]]\nbody = \"tors\"\nforce = [1, 0, 0]\nstart = 1"),
         "Did you mean \"torso\"?");
  expect(standing(1, "", "[[push]]\nbody = \"torso\"\nstart = 1"), "\"force\": expected a list");
  expect(standing(1, "", "[constants]\nx = \"1/0\""), "finite");
  expect(standing(1, "", "[constants]\nxx = 1\ny = \"xxx\""), "Did you mean \"xx\"?");
  expect(standing(1, "", "[[push]]\nbody = \"feet\"\nforce = [1, 0, 0]\nstart = 1"), "is a group");
  expect(standing(1, "", "[[feedback]]\njoints = [\"hip\"]"), "\"add\" is missing");
  expect(standing(1, "stop = \"ended.thre\"", ""), "nothing here is named \"ended.thre\"");
  expect(standing(1, "", "[measures]\nx = { of = 1, take = \"last\", when = \"nothing\" }"),
         "nothing here is named \"nothing\"");
  expect(standing(1, "", "", "", "height = \"com.z\""), "nothing here is named \"com.z\"");
  expect(standing(1, "", "", "", "velocity = [1, 2]"), "expected a list of 3");
  expect(standing(1, "", "", "", "after = { file = \"no.toml\" }"), "no.toml");
}

}  // namespace
}  // namespace traceur::skill
