// Falls held against a simulation of the test's own: what is measured and what is done when, by the
// words of fall_trial.h alone.
#include "traceur/fall/fall_trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "traceur/control/stable_pd.h"
#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/fall/fall_problem.h"
#include "traceur/fall/plan_library.h"

namespace traceur::fall {
namespace {

using Eigen::VectorXd;
using sim::Matrix3d;
using sim::Vector3d;

constexpr double kG = 9.81;

FallRobot readFalls(const std::string& robot) {
  return FallRobot::fromFile("models/" + robot + "/falls.toml");
}

/// A robot in its stance, and all that is read of it step by step.
struct ByHand {
  ByHand(const FallRobot& robot, const FallSetup& setup, const FallProtocol& with)
      : falls(robot),
        protocol(with),
        model(sim::Model::fromScene({.robot = falls.robot,
                                     .ground_material = protocol.ground,
                                     .time_step = protocol.time_step})),
        body(model, setup),
        world(model),
        s(world.snapshot()),
        pd(control::defaultController(model)),
        stance(model->stateOf(falls.robot->poses.at(setup.stance))),
        held(control::targetOf(*model, stance)),
        window(std::max(1, stepsIn(protocol.window))) {
    for (const std::string& point : setup.graph.nodes[0].points) {
      own.insert(model->body(falls.robot->contacts.at(point).body).value);
    }
    world.reset(stance);
  }

  int stepsIn(double duration) const {
    return static_cast<int>(std::lround(duration / protocol.time_step));
  }
  bool falling(int node) const {
    const Vector2d at = body.com(s);
    return at.x() + body.comVelocity(s).x() * std::sqrt(at.y() / kG) > body.node(s, node).x();
  }

  /// @param act  adds the torques once the fall has been noticed
  void run(const Push& push, const std::function<void(VectorXd&)>& act) {
    const int pushed = stepsIn(push.duration);
    VectorXd tau(model->nv());
    sim::Torque command{VectorXd::Zero(model->nu())};
    const double edge = body.node(s, 0).x();
    world.push(model->body(falls.push_body), {body.setup().sign() * push.force, 0, 0});
    for (int k = 0; k < 5000; ++k) {
      if (k > 0) read(k);
      com.push_back(body.com(s));
      if (noticed < 0 && k >= pushed &&
          com[k].x() + body.comVelocity(s).x() * std::sqrt(com[k].y() / kG) > edge) {
        noticed = k;
        start = body.pendulum(s, 0);
        pivot = body.node(s, 0).x();
      }
      if (noticed >= 0 && k == noticed + stepsIn(protocol.settle)) return;
      if (k == pushed) world.push(model->body(falls.push_body), Vector3d::Zero());
      tau.setZero();
      if (noticed < 0) {
        pd.addTorque(s, held, tau);
      } else {
        act(tau);
      }
      control::toMotors(*model, tau, command);
      for (const sim::Joint& j : model->joints()) {
        share = std::max(share, std::abs(command.tau[j.motor]) / j.limit.torque);
      }
      world.step(command);
    }
    FAIL() << "no fall";
  }

  void read(int k) {
    double up = 0;
    std::set<int> down;
    now.clear();
    for (const sim::Contact& c : s.contacts()) {
      if (model->isRobot(c.body_a) == model->isRobot(c.body_b)) continue;
      EXPECT_TRUE(model->isRobot(c.body_b));  // the ground comes first
      const std::string part = body.partAt(s, c.body_b, c.p_WC);
      now.insert(part);
      down.insert(c.body_b.value);
      if (own.contains(c.body_b.value)) continue;
      up += c.f_WC.z();
      if (std::none_of(touched.begin(), touched.end(),
                       [&](const auto& t) { return t.first == part; })) {
        touched.emplace_back(part, k);
      }
    }
    for (int b = 0; b < model->bodies(); ++b) {
      away[b] = down.contains(b) ? 0 : away[b] + 1;
      if (away[b] >= window) own.erase(b);
    }
    time.push_back(s.time());
    force.push_back(up);
    const sim::ContactPoint& point = falls.robot->contacts.at(falls.head);
    sim::Matrix3Xd J = sim::Matrix3Xd::Zero(3, model->nv());
    s.pointJacobian(model->body(point.body), point.p_BP, J);
    head.emplace_back(J * s.v());
  }

