#include "traceur/flight/turning.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace traceur::flight {
namespace {

Vector3d spin(const Matrix3d& R, const Vector3d& L, const Matrix3d& I) {
  return R * (I.inverse() * (R.transpose() * L));
}

Matrix3d rotation(const Vector3d& by) {
  const double angle = by.norm();
  if (!(angle > 0)) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, by / angle).toRotationMatrix();
}

}  // namespace

Matrix3d turned(Matrix3d R, const Vector3d& L, const Matrix3d& from, const Matrix3d& to,
                double duration) {
  if (!(duration > 0)) return R;
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / kStep - 1e-9)));
  const double dt = duration / steps;
  for (int k = 0; k < steps; ++k) {
    const auto inertia = [&](double s) -> Matrix3d { return from + (k + s) / steps * (to - from); };
    const Matrix3d middle = rotation(dt / 2 * spin(R, L, inertia(0))) * R;
    R = rotation(dt * spin(middle, L, inertia(0.5))) * R;
  }
  return R;
}

}  // namespace traceur::flight
