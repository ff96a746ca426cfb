#include "traceur/skill/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>

#include "traceur/control/expression.h"
#include "traceur/control/signals.h"
#include "traceur/control/stable_pd.h"
#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/skill/names.h"

namespace traceur::skill {
namespace {

using control::Expression;

struct BoundTarget {
  int joint;
  double sign;
  Expression value;
};

struct BoundForce {
  control::VirtualForce force;
  Expression x, y, z;
};

struct BoundPhase {
  std::vector<BoundTarget> targets;
  Expression blend;
  std::vector<BoundForce> forces;
  std::optional<Expression> until;
};

struct BoundFeedback {
  std::vector<BoundTarget> joints;
  const std::vector<bool>* during;
};

struct BoundMeasure {
  Expression of;
  double value = 0;
  int seen = 0;  // steps
};

/// What is said of a whole trial: nothing where a measure it names has no value, also where its
/// text would hide that, as comparisons and max do.
struct Verdict {
  Expression of;
  std::vector<const double*> measures;

  double value() const {
    const bool unknown = std::any_of(measures.begin(), measures.end(),
                                     [](const double* m) { return std::isnan(*m); });
    return unknown ? std::numeric_limits<double>::quiet_NaN() : of.value();
  }
};

/// The index of the row of this name, if there is one.
std::optional<Eigen::Index> placeOf(const auto& rows, const std::string& name) {
  const auto at =
      std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row.name == name; });
  if (at == rows.end()) return std::nullopt;
  return at - rows.begin();
}

}  // namespace

bool Rollout::failed() const {
  return diverged || std::find(violated.begin(), violated.end(), true) != violated.end();
}

struct Runner::Impl {
  std::shared_ptr<const Skill> skill;
  sim::World world;
  control::Signals signals;
  control::StablePd pd;

  // Places the expressions point at.
  VectorXd parameters;
  double task = 0;
  double horizon = 0;
  double time = 0;
  double entered = 0;          // the phase, at this time
  double phase_time = 0;       // a whole number of steps, which a difference of two times is not
  std::vector<double> failed;  // by failure: 0 or 1
  bool task_moves = false;     // the motion depends on the task
  bool task_costs = false;     // a cost does

  std::vector<BoundPhase> phases;
  std::vector<BoundFeedback> feedback;
  std::vector<BoundMeasure> measures;
  std::vector<Expression> failures;
  std::vector<Verdict> terms;
  std::optional<Expression> stop;
  std::optional<Verdict> achieved;

  bool senses_velocity = false;                           // feedback reads the COM's
  sim::Vector3d sensed_velocity = sim::Vector3d::Zero();  // [m/s]

  // Scratch.
  control::JointTarget from, goal, reached, target;  // reached: without feedback
  VectorXd tau;
  sim::Torque command;
  Random noise{0};
  std::deque<sim::Torque> late;  // commands that a delay keeps back, the oldest first

  explicit Impl(std::shared_ptr<const Skill> s)
      : skill(std::move(s)),
        world(skill->model),
        signals(skill->model),
        pd(controllerOf(*skill)),
        parameters(skill->parameters.size()),
        horizon(skill->horizon),
        failed(skill->failures.size()),
        tau(skill->model->nv()) {
    const auto setup = [this](const std::string& name) { return find(Scope::kSetup, name); };
    const auto running = [this](const std::string& name) { return find(Scope::kRunning, name); };
    measures.reserve(skill->measures.size());  // verdicts point into it
    for (const Measure& m : skill->measures) measures.push_back({Expression(m.of, running)});
    for (const Phase& p : skill->phases) {
      BoundPhase b{bind(p.targets, setup), Expression(p.blend, setup), {}, {}};
      for (const ForceTerm& f : p.forces) {
        b.forces.push_back({{f.body, f.p_BP, Vector3d::Zero()},
                            Expression(f.x, setup),
                            Expression(f.y, setup),
                            Expression(f.z, setup)});
      }
      if (!p.until.empty()) b.until.emplace(p.until, running);
      phases.push_back(std::move(b));
    }
    const auto sensed = [&](const std::string& name) -> const double* {
      for (int axis = 0; axis < 3; ++axis) {
        if (name != std::string("com_velocity.") + "xyz"[axis]) continue;
        senses_velocity = true;
        return &sensed_velocity[axis];
      }
      return running(name);
    };
    for (const Feedback& f : skill->feedback) {
      feedback.push_back({bind(f.joints, sensed), &f.during});
    }
    for (const Failure& f : skill->failures) failures.emplace_back(f.when, running);
    const auto verdict = [&](const std::string& text, bool cost) {
      std::vector<const double*> named;
      Expression of(text, [&](const std::string& name) {
        if (cost) task_costs = task_costs || name == "task";
        const double* place = find(Scope::kVerdict, name);
        for (const BoundMeasure& m : measures) {
          if (&m.value == place) named.push_back(place);
        }
        return place;
      });
      return Verdict{std::move(of), std::move(named)};
    };
    for (const Term& t : skill->terms) terms.push_back(verdict(t.cost, true));
    if (!skill->stop.empty()) stop.emplace(skill->stop, running);
    if (!skill->task.achieved.empty()) achieved = verdict(skill->task.achieved, false);
    const auto n = static_cast<Eigen::Index>(skill->model->joints().size());
    for (auto* q : {&from.q, &goal.q, &reached.q, &target.q}) q->setZero(n);
  }

