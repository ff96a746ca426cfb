#include "traceur/optim/curve.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::optim {

using Eigen::VectorXd;

VectorXd Curve::at(double w) const {
  assert(points.cols() > 0);
  w = std::clamp(w, 0.0, 1.0);
  const int K = static_cast<int>(points.cols());
  VectorXd x;
  if (kind == Kind::kBezier) {
    x = points * bernstein(K, w);
  } else if (K == 1) {
    x = points.col(0);
  } else {
    // A task's w, rounded, lies a hair beside its knot; it is the knot that was run.
    const double nearest = std::round(w * (K - 1));
    const double at = std::abs(w * (K - 1) - nearest) < 1e-9 ? nearest : w * (K - 1);
    const int k = std::min(static_cast<int>(at), K - 2);
    const double t = at - k;
    x = (1 - t) * points.col(k) + t * points.col(k + 1);
  }
  for (int i = 0; i < x.size(); ++i) x[i] = bounds.fold(i, x[i]);
  return x;
}

VectorXd bernstein(int K, double w) {
  assert(K >= 1);
  VectorXd weights(K);
  double binomial = 1;
  for (int k = 0; k < K; ++k) {
    weights[k] = binomial * std::pow(w, k) * std::pow(1 - w, K - 1 - k);
    binomial = binomial * (K - 1 - k) / (k + 1);
  }
  return weights;
}

}  // namespace traceur::optim
