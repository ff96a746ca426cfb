// What a skill happens in: a robot, the ground and a few props, composed into one Model.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "traceur/core/gravity.h"
#include "traceur/sim/robot.h"

namespace traceur::sim {

/// How a surface of the scene meets the robot (its material then decides) or another one (the
/// larger friction then counts). Contact softness decides impact forces, so every comparison fixes
/// it.
struct Material {
  double friction = 1.0;  ///< Coulomb coefficient
  double rolling = 0.0;   ///< rolling friction as a lever arm [m]; 0: rolls on
  /// Time constant of the contact's spring [s], MuJoCo's solref; the solver needs
  /// at least twice the time step. 0.004 s sinks 0.01 mm under a standing BioloidGP [ours: stiff
  /// enough to stand on, soft enough for steps of 2 ms].
  double compliance = 0.004;
  /// Of that spring: 1 throws nothing back; with less, a body of frequency 1 / (compliance ·
  /// damping_ratio) [rad/s] on it bounces.
  double damping_ratio = 1;
};

/// A body or obstacle beside the robot.
struct Prop {
  enum class Shape { kBox, kBall, kCapsule };
  std::string name;
  Shape shape = Shape::kBox;
  /// Half lengths (box), {radius, ·, ·} (ball), {radius, half length of the axis, ·} (capsule) [m].
  Vector3d size = Vector3d::Constant(0.1);
  Vector3d position = Vector3d::Zero();  ///< centre, world [m]
  Vector3d rpy = Vector3d::Zero();       ///< fixed axes [rad]
  double mass = 0;                       ///< [kg]; 0: fixed to the world
  bool hollow = false;                   ///< a ball's mass in its shell: I = 2/3 m r²
  Material material = {};
};

/// An upright slab to run into, fixed to the world, of 0.2 m behind its face, which is `width` by
/// `height` [m]. The face stands with the middle of its foot on `position` [m] and looks along
/// `yaw` [rad, about z; 0: along x].
Prop wall(std::string name, const Vector3d& position, double yaw, double width, double height);
/// A round bar between two points [m] of a radius [m], fixed to the world.
Prop rail(std::string name, const Vector3d& from, const Vector3d& to, double radius);

struct Scene {
  std::shared_ptr<const Robot> robot = nullptr;  ///< may be null: props alone
  bool ground = true;                            ///< the plane z = 0
  Material ground_material = {};
  std::vector<Prop> props = {};
  /// Whether props that have come to rest are left out of a step until something wakes them: a
  /// touch, a push. They then rest to the bit where they are, and many cost little more than none.
  bool props_sleep = false;
  double time_step = 0.001;                      ///< [s]
  Vector3d gravity = Vector3d(0, 0, -kGravity);  ///< [m/s²]
};

}  // namespace traceur::sim
