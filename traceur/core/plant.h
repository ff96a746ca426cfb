// Something that moves and can be driven, one step at a time.
#pragma once

#include <Eigen/Core>

namespace traceur {

/// A model, a corrected model, another simulator or a machine: whoever learns or controls knows no
/// more of it.
class Plant {
 public:
  using VectorXd = Eigen::VectorXd;

  virtual ~Plant() = default;
  virtual int states() const = 0;       ///< size of the state
  virtual int inputs() const = 0;       ///< size of the input
  virtual double timeStep() const = 0;  ///< [s]

  /// Begins an episode. Equal resets and inputs give equal states, but for a plant that says it is
  /// noisy or a machine.
  /// @param x  (states)
  virtual void reset(const VectorXd& x) = 0;
  /// Holds an input, (inputs), for one time step.
  virtual void step(const VectorXd& u) = 0;
  /// What can be seen of the state now, (states).
  virtual const VectorXd& state() const = 0;
};

}  // namespace traceur
