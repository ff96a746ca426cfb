// Which joints of a robot are a left and a right one.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "traceur/sim/world.h"

namespace traceur::sim {

/// The plane that halves a robot at joint angles 0, upright: left·p = offset.
struct SagittalPlane {
  Vector3d left = Vector3d::UnitY();  ///< its normal, unit and level
  double offset = 0;                  ///< [m]

  /// A point's distance from it, to the left [m].
  double side(const Vector3d& p) const { return left.dot(p) - offset; }
  Vector3d mirrored(const Vector3d& p) const { return p - 2 * side(p) * left; }
};

struct Mirroring {
  SagittalPlane plane;
  std::map<std::string, MirroredPair> pairs;
  /// Pairs by name that are none by place or axis, "l_arm and r_arm".
  std::vector<std::string> refused;
};

/// Finds a robot's left-right pairs. Two joints are one if their names differ in nothing but left
/// and right (l and r), or, where a name says no side, by their places alone; and if the mirror
/// image of the left axis is the right one. A reflection P turns a rotation about a into one about
/// -P a, and a translation along a into one along P a:
///
///     sign = sgn(a_right · (-P a_left))   hinges,   sgn(a_right · P a_left)   slides
///
/// The plane is what lies in the middle of the joints that names pair; without any, y = 0.
/// A pair is called what its names share, "left_hip_joint" and "right_hip_joint": "hip".
/// @param world  at joint angles 0
Mirroring mirroringOf(const World& world);

}  // namespace traceur::sim
