#include "traceur/skill/skill_controller.h"

#include <algorithm>
#include <cmath>

namespace traceur::skill {

using control::Expression;

SkillController::SkillController(std::shared_ptr<const Skill> skill, Places& places)
    : skill_(std::move(skill)), places_(&places) {
  const Expression::Lookup setup = places.in(Scope::kSetup);
  const Expression::Lookup running = places.in(Scope::kRunning);
  for (const Phase& p : skill_->phases) {
    BoundPhase b{bind(p.targets, setup), Expression(p.blend, setup), {}, {}};
    for (const ForceTerm& f : p.forces) {
      b.forces.push_back({{.body = f.body, .p_BP = f.p_BP},
                          Expression(f.x, setup),
                          Expression(f.y, setup),
                          Expression(f.z, setup)});
    }
    if (!p.until.empty()) b.until.emplace(p.until, running);
    phases_.push_back(std::move(b));
  }
  const auto sensed = [&](const std::string& name) -> const double* {
    for (int axis = 0; axis < 3; ++axis) {
      if (name != std::string("com_velocity.") + "xyz"[axis]) continue;
      senses_velocity_ = true;
      return &sensed_velocity_[axis];
    }
    return running(name);
  };
  for (const Feedback& f : skill_->feedback) {
    feedback_.push_back({bind(f.joints, sensed), &f.during});
  }
}

std::vector<SkillController::Target> SkillController::bind(const std::vector<JointValue>& values,
                                                           const Expression::Lookup& lookup) {
  std::vector<Target> out;
  out.reserve(values.size());
  for (const JointValue& v : values) {
    out.push_back({v.joint, v.sign, Expression(v.expression, lookup)});
  }
  return out;
}

std::vector<std::string> SkillController::phases() const {
  std::vector<std::string> names;
  for (const Phase& p : skill_->phases) names.push_back(p.name);
  return names;
}

void SkillController::begin(const motion::Moment& m) {
  goal_ = reached_ = control::targetOf(*skill_->model, skill_->start);
  places_->time = 0;
  enter(0, m);
}

void SkillController::enter(int phase, const motion::Moment& m) {
  phase_ = phase;
  entered_step_ = m.step;
  entered_ = m.time;
  places_->phase_time = 0;
  from_ = reached_;
  const Phase& p = skill_->phases[phase];
  if (!p.from_previous) goal_.q = p.base;
  for (const Target& t : phases_[phase].targets) goal_.q[t.joint] = t.sign * t.value.value();
  for (Force& f : phases_[phase].forces) f.force.f = {f.x.value(), f.y.value(), f.z.value()};
}

void SkillController::update(const motion::Moment& m) {
  places_->time = m.time;
  places_->signals.update(m.s);
  places_->phase_time = (m.step - entered_step_) * skill_->model->timeStep();
  // A phase may end at once, but each at most once per step.
  for (size_t k = 0; k < phases_.size() && phases_[phase_].until; ++k) {
    const int next = skill_->phases[phase_].next;
    if (next == static_cast<int>(phases_.size()) || !phases_[phase_].until->holds()) break;
    enter(next, m);
  }
}

void SkillController::command(const motion::Moment& m, motion::Senses& senses,
                              control::Command& c) {
  const BoundPhase& p = phases_[phase_];
  const double blend = p.blend.value();
  const double done = blend > 0 ? std::min(1.0, (m.time - entered_) / blend) : 1.0;
  c.target.q = from_.q + done * (goal_.q - from_.q);
  reached_.q = done < 1 ? c.target.q : goal_.q;  // to the bit
  if (senses_velocity_) sensed_velocity_ = senses.comVelocity();
  for (const BoundFeedback& f : feedback_) {
    if (!(*f.during)[phase_]) continue;
    for (const Target& j : f.joints) {
      const double add = j.sign * j.value.value();
      if (!std::isnan(add)) c.target.q[j.joint] += add;  // cop has no value in flight
    }
  }
  c.forces.clear();
  for (const Force& f : p.forces) c.forces.push_back(f.force);
  c.limited = skill_->phases[phase_].limited;
}

}  // namespace traceur::skill
