// What falls.toml may say.
#include "traceur/fall/fall_testing.h"

namespace traceur::fall {
namespace {

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

/// A robot whose parts are elsewhere than its file says.
FallRobot changed(const FallRobot& falls, const std::function<void(sim::Robot&)>& change) {
  sim::Robot robot = *falls.robot;
  change(robot);
  FallRobot other = falls;
  other.robot = std::make_shared<const sim::Robot>(robot);
  return other;
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

}  // namespace
}  // namespace traceur::fall
