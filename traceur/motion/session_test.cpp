#include "traceur/motion/session.h"

#include <gtest/gtest.h>

#include <cmath>

namespace traceur::motion {
namespace {

using Eigen::VectorXd;

/// A pendulum without gravity: a rod of 1 kg m² about its hinge, a motor, and a ball that floats.
std::shared_ptr<const sim::Model> rod() {
  static const auto kModel = sim::Model::fromMjcf(R"(<mujoco>
    <option timestep="0.001" gravity="0 0 0" integrator="Euler"/>
    <worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
    <actuator><motor name="hinge" joint="hinge"/></actuator></mujoco>)");
  return kModel;
}

/// Holds what it is told; a phase each half of the way to `end`.
class Hold : public Controller {
 public:
  double target = 0;
  double halfway = 1e9;  // [s]
  double sensed = 0;
  int begun = 0;
  std::vector<double> commands;  // at these times [s]

  void begin(const Moment& m, const control::JointTarget& /*held*/) override {
    ++begun;
    EXPECT_EQ(m.step, 0);
    phase_ = 0;
    commands.clear();
  }
  void update(const Moment& m) override {
    if (m.time >= halfway) phase_ = 1;
  }
  void command(const Moment& m, Senses& senses, control::Command& c) override {
    commands.push_back(m.time);
    c.target.q = VectorXd::Constant(1, target);
    sensed = senses.comVelocity().x();
  }
  int phase() const override { return phase_; }
  std::vector<std::string> phases() const override { return {"first", "second"}; }

 private:
  int phase_ = 0;
};

class Watch : public Observer {
 public:
  int end_at = 1 << 30;  // step
  int seen = 0;
  int lasts = 0;
  std::vector<double> torques;

