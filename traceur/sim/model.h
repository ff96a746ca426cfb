// The immutable description every World shares.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/sim/scene.h"

struct mjModel_;  // NOLINT(readability-identifier-naming): MuJoCo's name

namespace traceur::sim {

using Eigen::VectorXd;

/// The physics engine's version: results are bit-equal only within one.
std::string engineVersion();

/// Made only by Model: a name becomes an id once, and a wrong name fails at load.
struct BodyId {
  int value = -1;
  bool operator==(const BodyId&) const = default;
};

/// A place on a body.
struct BodyPoint {
  BodyId body;
  Vector3d p_BP = Vector3d::Zero();  ///< in the body's frame [m]
};

/// A hinge or slide joint with the motor that drives it: a command of 1 is 1 N·m, for a slide 1 N.
struct Joint {
  std::string name;
  bool slides = false;  ///< along its axis [m, N] instead of turning about it [rad, N·m]
  int q = -1;           ///< index in q (nq)
  int v = -1;           ///< index in v (nv)
  BodyId body = {};     ///< that it moves
  int motor = -1;       ///< index in the motor command (nu); -1: not actuated
  JointLimit limit;     ///< infinite where the robot does not say
};

/// Generalised position and velocity at a time: what a world can be put into.
struct State {
  double time = 0;  ///< [s]
  VectorXd q;       ///< (nq) [m, quaternion w x y z, rad | m]
  VectorXd v;       ///< (nv) [m/s in world axes, rad/s | m/s; root rotation in body axes]
};

/// What a robot and its scene are made of, and by which number each part is known: immutable, so
/// that any number of worlds on any threads can share one.
class Model {
 public:
  /// @throws InputError: what MuJoCo or we found wrong, with the file; a file that crashes MuJoCo,
  /// or takes it more than 4 s or 1 GB, too
  static std::shared_ptr<const Model> fromScene(const Scene& scene);
  /// An MJCF text as it is.
  static std::shared_ptr<const Model> fromMjcf(const std::string& text);
  ~Model();
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  /// What the file calls the robot; empty where it says nothing.
  std::string name() const;
  int nq() const;
  int nv() const;
  int nu() const;
  int bodies() const;
  double timeStep() const;  ///< [s]
  double gravity() const;   ///< downwards, along -z [m/s²]
  double mass() const;      ///< of the robot: the root's subtree [kg]

  /// The robot's floating body; the first body under the world where nothing floats.
  BodyId root() const { return root_; }
  /// Where its free joint's numbers begin in q and in v; only where it floats.
  int rootQ() const;
  int rootV() const;
  /// Rows of v that no motor can drive: 6 for a floating base, else 0.
  int rootDofs() const { return root_dofs_; }
  /// Off the ground and not pushed, nothing but gravity moves the robot's COM: it floats, and the
  /// model has no constraints and tendons, no medium, no spring or damping on the root.
  bool gravityAlone() const { return gravity_alone_; }
  /// @throws InputError "no body named …" with a suggestion
  BodyId body(std::string_view name) const;
  std::string bodyName(BodyId body) const;
  /// A contact point of the robot's file.
  /// @throws InputError "no contact point named …" with a suggestion
  BodyPoint contactPoint(std::string_view name) const;
  BodyId parent(BodyId body) const;
  /// Whether a body is another or one that it carries, at any remove.
  bool hangsOn(BodyId body, BodyId ancestor) const;
  /// The world and everything fixed to it has mass 0 and never moves.
  bool isStatic(BodyId body) const;
  /// Whether a body belongs to the robot: the root and all that hangs on it. False for an id that
  /// the model does not have.
  bool isRobot(BodyId body) const;
  double bodyMass(BodyId body) const;  ///< [kg]
  /// Whether any of the robot's shapes can touch what is not the robot. One that cannot falls for
  /// ever.
  bool canTouchWorld() const;

  /// The robot's hinges and slides, in the order of v. Props' joints are not among them.
  const std::vector<Joint>& joints() const { return joints_; }
  /// Names of the robot's ball joints, which turn freely: no motor is on them.
  const std::vector<std::string>& ballJoints() const { return ball_joints_; }
  /// @throws InputError "no joint named …" with a suggestion
  const Joint& joint(std::string_view name) const;
  /// The body that a joint moves against its parent.
  BodyId bodyOf(const Joint& joint) const;

  /// q at joint angles 0 as the file has it, v = 0.
  State initialState() const;
  /// The pose with the robot's lowest point on z = 0, props where the scene put them, v = 0.
  /// @throws InputError for a joint the model lacks
  State stateOf(const Pose& pose) const;
  /// The same, moved as a rigid body that rises by `height` [m] and has the COM velocity [m/s] and
  /// the spin about the COM [rad/s], world axes. The robot floats.
  State launched(State state, double height, const Vector3d& velocity, const Vector3d& spin) const;
  /// Puts a prop that floats elsewhere, with its origin there [m] and this velocity [m/s], not
  /// turned and without spin.
  void putFree(State& state, BodyId prop, const Vector3d& at, const Vector3d& velocity) const;
  /// The first body of the scene that the robot reaches into deeper than `depth` [m].
  std::optional<BodyId> bodyReachedInto(const State& state, double depth) const;

  /// Which scene's robot this is; null for fromMjcf.
  const std::shared_ptr<const Robot>& robot() const { return robot_; }
  /// The scene as MJCF, for pictures and for other programs: its numbers have six digits, and of
  /// meshes and textures it holds absolute paths.
  /// Made when it is first asked for.
  const std::string& mjcf() const;
  /// A print of all that decides motion, to the last digit; another with another engine.
  std::uint64_t fingerprint() const;
  /// The physics: without geoms that cannot touch anything, textures and the like. What is to be
  /// seen is compiled from mjcf(); bodies, q and v are the same in both.
  const mjModel_* raw() const { return model_; }

 private:
  Model(std::string_view physics, std::function<std::string()> make_mjcf,
        std::shared_ptr<const Robot> robot);

  std::function<std::string()> make_mjcf_;
  mutable std::once_flag mjcf_made_;
  mutable std::string mjcf_;
  std::shared_ptr<const Robot> robot_;
  mjModel_* model_ = nullptr;
  BodyId root_;
  int root_dofs_ = 0;
  bool gravity_alone_ = false;
  std::vector<Joint> joints_;
  std::vector<std::string> ball_joints_;
};

/// The poses of the key frames in the robot's file, by name; where one has none, by "key N".
/// @throws InputError as Model::fromScene
std::map<std::string, Pose> keyPoses(const Robot& robot);

}  // namespace traceur::sim
