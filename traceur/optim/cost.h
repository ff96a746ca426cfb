// What counts as a cost, in one place.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace traceur::optim {

/// Whether a trial's number says how good it was: it is finite. NaN says nothing; neither does an
/// infinity, of either sign: a logarithm of 0 or a division by it is a mishap of the trial, and -∞,
/// which no other trial could ever better, would end a search at a point that is no answer.
inline bool isCost(double cost) {
  return std::isfinite(cost);
}

/// The mean of costs, (M), M ≥ 1: finite if all of them are, however large.
inline double meanCost(const Eigen::Ref<const Eigen::VectorXd>& costs) {
  const double mean = costs.mean();
  if (std::isfinite(mean)) return mean;
  return (costs / static_cast<double>(costs.size())).sum();  // where only the sum overflowed
}

}  // namespace traceur::optim
