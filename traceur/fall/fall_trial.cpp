#include "traceur/fall/fall_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/motion/session.h"

namespace traceur::fall {
namespace {

/// Holds the stance until a fall shows, then goes over to a way to fall.
class Faller : public motion::Controller {
 public:
  /// @param blind  steps in which it looks for no fall: of the push
  Faller(const FallContext& context, const WayToFall& way, int blind)
      : body_(&context.body),
        holding_(wayNamed("hold").make(context)),
        way_(way.make(context)),
        blind_(blind) {}

  void begin(const motion::Moment& m, const control::JointTarget& held) override {
    noticed_ = -1;
    pivot_ = body_->node(m.s, 0).x();
    held_ = held;
    holding_->begin(m, held);
  }
  void update(const motion::Moment& m) override {
    if (noticed_ < 0 && m.step >= blind_ && falls(m.s)) {
      noticed_ = m.step;
      time_ = m.s.time();
      start_ = {0, 0, body_->pendulum(m.s, 0)};
      pivot_ = body_->node(m.s, 0).x();
      way_->begin(m, held_);
    }
    if (noticed_ >= 0) way_->update(m);
  }
  void command(const motion::Moment& m, motion::Senses& senses, control::Command& c) override {
    (noticed_ < 0 ? holding_ : way_)->command(m, senses, c);
    held_ = c.target;
  }
  int phase() const override { return noticed_ < 0 ? 0 : 1 + way_->phase(); }
  std::vector<std::string> phases() const override {
    std::vector<std::string> names = {"push"};
    if (noticed_ < 0) return names;
    for (const std::string& name : way_->phases()) names.push_back(name);
    return names;
  }

  int noticed() const { return noticed_; }  // step; -1: not yet
  double time() const { return time_; }     // of it [s]
  double pivot() const { return pivot_; }   // where it began to turn [m]
  const FallState& start() const { return start_; }

 private:
  /// Whether the extrapolated COM is past the pivot.
  bool falls(const sim::Snapshot& s) const {
    const Vector2d com = body_->com(s);
    const double rate = std::sqrt(body_->model()->gravity() / com.y());
    return com.x() + body_->comVelocity(s).x() / rate > pivot_;
  }

  const SagittalBody* body_;
  std::unique_ptr<motion::Controller> holding_, way_;
  control::JointTarget held_;
  int blind_;
  int noticed_ = -1;
  double time_ = 0;
  double pivot_ = 0;
  FallState start_;
};

/// Ends a trial when the fall is over, or when none shows; keeps the way of the COM.
class FallWatch : public motion::Observer {
 public:
  FallWatch(const Faller& faller, const SagittalBody& body, int patience, int settle)
      : faller_(&faller), body_(&body), patience_(patience), settle_(settle) {}

  std::string_view ends(const motion::Moment& m) override {
    if (faller_->noticed() < 0) return m.step > patience_ ? "no fall" : "";
    return m.step >= faller_->noticed() + settle_ ? "settled" : "";
  }
  void see(const motion::Moment& m, bool last) override {
    const double h = body_->model()->timeStep();
    const int every = std::max(1, static_cast<int>(std::lround(0.01 / h)));
    if (last || faller_->noticed() < 0 || (m.step - faller_->noticed()) % every != 0) return;
    com.push_back(body_->com(m.s) - Vector2d(faller_->pivot(), 0));
  }

  std::vector<Vector2d> com;

 private:
  const Faller* faller_;
  const SagittalBody* body_;
  int patience_, settle_;
};

/// Ends a trial when the COM passes the pivot.
class StanceWatch : public motion::Observer {
 public:
  explicit StanceWatch(const SagittalBody& body) : body_(&body) {}
  std::string_view ends(const motion::Moment& m) override {
    return m.step > 0 && body_->com(m.s).x() > body_->node(m.s, 0).x() ? "falls" : "";
  }

 private:
  const SagittalBody* body_;
};

std::shared_ptr<const sim::Model> modelOf(const FallRobot& falls, const FallProtocol& protocol) {
  return sim::Model::fromScene(
      {.robot = falls.robot, .ground_material = protocol.ground, .time_step = protocol.time_step});
}

}  // namespace

FallSimulator::FallSimulator(const FallRobot& falls, FallSetup setup, FallProtocol protocol)
    : falls_(&falls),
      protocol_(protocol),
      body_(modelOf(falls, protocol), std::move(setup)),
      stance_(body_.model()->stateOf(falls.robot->poses.at(body_.setup().stance))) {}

void FallSimulator::checkStance() const {
  static constexpr double kStill = 0.5;       // [s]
  static constexpr double kOffGround = 0.02;  // of the COM's height
  const std::string& stance = body_.setup().stance;
  const ContactNode& first = body_.setup().graph.nodes[0];
  sim::World world(body_.model());
  world.reset(stance_);
  const sim::Snapshot& s = world.snapshot();
  for (const std::string& name : first.points) {
    const double height = body_.point(s, name).z();
    if (height <= kOffGround * body_.com(s).y()) continue;
    throw InputError(fmt::format(
        "{}: in the stance \"{}\" the contact point \"{}\" of \"{}\", on which it should stand, is "
        "{:.3g} m above the ground",
        falls_->robot->name, stance, name, first.name, height));
  }
  if (!body_.setup().stands) return;
  const FallContext context{*falls_, body_, stance_, {}};
  const std::unique_ptr<motion::Controller> hold = wayNamed("hold").make(context);
  control::Actuation actuation(control::defaultController(body_.model()));
  StanceWatch watch(body_);
  const std::array<motion::Observer*, 1> observers = {&watch};
  motion::Session session(world, actuation, *hold, observers);
  const motion::Trial& trial = session.run(stance_, {.horizon = kStill});
  if (trial.ended == "horizon") return;
  throw InputError(
      fmt::format("{}: the stance \"{}\" cannot stand still: unpushed, it begins to fall after "
                  "{:.2f} s",
                  falls_->robot->name, stance, trial.time));
}

FallTrial FallSimulator::run(const Push& push, std::string_view way, const Plan& plan,
                             const motion::TrialOptions& more) {
  const auto steps = [&](double time) {
    return static_cast<int>(std::lround(time / protocol_.time_step));
  };
  const FallContext context{*falls_, body_, stance_, plan};
  sim::World world(body_.model());
  control::Actuation actuation(control::defaultController(body_.model()));
  Faller faller(context, wayNamed(way), steps(push.duration));
  ImpulseMeter meter(body_, protocol_, falls_->head);
  FallWatch watch(faller, body_, steps(push.duration) + steps(protocol_.patience),
                  steps(protocol_.settle));
  const std::array<motion::Observer*, 2> observers = {&meter, &watch};
  motion::Session session(world, actuation, faller, observers);
  motion::TrialOptions options = more;
  if (push.force != 0) {
    options.pushes.push_back({.body = body_.model()->body(falls_->push_body),
                              .force = {body_.setup().sign() * push.force, 0, 0},
                              .duration = push.duration});
  }
  const motion::Trial& ended = session.run(stance_, options);
  FallTrial trial;
  static_cast<Impacts&>(trial) = meter.impacts();
  trial.fell = faller.noticed() >= 0;
  trial.noticed = faller.time();
  trial.start = faller.start();
  trial.diverged = ended.diverged;
  trial.com = std::move(watch.com);
  return trial;
}

}  // namespace traceur::fall
