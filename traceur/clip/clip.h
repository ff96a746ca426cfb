// A motion as animation programs know it: a skeleton and what its joints do over time.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "traceur/sim/recording.h"

namespace traceur::clip {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// A joint carries a bone. Where nothing turns, all bones have the world's axes: x forward, y left,
/// z up [m]. Of a joint j with the parent i, in the world,
///   R_j = R_i · rotation_j,   p_j = p_i + R_i · offset_j   (or position_j, where it moves).
struct Joint {
  std::string name;
  int parent = -1;     ///< an earlier joint; -1: the root
  Vector3d offset;     ///< from the parent; of the root its place at rest
  bool moves = false;  ///< it does not stay where it is on its parent; the root's always does
  Vector3d tip = Vector3d::Zero();  ///< of a joint without children: where its bone ends
};

struct Frame {
  std::vector<Quaterniond> rotation;  ///< of each joint on its parent
  std::vector<Vector3d> position;     ///< on its parent; of a joint that does not move its offset
};

/// Where a joint is, in the world.
struct Place {
  Eigen::Matrix3d R;
  Vector3d p;
};

struct Clip {
  double interval = 0;  ///< between two frames [s]
  std::vector<Joint> joints;
  std::vector<Frame> frames;

  std::vector<Place> places(size_t frame) const;
};

/// The robot's part of a recording: a joint for each of its bodies, by the body's name, where its
/// first hinge is.
/// @throws InputError for a recording whose scene cannot be made again
Clip clipOf(const sim::Recording& recording);

}  // namespace traceur::clip
