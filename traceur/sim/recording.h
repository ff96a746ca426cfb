// What happened in one trial, sampled: enough to draw it, plot it and look at its forces anywhere.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "traceur/sim/snapshot.h"

namespace traceur::sim {

/// The world at one instant.
struct Frame {
  State state;
  Vector3d com = Vector3d::Zero();           ///< of the robot, world [m]
  Vector3d com_velocity = Vector3d::Zero();  ///< [m/s]
  int phase = 0;                             ///< index in Recording::phases
  VectorXd torque;                           ///< motor command, (nu) [N·m]
  std::vector<Contact> contacts;
  /// The largest force of the parent on each body through its joint since the frame before,
  /// (bodies) [N]: what a joint bore of an impact that lies between two frames. Empty in older
  /// recordings.
  VectorXd joint_forces = {};
};

struct Recording {
  /// The scene: Model::fromMjcf makes it again, where its meshes and textures, if any, still are.
  std::string mjcf;
  std::vector<std::string> phases;  ///< names, in order
  std::vector<Frame> frames;        ///< equally spaced in time, the first at the start

  /// Portable bytes (little-endian doubles, versioned).
  std::string encode() const;
  /// @throws InputError for bytes that are not a recording, or of a newer version
  static Recording decode(std::string_view bytes);
};

/// The frame as it is now, without joint forces.
Frame frameOf(const Snapshot& snapshot, int phase, const VectorXd& torque);

}  // namespace traceur::sim