  static std::vector<BoundTarget> bind(const std::vector<JointValue>& values,
                                       const Expression::Lookup& lookup) {
    std::vector<BoundTarget> out;
    out.reserve(values.size());
    for (const JointValue& v : values) {
      out.push_back({v.joint, v.sign, Expression(v.expression, lookup)});
    }
    return out;
  }

  const double* find(Scope scope, const std::string& name) {
    if (const auto i = placeOf(skill->parameters, name)) return &parameters[*i];
    if (name == "task") {
      task_moves = task_moves || scope != Scope::kVerdict;
      return &task;
    }
    if (name == "horizon") return &horizon;
    if (scope == Scope::kSetup) return nullptr;
    if (name == "time") return &time;
    if (scope == Scope::kRunning) {
      return name == "phase_time" ? &phase_time : signals.find(name);
    }
    if (const auto i = placeOf(skill->measures, name)) return &measures[*i].value;
    if (const auto i = placeOf(skill->failures, name)) return &failed[*i];
    return nullptr;
  }

  void enter(int phase) {
    from = reached;
    const Phase& p = skill->phases[phase];
    if (!p.from_previous) goal.q = p.base;
    for (const BoundTarget& t : phases[phase].targets) goal.q[t.joint] = t.sign * t.value.value();
    for (BoundForce& f : phases[phase].forces) {
      f.force.f = {f.x.value(), f.y.value(), f.z.value()};
    }
  }

  /// @param end  no step follows
  void measure(int phase, bool end) {
    for (size_t i = 0; i < measures.size(); ++i) {
      const Measure& m = skill->measures[i];
      if (!m.during[phase]) continue;
      BoundMeasure& b = measures[i];
      if (m.take == Measure::Take::kFirst && b.seen > 0) continue;
      const double x = b.of.value();
      if (std::isnan(x)) continue;  // a signal that has no value now, such as cop in flight
      const bool first = b.seen++ == 0;
      switch (m.take) {
        case Measure::Take::kFirst:
        case Measure::Take::kLast:
          b.value = x;
          break;
        case Measure::Take::kMin:
          b.value = first ? x : std::min(b.value, x);
          break;
        case Measure::Take::kMax:
          b.value = first ? x : std::max(b.value, x);
          break;
        case Measure::Take::kMean:
          b.value = first ? x : b.value + (x - b.value) / b.seen;
          break;
        case Measure::Take::kIntegral:
          b.value = (first ? 0 : b.value) + (end ? 0 : x * skill->model->timeStep());
          break;
      }
    }
  }

  void control(int phase, const sim::Snapshot& s) {
    const BoundPhase& p = phases[phase];
    const double blend = p.blend.value();
    const double done = blend > 0 ? std::min(1.0, (time - entered) / blend) : 1.0;
    target.q = from.q + done * (goal.q - from.q);
    reached.q = done < 1 ? target.q : goal.q;  // to the bit
    const Disturbance& d = skill->disturbance;
    if (senses_velocity) sensed_velocity = s.comVelocity();
    if (senses_velocity && d.velocity_noise > 0) {
      for (double& v : sensed_velocity) v += d.velocity_noise * noise.normal();
    }
    for (const BoundFeedback& f : feedback) {
      if (!(*f.during)[phase]) continue;
      for (const BoundTarget& j : f.joints) {
        const double add = j.sign * j.value.value();
        if (!std::isnan(add)) target.q[j.joint] += add;  // cop has no value in flight
      }
    }
    // To a PD controller an angle read too large is a target too small.
    if (d.encoder_noise > 0) {
      for (double& q : target.q) q -= d.encoder_noise * noise.normal();
    }
    tau.setZero();
    for (const BoundForce& f : p.forces) f.force.addTorque(s, tau);
    using Clamp = control::StablePd::Clamp;
    pd.addTorque(s, target, tau, skill->phases[phase].limited ? Clamp::kSum : Clamp::kOwn);
    control::toMotors(*skill->model, tau, command);
  }

