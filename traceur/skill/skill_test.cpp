#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/optim/minimise.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"
#include "traceur/skill/skill_testing.h"

namespace traceur::skill {
namespace {

constexpr const char* kJump = "skills/bioloid-gp/jump.toml";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// A skill of one parameter that does next to nothing, for a fraction of a second.
constexpr const char* kNod = R"(
name = "nod"
robot = "bioloid-gp"
horizon = 0.2
[task]
default = 0.1
range = [0, 1]
tolerance = 0.01
achieved = "bent"
[start.pose]
base = "stand"
[parameters]
lean = { unit = "rad", range = [-1, 1], initial = 0.3 }
[[phase]]
name = "bend"
pose = { base = "stand", shoulder = "2 * lean", hip = 0.05 }
until = "phase_time >= 0.1"
[[phase]]
name = "hold"
pose = { base = "previous" }
[measures]
bent = { of = "joint.l_shoulder", take = "last" }
highest = { of = "com.z", take = "max" }
early = { of = "time", take = "max", during = ["bend"] }
[[failure]]
name = "fall"
when = "com.z < 0.1"
[[objective]]
name = "bend"
cost = "(bent - task)^2"
[[objective]]
name = "fall"
cost = "10 * fall"
)";

TEST(SkillFile, PhasesMayFormACycle) {
  const std::string swing =
      replaced(replaced(kNod, "pose = { base = \"previous\" }",
                        "pose = { base = \"stand\", shoulder = \"-2 * lean\" }\n"
                        "until = \"phase_time >= 0.03\"\nthen = \"bend\""),
               "phase_time >= 0.1", "phase_time >= 0.02");
  const auto skill = fromText(swing);
  sim::Recording recording;
  Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1, &recording);
  // 0.2 s in turns of 0.02 and 0.03, each to the step, whenever it begins.
  ASSERT_EQ(recording.frames.size(), 21U);
  for (int k = 0; k <= 20; ++k) EXPECT_EQ(recording.frames[k].phase, k % 5 < 2 ? 0 : 1) << k;
  EXPECT_NE(mistakes(replaced(swing, "then = \"bend\"", "then = \"bned\""))
                .find("no phase named \"bned\". Did you mean \"bend\"?"),
            std::string::npos);
}

