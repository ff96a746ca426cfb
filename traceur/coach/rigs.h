// Control rigs: the few numbers that an instruction lets practice move [Ha2015, Table 5].
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/coach/script.h"

namespace traceur::coach {

/// A number that practice moves.
struct DraftParameter {
  std::string name, unit;
  double min = 0, max = 0, initial = 0;
  std::string help;
};

/// A phase's part of a skill file while it is put together.
struct SkillDraft {
  std::vector<DraftParameter> parameters;
  std::vector<std::pair<std::string, std::string>> pose, stiffness, damping;  ///< joint, expression
  std::vector<std::string> reach;   ///< keys of [phase.reach], then its goals
  std::vector<std::string> forces;  ///< [[phase.force]] blocks
  std::vector<std::string> measures;
  std::vector<std::string> constants;
  std::vector<std::string> rigs;  ///< that have been added

  bool has(std::string_view rig) const;
};

/// What a rig may know of the body and the phase it is added to.
struct Body {
  const Script* script = nullptr;
  std::vector<std::string> soles;        ///< the bodies that stand on the ground flat, one a leg
  std::vector<std::string> leg_joints;   ///< pairs that move them within the plane of motion
  std::vector<std::string> side_joints;  ///< … and across it
  std::string root;
  Vector3d origin;           ///< of the script's places: the feet at the start [m]
  std::vector<double> side;  ///< of each sole beside the root at the start, to the left [m]

  explicit Body(const Script& s);
  /// The group that a phase's forces act on, where no limb is named: what bears it, in the air the
  /// feet.
  static std::string contactOf(const Phase& phase);
  /// Of the key pose, soles flat: the root from the soles, x and z [m], and its pitch [rad].
  Vector3d rootFromSoles(const KeyPose& pose) const;
  /// "x = …", "y = …": an offset forward and to the left [m], expressions, as the root is headed.
  std::string headed(const std::string& forward, const std::string& left) const;
  /// "(body.l_foot.x + body.r_foot.x) / 2"
  std::string mean(const std::vector<std::string>& bodies, char axis) const;
};

/// How a rig is used in a phase.
struct RigUse {
  const Body* body = nullptr;
  const Phase* phase = nullptr;
  std::string target = {};               ///< group of bodies
  std::vector<std::string> joints = {};  ///< pairs or joints
  double value = 0;                      ///< of what is set exactly [rad], a factor; 0: searched
  double twist = 0;        ///< spin about the vertical that it is to end with, to the left [rad/s]
  bool wall = false;       ///< the feet are to meet a wall, not the ground
  bool from_wall = false;  ///< it has kicked off a wall
};

struct Rig {
  std::string_view name;        ///< "IKPose"
  std::string_view parameters;  ///< what practice moves, in words
  void (*add)(const RigUse&, SkillDraft&);
};
/// The dissertation's five.
std::span<const Rig> allRigs();
const Rig& rigNamed(std::string_view name);

}  // namespace traceur::coach
