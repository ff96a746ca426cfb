// The chapter's parts together, on the two robots: graphs, reach, plans, poses, falls.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/fall/embedded/fall_plan.h"
#include "traceur/fall/expansion.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/fall/plan_library.h"
#include "traceur/fall/value_table.h"

namespace traceur::fall {
namespace {

std::shared_ptr<const FallRobot> fallsOf(const std::string& robot) {
  return std::make_shared<const FallRobot>(FallRobot::fromFile("models/" + robot + "/falls.toml"));
}

std::shared_ptr<const sim::Model> modelOf(const FallRobot& falls) {
  return sim::Model::fromScene({.robot = falls.robot});
}

FallExperimentOptions withPoses(int poses) {
  FallExperimentOptions options;
  options.problem.poses = poses;
  return options;
}

/// A coarse problem, quick to plan even without pruning.
FallProblem coarse(const FallRobot& falls, const std::string& stance,
                   const std::string& direction) {
  const SagittalBody body(modelOf(falls), falls.setup(stance, direction));
  FallProblem p = fallProblem(body, falls, {.poses = 2000});
  p.grid.time *= 3;
  p.grid.angle *= 2;
  p.grid.rod_rates = 1;
  return p;
}

FallState randomStart(double r, int i) {
  Random random(1, 2, i);
  return {0, 0, {.theta = random.uniform(-0.1, 0.2), .r = r, .theta_rate = random.uniform(0.4, 2)}};
}

/// Atlas with this text as its falls.toml.
FallRobot fallsFromText(const std::string& toml) {
  const TestFolder folder;
  const auto file = folder / "falls.toml";
  std::ofstream(file) << "robot = \""
                      << std::filesystem::absolute("models/atlas/robot.toml").string() << "\"\n"
                      << toml;
  return FallRobot::fromFile(file);
}

std::string complaint(const std::string& toml) {
  try {
    fallsFromText(toml);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

constexpr const char* kHead =
    "push_body = \"utorso\"\nhead = \"head\"\ntuck = \"tuck\"\njoints = [\"leg_kny\"]\n"
    "rod_speed = 0.3\nstopper_speed = 3\n"
    "[[fall]]\nstance = \"two_feet\"\ndirection = \"forward\"\n[fall.graph]\n";
constexpr const char* kGraph =
    "feet = { points = [\"left_toe\"], next = [\"hands\"] }\n"
    "hands = { points = [\"left_hand\"] }\n";

/// What is said of a file with these lines before a part of it.
std::string complaintWith(const std::string& lines, const char* before) {
  std::string text = std::string(kHead) + kGraph;
  return complaint(text.insert(text.find(before), lines + "\n"));
}

TEST(FallRobot, NamesWhatAGraphGetsWrong) {
  EXPECT_NE(
      complaint(std::string(kHead) + "feet = { points = [\"left_toe\"], next = [\"hands\"] }\n"
                                     "hands = { points = [\"left_hnd\"] }\n")
          .find("no contact point \"left_hnd\" in atlas's file. Did you mean \"left_hand\"?"),
      std::string::npos);
  EXPECT_NE(
      complaint(std::string(kHead) + "feet = { points = [\"left_toe\"], next = [\"hands\"] }\n"
                                     "hands = { points = [\"left_hand\"], next = [\"knees\"] }\n"
                                     "knees = { points = [\"left_knee\"], next = [\"hands\"] }\n")
          .find("a fall along hands -> knees -> hands need not end"),
      std::string::npos);
  EXPECT_NE(complaint(std::string(kHead) + "feet = { points = [\"left_toe\"], next = [\"hand\"] }\n"
                                           "hands = { points = [\"left_hand\"] }\n")
                .find("no node \"hand\" in this graph. Did you mean \"hands\"?"),
            std::string::npos);
  EXPECT_EQ(
      complaint(std::string(kHead) + "feet = { points = [\"left_toe\"], next = [\"hands\"] }\n"
                                     "hands = { points = [\"left_hand\"] }\n"),
      "");
}

TEST(FallRobot, NamesWhatARangeGetsWrong) {
  const auto with = [](const std::string& range) {
    return complaintWith("[ranges]\n" + range, "[[fall]]");
  };
  EXPECT_NE(with("leg_kn = [0, 1]").find("not one of \"joints\". Did you mean \"leg_kny\"?"),
            std::string::npos);
  EXPECT_NE(with("leg_kny = [1, 0]").find("expected [min, max]"), std::string::npos);
  EXPECT_EQ(with("leg_kny = [0.2, 2]"), "");
}

TEST(FallRobot, EveryKeyIsReadIntoItsPlace) {
  const FallRobot f = fallsFromText(R"(
push_body = "pelvis"
head = "head"
tuck = "tuck"
joints = ["leg_kny", "arm_elx"]
rod_speed = 0.31
stopper_speed = 3.1
stiffness = 0.9
least_interval = 0.02
damping = 1.1
rest_stiffness = 0.7
rest_damping = 0.6
support = 0.5
ramp = 0.4
rest_height = 0.3
[ranges]
leg_kny = [0.2, 2]
arm_elx = [0.5, 1]
[[fall]]
stance = "two_feet"
direction = "backward"
rod_speed = 0.6
stands = false
without.hands = { stopper_speed = 7 }
[fall.graph]
feet = { points = ["left_heel", "right_heel"], next = ["hands", "hips"] }
hips = { points = ["hips"] }
hands = { points = ["left_hand"], next = ["hips"] }
[[fall]]
stance = "one_foot"
direction = "forward"
stiffness = 0.8
[fall.graph]
foot = { points = ["right_toe"], next = ["head"] }
head = { points = ["head"] }
)");
  EXPECT_EQ(f.robot->name, "atlas");
  EXPECT_EQ(f.push_body + f.head + f.tuck, "pelvisheadtuck");
  EXPECT_EQ(f.joints, std::vector<std::string>({"leg_kny", "arm_elx"}));
  EXPECT_EQ(f.least_interval, 0.02);
  const FallTracking& t = f.tracking;
  EXPECT_EQ((std::vector<double>{t.damping, t.rest_stiffness.value_or(0), t.rest_damping, t.support,
                                 t.ramp, t.rest_height}),
            (std::vector<double>{1.1, 0.7, 0.6, 0.5, 0.4, 0.3}));
  using Range = std::pair<double, double>;
  EXPECT_EQ(f.ranges.at("l_leg_kny"), Range(0.2, 2));
  EXPECT_EQ(f.ranges.at("r_leg_kny"), Range(0.2, 2));
  EXPECT_EQ(f.ranges.at("l_arm_elx"), Range(0.5, 1));
  EXPECT_EQ(f.ranges.at("r_arm_elx"), Range(-1, -0.5));  // mirrored
  ASSERT_EQ(f.setups.size(), 2U);
  const FallSetup& back = f.setup("two_feet", "backward");
  EXPECT_EQ(&back, &f.setups[0]);
  EXPECT_FALSE(back.stands);
  EXPECT_EQ(back.sign(), -1);
  const auto quick = [](const FallSetup& s) {
    return std::vector<double>{s.quick.rod_speed, s.quick.stopper_speed, s.quick.stiffness};
  };
  EXPECT_EQ(quick(back), (std::vector<double>{0.6, 3.1, 0.9}));
  EXPECT_EQ(quick(back.without("hands")), (std::vector<double>{0.6, 7, 0.9}));
  EXPECT_EQ(back.graph.edges, (std::vector<std::vector<int>>{{2, 1}, {}, {1}}));
  EXPECT_EQ(back.graph.nodes[0].points, std::vector<std::string>({"left_heel", "right_heel"}));
  const FallSetup& forward = f.setup("one_foot", "forward");
  EXPECT_TRUE(forward.stands);
  EXPECT_EQ(forward.sign(), 1);
  EXPECT_EQ(quick(forward), (std::vector<double>{0.31, 3.1, 0.8}));
  EXPECT_THROW(f.setup("one_foot", "backward"), InputError);

  const FallTracking usual = fallsFromText(std::string(kHead) + kGraph).tracking;
  const FallTracking said;
  EXPECT_FALSE(usual.rest_stiffness);
  EXPECT_EQ(usual.rest_damping, usual.damping);
  EXPECT_EQ((std::vector<double>{usual.damping, usual.support, usual.ramp, usual.rest_height}),
            (std::vector<double>{said.damping, said.support, said.ramp, said.rest_height}));
}

TEST(FallRobot, NumbersEndWhereTheySay) {
  for (const char* factor : {"damping", "rest_stiffness", "rest_damping", "support", "ramp",
                             "rest_height", "least_interval", "stiffness"}) {
    const std::string key = factor;
    EXPECT_EQ(complaintWith(key + " = 0", "[[fall]]"), "") << key;
    EXPECT_NE(complaintWith(key + " = -0.01", "[[fall]]").find(key), std::string::npos) << key;
  }
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = std::string(kHead) + kGraph;
    return complaint(text.replace(text.find(from), from.size(), to));
  };
  EXPECT_EQ(with("rod_speed = 0.3", "rod_speed = 0"), "");
  EXPECT_NE(with("rod_speed = 0.3", "rod_speed = -0.1"), "");
  EXPECT_NE(with("rod_speed = 0.3\n", "").find("rod_speed"), std::string::npos);
  EXPECT_NE(with("stopper_speed = 3\n", "").find("stopper_speed"), std::string::npos);
  EXPECT_NE(with("\"forward\"", "\"sideways\"").find("forward or backward"), std::string::npos);
  EXPECT_NE(with("\"head\"", "\"haed\"").find("Did you mean \"head\"?"), std::string::npos);
  EXPECT_NE(with("\"tuck\"", "\"tukc\"").find("Did you mean \"tuck\"?"), std::string::npos);
  EXPECT_NE(with("\"two_feet\"", "\"two_fete\"").find("two_feet"), std::string::npos);
  EXPECT_NE(complaintWith("[ranges]\nleg_kny = [1, 1]", "[[fall]]"), "");
}

TEST(FallRobot, RangesHoldForBothSidesOfAPairAndWithinTheRobotsLimits) {
  FallRobot falls = *fallsOf("atlas");
  falls.ranges = {{"l_arm_elx", {0.6, 9}}, {"l_leg_kny", {0.2, 1}}};
  const SagittalBody body(modelOf(falls), falls.setup("one_foot", "forward"));
  int seen = 0;
  for (const MovedJoint& j : movedJoints(body, falls)) {
    if (j.name == "l_arm_elx") {
      EXPECT_EQ(j.min, 0.6);
      EXPECT_EQ(j.max, body.model()->joint(j.name).limit.max);
      EXPECT_EQ(j.other, "r_arm_elx");
      EXPECT_EQ(j.sign, -1);
      ++seen;
    } else if (j.name == "l_leg_kny") {  // a foot is on one side only
      EXPECT_EQ(j.other, "");
      EXPECT_EQ(j.min, 0.2);
      EXPECT_EQ(j.max, 1);
      ++seen;
    } else if (j.name == "r_leg_kny") {
      EXPECT_EQ(j.min, body.model()->joint(j.name).limit.min);
    }
  }
  EXPECT_EQ(seen, 2);
  falls.ranges = {{"l_leg_kny", {30, 90}}};  // degrees
  EXPECT_THROW(movedJoints(body, falls), InputError);
}

TEST(FallRobot, LeavesOutANodeAndItsEdges) {
  const ContactGraph whole = fallsOf("bioloid-gp")->setup("one_foot", "forward").graph;
  const ContactGraph less = whole.without("hands");
  ASSERT_EQ(less.nodes.size(), whole.nodes.size() - 1);
  int edges = 0;
  for (size_t i = 0; i < less.nodes.size(); ++i) {
    for (const int to : less.edges[i]) {
      ++edges;
      EXPECT_NE(less.nodes[to].name, "hands");
    }
  }
  EXPECT_EQ(edges, 11 - 4);  // Figure 20 has eleven, four of them to or from the hands
  ContactGraph all = whole;
  for (const char* node : {"left-heel", "left-toes", "hands"}) all = all.without(node);
  EXPECT_THROW(all.without("head"), InputError);  // nothing could follow
  EXPECT_THROW(whole.without("right-toes"), InputError);
  EXPECT_THROW(whole.without("tail"), InputError);
}

TEST(FallRobot, GraphsKeepTheirOtherEdgesAndHaveAnOrder) {
  const auto edges_of = [](const ContactGraph& graph) {
    std::set<std::pair<std::string, std::string>> edges;
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
      for (const int to : graph.edges[i]) {
        edges.emplace(graph.nodes[i].name, graph.nodes[to].name);
      }
    }
    return edges;
  };
  for (const char* robot : {"bioloid-gp", "atlas"}) {
    const auto falls = fallsOf(robot);
    for (const FallSetup& setup : falls->setups) {
      const ContactGraph& graph = setup.graph;
      const size_t n = graph.nodes.size();
      std::vector<int> order = graph.order();
      ASSERT_EQ(order.size(), n);
      std::vector<int> place(n, -1);
      for (size_t i = 0; i < n; ++i) place[order[i]] = static_cast<int>(i);
      for (size_t i = 0; i < n; ++i) {
        ASSERT_GE(place[i], 0);
        for (const int to : graph.edges[i]) EXPECT_LT(place[i], place[to]);
        EXPECT_TRUE(graph.has(graph.nodes[i].name));
      }
      EXPECT_FALSE(graph.has("tail"));
      for (size_t i = 1; i < n; ++i) {
        const std::string& gone = graph.nodes[i].name;
        auto expected = edges_of(graph);
        std::erase_if(expected, [&](const auto& e) { return e.first == gone || e.second == gone; });
        EXPECT_EQ(edges_of(graph.without(gone)), expected) << robot << " without " << gone;
        EXPECT_FALSE(graph.without(gone).has(gone));
      }
    }
  }
}

TEST(FallRobot, IsAsQuickAsIsSaidForTheFallAndForWhatIsLeftOut) {
  FallSetup setup = fallsOf("bioloid-gp")->setup("one_foot", "forward");
  const FallSetup without = setup.without("hands");
  EXPECT_EQ(without.graph.nodes.size(), setup.graph.nodes.size() - 1);
  EXPECT_GT(without.quick.stopper_speed, setup.quick.stopper_speed);
  EXPECT_EQ(without.quick.rod_speed, setup.quick.rod_speed);  // what is not said stays
  EXPECT_EQ(setup.without("head").quick.stopper_speed, setup.quick.stopper_speed);
  // In any order, where they say different things.
  setup.quick_without["head"] = {.rod_speed = 0.01};
  for (const FallSetup& both :
       {setup.without("hands").without("head"), setup.without("head").without("hands")}) {
    EXPECT_EQ(both.quick.rod_speed, 0.01);
    EXPECT_EQ(both.quick.stopper_speed, without.quick.stopper_speed);
    EXPECT_EQ(both.quick.stiffness, without.quick.stiffness);
  }

  const auto with = [](const std::string& more) { return complaintWith(more, "[fall.graph]"); };
  EXPECT_NE(with("without.hand = { stiffness = 1 }").find("Did you mean \"hands\"?"),
            std::string::npos);
  EXPECT_NE(with("without.hands = { stopper_speed = 0 }").find("expected > 0"), std::string::npos);
  EXPECT_NE(with("without.hands = { speed = 1 }").find("speed"), std::string::npos);
  EXPECT_NE(with("stiffness = inf").find("expected a finite number"), std::string::npos);
  EXPECT_EQ(with("stiffness = 0.5\nwithout.hands = { rod_speed = 0.1 }"), "");
}

TEST(FallRobot, NamesAJointABodyAndAGraphThatAreNone) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = std::string(kHead) + kGraph;
    return complaint(text.replace(text.find(from), from.size(), to));
  };
  EXPECT_NE(with("leg_kny", "leg_knyy").find("Did you mean \"leg_kny\"?"), std::string::npos);
  EXPECT_NE(with("utorso", "utorsoo").find("no body \"utorsoo\". Did you mean \"utorso\"?"),
            std::string::npos);
  EXPECT_NE(with("next = [\"hands\"]", "next = []").find("expected a first node"),
            std::string::npos);
  // One mistake, one complaint.
  const std::string once = with("stopper_speed = 3", "stopper_speed = 0");
  EXPECT_EQ(once.find("stopper_speed"), once.rfind("stopper_speed")) << once;
}