TEST(SkillFile, APhaseEndsByTheFirstExitThatHolds) {
  const std::string text = replaced(kNod, "pose = { base = \"previous\" }", R"(
pose = { base = "previous" }
until = "phase_time >= 0.02"
then = "bend"
[[phase.exit]]
when = "lean > 0.2 && time >= 0.05"
then = "rest"
[[phase.exit]]
when = "time >= 0.05"
then = "bend"
[[phase]]
name = "rest"
)");
  const std::string quick = replaced(text, "phase_time >= 0.1", "phase_time >= 0.04");
  const auto phases = [&](double lean) {
    sim::Recording recording;
    Runner(fromText(quick)).run(VectorXd::Constant(1, lean), 0.1, &recording);
    std::vector<int> out;
    for (const sim::Frame& f : recording.frames) out.push_back(f.phase);
    return std::vector<int>(out.begin(), out.begin() + 11);
  };
  EXPECT_EQ(phases(0.3), (std::vector<int>{0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2}));
  // From 0.05 s on the second holds as soon as the phase is entered.
  EXPECT_EQ(phases(0.1), (std::vector<int>{0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
  EXPECT_NE(
      mistakes(replaced(quick, "then = \"rest\"", "then = \"nap\"")).find("no phase named \"nap\""),
      std::string::npos);
  EXPECT_NE(mistakes(replaced(quick, "when = \"time >= 0.05\"", "")).find("\"when\""),
            std::string::npos);
}

TEST(Rollout, PhasesThatEndAtOnceEndOnceAStep) {
  const std::string text =
      replaced(replaced(kNod, "pose = { base = \"previous\" }",
                        "pose = { base = \"previous\" }\nuntil = \"time >= 0\"\nthen = \"bend\""),
               "phase_time >= 0.1", "time >= 0");
  std::vector<int> phases;
  Runner(fromText(text))
      .run(VectorXd::Constant(1, 0.3), 0.1, nullptr,
           [&](double, int phase, const control::JointTarget&) { phases.push_back(phase); });
  EXPECT_EQ(phases, std::vector<int>(200, 0));  // two phases: round the cycle once
}

TEST(SkillProblem, ScoresOneTrialForAllTasks) {
  const auto skill = fromText(kNod);
  const VectorXd tasks = VectorXd::LinSpaced(3, 0, 1);
  const SkillProblem family(skill, tasks);
  EXPECT_EQ(family.tasks(), tasks);
  const VectorXd x = VectorXd::Constant(1, 0.2);
  const optim::Evaluation e = family.evaluate(x);
  ASSERT_EQ(e.task_costs.size(), 3U);
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(e.task_costs[i], SkillProblem(skill, tasks[i]).evaluate(x).cost) << tasks[i];
    sum += e.task_costs[i];
  }
  EXPECT_DOUBLE_EQ(e.cost, sum / 3);
}

TEST(SkillProblem, RefusesTasksThatChangeTheMotion) {
  const auto skill = fromText(replaced(kNod, "hip = 0.05", "hip = \"0.05 * task\""));
  EXPECT_NO_THROW(SkillProblem(skill, 0.5));
  EXPECT_THROW(SkillProblem(skill, VectorXd(VectorXd::LinSpaced(3, 0, 1))), InputError);
}

TEST(Rollout, AFailureOfTheLastStepIsWhatEndsIt) {
  const auto skill = fromText(replaced(kNod, "com.z < 0.1", "time >= 0.2"));
  VectorXd x(1);
  x << 0.3;
  const Rollout r = Runner(skill).run(x, 0.1);
  EXPECT_TRUE(r.failed());
  EXPECT_EQ(r.ended, skill->failures[0].name);
  EXPECT_NEAR(r.time, 0.2, 1e-9);
}

TEST(SkillFile, TheNodDoesWhatItSays) {
  const auto skill = fromText(kNod);
  Runner runner(skill);
  sim::Recording recording;
  VectorXd x(1);
  x << 0.3;
  const Rollout r = runner.run(x, 0.1, &recording);
  EXPECT_EQ(r.ended, "horizon");
  EXPECT_NEAR(r.time, 0.2, 1e-9);
  EXPECT_FALSE(r.failed());
  EXPECT_NEAR(r.achieved, r.measures[0], 0);
  EXPECT_NEAR(r.cost, (r.measures[0] - 0.1) * (r.measures[0] - 0.1), 1e-15);
  EXPECT_NEAR(r.measures[2], 0.1, 1.1e-3);
  EXPECT_GT(r.measures[0], 0.05);  // the arms are on their way to 0.6 rad
  EXPECT_EQ(recording.frames.size(), 21u);
  EXPECT_EQ(recording.frames.front().phase, 0);
  EXPECT_EQ(recording.frames.back().phase, 1);
  const auto& shoulder = skill->phases[0].targets;
  ASSERT_EQ(shoulder.size(), 4u);  // two pairs of joints
}

TEST(SkillFile, AParameterBeginsInTheMiddleUnlessItSays) {
  EXPECT_EQ(fromText(kNod)->initialParameters()[0], 0.3);
  const auto skill = fromText(replaced(kNod, "range = [-1, 1], initial = 0.3", "range = [-1, 4]"));
  EXPECT_EQ(skill->initialParameters()[0], 1.5);
  EXPECT_EQ(SkillProblem(skill, 0.1).lower()[0], -1);
  EXPECT_EQ(SkillProblem(skill, 0.1).upper()[0], 4);
}

/// A skill that has every key once.
constexpr const char* kAll = R"(
name = "all"
description = "has every key"
robot = "bioloid-gp"
horizon = 0.7
time_step = 0.002
stop = "time > 0.6"
target_cost = 0.25
[task]
name = "height"
unit = "m"
default = 0.3
range = [0.1, 0.9]
tolerance = 0.02
achieved = "2 * top"
[scene]
friction = 0.6
rolling_friction = 0.01
compliance = 0.009
[[scene.box]]
name = "crate"
size = [0.2, 0.4, 0.6]
at = [3, 4, 0.3]
yaw = 0.5
mass = 7
friction = 0.123
[[scene.ball]]
name = "ball"
radius = 0.1
at = [5, 6, 0.1]
mass = 2
[[scene.wall]]
name = "wall"
at = [9, 0, 0]
yaw = 3.141592653589793
width = 2
height = 3
[[scene.rail]]
name = "rail"
from = [1, 2, 1]
to = [1, 4, 1]
radius = 0.03
[start.pose]
base = "stand"
hip = 0.11
[controller]
kp = 31
kd = 1.7
torque_limit = 0.8
speed_limit = 5
[parameters]
a = { unit = "rad", range = [-1, 2], initial = 0.5, help = "words" }
b = { range = [3, 4] }
[[phase]]
name = "one"
pose = { base = "crouch", hip = "a", l_shoulder = 0.2 }
blend = "0.1 * b"
limited = false
until = "phase_time > 0.2"
force = [{ bodies = ["l_foot", "r_foot"], at = [0.01, 0.02, 0.03], force = ["a", "b", 5] }]
[[phase]]
name = "two"
pose = { base = "previous" }
until = "time > 0.5"
then = "one"
[[phase]]
name = "three"
[[feedback]]
joints = ["hip"]
add = "0.1 * root.pitch"
during = ["two"]
[measures]
top = { of = "com.z", take = "max", during = ["one", "three"], otherwise = 4 }
total = { of = "com.x", take = "integral" }
[[failure]]
name = "fall"
when = "com.z < 0.1"
during = ["two", "three"]
[[objective]]
name = "high"
cost = "(top - task)^2"
[[objective]]
name = "low"
cost = "total"
)";

TEST(SkillFile, AKeyThatThereIsNotIsNamedInEveryTable) {
  const std::string text = kAll;
  int tables = 0;
  for (size_t at = 0; (at = text.find("\n[", at)) != std::string::npos; ++at) {
    const size_t line = text.find('\n', at + 1) + 1;
    const std::string table = text.substr(at + 1, line - at - 2);
    if (table == "[parameters]" || table == "[measures]") continue;  // any key is a name there
    std::string wrong = text;
    wrong.insert(line, "nonsense = 1\n");
    EXPECT_NE(mistakes(wrong).find("nonsense"), std::string::npos) << table;
    ++tables;
  }
  EXPECT_EQ(tables, 15);
  for (const char* row : {"a = {", "b = {", "top = {", "total = {", "force = [{"}) {
    EXPECT_NE(mistakes(replaced(text, row, row + std::string("nonsense = 1, "))).find("nonsense"),
              std::string::npos)
        << row;
  }
  EXPECT_NE(mistakes("nonsense = 1" + text).find("nonsense"), std::string::npos);
}

TEST(SkillFile, EveryKeyIsReadIntoItsPlace) {
  const auto skill = fromText(kAll);
  const Skill& s = *skill;
  EXPECT_EQ(s.name, "all");
  EXPECT_EQ(s.text, kAll);
  EXPECT_EQ(s.file, "skills/bioloid-gp/test.toml");
  EXPECT_EQ(s.description, "has every key");
  EXPECT_EQ(s.horizon, 0.7);
  EXPECT_EQ(s.model->timeStep(), 0.002);
  EXPECT_EQ(s.stop, "time > 0.6");
  EXPECT_EQ(s.target_cost, 0.25);
  EXPECT_EQ(s.task.name, "height");
  EXPECT_EQ(s.task.unit, "m");
  EXPECT_EQ(std::vector<double>({s.task.initial, s.task.min, s.task.max, s.task.tolerance}),
            std::vector<double>({0.3, 0.1, 0.9, 0.02}));
  EXPECT_EQ(s.task.achieved, "2 * top");

  sim::World world(s.model);
  world.reset(s.start);
  const auto at = [&](const char* body) {
    return sim::Vector3d(world.snapshot().bodyPosition(s.model->body(body)));
  };
  const auto axis = [&](const char* body, int k) {
    return sim::Vector3d(world.snapshot().bodyRotation(s.model->body(body)).col(k));
  };
  EXPECT_LT((at("crate") - sim::Vector3d(3, 4, 0.3)).norm(), 1e-9);
  EXPECT_LT((axis("crate", 0) - sim::Vector3d(std::cos(0.5), std::sin(0.5), 0)).norm(), 1e-9);
  EXPECT_LT((axis("crate", 2) - sim::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_LT((at("ball") - sim::Vector3d(5, 6, 0.1)).norm(), 1e-9);
  EXPECT_NEAR(at("wall").z(), 1.5, 1e-9);
  EXPECT_GT(at("wall").x(), 9);  // behind its face, which looks at -x
  EXPECT_LT((at("rail") - sim::Vector3d(1, 3, 1)).norm(), 1e-9);
  EXPECT_NEAR(std::abs(axis("rail", 2).y()), 1, 1e-9);
  for (const char* fixed : {"wall", "rail"}) EXPECT_TRUE(s.model->isStatic(s.model->body(fixed)));
  for (const char* free : {"crate", "ball"}) EXPECT_FALSE(s.model->isStatic(s.model->body(free)));
  for (const char* number : {"0.123", "0.1 0.2 0.3", "0.6 ", " 0.01", "0.009"}) {
    EXPECT_NE(s.model->mjcf().find(number), std::string::npos) << number;
  }
  // A push of m·v moves what has the mass it says: 1 N for one step.
  for (const auto& [name, mass] : {std::pair("crate", 7.0), std::pair("ball", 2.0)}) {
    const sim::BodyId body = s.model->body(name);
    const double before = world.snapshot().bodyVelocity(body).z();
    world.push(body, {0, 0, 1000});
    world.step({VectorXd::Zero(s.model->nu())});
    world.push(body, sim::Vector3d::Zero());
    EXPECT_NEAR(world.snapshot().bodyVelocity(body).z() - before, 0.002 * (1000 / mass - 9.81),
                1e-6)
        << name;
  }

  const auto& joints = s.model->joints();
  const auto index = [&](const std::string& joint) {
    return std::find_if(joints.begin(), joints.end(), [&](auto& j) { return j.name == joint; }) -
           joints.begin();
  };
  const auto& poses = s.model->robot()->poses;
  EXPECT_EQ(s.start.q[s.model->joint("l_hip").q], 0.11);
  EXPECT_EQ(s.start.q[s.model->joint("r_hip").q], -0.11);
  EXPECT_EQ(s.start.q[s.model->joint("l_shin").q], poses.at("stand").joints.at("l_shin"));
  control::StablePd pd = controllerOf(s);
  for (const sim::JointGain& g : pd.gains()) EXPECT_EQ(std::pair(g.kp, g.kd), std::pair(31.0, 1.7));
  for (const sim::JointLimit& l : pd.limits()) {
    EXPECT_EQ(std::pair(l.torque, l.speed), std::pair(0.8, 5.0));
  }
  ASSERT_EQ(s.parameters.size(), 2U);
  const ParamSpec& a = s.parameters[0];
  EXPECT_EQ(a.name + a.unit + a.help, "aradwords");
  EXPECT_EQ(std::vector<double>({a.min, a.max, a.initial}), std::vector<double>({-1.0, 2.0, 0.5}));
  EXPECT_EQ(s.parameters[1].initial, 3.5);

  ASSERT_EQ(s.phases.size(), 3U);
  const Phase& one = s.phases[0];
  EXPECT_EQ(one.name, "one");
  EXPECT_FALSE(one.from_previous);
  EXPECT_EQ(one.base[index("l_shin")], poses.at("crouch").joints.at("l_shin"));
  ASSERT_EQ(one.targets.size(), 3U);
  EXPECT_EQ(one.targets[0].expression, "a");
  EXPECT_EQ(one.targets[0].joint, index("l_hip"));
  EXPECT_EQ(one.targets[1].joint, index("r_hip"));
  EXPECT_EQ(one.targets[2].joint, index("l_shoulder"));
  EXPECT_EQ(one.targets[2].expression, "(0.2)");
  EXPECT_EQ(one.blend, "0.1 * b");
  EXPECT_FALSE(one.limited);
  ASSERT_EQ(one.exits.size(), 1U);
  EXPECT_EQ(one.exits[0].when, "phase_time > 0.2");
  EXPECT_EQ(one.exits[0].next, 1);
  ASSERT_EQ(one.forces.size(), 1U);
  const ForceTerm& f = one.forces[0];
  ASSERT_EQ(f.points.size(), 2U);
  EXPECT_EQ(s.model->bodyName(f.points[1].body), "r_foot");
  for (const sim::BodyPoint& p : f.points) EXPECT_EQ(p.p_BP, sim::Vector3d(0.01, 0.02, 0.03));
  EXPECT_EQ(f.force.x + f.force.y + f.force.z, "ab(5)");
  EXPECT_TRUE(s.phases[1].from_previous);
  EXPECT_TRUE(s.phases[1].limited);
  EXPECT_EQ(s.phases[1].exits.at(0).next, 0);
  EXPECT_TRUE(s.phases[2].exits.empty());
  EXPECT_EQ(s.phases[2].base, VectorXd(VectorXd::Zero(s.model->nu())));

  using During = std::vector<bool>;
  ASSERT_EQ(s.feedback.size(), 1U);
  ASSERT_EQ(s.feedback[0].joints.size(), 2U);
  EXPECT_EQ(s.feedback[0].joints[1].expression, "0.1 * root.pitch");
  EXPECT_EQ(s.feedback[0].joints[1].sign, -1);
  EXPECT_EQ(s.feedback[0].during, During({false, true, false}));
  ASSERT_EQ(s.measures.size(), 2U);
  EXPECT_EQ(s.measures[0].name + s.measures[0].of, "topcom.z");
  EXPECT_EQ(s.measures[0].take, Measure::Take::kMax);
  EXPECT_EQ(s.measures[0].otherwise, 4);
  EXPECT_EQ(s.measures[0].during, During({true, false, true}));
  EXPECT_EQ(s.measures[1].otherwise, 0);
  EXPECT_EQ(s.measures[1].during, During({true, true, true}));
  ASSERT_EQ(s.failures.size(), 1U);
  EXPECT_EQ(s.failures[0].when, "com.z < 0.1");
  EXPECT_EQ(s.failures[0].during, During({false, true, true}));
  ASSERT_EQ(s.terms.size(), 2U);
  EXPECT_EQ(s.terms[1].name + s.terms[1].cost, "lowtotal");
}

TEST(SkillFile, BoundsOfItsNumbersAreWhereItSaysTheyAre) {
  const auto with = [](const std::string& from, const std::string& to) {
    return mistakes(replaced(kNod, from, to));
  };
  EXPECT_EQ(with("horizon = 0.2", "horizon = 600"), "accepted");
  EXPECT_NE(with("horizon = 0.2", "horizon = 600.1"), "accepted");
  EXPECT_NE(with("horizon = 0.2", "horizon = 0"), "accepted");
  EXPECT_EQ(with("tolerance = 0.01", "tolerance = 0"), "accepted");
  EXPECT_NE(with("tolerance = 0.01", "tolerance = -0.01"), "accepted");
  for (const char* fits : {"default = 0", "default = 1"}) {
    EXPECT_EQ(with("default = 0.1", fits), "accepted") << fits;
  }
  for (const char* not_in : {"default = -0.1", "default = 1.1"}) {
    EXPECT_NE(with("default = 0.1", not_in), "accepted") << not_in;
  }
  for (const char* fits : {"initial = -1", "initial = 1"}) {
    EXPECT_EQ(with("initial = 0.3", fits), "accepted") << fits;
  }
  for (const char* not_in : {"initial = -1.1", "initial = 1.1"}) {
    EXPECT_NE(with("initial = 0.3", not_in), "accepted") << not_in;
  }
  EXPECT_NE(with("range = [-1, 1], initial = 0.3", "range = [1, 1], initial = 1"), "accepted");
  const auto top = [](const std::string& line) { return mistakes(line + std::string(kNod)); };
  EXPECT_EQ(top("time_step = 0.002"), "accepted");
  EXPECT_NE(top("time_step = 0.0201"), "accepted");
  EXPECT_NE(top("time_step = 0"), "accepted");
  EXPECT_EQ(top("time_step = 1e-6"), "accepted");
  EXPECT_NE(top("time_step = 0.9e-6"), "accepted");
  for (const char* range : {"range = [0, inf]", "range = [-inf, 0]", "range = [0]"}) {
    EXPECT_NE(with("range = [-1, 1], initial = 0.3", range), "accepted") << range;
  }
  const auto scene = [](const std::string& line) {
    return mistakes(std::string(kNod) + "[scene]\n" + line);
  };
  EXPECT_EQ(scene("compliance = 0.002"), "accepted");
  EXPECT_NE(scene("compliance = 0.0019"), "accepted");
  EXPECT_EQ(scene("damping_ratio = 0.1"), "accepted");
  EXPECT_NE(scene("damping_ratio = 0"), "accepted");
  EXPECT_EQ(scene("friction = 0\nrolling_friction = 0"), "accepted");
  EXPECT_NE(scene("friction = -0.1"), "accepted");
  EXPECT_NE(scene("rolling_friction = -0.1"), "accepted");
  EXPECT_EQ(mistakes("time_step = 0.02" + std::string(kNod) + "[scene]\ncompliance = 0.04"),
            "accepted");
  EXPECT_EQ(with("[parameters]",
                 "[controller]\nkp = 0\nkd = 0\ntorque_limit = 0\nspeed_limit = 0\n[parameters]"),
            "accepted");
  for (const char* key : {"kp", "kd", "torque_limit", "speed_limit"}) {
    const auto controller = [&](const char* value) {
      return with("[parameters]",
                  "[controller]\n" + std::string(key) + " = " + value + "\n[parameters]");
    };
    EXPECT_NE(controller("-0.1").find(std::string(key) + "\": expected a number >= 0"),
              std::string::npos);
  }
  for (const char* wrong :
       {"[[scene.ball]]\nname = \"b\"\nat = [5, 0, 1]\nradius = 0\nmass = 1",
        "[[scene.ball]]\nname = \"b\"\nat = [5, 0, 1]\nradius = 0.1\nmass = -1",
        "[[scene.wall]]\nname = \"w\"\nat = [5, 0, 0]\nwidth = 0\nheight = 1",
        "[[scene.wall]]\nname = \"w\"\nat = [5, 0, 0]\nwidth = 1\nheight = 0",
        "[[scene.rail]]\nname = \"r\"\nfrom = [5, 0, 1]\nto = [6, 0, 1]\nradius = 0"}) {
    EXPECT_NE(mistakes(std::string(kNod) + wrong).find("expected a number > 0"), std::string::npos)
        << wrong;
  }
  // How deep a robot may begin in what lies on the ground: a millimetre, engines differ by another.
  const auto step = [&](const char* at) {
    return mistakes(std::string(kNod) +
                    "[[scene.box]]\nname = \"step\"\nsize = [0.3, 0.3, 0.05]\nat = " + at);
  };
  EXPECT_EQ(step("[0, 0, -0.0245]"), "accepted");
  EXPECT_NE(
      step("[0, 0, -0.0225]").find("test.toml: [start.pose]: the robot begins inside \"step\""),
      std::string::npos);
}

/// Of a mistake the one word that matters; the rest can still be judged.
TEST(SkillFile, EachMistakeIsSaidAndNoOther) {
  const auto count = [](const std::string& text, const std::string& word) {
    int n = 0;
    for (size_t at = 0; (at = text.find(word, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  const std::string nod = kNod;
  const auto only = [&](const std::string& text, const std::string& words) {
    const std::string said = mistakes(text);
    EXPECT_NE(said.find(words), std::string::npos) << words << "\n" << said;
    EXPECT_EQ(count(said, "test.toml:"), 1) << said;
  };
  const auto with = [&](const std::string& from, const std::string& to, const std::string& words) {
    only(replaced(nod, from, to), words);
  };
  only(nod + "[scene]\nfriction = -0.1\n", "\"friction\": expected a number >= 0");
  only(nod + "[scene]\nrolling_friction = -0.1\n", "\"rolling_friction\": expected");
  only(nod + "[scene]\ncompliance = 1e-4\n", "\"compliance\" 0.0001 s");
  only("time_step = 1" + nod, "\"time_step\": expected seconds in");
  with("\"bioloid-gp\"", "\"bioloid\"", "no robot \"bioloid\"");
  with("robot = \"bioloid-gp\"\n", "", "\"robot\" is missing");
  with("name = \"hold\"", "name = \"bend\"", "\"bend\": two phases have this name");
  with("until = \"phase_time >= 0.1\"\n", "",
       "phase \"bend\": \"until\" is missing: expected the condition that begins \"hold\"");
  with("of = \"com.z\", ", "", "measure \"highest\": \"of\" is missing");
  with("when = \"com.z < 0.1\"\n", "", "failure \"fall\": \"when\" is missing");
  with("cost = \"10 * fall\"", "", "objective \"fall\": \"cost\" is missing");
  with("hip = 0.05", "l_shoulderr = 0.05", "Did you mean \"l_shoulder\"?");
  with("hip = 0.05", "hip = inf", "expected a finite number");
  with("hip = 0.05", "hip = [1]", "expected a number or an expression, got");
  with("[parameters]", "hip = \"lean\"\n[parameters]",
       "the same in every trial: expected a number");
  // What may be named where.
  with("2 * lean", "bent", "nothing here is named \"bent\"");
  with("phase_time >= 0.1", "bent > 0", "nothing here is named \"bent\"");
  with("10 * fall", "com.z", "\"com.z\" is a signal: expected names of measures");
  with("10 * fall", "in.bend", "nothing here is named \"in.bend\"");
  with("10 * fall", "phase_time", "nothing here is named \"phase_time\"");
  for (const char* place : {"2 * lean", "phase_time >= 0.1", "10 * fall"}) {
    EXPECT_EQ(mistakes(replaced(nod, place, "pi + task + horizon + lean")), "accepted") << place;
  }
  EXPECT_EQ(mistakes(replaced(nod, "10 * fall", "time + fall + bent")), "accepted");
  EXPECT_EQ(mistakes(replaced(nod, "2 * lean", "time + com.z + in.bend")), "accepted");
  // A force has three parts and a body that there is.
  const auto force = [&](const std::string& row) {
    return replaced(nod, "name = \"hold\"\n", "name = \"hold\"\nforce = [{ " + row + " }]\n");
  };
  EXPECT_EQ(mistakes(force("bodies = [\"l_hand\"], force = [1, 2, \"lean\"]")), "accepted");
  for (const char* wrong : {"", ", force = 1", ", force = [1, 2]", ", force = [1, 2, 3, 4]"}) {
    only(force("bodies = [\"l_hand\"]" + std::string(wrong)), "expected a list of 3 numbers");
  }
  only(force("bodies = [\"l_hnad\"], force = [1, 2, 3]"), "Did you mean \"l_hand\"?");
  only(replaced(replaced(nod, "lean = { unit = \"rad\", range = [-1, 1], initial = 0.3 }\n", ""),
                "2 * lean", "2"),
       "test.toml: [parameters]: expected at least one parameter");
  const size_t objectives = nod.find("[[objective]]");
  only(nod.substr(0, objectives), "test.toml: [[objective]]: expected at least one term");
  std::string no_phases = nod;
  no_phases.erase(no_phases.find("[[phase]]"),
                  no_phases.find("[measures]") - no_phases.find("[[phase]]"));
  only(replaced(no_phases, ", during = [\"bend\"]", ""),
       "test.toml: [[phase]]: expected at least one phase");
}

TEST(SkillFile, WhatIsLeftOutHasItsDefault) {
  const auto skill = fromText(
      replaced(kNod, "default = 0.1\nrange = [0, 1]\ntolerance = 0.01\nachieved = \"bent\"\n", "") +
      "[[scene.box]]\nname = \"crate\"\nsize = [1, 1, 1]\nat = [5, 0, 2]\n"
      "[[scene.wall]]\nname = \"wall\"\nat = [9, 0, 0]\nwidth = 2\nheight = 3\n");
  const Skill& s = *skill;
  EXPECT_EQ(std::vector<double>({s.task.initial, s.task.min, s.task.max, s.task.tolerance}),
            std::vector<double>(4, 0.0));
  EXPECT_EQ(s.task.name, "task");
  EXPECT_TRUE(std::isnan(Runner(skill).run(VectorXd::Zero(1), 0).achieved));
  sim::World world(s.model);
  world.reset(s.start);
  const sim::BodyId crate = s.model->body("crate");
  EXPECT_TRUE(s.model->isStatic(crate));
  EXPECT_TRUE(world.snapshot().bodyRotation(crate).isIdentity(1e-12));
  EXPECT_LT(world.snapshot().bodyPosition(s.model->body("wall")).x(), 9);  // its face looks at +x
  const auto ranged = fromText(replaced(kNod, "default = 0.1\nrange = [0, 1]", "range = [0.2, 1]"));
  EXPECT_EQ(ranged->task.initial, 0.2);

  const control::StablePd usual = control::defaultController(s.model);
  for (const char* key : {"kp", "kd", "torque_limit", "speed_limit"}) {
    const auto some = fromText(
        replaced(kNod, "[parameters]", "[controller]\n" + std::string(key) + " = 1\n[parameters]"));
    control::StablePd pd = controllerOf(*some);
    control::StablePd base = usual;
    const std::string changed = key;
    EXPECT_EQ(pd.gains()[0].kp, changed == "kp" ? 1 : base.gains()[0].kp);
    EXPECT_EQ(pd.gains()[0].kd, changed == "kd" ? 1 : base.gains()[0].kd);
    EXPECT_EQ(pd.limits()[0].torque, changed == "torque_limit" ? 1 : base.limits()[0].torque);
    EXPECT_EQ(pd.limits()[0].speed, changed == "speed_limit" ? 1 : base.limits()[0].speed);
  }
}

TEST(SkillFile, MoreRowsThanAnyoneWritesEndTheReading) {
  const std::string nod = kNod;
  const auto rows = [](int count, const std::string& before, const std::string& after) {
    std::string text;
    for (int i = 0; i < count; ++i) text += fmt::format("{}{}{}", before, i, after);
    return text;
  };
  const auto parameters = [&](int more) {
    return mistakes(replaced(nod, "[parameters]\n",
                             "[parameters]\n" + rows(more, "p", " = { range = [0, 1] }\n")));
  };
  EXPECT_EQ(parameters(499), "accepted");
  EXPECT_NE(parameters(500).find("501 parameters: expected at most 500"), std::string::npos);
  const auto refused = [](const std::string& text, const std::string& words) {
    const std::string said = mistakes(text);
    EXPECT_NE(said.find(words + ": expected at most"), std::string::npos) << said.substr(0, 300);
  };
  refused(replaced(nod, "[measures]\n",
                   "[measures]\n" + rows(498, "m", " = { of = \"time\", take = \"max\" }\n")),
          "501 measures");
  refused(nod + rows(500, "[[failure]]\nname = \"f", "\"\nwhen = \"time < 0\"\n"), "501 failures");
  refused(nod + rows(499, "[[phase]]\nname = \"p", "\"\n"), "501 phases");
  refused(nod + rows(501, "[[scene.box]]\nname = \"b", "\"\nsize = [1, 1, 1]\nat = [5, 0, 0]\n"),
          "501 props");
  const auto terms = [&](int count) {
    return nod + rows(count, "[[objective]]\nname = \"o", "\"\ncost = \"fall\"\n");
  };
  const int ours =
      9;  // of the nod: a target, two conditions, three measures, two costs, "achieved"
  refused(terms(5001 - ours), "the 5001. expression");
  EXPECT_EQ(mistakes(terms(5000 - ours)), "accepted");
}

/// Beside the file, above it, in $TRACEUR_DATA and in the working folder.
TEST(SkillFile, RobotsAreFoundByPathOrName) {
  const TestFolder folder;
  const auto robot = [&](const std::string& path) {
    std::filesystem::create_directories(folder / path);
    std::ofstream(folder / path / "robot.toml") << "name = \"r\"\n";
    return folder / path / "robot.toml";
  };
  const auto above = robot("models/zebra");
  const auto beside = robot("a/models/ant");
  const auto elsewhere = robot("data/models/mole");
  const auto from = folder / "a/b";
  std::filesystem::create_directories(from);
  EXPECT_EQ(findRobot("zebra", from), above);
  EXPECT_EQ(findRobot("ant", from), beside);
  EXPECT_EQ(findRobot("../models/ant/robot.toml", from), from / "../models/ant/robot.toml");
  EXPECT_EQ(findRobot(above.string(), from), above);
  EXPECT_EQ(findRobot("bioloid-gp", from),
            std::filesystem::absolute("models/bioloid-gp/robot.toml"));
  EXPECT_EQ(findRobot("bioloid-gp", ""), std::filesystem::absolute("models/bioloid-gp/robot.toml"));
  EXPECT_THROW(findRobot("mole", from), InputError);
  setenv("TRACEUR_DATA", (folder / "data").c_str(), 1);
  EXPECT_EQ(findRobot("mole", from), elsewhere);
  try {
    findRobot("moles", from);
    FAIL() << "found";
  } catch (const InputError& e) {
    const std::string said = e.what();  // each once, in order
    EXPECT_NE(said.find("one of: ant, athlete, atlas, bioloid-gp, human, mole, odd, zebra. "
                        "Did you mean \"mole\"?"),
              std::string::npos)
        << said;
  }
  unsetenv("TRACEUR_DATA");
}

TEST(SkillFile, WhereNoRobotsAreTheFoldersWithoutAnyAreTold) {
  const TestFolder folder;
  struct WorkingFolder {
    std::filesystem::path before = std::filesystem::current_path();
    explicit WorkingFolder(const std::filesystem::path& now) { std::filesystem::current_path(now); }
    ~WorkingFolder() { std::filesystem::current_path(before); }
  } const there(folder.path());
  try {
    findRobot("zebra", "a");
    FAIL() << "found";
  } catch (const InputError& e) {
    const std::string said = e.what();
    if (said.find("found no models/") == std::string::npos) GTEST_SKIP() << "some are installed";
    const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    for (const auto& root : {folder / "a", folder.path(), folder.path().parent_path(),
                             program.parent_path() / "share/traceur"}) {
      EXPECT_NE(said.find((root / "models").string()), std::string::npos) << root << "\n" << said;
    }
  }
}

TEST(SkillFile, APosesRootIsThatOfTheStart) {
  const auto pitch = [](const Skill& s) {
    sim::World world(s.model);
    world.reset(s.start);
    const auto R = world.snapshot().bodyRotation(s.model->body("torso"));
    return std::atan2(R(0, 2), R(2, 2));
  };
  const auto with = [](const std::string& base) {
    return fromText(replaced(kNod, "base = \"stand\"\n[parameters]", base + "[parameters]"));
  };
  EXPECT_NEAR(pitch(*with("base = \"crouch\"\n")), 0.2895, 1e-9);
  EXPECT_NEAR(pitch(*with("base = \"stand\"\n")), 0, 1e-9);
  const auto zero = with("hip = \"2 * 0.1\"\n");
  EXPECT_NEAR(pitch(*zero), 0, 1e-9);
  EXPECT_EQ(zero->start.q[zero->model->joint("l_hip").q], 0.2);
  EXPECT_EQ(zero->start.q[zero->model->joint("r_hip").q], -0.2);
  EXPECT_EQ(zero->start.q[zero->model->joint("l_shin").q], 0);
}

TEST(SkillFile, MirroredNamesTurnOppositeWhereTheRobotSaysSo) {
  const auto skill = fromText(kNod);
  for (const JointValue& v : skill->phases[0].targets) {
    const std::string& joint = skill->model->joints()[v.joint].name;
    EXPECT_EQ(v.sign, joint == "r_hip" ? -1 : 1) << joint;
  }
}

TEST(SkillFile, ReportsAllMistakesWithPlaceAndSuggestion) {
  std::string text = kNod;
  text = replaced(text, "hip = 0.05", "hpi = 0.05");
  text = replaced(text, "2 * lean", "2 * laen");
  text = replaced(text, "of = \"com.z\"", "of = \"con.z\"");
  text = replaced(text, "take = \"last\"", "take = \"lsat\"");
  text = replaced(text, "until = ", "untill = ");
  text = replaced(text, "range = [-1, 1]", "range = [1, -1]");
  text = replaced(text, "during = [\"bend\"]", "during = [\"bned\"]");
  const std::string m = mistakes(text);
  EXPECT_NE(m.find(":16:"), std::string::npos) << m;
  for (const char* part :
       {"Did you mean \"hip\"?", "Did you mean \"lean\"?", "Did you mean \"com.z\"?",
        "Did you mean \"last\"?", "Did you mean \"until\"?", "min < max, got [1, -1]",
        "Did you mean \"bend\"?"}) {
    EXPECT_NE(m.find(part), std::string::npos) << part << "\n" << m;
  }
}

TEST(SkillFile, RefusesWhatCannotBeRun) {
  const std::string text = kNod;
  EXPECT_NE(
      mistakes(replaced(text, "\"bioloid-gp\"", "\"bioloid\"")).find("Did you mean \"bioloid-gp\""),
      std::string::npos);
  EXPECT_NE(  // a name that no file can have
      mistakes(replaced(text, "\"bioloid-gp\"", '"' + std::string(300, 'r') + '"'))
          .find("no robot"),
      std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "[-1, 1]", "[nan, 1]")).find("finite"), std::string::npos);
  const auto with = [&](const std::string& controller) {
    return mistakes(replaced(text, "[parameters]", "[controller]\n" + controller + "[parameters]"));
  };
  EXPECT_EQ(with("torque_limit = inf\n"), "accepted");
  EXPECT_NE(with("kp = inf\n").find("finite"), std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "horizon = 0.2", "horizon = -1")).find("(0, 600]"),
            std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "default = 0.1", "default = 7")).find("min <= default"),
            std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "[parameters]", "[parameters]\n[unused]")).find("at least one"),
            std::string::npos);
  std::string no_phases = text;  // "during" then names none
  for (size_t at; (at = no_phases.find("[[phase]]")) != std::string::npos;) {
    no_phases.replace(at, 9, "[[phases]]");
  }
  EXPECT_NE(mistakes(no_phases).find("Did you mean \"phase\""), std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "com.z < 0.1", "com.z = 0.1")).find("did you mean '=='"),
            std::string::npos);
  EXPECT_NE(
      mistakes(replaced(text, "base = \"stand\"", "base = \"lie\"")).find("has no pose \"lie\""),
      std::string::npos);
  EXPECT_NE(
      mistakes(replaced(text, "name = \"nod\"", "name = 3")).find("expected text, got a number"),
      std::string::npos);
  EXPECT_NE(mistakes("name = \n").find(":1:"), std::string::npos);
  EXPECT_NE(mistakes("").find("\"robot\" is missing"), std::string::npos);
}

