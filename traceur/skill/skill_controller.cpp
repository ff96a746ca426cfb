#include "traceur/skill/skill_controller.h"

#include <algorithm>
#include <cmath>

namespace traceur::skill {

using control::Expression;

namespace {

/// The axes of Frame::kCopToCom as columns; nothing where the COM is on the centre of pressure or
/// at the end of a line along x.
std::optional<sim::Matrix3d> copToCom(const Vector3d& cop, const Vector3d& com) {
  sim::Matrix3d R;
  R.col(2) = com - cop;
  R.col(1) = R.col(2).cross(Vector3d::UnitX());
  if (!(R.col(2).norm() > 0) || !(R.col(1).norm() > 0)) return std::nullopt;
  R.col(2).normalize();
  R.col(1).normalize();
  R.col(0) = R.col(1).cross(R.col(2));
  return R;
}

/// The axes of Frame::kHeading as columns.
std::optional<sim::Matrix3d> headed(const Vector3d& forward) {
  sim::Matrix3d R;
  R << forward, Vector3d::UnitZ().cross(forward), Vector3d::UnitZ();
  return R;
}

bool touches(const sim::Snapshot& s, sim::BodyId body) {
  const auto& contacts = s.robotContacts();
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const sim::RobotContact& c) { return c.body == body; });
}

}  // namespace

