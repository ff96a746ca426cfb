// What a controller asks of a robot's motors, and the one place that makes torques of it.
#pragma once

#include <vector>

#include "traceur/control/stable_pd.h"
#include "traceur/control/virtual_force.h"

namespace traceur::control {

/// What is asked for one step.
struct Command {
  JointTarget target;  ///< by joint [rad | m]
  VectorXd stiffness;  ///< by joint: factor on kp; empty: 1
  VectorXd damping;    ///< by joint: factor on kd; empty: 1. Where both are 0 a joint is limp.
  std::vector<VirtualForce> forces;
  bool limited = true;  ///< whether the forces' torques count against the motors' limits
  /// Whether the PD control reckons with them. It then holds its target against what they would do;
  /// else it lets them move the body as they like.
  bool expected = true;
};

/// Virtual forces, PID control, and one clamp of what motors have to give:
///
///     τ₀ = Σ Jᵀ f
///     τ = clamp(τ₀ + PID(q, v, τ₀ or 0))   limited, else   τ₀ + clamp(PID(q, v, τ₀ or 0))
///
/// with the robot's gains times the command's factors, kᵢ with the stiffness. The integral alone
/// never asks for more than the motor's limit, so that it does not wind up [ours].
///
/// Life of an actuation: holdFor() and begin() once a trial, torque() whenever a command is given.
class Actuation {
 public:
  explicit Actuation(StablePd pd);

  /// Each torque holds for so long; at first for the model's time step [s].
  void holdFor(double interval);
  /// @param integral  of the errors so far, by joint [rad·s]; empty: none
  void begin(const VectorXd& integral = {});
  const VectorXd& integral() const { return integral_; }
  void torque(const sim::Snapshot& s, const Command& command, sim::Torque& torque);

  const sim::Model& model() const { return *model_; }
  std::span<const sim::JointLimit> limits() { return pd_.limits(); }

 private:
  void integrate(const sim::Snapshot& s, const JointTarget& target);

  StablePd pd_;
  std::shared_ptr<const sim::Model> model_;
  std::vector<sim::JointGain> gains_;
  double interval_;
  VectorXd integral_;  // of q* - q, by joint [rad·s]
  VectorXd tau_;       // (nv)
};

}  // namespace traceur::control