  void begin(const Moment& /*m*/) override {
    seen = lasts = 0;
    torques.clear();
  }
  std::string_view ends(const Moment& m) override { return m.step >= end_at ? "enough" : ""; }
  void see(const Moment& /*m*/, bool last) override {
    ++seen;
    lasts += last;
  }
  void commanded(const Moment& /*m*/, const control::Command& /*c*/,
                 const sim::Torque& torque) override {
    torques.push_back(torque.tau[0]);
  }
};

struct Bench {
  sim::World world{rod()};
  control::Actuation actuation{control::StablePd(rod(), {{.kp = 100, .kd = 20}})};
  Hold controller;
  Watch watch;
  std::vector<Observer*> observers = {&watch};
  Session session{world, actuation, controller, observers};
};

sim::State at(double q, double v = 0) {
  return {0, VectorXd::Constant(1, q), VectorXd::Constant(1, v)};
}

TEST(Session, RunsToTheHorizonAndTellsItsEnd) {
  Bench b;
  b.controller.target = 1;
  const Trial t = b.session.run(at(0), {.horizon = 3});
  EXPECT_EQ(t.ended, "horizon");
  EXPECT_DOUBLE_EQ(t.time, 3);
  EXPECT_FALSE(t.diverged);
  EXPECT_NEAR(t.end.q[0], 1, 1e-4);  // critically damped, of 0.1 s
  EXPECT_EQ(b.watch.seen, 3001);     // every moment, the last one too
  EXPECT_EQ(b.watch.lasts, 1);
  EXPECT_EQ(b.controller.commands.size(), 3000u);
  EXPECT_EQ(b.controller.begun, 1);
}

TEST(Session, AnObserverEndsItAndItsWordCounts) {
  Bench b;
  b.watch.end_at = 700;
  Trial t = b.session.run(at(0), {});
  EXPECT_EQ(t.ended, "enough");
  EXPECT_DOUBLE_EQ(t.time, 0.7);
  t = b.session.run(at(0), {.horizon = 0.7});
  EXPECT_EQ(t.ended, "enough");  // more than that time is up
}

TEST(Session, ATorqueHoldsUntilTheControllerDecidesAnew) {
  Bench b;
  b.controller.target = 1;
  // Stiff enough to ring if each torque were reckoned to hold for one step of 1 ms.
  b.actuation = control::Actuation(control::StablePd(rod(), {{.kp = 1e5, .kd = 600}}));
  const Trial t = b.session.run(at(0), {.horizon = 1, .decision_interval = 0.005});
  EXPECT_EQ(b.controller.commands.size(), 200u);
  EXPECT_EQ(b.watch.torques.size(), 200u);
  EXPECT_EQ(b.watch.seen, 1001);  // every step
  EXPECT_NEAR(b.controller.commands[7], 0.035, 1e-12);
  EXPECT_NEAR(t.end.q[0], 1, 1e-3);
  EXPECT_LT(std::abs(b.watch.torques.back()), 1);
  // What is no whole number of steps, or less than one, is rounded.
  const auto hash = [&](double interval) -> std::uint64_t {
    return b.session.run(at(0), {.horizon = 1, .decision_interval = interval}).hash;
  };
  EXPECT_EQ(hash(0.0001), hash(0));
  EXPECT_NE(hash(0.002), hash(0));
  // In between, a delay passes on what was decided.
  Bench late;
  late.controller.target = 1;
  late.session.run(at(0), {.horizon = 0.1, .decision_interval = 0.005, .delay = 0.003});
  EXPECT_EQ(late.controller.commands.size(), 20u);
}

TEST(Session, StepByStepIsTheSameTrial) {
  Bench b;
  b.controller.target = 1;
  const Trial whole = b.session.run(at(0.2), {.horizon = 0.5});
  Bench other;
  other.controller.target = 1;
  other.session.begin(at(0.2), {.horizon = 0.5});
  int steps = 0;
  while (other.session.step()) ++steps;
  EXPECT_EQ(steps, 500);
  EXPECT_EQ(other.session.trial().hash, whole.hash);
  EXPECT_EQ(b.session.run(at(0.2), {.horizon = 0.5}).hash, whole.hash);  // in a used world
  EXPECT_NE(b.session.run(at(0.3), {.horizon = 0.5}).hash, whole.hash);
}

TEST(Session, ATrialThatGoesOnHasTheBitsOfOneThatWasNeverParted) {
  const auto bench = [] {
    auto b = std::make_unique<Bench>();
    control::StablePd gains(rod(), {{.kp = 100, .kd = 20, .ki = 50}});
    gains.limits()[0].torque = 40;
    b->actuation = control::Actuation(std::move(gains));
    b->controller.target = 1;
    return b;
  };
  const auto whole = bench();
  const TrialOptions late{.horizon = 0.5, .delay = 0.004};
  const sim::State end = whole->session.run(at(0.2), late).end;
  const auto first = bench();
  TrialOptions part = late;
  part.horizon = 0.2;
  first->session.run(at(0.2), part);
  const Ending parted = first->session.ending();
  EXPECT_FALSE(parted.empty());
  EXPECT_TRUE(Ending().empty());
  EXPECT_EQ(parted.target.q[0], 1);
  EXPECT_GT(parted.integral[0], 0);
  EXPECT_EQ(parted.late.size(), 4u);
  const auto second = bench();
  part.horizon = 0.3;
  const Trial& rest = second->session.run(parted, part);
  EXPECT_DOUBLE_EQ(rest.time, 0.3);
  EXPECT_EQ(rest.end.q, end.q);
  EXPECT_EQ(rest.end.v, end.v);
  EXPECT_EQ(first->session.run(parted, part).end.q, end.q);  // in the world it ended in
  // Another trial begins without what was summed up.
  EXPECT_EQ(second->session.run(at(0.2), late).end.q, end.q);
}

TEST(Session, APushEndsWithItsTrialAndMayHaveBegunBefore) {
  Bench b;
  const auto push = [](double start, double duration) {
    return Push{
        .body = rod()->body("rod"), .moment = {0, 50, 0}, .start = start, .duration = duration};
  };
  b.session.run(at(0), {.horizon = 0.2, .pushes = {push(0.1, 1)}});
  const Ending ending = b.session.ending();
  Bench still;
  still.session.run(at(0), {.horizon = 0.2, .pushes = {push(0.1, 0.1)}});
  const Ending same = still.session.ending();
  const sim::State on = b.session.run(ending, {.horizon = 1}).end;
  EXPECT_NEAR(on.q[0], 0, 1e-3);  // the push would hold it at half a radian
  EXPECT_EQ(still.session.run(same, {.horizon = 1}).end.q, on.q);
  // Three quarters of it lie in the trial.
  Bench late;
  const double whole =
      late.session.run(at(0), {.horizon = 0.2, .pushes = {push(0, 0.15)}}).end.q[0];
  EXPECT_EQ(late.session.run(at(0), {.horizon = 0.2, .pushes = {push(-0.05, 0.2)}}).end.q[0],
            whole);
}

TEST(Session, ATrialGoesOnFromAnothersEnd) {
  Bench b;
  b.controller.target = 1;
  const sim::State end = b.session.run(at(0), {.horizon = 0.2}).end;
  const sim::State on = b.session.run(end, {.horizon = 0.3}).end;
  const sim::State whole = b.session.run(at(0), {.horizon = 0.5}).end;
  EXPECT_NEAR(on.q[0], whole.q[0], 1e-12);
  EXPECT_NEAR(on.v[0], whole.v[0], 1e-12);
  EXPECT_NEAR(on.time, whole.time, 1e-12);
}

TEST(Session, APushIsForceTimesTimeOnTheBody) {
  Bench b;
  b.observers.clear();
  Session session(b.world, b.actuation, b.controller, {});
  control::Actuation limp(control::StablePd(rod(), {{.kp = 0, .kd = 0}}));
  Session free(b.world, limp, b.controller, {});
  const sim::BodyId body = rod()->body("rod");
  const Push push{.body = body, .moment = {0, 2, 0}, .start = 0.1, .duration = 0.25};
  EXPECT_NEAR(free.run(at(0), {.horizon = 0.1, .pushes = {push}}).end.v[0], 0, 1e-12);
  EXPECT_NEAR(free.run(at(0), {.horizon = 0.2, .pushes = {push}}).end.v[0], 0.2, 1e-9);
  EXPECT_NEAR(free.run(at(0), {.horizon = 1, .pushes = {push}}).end.v[0], 0.5, 1e-9);
}

TEST(Session, PushesAddUpWhateverTheirOrder) {
  Bench b;
  control::Actuation limp(control::StablePd(rod(), {{.kp = 0, .kd = 0}}));
  Session free(b.world, limp, b.controller, {});
  const auto push = [](double moment, double start, double duration) {
    return Push{
        .body = rod()->body("rod"), .moment = {0, moment, 0}, .start = start, .duration = duration};
  };
  for (const auto& pushes : {std::vector<Push>{push(2, 0.1, 0.1), push(3, 0, 0.1)},
                             std::vector<Push>{push(3, 0, 0.1), push(2, 0.1, 0.1)},
                             std::vector<Push>{push(2, 0, 0.15), push(1, 0.05, 0.2)}}) {
    EXPECT_NEAR(free.run(at(0), {.horizon = 1, .pushes = pushes}).end.v[0], 0.5, 1e-9);
  }
}

/// A rod on its hinge that floats and a ball, both falling, far from any ground.
std::shared_ptr<const sim::Model> falling() {
  static const auto kModel = sim::Model::fromMjcf(R"(<mujoco>
    <option timestep="0.001" integrator="Euler"/>
    <worldbody>
    <body name="root" pos="0 0 50"><freejoint/><inertial pos="0 0 0" mass="2" diaginertia="1 2 3"/>
      <geom size="0.1"/>
      <body name="rod"><joint name="hinge" axis="0 1 0"/>
        <inertial pos="0.5 0 0" mass="1" diaginertia="1 1 1"/></body></body>
    <body name="ball" pos="-9 0 0"><freejoint/><geom name="ball" size="0.05" mass="5"/></body>
    </worldbody>
    <actuator><motor name="hinge" joint="hinge"/></actuator></mujoco>)");
  return kModel;
}

/// Where it is after a trial of a held hinge, whose momentum is kept.
void fall(sim::World& world, const TrialOptions& options) {
  control::Actuation actuation{control::StablePd(falling(), {{.kp = 100, .kd = 20}})};
  Hold controller;
  Session session(world, actuation, controller, {});
  sim::State start = falling()->initialState();
  start.v.segment<6>(0) << 0.3, -0.2, 1, 0.5, 1, -0.7;
  session.run(start, options);
}

TEST(Session, ADragMovesAndTurnsABodyInFlight) {
  sim::World undisturbed(falling());
  fall(undisturbed, {.horizon = 0.2});
  const Drag drag{
      .start = 0.2,
      .by = {1, 2, 3},
      .turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix()};
  sim::World dragged(falling());
  fall(dragged, {.horizon = 0.201, .drags = {drag}});  // seen after one more step
  const sim::Snapshot& a = undisturbed.snapshot();
  const sim::Snapshot& b = dragged.snapshot();
  const Eigen::Vector3d g(0, 0, -9.81);
  EXPECT_NEAR((b.comVelocity() - a.comVelocity() - 1e-3 * g).norm(), 0, 1e-9);
  EXPECT_NEAR((b.com() - a.com() - drag.by - 1e-3 * b.comVelocity()).norm(), 0, 1e-5);
  EXPECT_NEAR((b.angularMomentum() - drag.turn * a.angularMomentum()).norm(), 0,
              2e-3 * a.angularMomentum().norm());
  const sim::BodyId root = falling()->root();
  const Eigen::Matrix3d turned = b.bodyRotation(root) * a.bodyRotation(root).transpose();
  EXPECT_NEAR((turned - drag.turn).norm(), 0, 5e-3);
}

TEST(Session, AShotMeetsTheCom) {
  const sim::BodyId ball = falling()->body("ball");
  // It gets there in 0.1 s, less what the two are thick.
  const Shot shot{.body = ball, .start = 0.1, .velocity = {0, 12, -3}, .distance = 1.2};
  const auto apart = [&](double horizon) {
    sim::World world(falling());
    fall(world, {.horizon = horizon, .shots = {shot}});
    return (world.snapshot().bodyPosition(ball) - world.snapshot().com()).norm();
  };
  EXPECT_GT(apart(0.1), 5);
  EXPECT_NEAR(apart(0.101), 1.2, 0.02);
  EXPECT_LT(apart(0.18), 0.35);
  EXPECT_NEAR(apart(0.14) - apart(0.16), 0.02 * 12.5, 0.02);  // straight at it
}

TEST(Session, ADragLeavesAPushGoing) {
  const Push push{.body = falling()->root(), .force = {0, 9, 0}, .start = 0, .duration = 0.2};
  const auto momentum = [&](const std::vector<Drag>& drags) {
    sim::World world(falling());
    fall(world, {.horizon = 0.3, .pushes = {push}, .drags = drags});
    return world.snapshot().linearMomentum().y();
  };
  EXPECT_NEAR(momentum({{.start = 0.1, .by = {1, 0, 0}}}), momentum({}), 1e-6);
}

TEST(Session, EachCommandIsNewButForItsTarget) {
  // A controller that speaks once: its target stays, free of noise; its factors do not.
  class Once : public Controller {
   public:
    std::vector<double> targets, sizes;
    void begin(const Moment& /*m*/, const control::JointTarget& /*held*/) override {}
    void command(const Moment& m, Senses& /*senses*/, control::Command& c) override {
      if (m.step == 0) {
        c.target.q[0] = 1;
        c.stiffness = VectorXd::Zero(1);
        c.limited = c.expected = false;
        c.forces.resize(1);
        c.forces[0].at_com = true;
        return;
      }
      targets.push_back(c.target.q[0]);
      sizes.push_back(static_cast<double>(c.stiffness.size() + c.forces.size()) + !c.limited +
                      !c.expected);
    }
    std::vector<std::string> phases() const override { return {"once"}; }
  } once;
  Bench b;
  Session session(b.world, b.actuation, once, {});
  session.run(at(0), {.horizon = 0.02, .encoder_noise = 0.1});
  EXPECT_EQ(once.targets, std::vector<double>(19, 1.0));
  EXPECT_EQ(once.sizes, std::vector<double>(19, 0.0));
}

TEST(Session, ADelayKeepsCommandsBackAndHoldsTheStartUntilThen) {
  Bench b;
  b.controller.target = 1;
  b.session.run(at(0), {.horizon = 0.05});
  const double first = b.watch.torques.front();
  EXPECT_GT(first, 1);
  b.session.begin(at(0), {.horizon = 0.05, .delay = 0.01});
  for (int i = 0; i < 10; ++i) b.session.step();
  EXPECT_EQ(b.world.state().v[0], 0);
  b.session.step();
  EXPECT_NEAR(b.world.state().v[0], first * 0.001, 1e-12);
}

TEST(Session, NoiseIsOfItsSizeAndFollowsFromSeedAndStream) {
  Bench b;
  const auto run = [&](TrialOptions o) {
    o.horizon = 2;
    b.session.run(at(0), o);
    return b.watch.torques;
  };
  // 100 N m/rad times the error read is the torque asked for, as far as the step's own motion does
  // not enter.
  const auto noisy = run({.encoder_noise = 0.01});
  double sum = 0;
  for (const double t : noisy) sum += t * t;
  EXPECT_NEAR(std::sqrt(sum / noisy.size()), 1, 0.2);
  EXPECT_EQ(noisy, run({.encoder_noise = 0.01}));
  EXPECT_NE(noisy, run({.encoder_noise = 0.01, .seed = 2}));
  EXPECT_NE(noisy, run({.encoder_noise = 0.01, .stream = 1}));
  run({.velocity_noise = 0.5});
  EXPECT_NE(b.controller.sensed, 0);
  run({});
  EXPECT_EQ(b.controller.sensed, 0);
}

TEST(Session, RecordsPhasesAndFramesEveryHundredth) {
  Bench b;
  b.controller.halfway = 0.5;
  sim::Recording r;
  r.frames.resize(7);  // of an earlier trial
  b.session.run(at(0), {.horizon = 1, .recording = &r});
  EXPECT_EQ(r.phases, (std::vector<std::string>{"first", "second"}));
  ASSERT_EQ(r.frames.size(), 101u);
  EXPECT_EQ(r.frames[49].phase, 0);
  EXPECT_EQ(r.frames[50].phase, 1);
  EXPECT_NEAR(r.frames[100].state.time, 1, 1e-9);
  EXPECT_EQ(r.mjcf, rod()->mjcf());
}

TEST(Session, RecordsWhatJointsBoreBetweenFrames) {
  // A mass on a rod, hit for 1 ms between two frames: the hinge holds against it.
  const auto model = sim::Model::fromMjcf(R"(<mujoco>
    <option timestep="0.001" gravity="0 0 0" integrator="Euler"/>
    <worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>
    <actuator><motor name="hinge" joint="hinge"/></actuator></mujoco>)");
  sim::World world(model);
  control::Actuation actuation(control::StablePd(model, {{.kp = 0, .kd = 0}}));
  Hold controller;
  Session session(world, actuation, controller, {});
  sim::Recording r;
  const Push hit{
      .body = model->body("rod"), .force = {0, 0, -50}, .start = 0.014, .duration = 0.001};
  const Trial recorded = session.run(at(0), {.horizon = 0.05, .pushes = {hit}, .recording = &r});
  ASSERT_EQ(r.frames.size(), 6u);
  for (size_t i = 0; i < r.frames.size(); ++i) {
    ASSERT_EQ(r.frames[i].joint_forces.size(), model->bodies());
    EXPECT_NEAR(r.frames[i].joint_forces[1], i == 2 ? 50 : 0, 1e-9) << i;
  }
  // To record changes no bit.
  EXPECT_EQ(session.run(at(0), {.horizon = 0.05, .pushes = {hit}}).hash, recorded.hash);
}

TEST(Session, ASimulationThatDivergesEndsAndSaysSo) {
  Bench b;
  const Trial t = b.session.run(at(0, 1e12), {.horizon = 1});
  EXPECT_TRUE(t.diverged);
  EXPECT_EQ(t.ended, "diverged");
  EXPECT_LT(t.time, 0.1);
}

}  // namespace
}  // namespace traceur::motion
