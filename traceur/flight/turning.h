// How a body turns in flight while its inertia changes.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace traceur::flight {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The attitude of a body in flight, of which nothing but the angular momentum L about the COM
/// stays [Ha2015, §3.4.1, Eq. 3-4]:
///
///     Ṙ = [ω]ₓ R,   ω = R I_B⁻¹ Rᵀ L,   I_B(t) from `from` to `to`, element by element
///
/// by midpoint steps of at most kStep on the rotations. What a changing pose does by its own
/// momentum is left out, as there.
/// @param R         attitude at the beginning, world from body
/// @param L         about the COM, world axes [kg·m²/s]
/// @param from, to  inertia about the COM in the body's axes [kg·m²]
/// @param duration  [s]; ≤ 0: none
Matrix3d turned(Matrix3d R, const Vector3d& L, const Matrix3d& from, const Matrix3d& to,
                double duration);

/// [ours: at 8 rad/s a step turns by 0.16 rad, and a second of flight errs by less than 1e-3 rad]
inline constexpr double kStep = 0.02;

/// A rotation as divers count it [Yeadon1990]: a somersault forward about the left axis, which is
/// tilted down to the left and headed from x towards y [rad]; each in (-π, π], and
///
///     R = Rz(heading) Rx(-tilt) Ry(somersault)
struct Turn {
  double somersault = 0, tilt = 0, heading = 0;

  static Turn of(const Matrix3d& R);
};

}  // namespace traceur::flight
