// How a body turns in flight, by its angular momentum and by changing its pose.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace traceur::flight {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The attitude of a rigid body in flight, of which nothing but the angular momentum L about the
/// COM stays [Ha2015, §3.4.1, Eq. 3]:
///
///     Ṙ = [ω]ₓ R,   ω = R I_B⁻¹ Rᵀ L
///
/// by midpoint steps of at most kStep.
/// @param R         attitude at the beginning, world from body
/// @param L         about the COM, world axes [kg·m²/s]
/// @param inertia   about the COM in the body's axes [kg·m²]
/// @param duration  [s]; ≤ 0: none
Matrix3d turned(const Matrix3d& R, const Vector3d& L, const Matrix3d& inertia, double duration);

/// Longest step [s] [ours: tests hold the energy of a rigid body within 1 % over a second]
inline constexpr double kStep = 0.02;

/// A body at one place s of a change of pose that goes from 0 to 1.
struct Changing {
  Matrix3d inertia;  ///< about the COM, root's axes [kg·m²]
  /// Angular momentum about the COM at ṡ = 1 with the root held, root's axes [kg·m²]
  Vector3d momentum;
};

/// A change of pose, which turns the root even where there is no angular momentum:
///
///     ω_B = I_B(s)⁻¹ (Rᵀ L − h_B(s) ṡ)
///
/// The dissertation leaves h_B out [Ha2015, §3.4.1, Eq. 4]; it turns a person by tens of degrees.
/// I_B and h_B are parabolas through three places.
class PoseChange {
 public:
  PoseChange(const Changing& begin, const Changing& middle, const Changing& end);

 private:
  friend Matrix3d turned(const Matrix3d& R, const Vector3d& L, const PoseChange& by,
                         double duration);
  static constexpr int kSteps = 5;
  std::array<Matrix3d, 2 * kSteps> inverse_;  // of the inertia, at the steps' begins and middles
  std::array<Vector3d, 2 * kSteps> drift_;    // I⁻¹ h there
};

/// The attitude after a change of pose, at an even rate.
/// @param duration  that it takes [s]; ≤ 0: it is left out
Matrix3d turned(const Matrix3d& R, const Vector3d& L, const PoseChange& by, double duration);

}  // namespace traceur::flight