TEST(SkillFile, NamesCanBeSpelledAndMeanOneThing) {
  const std::string text = kNod;
  const auto parameter = [&](const std::string& name) {
    return mistakes(
        replaced(text, "lean = {", name + " = { unit = \"rad\", range = [-1, 1] }\nlean = {"));
  };
  EXPECT_EQ(parameter("other"), "accepted");
  for (const char* bad : {"time", "task", "horizon", "phase_time", "stop", "diverged"}) {
    EXPECT_NE(parameter(bad).find("has a meaning of its own"), std::string::npos) << bad;
  }
  for (const char* bad : {"foot-angle", "\"a,b\"", "\"a b\"", "2x", "max", "pi", "\"com.x\""}) {
    EXPECT_NE(parameter(bad).find("letters, digits"), std::string::npos) << bad;
  }
  for (const char* bad : {"bent", "fall"}) {
    EXPECT_NE(parameter(bad).find("have this name"), std::string::npos) << bad;
  }
  EXPECT_NE(
      mistakes(replaced(text, "name = \"fall\"\nwhen", "name = \"a,b\"\nwhen")).find("\"a,b\""),
      std::string::npos);
  EXPECT_NE(mistakes(replaced(text, "bent = {",
                              "early-bend = { of = \"time\", take = \"max\" }\nbent = {"))
                .find("\"early-bend\""),
            std::string::npos);
}

