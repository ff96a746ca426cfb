#include "traceur/skill/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/motion/session.h"
#include "traceur/skill/measures.h"
#include "traceur/skill/skill_controller.h"

namespace traceur::skill {
namespace {

/// Passes on what the joints are told.
class Listener : public motion::Observer {
 public:
  Listener(const motion::Controller& controller, const Runner::OnTarget*& to)
      : controller_(&controller), to_(&to) {}
  void commanded(const motion::Moment& m, const control::Command& c,
                 const sim::Torque& /*torque*/) override {
    if (*to_ && **to_) (**to_)(m.time, controller_->phase(), c.target);
  }

 private:
  const motion::Controller* controller_;
  const Runner::OnTarget** to_;
};

}  // namespace

bool Rollout::failed() const {
  return diverged || std::find(violated.begin(), violated.end(), true) != violated.end();
}

struct Runner::Impl {
  std::shared_ptr<const Skill> skill;
  sim::World world;
  Places places;
  SkillController controller;
  Measures measures;
  const OnTarget* on_target = nullptr;
  Listener listener;
  control::Actuation actuation;
  std::array<motion::Observer*, 2> observers;
  motion::Session session;

  explicit Impl(std::shared_ptr<const Skill> s)
      : skill(std::move(s)),
        world(skill->model),
        places(*skill),
        controller(skill, places),
        measures(*skill, places, controller),
        listener(controller, on_target),
        actuation(controllerOf(*skill)),
        observers{&measures, &listener},
        session(world, actuation, controller, observers) {}

  Rollout run(const VectorXd& x, double task, sim::Recording* recording) {
    if (x.size() != places.parameters.size() || !x.allFinite()) {
      throw InputError(fmt::format("{}: expected {} finite parameters, got {}{}", skill->name,
                                   places.parameters.size(), x.size(),
                                   x.allFinite() ? "" : " with NaN or infinity"));
    }
    places.parameters = x;
    places.task = task;
    const Disturbance& d = skill->disturbance;
    const motion::Trial& trial =
        session.run(skill->start, {.horizon = skill->horizon,
                                   .delay = d.delay,
                                   .encoder_noise = d.encoder_noise,
                                   .velocity_noise = d.velocity_noise,
                                   .seed = d.seed,
                                   .stream = std::bit_cast<std::uint64_t>(task),
                                   .recording = recording});
    Rollout r;
    r.ended = trial.ended;
    r.time = trial.time;
    r.hash = trial.hash;
    r.diverged = trial.diverged;
    for (const double f : places.failed) r.violated.push_back(f != 0);
    r.terms = measures.terms();
    for (const double t : r.terms) r.cost += t;
    r.measures = places.measures;
    r.achieved = measures.achieved();
    if (r.diverged) r.cost = std::numeric_limits<double>::infinity();
    return r;
  }
};

control::StablePd controllerOf(const Skill& skill) {
  control::StablePd pd = control::defaultController(skill.model);
  const ControllerOptions& c = skill.controller;
  for (sim::JointGain& g : pd.gains()) {
    g.kp = c.kp.value_or(g.kp);
    g.kd = c.kd.value_or(g.kd);
  }
  for (sim::JointLimit& l : pd.limits()) {
    l.torque = c.torque.value_or(l.torque);
    l.speed = c.speed.value_or(l.speed);
  }
  return pd;
}

Runner::Runner(std::shared_ptr<const Skill> skill)
    : impl_(std::make_unique<Impl>(std::move(skill))) {}
Runner::~Runner() = default;
Runner::Runner(Runner&&) noexcept = default;

double Runner::costOf(double task) {
  impl_->places.task = task;
  double cost = 0;
  for (const double t : impl_->measures.terms()) cost += t;
  return cost;
}

bool Runner::costDependsOnTask() const {
  return impl_->measures.costDependsOnTask();
}

bool Runner::motionDependsOnTask() const {
  return impl_->places.task_moves;
}

Rollout Runner::run(const VectorXd& parameters, double task, sim::Recording* recording,
                    const OnTarget& on_target) {
  impl_->on_target = &on_target;
  Rollout r = impl_->run(parameters, task, recording);
  impl_->on_target = nullptr;
  return r;
}

}  // namespace traceur::skill
