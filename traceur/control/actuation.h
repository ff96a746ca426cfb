// What a controller asks of a robot's motors, and the one place that makes torques of it.
#pragma once

#include <vector>

#include "traceur/control/stable_pd.h"

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

/// Virtual forces, PD control, and one clamp of what motors have to give:
///
///     τ₀ = Σ Jᵀ f,   τ = clamp(τ₀ + PD(q, v, τ₀ or 0))   limited, else   τ₀ + clamp(PD(q, v, τ₀ or
///     0))
///
/// with the robot's gains times the command's factors.
class Actuation {
 public:
  explicit Actuation(StablePd pd);

  void torque(const sim::Snapshot& s, const Command& command, sim::Torque& torque);

  const sim::Model& model() const { return *model_; }
  std::span<const sim::JointLimit> limits() { return pd_.limits(); }

 private:
  StablePd pd_;
  std::shared_ptr<const sim::Model> model_;
  std::vector<sim::JointGain> gains_;
  VectorXd tau_;  // (nv)
};

}  // namespace traceur::control
