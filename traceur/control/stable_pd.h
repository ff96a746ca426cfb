// Joint PD control that stays stable at any gain, and the limits of real motors.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "traceur/sim/snapshot.h"
#include "traceur/sim/world.h"

namespace traceur::control {

using Eigen::VectorXd;

/// Joint angles to reach, in the order of sim::Model::joints() [rad].
struct JointTarget {
  VectorXd q;
};

/// Stable proportional-derivative control: the torque an implicit integrator would see at the end
/// of the step,
///
///     (M + K_d Δt) v̇ = f_ext + τ₀ − K_p (q + v Δt − q*) − K_d v
///     τ = −K_p (q + v Δt − q*) − K_d (v + v̇ Δt)                       [Tan2011, Eq. 5-7]
///
/// and K_i ∫ (q* − q) dt with both where a joint has an integral gain [ours],
/// so that gains far above those an explicit controller could hold neither ring nor explode: the
/// published kp = 60, kd = 3 on links of 10⁻⁴ kg·m² are stable at 2 ms. f_ext are gravity,
/// Coriolis, passive and last step's contact forces, τ₀ what other controllers have already added,
/// as far as motors exert it: not the root's rows of a virtual force. The engine's own joint
/// damping, implicit too, is in f_ext alone: a joint with much of it is predicted some per cent
/// too quick.
class StablePd {
 public:
  /// @param gains  by index in model.joints()
  StablePd(std::shared_ptr<const sim::Model> model, std::vector<sim::JointGain> gains);

  /// What limitedTorque() clamps: a joint's sum of what tau held and what is added, as its motor
  /// can give it, or what is added alone, where the rest is not meant to be the motor's, or
  /// nothing.
  enum class Clamp { kSum, kOwn, kNone };

  /// Adds the torque, (nv) [N·m], each joint clamped at most once with its own limit.
  /// @param integral  of q* − q until now, by joint [rad·s]; null: 0
  void addTorque(const sim::Snapshot& s, const JointTarget& target, Eigen::Ref<VectorXd> tau,
                 Clamp clamp = Clamp::kSum, const VectorXd* integral = nullptr);

  /// Each torque holds for so long, Δt above; at first for the model's time step [s].
  void holdFor(double interval) { interval_ = interval; }

  /// The limits and gains in force, by index in model.joints(); the limits are the robot's at
  /// first.
  std::span<sim::JointLimit> limits() { return limits_; }
  std::span<sim::JointGain> gains() { return gains_; }
  const std::shared_ptr<const sim::Model>& model() const { return model_; }

 private:
  std::shared_ptr<const sim::Model> model_;
  std::vector<sim::JointGain> gains_;
  std::vector<sim::JointLimit> limits_;
  double interval_;
  VectorXd damping_;  // (nv), K_d Δt
  VectorXd vdot_;     // (nv)
};

/// What a motor can give of the torque asked for [N·m] at joint speed v [rad/s]: at most
/// limit.torque in magnitude and, where it would speed the joint up, fading to nothing between
/// 90 % and 100 % of limit.speed [ours: narrow, so that the two limits mean what they say].
/// Braking is never reduced by speed.
double limitedTorque(double torque, double v, const sim::JointLimit& limit);

/// Generalised torque (nv) to motor command (nu). The one place where the root's six rows, which
/// no motor can give, are dropped.
void toMotors(const sim::Model& model, const VectorXd& tau, sim::Torque& command);

/// The robot's default controller: its own gains and limits. Joints without a gain get none.
StablePd defaultController(std::shared_ptr<const sim::Model> model);

/// The angles of a state, as a target.
JointTarget targetOf(const sim::Model& model, const sim::State& state);

}  // namespace traceur::control