TEST(FallRobot, GraphsAreThePublishedOnes) {
  const auto edges = [](const FallSetup& s) {
    std::string text;
    for (size_t i = 0; i < s.graph.nodes.size(); ++i) {
      for (const int to : s.graph.edges[i]) {
        text += s.graph.nodes[i].name + ">" + s.graph.nodes[to].name + " ";
      }
    }
    return text;
  };
  EXPECT_EQ(edges(fallsOf("bioloid-gp")->setup("one_foot", "forward")),
            "right-toes>left-heel right-toes>left-toes right-toes>hands right-toes>head "
            "left-heel>left-toes left-toes>hands left-toes>head left-toes>right-heel "
            "hands>head hands>right-heel head>right-heel ");
  const auto atlas = fallsOf("atlas");
  EXPECT_EQ(edges(atlas->setup("one_foot", "forward")),
            "right-foot>left-foot right-foot>hands right-foot>head left-foot>hands left-foot>head "
            "hands>head ");
  EXPECT_EQ(edges(atlas->setup("two_feet", "forward")),
            "feet>knees feet>hands feet>head knees>hands knees>head hands>head ");
  EXPECT_EQ(edges(atlas->setup("two_feet", "backward")),
            "feet>hips feet>hands feet>back hips>hands hips>back hands>back ");
  EXPECT_THROW(atlas->setup("two_feet", "sideways"), InputError);
}

TEST(ReachTable, HasWhatWasMarkedWithinOneCell) {
  ReachTable table(0.05, 1);
  EXPECT_FALSE(table.reachable(0.52, 0.31, 2));
  table.mark(0.52, 0.31, 2);
  EXPECT_TRUE(table.reachable(0.52, 0.31, 2));
  EXPECT_TRUE(table.reachable(0.57, 0.26, 2.05));
  EXPECT_FALSE(table.reachable(0.67, 0.31, 2));
  EXPECT_FALSE(table.reachable(0.52, 0.31, 2.3));
  table.mark(0.52, 0.31, std::numbers::pi);  // goes round
  EXPECT_TRUE(table.reachable(0.52, 0.31, -std::numbers::pi + 0.05));
  EXPECT_FALSE(table.reachable(7, 0.31, 2));
}

TEST(ReachTable, HoldsThePosesItWasMadeFrom) {
  const auto falls = fallsOf("atlas");
  const SagittalBody body(modelOf(*falls), falls->setup("two_feet", "forward"));
  const ReachTables a = sampleReach(body, *falls, {.poses = 500, .seed = 3, .cell = 0.05});
  const ReachTables b = sampleReach(body, *falls, {.poses = 500, .seed = 3, .cell = 0.05});
  for (size_t i = 0; i < a.size(); ++i) {
    for (size_t e = 0; e < a[i].size(); ++e) {
      EXPECT_GT(a[i][e].filled(), 0);
      EXPECT_LT(a[i][e].filled(), 0.5);
      EXPECT_EQ(a[i][e].filled(), b[i][e].filled());
    }
  }
  // The stance itself lies in a cell that some random pose has marked.
  sim::World world(body.model());
  world.reset(body.model()->stateOf(falls->robot->poses.at("two_feet")));
  const sim::Snapshot& s = world.snapshot();
  const ReachTables many = sampleReach(body, *falls, {.poses = 5000, .seed = 3, .cell = 0.05});
  const double r1 = (body.com(s) - body.node(s, 0)).norm();
  for (size_t e = 0; e < many[0].size(); ++e) {
    const int to = body.setup().graph.edges[0][e];
    const double r2 = (body.node(s, to) - body.com(s)).norm();
    const double theta2 = body.stopperAngle(s, 0, to);
    EXPECT_TRUE(many[0][e].reachable(r1, r2, theta2)) << e;
    EXPECT_FALSE(many[0][e].reachable(r2 / 3, 2 * r1, theta2)) << e;
  }
}

