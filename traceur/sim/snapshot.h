// What a controller, a condition or an objective may read of a world, computed when asked.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "traceur/sim/inertia_factor.h"
#include "traceur/sim/model.h"

struct mjData_;  // NOLINT(readability-identifier-naming): MuJoCo's name

namespace traceur::sim {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Matrix3Xd = Eigen::Matrix3Xd;

/// One point where two bodies press on each other.
struct Contact {
  BodyId body_a;
  BodyId body_b;
  Vector3d p_WC;    ///< [m]
  Vector3d normal;  ///< unit, world axes, from a to b
  Vector3d f_WC;    ///< force on body b (minus it acts on a), world axes [N]
};

/// One point where the robot presses on what is not the robot.
struct RobotContact {
  BodyId body;  ///< the robot's
  BodyId other;
  Vector3d p_WC;  ///< [m]
  Vector3d f_W;   ///< force on the robot, world axes [N]
};

/// A view of a World, valid until its next step or reset. All vectors are in world axes.
///
/// Time: q, v and everything computed from them belong to the present time; contacts, cop and
/// jointForces belong to the step that led here, the last one whose forces are known.
class Snapshot {
 public:
  double time() const;                   ///< [s]
  Eigen::Map<const VectorXd> q() const;  ///< (nq)
  Eigen::Map<const VectorXd> v() const;  ///< (nv)

  Vector3d com() const;              ///< of the robot [m]
  Vector3d comVelocity() const;      ///< [m/s]
  Vector3d linearMomentum() const;   ///< [kg·m/s]
  Vector3d angularMomentum() const;  ///< of the robot about its COM [kg·m²/s]
  Matrix3d inertia() const;          ///< of the robot about its COM, as it is now [kg·m²]
  /// The angular velocity of a rigid body with its inertia and angular momentum: I⁻¹ L [rad/s].
  Vector3d spin() const;
  /// Where the robot is headed: unit, horizontal, at right angles to the root's left (y), so that
  /// it stays while the robot somersaults. The world's x where left is straight up or down.
  Vector3d heading() const;

  Vector3d bodyPosition(BodyId body) const;     ///< p_WB, origin of the body's frame [m]
  Matrix3d bodyRotation(BodyId body) const;     ///< R_WB
  Vector3d bodyCom(BodyId body) const;          ///< p_WBcm [m]
  Vector3d bodyVelocity(BodyId body) const;     ///< of the body's origin, v_WB [m/s]
  Vector3d position(const BodyPoint& p) const;  ///< p_WP [m]
  Vector3d velocity(const BodyPoint& p) const;  ///< v_WP [m/s]
  /// What the motors were told for the step that led here, (nu) [N·m]; 0 at the start.
  Eigen::Map<const VectorXd> torque() const;

  const std::vector<Contact>& contacts() const { return contacts_; }
  /// Those of contacts() that are between the robot and the world, seen from the robot.
  const std::vector<RobotContact>& robotContacts() const { return robot_contacts_; }
  /// Whether anything but the robot itself presses on the robot.
  bool touchesWorld() const;
  /// Centre of pressure of the robot's contacts with the static world, weighted by the vertical
  /// force, on walls by what presses on them: p = Σ f_z p / Σ f_z [m]. None in flight.
  /// [Popovic2005]
  std::optional<Vector3d> cop() const;
  /// Convex hull of the robot's contacts with the static world, counter-clockwise, (x, y) [m].
  std::vector<Vector2d> supportPolygon() const;
  /// Force of the parent on each body through its joint, (3 x bodies) [N]; needs
  /// World::watchJointForces. Its norm is the dissertation's joint stress [Ha2015, §3.6.1].
  const Matrix3Xd& jointForces() const { return joint_forces_; }

  /// A hinge's axis, or the direction in which a slide's value grows: unit.
  Vector3d jointAxis(const Joint& joint) const;
  Vector3d jointAnchor(const Joint& joint) const;  ///< a point of that axis [m]
  /// Inertia against the joint alone, its motor's too: M_jj [kg·m² | kg].
  double jointInertia(const Joint& joint) const;
  /// The farthest point along u (unit) of a body's shapes that can touch anything [m]; none where
  /// it has none.
  std::optional<Vector3d> farthestPoint(BodyId body, const Vector3d& u) const;

  /// J with ṗ = J·v for the point p_BP (body frame) of a body, (3 x nv).
  void pointJacobian(BodyId body, const Vector3d& p_BP, Eigen::Ref<Matrix3Xd> J) const;
  /// J with ω = J·v of a body, world axes, (3 x nv).
  void rotationJacobian(BodyId body, Eigen::Ref<Matrix3Xd> J) const;
  /// Adds Jᵀf of a force on the COM [N] to tau (nv).
  void addComForce(const Vector3d& f, Eigen::Ref<VectorXd> tau) const;
  /// J with angularMomentum = J·v, (3 x nv).
  void angularMomentumJacobian(Eigen::Ref<Matrix3Xd> J) const;
  /// J with comVelocity = J·v, (3 x nv).
  void comJacobian(Eigen::Ref<Matrix3Xd> J) const;

  /// Adds Jᵀf of a force f [N] at the point p_BP (body frame) of a body to tau, (nv) [N·m].
  void addPointForce(BodyId body, const Vector3d& p_BP, const Vector3d& f,
                     Eigen::Ref<VectorXd> tau) const;
  /// The same of a moment on a body [N·m].
  void addMoment(BodyId body, const Vector3d& moment, Eigen::Ref<VectorXd> tau) const;

  /// Everything but motors that acts along v: gravity, Coriolis, passive damping, what World::push
  /// exerts now, and the contact and limit forces of the last step, (nv) [N·m].
  void externalForce(Eigen::Ref<VectorXd> tau) const;
  /// Solves (M(q) + diag(d)) x = b in place, d ≥ 0 and b (nv), by an InertiaFactor.
  void solveInertia(const VectorXd& d, Eigen::Ref<VectorXd> b) const;

 private:
  friend class World;
  /// Sign of the contact's force on the robot if the static world presses on it, else 0.
  int support(const Contact& c) const;
  bool willTouchWorld() const;  // touchesWorld() of the step that comes next
  void keepSleeping();
  void capture();  // reads contacts and joint forces while the engine still has them

  const Model* model_ = nullptr;
  mjData_* data_ = nullptr;
  bool wants_joint_forces_ = false;
  bool pushed_ = false;  // something, since the last reset
  std::vector<Contact> contacts_;
  std::vector<Contact> before_;  // scratch of capture
  std::vector<RobotContact> robot_contacts_;
  Matrix3Xd joint_forces_;
  mutable bool has_com_velocity_ = false;  // computed once per step
  mutable Vector3d com_velocity_ = Vector3d::Zero();
  mutable bool has_angular_momentum_ = false;
  mutable Matrix3Xd momentum_;  // scratch of comVelocity
  mutable std::optional<InertiaFactor> factor_;
  mutable Matrix3Xd com_jacobian_;  // scratch of addComForce
};

}  // namespace traceur::sim
