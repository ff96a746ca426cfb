// How far the engine's shapes reach.
#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <optional>

namespace traceur::sim {

/// The point of a geom that is farthest along u (unit, world axes) [m], exact for the primitive
/// shapes and meshes; none for what has no end. The geom's place is d's.
std::optional<Eigen::Vector3d> farthestPoint(const mjModel* m, const mjData* d, int geom,
                                             const Eigen::Vector3d& u);

}  // namespace traceur::sim
