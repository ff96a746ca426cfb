// A whole robot pushed over in the simulator, by one way or another of meeting the ground.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "traceur/fall/pose_solver.h"
#include "traceur/sim/recording.h"

namespace traceur::fall {

/// What the robot does once it is falling.
enum class Strategy {
  kPlanned,  ///< the poses of a plan, one contact after another
  kHold,     ///< keeps the pose of the stance: "unplanned" [Ha2015, §4.4]
  kLimp,     ///< motors off
  kDamp,     ///< motors only resist motion: kp = 0
  kTuck      ///< curls up
};

std::string_view nameOf(Strategy strategy);

/// A plan as a robot can follow it: a pose a contact, each tracked until the contact is made.
struct FallMotion {
  struct Stage {
    int node = 0;                     ///< of the graph: what is to touch
    std::vector<std::string> points;  ///< any of which on the ground ends it
    double duration = 0;              ///< planned [s]
    double rod_rate = 0;              ///< ṙ₁ until then [m/s]
    std::vector<sim::State> poses;  ///< on the way there, evenly in time; the last when it touches
  };
  std::vector<Stage> stages;
  sim::State rest;  ///< held after the last contact
};

/// The poses that lead through a plan's contacts, and to rest after the last.
/// @param made   contacts made before the plan's pivot, which are kept as far as that costs little
/// @param start  what it was planned from: without contacts there, only how to come to rest
/// @param pose   the robot's then
FallMotion motionOf(const FallPlan& plan, const PendulumModel& model, const SagittalBody& body,
                    PoseSolver& poses, const FallTracking& tracking, const FallState& start,
                    const std::vector<PoseSolver::Goal>& made, const sim::State& pose);

/// A constant force on the push body at its COM, horizontal, along the fall, from the start on.
struct Push {
  double force = 0;       ///< [N]
  double duration = 0.1;  ///< [s] [Ha2015, §4.4.1.1]
};

/// How falls are simulated and measured; all comparisons share one.
struct FallProtocol {
  double time_step = 0.0005;  ///< [s] [Ha2015, §4.4]
  double window = 0.01;  ///< impulses are sums over so long [s]: what the paper's plots rest at
  double settle = 2.5;   ///< how long after the fall is noticed the trial goes on [s]
  double patience = 2;   ///< how long after the push a fall may take to show [s]
  sim::Material ground = {};  ///< its softness decides raw forces, the window most of the rest
};

struct GroundContact {
  std::string part;    ///< the nearest contact point of the body's, or the body
  double time = 0;     ///< of the first touch [s]
  double impulse = 0;  ///< largest windowed one of all contacts until the next part touches [N·s]
};

struct FallTrial {
  bool fell = false;   ///< whether the fall was noticed; without, nothing below means much
  double noticed = 0;  ///< when [s]
  FallState start;     ///< what a plan begins from then
  /// The largest over time of Σ h f_y over the window, f_y the vertical force on what is not the
  /// stance's own contact, which counts once it has been off the ground for the window [N·s].
  double impulse = 0;
  double raw_impulse = 0;  ///< the largest of a single step [N·s]
  double peak_force = 0;   ///< of the same force [N]
  double peak_torque = 0;  ///< as a share of a joint's limit
  double peak_head = 0;    ///< acceleration of the head's point, mean over the window [m/s²]
  bool head_hit = false;   ///< the head touched the ground
  bool diverged = false;
  std::vector<GroundContact> contacts;  ///< in order of first touch
  std::vector<Vector2d> com;  ///< in the plane, from the first pivot, every 10 ms from `noticed` on
  std::vector<std::pair<double, double>> windowed;  ///< time [s], windowed impulse [N·s], every ms
};

/// One thread's workspace for trials of one setup.
class FallSimulator {
 public:
  FallSimulator(const FallRobot& falls, FallSetup setup, FallProtocol protocol = {});

  const SagittalBody& body() const { return body_; }

  /// @throws InputError for a stance that does not stand on its first node, or that should
  ///         stand still but, unpushed, begins to fall within half a second
  void checkStance() const;

  /// Makes the motion from a state; nothing where none is needed or known: what was begun then goes
  /// on. It is asked when the fall is noticed, at the first touch of a planned part (its impulse is
  /// still to come, as measured states have it), and again when the last has not stopped the fall.
  using Plan = std::function<std::optional<FallMotion>(
      const FallState& start, const std::vector<PoseSolver::Goal>& made, const sim::State& pose)>;
  /// A whole trial. Equal arguments give equal bits.
  /// @param plan  of Strategy::kPlanned
  FallTrial run(const Push& push, Strategy strategy, const Plan& plan = {},
                sim::Recording* recording = nullptr);

 private:
  const FallRobot* falls_;
  FallProtocol protocol_;
  SagittalBody body_;
  sim::State stance_;
};

}  // namespace traceur::fall
