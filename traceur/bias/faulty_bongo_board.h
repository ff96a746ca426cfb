// The bongo board's model with the faults a person would look for first, and how to find them in
// logs: what a bias model is to be measured against.
#pragma once

#include <vector>

#include "traceur/bias/bongo_board.h"
#include "traceur/bias/dynamics_bias.h"

namespace traceur::bias {

/// Faults with a formula.
struct BongoModelFaults {
  double inertia_scale = 1;     ///< on every mass and moment of inertia
  double delay = 0;             ///< from a reading to the torque that answers it [s]
  double coulomb_friction = 0;  ///< of both ankles together [N·m]
  double viscous_friction = 0;  ///< the same [N·m·s/rad]
  double com_offset = 0;        ///< of the pelvis, along its bar [m]: its weight alone
};

/// BongoBoard with faults. Before a reset no torque was asked for.
class FaultyBongoBoard : public Plant {
 public:
  FaultyBongoBoard(const BongoParameters& parameters, const BongoModelFaults& faults,
                   double time_step = 0.001);

  int states() const override { return 6; }
  int inputs() const override { return 1; }
  double timeStep() const override { return board_.timeStep(); }
  void reset(const VectorXd& x) override;
  void step(const VectorXd& u) override;
  const VectorXd& state() const override { return x_; }

  /// What was asked for before now, the latest last.
  void setPast(const Eigen::Ref<const VectorXd>& torques);

 private:
  BongoBoard board_;
  BongoModelFaults faults_;
  double offset_moment_;      // of an upright board [N·m]
  std::vector<double> late_;  // the torques asked for, in a ring
  size_t now_ = 0;
  double part_ = 0;  // of a step by which the delay exceeds whole ones
  VectorXd x_ = VectorXd::Zero(6);
};

/// The faults with which the model comes closest to what was seen: the least mean square of
///
///     (x_{t+k} - Φ_k(x_t, u_t … u_{t+k-1})) / its standard deviation under the faultless model
///
/// over all rates, every `stride` steps of the logs, by NLopt's Subplex. Delays up to 20 ms are
/// looked for, inertia from a half to twice, friction to 20 N·m (·s/rad), offsets to 2 cm.
/// @return the faults; none without logs
BongoModelFaults identify(const std::vector<RunLog>& logs, const BongoParameters& board,
                          const BiasOptions& options,
                          const std::function<bool(const VectorXd& x)>& keep);

}  // namespace traceur::bias