TEST(SagittalBody, SeesAStandingRobotAsAPendulum) {
  const auto falls = fallsOf("atlas");
  for (const char* direction : {"forward", "backward"}) {
    const SagittalBody body(modelOf(*falls), falls->setup("two_feet", direction));
    const sim::State stance = body.model()->stateOf(falls->robot->poses.at("two_feet"));
    sim::World world(body.model());
    world.reset(stance);
    const PendulumState s = body.pendulum(world.snapshot(), 0);
    EXPECT_LT(s.theta, 0);  // the edge it would fall over is ahead
    EXPECT_NEAR(s.com().y(), body.com(world.snapshot()).y(), 1e-3);
    // Point masses alone have 26.5, all of it 28.6, with the arms sideways.
    EXPECT_NEAR(body.inertia(stance), 28, 2);
  }
}

TEST(SagittalBody, RodAndStopperLeadToThePartsTheyAreOf) {
  for (const auto& [robot, stance, direction] :
       {std::tuple("atlas", "two_feet", "forward"), std::tuple("atlas", "two_feet", "backward"),
        std::tuple("bioloid-gp", "one_foot", "forward")}) {
    const auto falls = fallsOf(robot);
    const SagittalBody body(modelOf(*falls), falls->setup(stance, direction));
    sim::State state = body.model()->stateOf(falls->robot->poses.at(stance));
    state.v.setLinSpaced(-0.3, 0.5);
    sim::World world(body.model());
    world.reset(state);
    const sim::Snapshot& s = world.snapshot();
    const double sign = std::string(direction) == "forward" ? 1 : -1;
    EXPECT_EQ(body.com(s), Vector2d(sign * s.com().x(), s.com().z()));
    const ContactGraph& graph = body.setup().graph;
    for (size_t i = 0; i < graph.nodes.size(); ++i) {
      const auto node = static_cast<int>(i);
      Vector2d mean = Vector2d::Zero();
      for (const std::string& point : graph.nodes[i].points) {
        mean += body.inPlane(body.point(s, point));
        const sim::BodyId of = body.model()->body(falls->robot->contacts.at(point).body);
        EXPECT_EQ(body.partAt(s, of, body.point(s, point)), point);
      }
      mean /= static_cast<double>(graph.nodes[i].points.size());
      EXPECT_LT((body.node(s, node) - mean).norm(), 1e-12);
      const PendulumState p = body.pendulum(s, node);
      EXPECT_LT((p.com() + body.node(s, node) - body.com(s)).norm(), 1e-12);
      EXPECT_LT((p.comVelocity() - body.comVelocity(s)).norm(), 1e-12);
      for (const int to : graph.edges[i]) {
        const double theta2 = body.stopperAngle(s, node, to);
        EXPECT_GT(theta2, -std::numbers::pi);
        EXPECT_LE(theta2, std::numbers::pi);
        const double angle = p.theta + theta2;
        const double length = (body.node(s, to) - body.com(s)).norm();
        const Vector2d tip = body.com(s) + length * Vector2d(std::sin(angle), std::cos(angle));
        EXPECT_LT((tip - body.node(s, to)).norm(), 1e-12);
      }
    }
    for (const HeldPart& part : heldParts(body, s, 0)) {
      const double angle = body.pendulum(s, 0).theta + part.theta2;
      const Vector2d tip = body.com(s) + part.r2 * Vector2d(std::sin(angle), std::cos(angle));
      EXPECT_LT((tip - body.inPlane(body.point(s, part.name))).norm(), 1e-12) << part.name;
    }
  }
  for (const auto& [angle, in_range] :
       {std::pair(0.0, 0.0), std::pair(-3.0, -3.0), std::pair(4 * std::numbers::pi + 0.1, 0.1),
        std::pair(-std::numbers::pi - 0.1, std::numbers::pi - 0.1)}) {
    EXPECT_NEAR(wrapped(angle), in_range, 1e-12);
  }
  EXPECT_EQ(wrapped(-std::numbers::pi), std::numbers::pi);
}

TEST(ReachTable, IsMarkedACellEachWayAndRoundTheCircle) {
  ReachTable table(0.1, 1);
  const double turn = 2 * std::numbers::pi / ReachTable::kAngles;
  table.mark(0.55, 0.35, std::numbers::pi - turn / 2);  // the last angle below π
  const auto reached = [&](int i, int j, int k) {
    return table.reachable(0.55 + 0.1 * i, 0.35 + 0.1 * j, std::numbers::pi - turn / 2 + turn * k);
  };
  int marked = 0;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (int k = -2; k <= 2; ++k) {
        const bool near = std::abs(i) < 2 && std::abs(j) < 2 && std::abs(k) < 2;
        EXPECT_EQ(reached(i, j, k), near) << i << j << k;
        marked += near;
      }
    }
  }
  EXPECT_NEAR(table.filled(), marked / (std::pow(table.cells(), 2) * ReachTable::kAngles), 1e-12);
  EXPECT_EQ(table.cells(), 12);
  EXPECT_TRUE(reached(0, 0, ReachTable::kAngles));
  for (const double outside : {-0.01, 1.21, 1e9}) {
    EXPECT_FALSE(table.reachable(outside, 0.35, 3));
    EXPECT_FALSE(table.reachable(0.55, outside, 3));
  }
  // At the ends there are no cells beyond.
  ReachTable corner(0.1, 1);
  corner.mark(0, 1.19, 0);
  EXPECT_NEAR(corner.filled() * std::pow(corner.cells(), 2) * ReachTable::kAngles, 2 * 2 * 3, 1e-9);
}

TEST(Planner, BranchAndBoundIsExact) {
  const auto falls = fallsOf("atlas");
  for (const char* direction : {"forward", "backward"}) {
    FallProblem p = coarse(*falls, "two_feet", direction);
    for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
      p.stall = stall;
      int found = 0;
      for (int i = 0; i < 25; ++i) {
        const FallState start = randomStart(1.1, i);
        PlanEffort pruned, all;
        const FallPlan exact = planExactly(p, start, &pruned);
        const FallPlan plain = planUnpruned(p, start, &all);
        EXPECT_EQ(exact.cost, plain.cost);
        EXPECT_LE(pruned.actions, all.actions);
        if (std::isinf(exact.cost)) continue;
        ++found;
        std::vector<FallAction> actions;
        for (const PlannedContact& c : exact.contacts) actions.push_back(c.action);
        EXPECT_EQ(replay(p, start, actions).cost, exact.cost);
      }
      EXPECT_GT(found, 0);
    }
  }
}

TEST(Planner, ARodDoesNotStopAFallByGrowingBeyondTheRobot) {
  FallProblem p;
  p.model = {.mass = 100, .inertia = 10};
  p.graph.nodes = {{"feet", {}}};
  p.graph.edges = {{}};
  p.rod_speed = 0.6;
  // A tenth faster than what stands up again by itself.
  const double r = 1.1, theta = -0.3;
  const double passive = std::sqrt(2 * p.model.gravity * (1 - std::cos(theta)) / r);
  const FallState start{0, 0, {.theta = theta, .r = r, .theta_rate = 1.1 * passive}};
  Expansion out;
  expand(p, start, out);
  EXPECT_TRUE(out.stops);  // at twice the length
  p.lengths = {{0.6, 1.2}};
  expand(p, start, out);
  EXPECT_FALSE(out.stops);
}

TEST(Planner, AnActionTriedKeepsTheRodWithinTheRobot) {
  const auto falls = fallsOf("atlas");
  FallProblem p = coarse(*falls, "two_feet", "forward");
  const FallState start = randomStart(1.1, 0);
  Expansion out;
  expand(p, start, out);
  ASSERT_FALSE(out.contacts.empty());
  const FallAction action = out.contacts.front().action;
  EXPECT_TRUE(tryAction(p, start, action));
  p.lengths.assign(p.graph.nodes.size(), {0.1, 1});  // the rod is 1.1 m
  EXPECT_FALSE(tryAction(p, start, action));
}

TEST(Planner, AFallStopsWhereTheRodCannotPassItsPivot) {
  FallProblem p;
  PendulumModel fine = p.model;
  fine.step = 1e-5;
  for (const double theta : {-0.4, -0.05}) {
    for (const double r : {0.2, 1.1}) {
      const double passing = std::sqrt(2 * p.model.gravity * (1 - std::cos(theta)) / r);
      for (const double share : {0.99, 1.01}) {
        PendulumState s{.theta = theta, .r = r, .theta_rate = share * passing};
        p.stall = Stall::kStops;
        EXPECT_EQ(stopped(p, s), share < 1) << theta << " " << r;
        p.stall = Stall::kLiteral;
        EXPECT_FALSE(stopped(p, s));
        while (s.theta_rate > 0 && s.theta < 0) step(fine, 0, s);
        EXPECT_EQ(s.theta_rate <= 0, share < 1) << theta << " " << r;
      }
    }
  }
  for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
    p.stall = stall;
    EXPECT_FALSE(stopped(p, {.theta = 0.1, .r = 1, .theta_rate = 1e-3}));
    EXPECT_TRUE(stopped(p, {.theta = 0.1, .r = 1, .theta_rate = 0}));
    EXPECT_TRUE(stopped(p, {.theta = -0.1, .r = 1, .theta_rate = -1}));
  }
}

