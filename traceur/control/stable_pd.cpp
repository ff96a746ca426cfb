#include "traceur/control/stable_pd.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::control {

StablePd::StablePd(std::shared_ptr<const sim::Model> model, std::vector<sim::JointGain> gains)
    : model_(std::move(model)),
      gains_(std::move(gains)),
      interval_(model_->timeStep()),
      damping_(VectorXd::Zero(model_->nv())),
      vdot_(model_->nv()) {
  assert(gains_.size() == model_->joints().size());
  for (const sim::Joint& j : model_->joints()) limits_.push_back(j.limit);
}

void StablePd::addTorque(const sim::Snapshot& s, const JointTarget& target,
                         Eigen::Ref<VectorXd> tau, Clamp clamp, const VectorXd* integral) {
  const std::vector<sim::Joint>& joints = model_->joints();
  const double dt = interval_;
  const auto q = s.q();
  const auto v = s.v();
  const auto summed = [&](size_t i) {
    return integral ? gains_[i].ki * (*integral)[static_cast<Eigen::Index>(i)] : 0;
  };
  s.externalForce(vdot_);
  for (size_t i = 0; i < joints.size(); ++i) {
    const int d = joints[i].v;
    if (joints[i].motor >= 0) vdot_[d] += tau[d];
    const double error = q[joints[i].q] + dt * v[d] - target.q[i];
    vdot_[d] -= gains_[i].kp * error + gains_[i].kd * v[d];
    if (gains_[i].ki > 0) vdot_[d] += summed(i);
    damping_[d] = gains_[i].kd * dt;
  }
  s.solveInertia(damping_, vdot_);
  for (size_t i = 0; i < joints.size(); ++i) {
    const int d = joints[i].v;
    const double error = q[joints[i].q] + dt * v[d] - target.q[i];
    double torque = -gains_[i].kp * error - gains_[i].kd * (v[d] + dt * vdot_[d]);
    if (gains_[i].ki > 0) torque += summed(i);
    switch (clamp) {
      case Clamp::kSum:
        tau[d] = limitedTorque(tau[d] + torque, v[d], limits_[i]);
        break;
      case Clamp::kOwn:
        tau[d] += limitedTorque(torque, v[d], limits_[i]);
        break;
      case Clamp::kNone:
        tau[d] += torque;
        break;
    }
  }
}

double limitedTorque(double torque, double v, const sim::JointLimit& limit) {
  static constexpr double kFade = 0.9;
  double most = limit.torque;
  if (torque * v > 0 && std::isfinite(limit.speed)) {
    const double fade =
        std::clamp((limit.speed - std::abs(v)) / ((1 - kFade) * limit.speed), 0.0, 1.0);
    if (fade == 0) return 0;  // also where there is no limit of torque
    most *= fade;
  }
  return std::clamp(torque, -most, most);
}

void toMotors(const sim::Model& model, const VectorXd& tau, sim::Torque& command) {
  assert(tau.size() == model.nv());
  command.tau.setZero(model.nu());
  for (const sim::Joint& j : model.joints()) {
    if (j.motor >= 0) command.tau[j.motor] = tau[j.v];
  }
}

StablePd defaultController(std::shared_ptr<const sim::Model> model) {
  std::vector<sim::JointGain> gains;
  for (const sim::Joint& j : model->joints()) {
    const sim::Robot* robot = model->robot().get();
    const auto gain = robot ? robot->gains.find(j.name) : decltype(robot->gains.end()){};
    gains.push_back(robot && gain != robot->gains.end() ? gain->second : sim::JointGain{});
  }
  return {std::move(model), std::move(gains)};
}

JointTarget targetOf(const sim::Model& model, const sim::State& state) {
  JointTarget target{VectorXd(model.joints().size())};
  for (size_t i = 0; i < model.joints().size(); ++i) {
    target.q[static_cast<Eigen::Index>(i)] = state.q[model.joints()[i].q];
  }
  return target;
}

}  // namespace traceur::control
