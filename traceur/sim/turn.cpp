#include "traceur/sim/turn.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace traceur::sim {

Turn Turn::of(const Eigen::Matrix3d& R) {
  using Eigen::Vector3d;
  const Vector3d left = R.col(1);
  const Vector3d up = R.col(2);
  const Vector3d forward = left.cross(Vector3d::UnitZ()).normalized();
  return {std::atan2(up.dot(forward), up.dot(forward.cross(left))),
          -std::asin(std::clamp(left.z(), -1.0, 1.0)), std::atan2(forward.y(), forward.x())};
}

}  // namespace traceur::sim
