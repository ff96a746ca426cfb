// The quantities a condition, a feedback term or an objective may name.
#pragma once

#include <deque>
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
///     linear_momentum.x          [kg·m/s];  angular_momentum.x about the COM [kg·m²/s]
///     cop.x                      centre of pressure [m]; not a number in flight
///     support.x .y               middle of the support polygon's corners [m]; as cop
///     support.margin             how far inside the polygon the COM's projection is [m], outside
///                                < 0; as cop
///     root.roll .pitch .yaw      attitude of the root [rad]; pitch > 0 leans forward
///     attitude.NAME.roll         the same of a body
///     somersault.NAME            how far a body has turned forward about its left axis from
///                                upright, counted on through whole turns of the trial [rad]. As
///                                divers say: somersault, tilt, twist [Yeadon1990]
///     tilt.NAME                  how far the left axis points down [rad]
///     heading.NAME               where it is headed, counted on: 0 along x, π/2 along y [rad]
///     spin.x                     whole-body angular velocity I⁻¹ L [rad/s]
///     body.NAME.x                origin of a body [m];  body_velocity.NAME.x [m/s]
///     body_com.NAME.x            a body's centre of mass [m]
///     point.NAME.x               a contact point of the robot's file [m]; point_velocity.NAME.x
///     joint.NAME                 angle [rad];  joint_velocity.NAME [rad/s]
///     joint_force.NAME           magnitude of the force that a joint bears [N]
///     torque.NAME                what a joint's motor was told [N·m]
///     power.NAME                 that times the joint's velocity [W];  power.robot: Σ |power|
///     contact.NAME               how many points of a body or a group of the robot's file touch
///                                something else; a robot's bodies: something that is not the robot
///     contact.robot              of any of its bodies
///     contact_force.NAME         vertical force on them [N]
///     impulse.NAME               of that force over the last 10 ms [N·s]
///
/// Instead of .x and .y a vector's part .forward along the robot's heading, or .left of it, may be
/// named.
///
/// Of a group of bodies, body, body_velocity and body_com are means; of a pair of joints, joint and
/// joint_velocity are means of values that equal motions make equal.
class Signals {
 public:
  explicit Signals(std::shared_ptr<const sim::Model> model);

  /// The place of a signal, valid as long as this object; null if there is no such signal.
  const double* find(const std::string& name);
  /// Examples of every kind for this model, for messages and did-you-mean, as expressions spell
  /// them.
  std::vector<std::string> names() const;

  /// As printed: "m", "m/s"; "" for a pure number, and for what is no signal.
  std::string unitOf(const std::string& name) const;

  /// A trial begins: nothing is remembered of the last one.
  void begin();
  void update(const sim::Snapshot& s);
  /// Whether somebody asked for a joint's force: the world then has to watch them.
  bool readsJointForces() const;

 private:
  using Reader = std::function<double(const sim::Snapshot&)>;
  struct Entry {
    std::string name;
    Reader read;
    double value = 0;
    bool windowed = false;      // the value is the sum of what was read in the window
    bool turns = false;         // an angle that counts on through whole turns
    bool read_before = false;   // in this trial
    std::deque<double> window;  // the oldest first
  };
  Reader reader(const std::string& name) const;
  Reader contactReader(const std::string& name) const;
  Reader jointReader(const std::string& name) const;
  Reader vectorReader(const std::string& name, int axis) const;
  std::vector<bool> bodiesNamed(const std::string& name) const;
  std::vector<sim::BodyId> bodyOrGroup(const std::string& name) const;
  std::vector<std::pair<sim::Joint, double>> jointOrPair(const std::string& name) const;

  std::shared_ptr<const sim::Model> model_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace traceur::control
