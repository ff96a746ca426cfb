// A skill: a robot in a scene, what it does phase by phase, the numbers practice may move, and what
// makes a trial good or bad. All of it is data a person writes in TOML; docs/guide/skill-files.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "traceur/control/pose_solver.h"
#include "traceur/core/param.h"
#include "traceur/flight/planner.h"
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

/// A number with a name of its own, worked out of others.
struct Value {
  std::string name;
  std::string expression;
  bool running = false;  ///< each step, of signals too; else as a trial begins
};

/// A joint's target in a phase: sign · expression [rad].
struct JointValue {
  int joint = 0;  ///< index in sim::Model::joints()
  double sign = 1;
  std::string expression;
};

/// Three expressions along the axes of a frame.
struct VectorText {
  std::string x = "0", y = "0", z = "0";
};

/// The axes of a virtual force.
enum class Frame {
  kWorld,
  /// z from the centre of pressure to the COM, y = z × the world's x, to the left of one who looks
  /// along x, and x = y × z, forward along the ground of one who stands upright. In flight from the
  /// last centre of pressure; no force before there was one.
  kCopToCom,
  kHeading,  ///< x where the robot is headed (sim::Snapshot::heading), z up
};

/// A force and a moment exerted through the joints, in every step of a phase.
struct ForceTerm {
  std::vector<sim::BodyPoint> points;  ///< each is given the force and its body the moment
  bool com = false;                    ///< instead of points
  /// The force is shared out among the points whose bodies touch something, and is none where none
  /// does; so is what `against` takes.
  bool touching = false;
  Frame frame = Frame::kWorld;
  VectorText force;   ///< [N]
  VectorText moment;  ///< [N·m]
  /// The bodies that are given the opposite, force and moment about the same point.
  std::vector<sim::BodyId> against;
};

/// A factor on a joint's gain.
struct GainFactor {
  int joint = 0;  ///< index in sim::Model::joints()
  std::string factor;
};

/// Something a pose is to come to. Axes that are empty are free.
struct ReachGoal {
  control::Place of, from;
  std::string x, y, z;           ///< of − from, world axes [m]
  std::string distance;          ///< |of − from| [m]
  std::string roll, pitch, yaw;  ///< of the first body of `of`; empty: as it is [rad]
  std::string weight = "1";
};

/// Joint targets that put the body's parts somewhere (control::PoseSolver).
struct Reach {
  std::vector<ReachGoal> goals;
  std::vector<sim::BodyId> hold;  ///< stay where they are, and as they are turned
  std::vector<int> joints;        ///< that may move
  double every = 0;               ///< solved anew so often [s]; 0: only on entering the phase
};

/// Poses in the air that bring the body to the ground as it should come (flight::FlightPlanner).
/// The phase's own pose is the landing's.
struct Flight {
  std::string somersault;                 ///< wanted at touch-down, of the root [rad]
  std::string ground = "0";               ///< height of the surface [m]
  std::vector<flight::FlightPose> poses;  ///< to choose from
};

/// A way out of a phase.
struct Exit {
  std::string when;  ///< condition over signals
  int next = 0;      ///< index of the phase that follows; an earlier one makes a cycle
};

struct Phase {
  std::string name;
  bool from_previous = false;  ///< joints not named keep the last phase's target, else base's
  VectorXd base;               ///< by joint [rad]
  std::vector<JointValue> targets;
  std::string blend = "0";  ///< time over which the target moves from the last one [s]
  std::vector<GainFactor> stiffness, damping;
  std::optional<Reach> reach;    ///< where its joints' targets come from; pose holds for the others
  std::optional<Flight> flight;  ///< chooses the target on the way to it
  std::vector<ForceTerm> forces;
  bool limited = true;  ///< whether the forces' torques count against the motors' limits
  /// It ends by the first whose condition holds; the number of phases as `next` is the skill's end.
  /// None: it is held to the end.
  std::vector<Exit> exits;
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
  std::string unit;  ///< as printed; empty: not said, a signal's own is known
  std::string of;    ///< expression over signals
  Take take = Take::kLast;
  /// The value in a trial in which `of` was never a number while it was looked at.
  double otherwise = std::numeric_limits<double>::quiet_NaN();
  std::vector<bool> during;  ///< by phase
  std::string when;          ///< condition over signals: it looks only then; empty: always
};

/// A way to fail: the trial ends there and the constraint of this name is violated.
struct Failure {
  std::string name;  ///< "part.name" of a part's
  std::string when;  ///< condition over signals; empty: a part's, which says when
  std::vector<bool> during;
};

/// One term of the cost.
struct Term {
  std::string name;
  std::string cost;  ///< expression over measures, failures (0 or 1), time, horizon
};

/// The controller's gains and limits where the skill overrides the robot's.
struct ControllerOptions {
  /// By joint, as gains and limits there are [N·m/rad], [N·m·s/rad], [N·m/(rad·s)], [N·m], [rad/s].
  struct Override {
    std::optional<double> kp, kd, ki, torque, speed;
    bool operator==(const Override&) const = default;
  };
  std::vector<Override> joints;
  bool operator==(const ControllerOptions&) const = default;
};

/// A force and a moment on a body's COM for a while.
struct PushTerm {
  sim::BodyId body;
  VectorText force, moment;  ///< world axes [N], [N·m]
  std::string start;         ///< since the trial began [s]
  std::string duration;      ///< [s]
};

