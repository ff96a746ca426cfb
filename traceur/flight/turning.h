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

/// Longest step [s] [ours: tests hold the energy of a rigid body within 1 % over a second]
inline constexpr double kStep = 0.02;

}  // namespace traceur::flight