  /// What a trial of the same says.
  void expectSame(const FallTrial& t) const {
    const double h = protocol.time_step;
    ASSERT_TRUE(t.fell);
    EXPECT_FALSE(t.diverged);
    EXPECT_NEAR(t.noticed, noticed * h, 1e-9);
    EXPECT_EQ(t.start.contact, 0);
    EXPECT_EQ(t.start.time, 0);
    EXPECT_NEAR(t.start.pendulum.theta, start.theta, 1e-9);
    EXPECT_NEAR(t.start.pendulum.theta_rate, start.theta_rate, 1e-9);
    const int n = static_cast<int>(force.size());  // the i-th is after step i + 1
    std::vector<double> windowed(n);
    double jolt = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = std::max(0, i - window + 1); j <= i; ++j) windowed[i] += h * force[j];
      if (i >= window) jolt = std::max(jolt, (head[i] - head[i - window]).norm() / (window * h));
    }
    const auto near = [](double is, double should) {
      EXPECT_NEAR(is, should, 1e-6 * (1 + std::abs(should)));
    };
    near(t.impulse, *std::max_element(windowed.begin(), windowed.end()));
    near(t.peak_force, *std::max_element(force.begin(), force.end()));
    near(t.raw_impulse, h * t.peak_force);
    near(t.peak_head, jolt);
    near(t.peak_torque, share);
    ASSERT_EQ(t.contacts.size(), touched.size());
    bool head_hit = false;
    for (size_t c = 0; c < touched.size(); ++c) {
      const auto& [part, k] = touched[c];
      EXPECT_EQ(t.contacts[c].part, part);
      EXPECT_NEAR(t.contacts[c].time, k * h, 1e-9);
      const int until = c + 1 < touched.size() ? touched[c + 1].second : n + 1;
      double most = 0;
      for (int i = k; i < until; ++i) most = std::max(most, windowed[i - 1]);
      near(t.contacts[c].impulse, most);
      head_hit = head_hit || part == falls.head;
    }
    EXPECT_EQ(t.head_hit, head_hit);
    const int each = stepsIn(0.001);
    ASSERT_EQ(t.windowed.size(), static_cast<size_t>((n + each - 1) / each));
    for (size_t i = 0; i < t.windowed.size(); ++i) {
      near(t.windowed[i].first, time[i * each]);
      near(t.windowed[i].second, windowed[i * each]);
    }
    const int centisecond = stepsIn(0.01);
    const int settle = stepsIn(protocol.settle);
    ASSERT_EQ(t.com.size(), static_cast<size_t>((settle + centisecond - 1) / centisecond));
    for (size_t i = 0; i < t.com.size(); ++i) {
      const Vector2d expected = com[noticed + i * centisecond] - Vector2d(pivot, 0);
      EXPECT_LT((t.com[i] - expected).norm(), 1e-6) << i;
    }
  }

  const FallRobot& falls;
  FallProtocol protocol;
  std::shared_ptr<const sim::Model> model;
  SagittalBody body;
  sim::World world;
  const sim::Snapshot& s;
  control::StablePd pd;
  sim::State stance;
  control::JointTarget held;
  int window;
  std::set<int> own;  // bodies that have stood on the ground so far
  std::map<int, int> away;
  std::set<std::string> now;  // parts on the ground
  std::vector<std::pair<std::string, int>> touched;
  std::vector<double> time, force;
  std::vector<Vector3d> head;
  std::vector<Vector2d> com;
  double share = 0;
  int noticed = -1;
  double pivot = 0;
  PendulumState start;
};

TEST(FallTrial, IsWhatASimulationByHandMeasures) {
  const FallRobot bioloid = readFalls("bioloid-gp");
  const FallRobot atlas = readFalls("atlas");
  const FallProtocol coarse{
      .time_step = 0.001, .window = 0.012, .settle = 0.9, .ground = {.compliance = 0.006}};
  const FallProtocol fine{.settle = 0.5};
  const FallProtocol by_step{.time_step = 0.001, .window = 0.0001, .settle = 0.9};
  for (const auto& [falls, setup, protocol, push, strategy] :
       {std::tuple(&bioloid, 0, &coarse, Push{1.5, 0.08}, "hold"),
        std::tuple(&bioloid, 0, &fine, Push{2}, "limp"),
        std::tuple(&bioloid, 0, &by_step, Push{0}, "damp"),
        std::tuple(&bioloid, 0, &coarse, Push{3}, "tuck"),
        std::tuple(&atlas, 2, &coarse, Push{700, 0.06}, "tuck")}) {
    SCOPED_TRACE(strategy);
    ByHand hand(*falls, falls->setups[setup], *protocol);
    const control::JointTarget tuck =
        control::targetOf(*hand.model, hand.model->stateOf(falls->robot->poses.at(falls->tuck)));
    hand.run(push, [&, how = std::string_view(strategy)](VectorXd& tau) {
      if (how == "limp") return;
      if (how == "damp") {
        for (sim::JointGain& g : hand.pd.gains()) g.kp = 0;
      }
      hand.pd.addTorque(hand.s, how == "tuck" ? tuck : hand.held, tau);
    });
    FallSimulator simulator(*falls, falls->setups[setup], *protocol);
    hand.expectSame(simulator.run(push, strategy));
  }
}