SkillController::SkillController(std::shared_ptr<const Skill> skill, Places& places)
    : skill_(std::move(skill)), places_(&places) {
  const Expression::Lookup running = places.in(Scope::kRunning);
  for (const skill::Phase& p : skill_->phases) {
    Phase b{bind(p.targets, running),
            Expression(p.blend, running),
            bind(p.stiffness, running),
            bind(p.damping, running),
            nullptr,
            nullptr,
            {},
            {}};
    if (p.flight) b.flight = std::make_unique<BoundFlight>(*p.flight, skill_->model, places);
    if (p.reach) b.reach = std::make_unique<BoundReach>(*p.reach, skill_->model, places);
    for (const ForceTerm& f : p.forces) {
      b.forces.push_back({&f, {f.force, running}, {f.moment, running}});
      follows_cop_ = follows_cop_ || f.frame == Frame::kCopToCom;
    }
    for (const Exit& e : p.exits) b.exits.emplace_back(e.when, running);
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

std::vector<SkillController::Factor> SkillController::bind(const std::vector<GainFactor>& values,
                                                           const Expression::Lookup& lookup) {
  std::vector<Factor> out;
  out.reserve(values.size());
  for (const GainFactor& v : values) out.push_back({v.joint, Expression(v.factor, lookup)});
  return out;
}

std::vector<std::string> SkillController::phases() const {
  return skill_->phaseNames();
}

void SkillController::begin(const motion::Moment& m, const control::JointTarget& held) {
  reached_ = held;
  path_ = {held, {held}, 0};
  over_ = false;
  places_->forget();
  places_->look(m.s);
  enter(0, m);
  places_->signals.begin();  // the first step is looked at once
}

void SkillController::enter(int phase, const motion::Moment& m) {
  places_->in_stage[phase_] = 0;
  phase_ = phase;
  // A phase knows no pressure but what there is in it: so it goes as it would go alone.
  cop_ = follows_cop_ ? m.s.cop() : std::nullopt;
  places_->in_stage[phase_] = 1;
  ++places_->entered_stage[phase_];
  entered_step_ = m.step;
  places_->phase_time = 0;
  places_->follow();
  const skill::Phase& p = skill_->phases[phase];
  Phase& bound = phases_[phase];
  control::JointTarget goal = path_.end();
  if (!p.from_previous) goal.q = p.base;
  for (const Target& t : bound.targets) {
    const double value = t.value.value();
    if (!std::isnan(value)) goal.q[t.joint] = t.sign * value;  // a signal without a value
  }
  wanted_ = goal.q;
  path_ = {reached_, {std::move(goal)}, bound.blend.value()};
  path_began_ = m.time;
  if (bound.reach) solveReach(m);
  if (bound.flight) bound.flight->begin(path_.end().q);
}

void SkillController::solveReach(const motion::Moment& m) {
  phases_[phase_].reach->solve(m.s, wanted_, path_.end());
  solved_step_ = m.step;
}

void SkillController::exert(const Force& force, const sim::Snapshot& s,
                            std::vector<control::VirtualForce>& out) {
  const ForceTerm& term = *force.term;
  Vector3d f = force.force.value();
  Vector3d moment = force.moment.value();
  if (!f.allFinite() || !moment.allFinite()) return;  // of signals without a value
  if (term.frame != Frame::kWorld) {
    const auto R = term.frame == Frame::kHeading ? headed(s.heading())
                   : cop_                        ? copToCom(*cop_, s.com())
                                                 : std::nullopt;
    if (!R) return;
    f = *R * f;
    moment = *R * moment;
  }
  std::vector<sim::BodyPoint> points = term.points;
  std::vector<sim::BodyId> against = term.against;
  if (term.touching) {
    std::erase_if(points, [&](const sim::BodyPoint& p) { return !touches(s, p.body); });
    std::erase_if(against, [&](sim::BodyId body) { return !touches(s, body); });
    if (!points.empty()) {
      f /= static_cast<double>(points.size());
      moment /= static_cast<double>(points.size());
    }
  }
  if (against.empty() && !term.against.empty()) return;
  const auto add = [&](const control::VirtualForce& one) {
    out.push_back(one);
    if (against.empty()) return;
    for (const control::VirtualForce& r : control::reaction(s, one, against)) out.push_back(r);
  };
  if (term.com) {
    control::VirtualForce one;
    one.at_com = true;
    one.f = f;
    add(one);
  }
  for (const sim::BodyPoint& p : points) {
    add({.body = p.body, .p_BP = p.p_BP, .f = f, .at_com = false, .moment = moment});
  }
}

void SkillController::update(const motion::Moment& m) {
  places_->time = m.time;
  places_->phase_time = (m.step - entered_step_) * skill_->model->timeStep();
  std::fill(places_->ended_stage.begin(), places_->ended_stage.end(), 0.0);
  places_->look(m.s);
  if (follows_cop_) {
    if (const auto cop = m.s.cop()) cop_ = cop;
  }
  // A phase may end at once, but each at most once per step.
  for (size_t k = 0; k < phases_.size() && !over_; ++k) {
    const std::vector<Expression>& exits = phases_[phase_].exits;
    const auto exit =
        std::find_if(exits.begin(), exits.end(), [](const Expression& e) { return e.holds(); });
    if (exit == exits.end()) break;
    const int next = skill_->phases[phase_].exits[exit - exits.begin()].next;
    places_->ended_stage[phase_] = 1;
    over_ = next == static_cast<int>(phases_.size());
    if (over_) break;  // it is held to the end
    enter(next, m);
  }
}

void SkillController::factors(const std::vector<Factor>& from, VectorXd& to) const {
  if (from.empty()) return;
  to.setOnes(static_cast<Eigen::Index>(skill_->model->joints().size()));
  for (const Factor& f : from) {
    const double value = f.value.value();
    if (std::isfinite(value)) to[f.joint] = std::max(0.0, value);
  }
}

void SkillController::command(const motion::Moment& m, motion::Senses& senses,
                              control::Command& c) {
  const Phase& p = phases_[phase_];
  const double every = p.reach ? skill_->phases[phase_].reach->every : 0;
  const double since = (m.step - solved_step_) * skill_->model->timeStep();
  if (every > 0 && since >= every - 1e-9) solveReach(m);
  if (p.flight) {
    if (const VectorXd* target = p.flight->update(m.s)) {
      path_ = {reached_, {{*target}}, flight::FlightPlanner::kSwitch};
      path_began_ = m.time;
    }
  }
  const double since_path = m.time - path_began_;
  c.target = path_.at(since_path);
  reached_ = path_.over(since_path) ? path_.end() : c.target;  // to the bit
  if (senses_velocity_) sensed_velocity_ = senses.comVelocity();
  for (const BoundFeedback& f : feedback_) {
    if (!(*f.during)[phase_]) continue;
    for (const Target& j : f.joints) {
      const double add = j.sign * j.value.value();
      if (!std::isnan(add)) c.target.q[j.joint] += add;  // cop has no value in flight
    }
  }
  factors(p.stiffness, c.stiffness);
  factors(p.damping, c.damping);
  for (const Force& f : p.forces) exert(f, m.s, c.forces);
  c.limited = skill_->phases[phase_].limited;
}

}  // namespace traceur::skill
