// A robot in the plane of its fall: as a pendulum, what it can reach, and poses in it.
#include "traceur/fall/fall_testing.h"

namespace traceur::fall {
namespace {

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

}  // namespace
}  // namespace traceur::fall