/// Follows the motions it is given, by the words of FallTracking: one a question, then none.
struct FollowerByHand {
  struct Question {
    FallState start;
    std::vector<PoseSolver::Goal> made;
  };
  ByHand& hand;
  const FallTracking& tracking;
  double stiffness;
  std::vector<std::optional<FallMotion>> answers;
  std::vector<Question> asked = {};
  std::optional<FallMotion> motion = {};
  std::vector<sim::JointGain> gains = {hand.pd.gains().begin(), hand.pd.gains().end()};
  control::JointTarget from = hand.held, target = hand.held;
  std::vector<int> made = {0};
  size_t stage = 0;
  int ended = 0;
  double begun = 0, last = 0;

  bool ask() {
    const sim::Snapshot& s = hand.s;
    last = s.time();
    const int on = made.back();
    Question question{
        {on, s.time() - hand.noticed * hand.protocol.time_step, hand.body.pendulum(s, on)}, {}};
    for (const int node : made) {
      if (node == on) continue;
      question.made.push_back({node, hand.body.node(s, node) - hand.body.node(s, on)});
    }
    asked.push_back(question);
    if (asked.size() > answers.size() || !answers[asked.size() - 1]) return false;
    const FallMotion& answer = *answers[asked.size() - 1];
    if (answer.stages.empty() && answer.rest.q.size() == 0) return false;
    motion = answer;
    stage = 0;
    enter();
    return true;
  }
  void enter() {
    begun = last = hand.s.time();
    from = target;
  }
  const FallMotion::Stage* now() const {
    return motion && stage < motion->stages.size() ? &motion->stages[stage] : nullptr;
  }

  void operator()(VectorXd& tau) {
    const sim::Snapshot& s = hand.s;
    const double t = s.time();
    if (asked.empty()) ask();
    if (now()) {
      const bool touched = std::any_of(now()->points.begin(), now()->points.end(),
                                       [&](const auto& p) { return hand.now.contains(p); });
      const double late = std::max(tracking.least_wait, tracking.late * now()->duration);
      if (touched || t - begun > now()->duration + late) {
        if (touched) made.push_back(now()->node);
        ++stage;
        ++ended;
        if (!touched || !ask()) enter();
      }
    } else if (t - last > tracking.again && hand.falling(made.back())) {
      ask();
    }
    double kp = 1;
    double kd = 1;
    if (motion) {
      const std::vector<sim::State> poses =
          now() ? now()->poses : std::vector<sim::State>{motion->rest};
      const double ramp = now() ? tracking.ramp * now()->duration : tracking.rest;
      const auto n = static_cast<double>(poses.size());
      const double along = ramp > 0 ? std::clamp((t - begun) / ramp, 0., 1.) * n : n;
      const auto i = std::min(static_cast<size_t>(along), poses.size() - 1);
      const VectorXd before = i == 0 ? from.q : control::targetOf(*hand.model, poses[i - 1]).q;
      const VectorXd to = control::targetOf(*hand.model, poses[i]).q;
      target.q = before + (along - static_cast<double>(i)) * (to - before);
      kp = now() ? stiffness : tracking.rest_stiffness.value_or(stiffness);
      kd = now() ? tracking.damping : tracking.rest_damping;
    }
    for (size_t i = 0; i < gains.size(); ++i) {
      hand.pd.gains()[i] = {kp * gains[i].kp, kd * gains[i].kd};
    }
    hand.pd.addTorque(s, target, tau, control::StablePd::Clamp::kNone);  // knows of no support
    if (now()) support(tau);
    for (const sim::Joint& j : hand.model->joints()) {  // both together
      tau[j.v] = control::limitedTorque(tau[j.v], s.v()[j.v], j.limit);
    }
  }

