// The one loop that moves a robot.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/motion/controller.h"
#include "traceur/sim/recording.h"

namespace traceur::motion {

/// A force and a moment on a body at its COM for a while. Several at once add up.
struct Push {
  sim::BodyId body;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< world axes [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< world axes [N·m]
  double start = 0;                                  ///< since the trial began [s]
  double duration = 0.1;                             ///< [s]
};

/// The robot is put somewhere else from one step to the next, as by a hand. It floats.
struct Drag {
  double start = 0;                                    ///< since the trial began [s]
  Eigen::Vector3d by = Eigen::Vector3d::Zero();        ///< so far, world axes [m]
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< about the COM, whose velocity stays; all
                                                       ///< other motion turns with the body
};

/// A free prop is shot at the robot's COM, which it would meet if both fell on freely.
struct Shot {
  sim::BodyId body;
  double start = 0;                                     ///< since the trial began [s]
  Eigen::Vector3d velocity = Eigen::Vector3d::UnitX();  ///< world axes; not the COM's [m/s]
  double distance = 1;                                  ///< from the COM as it is shot [m]
};

/// Times are rounded to whole steps.
struct TrialOptions {
  double horizon = std::numeric_limits<double>::infinity();  ///< [s]; without, an observer ends it
  std::vector<Push> pushes = {};
  std::vector<Drag> drags = {};
  std::vector<Shot> shots = {};
  double decision_interval = 0;  ///< of the controller [s]; at least each step, as it is with 0
  double delay = 0;              ///< from a state to the torque that answers it [s]
  double encoder_noise = 0;      ///< of the angles PD control reads, standard deviation [rad | m]
  double velocity_noise = 0;     ///< of Senses::comVelocity, by axis [m/s]
  std::uint64_t seed = 1;        ///< of the noise
  std::uint64_t stream = 0;      ///< of the noise
  sim::Recording* recording = nullptr;  ///< filled every kInterval when given
  bool joint_forces = false;            ///< somebody reads Snapshot::jointForces
};

/// Where a trial begins that goes on from another one, with the bits of one that was never parted.
/// Pushes end with their trial.
struct Ending {
  sim::Checkpoint world;
  control::JointTarget target;        ///< what the joints were told last
  Eigen::VectorXd integral = {};      ///< of control::Actuation
  std::deque<sim::Torque> late = {};  ///< what a delay keeps back, the oldest first

  bool empty() const { return world.empty(); }
};

/// How a trial ended. That a simulation diverged is a value.
struct Trial {
  /// "horizon", "diverged", "too many contacts" or an observer's word.
  std::string ended;
  double time = 0;        ///< since it began [s]
  bool diverged = false;  ///< or had too many contacts: what was measured means nothing
  sim::State end;
  std::uint64_t hash = 0;  ///< of the states every kInterval and of the last one
};

/// A trial, step by step. Equal arguments give equal bits, in a new world and in a used one.
/// The world, the actuation, the controller and the observers outlive it.
class Session {
 public:
  /// Time between a recording's frames [s].
  static constexpr double kInterval = 0.01;
  /// How many steps of dt a controller decides once in that is to decide each interval [s].
  static int stepsOf(double interval, double dt);

  Session(sim::World& world, control::Actuation& actuation, Controller& controller,
          std::span<Observer* const> observers);

  /// Puts the world into a state and begins a trial.
  void begin(const sim::State& start, const TrialOptions& options);
  /// Begins a trial where another one ended, of the same model and the same delay.
  void begin(const Ending& start, const TrialOptions& options);
  /// One step, or the end.
  /// @return whether there is a next one
  bool step();
  /// What has become of it; whole once step() has returned false.
  const Trial& trial() const { return trial_; }
  /// From where another trial can go on.
  Ending ending() const;

  /// A whole trial.
  const Trial& run(const sim::State& start, const TrialOptions& options);
  const Trial& run(const Ending& start, const TrialOptions& options);

 private:
  class NoisySenses;

  void prepare(const TrialOptions& options);
  void start();
  void record(bool due);
  bool finish(const Moment& m, std::string_view why);
  bool meddle();
  void decide(const Moment& m);
  void push(const Moment& m, bool anew);

  sim::World* world_;
  control::Actuation* actuation_;
  Controller* controller_;
  std::vector<Observer*> observers_;
  TrialOptions options_;
  Trial trial_;
  double began_ = 0;  // in the world's time [s]
  int step_ = 0;
  int steps_ = 0;  // of the horizon
  int every_ = 1;  // so many steps the controller decides
  bool ended_ = true;
  Random noise_{0};
  Hash hash_;
  control::Command command_;
  control::Command misread_;      // the same, with the errors of encoders
  sim::Torque decided_, torque_;  // the latter is what the motors do, late where there is a delay
  Eigen::VectorXd peaks_;         // of joint forces since the last frame, (bodies) [N]
  std::deque<sim::Torque> late_;  // what a delay keeps back, the oldest first
};

}  // namespace traceur::motion
