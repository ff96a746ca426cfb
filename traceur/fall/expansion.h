// What can be done from a state of a fall.
#pragma once

#include <vector>

#include "traceur/fall/planner.h"

namespace traceur::fall {

/// All that may happen next, without what a fall that stops by itself makes needless.
struct Expansion {
  bool stops = false;  ///< some ṙ₁ ends the fall without another contact
  std::vector<PlannedContact> contacts;
};

/// Tries every action; fills `out`, whose memory is used again.
void expand(const FallProblem& problem, const FallState& from, Expansion& out);

/// Whether an impact ended the fall: the pendulum is thrown back, or, where stalling stops it, has
/// not the energy to pass over its new pivot.
bool stopped(const FallProblem& problem, const PendulumState& after);

}  // namespace traceur::fall
