#include "traceur/landing/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "traceur/core/error.h"
#include "traceur/sim/turn.h"

namespace traceur::landing {

bool Verdict::safe() const {
  return stands() && head_force < kHeadForce;
}

Judge::Judge(std::shared_ptr<const sim::Model> model)
    : model_(std::move(model)), head_(group("head")), feet_(group("feet")), back_(group("trunk")) {
  const std::vector<bool> shoulders = group("shoulders");
  for (size_t b = 0; b < back_.size(); ++b) back_[b] = back_[b] || shoulders[b];
  back_[static_cast<size_t>(model_->root().value)] = false;  // who lands on the seat has not rolled
}

std::vector<bool> Judge::group(const char* name) const {
  const auto& groups = model_->robot()->bodies;
  const auto found = groups.find(name);
  if (found == groups.end()) {
    throw InputError(fmt::format("{}: [bodies]: expected a group \"{}\" to judge a landing by",
                                 model_->robot()->toml.string(), name));
  }
  std::vector<bool> in(static_cast<size_t>(model_->bodies()), false);
  for (const std::string& body : found->second) {
    in[static_cast<size_t>(model_->body(body).value)] = true;
  }
  return in;
}

void Judge::begin(const motion::Moment& m) {
  verdict_ = {};
  verdict_.stress.setZero(model_->bodies());
  somersault_ = sim::Turn::of(m.s.bodyRotation(model_->root())).somersault;
  on_back_ = false;
  up_since_.reset();
  const double steps = Verdict::kStressWindow / model_->timeStep();
  window_.assign(static_cast<size_t>(std::max(1L, std::lround(steps))),
                 VectorXd::Zero(model_->bodies()));
  sum_.setZero(model_->bodies());
  steps_ = 0;
}

void Judge::addStress(const motion::Moment& m) {
  VectorXd& oldest = window_[static_cast<size_t>(steps_) % window_.size()];
  sum_ -= oldest;
  oldest = m.s.jointForces().colwise().norm().transpose();
  sum_ += oldest;
  ++steps_;
  const double n = static_cast<double>(std::min(window_.size(), static_cast<size_t>(steps_)));
  verdict_.stress = verdict_.stress.cwiseMax(sum_ / n);
}

void Judge::look(const motion::Moment& m) {
  const double now = sim::Turn::of(m.s.bodyRotation(model_->root())).somersault;
  somersault_ += std::remainder(now - somersault_, 2 * std::numbers::pi);
  bool touches = false;
  bool feet_alone = true;
  double head = 0;
  for (const sim::RobotContact& c : m.s.robotContacts()) {
    const auto body = static_cast<size_t>(c.body.value);
    if (head_[body]) head += c.f_W.norm();
    if (!model_->isStatic(c.other)) continue;  // what flies about is no ground
    touches = true;
    feet_alone = feet_alone && feet_[body];
    on_back_ = on_back_ || (back_[body] && somersault_ > 2);
  }
  if (touches && !verdict_.touch_down) {
    // Turns in the air are no rolls: it is counted from the nearest upright, a lean back up to 1.5.
    static constexpr double kTurn = 2 * std::numbers::pi;
    somersault_ -= kTurn * std::floor((somersault_ + 1.5) / kTurn);
    on_back_ = false;
    verdict_.touch_down = m.time;
    verdict_.touch_down_speed = -m.s.comVelocity().z();
    verdict_.touch_down_somersault = somersault_;
    verdict_.touch_down_tilt = sim::Turn::of(m.s.bodyRotation(model_->root())).tilt;
    const sim::Vector3d heading = m.s.heading();
    verdict_.touch_down_forward = m.s.comVelocity().dot(heading);
    verdict_.touch_down_spin = m.s.spin().dot(sim::Vector3d::UnitZ().cross(heading));
  }
  if (!verdict_.touch_down) return;
  addStress(m);
  verdict_.head_force = std::max(verdict_.head_force, head);
  const bool in_time = m.time - *verdict_.touch_down < Verdict::kRollingTime;
  if (!verdict_.rolled && in_time && on_back_ && somersault_ > Verdict::kRolled) {
    verdict_.rolled = m.time;
  }
  const bool up = touches && feet_alone && m.s.com().z() > Verdict::kStanding;
  if (!up) {
    up_since_.reset();
  } else if (!up_since_) {
    up_since_ = m.time;
  }
  if (verdict_.rolled && up && !verdict_.stood &&
      m.time - *up_since_ > Verdict::kStandingTime - 1e-9) {
    verdict_.stood = m.time;
  }
}

std::string_view Judge::ends(const motion::Moment& m) {
  look(m);
  if (verdict_.stood) {
    if (m.time - *verdict_.stood < Verdict::kLater) return {};
    verdict_.stands_later = up_since_.has_value();
    return "stands";
  }
  if (!verdict_.touch_down || m.time - *verdict_.touch_down < kPatience) return {};
  return "does not stand";
}

}  // namespace traceur::landing