TEST(Planner, ExpandsAllThatAnActionMayDoAndNothingElse) {
  const auto falls = fallsOf("atlas");
  FallProblem p = coarse(*falls, "two_feet", "forward");
  p.grid.rod_rates = 3;
  p.least_interval = 0.1;
  const int angles = static_cast<int>(std::lround(2 * std::numbers::pi / p.grid.angle));
  size_t seen = 0;
  Expansion out;  // used again and again, as a search does
  for (int i = 0; i < 4; ++i) {
    FallState start = randomStart(1.1, i);
    start.pendulum.theta = std::abs(start.pendulum.theta);  // nothing stops it
    start.time = i % 2 == 0 ? 0 : 0.3;
    expand(p, start, out);
    ASSERT_FALSE(out.stops);
    seen += out.contacts.size();
    size_t allowed = 0;
    const std::vector<int>& next = p.graph.edges[0];
    for (const double rate : {-p.rod_speed, 0.0, p.rod_speed}) {
      for (int k = 1; k * p.grid.time < 1.5; ++k) {
        for (int a = 1; a <= angles; ++a) {
          for (const int to : next) {
            allowed += tryAction(p, start,
                                 {to, -std::numbers::pi + a * p.grid.angle, k * p.grid.time, rate})
                           .has_value();
          }
        }
      }
    }
    EXPECT_EQ(out.contacts.size(), allowed);
    for (const PlannedContact& c : out.contacts) {
      const auto tried = tryAction(p, start, c.action);
      ASSERT_TRUE(tried);
      EXPECT_EQ(tried->impact.impulse, c.impact.impulse);
      EXPECT_EQ(c.next().time, start.time + c.action.duration);
      EXPECT_EQ(c.next().contact, c.action.contact);
      EXPECT_GE(c.action.duration, p.least_interval);
      const auto edge = std::find(next.begin(), next.end(), c.action.contact) - next.begin();
      ASSERT_LT(edge, static_cast<std::ptrdiff_t>(next.size()));
      const double turn =
          std::remainder(c.action.theta2 - p.first_angle[0][edge], 2 * std::numbers::pi);
      EXPECT_LE(std::abs(turn), c.next().time * p.stopper_speed + 1e-9);
      EXPECT_TRUE(p.reach[0][edge].reachable(c.before.r, c.impact.length, c.action.theta2));
      // The stopper's tip is on the ground.
      EXPECT_NEAR(c.before.com().y() + c.impact.length * std::cos(c.before.theta + c.action.theta2),
                  0, 1e-9);
    }
  }
  EXPECT_GT(seen, 0U);
}

TEST(Planner, AHeldPoseHitsTheGroundPartByPart) {
  FallProblem p;
  p.model = {.mass = 100, .inertia = 20};
  const FallState start{0, 0.5, {.theta = 0.1, .r = 1, .theta_rate = 0.5}};
  const std::vector<HeldPart> parts = {{"hand", 0.8, 2.2}, {"knee", 0.75, 2.6}, {"head", 0.5, 0}};
  const std::vector<HeldImpact> impacts = heldFall(p, parts, start);
  ASSERT_EQ(impacts.size(), 2U);
  // Where the tips are, seen from the COM: the body turns with the rod between impacts, and not in
  // one, whatever the new rod's direction is.
  std::vector<double> world;
  world.reserve(parts.size());
  for (const HeldPart& part : parts) world.push_back(start.pendulum.theta + part.theta2);
  PendulumState s = start.pendulum;
  double time = start.time;
  std::vector<bool> down(parts.size());
  for (const HeldImpact& found : impacts) {
    size_t hit = parts.size();
    while (hit == parts.size()) {
      ASSERT_LT(s.theta, std::numbers::pi / 2);
      const double before = s.theta;
      step(p.model, 0, s);
      time += p.model.step;
      for (size_t i = parts.size(); i-- > 0;) {
        world[i] += s.theta - before;
        const bool below = s.com().y() + parts[i].r2 * std::cos(world[i]) <= 0;
        if (below && !down[i]) hit = i;
      }
    }
    down[hit] = true;
    EXPECT_EQ(found.part, parts[hit].name);
    EXPECT_NEAR(found.time, time, 1e-9);
    const auto expected = impact(p.model, s, world[hit] - s.theta);
    ASSERT_TRUE(expected);
    EXPECT_NEAR(found.impulse, expected->impulse, 1e-9 * expected->impulse);
    s = expected->after;
  }
}

TEST(Planner, ACachePlansNearlyAsWellAsTheOptimum) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  for (int i = 0; i < 10; ++i) {
    const FallState start = randomStart(1.1, i);
    PlanEffort cached, all;
    const double optimum = planUnpruned(p, start, &all).cost;
    const double cost = planCached(p, start, 0.1, &cached).cost;
    EXPECT_GE(cost, optimum);
    EXPECT_LE(cost, 1.5 * optimum);  // nearer states than 0.1 are not worth more
    EXPECT_LE(cached.states, all.states);
  }
}

TEST(Planner, EveryContactOfAPlanIsAllowed) {
  const auto falls = fallsOf("bioloid-gp");
  const SagittalBody body(modelOf(*falls), falls->setup("one_foot", "forward"));
  FallProblem p = fallProblem(body, *falls, {.poses = 2000});
  p.least_interval = 0.04;
  sim::World world(body.model());
  world.place(body.model()->stateOf(falls->robot->poses.at(body.setup().stance)));
  const std::vector<HeldPart> parts = heldParts(body, world.snapshot(), 0);
  ASSERT_FALSE(parts.empty());
  for (int i = 0; i < 10; ++i) {
    const FallState start = randomStart(0.17, i);
    const FallPlan plan = planExactly(p, start);
    double cost = 0;
    int on = 0;
    for (const PlannedContact& c : plan.contacts) {
      EXPECT_EQ(c.from.contact, on);
      on = c.action.contact;
      cost = std::max(cost, c.impact.impulse);
      EXPECT_LE(std::abs(c.action.rod_rate), p.rod_speed);
      EXPECT_GE(c.action.duration, p.least_interval);
    }
    if (!std::isinf(plan.cost)) {
      EXPECT_EQ(cost, plan.cost);
    }
    double held = 0;
    for (const HeldImpact& h : heldFall(p, parts, start)) held = std::max(held, h.impulse);
    if (start.pendulum.theta > 0) {
      EXPECT_LT(plan.cost, held);
    }
  }
}

TEST(Planner, AFallThatHasTurnedBackNeedsNoContact) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  const FallState back{0, 0, {.theta = 0.1, .r = 1.1, .theta_rate = -0.2}};
  EXPECT_EQ(planExactly(p, back).cost, 0);
  EXPECT_TRUE(planExactly(p, back).contacts.empty());
  EXPECT_TRUE(heldFall(p, {{"head", 0.7, 0}}, back).empty());
}

TEST(ValueTable, PlansNearlyAsTheExactPlannerAndNeverClaimsMore) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  const ValueTable table(p, {.times = 4, .angles = 9, .lengths = 4, .rates = 8});
  EXPECT_LT(table.bytes(), 5'000'000U);
  double exact = 0;
  double quick = 0;
  for (int i = 0; i < 25; ++i) {
    const FallState start = randomStart(1.1, i);
    const FallPlan best = planExactly(p, start);
    const FallPlan near = planQuickly(p, table, start);
    EXPECT_GE(near.cost, best.cost);
    if (std::isinf(best.cost)) continue;
    ASSERT_FALSE(std::isinf(near.cost)) << "a dead end";
    std::vector<FallAction> actions;
    for (const PlannedContact& c : near.contacts) actions.push_back(c.action);
    EXPECT_EQ(replay(p, start, actions).cost, near.cost);
    exact += best.cost;
    quick += near.cost;
  }
  EXPECT_GT(exact, 0);
  EXPECT_LT(quick, 1.05 * exact);
}

TEST(ValueTable, IsMultilinearInsideAndConstantBeyond) {
  FallProblem p;
  p.graph.nodes = {{"feet", {}}, {"hands", {}}};
  p.graph.edges = {{1}, {}};
  p.lengths = {{0.3, 0.5}, {0.2, 0.9}};
  const ValueGrid grid{.times = 3, .angles = 4, .lengths = 2, .rates = 5};
  const auto value = [](int node, double t, double theta, double r, double rate) {
    return (1 + node) * (2 + t) * (3 - theta) * (1 + r) * (5 + rate);
  };
  const ValueTable empty(p, grid, std::vector<float>(2 * 3 * 4 * 2 * 5).data());
  std::vector<float> values;
  for (int node = 0; node < 2; ++node) {
    const ValueTable::Node& n = empty.nodes()[node];
    EXPECT_EQ(n.first, static_cast<size_t>(node) * 3 * 4 * 2 * 5);
    EXPECT_EQ(std::pair(n.r.min, n.r.max), p.lengths[node]);
    EXPECT_EQ(n.time.min, 0);
    EXPECT_EQ(n.rate.min, 0);
    // Twice the rate of a fall to the ground.
    EXPECT_NEAR(n.rate.max, 2 * std::sqrt(2 * 9.81 / p.lengths[node].second), 1e-12);
    EXPECT_LT(n.theta.min, -1);
    EXPECT_EQ(n.theta.max, std::numbers::pi / 2);
    for (int t = 0; t < 3; ++t) {
      for (int a = 0; a < 4; ++a) {
        for (int l = 0; l < 2; ++l) {
          for (int w = 0; w < 5; ++w) {
            values.push_back(static_cast<float>(
                value(node, n.time.at(t), n.theta.at(a), n.r.at(l), n.rate.at(w))));
          }
        }
      }
    }
  }
  const ValueTable table(p, grid, values.data());
  EXPECT_EQ(table.values(), values);
  EXPECT_EQ(table.bytes(), 4 * values.size());
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const int node = i % 2;
    const ValueTable::Node& n = table.nodes()[node];
    double at[4];
    double held[4];
    const ValueTable::Axis* const axes[] = {&n.time, &n.theta, &n.r, &n.rate};
    for (int k = 0; k < 4; ++k) {
      const double span = axes[k]->max - axes[k]->min;
      at[k] = random.uniform(axes[k]->min - span / 4, axes[k]->max + span / 4);
      if (i < 4) at[k] = i < 2 ? axes[k]->min : axes[k]->max;
      held[k] = std::clamp(at[k], axes[k]->min, axes[k]->max);
    }
    const double expected = value(node, held[0], held[1], held[2], held[3]);
    EXPECT_NEAR(table.at({node, at[0], {.theta = at[1], .r = at[2], .theta_rate = at[3]}}),
                expected, 1e-5 * expected);
  }
}

