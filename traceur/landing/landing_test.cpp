#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/core/toml.h"
#include "traceur/landing/condition.h"
#include "traceur/landing/falls.h"
#include "traceur/landing/stress.h"

namespace traceur::landing {
namespace {

/// The person, limp, dropped on its feet; or held in a pose.
std::shared_ptr<const skill::Skill> dropped(const char* stiffness, double height, double pitch) {
  return skill::Skill::fromText(fmt::format(R"(
name = "dropped"
robot = "human"
horizon = 15
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
  return fallAll({skill, skill->initialParameters()}, one, {.threads = 1}).front();
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

TEST(Judge, DoesNotCountTurnsInTheAirAsRolls) {
  // Limp, with a spin that turns it over once before it comes down.
  const auto skill = dropped("0", 6, 0);
  VectorXd spinning = skill->initialConditions();
  spinning[2] = 7;
  const Fall f =
      fallAll({skill, skill->initialParameters()}, std::vector{spinning}, {.threads = 1}).front();
  ASSERT_TRUE(f.verdict.touch_down);
  EXPECT_GE(f.verdict.touch_down_somersault, -1.5);
  EXPECT_LT(f.verdict.touch_down_somersault, 2 * M_PI - 1.5);
  EXPECT_FALSE(f.verdict.stands());
}

TEST(Judge, TakesNoShotForTheGround) {
  skill::Disturbance how;
  how.props.push_back({.name = "ball",
                       .shape = sim::Prop::Shape::kBall,
                       .size = {0.1, 0, 0},
                       .position = {-50, 0, 0.1},
                       .mass = 5});
  const auto plain = dropped("0", 4, 0);
  const auto skill = skill::Skill::fromText(plain->text, plain->file, how);
  const motion::Shot shot{.body = skill->model->body("ball"), .start = 0.1, .velocity = {0, 10, 0}};
  const std::vector<VectorXd> one = {skill->initialConditions()};
  const auto fall = [&](const skill::Meddling& happens) {
    return fallAll({skill, skill->initialParameters(), happens}, one, {.threads = 1}).front();
  };
  const Fall unhurt = fall({});
  const Fall hit = fall({.shots = {shot}});
  EXPECT_NE(hit.rollout.hash, unhurt.rollout.hash);
  EXPECT_NEAR(hit.verdict.touch_down.value(), unhurt.verdict.touch_down.value(), 0.1);
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
  const auto a = fallAll({skill, skill->initialParameters()}, all, {.threads = 1});
  const auto b = fallAll({skill, skill->initialParameters()}, all, {.threads = 2});
  for (size_t k = 0; k < all.size(); ++k) EXPECT_EQ(a[k].rollout.hash, b[k].rollout.hash);
  EXPECT_THROW(findFallSet("esy"), InputError);
  EXPECT_THROW(drawFalls(*skill, findFallSet("m2"), 1, 1), InputError);  // it knows no yaw
}

TEST(Falls, EndWhereTheyAreAskedTo) {
  const auto skill = dropped("0", 2.4, 0.1);
  std::stop_source stop;
  int done = 0;
  const auto falls =
      fallAll({skill, skill->initialParameters()}, drawFalls(*skill, findFallSet("easy"), 5, 1),
              {.threads = 1, .stop = stop.get_token(), .on_done = [&] {
                 if (++done == 2) stop.request_stop();
               }});
  EXPECT_EQ(done, 2);
  EXPECT_TRUE(falls[1].verdict.touch_down);
  EXPECT_FALSE(falls[2].verdict.touch_down);
}

TEST(Falls, AgainBeginWhereTheyBegan) {
  const auto skill = dropped("1", 2.4, 0.1);
  const auto conditions = drawFalls(*skill, findFallSet("easy"), 2, 5);
  const auto held = fallAll({skill, skill->initialParameters()}, conditions, {.threads = 1});
  const auto other = dropped("0", 1.5, 1);  // which alone would begin lower and flatter
  const auto limp = fallAgain({other, other->initialParameters()}, held, {.threads = 2});
  ASSERT_EQ(limp.size(), 2U);
  for (size_t k = 0; k < limp.size(); ++k) {
    EXPECT_EQ(limp[k].start.q, held[k].start.q);
    EXPECT_EQ(limp[k].start.v, held[k].start.v);
    EXPECT_NEAR(limp[k].verdict.touch_down.value(), held[k].verdict.touch_down.value(), 0.05);
    EXPECT_NE(limp[k].rollout.hash, held[k].rollout.hash);
  }
  EXPECT_NE(held[0].start.q, held[1].start.q);
}

TEST(Landing, OfThePersonRollsAndStands) {
  const auto skill = skill::Skill::fromFile(skill::findSkill("human", "land"));
  const FallSet set{"near the default", "", {{"height", 2.6, 2.8}, {"forward", 2.4, 2.6}}};
  const auto falls = fallAll({skill, skill->initialParameters()}, drawFalls(*skill, set, 4, 1), {});
  for (const Fall& f : falls) {
    EXPECT_TRUE(f.verdict.rolled) << f.rollout.ended;
    EXPECT_TRUE(f.verdict.stands()) << f.rollout.ended;
    EXPECT_TRUE(f.verdict.stands_later) << f.rollout.ended;
    EXPECT_LT(*f.verdict.rolled, *f.verdict.stood);
  }
}

TEST(Landing, HandsFirstRollsAndMostlyStands) {
  const auto skill = skill::Skill::fromFile(skill::findSkill("human", "land"));
  const auto falls = fallAll({skill, skill->initialParameters()},
                             drawFalls(*skill, findFallSet("hands"), 8, 1), {});
  int rolled = 0;
  int stand = 0;
  for (const Fall& f : falls) {
    EXPECT_GT(std::abs(f.verdict.touch_down_somersault), 1) << "not hands first";
    rolled += f.verdict.rolled.has_value();
    stand += f.verdict.stands();
  }
  EXPECT_GE(rolled, 7);  // of 100 falls of another seed, 98
  EXPECT_GE(stand, 5);   // 85
}

TEST(Landing, PutsItsFeetOnANarrowWallAndRollsOffIt) {
  static constexpr double kHeight = 1.4;
  static constexpr double kHalf = 0.2;
  int rolled = 0;
  for (const double ahead : {-0.2, 0.0, 0.2}) {
    const double aim = 1.3 + ahead;  // 2.5 m/s for 0.52 s, less or more far
    skill::Disturbance how;
    how.props.push_back({.name = "box",
                         .size = {kHalf, 1, kHeight / 2},
                         .position = {aim, 0, kHeight / 2},
                         .material = {.friction = 1, .compliance = 0.006}});
    const std::filesystem::path file = skill::findSkill("human", "land");
    const auto skill = skill::Skill::fromText(readFile(file), file, how);
    sim::Recording recording;
    Faller faller({skill, skill->initialParameters()});
    const Fall f = faller.fall(
        skill->conditionsWith({{"height", 3.6}, {"forward", 2.5}, {"roof", kHeight}, {"aim", aim}}),
        {}, &recording);
    rolled += f.verdict.rolled.has_value();
    ASSERT_TRUE(f.verdict.touch_down);
    // Both feet, on its top, and nothing else before it leaps off.
    std::set<std::string> on_it;
    double where = 0;
    int touched = 0;
    for (const sim::Frame& frame : recording.frames) {
      if (frame.state.time > *f.verdict.touch_down + 0.1) break;
      for (const sim::Contact& c : frame.contacts) {
        for (const sim::BodyId body : {c.body_a, c.body_b}) {
          const std::string name = skill->model->bodyName(body);
          if (name != "box" && name != "world") on_it.insert(name);
        }
        where += c.p_WC.x();
        ++touched;
        EXPECT_NEAR(c.p_WC.z(), kHeight, 0.05) << ahead;
        EXPECT_NEAR(c.p_WC.x(), aim, kHalf + 0.01) << ahead;
      }
    }
    EXPECT_EQ(on_it, (std::set<std::string>{"l_foot", "r_foot"})) << ahead;
    ASSERT_GT(touched, 0);
    EXPECT_NEAR(where / touched, aim, 0.12) << ahead;  // not aimed, up to 0.2 m from it
  }
  EXPECT_GE(rolled, 2);
}

TEST(Landing, OfTheOddBodyTurnsOverAndStands) {
  const auto skill = skill::Skill::fromFile(skill::findSkill("odd", "land"));
  const auto measured = [&](const Fall& f, std::string_view name) {
    for (size_t i = 0; i < skill->measures.size(); ++i) {
      if (skill->measures[i].name == name) return f.rollout.measures[i];
    }
    return std::nan("");
  };
  int stands = 0;
  for (const double height : {2.5, 2.7, 2.9}) {
    const Fall f = Faller({skill, skill->initialParameters()})
                       .fall(skill->conditionsWith({{"height", height}, {"practice", 1}}));
    EXPECT_GT(measured(f, "turned"), 5) << height;
    EXPECT_LT(f.verdict.head_force, Verdict::kHeadForce) << height;
    stands += measured(f, "stood") > 0.6;
  }
  EXPECT_GE(stands, 2);
}

TEST(Landing, RunsOnIfToldTo) {
  const auto skill = skill::Skill::fromFile(skill::findSkill("human", "land"));
  const auto ran = std::find_if(skill->measures.begin(), skill->measures.end(),
                                [](const skill::Measure& m) { return m.name == "ran"; });
  ASSERT_NE(ran, skill->measures.end());
  int far = 0;
  for (const double height : {2.4, 2.7, 3.0}) {
    const VectorXd x =
        skill->conditionsWith({{"height", height}, {"forward", 3}, {"run", 1}, {"practice", 1}});
    const Fall f = Faller({skill, skill->initialParameters()}).fall(x);
    EXPECT_TRUE(f.verdict.rolled);
    far += f.rollout.measures[static_cast<size_t>(ran - skill->measures.begin())] > 2;
  }
  EXPECT_GE(far, 2);  // metres, upright
}

TEST(LandingCondition, FindsThePlanesThatItWasDrawnFrom) {
  const Plane middle{-0.02, -0.1, 0.05, 0.4};
  std::vector<Fall> falls;
  for (std::uint64_t k = 0; k < 4000; ++k) {
    Random random(3, k);
    Fall f;
    Verdict& v = f.verdict;
    v.touch_down = 0.5;
    v.touch_down_speed = random.uniform(4, 9);
    v.touch_down_forward = random.uniform(0, 5);
    v.touch_down_spin = random.uniform(-1, 3);
    const double off = random.uniform(-1, 1);
    v.touch_down_somersault =
        middle.at(-v.touch_down_speed, v.touch_down_forward, v.touch_down_spin) + off;
    const double width = 0.2 + 0.05 * v.touch_down_forward;  // more room the faster it goes
    if (std::abs(off) < width) v.rolled = v.stood = 1;
    falls.push_back(f);
  }
  const LandingCondition learned = learnCondition(falls);
  // A tenth of the successes are outside on each side, where they are as many everywhere.
  const auto expect = [&](const Plane& plane, double sign) {
    EXPECT_NEAR(plane.up, middle.up, 0.02);
    EXPECT_NEAR(plane.forward, middle.forward + sign * 0.8 * 0.05, 0.01);
    EXPECT_NEAR(plane.spin, middle.spin, 0.02);
    EXPECT_NEAR(plane.at(-6, 2, 1), middle.at(-6, 2, 1) + sign * 0.8 * 0.3, 0.02);
  };
  expect(learned.least, -1);
  expect(learned.most, 1);
  EXPECT_NEAR(learned.wanted().forward, middle.forward, 0.005);
  EXPECT_THROW(learnCondition(std::span(falls).first(20)), InputError);
}

TEST(Stress, KnowsAPersonsJoints) {
  const auto joints = stressedJoints(*dropped("0", 2.4, 0)->model);
  std::vector<std::string> names, ends;
  for (const StressedJoint& j : joints) {
    names.push_back(j.name);
    if (j.meets_first) ends.push_back(j.name);
    if (j.name == "hip") {
      EXPECT_EQ(j.moves.size(), 2U);
      EXPECT_NEAR(j.carries, 8.72 + 2.84 + 0.76, 0.02);  // thigh, shank, foot of de Leva's table
    }
    EXPECT_EQ(j.moves.size(), j.name == "neck" || j.name.ends_with("spine") ? 1U : 2U) << j.name;
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"lower_spine", "upper_spine", "neck", "clavicle", "shoulder",
                                      "elbow", "wrist", "hip", "knee", "ankle"}));
  EXPECT_EQ(ends, (std::vector<std::string>{"wrist", "ankle"}));
  EXPECT_EQ(withoutEnds(joints).size(), 8U);
}

TEST(Stress, IsComparedJointByJoint) {
  const std::vector<StressedJoint> joints = {{"one", {{1}, {2}}, 1, false},
                                             {"two", {{3}}, 1, false}};
  const VectorXd limp = (VectorXd(4) << 99, 2, 8, 6).finished();
  const VectorXd ours = (VectorXd(4) << 1, 4, 1, 3).finished();
  const StressRatio r = compared(joints, limp, ours);  // 8 / 4 and 6 / 3 of the worse side
  EXPECT_DOUBLE_EQ(r.mean, 2);
  EXPECT_DOUBLE_EQ(r.sums, 2);
  const VectorXd soft = (VectorXd(4) << 1, 1, 1, 3).finished();
  const StressRatio better = compared(joints, limp, soft);
  EXPECT_DOUBLE_EQ(better.mean, 5);
  EXPECT_DOUBLE_EQ(better.geometric, 4);
  EXPECT_DOUBLE_EQ(better.sums, 14.0 / 4);
  EXPECT_DOUBLE_EQ(better.worst, 2);
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
