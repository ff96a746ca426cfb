#include "traceur/skill/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/skill/launch.h"
#include "traceur/skill/skill_sequence.h"

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
  struct Push {
    const PushTerm* term;
    BoundVector force, moment;
    control::Expression start, duration;
  };

  std::shared_ptr<const Skill> skill;
  sim::World world;
  Places places;
  SkillSequence* sequence = nullptr;  // the controller of a skill of parts
  std::unique_ptr<motion::Controller> controller;
  Measures measures;
  const OnTarget* on_target = nullptr;
  Listener listener;
  control::Actuation actuation;
  std::vector<motion::Observer*> observers;
  motion::Session session;
  bool joint_forces = false;  // somebody else reads them
  std::optional<LaunchState> launch;
  std::vector<Push> pushes;
  Meddling meddling;                    // besides them
  motion::Ending after;                 // where the skill that comes before this one ended
  std::optional<sim::State> elsewhere;  // where trials begin instead

  explicit Impl(std::shared_ptr<const Skill> s)
      : skill(std::move(s)),
        world(skill->model),
        places(*skill),
        controller(makeController()),
        measures(*skill, places, *controller),
        listener(*controller, on_target),
        actuation(controllerOf(*skill)),
        observers(watchers()),
        session(world, actuation, *controller, observers) {
    const auto setup = places.in(Scope::kSetup);
    if (skill->launch) launch.emplace(*skill, places);
    for (const PushTerm& p : skill->pushes) {
      pushes.push_back({&p,
                        {p.force, setup},
                        {p.moment, setup},
                        control::Expression(p.start, setup),
                        control::Expression(p.duration, setup)});
    }
    if (skill->after) after = endingOf(*skill->after);
  }

  std::unique_ptr<motion::Controller> makeController() {
    if (skill->parts.empty()) return std::make_unique<SkillController>(skill, places);
    auto made = std::make_unique<SkillSequence>(*skill, places);
    sequence = made.get();
    return made;
  }

  std::vector<motion::Observer*> watchers() {
    std::vector<motion::Observer*> all = {&measures, &listener};
    if (sequence) all.insert(all.begin(), sequence);
    return all;
  }

  motion::Ending endingOf(const Part& before) {
    const auto constants = places.in(Scope::kConstant);
    VectorXd x(before.parameters.size());
    for (size_t i = 0; i < before.parameters.size(); ++i) {
      x[static_cast<Eigen::Index>(i)] =
          control::Expression(before.parameters[i], constants).value();
    }
    Runner runner(before.skill);
    sim::Recording film;  // filming watches joint forces, which the first moment here may read
    const Rollout r = runner.run(x, control::Expression(before.task, constants).value(),
                                 places.readJointForces() ? &film : nullptr);
    if (r.failed()) {
      throw InputError(
          fmt::format("{}: [start.after]: {} ended with \"{}\" after {:.3f} s: expected "
                      "a trial that does not fail",
                      skill->file.string(), before.skill->file.string(), r.ended, r.time));
    }
    return runner.ending();
  }

  bool namesFailure(const std::string& word) const {
    return std::any_of(skill->failures.begin(), skill->failures.end(),
                       [&](const Failure& f) { return word == f.name; });
  }

  static bool finite(const std::vector<motion::Push>& all) {
    return std::all_of(all.begin(), all.end(), [](const motion::Push& p) {
      return p.force.allFinite() && p.moment.allFinite() && std::isfinite(p.start) &&
             std::isfinite(p.duration);
    });
  }

  /// Of numbers that make no start or no push.
  Rollout nothing() const {
    Rollout r;
    r.diverged = true;
    r.ended = "diverged";
    r.cost = std::numeric_limits<double>::infinity();
    r.violated.assign(skill->failures.size(), false);
    r.terms.assign(skill->terms.size(), std::nan(""));
    r.measures.assign(skill->measures.size(), std::nan(""));
    r.achieved = std::nan("");
    return r;
  }

  std::vector<motion::Push> pushesNow() const {
    std::vector<motion::Push> now = meddling.pushes;
    for (const Push& p : pushes) {
      now.push_back({.body = p.term->body,
                     .force = p.force.value(),
                     .moment = p.moment.value(),
                     .start = p.start.value(),
                     .duration = p.duration.value()});
    }
    return now;
  }

  void settle(const VectorXd& x, double task) {
    if (x.size() != places.parameters.size() || !x.allFinite()) {
      throw InputError(fmt::format("{}: expected {} finite parameters, got {}{}", skill->name,
                                   places.parameters.size(), x.size(),
                                   x.allFinite() ? "" : " with NaN or infinity"));
    }
    places.parameters = x;
    places.task = task;
    places.settle();
  }

  sim::State start() {
    if (elsewhere) return *elsewhere;
    return launch ? launch->state() : skill->start;
  }

  Rollout run(const VectorXd& x, double task, sim::Recording* recording,
              const motion::Ending* start) {
    settle(x, task);
    const Disturbance& d = skill->disturbance;
    const motion::TrialOptions options{.horizon = skill->horizon,
                                       .pushes = pushesNow(),
                                       .drags = meddling.drags,
                                       .shots = meddling.shots,
                                       .decision_interval = skill->decision_interval,
                                       .delay = d.delay,
                                       .encoder_noise = d.encoder_noise,
                                       .velocity_noise = d.velocity_noise,
                                       .seed = d.seed,
                                       .stream = std::bit_cast<std::uint64_t>(task),
                                       .recording = recording,
                                       .joint_forces = joint_forces || places.readJointForces()};
    if (!start && skill->after && !elsewhere) start = &after;
    const sim::State begin = start ? skill->start : this->start();
    if (!begin.q.allFinite() || !begin.v.allFinite() || !finite(options.pushes)) return nothing();
    const motion::Trial& trial = start ? session.run(*start, options) : session.run(begin, options);
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
    // A failure counts more than a good end in the same step.
    const auto failure = std::find(r.violated.begin(), r.violated.end(), true);
    if (failure != r.violated.end() && !namesFailure(r.ended)) {
      r.ended = skill->failures[failure - r.violated.begin()].name;
    }
    if (r.diverged) r.cost = std::numeric_limits<double>::infinity();
    return r;
  }
};

