// A skill: a robot in a scene, what it does phase by phase, the numbers practice may move, and what
// makes a trial good or bad. All of it is data a person writes in TOML; docs/guide/skill-files.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "traceur/core/param.h"
#include "traceur/sim/model.h"

namespace traceur::skill {

using Eigen::Vector3d;
using Eigen::VectorXd;

/// What a person asks for: one number in the task's own unit.
struct Task {
  std::string name;
  std::string unit;
  double initial = 0;  ///< when nothing is asked
  double min = 0;
  double max = 0;
  /// Expression over measures: what a trial did, in the same unit; empty: it cannot be said.
  std::string achieved;
  double tolerance = 0;  ///< |achieved - task| a person would accept
};

/// A joint's target in a phase: sign · expression [rad].
struct JointValue {
  int joint = 0;  ///< index in sim::Model::joints()
  double sign = 1;
  std::string expression;
};

/// A force exerted through the joints, in every step of a phase.
struct ForceTerm {
  sim::BodyId body;
  Vector3d p_BP = Vector3d::Zero();       ///< in the body's frame [m]
  std::string x = "0", y = "0", z = "0";  ///< world axes [N]
};

struct Phase {
  std::string name;
  bool from_previous = false;  ///< joints not named keep the last phase's target, else base's
  VectorXd base;               ///< by joint [rad]
  std::vector<JointValue> targets;
  std::string blend = "0";  ///< time over which the target moves from the last one [s]
  std::vector<ForceTerm> forces;
  bool limited = true;  ///< whether the forces' torques count against the motors' limits
  std::string until;    ///< condition that ends it; empty: it is held to the end
  int next = 0;         ///< index of the phase that follows; an earlier one makes a cycle
};

/// Added to joint targets in every step.
struct Feedback {
  std::vector<JointValue> joints;  ///< sign · expression [rad]
  std::vector<bool> during;        ///< by phase
};

/// A number taken from a whole trial: "max of com.z".
struct Measure {
  enum class Take { kFirst, kLast, kMin, kMax, kMean, kIntegral };
  std::string name;
  std::string of;  ///< expression over signals
  Take take = Take::kLast;
  /// The value in a trial in which `of` was never a number while it was looked at.
  double otherwise = std::numeric_limits<double>::quiet_NaN();
  std::vector<bool> during;  ///< by phase
};

/// A way to fail: the trial ends there and the constraint of this name is violated.
struct Failure {
  std::string name;
  std::string when;  ///< condition over signals
  std::vector<bool> during;
};

/// One term of the cost.
struct Term {
  std::string name;
  std::string cost;  ///< expression over measures, failures (0 or 1), time, horizon
};

/// The controller's gains and limits where the skill overrides the robot's.
struct ControllerOptions {
  std::optional<double> kp, kd;         ///< [N·m/rad], [N·m·s/rad]
  std::optional<double> torque, speed;  ///< limits [N·m], [rad/s]
};

/// How a robot and its ground may differ from their model, to know what a skill withstands before
/// it meets them.
struct Disturbance {
  double mass = 1;                 ///< factor on every mass and inertia of the robot
  std::optional<double> friction;  ///< of the ground, in place of the skill's
  double delay = 0;                ///< from a state to the torque that answers it [s], whole steps
  double encoder_noise = 0;        ///< of the angles PD control reads, standard deviation [rad]
  double velocity_noise = 0;       ///< of the com_velocity that feedback reads [m/s]
  std::uint64_t seed = 1;          ///< of the noise, which differs from task to task
};

/// Immutable; shared by all threads. Expressions are checked when it is read.
struct Skill {
  std::string name;
  std::string description;
  std::string text;  ///< the file, as it was read
  std::filesystem::path file;
  std::shared_ptr<const sim::Model> model;
  sim::State start;
  double horizon = 0;  ///< [s]
  std::string stop;    ///< condition that ends a trial well; empty: the horizon does
  Task task;
  ParamSpecs parameters;
  ControllerOptions controller;
  std::vector<Phase> phases;
  std::vector<Feedback> feedback;
  std::vector<Measure> measures;
  std::vector<Failure> failures;
  std::vector<Term> terms;
  /// Good enough: practice stops here.
  double target_cost = -std::numeric_limits<double>::infinity();
  Disturbance disturbance;

  VectorXd initialParameters() const;

  /// @throws InputError listing every mistake of the file with line and column
  static std::shared_ptr<const Skill> fromFile(const std::filesystem::path& file);
  /// The same from a text; `file` is named in messages and says where the robot is looked for.
  static std::shared_ptr<const Skill> fromText(const std::string& text,
                                               const std::filesystem::path& file,
                                               const Disturbance& disturbance = {});
};

/// Where the robot a skill or a person names is described: a path, or a name under models/ beside
/// the file or above it, in $TRACEUR_DATA, beside the running program (../share/traceur), or where
/// Traceur was built to be installed.
/// @throws InputError with the names there are, or the folders without any
std::filesystem::path findRobot(const std::string& name, const std::filesystem::path& beside);

}  // namespace traceur::skill
