#include "traceur/flight/turning.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace traceur::flight {
namespace {

Matrix3d rotation(const Vector3d& by) {
  const double angle = by.norm();
  if (!(angle > 0)) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, by / angle).toRotationMatrix();
}

}  // namespace

Matrix3d turned(const Matrix3d& R, const Vector3d& L, const Matrix3d& inertia, double duration) {
  if (!(duration > 0)) return R;
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / kStep - 1e-9)));
  const double dt = duration / steps;
  const Matrix3d inverse = inertia.inverse();
  Matrix3d now = R;
  for (int k = 0; k < steps; ++k) {
    // Seen from the body L turns the other way: d/dt L_B = L_B × ω_B.
    const Vector3d L_B = now.transpose() * L;
    const Vector3d middle = L_B + dt / 2 * L_B.cross(inverse * L_B);
    now *= rotation(dt * (inverse * middle));
  }
  return now;
}

PoseChange::PoseChange(const Changing& begin, const Changing& middle, const Changing& end) {
  for (int k = 0; k < 2 * kSteps; ++k) {
    const double s = static_cast<double>(k) / (2 * kSteps);
    const auto at = [s](const auto& a, const auto& b, const auto& c) {
      return ((1 - s) * (1 - 2 * s) * a + 4 * s * (1 - s) * b + s * (2 * s - 1) * c).eval();
    };
    const auto i = static_cast<size_t>(k);
    inverse_[i] = at(begin.inertia, middle.inertia, end.inertia).inverse();
    drift_[i] = inverse_[i] * at(begin.momentum, middle.momentum, end.momentum);
  }
}

Matrix3d turned(const Matrix3d& R, const Vector3d& L, const PoseChange& by, double duration) {
  if (!(duration > 0)) return R;
  const double dt = duration / PoseChange::kSteps;
  const auto spin = [&](size_t k, const Vector3d& L_B) -> Vector3d {
    return by.inverse_[k] * L_B - by.drift_[k] / duration;
  };
  Matrix3d now = R;
  for (size_t k = 0; k < by.inverse_.size(); k += 2) {
    const Vector3d L_B = now.transpose() * L;
    const Vector3d middle = L_B + dt / 2 * L_B.cross(spin(k, L_B));
    now *= rotation(dt * spin(k + 1, middle));
  }
  return now;
}

}  // namespace traceur::flight
