// What breaks a robot's fall: the parts it may put to the ground, in which order, from which
// stance.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "traceur/sim/robot.h"

namespace traceur::fall {

/// A part that may touch the ground: one contact point of the robot's file, or several that touch
/// together, whose mean it then is (two hands, or toe and heel of a sole).
struct ContactNode {
  std::string name;
  std::vector<std::string> points;
};

/// Which part may touch the ground after which: a directed graph without cycles [Ha2015, §4.3.2].
struct ContactGraph {
  std::vector<ContactNode> nodes;       ///< the first is what the robot stands on
  std::vector<std::vector<int>> edges;  ///< by node: what may follow it

  bool has(std::string_view node) const;
  /// The nodes so that each comes after all it can follow.
  std::vector<int> order() const;
  /// The same without a node.
  /// @throws InputError for a name it does not have, the first, or where nothing could follow the
  ///         first then
  ContactGraph without(std::string_view node) const;
};

/// A way to fall: from a stance, in a direction.
struct FallSetup {
  std::string stance;     ///< the name of a pose in the robot's file
  std::string direction;  ///< "forward" or "backward": along +x or -x of the robot
  ContactGraph graph;
  /// How quick the body is on the way to a contact.
  struct Quickness {
    double rod_speed = 0;      ///< largest |ṙ₁| [m/s]
    double stopper_speed = 0;  ///< largest |θ̇₂| [rad/s]
    double stiffness = 1;      ///< factor on the robot's kp
  };
  Quickness quick = {};
  /// The same, where something is said; nothing: as it was.
  struct QuicknessChange {
    std::optional<double> rod_speed = {}, stopper_speed = {}, stiffness = {};
  };
  std::map<std::string, QuicknessChange> quick_without = {};  ///< by node: where that is left out
  bool stands = true;  ///< whether it should stand still until it is pushed

  double sign() const { return direction == "backward" ? -1 : 1; }
  /// The same fall without a node, as quick as is said for that; of several left out one after
  /// another the last to say something of a speed decides on it.
  /// @throws InputError as ContactGraph::without, naming the fall
  FallSetup without(const std::string& node) const;
};

/// How a plan is followed, beside FallSetup::Quickness. All of it is ours: the first six are the
/// robot's, the others were chosen by planned / unplanned impulse over pushes of the published
/// ranges.
struct FallTracking {
  double damping = 1;  ///< factor on the robot's kd while it falls
  /// Factor on its kp once the last contact has been made; nothing: Quickness::stiffness.
  std::optional<double> rest_stiffness = {};
  double rest_damping = 1;  ///< factor on its kd then
  double support = 0;       ///< share of the rod's force that the joints are told to bear
  double ramp = 0.8;  ///< time in which the poses to a contact are gone through, of that to it
  double rest_height = 0.9;  ///< of the COM at rest, as a share of that at the last contact
  int waypoints = 4;         ///< poses on the way to a contact, the last of them Eq. 19's
  double approach =
      0.3;            ///< weight of the next part's place before the last pose, growing up to it
  double kept = 0.1;  ///< weight of parts that touched before: kept there where that costs little
  double rod_time = 0.1;     ///< in which the support brings the rod to its planned rate [s]
  double late = 0.5;         ///< share of the planned time that a contact may be late
  double least_wait = 0.05;  ///< and no less than so long [s]
  double again = 0.1;        ///< after the last contact, until another plan is asked for [s]
  double rest = 0.1;         ///< time to come to rest after the last contact [s]
};

/// models/ROBOT/falls.toml: all a fall needs to know beyond robot.toml.
struct FallRobot {
  std::shared_ptr<const sim::Robot> robot;
  std::string push_body;            ///< pushes act on its COM
  std::string head;                 ///< the contact point that stands for the head
  std::string tuck;                 ///< the name of a pose: curled up
  std::vector<std::string> joints;  ///< that a plan moves; a pair's name means both
  /// Of joints that a plan may use only a part of: [least, most] angle [rad]. A limb that is not
  /// quite stretched yields when it meets the ground.
  std::map<std::string, std::pair<double, double>> ranges;
  double least_interval = 0;  ///< from the beginning or a contact to the next contact [s]
  FallTracking tracking;
  std::vector<FallSetup> setups;

  /// @throws InputError listing every mistake: a contact point, body, joint or pose that the robot
  ///         lacks, a graph that leads nowhere or round in a circle, numbers out of range
  static FallRobot fromFile(const std::filesystem::path& file);

  /// @throws InputError naming what there is
  const FallSetup& setup(std::string_view stance, std::string_view direction) const;
};

}  // namespace traceur::fall