/// A library of BioloidGP's plans, aligned as the reader wants it: made once, as it takes a while.
struct Compiled {
  Compiled()
      : falls(fallsOf("bioloid-gp")),
        body(modelOf(*falls), falls->setup("one_foot", "forward")),
        problem(fallProblem(body, *falls, {.poses = 2000})),
        table(problem),
        bytes(compileLibrary(problem, table, {"bioloid-gp", "one_foot", "forward"})),
        words((bytes.size() + 3) / 4) {
    std::memcpy(words.data(), bytes.data(), bytes.size());
  }
  std::shared_ptr<const FallRobot> falls;
  SagittalBody body;
  FallProblem problem;
  ValueTable table;
  std::string bytes;
  std::vector<std::uint32_t> words;

  static const Compiled& once() {
    static const Compiled kOnce;
    return kOnce;
  }
};

TEST(PlanLibrary, TheReaderWithoutAHeapPlansAsWell) {
  const Compiled& c = Compiled::once();
  const fall_library* library = nullptr;
  ASSERT_EQ(fall_open(c.words.data(), c.bytes.size(), &library), nullptr);
  EXPECT_LT(c.bytes.size(), 5'000'000);
  EXPECT_EQ(std::string(library->robot), "bioloid-gp");
  double read = 0;
  double planned = 0;
  int none = 0;
  for (int i = 0; i < 20; ++i) {
    const FallState start = randomStart(0.17, i);
    const FallPlan plan = planQuickly(c.problem, c.table, start, {1, 1, 1});
    fall_state at{0, 0, static_cast<float>(start.pendulum.theta),
                  static_cast<float>(start.pendulum.r),
                  static_cast<float>(start.pendulum.theta_rate)};
    fall_contact contact{};
    fall_answer answer = FALL_NONE;
    double cost = 0;
    while ((answer = fall_next(library, &at, &contact)) == FALL_CONTACT) {
      cost = std::max(cost, static_cast<double>(contact.impulse));
      at = contact.next;
    }
    if (std::isinf(plan.cost)) {
      ++none;
      continue;
    }
    EXPECT_EQ(answer, FALL_STOPS) << i;
    read += cost;
    planned += plan.cost;
  }
  EXPECT_LT(none, 5);
  EXPECT_NEAR(read, planned, 0.03 * planned);  // single precision moves a contact now and then
}

TEST(PlanLibrary, GivesBackTheTableItWasMadeFrom) {
  const Compiled& c = Compiled::once();
  const ValueTable read = tableFromLibrary(c.bytes, c.problem, "file");
  EXPECT_EQ(read.values(), c.table.values());
  const FallState start = randomStart(0.17, 3);
  EXPECT_EQ(read.at(start), c.table.at(start));
}