TEST(SkillFile, MistakesInPropsStandAtTheirLines) {
  const std::string text = kNod;
  const std::string m =
      mistakes(text +
               "[[scene.box]]\nname = \"l_foot\"\nsize = [1, 1, 1]\nat = [5, 0, 0]\n"
               "[[scene.box]]\nname = \"flat\"\nsize = [1, 0, 1]\nat = [5, 0, 0]\n"
               "[[scene.box]]\nname = \"fine\"\nsize = [1, 1, 1]\nat = [5, 0, 0]\n");
  const long first = std::count(text.begin(), text.end(), '\n') + 2;
  EXPECT_NE(m.find(":" + std::to_string(first) + ":8: scene: prop \"l_foot\""), std::string::npos)
      << m;
  EXPECT_NE(m.find(":" + std::to_string(first + 4) + ":8: scene: prop \"flat\""), std::string::npos)
      << m;
  EXPECT_EQ(m.find("fine"), std::string::npos) << m;
  EXPECT_EQ(m.find("\"robot\""), std::string::npos) << m;
  // A robot that cannot be had, or is none, is no prop's mistake.
  const TestFolder folder;
  std::ofstream(folder / "broken.xml") << "<mujoco><worldbody><body></worldbody></mujoco>";
  for (const std::string& robot : {std::string("bioloid"), (folder / "broken.xml").string()}) {
    const std::string said = mistakes(replaced(text, "bioloid-gp", robot) +
                                      "[[scene.box]]\nname = \"fine\"\nsize = [1, 1, 1]\n"
                                      "at = [5, 0, 0]\n");
    EXPECT_NE(said.find("test.toml:3:9: \"robot\": "), std::string::npos) << said;
    EXPECT_EQ(said.find("test.toml:", said.find("test.toml:") + 1), std::string::npos) << said;
  }
}

