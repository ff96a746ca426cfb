// Forces and moments exerted through the joints.
#pragma once

#include <vector>

#include "traceur/sim/snapshot.h"

namespace traceur::control {

using Eigen::VectorXd;

/// A force at a point of a body or at the COM, and a moment on the body, as joint torques would
/// give them to a robot that is held: τ = Jᵀ f + J_ωᵀ m. [Ha2015, §7.4.1]
struct VirtualForce {
  sim::BodyId body = {};
  sim::Vector3d p_BP = sim::Vector3d::Zero();    ///< in the body's frame [m]
  sim::Vector3d f = sim::Vector3d::Zero();       ///< world axes [N]
  bool at_com = false;                           ///< of the robot, instead of the body's point
  sim::Vector3d moment = sim::Vector3d::Zero();  ///< on the body, world axes [N·m]

  void addTorque(const sim::Snapshot& s, Eigen::Ref<VectorXd> tau) const;
};

/// What balances a force on other bodies, so that the robot as a whole is given nothing that the
/// ground would have to bear: each of them takes its share of
///
///     f' = -f,   m' = -(p - p') × f
///
/// about its own origin p', p where f is exerted. Nothing for no bodies.
std::vector<VirtualForce> reaction(const sim::Snapshot& s, const VirtualForce& force,
                                   const std::vector<sim::BodyId>& bodies);

}  // namespace traceur::control