control::StablePd controllerOf(const Skill& skill) {
  control::StablePd pd = control::defaultController(skill.model);
  for (size_t i = 0; i < skill.controller.joints.size(); ++i) {
    const ControllerOptions::Override& o = skill.controller.joints[i];
    sim::JointGain& g = pd.gains()[i];
    g = {o.kp.value_or(g.kp), o.kd.value_or(g.kd), o.ki.value_or(g.ki)};
    sim::JointLimit& l = pd.limits()[i];
    l.torque = o.torque.value_or(l.torque);
    l.speed = o.speed.value_or(l.speed);
  }
  return pd;
}

Runner::Runner(std::shared_ptr<const Skill> skill)
    : impl_(std::make_unique<Impl>(std::move(skill))) {}
Runner::~Runner() = default;
Runner::Runner(Runner&&) noexcept = default;

void Runner::watchedBy(const std::vector<motion::Observer*>& observers, bool joint_forces) {
  impl_->observers = impl_->watchers();
  impl_->observers.insert(impl_->observers.end(), observers.begin(), observers.end());
  impl_->session =
      motion::Session(impl_->world, impl_->actuation, *impl_->controller, impl_->observers);
  impl_->joint_forces = joint_forces;
}

void Runner::under(const VectorXd& conditions) {
  const Skill& skill = *impl_->skill;
  const VectorXd now = conditions.size() == 0 ? skill.initialConditions() : conditions;
  if (now.size() != impl_->places.conditions.size() || !now.allFinite()) {
    throw InputError(fmt::format("{}: expected {} finite conditions, got {}{}", skill.name,
                                 impl_->places.conditions.size(), now.size(),
                                 now.allFinite() ? "" : " with NaN or infinity"));
  }
  impl_->places.conditions = now;
}

sim::State Runner::start(const VectorXd& parameters, double task) {
  impl_->settle(parameters, task);
  return impl_->start();
}

void Runner::beginsAt(const std::optional<sim::State>& start) {
  impl_->elsewhere = start;
}

void Runner::meddledWith(const Meddling& how) {
  impl_->meddling = how;
}

double Runner::costOf(double task) {
  impl_->places.task = task;
  double cost = 0;
  for (const double t : impl_->measures.terms()) cost += t;
  return cost;
}

motion::Ending Runner::ending() const {
  return impl_->session.ending();
}

bool Runner::costDependsOnTask() const {
  return impl_->measures.costDependsOnTask();
}

bool Runner::motionDependsOnTask() const {
  return impl_->places.task_moves;
}

Rollout Runner::run(const VectorXd& parameters, double task, sim::Recording* recording,
                    const OnTarget& on_target, const motion::Ending* start) {
  impl_->on_target = &on_target;
  Rollout r = impl_->run(parameters, task, recording, start);
  impl_->on_target = nullptr;
  return r;
}

}  // namespace traceur::skill
