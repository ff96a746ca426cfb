// Poses that differ in how hard they are to turn.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "traceur/flight/turning.h"
#include "traceur/sim/world.h"

namespace traceur::flight {

using Eigen::VectorXd;

/// A pose that a robot may take in flight.
struct FlightPose {
  VectorXd joints;   ///< by joint [rad]
  Matrix3d inertia;  ///< about the COM, in the root's axes [kg·m²]
};

/// The pose's inertia.
/// @param world   scratch, of the robot's model
/// @param joints  by joint [rad]
FlightPose flightPose(sim::World& world, const VectorXd& joints);

/// From many poses, `count` that are as unlike as can be [Ha2015, §3.4.1, Eq. 5]: the first is
/// `seed_pose`, each other one argmax min_j ‖I(q) − I(q_j)‖ (Frobenius) of what is left.
///
/// The dissertation takes them from a clip of a person stretching; ours are drawn: of each pair of
/// joints, and of each that has no partner, an angle between its limits, small ones more often; in
/// one draw of four the two of a pair differ. Poses that touch themselves are left out.
/// @param seed_pose  by joint [rad]
std::vector<FlightPose> unlikePoses(const std::shared_ptr<const sim::Model>& model,
                                    const VectorXd& seed_pose, int count, std::uint64_t seed = 1);

}  // namespace traceur::flight
