// What a trial will cost compared with others, learned from what they have cost.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace traceur::optim {

struct CostModelOptions {
  double width = 1;    ///< > 0, the kernel's standard deviation
  double noise = 0.1;  ///< > 0, standard deviation of what the kernel cannot explain, of targets' 1
};

/// A Gaussian process [Rasmussen2006, Alg. 2.1] over the ranks of costs, so that it, like CMA-ES,
/// does not change when costs go through an increasing function. The trial with share p of the
/// others below it (equals by half) has the target ln p, made to mean 0 and variance 1 over all:
/// what is good is told apart finely, what is bad coarsely. With k(a, b) = exp(-‖a - b‖²/(2 w²)),
///
///     mean(x) = k(x)ᵀ (K + σ² I)⁻¹ y,    deviation(x)² = 1 - k(x)ᵀ (K + σ² I)⁻¹ k(x)
class CostModel {
 public:
  /// @param X      (n x N) trials in columns, N ≥ 1
  /// @param costs  (N) finite
  CostModel(Eigen::MatrixXd X, const std::vector<double>& costs, const CostModelOptions& options);

  struct Prediction {
    double mean = 0;       ///< lower is better; 0 far from all trials
    double deviation = 0;  ///< in [0, 1]; 1 far from all trials
  };
  /// @param x  (n)
  Prediction predict(const Eigen::VectorXd& x) const;

 private:
  double gamma_;
  Eigen::MatrixXd X_;
  Eigen::MatrixXd factor_;   // (N x N) L with L Lᵀ = K + σ² I; above the diagonal 0
  Eigen::VectorXd weights_;  // (N) (K + σ² I)⁻¹ y
};

}  // namespace traceur::optim