/// How a trial starts if not at rest on the ground.
struct Launch {
  sim::Pose pose;                ///< joints, and the attitude where none is given
  std::string height = "0";      ///< of the lowest point, or …
  bool of_com = false;           ///< … of the COM [m]
  VectorText velocity;           ///< of the COM, world axes [m/s]
  VectorText spin;               ///< about the COM, world axes [rad/s]
  std::string roll, pitch, yaw;  ///< of the root; empty: the pose's [rad]
  /// The somersault of the root with which it would meet the surface if it stayed rigid; the pitch
  /// is what comes to it. Empty: pitch says.
  std::string lands;
  std::string ground = "0";  ///< height of that surface [m]
};

struct Skill;

/// Another skill that is performed in this one's scene.
struct Part {
  std::string name;
  std::shared_ptr<const Skill> skill;
  std::vector<std::string> parameters;  ///< by the other skill's; expressions of this one's names
  std::string task;
  std::string until;  ///< condition that ends it before it ends itself; empty: none
  /// Its cost in a trial that does not reach it.
  double otherwise = std::numeric_limits<double>::quiet_NaN();
};

/// How a robot and what is around it may differ from their model, to know what a skill withstands
/// before it meets them.
struct Disturbance {
  double mass = 1;                      ///< factor on every mass and inertia of the robot
  std::optional<double> friction;       ///< of the ground, in place of the skill's
  std::optional<double> compliance;     ///< of the ground, in place of the skill's [s]
  std::optional<double> damping_ratio;  ///< of the ground, in place of the skill's
  std::vector<sim::Prop> props;         ///< besides the skill's
  std::optional<double> time_step;      ///< of the simulation, in place of the skill's [s]
  double delay = 0;           ///< from a state to the torque that answers it [s], whole steps
  double encoder_noise = 0;   ///< of the angles PD control reads, standard deviation [rad]
  double velocity_noise = 0;  ///< of the com_velocity that feedback reads [m/s]
  std::uint64_t seed = 1;     ///< of the noise, which differs from task to task
};

/// Immutable; shared by all threads. Expressions are checked when it is read.
struct Skill {
  std::string name;
  std::string description;
  std::string text;  ///< the file, as it was read
  std::string like;  ///< the text of that which it is like (skill::LikeDocument); empty: none
  std::filesystem::path file;
  std::vector<std::pair<std::string, double>> constants;
  std::shared_ptr<const sim::Model> model;
  sim::State start;              ///< with the initial parameters and task
  std::optional<Launch> launch;  ///< in place of start, where it is more than a pose
  /// It starts where this one's trial ends, of numbers alone.
  std::optional<Part> after;
  double horizon = 0;  ///< [s]
  /// The file's time step: its controller decides so often also where a disturbance has the
  /// simulation's time step finer [s].
  double decision_interval = 0;
  std::string stop;  ///< condition that ends a trial well; empty: the horizon does
  Task task;
  /// What a trial is put under, as a height to fall from: a person sets them within their ranges,
  /// practice draws them. Of none asked for, the initial ones.
  ParamSpecs conditions;
  /// The ranges that practice draws them from, within their own: least and most.
  std::vector<std::pair<double, double>> drawn;
  ParamSpecs parameters;
  std::vector<Value> values;  ///< each may name those before it
  ControllerOptions controller;
  std::vector<Phase> phases;
  std::vector<Part> parts;  ///< one after another, instead of phases
  std::vector<Feedback> feedback;
  std::vector<PushTerm> pushes;
  std::vector<Measure> measures;
  std::vector<Failure> failures;
  std::vector<Term> terms;
  /// Good enough: practice stops here.
  double target_cost = -std::numeric_limits<double>::infinity();
  Disturbance disturbance;

  VectorXd initialParameters() const;
  VectorXd initialConditions() const;
  /// The initial conditions, but for these. @pre the names are conditions'
  VectorXd conditionsWith(const std::vector<std::pair<std::string_view, double>>& numbers) const;
  /// Its phases; of a skill of parts "part.phase" of each.
  std::vector<std::string> phaseNames() const;
  /// What in.NAME and ended.NAME may name: phases, then parts.
  std::vector<std::string> stageNames() const;

  /// @throws InputError listing every mistake of the file with line and column
  static std::shared_ptr<const Skill> fromFile(const std::filesystem::path& file);
  /// The same from a text; `file` is named in messages and says where the robot is looked for.
  static std::shared_ptr<const Skill> fromText(const std::string& text,
                                               const std::filesystem::path& file,
                                               const Disturbance& disturbance = {});
};

/// Where the skill of this name is that a robot under models/ has: skills/ROBOT/NAME.toml, beside
/// any models/ that findRobot looks in.
/// @throws InputError with the folders it is in none of
std::filesystem::path findSkill(const std::string& robot, const std::string& name);

/// Where the robot a skill or a person names is described: a path, or a name under models/ beside
/// the file or above it, in $TRACEUR_DATA, beside the running program (../share/traceur), or where
/// Traceur was built to be installed.
/// @throws InputError with the names there are, or the folders without any
std::filesystem::path findRobot(const std::string& name, const std::filesystem::path& beside);

}  // namespace traceur::skill
