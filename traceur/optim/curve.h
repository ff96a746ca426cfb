// A policy for every task of a range: points in parameter space along a curve.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "traceur/optim/bound_fold.h"

namespace traceur::optim {

/// A path over w ∈ [0, 1], from the first task to the last:
/// x(w) = fold(y(w)) with y(w)
///
///     kBezier    y(w) = Σ_k C(K-1, k) w^k (1-w)^(K-1-k) p_k    K = 2 linear, K = 4 cubic
///                                                              [Ha2015, §7.3.1]
///     kPolyline  straight from p_k, at w = k/(K-1), to p_{k+1}; K = 1: constant
struct Curve {
  enum class Kind { kBezier, kPolyline };

  Kind kind = Kind::kBezier;
  Eigen::MatrixXd points;  ///< (n x K) control points p_k, in columns
  BoundFold bounds = {};   ///< keeps every point inside a box; none by default

  /// (n), folded into the bounds. w outside [0, 1] is taken to the nearer end.
  Eigen::VectorXd at(double w) const;
};

/// A curve and what running its points at a problem's tasks cost.
struct Family {
  Curve curve;                     ///< of x inside the bounds at every task
  double cost = 0;                 ///< mean over the tasks of f(x(w_i); w_i)
  std::vector<double> task_costs;  ///< (M)
};

/// (K) the weights of a Bézier curve's control points at w: x(w) = points · bernstein(K, w).
Eigen::VectorXd bernstein(int K, double w);

}  // namespace traceur::optim
