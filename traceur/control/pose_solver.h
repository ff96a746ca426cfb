// Whole-body poses that put points, the COM and attitudes where somebody wants them.
#pragma once

#include <optional>
#include <vector>

#include "traceur/sim/snapshot.h"
#include "traceur/sim/world.h"

namespace traceur::control {

using Eigen::VectorXd;

/// A place that follows the robot: the mean of points, the COM, or the world's origin.
struct Place {
  std::vector<sim::BodyPoint> points = {};
  bool com = false;  ///< of the robot, instead

  sim::Vector3d position(const sim::Snapshot& s) const;  ///< [m]
  /// J with ṗ = J·v, (3 x nv).
  void jacobian(const sim::Snapshot& s, Eigen::Ref<sim::Matrix3Xd> J) const;
};

/// What a pose should come to: each of these that is given.
struct PoseGoal {
  Place of;
  Place from = {};  ///< what `of` is seen from, along world axes
  /// Where it should be, by axis [m]; an axis without is free.
  std::optional<double> x = {}, y = {}, z = {};
  std::optional<double> distance = {};  ///< |of − from| [m]
  /// The rotation R_WB that the first point's body should have.
  std::optional<sim::Matrix3d> attitude = {};
  double weight = 1;  ///< of its squared errors, [m²] and [rad²] alike
};

/// The pose nearest to one that is wanted for its own sake, among those that meet the goals:
///
///     argmin_q  Σ w |e(q)|² + ε |q_J − q̂_J|² + ε |root − root₀|²,   q_J within the joints' limits
///
/// e the goals' errors, q_J the joints that may move, q̂ the wanted angles, ε = 10⁻⁶, small enough
/// that goals which can be met are met to .2 mm [ours: measured, see kSteps]. Where the robot
/// floats, its root moves too: with the soles among the goals, the pose is one that stands on them.
/// By damped Gauss-Newton steps with bounds [Levenberg1944]; goals that cannot be met all are
/// missed by least squares.
class PoseSolver {
 public:
  /// @param joints  that may move, by index in model->joints(); each once
  PoseSolver(std::shared_ptr<const sim::Model> model, std::vector<int> joints);

  /// @param from    where the search begins: the root, and joints that may not move, are as here
  /// @param wanted  by index in joints() of the model; those that may not move are ignored
  /// @param error   if given, what is left: the square root of Σ w |e|²
  /// @return v is that of `from`
  sim::State solve(const std::vector<PoseGoal>& goals, const sim::State& from,
                   const VectorXd& wanted, double* error = nullptr);

 private:
  struct Residuals;
  Residuals residuals(const std::vector<PoseGoal>& goals, const sim::State& from,
                      const sim::State& at, const VectorXd& wanted, bool slopes);
  sim::State moved(const sim::State& at, const VectorXd& dx) const;

  std::shared_ptr<const sim::Model> model_;
  std::vector<int> joints_;
  int root_dofs_ = 0;  // 6 where it floats
  sim::World world_;
};

}  // namespace traceur::control