  /// What bears the rod's force: Eq. 12, between nothing and one and a half weights.
  void support(VectorXd& tau) const {
    const sim::Snapshot& s = hand.s;
    const PendulumState p = hand.body.pendulum(s, made.back());
    const double m = hand.model->mass();
    const double force =
        std::clamp(m * (kG * std::cos(p.theta) - p.r * p.theta_rate * p.theta_rate +
                        (now()->rod_rate - p.r_rate) / tracking.rod_time),
                   0., 1.5 * m * kG);
    const auto& points = hand.body.setup().graph.nodes[made.back()].points;
    Vector3d pivot = Vector3d::Zero();
    sim::Matrix3Xd J = sim::Matrix3Xd::Zero(3, hand.model->nv());
    sim::Matrix3Xd feet = J;
    for (const std::string& name : points) {
      const sim::ContactPoint& at = hand.falls.robot->contacts.at(name);
      s.pointJacobian(hand.model->body(at.body), at.p_BP, J);
      feet += J / static_cast<double>(points.size());
      pivot += hand.body.point(s, name) / static_cast<double>(points.size());
    }
    s.comJacobian(J);
    tau += tracking.support * force * (J - feet).transpose() * (s.com() - pivot).normalized();
  }
};

/// Both follow the same answers: equal questions and equal falls.
/// @return the questions
std::vector<FollowerByHand::Question> expectFollowed(
    const FallRobot& falls, const FallSetup& setup, const Push& push,
    const std::vector<std::optional<FallMotion>>& answers, const FallProtocol& protocol) {
  ByHand hand(falls, setup, protocol);
  FollowerByHand follower{hand, falls.tracking, setup.quick.stiffness, answers};
  hand.run(push, std::ref(follower));
  FallSimulator simulator(falls, setup, protocol);
  std::vector<FollowerByHand::Question> asked;
  sim::Recording recording{"another", {"another"}, std::vector<sim::Frame>(3)};
  const FallTrial trial = simulator.run(
      push, "planned",
      [&](const FallState& start, const std::vector<PoseSolver::Goal>& made,
          const sim::State&) -> std::optional<FallMotion> {
        asked.push_back({start, made});
        return asked.size() <= answers.size() ? answers[asked.size() - 1] : std::nullopt;
      },
      {.recording = &recording});
  hand.expectSame(trial);
  EXPECT_EQ(asked.size(), follower.asked.size());
  for (size_t i = 0; i < std::min(asked.size(), follower.asked.size()); ++i) {
    const auto& [start, made] = follower.asked[i];
    EXPECT_EQ(asked[i].start.contact, start.contact) << i;
    EXPECT_NEAR(asked[i].start.time, start.time, 1e-9) << i;
    EXPECT_LT((asked[i].start.pendulum.com() - start.pendulum.com()).norm(), 1e-6) << i;
    EXPECT_LT((asked[i].start.pendulum.comVelocity() - start.pendulum.comVelocity()).norm(), 1e-4);
    EXPECT_EQ(asked[i].made.size(), made.size()) << i;
    for (size_t g = 0; g < std::min(made.size(), asked[i].made.size()); ++g) {
      EXPECT_EQ(asked[i].made[g].node, made[g].node);
      EXPECT_LT((asked[i].made[g].place - made[g].place).norm(), 1e-6);
    }
  }
  // A phase for each contact, by number.
  EXPECT_EQ(recording.mjcf, hand.model->mjcf());
  EXPECT_EQ(recording.frames.front().phase, 0);
  EXPECT_EQ(recording.frames.back().phase, 1 + follower.ended);
  std::vector<std::string> phases = {"push"};
  for (int i = 1; i <= 1 + follower.ended; ++i) phases.push_back("contact " + std::to_string(i));
  EXPECT_EQ(recording.phases, phases);
  EXPECT_EQ(recording.frames.size(), (hand.com.size() + 9) / 10);
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    EXPECT_NEAR(recording.frames[i].state.time, 0.01 * static_cast<double>(i), 1e-9);
  }
  return asked;
}

FallMotion::Stage stageTo(const FallSetup& setup, int node, double duration, double rod_rate,
                          std::vector<sim::State> poses) {
  return {node, setup.graph.nodes[node].points, duration, rod_rate, std::move(poses)};
}

