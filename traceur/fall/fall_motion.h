// A plan as poses that a robot can follow.
#pragma once

#include <string>
#include <vector>

#include "traceur/fall/pose_solver.h"

namespace traceur::fall {

/// A plan as a robot can follow it: a pose a contact, each tracked until the contact is made.
struct FallMotion {
  struct Stage {
    int node = 0;                     ///< of the graph: what is to touch
    std::vector<std::string> points;  ///< any of which on the ground ends it
    double duration = 0;              ///< planned [s]
    double rod_rate = 0;              ///< ṙ₁ until then [m/s]
    std::vector<sim::State> poses;  ///< on the way there, evenly in time; the last when it touches
  };
  std::vector<Stage> stages;
  sim::State rest;  ///< held after the last contact
};

/// The poses that lead through a plan's contacts, and to rest after the last.
/// @param made   contacts made before the plan's pivot, which are kept as far as that costs little
/// @param start  what it was planned from: without contacts there, only how to come to rest
/// @param pose   the robot's then
FallMotion motionOf(const FallPlan& plan, const PendulumModel& model, const SagittalBody& body,
                    PoseSolver& poses, const FallTracking& tracking, const FallState& start,
                    const std::vector<PoseSolver::Goal>& made, const sim::State& pose);

}  // namespace traceur::fall
