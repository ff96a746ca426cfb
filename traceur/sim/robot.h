// A robot: its MJCF or URDF, and beside it a TOML with what those formats do not say.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "traceur/core/error.h"

namespace traceur::sim {

using Eigen::Vector3d;

/// What a joint's motor and range allow; the second units are those of a slide.
struct JointLimit {
  double torque = 0;  ///< largest magnitude [N·m | N]
  double speed = 0;   ///< largest magnitude [rad/s | m/s]
  double min = 0;     ///< [rad | m]
  double max = 0;     ///< [rad | m]
};

/// Gains of the default controller: kp [N·m/rad | N/m], kd [N·m·s/rad | N·s/m], and of the error's
/// integral ki [N·m/(rad·s) | N/(m·s)].
struct JointGain {
  double kp = 0;
  double kd = 0;
  double ki = 0;
};

/// One name for a left and a right joint: value v means left = v, right = sign·v.
struct MirroredPair {
  std::string left;
  std::string right;
  double sign = 1;
};

/// A named place where the robot may meet the world.
struct ContactPoint {
  std::string body;
  Vector3d p_BP = Vector3d::Zero();  ///< in the body's frame [m]
};

/// Joint angles [rad | m] by joint name (joints not named are 0) and the root's attitude.
struct Pose {
  Vector3d root_rpy = Vector3d::Zero();  ///< roll, pitch, yaw [rad], fixed axes x, y, z
  std::map<std::string, double> joints;
};

/// The rotation of roll, pitch and yaw about the fixed axes x, y and z: Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Quaterniond rotationOf(const Vector3d& rpy);
/// And back: pitch in [-π/2, π/2].
Vector3d rpyOf(const Eigen::Matrix3d& R);
/// Its inverse, with a pitch in [-π/2, π/2].
Vector3d rpyOf(const Eigen::Quaterniond& rotation);

/// The figures a robot is known by, held against the model by the robots' contract test.
struct PublishedFigures {
  double mass = 0;        ///< [kg]
  double height = 0;      ///< sole to top at joint angles 0 [m]
  double com_height = 0;  ///< COM above the sole at joint angles 0 [m]
  int joints = 0;         ///< actuated
  std::string source;
};

/// A joint and the factor with which a value given to a pair's name reaches it.
struct SignedJoint {
  std::string joint;
  double sign = 1;
};

struct Robot {
  std::string name;
  std::string description;
  std::filesystem::path file;  ///< MJCF (.xml) or URDF (.urdf)
  std::filesystem::path toml;  ///< what says the rest; empty for a bare MJCF or URDF
  double mass_scale = 1;       ///< factor on every mass and inertia in the file
  std::optional<PublishedFigures> published;
  /// The joints that have motors, where the TOML says it; else those that the file's actuators
  /// drive, or all that do not follow another where it has none.
  std::optional<std::set<std::string>> motors;
  std::map<std::string, MirroredPair> mirrored;
  std::map<std::string, JointLimit> limits;                ///< by joint
  std::map<std::string, JointGain> gains;                  ///< by joint
  std::map<std::string, std::vector<std::string>> limbs;   ///< bodies from the root outwards
  std::map<std::string, std::vector<std::string>> bodies;  ///< groups of bodies
  std::map<std::string, ContactPoint> contacts;
  std::map<std::string, Pose> poses;

  /// Reads models/<robot>/robot.toml, or a bare MJCF/URDF, which then has only what the file says.
  /// @throws InputError listing every mistake of the TOML
  static Robot fromFile(const std::filesystem::path& file);

  /// The joints a word in a skill file means: a pair's two, or the one of that name (which
  /// the model may lack).
  std::vector<SignedJoint> jointsNamed(const std::string& word) const;
};

}  // namespace traceur::sim