TEST(FallTrial, APlanIsFollowedPoseByPoseAndAskedForAgain) {
  FallRobot falls = readFalls("atlas");
  FallSetup setup = falls.setup("two_feet", "forward");
  setup.quick.stiffness = 0.6;
  falls.tracking = {.damping = 0.4,
                    .rest_stiffness = 0.3,
                    .rest_damping = 0.7,
                    .support = 0.8,
                    .ramp = 0.7,
                    .rod_time = 0.08,
                    .late = 0.3,
                    .least_wait = 0.04,
                    .again = 0.07,
                    .rest = 0.12};
  const FallProtocol protocol{.time_step = 0.001, .settle = 0.9};
  const ByHand hand(falls, setup, protocol);
  const auto pose = [&](const char* name) {
    return hand.model->stateOf(falls.robot->poses.at(name));
  };
  const sim::State tuck = pose("tuck");
  const sim::State stand = pose("two_feet");
  // Late by its share of the time, then by the least; a rod that is to grow and one to shrink fast.
  const FallMotion timed{
      {stageTo(setup, 3, 0.2, 0, {stand, tuck, stand}), stageTo(setup, 2, 0.05, 3, {tuck}),
       stageTo(setup, 3, 0.05, -3, {tuck, stand})},
      stand};
  const FallMotion kneeling{
      {stageTo(setup, 1, 0.4, -0.1, {stand, tuck}), stageTo(setup, 2, 0.3, 0.2, {stand})}, tuck};
  const auto late = expectFollowed(falls, setup, {900}, {std::nullopt, timed}, protocol);
  ASSERT_GE(late.size(), 2U);
  EXPECT_NEAR(late[1].start.time, 0.07, 0.0011);
  const auto touched = expectFollowed(falls, setup, {1800}, {kneeling, FallMotion{}}, protocol);
  ASSERT_GE(touched.size(), 2U);
  EXPECT_EQ(touched[1].start.contact, 2);  // the knees come too late
  EXPECT_EQ(touched[1].made.size(), 1U);
  EXPECT_GE(touched.size(), 3U);  // it goes on falling
  // At once, without support, and anew at a touch.
  falls.tracking.support = falls.tracking.ramp = falls.tracking.rest = 0;
  falls.tracking.rest_stiffness.reset();
  const FallMotion resting{{}, stand};
  const auto anew = expectFollowed(falls, setup, {1500}, {kneeling, timed, resting}, protocol);
  EXPECT_GE(anew.size(), 2U);
}

TEST(FallTrial, WithoutAPlanThePoseIsKept) {
  const FallRobot falls = readFalls("bioloid-gp");
  FallSimulator simulator(falls, falls.setups[0], {.time_step = 0.001, .settle = 0.6});
  const FallTrial held = simulator.run({1.5}, "hold");
  for (const auto& answer : {std::optional<FallMotion>(), std::optional(FallMotion{})}) {
    const FallTrial trial =
        simulator.run({1.5}, "planned",
                      [&](const FallState&, const std::vector<PoseSolver::Goal>&,
                          const sim::State&) { return answer; });
    EXPECT_EQ(trial.impulse, held.impulse);
    EXPECT_EQ(trial.com, held.com);
  }
}

TEST(FallTrial, EndsWhereNothingFallsOrTheNumbersDo) {
  const FallRobot falls = readFalls("atlas");
  FallSimulator simulator(falls, falls.setup("two_feet", "forward"),
                          {.time_step = 0.001, .patience = 0.3});
  sim::Recording recording;
  const FallTrial weak = simulator.run({50, 0.05}, "hold", {}, {.recording = &recording});
  EXPECT_FALSE(weak.fell);
  EXPECT_FALSE(weak.diverged);
  EXPECT_TRUE(weak.com.empty());
  EXPECT_EQ(recording.phases, std::vector<std::string>{"push"});
  EXPECT_EQ(recording.frames.back().phase, 0);
  EXPECT_NEAR(recording.frames.back().state.time, 0.35, 1e-9);  // one step more is looked at
  EXPECT_NEAR(weak.windowed.back().first, 0.351, 1e-9);
  const FallTrial torn = simulator.run({1e15}, "hold");
  EXPECT_TRUE(torn.diverged);
  EXPECT_LT(torn.windowed.size(), 300U);
}

TEST(FallSimulator, IsDisturbedAsAnyTrialIs) {
  const FallRobot falls = readFalls("bioloid-gp");
  FallSimulator simulator(falls, falls.setups[0], {.time_step = 0.001, .settle = 0.6});
  const double alone = simulator.run({1.5}, "hold").impulse;
  EXPECT_NE(simulator.run({1.5}, "hold", {}, {.delay = 0.02}).impulse, alone);
  const double noisy = simulator.run({1.5}, "hold", {}, {.encoder_noise = 0.02}).impulse;
  EXPECT_NE(noisy, alone);
  EXPECT_EQ(simulator.run({1.5}, "hold", {}, {.encoder_noise = 0.02}).impulse, noisy);
  EXPECT_NE(simulator.run({1.5}, "hold", {}, {.encoder_noise = 0.02, .seed = 2}).impulse, noisy);
  // A push back when the fall is on its way.
  const motion::Push back{
      .body = simulator.body().model()->root(), .force = {-3, 0, 0}, .start = 0.3};
  EXPECT_NE(simulator.run({1.5}, "hold", {}, {.pushes = {back}}).impulse, alone);
  EXPECT_EQ(simulator.run({1.5}, "hold").impulse, alone);
}

