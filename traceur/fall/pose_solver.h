// Whole-body poses that put a plan's contacts where it wants them.
#pragma once

#include <string>
#include <vector>

#include "traceur/fall/planner.h"
#include "traceur/fall/sagittal_body.h"

namespace traceur::fall {

/// Life: made once for a setup and a thread; solve() for each contact of a plan.
class PoseSolver {
 public:
  PoseSolver(const SagittalBody& body, const FallRobot& falls);
  PoseSolver(const PoseSolver&) = delete;
  PoseSolver& operator=(const PoseSolver&) = delete;

  /// A part and where it should be, in the plane, from the pivot.
  struct Goal {
    int node = 0;
    Vector2d place;     ///< [m]
    double weight = 1;  ///< of its squared distance
  };

  /// The pose at a contact: with p₀ the pivot, p₁ the COM and p₂ the tip of the stopper,
  ///
  ///     argmin_q |z(q, c₁) - p₀|² + |com(q) - p₁|² + |z(q, c₂) - p₂|²       [Ha2015, Eq. 19]
  ///
  /// within the joints' limits, over those that a plan moves and the root's place in the plane. Of
  /// the many solutions the one near `from`: a thousandth of the squared angles' differences, in
  /// units of the stance's height, is added, and so is ten times the square of each depth of a
  /// contact point under the ground [ours].
  /// The other joints stay as in the stance.
  /// @param goals   p₀, p₂ and what else should be somewhere
  /// @param com     p₁
  /// @param error   if given, the distance that is left [m]: the square root of the weighted sum
  sim::State solve(const std::vector<Goal>& goals, const Vector2d& com, const sim::State& from,
                   double* error = nullptr);

 private:
  const SagittalBody* body_;
  sim::World world_;
  std::vector<MovedJoint> joints_;
  std::vector<sim::ContactPoint> points_;  // all of the robot's
  double height_;                          // of the COM in the stance [m]
  sim::State stance_;
};

}  // namespace traceur::fall
