// What a body in the air does with its pose to arrive as it wants to.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "traceur/flight/poses.h"
#include "traceur/sim/turn.h"

namespace traceur::flight {

/// Until a body in free flight is `height` [m] lower, which rises with `velocity` [m/s] [s]; 0
/// where it is below already and never gets there.
double fallTime(double height, double velocity, double gravity);

/// How a body meets the ground, as far as it can be said.
struct TouchDown {
  double time = 0;                       ///< until then [s]
  Vector3d velocity = Vector3d::Zero();  ///< of the COM, world axes [m/s]
  Vector3d spin = Vector3d::Zero();      ///< I⁻¹ L, world axes [rad/s]
  sim::Turn turn;                        ///< of the root
};

/// What to do in the air.
struct FlightPlan {
  int pose = -1;    ///< the pose to take first; -1: the landing's
  double hold = 0;  ///< how long, from the plan on, until the landing's is taken [s]
  TouchDown touch_down;
  double cost = 0;  ///< of the residual
};

/// Plans the pose in the air so that the body touches down with the somersault that it wants
/// [Ha2015, §3.4.1, Eq. 2]:
///
///     min over poses q and durations Δt of  (θ_T − θ*(v_T, ω_T))² + φ_T²
///
/// θ_T the somersault, φ_T the tilt [ours], which turned() predicts for q taken within kSwitch,
/// held for Δt, the landing's pose taken within kSwitch and held until the ground comes. What the
/// changes of pose turn the root by is part of it [ours].
class FlightPlanner {
 public:
  /// Time in which a pose is taken; so published [s].
  static constexpr double kSwitch = 0.1;
  /// By which joints follow late [s] [ours]
  static constexpr double kLag = 0.04;

  /// The somersault that is wanted at such a touch-down [rad]; equal modulo 2π.
  using Wanted = std::function<double(const TouchDown&)>;

  FlightPlanner(std::shared_ptr<const sim::Model> model, std::vector<FlightPose> poses);

  const std::vector<FlightPose>& poses() const { return poses_; }
  /// What it should be on landing, by joint [rad].
  void landIn(const VectorXd& joints);

  const FlightPose& landing() const { return landing_; }

  /// @param ground  the height of the surface [m]
  /// @param only    the one pose to look at; none: all, and none but the landing's too
  FlightPlan plan(const sim::Snapshot& s, const Wanted& wanted, double ground,
                  std::optional<int> only = {});

 private:
  struct Flight;
  /// A pose, with what it needs to be changed from or to.
  struct Shape {
    VectorXd joints;            // [rad]
    Matrix3d inertia;           // root's axes
    Eigen::Matrix3Xd momentum;  // of each joint's motion with the root held, root's axes
  };
  Shape shapeOf(const sim::Snapshot& s) const;
  Shape shapeOf(const VectorXd& joints);
  PoseChange change(const Shape& from, const Shape& to);
  TouchDown arrive(const Flight& f, const Matrix3d& R) const;
  double height(double somersault);

  std::shared_ptr<const sim::Model> model_;
  std::vector<FlightPose> poses_;
  sim::World world_;  // scratch
  FlightPose landing_;
  std::vector<Shape> shapes_;  // of poses_
  Shape landing_shape_;
  std::vector<PoseChange> to_landing_;  // from poses_
  std::vector<std::pair<double, double>>
      heights_;  // of the COM in the landing's pose, by somersault
};

}  // namespace traceur::flight
