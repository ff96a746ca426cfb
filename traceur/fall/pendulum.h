// A falling humanoid as a stick with a prop: a telescopic inverted pendulum that pivots about its
// centre of pressure, and a massless rod, the stopper, that can be put to the ground ahead of it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "traceur/core/gravity.h"

namespace traceur::fall {

using Eigen::Vector2d;

/// Where the fall goes after an impact. All three let the tip of the stopper stop vertically.
enum class PostImpact {
  kComVelocity,  ///< the COM keeps the velocity that the vertical impulse left it [default]
  kBodyRate,     ///< the rod turns as the body does after the impulse, [Ha2015, Eq. 14] to the word
  kSticking      ///< the tip stops horizontally too: angular momentum about it is kept
};

/// What is constant during a fall. The sagittal plane: x along the fall, y up, both from the pivot.
struct PendulumModel {
  double mass = 0;     ///< [kg]
  double inertia = 0;  ///< of the body about its COM, of the pose the fall begins in [kg·m²]
  double gravity = kGravity;  ///< [m/s²]
  double step = 0.001;        ///< of the integration [s]
  PostImpact post_impact = PostImpact::kComVelocity;
  /// The author's published trace was made with the opposite sign of the Coriolis term; only for
  /// comparing with it.
  bool reversed_coriolis = false;
};

/// Angles are from the vertical, positive towards the fall.
struct PendulumState {
  double theta = 0;       ///< θ₁ of the rod from the pivot to the COM [rad]
  double r = 0;           ///< r₁, its length [m]
  double theta_rate = 0;  ///< [rad/s]
  double r_rate = 0;      ///< [m/s]

  Vector2d com() const;          ///< [m]
  Vector2d comVelocity() const;  ///< [m/s]

  /// Seen from a pivot: the COM's place from it, and its velocity.
  static PendulumState of(const Vector2d& com, const Vector2d& velocity);
};

/// One step of semi-implicit Euler, the rod's length driven at rod_rate:
///
///     θ̈₁ = (g sin θ₁ - 2 ṙ₁ θ̇₁) / r₁,     ṙ₁ = rod_rate      [Ha2015, Eq. 11-13]
///
/// The length controller of Eq. 13 reaches the rate within one step, so that ṙ₁ before does not
/// matter.
void step(const PendulumModel& model, double rod_rate, PendulumState& s);

/// Length r₂ at which a stopper at θ₂ (from the prolonged rod, sense of θ₁) meets the ground;
/// nothing where it points up or would be longer than a hundred times the rod.
std::optional<double> stopperLength(const PendulumState& s, double theta2);

/// What the stopper at θ₂ does to the fall when it meets the ground now.
struct Impact {
  double impulse = 0;   ///< j, vertical [N·s]
  double length = 0;    ///< r₂, which becomes r₁ of the next pendulum [m]
  double advance = 0;   ///< x₂, from the pivot to the next one [m]
  PendulumState after;  ///< about the next pivot
};

/// With d = x₂ - x₁ and y₂' = y₁' - d θ₁' the velocity of the tip,
///
///     j = -y₂' / (1/m + d²/I),   y₁'⁺ = y₁' + j/m,   ω⁺ = θ₁' - d j/I      [Ha2015, Eq. 14-16]
///
/// and the next pendulum about the tip by PostImpact. Nothing when the tip cannot reach the ground
/// or does not approach it.
std::optional<Impact> impact(const PendulumModel& model, const PendulumState& s, double theta2);

}  // namespace traceur::fall