TEST(SkillFile, TheRobotDoesNotBeginInsideAProp) {
  const auto with = [](const char* at) {
    return mistakes(replaced(kNod, "[start.pose]",
                             "[[scene.box]]\nname = \"step\"\nsize = [0.3, 0.3, 0.05]\nat = " +
                                 std::string(at) + "\n[start.pose]"));
  };
  EXPECT_NE(with("[0, 0, 0.025]").find("inside \"step\""), std::string::npos);
  EXPECT_EQ(with("[1, 0, 0.025]"), "accepted");
}

TEST(SkillFile, SurfacesMustBeSoftEnoughForTheTimeStep) {
  const std::string m =
      mistakes("time_step = 0.005" + std::string(kNod) + "[scene]\ncompliance = 0.008\n");
  EXPECT_NE(m.find("\"compliance\" 0.008 s: expected at least twice the time step, 0.01 s"),
            std::string::npos)
      << m;
}

TEST(SkillFile, AchievedNeedsAToleranceAndNoTargetMeansNone) {
  EXPECT_NE(mistakes(replaced(kNod, "tolerance = 0.01\n", "")).find("\"tolerance\" is missing"),
            std::string::npos);
  EXPECT_EQ(fromText(kNod)->target_cost, -INFINITY);
  EXPECT_EQ(Skill().target_cost, -INFINITY);
}

TEST(Rollout, AMeasureThatSawNothingHasNoValueUnlessTheFileGivesOne) {
  const std::string never =
      replaced(kNod, "take = \"max\", during = [\"bend\"]", "take = \"max\", during = [\"never\"]");
  std::string text = replaced(never, "[measures]",
                              "until = \"time > 9\"\n[[phase]]\nname = \"never\"\n"
                              "pose = { base = \"previous\" }\n[measures]");
  text = replaced(text, "cost = \"10 * fall\"", "cost = \"early\"");
  VectorXd x(1);
  x << 0.3;
  const auto early = [&](const std::string& of) {
    const auto skill = fromText(of);
    const SkillProblem problem(skill, 0.1);
    const double value = Runner(skill).run(x, 0.1).measures[2];
    EXPECT_EQ(problem.evaluate(x).meaningful(), !std::isnan(value));
    return value;
  };
  for (const char* take : {"first", "last", "min", "max", "mean"}) {
    EXPECT_TRUE(std::isnan(early(
        replaced(text, "take = \"max\", during", "take = \"" + std::string(take) + "\", during"))))
        << take;
  }
  // Also where the cost would hide it: max(0, NaN) is 0, and so is NaN < 1.
  for (const char* cost : {"max(0, 1 - early)", "early < 1", "0 * early"}) {
    EXPECT_TRUE(std::isnan(
        early(replaced(text, "cost = \"early\"", "cost = \"" + std::string(cost) + "\""))))
        << cost;
  }
  // Also where there is no other measure, and whatever another one saw.
  std::string alone = replaced(text, "bent = { of = \"joint.l_shoulder\", take = \"last\" }\n", "");
  alone = replaced(alone, "highest = { of = \"com.z\", take = \"max\" }\n", "");
  alone = replaced(alone, "achieved = \"bent\"", "achieved = \"early < 1\"");
  alone = replaced(alone, "(bent - task)^2", "max(0, 1 - early)");
  const Rollout r = Runner(fromText(alone)).run(x, 0.1);
  EXPECT_TRUE(std::isnan(r.terms[0]));
  EXPECT_TRUE(std::isnan(r.achieved));
  EXPECT_TRUE(std::isfinite(Runner(fromText(text)).run(x, 0.1).terms[0]));
  EXPECT_EQ(early(replaced(text, "take = \"max\", during", "take = \"integral\", during")), 0);
  EXPECT_EQ(
      early(replaced(text, "take = \"max\", during", "take = \"max\", otherwise = 7, during")), 7);
}

TEST(Rollout, FeedbackOnWhatHasNoValueAddsNothing) {
  const auto skill = fromText(replaced(
      kNod, "[measures]", "[[feedback]]\njoints = [\"hip\"]\nadd = \"0.1 * cop.x\"\n[measures]"));
  const Rollout r = Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1);  // no COP at the start
  EXPECT_FALSE(r.diverged);
  EXPECT_TRUE(std::isfinite(r.cost));
}

