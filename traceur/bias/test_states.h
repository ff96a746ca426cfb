// States of the bongo board that several tests begin with or choose.
#pragma once

#include <Eigen/Core>

namespace traceur::bias {

/// At rest, the board tilted by ab [rad] and all else 0, (6).
inline Eigen::VectorXd tilted(double ab) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  x[1] = ab;
  return x;
}

/// Chooses every state.
inline bool all(const Eigen::VectorXd&) {
  return true;
}

}  // namespace traceur::bias
