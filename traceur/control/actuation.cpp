#include "traceur/control/actuation.h"

#include <algorithm>
#include <cassert>

namespace traceur::control {

Actuation::Actuation(StablePd pd)
    : pd_(std::move(pd)),
      model_(pd_.model()),
      gains_(pd_.gains().begin(), pd_.gains().end()),
      interval_(model_->timeStep()),
      integral_(VectorXd::Zero(static_cast<Eigen::Index>(gains_.size()))),
      tau_(model_->nv()) {}

void Actuation::holdFor(double interval) {
  interval_ = interval;
  pd_.holdFor(interval);
}

void Actuation::begin(const VectorXd& integral) {
  assert(integral.size() == 0 || integral.size() == integral_.size());
  if (integral.size() > 0) {
    integral_ = integral;
  } else {
    integral_.setZero();
  }
}

void Actuation::torque(const sim::Snapshot& s, const Command& command, sim::Torque& torque) {
  const auto joints = static_cast<Eigen::Index>(gains_.size());
  assert(command.target.q.size() == joints);
  for (const VectorXd* factors : {&command.stiffness, &command.damping}) {
    assert(factors->size() == 0 || factors->size() == joints);
    (void)factors;
  }
  for (Eigen::Index i = 0; i < joints; ++i) {
    const double stiffness = command.stiffness.size() > 0 ? command.stiffness[i] : 1;
    pd_.gains()[i].kp = gains_[i].kp * stiffness;
    pd_.gains()[i].ki = gains_[i].ki * stiffness;
    pd_.gains()[i].kd = gains_[i].kd * (command.damping.size() > 0 ? command.damping[i] : 1);
  }
  integrate(s, command.target);
  using Clamp = StablePd::Clamp;
  tau_.setZero();
  if (command.expected) {
    for (const VirtualForce& f : command.forces) f.addTorque(s, tau_);
    pd_.addTorque(s, command.target, tau_, command.limited ? Clamp::kSum : Clamp::kOwn, &integral_);
  } else {
    pd_.addTorque(s, command.target, tau_, command.limited ? Clamp::kNone : Clamp::kOwn,
                  &integral_);
    for (const VirtualForce& f : command.forces) f.addTorque(s, tau_);
    for (size_t i = 0; command.limited && i < gains_.size(); ++i) {
      const int d = model_->joints()[i].v;
      tau_[d] = limitedTorque(tau_[d], s.v()[d], pd_.limits()[i]);
    }
  }
  toMotors(*model_, tau_, torque);
}

void Actuation::integrate(const sim::Snapshot& s, const JointTarget& target) {
  for (size_t i = 0; i < gains_.size(); ++i) {
    const double ki = pd_.gains()[i].ki;
    if (!(ki > 0)) continue;
    double& sum = integral_[static_cast<Eigen::Index>(i)];
    const sim::Joint& joint = model_->joints()[i];
    sum += interval_ * (target.q[static_cast<Eigen::Index>(i)] - s.q()[joint.q]);
    const double most = pd_.limits()[i].torque / ki;
    sum = std::clamp(sum, -most, most);
  }
}

}  // namespace traceur::control