TEST(WaysToFall, EachIsAControllerThatKeepsToItsRules) {
  const FallRobot bioloid = readFalls("bioloid-gp");
  std::set<std::string_view> names;
  for (const WayToFall& way : allWays()) {
    SCOPED_TRACE(way.name);
    EXPECT_TRUE(names.insert(way.name).second);
    EXPECT_FALSE(way.help.empty());
    EXPECT_EQ(&wayNamed(way.name), &way);
    // A plan of nothing: what follows one keeps the pose.
    const FallSimulator::Plan none = [](const FallState&, const std::vector<PoseSolver::Goal>&,
                                        const sim::State&) { return std::nullopt; };
    FallSimulator simulator(bioloid, bioloid.setups[0], {.time_step = 0.001, .settle = 0.6});
    sim::Recording recording;
    const FallTrial trial = simulator.run({2}, way.name, none, {.recording = &recording});
    EXPECT_TRUE(trial.fell);
    EXPECT_FALSE(trial.diverged);
    EXPECT_GT(trial.impulse, 0);
    EXPECT_LE(trial.peak_torque, 1);
    ASSERT_GE(recording.phases.size(), 2U);
    EXPECT_EQ(recording.phases[0], "push");
    EXPECT_EQ(recording.frames.front().phase, 0);
    EXPECT_EQ(recording.frames.back().phase, 1);
    EXPECT_EQ(simulator.run({2}, way.name, none).impulse, trial.impulse);  // to the bit
  }
  EXPECT_THROW(wayNamed("fly"), InputError);
}