TEST(PlanLibrary, RefusesWhatIsNotItsOwn) {
  const Compiled& c = Compiled::once();
  const auto message = [&](const std::string& bytes, const FallProblem& problem) -> std::string {
    try {
      tableFromLibrary(bytes, problem, "a.fallplan");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(message("", c.problem), "not a library"));
  EXPECT_TRUE(has(message("nonsense", c.problem), "a.fallplan: not a library"));
  EXPECT_TRUE(has(message(c.bytes.substr(0, c.bytes.size() - 4), c.problem), "another size"));
  std::string damaged = c.bytes;
  damaged.back() = static_cast<char>(damaged.back() + 1);
  EXPECT_TRUE(has(message(damaged, c.problem), "checksum"));
  std::string old = c.bytes;
  old[8] = static_cast<char>(old[8] + 1);
  EXPECT_TRUE(has(message(old, c.problem), "another version"));
  FallProblem other = c.problem;
  other.stopper_speed *= 2;
  EXPECT_TRUE(has(message(c.bytes, other), "traceur fall compile"));
}

/// A whole library of two nodes and one edge, as small as there is.
struct TinyLibrary {
  fall_library l{};
  fall_library_node nodes[2]{};
  fall_library_edge edge{};
  float values[2][16]{};
  std::uint32_t reach = 0xffffffff;

  TinyLibrary() {
    std::memcpy(l.magic, FALL_LIBRARY_MAGIC, sizeof l.magic);
    l.version = FALL_LIBRARY_VERSION;
    l.size = sizeof *this;
    l.mass = 3;
    l.inertia = 0.03F;
    l.gravity = 9.8F;
    l.step = 0.005F;
    l.rod_speed = 0.5F;
    l.stopper_speed = 5;
    l.grid_time = 0.02F;
    l.grid_angle = 0.2F;
    l.horizon = 0.5F;
    l.rod_rates = 3;
    l.stall_stops = 1;
    l.nodes = 2;
    l.first_node = offsetof(TinyLibrary, nodes);
    for (std::uint32_t i = 0; i < 2; ++i) {
      nodes[i].first_edge = offsetof(TinyLibrary, edge);
      nodes[i].time = {0, 1.5F, 2};
      nodes[i].theta = {-1.2F, 1.57F, 2};
      nodes[i].r = {0.1F, 0.3F, 2};
      nodes[i].rate = {0, 12, 2};
      nodes[i].values = offsetof(TinyLibrary, values) + i * sizeof values[0];
    }
    nodes[0].edges = 1;
    edge = {1, 1.5F, 0.2F, 2, 8, offsetof(TinyLibrary, reach)};
    seal();
  }
  void seal() {
    constexpr size_t summed = offsetof(fall_library, problem);
    l.checksum = fall_checksum(reinterpret_cast<const char*>(this) + summed, sizeof *this - summed);
  }
  /// What opening says; what opens is planned with.
  const char* open() {
    seal();
    const fall_library* library = nullptr;
    const char* wrong = fall_open(this, sizeof *this, &library);
    for (std::uint32_t node = 0; !wrong && node <= l.nodes; ++node) {
      fall_state at{node, 0, 0.3F, 0.2F, 3};
      fall_contact contact{};
      for (int k = 0; k < 3 && fall_next(library, &at, &contact) == FALL_CONTACT; ++k) {
        at = contact.next;
      }
    }
    return wrong;
  }
};
static_assert(sizeof(TinyLibrary) % 4 == 0);

TEST(PlanLibrary, TheReaderRefusesWhatContradictsItself) {
  ASSERT_EQ(TinyLibrary().open(), nullptr);
  const std::function<void(TinyLibrary&)> wrong[] = {
      [](TinyLibrary& t) { t.l.step = 0; },
      [](TinyLibrary& t) { t.l.step = 1e-9F; },  // would plan for hours
      [](TinyLibrary& t) { t.l.grid_angle = 1e-30F; },
      [](TinyLibrary& t) { t.l.horizon = INFINITY; },
      [](TinyLibrary& t) { t.l.gravity = NAN; },
      [](TinyLibrary& t) { t.l.grid_time = 0.001F; },  // shorter than a step: no stride
      [](TinyLibrary& t) { t.l.rod_rates = 0; },
      [](TinyLibrary& t) { t.l.nodes = 0; },
      [](TinyLibrary& t) { t.l.nodes = 50'000'000; },  // 88 times that is small in 32 bits
      [](TinyLibrary& t) { t.l.first_node += 2; },
      [](TinyLibrary& t) { t.l.first_node = 0xfffffff0; },
      [](TinyLibrary& t) { std::memset(t.l.stance, 'x', sizeof t.l.stance); },
      [](TinyLibrary& t) { std::memset(t.nodes[1].name, 'x', sizeof t.nodes[1].name); },
      [](TinyLibrary& t) { t.nodes[0].edges = 1'000'000; },
      [](TinyLibrary& t) { t.nodes[0].first_edge = sizeof t - 8; },
      [](TinyLibrary& t) { t.nodes[1].theta.n = 1; },
      [](TinyLibrary& t) { t.nodes[1].theta.n = 65536, t.nodes[1].r.n = 65536; },
      [](TinyLibrary& t) { t.nodes[1].rate.max = -1; },
      [](TinyLibrary& t) { t.nodes[1].r.min = 0; },
      [](TinyLibrary& t) { t.nodes[1].values += 4; },  // one value beyond the end
      [](TinyLibrary& t) { t.values[1][3] = NAN; },
      [](TinyLibrary& t) { t.edge.to = 2; },
      [](TinyLibrary& t) { t.edge.cell = 0; },
      [](TinyLibrary& t) { t.edge.cells = 3; },  // more bits than there are
      [](TinyLibrary& t) { t.edge.cells = 0x10000001; },
      [](TinyLibrary& t) { t.edge.reach = sizeof t; }};
  for (size_t i = 0; i < std::size(wrong); ++i) {
    TinyLibrary t;
    wrong[i](t);
    EXPECT_STREQ(t.open(), "a library of fall plans that contradicts itself") << i;
  }
}

TEST(PlanLibrary, WhateverOpensCanBePlannedWith) {
  for (size_t at = offsetof(fall_library, problem); at < sizeof(TinyLibrary); at += 4) {
    for (const std::uint32_t word : {0u, 1u, 2u, 0x7fffffffu, 0x80000000u, 0xffffffffu, 0x7fc00000u,
                                     0x7f000000u, 0xbf800000u}) {
      TinyLibrary t;
      std::memcpy(reinterpret_cast<char*>(&t) + at, &word, sizeof word);
      t.open();  // ends, and reads nothing else
    }
  }
}

TEST(PlanLibrary, TheReaderPlansNothingFromStatesThatAreNone) {
  const TinyLibrary t;
  const fall_library* library = nullptr;
  ASSERT_EQ(fall_open(&t, sizeof t, &library), nullptr);
  fall_contact contact{};
  for (const fall_state& state :
       {fall_state{2, 0, 0.3F, 0.2F, 3}, fall_state{0, NAN, 0.3F, 0.2F, 3},
        fall_state{0, 0, NAN, 0.2F, 3}, fall_state{0, 0, 0.3F, INFINITY, 3},
        fall_state{0, 0, 0.3F, 0.2F, -INFINITY}}) {
    EXPECT_EQ(fall_next(library, &state, &contact), FALL_NONE);
  }
}

TEST(PlanLibrary, TablesAreKeptWherePeopleKeepSuchThings) {
  const auto where = [](const char* cache, const char* home) {
    for (const auto& [name, value] :
         {std::pair("XDG_CACHE_HOME", cache), std::pair("HOME", home)}) {
      value ? setenv(name, value, 1) : unsetenv(name);
    }
    return tableCache().string();
  };
  const auto before = [](const char* name) {
    const char* value = std::getenv(name);
    return value ? std::optional<std::string>(value) : std::nullopt;
  };
  const auto cache = before("XDG_CACHE_HOME"), home = before("HOME");
  EXPECT_EQ(where("/c", "/h"), "/c/traceur/falls");
  EXPECT_EQ(where(nullptr, "/h"), "/h/.cache/traceur/falls");
  EXPECT_EQ(where("", "/h"), "/h/.cache/traceur/falls");
  EXPECT_EQ(where("c", "/h"), "/h/.cache/traceur/falls");
  for (const char* no_path : {static_cast<const char*>(nullptr), "", "h"}) {
    EXPECT_EQ(where(nullptr, no_path), "");
  }
  where(cache ? cache->c_str() : nullptr, home ? home->c_str() : nullptr);
}

TEST(PlanLibrary, ATableKeptOnDiskIsTheOneThatWouldBeMade) {
  const Compiled& c = Compiled::once();
  const TestFolder tables;
  const std::filesystem::path folder = tables / "fall-tables" / "deeper";
  const LibraryLabel label{"bioloid-gp", "one_foot", "forward"};
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  const auto file = std::filesystem::directory_iterator(folder)->path();
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  std::ofstream(file) << "damaged";
  EXPECT_EQ(cachedTable(c.problem, label, folder).values(), c.table.values());
  EXPECT_EQ(std::filesystem::file_size(file), c.bytes.size());
}

TEST(PoseSolver, PutsPartsAndComWhereTheyShouldBe) {
  const auto falls = fallsOf("atlas");
  const SagittalBody body(modelOf(*falls), falls->setup("two_feet", "forward"));
  PoseSolver solver(body, *falls);
  const sim::State stance = body.model()->stateOf(falls->robot->poses.at("two_feet"));
  const ContactGraph& graph = body.setup().graph;
  ASSERT_EQ(graph.nodes[1].name, "knees");
  double error = 0;
  const sim::State pose = solver.solve({{0, Vector2d::Zero()}, {1, Vector2d(0.35, 0)}},
                                       Vector2d(0.3, 0.7), stance, &error);
  sim::World world(body.model());
  world.reset(pose);
  const Vector2d from = body.node(world.snapshot(), 0);
  EXPECT_LT(error, 0.1);
  EXPECT_NEAR((body.node(world.snapshot(), 1) - from - Vector2d(0.35, 0)).norm(), 0, 0.1);
  EXPECT_NEAR((body.com(world.snapshot()) - from - Vector2d(0.3, 0.7)).norm(), 0, 0.1);
  for (const sim::Joint& j : body.model()->joints()) {
    EXPECT_GE(pose.q[j.q], j.limit.min - 1e-9) << j.name;
    EXPECT_LE(pose.q[j.q], j.limit.max + 1e-9) << j.name;
  }
}

TEST(FallRobot, GraphsAreToldWhatTheyLack) {
  const auto with = [](const std::string& graph) { return complaint(kHead + graph); };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(with("feet = { points = [], next = [\"hands\"] }\nhands = { points = [\"left_hand\"] }\n"),
      "\"feet\" has no contact point");
  has(with("feet = { points = [\"left_toe\"], next = [\"hands\"], nxt = 1 }\n"
           "hands = { points = [\"left_hand\"] }\n"),
      "nxt");
  has(with("feet = { points = [\"left_toe\"], next = [\"hands\"] }\n"
           "hands = { points = [\"left_hand\"], next = [\"feet\"] }\n"),
      "a fall along feet -> hands -> feet need not end");
  for (const char* nowhere : {"", "feet = { points = [\"left_toe\"] }\n",
                              "feet = { points = [\"left_toe\"], next = [] }\n"}) {
    has(with(nowhere), "expected a first node, what the robot stands on, with a \"next\"");
  }
  const std::string text = std::string(kHead) + kGraph;
  has(complaint(text.substr(0, text.find("[[fall]]"))), "expected at least one [[fall]]");
  has(complaintWith("rampp = 1", "[[fall]]"), "Did you mean \"ramp\"?");
  has(complaintWith("stand = true", "[fall.graph]"), "Did you mean \"stands\"?");
  has(complaintWith("without.feet = { stiffness = 1 }", "[fall.graph]"),
      "no node \"feet\" to leave out. There is: hands");
  // Its bodies are those of the robot, all of them.
  const auto push = [&](const std::string& body) {
    std::string other = text;
    return complaint(other.replace(other.find("utorso"), 6, body));
  };
  has(push("world"), "no body \"world\"");
  const auto model = modelOf(*fallsOf("atlas"));
  EXPECT_EQ(push(model->bodyName({1})), "");
  EXPECT_EQ(push(model->bodyName({model->bodies() - 1})), "");
  // As many ways as there are, each node is gone through once.
  std::string many = "a0 = { points = [\"left_toe\"], next = [\"a1\", \"b1\"] }\n";
  for (int i = 1; i < 40; ++i) {
    for (const char* name : {"a", "b"}) {
      many += fmt::format("{}{} = {{ points = [\"left_hand\"], next = [\"a{}\", \"b{}\"] }}\n",
                          name, i, i + 1, i + 1);
    }
  }
  EXPECT_EQ(with(many + "a40 = { points = [\"head\"] }\nb40 = { points = [\"head\"] }\n"), "");
  EXPECT_EQ(complaintWith("damping = -1", "[[fall]]").find('\n'),
            complaintWith("damping = -1", "[[fall]]").rfind('\n'));
}

TEST(FallRobot, SaysWhatThereIsToLeaveOutAndToFall) {
  const auto falls = fallsOf("bioloid-gp");
  const FallSetup& setup = falls->setup("one_foot", "forward");
  const auto message = [](const auto& of) -> std::string {
    try {
      of();
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(message([&] { setup.without("right-toes"); }),
            "one_foot forward: cannot leave out \"right-toes\": expected one of left-heel, "
            "left-toes, hands, head, right-heel");
  FallSetup head = setup;
  for (const char* node : {"left-heel", "left-toes", "hands"}) head = head.without(node);
  EXPECT_EQ(message([&] { head.without("head"); }),
            "one_foot forward: cannot leave out \"head\": nothing else follows \"right-toes\"");
  EXPECT_EQ(message([&] { fallsOf("atlas")->setup("two_feet", "left"); }),
            "atlas has no fall \"two_feet left\". There is: one_foot forward, two_feet forward, "
            "two_feet backward");
}

/// A robot whose parts are elsewhere than its file says.
FallRobot changed(const FallRobot& falls, const std::function<void(sim::Robot&)>& change) {
  sim::Robot robot = *falls.robot;
  change(robot);
  FallRobot other = falls;
  other.robot = std::make_shared<const sim::Robot>(robot);
  return other;
}

TEST(FallRobot, MovesJointsWithinWhatBothFilesAllow) {
  const auto falls = fallsOf("bioloid-gp");
  const auto moved = [&](const FallRobot& of) {
    const SagittalBody body(modelOf(of), of.setup("one_foot", "forward"));
    std::map<std::string, MovedJoint> joints;
    for (const MovedJoint& j : movedJoints(body, of)) joints[j.name] = j;
    return joints;
  };
  FallRobot some = *falls;
  some.joints = {"l_thigh", "shin", "shoulder"};
  some.ranges = {{"l_thigh", {-9, 9}}, {"l_shoulder", {-0.5, 0.5}}, {"r_shoulder", {-0.5, 0.5}}};
  const auto joints = moved(some);
  // A leg of its own, two that stand on different parts, arms that move alike.
  ASSERT_EQ(joints.size(), 4U);
  for (const char* name : {"l_thigh", "l_shin", "r_shin"}) {
    EXPECT_EQ(joints.at(name).other, "");
    EXPECT_EQ(joints.at(name).sign, 1);
    EXPECT_EQ(joints.at(name).min, -2.618);
    EXPECT_EQ(joints.at(name).max, 2.618);
  }
  EXPECT_EQ(joints.at("l_shoulder").other, "r_shoulder");
  EXPECT_EQ(joints.at("l_shoulder").min, -0.5);
  EXPECT_EQ(joints.at("l_shoulder").max, 0.5);
  const auto complaint_of = [&](const FallRobot& of) -> std::string {
    try {
      moved(of);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  for (const auto& range : {std::pair(2.618, 3.0), std::pair(-3.0, -2.618)}) {
    some.ranges = {{"l_thigh", range}};
    EXPECT_NE(complaint_of(some).find("is outside of its limits, -2.618 to 2.618 rad"),
              std::string::npos);
  }
  some.ranges.clear();
  for (const bool upper : {false, true}) {
    const FallRobot endless = changed(some, [&](sim::Robot& robot) {
      (upper ? robot.limits.at("l_thigh").max : robot.limits.at("l_thigh").min) =
          (upper ? 1 : -1) * std::numeric_limits<double>::infinity();
    });
    EXPECT_NE(complaint_of(endless).find("the joint l_thigh has no limits"), std::string::npos);
  }
}

TEST(FallProblem, IsTheStancesAndTheFiles) {
  for (const auto& [name, stance, direction] : {std::tuple("atlas", "two_feet", "backward"),
                                                std::tuple("bioloid-gp", "one_foot", "forward")}) {
    FallRobot falls = *fallsOf(name);
    falls.least_interval = 0.07;
    const SagittalBody body(modelOf(falls), falls.setup(stance, direction));
    const FallProblem p = fallProblem(
        body, falls,
        {.post_impact = PostImpact::kSticking, .stall = Stall::kLiteral, .poses = 300, .seed = 5});
    const sim::State state = body.model()->stateOf(falls.robot->poses.at(stance));
    sim::World world(body.model());
    world.reset(state);
    const sim::Snapshot& s = world.snapshot();
    EXPECT_EQ(p.model.mass, body.model()->mass());
    EXPECT_EQ(p.model.inertia, body.inertia(state));
    EXPECT_EQ(p.model.post_impact, PostImpact::kSticking);
    EXPECT_EQ(p.stall, Stall::kLiteral);
    EXPECT_EQ(p.rod_speed, body.setup().quick.rod_speed);
    EXPECT_EQ(p.stopper_speed, body.setup().quick.stopper_speed);
    EXPECT_EQ(p.least_interval, 0.07);
    EXPECT_EQ(p.graph.edges, body.setup().graph.edges);
    const double r1 = (body.com(s) - body.node(s, 0)).norm();
    EXPECT_NEAR(p.grid.time, std::sqrt(r1 / 9.81) / 8, p.model.step / 2);
    EXPECT_NEAR(std::remainder(p.grid.time, p.model.step), 0, 1e-12);
    std::vector<std::pair<double, double>> lengths;
    const ReachTables reach =
        sampleReach(body, falls, {.poses = 300, .seed = 5, .cell = r1 / 20}, &lengths);
    EXPECT_EQ(p.lengths, lengths);
    for (size_t i = 0; i < p.graph.nodes.size(); ++i) {
      ASSERT_EQ(p.reach[i].size(), p.graph.edges[i].size());
      ASSERT_EQ(p.first_angle[i].size(), p.graph.edges[i].size());
      for (size_t e = 0; e < p.reach[i].size(); ++e) {
        EXPECT_EQ(p.reach[i][e].marked(), reach[i][e].marked());
        EXPECT_EQ(p.first_angle[i][e],
                  body.stopperAngle(s, static_cast<int>(i), p.graph.edges[i][e]));
      }
    }
    // A pose that is held has all contact points but those it stands on.
    for (const int pivot : {0, 1}) {
      std::set<std::string> parts;
      for (const HeldPart& part : heldParts(body, s, pivot)) {
        parts.insert(part.name);
        EXPECT_LE(std::abs(part.theta2), std::numbers::pi);
      }
      for (const auto& [point, unused] : falls.robot->contacts) {
        const auto& on = p.graph.nodes[pivot].points;
        EXPECT_EQ(parts.contains(point), std::find(on.begin(), on.end(), point) == on.end());
      }
    }
  }
}

TEST(SagittalBody, ItsInertiaIsOfThePoseAlone) {
  const auto falls = fallsOf("atlas");
  const SagittalBody body(modelOf(*falls), falls->setup("two_feet", "forward"));
  const sim::State stance = body.model()->stateOf(falls->robot->poses.at("two_feet"));
  const double inertia = body.inertia(stance);
  sim::State other = stance;
  other.v.setLinSpaced(-1, 2);
  const Eigen::Quaterniond pitched(
      Eigen::AngleAxisd(0.7, sim::Vector3d::UnitY()) *
      Eigen::Quaterniond(stance.q[3], stance.q[4], stance.q[5], stance.q[6]));
  other.q.segment<4>(3) << pitched.w(), pitched.x(), pitched.y(), pitched.z();
  EXPECT_NEAR(body.inertia(other), inertia, 1e-9 * inertia);
}

TEST(SagittalBody, APartIsTheNearestPointOrElseTheBody) {
  const auto falls = fallsOf("bioloid-gp");
  const SagittalBody body(modelOf(*falls), falls->setup("one_foot", "forward"));
  sim::World world(body.model());
  sim::State state = body.model()->stateOf(falls->robot->poses.at("crouch"));
  world.reset(state);
  const sim::Snapshot& s = world.snapshot();
  const sim::BodyId foot = body.model()->body("l_foot");
  const sim::Vector3d toe = body.point(s, "left_toe");
  const sim::Vector3d heel = body.point(s, "left_heel");
  EXPECT_EQ(body.partAt(s, foot, 0.45 * toe + 0.55 * heel), "left_heel");
  EXPECT_EQ(body.partAt(s, foot, 0.55 * toe + 0.45 * heel), "left_toe");
  EXPECT_EQ(body.partAt(s, body.model()->body("l_thigh"), toe), "l_thigh");
}

TEST(ReachTable, IsMarkedByRandomPosesOfTheJointsThatMove) {
  for (const auto& [name, setup] : {std::pair("atlas", 2), std::pair("bioloid-gp", 0)}) {
    const auto falls = fallsOf(name);
    const SagittalBody body(modelOf(*falls), falls->setups[setup]);
    const sim::Model& model = *body.model();
    const ReachOptions options{.poses = 60, .seed = 9, .cell = 0.03};
    std::vector<std::pair<double, double>> lengths;
    const ReachTables tables = sampleReach(body, *falls, options, &lengths);
    const ContactGraph& graph = body.setup().graph;
    struct Stopper {
      size_t node, edge;
      double r1, r2, theta2;
    };
    std::vector<Stopper> stoppers;
    std::vector<std::pair<double, double>> seen(graph.nodes.size(), {1e9, 0});
    double longest = 0;
    sim::World world(body.model());
    for (int k = 0; k < options.poses; ++k) {
      Random random(options.seed, 0, k);
      sim::State pose = model.stateOf(falls->robot->poses.at(body.setup().stance));
      for (const MovedJoint& j : movedJoints(body, *falls)) {
        const double angle = random.uniform(j.min, j.max);
        pose.q[model.joint(j.name).q] = angle;
        if (!j.other.empty()) pose.q[model.joint(j.other).q] = j.sign * angle;
      }
      world.place(pose);
      const sim::Snapshot& s = world.snapshot();
      for (size_t i = 0; i < graph.nodes.size(); ++i) {
        const auto node = static_cast<int>(i);
        const double r1 = (body.node(s, node) - body.com(s)).norm();
        seen[i] = {std::min(seen[i].first, r1), std::max(seen[i].second, r1)};
        for (size_t e = 0; e < graph.edges[i].size(); ++e) {
          const int to = graph.edges[i][e];
          const double r2 = (body.node(s, to) - body.com(s)).norm();
          stoppers.push_back({i, e, r1, r2, body.stopperAngle(s, node, to)});
          longest = std::max({longest, r1, r2});
        }
      }
    }
    EXPECT_EQ(lengths, seen);
    ASSERT_EQ(tables.size(), graph.nodes.size());
    for (size_t i = 0; i < tables.size(); ++i) {
      ASSERT_EQ(tables[i].size(), graph.edges[i].size());
      for (size_t e = 0; e < tables[i].size(); ++e) {
        ReachTable expected(options.cell, longest);
        for (const Stopper& s : stoppers) {
          if (s.node == i && s.edge == e) expected.mark(s.r1, s.r2, s.theta2);
        }
        EXPECT_EQ(tables[i][e].cells(), static_cast<int>(std::ceil(longest / options.cell)) + 2);
        EXPECT_EQ(tables[i][e].marked(), expected.marked());
      }
    }
  }
}

TEST(PoseSolver, FindsAPoseThatNoSmallMoveBetters) {
  for (const auto& [name, setup] :
       {std::pair("atlas", 0), std::pair("atlas", 2), std::pair("bioloid-gp", 0)}) {
    const auto falls = fallsOf(name);
    const SagittalBody body(modelOf(*falls), falls->setups[setup]);
    const sim::Model& model = *body.model();
    PoseSolver solver(body, *falls);
    const sim::State stance = model.stateOf(falls->robot->poses.at(body.setup().stance));
    sim::World world(body.model());
    world.place(stance);
    const double height = body.com(world.snapshot()).y();
    const std::vector<MovedJoint> joints = movedJoints(body, *falls);
    sim::State from = stance;  // from another pose, turned, beyond some of the limits
    for (size_t i = 0; i < joints.size(); ++i) {
      double& q = from.q[model.joint(joints[i].name).q];
      q = i % 3 == 0 ? q + 0.15 : i % 3 == 1 ? joints[i].min - 0.1 : joints[i].max + 0.1;
    }
    const Eigen::Quaterniond turned =
        Eigen::AngleAxisd(0.2, sim::Vector3d::UnitY()) *
        Eigen::Quaterniond(stance.q[3], stance.q[4], stance.q[5], stance.q[6]);
    from.q.segment<4>(3) << turned.w(), turned.x(), turned.y(), turned.z();
    const std::vector<PoseSolver::Goal> goals = {{0, height * Vector2d(0.1, 0.02), 1},
                                                 {1, height * Vector2d(0.45, -0.02), 0.8},
                                                 {2, height * Vector2d(0.9, 0.1), 0.5}};
    const Vector2d com = height * Vector2d(0.4, 0.7);
    // In units of the height: Eq. 19, and with what is ours.
    const auto cost = [&](const sim::State& pose, bool whole) {
      world.place(pose);
      const sim::Snapshot& s = world.snapshot();
      double sum = (body.com(s) - com).squaredNorm();
      for (const PoseSolver::Goal& g : goals) {
        sum += g.weight * (body.node(s, g.node) - g.place).squaredNorm();
      }
      if (whole) {
        for (const auto& [point, unused] : falls->robot->contacts) {
          sum += 10 * std::pow(std::min(body.point(s, point).z(), 0.0), 2);
        }
        for (const MovedJoint& j : joints) {
          const int q = model.joint(j.name).q;
          sum += 1e-3 * std::pow(height * (pose.q[q] - std::clamp(from.q[q], j.min, j.max)), 2);
        }
      }
      return sum / (height * height);
    };
    double error = 0;
    const sim::State pose = solver.solve(goals, com, from, &error);
    EXPECT_NEAR(error, std::sqrt(cost(pose, false)) * height, 1e-9);
    sim::State others = stance;
    for (const MovedJoint& j : joints) {
      const int q = model.joint(j.name).q;
      EXPECT_GE(pose.q[q], j.min) << j.name;
      EXPECT_LE(pose.q[q], j.max) << j.name;
      others.q[q] = pose.q[q];
      if (j.other.empty()) continue;
      EXPECT_EQ(pose.q[model.joint(j.other).q], j.sign * pose.q[q]) << j.other;
      others.q[model.joint(j.other).q] = j.sign * pose.q[q];
    }
    others.q.head<7>() = pose.q.head<7>();
    EXPECT_EQ(pose.q, others.q);
    EXPECT_EQ(pose.q[1], 0);
    const double best = cost(pose, true);
    for (const double by : {-0.01, 0.01}) {
      const auto worse = [&, who = name, fall = setup](const sim::State& moved,
                                                       const std::string& what) {
        EXPECT_GT(cost(moved, true), best - 1e-7) << who << fall << " " << what << by;
      };
      sim::State moved = pose;
      moved.q[0] += by * height;
      worse(moved, "x");
      moved = pose;
      moved.q[2] += by * height;
      worse(moved, "z");
      moved = pose;
      const Eigen::Quaterniond pitched =
          Eigen::AngleAxisd(by, sim::Vector3d::UnitY()) *
          Eigen::Quaterniond(pose.q[3], pose.q[4], pose.q[5], pose.q[6]);
      moved.q.segment<4>(3) << pitched.w(), pitched.x(), pitched.y(), pitched.z();
      worse(moved, "pitch");
      for (const MovedJoint& j : joints) {
        moved = pose;
        double& q = moved.q[model.joint(j.name).q];
        q = std::clamp(q + by, j.min, j.max);
        if (!j.other.empty()) moved.q[model.joint(j.other).q] = j.sign * q;
        worse(moved, j.name);
      }
    }
  }
}

TEST(FallExperiment, APlanHalvesTheImpulseOfASmallRobotAndTheSameTwice) {
  const auto falls = fallsOf("bioloid-gp");
  FallExperiment experiment(falls, falls->setup("one_foot", "forward"), withPoses(3000));
  const FallTrial held = experiment.run({1.5}, "hold").trial;
  const FallExperiment::Outcome planned = experiment.run({1.5}, "planned");
  ASSERT_TRUE(held.fell && planned.trial.fell);
  EXPECT_FALSE(held.diverged || planned.trial.diverged);
  EXPECT_LT(planned.trial.impulse, 0.6 * held.impulse);
  EXPECT_FALSE(planned.plan.contacts.empty());
  EXPECT_EQ(experiment.run({1.5}, "planned").trial.impulse, planned.trial.impulse);
  // A robot that lies still presses with its weight: the window's impulse is m g times it.
  const double rest = held.windowed.back().second;
  EXPECT_NEAR(rest, 1.6 * 9.81 * 0.01, 0.05);
}

TEST(FallSimulator, WhatIsMeasuredFitsTogether) {
  const auto falls = fallsOf("bioloid-gp");
  FallSimulator simulator(*falls, falls->setup("one_foot", "forward"));
  const FallProtocol protocol;
  for (const std::string strategy : {"hold", "limp"}) {
    sim::Recording recording;
    const FallTrial t = simulator.run({1.5}, strategy, {}, {.recording = &recording});
    ASSERT_TRUE(t.fell);
    EXPECT_GE(t.noticed, 0.1);  // not before the push is over
    // Impulses.
    EXPECT_DOUBLE_EQ(t.raw_impulse, t.peak_force * protocol.time_step);
    EXPECT_GE(t.impulse, t.raw_impulse);
    EXPECT_LE(t.impulse, t.peak_force * protocol.window);
    double windowed = 0;
    for (size_t i = 0; i < t.windowed.size(); ++i) {
      windowed = std::max(windowed, t.windowed[i].second);
      EXPECT_GE(t.windowed[i].second, -1e-12);
      EXPECT_NEAR(t.windowed[i].first - t.windowed[0].first, 0.001 * static_cast<double>(i), 1e-9);
    }
    EXPECT_LE(windowed, t.impulse);
    EXPECT_GT(windowed, 0.9 * t.impulse);
    // Contacts, each part once and in their order.
    ASSERT_FALSE(t.contacts.empty());
    std::set<std::string> parts;
    double largest = 0;
    double before = 0;
    for (const GroundContact& c : t.contacts) {
      EXPECT_TRUE(parts.insert(c.part).second) << c.part;
      EXPECT_GE(c.time, before);
      EXPECT_GE(c.impulse, 0);
      before = c.time;
      largest = std::max(largest, c.impulse);
    }
    EXPECT_EQ(largest, t.impulse);
    EXPECT_EQ(t.head_hit, parts.contains(falls->head));
    EXPECT_GT(t.peak_head, 0);
    // The COM from the pivot on, every 10 ms of what is left; frames of all, from the stance on.
    EXPECT_EQ(t.com.size(), 250U);
    EXPECT_NEAR(t.com[0].x(), t.start.pendulum.com().x(), 1e-12);
    EXPECT_GT(t.com.back().x(), 0.05);
    for (size_t i = 0; i < recording.frames.size(); ++i) {
      EXPECT_NEAR(recording.frames[i].state.time, 0.01 * static_cast<double>(i), 1e-9);
    }
    EXPECT_NEAR(recording.frames.back().state.time, t.noticed + protocol.settle, 0.0101);
    EXPECT_EQ(recording.phases, std::vector<std::string>({"push", strategy}));
    for (const sim::Frame& f : recording.frames) {
      EXPECT_EQ(f.phase, f.state.time < t.noticed - 1e-9 ? 0 : 1);
      if (strategy == "limp" && f.state.time > t.noticed + 0.001) {
        EXPECT_EQ(f.torque.norm(), 0);
      }
    }
    EXPECT_GT(t.peak_torque, 0);  // until then the stance is kept
    EXPECT_LE(t.peak_torque, 1);
  }
}

TEST(FallExperiment, SupportKeepsTheLegsFromGivingWay) {
  FallRobot falls = *fallsOf("atlas");
  const auto late = [&](double support) {  // the knees, against the plan [s]
    falls.tracking.support = support;
    FallExperiment experiment(std::make_shared<const FallRobot>(falls),
                              falls.setup("two_feet", "forward"), withPoses(3000));
    const FallExperiment::Outcome outcome = experiment.run({1500}, "planned");
    const PlannedContact& first = outcome.plan.contacts.front();
    EXPECT_EQ(experiment.problem().graph.nodes[first.action.contact].name, "knees");
    for (const GroundContact& c : outcome.trial.contacts) {
      if (c.part.ends_with("knee")) return c.time - outcome.trial.noticed - first.action.duration;
    }
    ADD_FAILURE() << "no knee touched";
    return 0.0;
  };
  const double given_way = late(0);
  const double borne = late(1);
  EXPECT_LT(given_way, -0.2);
  EXPECT_GT(borne, given_way + 0.05);  // not on time either: the knees are at their limit
}

TEST(FallExperiment, APlanThatCostsMoreThanKeepingThePoseIsNotFollowed) {
  // Once it sits, all that is left to plan is to throw the arms behind its back, for more than the
  // back costs that follows anyway. By that plan the fall ends at 0.66 of unplanned.
  const auto falls = fallsOf("atlas");
  FallExperiment experiment(falls, falls->setup("two_feet", "backward"));
  const double held = experiment.run({364}, "hold").trial.impulse;
  const FallTrial trial = experiment.run({364}, "planned").trial;
  ASSERT_GE(trial.contacts.size(), 2U);
  EXPECT_EQ(trial.contacts[0].part, "hips");
  EXPECT_EQ(trial.contacts[1].part, "back");
  EXPECT_LT(trial.impulse, 0.6 * held);
}

TEST(FallExperiment, NothingAsksMoreOfAJointThanItHas) {
  for (const auto& [robot, push] : {std::pair{"atlas", 2000.0}, std::pair{"bioloid-gp", 5.0}}) {
    const auto falls = fallsOf(robot);
    FallExperiment experiment(falls, falls->setups.front(), withPoses(2000));
    for (const std::string strategy : {"planned", "hold", "damp", "tuck"}) {
      const FallTrial trial = experiment.run({push}, strategy).trial;
      EXPECT_LE(trial.peak_torque, 1) << robot << " " << strategy;
      EXPECT_GT(trial.peak_torque, 0.1) << robot << " " << strategy;
    }
  }
}

TEST(FallExperiment, APushTooWeakMakesNoFall) {
  const auto falls = fallsOf("atlas");
  FallExperiment experiment(falls, falls->setup("two_feet", "forward"), withPoses(200));
  EXPECT_FALSE(experiment.run({50}, "hold").trial.fell);
}

TEST(FallExperiment, RefusesAStanceThatCannotStand) {
  auto falls = std::make_shared<FallRobot>(FallRobot::fromFile("models/bioloid-gp/falls.toml"));
  FallSetup setup = falls->setup("one_foot", "forward");
  setup.stands = true;
  EXPECT_THROW(FallExperiment(falls, setup, withPoses(10)), InputError);
  setup.graph.nodes[0].points = {"left_hand"};
  EXPECT_THROW(FallExperiment(falls, setup, withPoses(10)), InputError);
}

}  // namespace
}  // namespace traceur::fall
