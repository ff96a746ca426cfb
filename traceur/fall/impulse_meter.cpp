#include "traceur/fall/impulse_meter.h"

#include <algorithm>
#include <cmath>

namespace traceur::fall {

ImpulseMeter::ImpulseMeter(const SagittalBody& body, const FallProtocol& protocol, std::string head)
    : body_(&body),
      model_(body.model()),
      window_(std::max(1, static_cast<int>(std::lround(protocol.window / protocol.time_step)))),
      head_(std::move(head)) {}

void ImpulseMeter::begin(const motion::Moment& /*m*/) {
  impacts_ = {};
  off_.assign(model_->bodies(), 0);
  standing_.assign(model_->bodies(), false);
  // What the stance stands on is its own.
  for (const std::string& name : body_->setup().graph.nodes[0].points) {
    standing_[model_->body(model_->robot()->contacts.at(name).body).value] = true;
  }
  forces_.clear();
  sum_ = 0;
  head_velocities_.clear();
}

void ImpulseMeter::see(const motion::Moment& m, bool /*last*/) {
  if (m.step == 0) return;  // forces of a step that nobody took
  const sim::Snapshot& s = m.s;
  std::vector<bool> touches(standing_.size());
  double force = 0;
  for (const sim::RobotContact& c : s.robotContacts()) {
    touches[c.body.value] = true;
    if (standing_[c.body.value]) continue;
    force += c.f_W.z();
    note(body_->partAt(s, c.body, c.p_WC), s.time());
  }
  for (size_t b = 0; b < standing_.size(); ++b) {
    off_[b] = touches[b] ? 0 : off_[b] + 1;
    if (off_[b] >= window_) standing_[b] = false;
  }
  const double h = model_->timeStep();
  forces_.push_back(force);
  sum_ += force * h;
  if (static_cast<int>(forces_.size()) > window_) {
    sum_ -= forces_.front() * h;
    forces_.pop_front();
  }
  impacts_.impulse = std::max(impacts_.impulse, sum_);
  impacts_.raw_impulse = std::max(impacts_.raw_impulse, force * h);
  impacts_.peak_force = std::max(impacts_.peak_force, force);
  if (!impacts_.contacts.empty()) {
    impacts_.contacts.back().impulse = std::max(impacts_.contacts.back().impulse, sum_);
  }
  if (impacts_.windowed.empty() || s.time() - impacts_.windowed.back().first > 0.001 - h / 2) {
    impacts_.windowed.emplace_back(s.time(), sum_);
  }
  const sim::ContactPoint& head = model_->robot()->contacts.at(head_);
  sim::Matrix3Xd J = sim::Matrix3Xd::Zero(3, model_->nv());
  s.pointJacobian(model_->body(head.body), head.p_BP, J);
  const sim::Vector3d v = J * s.v();
  head_velocities_.push_back(v);
  if (static_cast<int>(head_velocities_.size()) > window_) {
    const double acceleration = (v - head_velocities_.front()).norm() / (window_ * h);
    impacts_.peak_head = std::max(impacts_.peak_head, acceleration);
    head_velocities_.pop_front();
  }
}

void ImpulseMeter::commanded(const motion::Moment& /*m*/, const control::Command& /*c*/,
                             const sim::Torque& torque) {
  for (const sim::Joint& j : model_->joints()) {
    if (j.motor < 0) continue;
    impacts_.peak_torque =
        std::max(impacts_.peak_torque, std::abs(torque.tau[j.motor]) / j.limit.torque);
  }
}

void ImpulseMeter::note(const std::string& part, double time) {
  impacts_.head_hit = impacts_.head_hit || part == head_;
  for (const GroundContact& c : impacts_.contacts) {
    if (c.part == part) return;
  }
  impacts_.contacts.push_back({part, time, 0});
}

}  // namespace traceur::fall
