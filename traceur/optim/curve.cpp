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
  if (kind == Kind::kBezier) return points * bernstein(K, w);
  if (K == 1) return points.col(0);
  const int k = std::min(static_cast<int>(w * (K - 1)), K - 2);
  const double t = w * (K - 1) - k;
  return (1 - t) * points.col(k) + t * points.col(k + 1);
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