TEST(Rollout, AnIntegralIsOverTheTimeThatPasses) {
  const auto skill = fromText(replaced(kNod, "early = { of = \"time\", take = \"max\"",
                                       "early = { of = \"1\", take = \"integral\""));
  EXPECT_NEAR(Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1).measures[2], 0.1, 1e-12);
  const auto whole =
      fromText(replaced(kNod, "early = { of = \"time\", take = \"max\", during = [\"bend\"]",
                        "early = { of = \"1\", take = \"integral\""));
  EXPECT_NEAR(Runner(whole).run(VectorXd::Constant(1, 0.3), 0.1).measures[2], 0.2, 1e-12);
}

TEST(Rollout, MeasuresAreThoseOfTheStepsTheySee) {
  // What is measured is known at each step, and neither rises nor falls throughout.
  const auto signal = [](int step) { return std::pow(step * 0.001 - 0.13, 2) - 0.004; };
  const std::vector<std::string> takes = {"first", "last", "min", "max", "mean", "integral"};
  const auto measured = [&](const std::string& during) {
    std::string rows = "[measures]\n";
    for (const std::string& take : takes) {
      rows += take;
      rows += "_of = { of = \"(time - 0.13)^2 - 0.004\", take = \"";
      rows += take;
      rows += "\"";
      rows += during;
      rows += " }\n";
    }
    const auto skill = fromText(replaced(kNod, "[measures]\n", rows));
    return Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1).measures;
  };
  const struct {
    std::string during;
    int begin, end;  // steps, the last included
  } cases[] = {{"", 0, 200},
               {", during = [\"bend\"]", 0, 99},
               {", during = [\"hold\"]", 100, 200},
               {", during = [\"bend\", \"hold\"]", 0, 200}};
  for (const auto& [during, begin, end] : cases) {
    SCOPED_TRACE(during);
    double min = signal(begin), max = min, sum = 0, integral = 0;
    for (int i = begin; i <= end; ++i) {
      min = std::min(min, signal(i));
      max = std::max(max, signal(i));
      sum += signal(i);
      if (i < 200) integral += 0.001 * signal(i);  // no time passes after the last
    }
    const double expected[] = {signal(begin),           signal(end), min, max,
                               sum / (end - begin + 1), integral};
    const std::vector<double> all = measured(during);
    const auto nod = fromText(kNod);
    ASSERT_EQ(all.size(), takes.size() + nod->measures.size());
    for (size_t i = 0; i < takes.size(); ++i) EXPECT_NEAR(all[i], expected[i], 1e-12) << takes[i];
  }
}

TEST(Rollout, APhaseCutShortGoesOnFromTheTargetThatWasReached) {
  const auto skill = fromText(replaced(
      replaced(kNod, "until = \"phase_time >= 0.1\"", "blend = 0.2\nuntil = \"phase_time >= 0.1\""),
      "pose = { base = \"previous\" }", "pose = { base = \"stand\" }\nblend = 0.1"));
  double before = NAN;
  double largest = 0;
  Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1, nullptr,
                    [&](double, int, const control::JointTarget& target) {
                      const double q = target.q[skill->model->joint("l_shoulder").v - 6];
                      if (!std::isnan(before)) largest = std::max(largest, std::abs(q - before));
                      before = q;
                    });
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 0.01);  // 0.6 rad in 0.2 s, a step of 1 ms
}

TEST(Rollout, TooManyContactsAreAFailedTrialWithItsOwnWords) {
  std::string mjcf = "<mujoco><worldbody><body name='b' pos='0 0 .12'><freejoint/>";
  for (int i = 0; i < 400; ++i) {
    const int row = i / 20;
    mjcf += "<geom size='.05' mass='.1' pos='" + std::to_string(.11 * (i % 20)) + " " +
            std::to_string(.11 * row) + " 0'/>";
  }
  mjcf +=
      "<body><joint name='j'/><geom size='.01' contype='0' "
      "conaffinity='0'/></body></body></worldbody></mujoco>";
  const TestFolder folder;
  const std::string file = folder / "many.xml";
  std::ofstream(file) << mjcf;
  std::string text = replaced(kNod, "\"bioloid-gp\"", "\"" + file + "\"");
  text = replaced(text, "base = \"stand\"", "");
  text = replaced(text, "base = \"stand\", shoulder = \"2 * lean\", hip = 0.05", "j = \"lean\"");
  text = replaced(text, "joint.l_shoulder", "joint.j");
  text = replaced(text, "com.z < 0.1", "com.z < -1");
  auto skill = std::make_shared<Skill>(*fromText(text));
  // The engine makes room as it goes, within the memory that a scene's text may say.
  std::string scene = skill->model->mjcf();
  scene.insert(scene.rfind("</mujoco>"), "<size memory='300K'/>");
  skill->model = sim::Model::fromMjcf(scene);
  VectorXd x(1);
  x << 0;
  const Rollout r = Runner(skill).run(x, 0.1);
  EXPECT_EQ(r.ended, "too many contacts");
  EXPECT_TRUE(r.failed());
  EXPECT_EQ(r.cost, INFINITY);
}

TEST(SkillFile, EverySkillLoadsAndRuns) {
  int skills = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator("skills")) {
    if (entry.path().extension() != ".toml") continue;
    SCOPED_TRACE(entry.path());
    const auto skill = Skill::fromFile(entry.path());
    Runner runner(skill);
    const Rollout r = runner.run(skill->initialParameters(), skill->task.initial);
    EXPECT_FALSE(r.diverged);
    EXPECT_TRUE(std::isfinite(r.cost));
    EXPECT_GT(r.time, 0.1);
    EXPECT_EQ(r.terms.size(), skill->terms.size());
    ++skills;
  }
  EXPECT_GE(skills, 1);
}

TEST(Rollout, EqualArgumentsGiveEqualBits) {
  const auto skill = Skill::fromFile(kJump);
  Runner a(skill);
  Runner b(skill);
  const VectorXd x = skill->initialParameters();
  VectorXd other = x;
  other[0] -= 0.2;
  const Rollout first = a.run(x, 0.05);
  b.run(other, 0.03);
  sim::Recording recording;  // looking must not change anything
  const Rollout second = b.run(x, 0.05, &recording);
  EXPECT_EQ(first.hash, second.hash);
  EXPECT_EQ(first.cost, second.cost);
  EXPECT_NE(first.hash, a.run(other, 0.05).hash);
}

TEST(Rollout, ADisturbanceIsWhatItSays) {
  const std::string text = Skill::fromFile(kJump)->text;
  const auto with = [&](const Disturbance& d) { return Skill::fromText(text, kJump, d); };
  const auto plain = Skill::fromFile(kJump);
  Disturbance heavy;
  heavy.mass = 1.1;
  EXPECT_NEAR(with(heavy)->model->mass(), 1.1 * plain->model->mass(), 1e-9);
  Disturbance slippery;
  slippery.friction = 0.25;
  EXPECT_NE(with(slippery)->model->mjcf().find("friction=\"0.25 "), std::string::npos);

  Disturbance bouncing;
  bouncing.damping_ratio = 0.125;
  EXPECT_NE(with(bouncing)->model->mjcf().find("0.125"), std::string::npos);
  Disturbance beside;
  beside.props.push_back({.name = "crate", .position = {3, 0, 0.2}});
  EXPECT_GE(with(beside)->model->body("crate").value, 0);

  const VectorXd x = plain->initialParameters();
  const auto hash = [&](const Disturbance& d) { return Runner(with(d)).run(x, 0.05).hash; };
  const std::uint64_t undisturbed = Runner(plain).run(x, 0.05).hash;
  EXPECT_EQ(hash({}), undisturbed);
  Disturbance noisy;
  noisy.encoder_noise = 1e-3;
  EXPECT_NE(hash(noisy), undisturbed);
  EXPECT_EQ(hash(noisy), hash(noisy));
  Disturbance other = noisy;
  other.seed = 2;
  EXPECT_NE(hash(other), hash(noisy));
  Disturbance drifting;  // only feedback reads the velocity
  drifting.velocity_noise = 0.01;
  EXPECT_NE(hash(drifting), undisturbed);
  EXPECT_EQ(Runner(Skill::fromText(kNod, "skills/bioloid-gp/nod.toml", drifting))
                .run(VectorXd::Constant(1, 0.3), 0.1)
                .hash,
            Runner(fromText(kNod)).run(VectorXd::Constant(1, 0.3), 0.1).hash);
}

TEST(Rollout, ADelayedCommandComesLate) {
  const auto raised = [](double delay) {
    Disturbance d;
    d.delay = delay;
    const auto skill = Skill::fromText(kNod, "skills/bioloid-gp/nod.toml", d);
    sim::Recording recording;
    Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1, &recording);
    std::vector<double> angle;
    const int q = skill->model->joint("l_shoulder").q;
    for (const sim::Frame& f : recording.frames) angle.push_back(f.state.q[q] - skill->start.q[q]);
    return angle;  // every 10 ms
  };
  const std::vector<double> prompt = raised(0);
  const std::vector<double> late = raised(0.05);
  EXPECT_GT(prompt[4], 0.1);
  EXPECT_LT(std::abs(late[5]), 0.02);
  EXPECT_GT(late[9], 0.1);
}

