#include "traceur/control/actuation.h"

#include <cassert>

namespace traceur::control {

Actuation::Actuation(StablePd pd)
    : pd_(std::move(pd)),
      model_(pd_.model()),
      gains_(pd_.gains().begin(), pd_.gains().end()),
      tau_(model_->nv()) {}

void Actuation::torque(const sim::Snapshot& s, const Command& command, sim::Torque& torque) {
  const auto joints = static_cast<Eigen::Index>(gains_.size());
  assert(command.target.q.size() == joints);
  for (const VectorXd* factors : {&command.stiffness, &command.damping}) {
    assert(factors->size() == 0 || factors->size() == joints);
    (void)factors;
  }
  for (Eigen::Index i = 0; i < joints; ++i) {
    pd_.gains()[i].kp = gains_[i].kp * (command.stiffness.size() > 0 ? command.stiffness[i] : 1);
    pd_.gains()[i].kd = gains_[i].kd * (command.damping.size() > 0 ? command.damping[i] : 1);
  }
  using Clamp = StablePd::Clamp;
  tau_.setZero();
  if (command.expected) {
    for (const VirtualForce& f : command.forces) f.addTorque(s, tau_);
    pd_.addTorque(s, command.target, tau_, command.limited ? Clamp::kSum : Clamp::kOwn);
  } else {
    pd_.addTorque(s, command.target, tau_, command.limited ? Clamp::kNone : Clamp::kOwn);
    for (const VirtualForce& f : command.forces) f.addTorque(s, tau_);
    for (size_t i = 0; command.limited && i < gains_.size(); ++i) {
      const int d = model_->joints()[i].v;
      tau_[d] = limitedTorque(tau_[d], s.v()[d], pd_.limits()[i]);
    }
  }
  toMotors(*model_, tau_, torque);
}

}  // namespace traceur::control
