#include "traceur/control/pose_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace traceur::control {
namespace {

using sim::Vector3d;

class RobotBench {
 public:
  std::shared_ptr<const sim::Model> model =
      sim::Model::fromScene({.robot = std::make_shared<const sim::Robot>(
                                 sim::Robot::fromFile("models/bioloid-gp/robot.toml"))});
  sim::State stand = model->stateOf(model->robot()->poses.at("stand"));
  VectorXd wanted;
  sim::World world{model};

  RobotBench() : wanted(model->joints().size()) {
    for (size_t i = 0; i < model->joints().size(); ++i) {
      wanted[static_cast<Eigen::Index>(i)] = stand.q[model->joints()[i].q];
    }
  }
  std::vector<int> all() const {
    std::vector<int> joints;
    for (size_t i = 0; i < model->joints().size(); ++i) joints.push_back(static_cast<int>(i));
    return joints;
  }
  Place body(const char* name) const { return {.points = {{model->body(name)}}}; }
  const sim::Snapshot& at(const sim::State& pose) {
    world.place(pose);
    return world.snapshot();
  }
  /// The feet stay as they are.
  std::vector<PoseGoal> feet() {
    std::vector<PoseGoal> goals;
    for (const char* foot : {"l_foot", "r_foot"}) {
      const Vector3d p = at(stand).bodyPosition(model->body(foot));
      goals.push_back({.of = body(foot),
                       .x = p.x(),
                       .y = p.y(),
                       .z = p.z(),
                       .attitude = world.snapshot().bodyRotation(model->body(foot))});
    }
    return goals;
  }
};

TEST(PoseSolver, PutsTheComWhereItShouldBeOverFeetThatStay) {
  RobotBench b;
  std::vector<PoseGoal> goals = b.feet();
  const Vector3d com = b.at(b.stand).com();
  goals.push_back(
      {.of = {.com = true}, .x = com.x() + 0.01, .y = com.y() - 0.02, .z = com.z() - 0.03});
  double error = 1;
  const sim::State pose = PoseSolver(b.model, b.all()).solve(goals, b.stand, b.wanted, &error);
  EXPECT_LT(error, 3e-4);
  const sim::Snapshot& s = b.at(pose);
  EXPECT_LT((s.com() - com - Vector3d(0.01, -0.02, -0.03)).norm(), 3e-4);
  for (size_t i = 0; i < 2; ++i) {
    const sim::BodyId foot = goals[i].of.points[0].body;
    EXPECT_LT((s.bodyPosition(foot) - Vector3d(*goals[i].x, *goals[i].y, *goals[i].z)).norm(),
              3e-4);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(*goals[i].attitude * s.bodyRotation(foot).transpose()));
    EXPECT_LT(turn.angle(), 1e-3);
  }
  for (const sim::Joint& j : b.model->joints()) {
    EXPECT_GE(pose.q[j.q], j.limit.min);
    EXPECT_LE(pose.q[j.q], j.limit.max);
  }
}

TEST(PoseSolver, WithoutGoalsItTakesThePoseThatIsWanted) {
  RobotBench b;
  VectorXd other = b.wanted;
  other[b.all()[3]] += 0.4;
  const sim::State pose = PoseSolver(b.model, b.all()).solve({}, b.stand, other);
  EXPECT_NEAR(pose.q[b.model->joints()[3].q], other[3], 1e-6);
  EXPECT_LT((pose.q.head<7>() - b.stand.q.head<7>()).norm(), 1e-9);
}

TEST(PoseSolver, MovesOnlyWhatMayMove) {
  RobotBench b;
  const int hand = b.model->joint("l_hand").v - 6;
  const int arm = b.model->joint("l_shoulder").v - 6;
  ASSERT_EQ(b.model->joints()[hand].name, "l_hand");
  std::vector<PoseGoal> goals = b.feet();
  goals.push_back(
      {.of = {.points = {b.model->contactPoint("left_hand")}}, .from = b.body("torso"), .z = 0.05});
  double error = 1;
  const sim::State pose = PoseSolver(b.model, {arm, hand}).solve(goals, b.stand, b.wanted, &error);
  EXPECT_LT(error, 1e-3);
  for (const sim::Joint& j : b.model->joints()) {
    if (j.name == "l_hand" || j.name == "l_shoulder") continue;
    EXPECT_EQ(pose.q[j.q], b.stand.q[j.q]) << j.name;
  }
  const sim::Snapshot& s = b.at(pose);
  EXPECT_NEAR(s.position(b.model->contactPoint("left_hand")).z() -
                  s.bodyPosition(b.model->body("torso")).z(),
              0.05, 1e-3);
}

TEST(PoseSolver, ReachesADistanceAndSaysWhatIsLeftOfOneItCannot) {
  RobotBench b;
  PoseSolver solver(b.model, b.all());
  const auto apart = [&](double distance, double* error) {
    const sim::State pose =
        solver.solve({{.of = b.body("l_hand"), .from = b.body("r_hand"), .distance = distance}},
                     b.stand, b.wanted, error);
    const sim::Snapshot& s = b.at(pose);
    return (s.bodyPosition(b.model->body("l_hand")) - s.bodyPosition(b.model->body("r_hand")))
        .norm();
  };
  double error = 1;
  EXPECT_NEAR(apart(0.2, &error), 0.2, 1e-3);
  EXPECT_LT(error, 1e-3);
  const double most = apart(2, &error);
  EXPECT_LT(most, 1);  // arms are not longer
  EXPECT_NEAR(error, 2 - most, 1e-6);
}

TEST(PoseSolver, HeavierGoalsAreMissedByLess) {
  RobotBench b;
  const Vector3d p = b.at(b.stand).bodyPosition(b.model->body("torso"));
  const auto height = [&](double weight) {
    const sim::State pose = PoseSolver(b.model, b.all())
                                .solve({{.of = b.body("torso"), .z = p.z(), .weight = weight},
                                        {.of = b.body("torso"), .z = p.z() + 1}},
                                       b.stand, b.wanted);
    return b.at(pose).bodyPosition(b.model->body("torso")).z() - p.z();
  };
  EXPECT_NEAR(height(1), 0.5, 1e-3);
  EXPECT_NEAR(height(3), 0.25, 1e-3);
}

TEST(PoseSolver, EqualArgumentsGiveEqualBits) {
  RobotBench b;
  std::vector<PoseGoal> goals = b.feet();
  goals.push_back({.of = {.com = true}, .z = 0.15});
  PoseSolver used(b.model, b.all());
  const sim::State first = used.solve(goals, b.stand, b.wanted);
  used.solve({}, b.stand, b.wanted);
  EXPECT_EQ(used.solve(goals, b.stand, b.wanted).q, first.q);
  EXPECT_EQ(PoseSolver(b.model, b.all()).solve(goals, b.stand, b.wanted).q, first.q);
}

}  // namespace
}  // namespace traceur::control