TEST(Rollout, TellsWhatTheJointsAreTold) {
  const auto skill = fromText(kNod);
  std::vector<double> times;
  const auto& joints = skill->model->joints();
  const auto shoulder = std::find_if(joints.begin(), joints.end(),
                                     [](const sim::Joint& j) { return j.name == "l_shoulder"; }) -
                        joints.begin();
  double told = 0;
  Runner(skill).run(VectorXd::Constant(1, 0.3), 0.1, nullptr,
                    [&](double time, int phase, const control::JointTarget& target) {
                      times.push_back(time);
                      if (phase == 0) told = target.q[shoulder];
                    });
  ASSERT_EQ(times.size(), 200U);
  EXPECT_DOUBLE_EQ(times[150], 0.15);
  EXPECT_DOUBLE_EQ(told, 0.6);
}

TEST(Rollout, AFailureEndsTheTrialAndNamesItsConstraint) {
  const auto skill = Skill::fromFile(kJump);
  Runner runner(skill);
  VectorXd x = skill->initialParameters();
  x[4] = 200;
  x[5] = 200;  // thrown on its back
  const Rollout r = runner.run(x, 0.05);
  EXPECT_TRUE(r.failed());
  EXPECT_TRUE(r.violated[0]);
  EXPECT_EQ(r.ended, "fall");
  EXPECT_LT(r.time, skill->horizon);
}

TEST(Rollout, ADivergedSimulationIsAFailedTrialNotAnException) {
  std::string text = replaced(kNod, "pose = { base = \"previous\" }",
                              "limited = false\npose = {}\nforce = [{ bodies = [\"l_hand\"], "
                              "force = [0, 0, \"1e12 * lean\"] }]");
  const auto skill = fromText(text);
  Runner runner(skill);
  VectorXd x(1);
  x << 1;
  const Rollout r = runner.run(x, 0.1);
  EXPECT_TRUE(r.diverged);
  EXPECT_TRUE(r.failed());
  EXPECT_EQ(r.cost, INFINITY);
  const SkillProblem problem(skill, 0.1);
  EXPECT_TRUE(problem.evaluate(x).failed);
  x << 0;
  EXPECT_FALSE(problem.evaluate(x).failed);
}

TEST(Rollout, WrongParametersAreRefused) {
  const auto skill = fromText(kNod);
  Runner runner(skill);
  EXPECT_THROW(runner.run(VectorXd::Zero(2), 0), InputError);
  EXPECT_THROW(runner.run(VectorXd::Constant(1, NAN), 0), InputError);
}

const VectorXd kLean = VectorXd::Constant(1, 0.3);

Eigen::Index indexOf(const Skill& skill, const std::string& joint) {
  const auto& joints = skill.model->joints();
  return std::find_if(joints.begin(), joints.end(), [&](auto& j) { return j.name == joint; }) -
         joints.begin();
}

/// What a joint is told at each step.
std::vector<double> told(const Skill& skill, const std::string& joint, double task = 0.1) {
  std::vector<double> targets;
  Runner(std::make_shared<const Skill>(skill))
      .run(kLean, task, nullptr, [&](double, int, const control::JointTarget& target) {
        targets.push_back(target.q[indexOf(skill, joint)]);
      });
  return targets;
}

TEST(Rollout, TargetsMoveEvenlyFromWhereTheLastPhaseLeftThem) {
  std::string text = replaced(kNod, "base = \"stand\"\n[parameters]",
                              "base = \"stand\"\nshoulder = 0.4\n[parameters]");
  text = replaced(text, "until = ", "blend = 0.2\nuntil = ");
  text =
      replaced(text, "pose = { base = \"previous\" }", "pose = { base = \"stand\" }\nblend = 0.05");
  const std::vector<double> targets = told(*fromText(text), "l_shoulder");
  ASSERT_EQ(targets.size(), 200U);
  const double left = 0.4 + 0.099 / 0.2 * (0.6 - 0.4);  // at the last step of the first phase
  for (int i = 0; i < 200; ++i) {
    const double t = 0.001 * i;
    const double expected =
        i < 100 ? 0.4 + t * (0.6 - 0.4) / 0.2 : left * (1 - std::min(1.0, (t - 0.1) / 0.05));
    EXPECT_NEAR(targets[i], expected, 1e-12) << i;
  }
}

TEST(Rollout, FeedbackAddsWhatItSensesWithItsSignInItsPhases) {
  for (const char* axis : {"x", "y", "z"}) {
    const std::string signal = "com_velocity." + std::string(axis);
    const std::string rows = fmt::format(R"([[feedback]]
joints = ["l_shoulder", "hip"]
add = "{0}"
during = ["hold"]
[measures]
seen = {{ of = "{0}", take = "integral", during = ["hold"] }}
)",
                                         signal);
    const std::string text = replaced(kNod, "[measures]\n", rows);
    const auto skill = fromText(text);
    const double seen = Runner(skill).run(kLean, 0.1).measures[0];
    EXPECT_NE(seen, 0);
    const struct {
      const char* joint;
      double base, sign;
    } joints[] = {{"l_shoulder", 0.6, 1}, {"l_hip", 0.05, 1}, {"r_hip", -0.05, -1}};
    for (const auto& [joint, base, sign] : joints) {
      double sum = 0;
      const std::vector<double> targets = told(*skill, joint);
      for (int i = 0; i < 100; ++i) EXPECT_EQ(targets[i], base);
      for (int i = 100; i < 200; ++i) sum += 0.001 * (targets[i] - base);
      EXPECT_NEAR(sum, sign * seen, 1e-14) << joint << axis;
    }
  }
}

/// What a seed gave once it gives for ever; tasks differ, and nobody draws for what is not there.
TEST(Rollout, NoiseOfASeedStaysWhatItIs) {
  Disturbance d;
  d.seed = 5;
  d.encoder_noise = 1e-3;
  const auto with = [](const std::string& text, const Disturbance& how) {
    return Skill::fromText(text, "skills/bioloid-gp/nod.toml", how);
  };
  const auto blurred = with(kNod, d);
  const auto nod = fromText(kNod);
  std::vector<VectorXd> exact;
  Runner(nod).run(kLean, 0.1, nullptr, [&](double, int, const control::JointTarget& target) {
    exact.push_back(target.q);
  });
  for (const double task : {0.1, 0.7}) {
    Random noise(5, std::bit_cast<std::uint64_t>(task));
    size_t step = 0;
    Runner(blurred).run(kLean, task, nullptr, [&](double, int, const control::JointTarget& target) {
      for (Eigen::Index j = 0; j < target.q.size(); ++j) {
        EXPECT_EQ(target.q[j], exact[step][j] - 1e-3 * noise.normal());
      }
      ++step;
    });
    EXPECT_EQ(step, 200U);
  }
  // The trial that is scored for many tasks has the noise of the first.
  const SkillProblem family(blurred, VectorXd(VectorXd::LinSpaced(3, 0, 1)));
  EXPECT_EQ(family.evaluate(kLean).task_costs[0], SkillProblem(blurred, 0).evaluate(kLean).cost);

  d.velocity_noise = 0.01;  // which nothing reads
  const std::uint64_t hash = Runner(blurred).run(kLean, 0.1).hash;
  EXPECT_EQ(Runner(with(kNod, d)).run(kLean, 0.1).hash, hash);
  d.velocity_noise = 0;
  const std::string idle =
      replaced(kNod, "[measures]",
               "[[feedback]]\njoints = [\"hip\"]\nadd = \"0 * com_velocity.x\"\n[measures]");
  EXPECT_EQ(Runner(with(idle, d)).run(kLean, 0.1).hash, hash);

  d.encoder_noise = 0;
  d.velocity_noise = 0.01;
  std::string text = replaced(kNod, "horizon = 0.2", "horizon = 0.002");
  std::string rows;
  const std::vector<std::string> joints = {"l_shoulder", "r_shoulder", "l_arm"};
  for (int i = 0; i < 3; ++i) {
    rows +=
        "[[feedback]]\njoints = [\"" + joints[i] + "\"]\nadd = \"com_velocity." + "xyz"[i] + "\"\n";
  }
  rows += "[measures]\n";
  for (const char axis : std::string("xyz")) {
    rows += std::string("v") + axis + " = { of = \"com_velocity." + axis +
            "\", take = \"integral\" }\n";
  }
  const auto sensing = with(replaced(text, "[measures]\n", rows), d);
  Random noise(5, std::bit_cast<std::uint64_t>(0.1));
  const std::vector<double> moved = Runner(sensing).run(kLean, 0.1).measures;  // in the second step
  for (int step = 0; step < 2; ++step) {
    for (int i = 0; i < 3; ++i) {
      const double base = i < 2 ? 0.6 : 0;
      const double velocity = step == 0 ? 0 : moved[i] / 0.001;
      EXPECT_NEAR(told(*sensing, joints[i])[step], base + velocity + 0.01 * noise.normal(), 1e-12);
    }
  }
}

