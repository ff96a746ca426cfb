// Where a picture is taken from.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace traceur::render {

using Eigen::Vector3d;

enum class View {
  kSide,          ///< along +y from the robot's right: forward (+x) is to the right
  kThreeQuarter,  ///< from the front right: forward is to the right and towards the viewer
  kFront          ///< along -x: the robot's left (+y) is to the right
};

struct Camera {
  View view = View::kThreeQuarter;
  /// In pictures of one motion: move smoothly with the robot's centre of mass (its height only if
  /// that changes by more than the robot's size, as in a fall from a wall), else stand still with
  /// the whole motion in view. A prop that moves, such as a ball, counts to what is looked at while
  /// it is within three robot sizes. Without effect when look_at is given.
  bool follow = true;
  std::optional<Vector3d> look_at = std::nullopt;  ///< point in the picture's middle, world [m]
  double distance = 0;  ///< from look_at [m]; 0: as near as shows the robot and such props
};

}  // namespace traceur::render
