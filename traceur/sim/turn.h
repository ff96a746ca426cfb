// A rotation as divers count it.
#pragma once

#include <Eigen/Core>

namespace traceur::sim {

/// A somersault forward about the left axis, which is tilted down to the left and headed from x
/// towards y [rad] [Yeadon1990]; somersault and heading in (-π, π], tilt in [-π/2, π/2], and
///
///     R = Rz(heading) Rx(-tilt) Ry(somersault)
///
/// The heading stays while a body somersaults. Where left is straight up or down they are no
/// numbers.
struct Turn {
  double somersault = 0, tilt = 0, heading = 0;

  static Turn of(const Eigen::Matrix3d& R);
};

}  // namespace traceur::sim
