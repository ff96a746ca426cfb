// The quantities a condition, a feedback term or an objective may name.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "traceur/sim/snapshot.h"

namespace traceur::control {

/// Values that change each step, by name: read once per step into fixed places, which expressions
/// point at. Only the signals that somebody asked for are computed.
///
///     time                       since the start [s]
///     com.x  com_velocity.x      centre of mass of the robot [m], [m/s]; .x .y .z
///     angular_momentum.x         about the COM [kg·m²/s]
///     cop.x                      centre of pressure [m]; not a number in flight
///     root.roll .pitch .yaw      attitude of the root [rad]; pitch > 0 leans forward
///     body.NAME.x                origin of a body [m];  body_velocity.NAME.x [m/s]
///     joint.NAME                 angle [rad];  joint_velocity.NAME [rad/s]
///     contact.NAME               how many points of a body or a group of the robot's file touch
///                                something else; a robot's bodies: something that is not the robot
///     contact.robot              of any of its bodies
///     contact_force.NAME         vertical force on them [N]
class Signals {
 public:
  explicit Signals(std::shared_ptr<const sim::Model> model);

  /// The place of a signal, valid as long as this object; null if there is no such signal.
  const double* find(const std::string& name);
  /// Examples of every kind for this model, for messages and did-you-mean; without those whose body
  /// or joint has a name that no expression can spell, such as one with '-'.
  std::vector<std::string> names() const;

  /// As printed: "m", "m/s"; "" for a pure number, and for what is no signal.
  std::string unitOf(const std::string& name) const;

  void update(const sim::Snapshot& s);

 private:
  struct Entry {
    std::string name;
    std::function<double(const sim::Snapshot&)> read;
    double value = 0;
  };
  std::function<double(const sim::Snapshot&)> reader(const std::string& name) const;
  std::vector<bool> bodiesNamed(const std::string& name) const;

  std::shared_ptr<const sim::Model> model_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace traceur::control
