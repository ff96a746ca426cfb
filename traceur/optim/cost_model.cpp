#include "traceur/optim/cost_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace traceur::optim {
namespace {

/// (N) ln of each cost's share of the others below it, standardised; 0 if all are equal.
Eigen::VectorXd targetsOf(const std::vector<double>& costs) {
  std::vector<double> sorted = costs;
  std::sort(sorted.begin(), sorted.end());
  const auto count = static_cast<Eigen::Index>(costs.size());
  Eigen::VectorXd y(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto [low, high] = std::equal_range(sorted.begin(), sorted.end(), costs[i]);
    const auto below = static_cast<double>((low - sorted.begin()) + (high - sorted.begin())) / 2;
    y[i] = std::log(below / static_cast<double>(count));  // the middle of equals, so never 0
  }
  if (sorted.front() == sorted.back()) return Eigen::VectorXd::Zero(count);
  y.array() -= y.mean();
  return y / std::sqrt(y.squaredNorm() / static_cast<double>(count));
}

}  // namespace

CostModel::CostModel(Eigen::MatrixXd X, const std::vector<double>& costs,
                     const CostModelOptions& options)
    : gamma_(1 / (2 * options.width * options.width)), X_(std::move(X)) {
  const Eigen::Index count = X_.cols();
  Eigen::MatrixXd K(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    K.col(i) = (-gamma_ * (X_.colwise() - X_.col(i)).colwise().squaredNorm().array()).exp();
    K(i, i) += options.noise * options.noise;
  }
  const Eigen::LLT<Eigen::MatrixXd> cholesky(K);
  factor_ = cholesky.matrixL();
  weights_ = cholesky.solve(targetsOf(costs));
}

CostModel::Prediction CostModel::predict(const Eigen::VectorXd& x) const {
  Eigen::VectorXd k = (-gamma_ * (X_.colwise() - x).colwise().squaredNorm().array()).exp();
  const double mean = weights_.dot(k);
  factor_.triangularView<Eigen::Lower>().solveInPlace(k);
  return {mean, std::sqrt(std::max(0.0, 1 - k.squaredNorm()))};
}

}  // namespace traceur::optim