TEST(Rollout, ADelayOfStepsIsThatManySteps) {
  const std::string text = "time_step = 0.01" + std::string(kNod) + "[scene]\ncompliance = 0.02\n";
  const auto torques = [&](double delay, double lean) {
    Disturbance d;
    d.delay = delay;
    Runner runner(Skill::fromText(text, "skills/bioloid-gp/nod.toml", d));
    sim::Recording recording;  // a frame a step
    std::vector<VectorXd> all;
    for (int again = 0; again < 2; ++again) {
      runner.run(VectorXd::Constant(1, lean), 0.1, &recording);
      EXPECT_EQ(recording.frames.size(), 21U);
      std::vector<VectorXd> now;
      for (const sim::Frame& f : recording.frames) now.push_back(f.torque);
      if (again > 0) {
        EXPECT_EQ(now, all);
      }
      all = now;
    }
    return all;
  };
  const auto prompt = torques(0, 0.3);
  EXPECT_TRUE(prompt[0].isZero(0));
  for (const int steps : {1, 3}) {
    const auto late = torques(0.01 * steps, 0.3);
    const auto other = torques(0.01 * steps, -0.2);
    // Until the first answer, the torque that holds the start, whatever is asked for.
    for (int i = 0; i <= steps; ++i) {
      EXPECT_EQ(late[i], late[0]);
      EXPECT_EQ(late[i], other[i]);
    }
    EXPECT_FALSE(late[0].isZero(0));
    EXPECT_EQ(late[steps + 1], prompt[1]);
  }
}

TEST(Rollout, ItsFingerprintIsOfItsFramesAndItsEnd) {
  const auto hash_of = [](const sim::Recording& recording) {
    Hash hash;
    for (const sim::Frame& f : recording.frames) {
      hash.add({f.state.q.data(), static_cast<size_t>(f.state.q.size())});
      hash.add({f.state.v.data(), static_cast<size_t>(f.state.v.size())});
    }
    return hash.value();
  };
  sim::Recording recording;
  const Rollout whole = Runner(fromText(kNod)).run(kLean, 0.1, &recording);
  EXPECT_EQ(whole.hash, hash_of(recording));
  EXPECT_EQ(recording.phases, std::vector<std::string>({"bend", "hold"}));
  EXPECT_FALSE(recording.mjcf.empty());

  const std::string stopping =
      replaced(kNod, "horizon = 0.2", "horizon = 0.2\nstop = \"time > 0.1045\"");
  const Rollout stopped = Runner(fromText(stopping)).run(kLean, 0.1, &recording);
  EXPECT_EQ(stopped.ended, "stop");
  EXPECT_FALSE(stopped.failed());
  EXPECT_NEAR(stopped.time, 0.105, 1e-12);
  EXPECT_EQ(recording.frames.size(), 11U);
  EXPECT_EQ(recording.phases.size(), 2U);
  EXPECT_NE(stopped.hash, hash_of(recording));  // the end lies between frames
  // A failure at the same time is what counts.
  const Rollout failed =
      Runner(fromText(replaced(stopping, "com.z < 0.1", "time > 0.1045"))).run(kLean, 0.1);
  EXPECT_EQ(failed.ended, "fall");
  EXPECT_EQ(failed.terms[1], 10);
  EXPECT_EQ(failed.cost, failed.terms[0] + failed.terms[1]);
  EXPECT_EQ(failed.hash, stopped.hash);

  // Steps longer than a frame's interval have a frame each.
  const std::string coarse =
      "time_step = 0.02" + std::string(kNod) + "[scene]\ncompliance = 0.04\n";
  Runner(fromText(coarse)).run(kLean, 0.1, &recording);
  EXPECT_EQ(recording.frames.size(), 11U);
}

TEST(Rollout, FailuresCountInTheirPhasesAndTheFirstIsNamed) {
  const std::string two = replaced(
      kNod, "[[failure]]\n",
      "[[failure]]\nname = \"never\"\nwhen = \"time > 9\"\n[[failure]]\nname = \"second\"\n"
      "when = \"time >= 0\"\nduring = [\"hold\"]\n[[failure]]\nname = \"third\"\n"
      "when = \"time > 0.05\"\nduring = [\"hold\"]\n[[failure]]\n");
  const Rollout r = Runner(fromText(two)).run(kLean, 0.1);
  EXPECT_EQ(r.ended, "second");
  EXPECT_NEAR(r.time, 0.1, 1e-12);
  EXPECT_EQ(r.violated, std::vector<bool>({false, true, true, false}));
}

TEST(Rollout, ARunnerKeepsNothingOfARun) {
  std::string rows = "[measures]\n";
  for (const char* take : {"first", "last", "min", "max", "mean", "integral"}) {
    rows +=
        std::string(take) + "_of = { of = \"joint.l_shoulder - 0.1\", take = \"" + take + "\" }\n";
  }
  std::string text = replaced(kNod, "[measures]\n", rows);
  text = replaced(text, "com.z < 0.1", "joint.l_shoulder > 0.5");
  const auto skill = fromText(text);
  Runner used(skill);
  sim::Recording recording, fresh;
  const Rollout failed = used.run(VectorXd::Constant(1, 0.9), 0.2, &recording);
  EXPECT_TRUE(failed.violated[0]);
  const Rollout again = used.run(VectorXd::Constant(1, -0.1), 0.1, &recording);
  const Rollout first = Runner(skill).run(VectorXd::Constant(1, -0.1), 0.1, &fresh);
  EXPECT_FALSE(again.failed());
  EXPECT_EQ(again.hash, first.hash);
  EXPECT_EQ(again.cost, first.cost);
  EXPECT_EQ(again.measures, first.measures);
  EXPECT_EQ(recording.phases, fresh.phases);
  ASSERT_EQ(recording.frames.size(), fresh.frames.size());
  for (size_t i = 0; i < fresh.frames.size(); ++i) {
    EXPECT_EQ(recording.frames[i].torque, fresh.frames[i].torque) << i;
  }
}

/// The feet touch nothing at the start: what has no value then is measured from when it has.
TEST(Rollout, MeasuresPassOverWhatHasNoValue) {
  std::string rows = "[measures]\nat_once = { of = \"0 * cop.x + time\", take = \"first\" }\n";
  for (const char* take : {"first", "last", "min", "max", "mean", "integral"}) {
    rows += std::string(take) + "_of = { of = \"cop.x\", take = \"" + take + "\" }\n";
  }
  const auto measures =
      Runner(fromText(replaced(kNod, "[measures]\n", rows))).run(kLean, 0.1).measures;
  EXPECT_GT(measures[0], 0);
  for (const double m : measures) EXPECT_TRUE(std::isfinite(m));
  EXPECT_LE(measures[3], measures[5]);
  EXPECT_LE(measures[5], measures[4]);
}

TEST(Rollout, AForceIsWithinTheMotorsLimitsUnlessTheyDoNotCount) {
  const auto most = [](const std::string& limited, double lean) {
    const auto skill = fromText(
        replaced(kNod, "name = \"bend\"\npose",
                 "name = \"bend\"\n" + limited +
                     "force = [{ bodies = [\"l_hand\"], force = [0, 0, \"50 * lean\"] }]\npose"));
    sim::Recording recording;
    Runner(skill).run(VectorXd::Constant(1, lean), 0.1, &recording);
    return recording.frames[1].torque.cwiseAbs().maxCoeff();
  };
  EXPECT_LE(most("", 1), 0.6 + 1e-9);
  EXPECT_GT(most("limited = false\n", 1), 1);
}

TEST(SkillProblem, RefusesTasksThatAreAllOneAndScoresNoneOfATrialThatDiverged) {
  const VectorXd tasks = VectorXd::LinSpaced(3, 0, 1);
  const std::string same = replaced(kNod, "(bent - task)^2", "bent^2");
  EXPECT_THROW(SkillProblem(fromText(same), tasks), InputError);
  EXPECT_THROW(
      SkillProblem(fromText(replaced(same, "achieved = \"bent\"", "achieved = \"bent - task\"")),
                   tasks),
      InputError);
  const std::string wild = replaced(kNod, "pose = { base = \"previous\" }",
                                    "limited = false\npose = {}\nforce = [{ bodies = [\"l_hand\"], "
                                    "force = [0, 0, \"1e12 * lean\"] }]");
  const SkillProblem problem(fromText(wild), tasks);
  const optim::Evaluation e = problem.evaluate(VectorXd::Ones(1));
  EXPECT_TRUE(e.failed);
  EXPECT_TRUE(e.task_costs.empty());
  EXPECT_EQ(problem.constraints(), std::vector<std::string>({"fall"}));
  EXPECT_EQ(problem.evaluate(VectorXd::Zero(1)).task_costs.size(), 3U);
}

TEST(Rollout, AFinerSimulationLeavesTheControllerItsTime) {
  const std::string text = R"(
name = "wave"
robot = "bioloid-gp"
horizon = 0.2
[parameters]
lift = { range = [0, 1], initial = 0.5 }
[start.pose]
base = "stand"
[[phase]]
name = "hold"
pose = { base = "stand", shoulder = "lift" }
[measures]
all = { of = 1, take = "integral" }
looked = { of = "time", take = "max" }
[[objective]]
name = "none"
cost = 0
)";
  Disturbance finer;
  finer.time_step = 0.0002;
  const auto skill = Skill::fromText(text, "skills/bioloid-gp/test.toml", finer);
  EXPECT_EQ(skill->model->timeStep(), 0.0002);
  EXPECT_EQ(skill->decision_interval, 0.001);
  Runner runner(skill);
  int decided = 0;
  const Runner::OnTarget count = [&](double, int, const control::JointTarget&) { ++decided; };
  const Rollout r = runner.run(skill->initialParameters(), 0, nullptr, count);
  EXPECT_EQ(decided, 200);
  EXPECT_NEAR(r.measures[0], 0.2, 1e-9);  // a millisecond each time that it looks
  EXPECT_NEAR(r.measures[1], 0.2, 1e-9);
}

}  // namespace
}  // namespace traceur::skill
