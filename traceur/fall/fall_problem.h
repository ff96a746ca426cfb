// From a robot in a stance to a problem that can be planned.
#pragma once

#include "traceur/fall/planner.h"

namespace traceur::fall {

struct FallProblemOptions {
  PostImpact post_impact = PostImpact::kComVelocity;
  Stall stall = Stall::kStops;
  int poses = 10'000;      ///< of the reach tables
  std::uint64_t seed = 1;  ///< of the reach tables
};

/// Mass and inertia are those of the stance, bounds those of the file. Time between contacts is
/// looked at every eighth of √(r₁/g) and the cells of the reach tables are a twentieth of r₁, both
/// of the stance [ours: 17 ms and 1 cm of BioloidGP, 41 ms and 5 cm of Atlas].
FallProblem fallProblem(const SagittalBody& body, const FallRobot& falls,
                        const FallProblemOptions& options = {});

/// A robot's contact points, but for those of the node it turns about, as they are.
std::vector<HeldPart> heldParts(const SagittalBody& body, const sim::Snapshot& s, int pivot);

}  // namespace traceur::fall
