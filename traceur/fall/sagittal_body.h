// A robot seen from the side: where its parts, its COM and its momentum are in the plane of a fall.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "traceur/fall/fall_robot.h"
#include "traceur/fall/pendulum.h"
#include "traceur/sim/world.h"

namespace traceur::fall {

/// The plane of a fall: x along the fall's direction, y up, origin on the ground under the world's.
class SagittalBody {
 public:
  /// @param model  of a scene with the robot whose contact points the setup names
  SagittalBody(std::shared_ptr<const sim::Model> model, FallSetup setup);

  const std::shared_ptr<const sim::Model>& model() const { return model_; }
  const FallSetup& setup() const { return setup_; }

  Vector2d inPlane(const sim::Vector3d& p) const { return {sign_ * p.x(), p.z()}; }
  Vector2d com(const sim::Snapshot& s) const { return inPlane(s.com()); }
  Vector2d comVelocity(const sim::Snapshot& s) const { return inPlane(s.comVelocity()); }
  /// A contact point of the robot's file.
  sim::Vector3d point(const sim::Snapshot& s, const std::string& name) const;
  /// The contact point of a body's that is nearest to a place on it, or the body's name.
  std::string partAt(const sim::Snapshot& s, sim::BodyId body, const sim::Vector3d& p_W) const;
  /// The mean of a node's points.
  Vector2d node(const sim::Snapshot& s, int node) const;
  /// The robot as a pendulum about a node.
  PendulumState pendulum(const sim::Snapshot& s, int node) const;
  /// θ₂ from the rod of a pendulum about `from` to the part `to` [rad], in (-π, π].
  double stopperAngle(const sim::Snapshot& s, int from, int to) const;
  /// Of the whole body about its COM, joints locked, about the axis across the plane [kg·m²].
  double inertia(const sim::State& state) const;

 private:
  std::shared_ptr<const sim::Model> model_;
  FallSetup setup_;
  double sign_;
};

/// A joint that a plan moves, or a left and a right one that it moves alike.
struct MovedJoint {
  std::string name;
  std::string other;  ///< "": none
  double sign = 1;    ///< other = sign·name
  double min = 0;     ///< of name: the robot's limit, or less of it where falls.toml says so [rad]
  double max = 0;
};

/// The joints of a robot's falls.toml; a pair moves alike unless a node of the graph hangs on one
/// side of it only.
/// @throws InputError for a range that has nothing in common with the joint's limits
std::vector<MovedJoint> movedJoints(const SagittalBody& body, const FallRobot& falls);

/// θ in (-π, π].
double wrapped(double angle);

}  // namespace traceur::fall
