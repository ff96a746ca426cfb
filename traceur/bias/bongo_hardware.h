// What stands for the real bongo board: another engine, with contacts, noise and the faults of a
// machine [Ha2015, §8.5.1].
#pragma once

#include <memory>

#include "traceur/bias/bongo_board.h"

namespace traceur::bias {

/// How the machine differs from BongoBoard's model of it. The defaults are a machine that is built
/// as the model says and measures exactly.
struct BongoFaults {
  double inertia_scale = 1;     ///< on every mass and moment of inertia
  double torque_variance = 0;   ///< white noise on the torque that acts [N²·m²]
  double angle_variance = 0;    ///< white noise on the angles that are read [rad²]
  double rate_variance = 0;     ///< the same of their rates [rad²/s²]
  double delay = 0;             ///< from a reading to the torque that answers it [s], whole steps
  double coulomb_friction = 0;  ///< of both ankles together [N·m]
  double viscous_friction = 0;  ///< the same [N·m·s/rad]
  double com_offset = 0;        ///< of the pelvis, along its bar [m]
  double torque_gain = 1;       ///< of what is asked for, what acts
  double encoder_step = 0;      ///< of the angles that are read [rad]; 0: exact
  double ground_friction = 0.447;  ///< between wheel and ground: the paper's surfaces, mixed
  double board_friction = 1;       ///< between wheel and board
};

/// Rigid bodies in Box2D 2.4: wheel, board, two legs and a pelvis bar, hinged; wheel and board
/// touch and may slip or part. The torque is shared by both ankles. State and input as
/// BongoBoard's, read through the faults.
///
/// A reset builds the world anew, so that nothing of an episode is left for the next. Noise is
/// drawn from (seed, episode, step): equal seeds and equal histories of resets give equal bits.
class BongoHardware : public Plant {
 public:
  BongoHardware(const BongoParameters& parameters, const BongoFaults& faults,
                std::uint64_t seed = 1, double time_step = 0.001);
  ~BongoHardware() override;

  int states() const override { return 6; }
  int inputs() const override { return 1; }
  double timeStep() const override;
  void reset(const VectorXd& x) override;
  void step(const VectorXd& u) override;
  const VectorXd& state() const override;

  /// The state without noise and steps of encoders.
  const VectorXd& trueState() const;
  /// The board rests on the wheel.
  bool boardOnWheel() const;
  /// Of the lower board end [m].
  double boardHeight() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace traceur::bias
