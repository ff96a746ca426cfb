// A robot.toml drafted from a bare MJCF or URDF, for a person to read and to change.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "traceur/control/stance.h"

namespace traceur::control {

struct Draft {
  std::shared_ptr<const sim::Model> model;  ///< of the bare file
  sim::Robot robot;                         ///< with all that is derived
  std::string stand_is;  ///< where the pose "stand" comes from, in words; empty: there is none
  double stiffness = 1;  ///< factor on gainsByPhysics that was needed
  Standing standing;     ///< of the pose "stand", or of the one that was held longest
  std::vector<std::string> doubts;  ///< what a person should look at, a sentence each
};

/// How long a pose is held to be one that stands [s]. A robot that topples does so with a time
/// constant of sqrt(h/g), 0.3 s for a person [ours].
inline constexpr double kHeld = 5;
/// Factors on the gains by physics that are tried in this order until it stands [ours].
inline constexpr double kLadder[] = {1, 2, 4, 8, 0.5, 0.25};

/// Pairs, limbs, groups and contact points by sim::mirroringOf and sim::anatomyOf, limits of the
/// file. The pose "stand" is the first that stands of: the file's key frames, those called after
/// standing first; knees a little bent (bentPose); joint angles 0. If none does, it is the one that
/// was held longest.
/// @param bare  of an MJCF or URDF
/// @throws InputError as sim::Model::fromScene
Draft draftRobot(const sim::Robot& bare);

/// The draft as the text of a robot.toml, its model by the path from a folder.
/// @throws InputError for a name that is not UTF-8, which TOML cannot hold
std::string tomlOf(const Draft& draft, const std::filesystem::path& folder);

}  // namespace traceur::control
