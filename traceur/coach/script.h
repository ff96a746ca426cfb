// A coach's script: the phases of a motion, a key pose for each, and what is asked of them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "traceur/coach/instruction.h"
#include "traceur/core/error.h"

namespace traceur::coach {

/// How a phase ends.
struct Ending {
  enum class Kind {
    kComLeads,  ///< the COM is so far ahead of what bears it [m]
    kLeave,     ///< a group of bodies touches nothing any more
    kTouch,     ///< a group of bodies touches something
    kTurned,    ///< the root has somersaulted so far from upright, either way [rad]
    kAfter,     ///< a time [s]
    kHeld,      ///< it is held to the end, a time [s]
  };
  Kind kind = Kind::kHeld;
  std::string group;  ///< of bodies
  double amount = 0;
};

/// What a phase is unless its lines say otherwise.
struct PhaseKind {
  std::string_view name;  ///< "leaning"
  std::string_view help;
  Ending ending = {};
  double longest = 1.5;         ///< it fails when it has not ended by then [s]
  double blend = 0.15;          ///< time in which it comes to its key pose [s]
  double stiffness = 1;         ///< of the legs: in a thrust the virtual force does the rest
  double damping = 1;           ///< of the legs: at speed it brakes them
  std::string_view bears = {};  ///< the group that is on something while it lasts; empty: it flies
  bool wall = false;            ///< what bears it is on a wall: the COM is nowhere over it
};
/// The phases of the dissertation's five skills.
const std::vector<PhaseKind>& phaseKinds();

/// A line of a script, or what stands between two semicolons of one.
struct Said {
  std::string text;
  int line = 0, column = 1;  ///< from 1; line 0: of none
};

/// A joint's target.
struct KeyAngle {
  std::string joint;  ///< a pair or a joint of the robot's file
  double angle = 0;   ///< [rad]
  double spread = 0;  ///< practice moves it by so much either way [rad]
};
struct KeyPose {
  std::string base;  ///< a pose of the robot's file, "zero", or "previous"
  std::vector<KeyAngle> angles;
  double blend = 0;  ///< [s]; 0: the phase kind's
};

struct Phase {
  std::string name;  ///< lower case letters, digits, spaces and '-', as "leaning", "landing 2"
  const PhaseKind* kind = nullptr;
  KeyPose pose;
  Ending ending;
  double longest = 0;                     ///< [s]
  std::string bears;                      ///< as PhaseKind
  std::vector<Instruction> instructions;  ///< those of all phases first
  std::vector<Said> settings;             ///< its lines that are no instructions: POSE, UNTIL, ...
};

/// Something around the robot, world axes.
struct SceneBox {
  std::string name;
  Vector3d size = Vector3d::Zero(), at = Vector3d::Zero();  ///< [m], its centre
};
struct SceneWall {
  std::string name;
  Vector3d at = Vector3d::Zero();  ///< the foot of its face, which looks towards the robot
};

struct Script {
  std::string name;
  std::string text;
  std::filesystem::path file;
  std::string robot;
  std::string start = "stand";  ///< a pose of the robot's file
  Axes axes = Axes::kPublished;
  Readings readings = Readings::kOurs;
  /// Trials of a phase for each number that practice moves [ours: a jump ahead has twelve, and
  /// takes 576].
  int budget = 48;
  bool ground = true;
  double friction = 1;
  std::vector<SceneBox> boxes;
  std::vector<SceneWall> walls;
  std::vector<Said> scene;  ///< as it was said
  std::vector<Phase> phases;
  std::shared_ptr<const sim::Model> model;  ///< of the robot alone
  std::vector<Mistake> notes;               ///< what is odd, but no mistake

  /// How many instructions a person gave: key poses do not count [Ha2015, Table 11].
  int instructions = 0;

  /// @throws InputError listing every mistake of the script with line and column
  static Script fromText(const std::string& text, const std::filesystem::path& file);
  static Script fromFile(const std::filesystem::path& file);
};

/// A script's text with one line more at the end of a phase's lines.
/// @throws InputError for a phase that the script has not
std::string withLine(const std::string& text, const std::string& phase, const std::string& line);
/// … and with other words in place of some that it has; "" leaves them out.
std::string withInstead(const std::string& text, const Said& said, const std::string& words);

}  // namespace traceur::coach
