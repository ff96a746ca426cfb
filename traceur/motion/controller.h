// What a robot does, a step at a time, whoever moves it; and who watches.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "traceur/control/actuation.h"

namespace traceur::motion {

/// A step of a trial, before it is taken.
struct Moment {
  const sim::Snapshot& s;
  int step = 0;
  double time = 0;  ///< since the trial began: step · Δt [s]
  /// Whether the controller decides at this step; else the torque of its last command holds.
  bool decides = true;
};

/// What a robot reads of itself, with the errors of a trial's sensors. Angles are read by the PD
/// control itself.
class Senses {
 public:
  virtual ~Senses() = default;
  /// The COM's velocity, world axes [m/s]. Each call reads anew.
  virtual Eigen::Vector3d comVelocity() = 0;
};

/// Life of a controller, of which a trial is one:
///   1. begin() at the trial's first moment, with the target that held the robot until then.
///   2. update() at each step at which it decides, then, unless the trial ends there, command().
class Controller {
 public:
  virtual ~Controller() = default;
  virtual void begin(const Moment& m, const control::JointTarget& held) = 0;
  /// Takes up what has happened: a phase that ends, ends here, before observers look.
  virtual void update(const Moment& /*m*/) {}
  /// What to do until it decides anew. `c` is a new command, but for its target: that of the last
  /// step, at first where the joints are.
  virtual void command(const Moment& m, Senses& senses, control::Command& c) = 0;

  /// The index of what it does now in phases().
  virtual int phase() const { return 0; }
  /// May grow during a trial, as a fall's contacts do.
  virtual std::vector<std::string> phases() const = 0;
};

/// Someone who watches a trial, measures it and may end it.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void begin(const Moment& /*m*/) {}
  /// Why the trial ends at this moment; empty: it goes on. The first of several who say so counts.
  virtual std::string_view ends(const Moment& /*m*/) { return {}; }
  /// @param last  no step follows
  virtual void see(const Moment& /*m*/, bool /*last*/) {}
  /// What the motors are told next; only where the controller decides.
  virtual void commanded(const Moment& /*m*/, const control::Command& /*c*/,
                         const sim::Torque& /*torque*/) {}
};

}  // namespace traceur::motion