  Rollout run(const VectorXd& x, double asked, sim::Recording* recording,
              const Runner::OnTarget& on_target) {
    if (x.size() != parameters.size() || !x.allFinite()) {
      throw InputError(fmt::format("{}: expected {} finite parameters, got {}{}", skill->name,
                                   parameters.size(), x.size(),
                                   x.allFinite() ? "" : " with NaN or infinity"));
    }
    parameters = x;
    task = asked;
    std::fill(failed.begin(), failed.end(), 0.0);
    for (size_t i = 0; i < measures.size(); ++i) {
      measures[i].value = skill->measures[i].otherwise;
      measures[i].seen = 0;
    }
    const double dt = skill->model->timeStep();
    const int steps = static_cast<int>(std::lround(horizon / dt));
    const int every = std::max(1, static_cast<int>(std::lround(kInterval / dt)));
    Rollout r;
    r.ended = "horizon";
    Hash hash;
    world.reset(skill->start);
    const sim::Snapshot& s = world.snapshot();
    goal = reached = control::targetOf(*skill->model, skill->start);
    command.tau.setZero(skill->model->nu());
    if (recording) {
      recording->mjcf = skill->model->mjcf();
      recording->phases.clear();
      for (const Phase& p : skill->phases) recording->phases.push_back(p.name);
      recording->frames.clear();
    }
    const auto delay = static_cast<size_t>(std::lround(skill->disturbance.delay / dt));
    noise = Random(skill->disturbance.seed, std::bit_cast<std::uint64_t>(asked));
    if (delay > 0) {  // until the first answer comes, motors do what holds the start
      tau.setZero();
      pd.addTorque(s, goal, tau);
      control::toMotors(*skill->model, tau, command);
      late.assign(delay, command);
    }
    int phase = 0;
    int entered_step = 0;
    time = entered = phase_time = 0;
    enter(0);
    for (int step = 0;; ++step) {
      time = step * dt;
      signals.update(s);
      phase_time = (step - entered_step) * dt;
      // A phase may end at once, but each at most once per step.
      for (size_t k = 0; k < phases.size() && phases[phase].until; ++k) {
        const int next = skill->phases[phase].next;
        if (next == static_cast<int>(phases.size()) || !phases[phase].until->holds()) break;
        phase = next;
        entered = time;
        entered_step = step;
        phase_time = 0;
        enter(phase);
      }
      bool fails = false;
      for (size_t i = 0; i < failures.size(); ++i) {
        if (skill->failures[i].during[phase] && failures[i].holds()) {
          failed[i] = 1;
          if (!fails) r.ended = skill->failures[i].name;
          fails = true;
        }
      }
      bool end = fails || step >= steps;
      if (!end && stop && stop->holds()) {
        r.ended = "stop";
        end = true;
      }
      measure(phase, end);
      if (step % every == 0 || end) {
        hash.add({s.q().data(), static_cast<size_t>(s.q().size())});
        hash.add({s.v().data(), static_cast<size_t>(s.v().size())});
        if (recording && step % every == 0) {
          recording->frames.push_back(sim::frameOf(s, phase, command.tau));
        }
      }
      if (end) break;
      control(phase, s);
      if (on_target) on_target(time, phase, target);
      if (delay > 0) {
        late.push_back(command);
        command = late.front();
        late.pop_front();
      }
      world.step(command);
      if (world.diverged() || world.overflowed()) {
        r.diverged = true;
        r.ended = world.diverged() ? "diverged" : "too many contacts";
        break;
      }
    }
    r.time = time;
    r.hash = hash.value();
    for (const double f : failed) r.violated.push_back(f != 0);
    for (const Verdict& t : terms) {
      r.terms.push_back(t.value());
      r.cost += r.terms.back();
    }
    for (const BoundMeasure& m : measures) r.measures.push_back(m.value);
    r.achieved = achieved ? achieved->value() : std::numeric_limits<double>::quiet_NaN();
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
  impl_->task = task;
  double cost = 0;
  for (const Verdict& t : impl_->terms) cost += t.value();
  return cost;
}

bool Runner::costDependsOnTask() const {
  return impl_->task_costs;
}

bool Runner::motionDependsOnTask() const {
  return impl_->task_moves;
}

Rollout Runner::run(const VectorXd& parameters, double task, sim::Recording* recording,
                    const OnTarget& on_target) {
  return impl_->run(parameters, task, recording, on_target);
}

}  // namespace traceur::skill