TEST(FallTrial, AStanceStandsOnItsFirstNodeForHalfASecond) {
  const FallRobot bioloid = readFalls("bioloid-gp");
  FallSetup setup = bioloid.setups[0];
  const auto complaint = [&](const FallRobot& falls) -> std::string {
    try {
      FallSimulator(falls, setup, {.time_step = 0.001}).checkStance();
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const auto with = [&](const Vector3d& moved) {
    sim::Robot robot = *bioloid.robot;
    robot.contacts.at("right_toe").p_BP += moved;
    FallRobot falls = bioloid;
    falls.robot = std::make_shared<const sim::Robot>(robot);
    return complaint(falls);
  };
  ByHand hand(bioloid, setup, {.time_step = 0.001});
  const double height = hand.body.com(hand.s).y();
  const double toe = hand.body.point(hand.s, "right_toe").z();
  // The sole is flat, so that the foot's axes are the world's.
  EXPECT_EQ(with({0, 0, 0.0198 * height - toe}), "");
  has(with({0, 0, 0.0202 * height - toe}),
      "bioloid-gp: in the stance \"one_foot\" the contact point \"right_toe\" of \"right-toes\"");
  // It topples forward: over an edge that is further ahead it falls later.
  setup.stands = true;
  const sim::BodyId foot = hand.model->body("r_foot");
  std::vector<double> reached;  // how far ahead of the toe the COM is in the foot's axes, by step
  sim::Torque command;
  VectorXd tau(hand.model->nv());
  while (reached.size() < 600) {
    const Matrix3d R = hand.s.bodyRotation(foot);
    reached.push_back((hand.body.com(hand.s).x() - hand.body.node(hand.s, 0).x()) / R(0, 0));
    tau.setZero();
    hand.pd.addTorque(hand.s, hand.held, tau);
    control::toMotors(*hand.model, tau, command);
    hand.world.step(command);
  }
  ASSERT_TRUE(std::is_sorted(reached.begin() + 200, reached.end()));
  has(with({reached[454], 0, 0}), "cannot stand still: unpushed, it begins to fall after 0.46 s");
  has(with({reached[495], 0, 0}), "begins to fall");
  EXPECT_EQ(with({reached[505], 0, 0}), "");
}

/// A plan of BioloidGP that touches with two parts of one foot, one after another.
FallPlan heelAndToes() {
  FallPlan plan;
  plan.cost = 1;
  const FallState start{0, 0, {.theta = 0.1, .r = 0.17, .theta_rate = 1}};
  PlannedContact heel{start, {1, 2.9, 0.1, -0.02}, start.pendulum, {}};
  heel.before = {.theta = 0.25, .r = 0.168, .theta_rate = 2};
  heel.impact.advance = 0.06;
  heel.impact.after = {.theta = -0.1, .r = 0.165, .theta_rate = 1.5};
  PlannedContact toes{heel.next(), {2, 3, 0.13, 0.03}, heel.before, {}};
  toes.before = {.theta = 0.3, .r = 0.16, .theta_rate = 2};
  toes.impact.advance = 0.09;
  plan.contacts = {heel, toes};
  return plan;
}

TEST(FallMotion, HasThePosesOfEquation19OnTheWayAndThenRests) {
  const FallRobot falls = readFalls("bioloid-gp");
  const auto model = sim::Model::fromScene({.robot = falls.robot});
  const SagittalBody body(model, falls.setups[0]);
  const sim::State pose = model->stateOf(falls.robot->poses.at("one_foot"));
  PoseSolver poses(body, falls);
  const PendulumModel pendulum{.mass = 1.6, .inertia = 0.01, .step = 0.001};
  const FallTracking tracking{.rest_height = 0.8, .waypoints = 3, .approach = 0.4, .kept = 0.2};
  const std::vector<PoseSolver::Goal> made = {{3, {-0.05, 0.02}}, {5, {0.02, 0.01}}};
  const FallPlan plan = heelAndToes();
  const FallMotion motion =
      motionOf(plan, pendulum, body, poses, tracking, plan.contacts[0].from, made, pose);
  ASSERT_EQ(motion.stages.size(), 2U);
  std::vector<PoseSolver::Goal> kept = {{3, {-0.05, 0.02}, 0.2}, {5, {0.02, 0.01}, 0.2}};
  sim::State from = pose;
  for (size_t i = 0; i < 2; ++i) {
    const PlannedContact& c = plan.contacts[i];
    const FallMotion::Stage& stage = motion.stages[i];
    EXPECT_EQ(stage.node, c.action.contact);
    EXPECT_EQ(stage.points, body.setup().graph.nodes[c.action.contact].points);
    EXPECT_EQ(stage.duration, c.action.duration);
    EXPECT_EQ(stage.rod_rate, c.action.rod_rate);
    ASSERT_EQ(stage.poses.size(), 3U);
    const Vector2d tip(c.impact.advance, 0);
    for (int k = 1; k <= 3; ++k) {
      PendulumState s = c.from.pendulum;
      const int steps = static_cast<int>(std::lround(1000 * c.action.duration)) * k;
      for (int done = 0; 3 * done < steps - 2; ++done) step(pendulum, c.action.rod_rate, s);
      std::vector<PoseSolver::Goal> goals = {{c.from.contact, Vector2d::Zero(), 1},
                                             {c.action.contact, tip, k == 3 ? 1 : 0.4 * k / 3}};
      goals.insert(goals.end(), kept.begin(), kept.end());
      from = poses.solve(goals, s.com(), from);
      EXPECT_LT((stage.poses[k - 1].q - from.q).norm(), 1e-9) << i << " " << k;
    }
    kept.push_back({c.from.contact, Vector2d::Zero(), 0.2});
    for (PoseSolver::Goal& k : kept) k.place -= tip;
  }
  // Between the last part and the one before that is on another body, both on the ground.
  ASSERT_EQ(kept[2].node, 0);
  const double back = kept[2].place.x();
  ASSERT_LT(back, 0);
  const sim::State rest = poses.solve({{2, Vector2d::Zero(), 1}, {0, {back, 0}, 1}},
                                      {back / 2, 0.8 * plan.contacts[1].before.com().y()}, from);
  EXPECT_LT((motion.rest.q - rest.q).norm(), 1e-9);
}

TEST(FallMotion, OfAPlanWithoutContactsIsARestOverThoseThatWereMade) {
  const FallRobot falls = readFalls("bioloid-gp");
  const auto model = sim::Model::fromScene({.robot = falls.robot});
  const SagittalBody body(model, falls.setups[0]);
  const sim::State pose = model->stateOf(falls.robot->poses.at("one_foot"));
  PoseSolver poses(body, falls);
  const FallTracking tracking{.rest_height = 0.7};
  FallState start{0, 0.3, {.theta = 0.2, .r = 0.16}};
  const auto motion = [&](const std::vector<PoseSolver::Goal>& made) {
    return motionOf({}, {}, body, poses, tracking, start, made, pose);
  };
  EXPECT_TRUE(motion({}).stages.empty());
  EXPECT_EQ(motion({}).rest.q.size(), 0);  // nothing to do: it has not touched yet
  start.contact = 3;
  const double height = 0.7 * start.pendulum.com().y();
  const auto expect_rest = [&](const std::vector<PoseSolver::Goal>& made,
                               const std::vector<PoseSolver::Goal>& on, double middle) {
    const FallMotion m = motion(made);
    EXPECT_TRUE(m.stages.empty());
    EXPECT_LT((m.rest.q - poses.solve(on, {middle, height}, pose).q).norm(), 1e-9);
  };
  expect_rest({{0, {-0.2, 0.03}, 0.1}, {2, {-0.1, 0.02}, 0.1}},
              {{3, Vector2d::Zero()}, {2, {-0.1, 0}}}, -0.05);
  expect_rest({{2, {0.12, 0.02}}}, {{3, Vector2d::Zero()}, {2, {0.12, 0}}}, 0.06);
  expect_rest({}, {{3, Vector2d::Zero()}}, 0);
}

TEST(FallExperiment, PlansAsItsOptionsSay) {
  const auto falls = std::make_shared<const FallRobot>(readFalls("bioloid-gp"));
  FallExperimentOptions options;
  options.problem.poses = 1500;
  options.protocol = {.time_step = 0.001, .settle = 0.5};
  const TestFolder tables;
  options.tables = tables.path();
  const auto run = [&](const FallPlan* plan = nullptr) {
    FallExperiment experiment(falls, falls->setups[0], options);
    return std::pair(experiment.run({1.5}, "planned", {}, plan), experiment.problem());
  };
  const auto [quick, problem] = run();
  EXPECT_FALSE(quick.refused);
  const FallPlan best = planExactly(problem, quick.trial.start);
  EXPECT_FALSE(std::filesystem::is_empty(tables.path()));
  const ValueTable table = cachedTable(problem, {}, tables.path());
  EXPECT_EQ(quick.plan.cost, planQuickly(problem, table, quick.trial.start).cost);
  options.exact = true;
  EXPECT_EQ(run().first.plan.cost, best.cost);
  // A given plan is followed, whatever the fall is like, and so is one that is not made anew.
  const auto given = run(&best).first;
  EXPECT_EQ(given.plan.contacts.size(), best.contacts.size());
  options.replans = false;
  const auto once = run().first;
  EXPECT_EQ(once.trial.com, given.trial.com);
  FallSimulator simulator(*falls, falls->setups[0], options.protocol);
  PoseSolver poses(simulator.body(), *falls);
  const PendulumModel pendulum = problem.model;
  int asked = 0;
  const FallTrial trial =
      simulator.run({1.5}, "planned",
                    [&](const FallState& start, const std::vector<PoseSolver::Goal>& made,
                        const sim::State& pose) -> std::optional<FallMotion> {
                      if (asked++ > 0) return std::nullopt;
                      return motionOf(best, pendulum, simulator.body(), poses, falls->tracking,
                                      start, made, pose);
                    });
  EXPECT_GT(asked, 1);
  EXPECT_EQ(trial.com, once.trial.com);
  EXPECT_NE(trial.com, quick.trial.com);
}

TEST(FallExperiment, RefusesAPlanThatCostsMoreThanThePoseUnlessItIsToldTo) {
  const auto falls = std::make_shared<const FallRobot>(readFalls("bioloid-gp"));
  // With nothing but the head to fall on.
  FallSetup setup = falls->setups[0];
  for (const char* node : {"hands", "left-heel", "left-toes"}) setup = setup.without(node);
  FallExperimentOptions options;
  options.problem.poses = 1500;
  options.protocol = {.time_step = 0.001, .settle = 0.4};
  options.exact = true;
  options.replans = false;
  FallExperiment experiment(falls, setup, options);
  FallSimulator simulator(*falls, setup, options.protocol);
  for (const auto& [push, refused] : {std::pair(0.5, false), std::pair(4.0, true)}) {
    // By the model, from where it is noticed.
    double held = 0;
    FallPlan best;
    const FallTrial kept = simulator.run(
        {push}, "planned",
        [&](const FallState& start, const std::vector<PoseSolver::Goal>&,
            const sim::State& pose) -> std::optional<FallMotion> {
          if (held > 0) return std::nullopt;
          sim::World world(simulator.body().model());
          world.reset(pose);
          for (const HeldImpact& h : heldFall(
                   experiment.problem(), heldParts(simulator.body(), world.snapshot(), 0), start)) {
            held = std::max(held, h.impulse);
          }
          best = planExactly(experiment.problem(), start);
          return std::nullopt;
        });
    EXPECT_EQ(held < best.cost, refused);
    const FallExperiment::Outcome outcome = experiment.run({push}, "planned");
    EXPECT_EQ(outcome.plan.cost, best.cost);
    EXPECT_EQ(outcome.refused, refused);
    EXPECT_EQ(outcome.trial.com == kept.com, refused);
    // One that is given is followed.
    const FallExperiment::Outcome told = experiment.run({push}, "planned", {}, &outcome.plan);
    EXPECT_FALSE(told.refused);
    EXPECT_NE(told.trial.com, kept.com);
  }
  // As printed, none is refused.
  options.problem.stall = Stall::kLiteral;
  EXPECT_FALSE(FallExperiment(falls, setup, options).run({4}, "planned").refused);
}

}  // namespace
}  // namespace traceur::fall
