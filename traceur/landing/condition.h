// The landing condition: how a body should be turned when it meets the ground, learned from what
// became of touch-downs.
#pragma once

#include <span>
#include <vector>

#include "traceur/landing/falls.h"

namespace traceur::landing {

/// θ = a v + b w + c ω + d [Ha2015, §3.4.1, Eq. 1], v the COM's velocity upwards and w forward
/// [m/s], ω the forward somersault's spin [rad/s], θ the root's somersault [rad].
struct Plane {
  double up = 0, forward = 0, spin = 0;  ///< a, b, c
  double constant = 0;                   ///< d

  double at(double v_up, double v_forward, double spin_forward) const {
    return up * v_up + forward * v_forward + spin * spin_forward + constant;
  }
};

struct LandingCondition {
  Plane least, most;  ///< between the two of which landings mostly succeed

  /// The plane in the middle: what is wanted in the air.
  Plane wanted() const;
};

/// Sees where the successes among touch-downs are: `least` and `most` leave a share of kOutside of
/// them below and above, by quantile regression [Koenker1978]; the dissertation says only "a
/// maximum and a minimum plane".
/// @param falls  that touched down; who stands has succeeded
/// @throws InputError for fewer than kLeast successes
LandingCondition learnCondition(std::span<const Fall> falls);

inline constexpr double kOutside = 0.1;  ///< [ours]
inline constexpr int kLeast = 20;        ///< [ours: four numbers of each plane]

/// The conditions of a landing skill under which it begins just above the ground, in any attitude
/// near the one it wants.
/// @param hands  that meet the ground first, instead of the feet
/// @throws InputError as drawFalls()
std::vector<VectorXd> drawTouchDowns(const skill::Skill& skill, int count, std::uint64_t seed,
                                     bool hands = false);

}  // namespace traceur::landing
