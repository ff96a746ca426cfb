// Which side of a boundary a point lies on, learned from points whose side is known.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace traceur::optim {

struct SvmOptions {
  double gamma = 1;  ///< > 0; the kernel is exp(-γ ‖a - b‖²), its standard deviation 1/√(2γ)
  double C = 1;      ///< > 0, the price of a training point on the wrong side
  bool balanced = true;  ///< C of a class times N / (2 · its size), so that the rare one counts
};

/// A support vector machine with a radial kernel, trained by LIBSVM [Chang2011]. Its decision value
///
///     d(x) = Σ_i c_i exp(-γ ‖x - s_i‖²) - ρ
///
/// is positive on the side of the points labelled true, 0 on the boundary, ±1 at the margin.
class SvmClassifier {
 public:
  /// @param X       (n x N) training points in columns
  /// @param inside  (N) their labels, at least one of each
  SvmClassifier(const Eigen::MatrixXd& X, const std::vector<bool>& inside,
                const SvmOptions& options);

  /// @param x  (n)
  double decision(const Eigen::VectorXd& x) const;

  int supportVectors() const { return static_cast<int>(coefficients_.size()); }

 private:
  double gamma_;
  double rho_ = 0;
  Eigen::MatrixXd support_;       // (n x support vectors)
  Eigen::VectorXd coefficients_;  // (support vectors)
};

}  // namespace traceur::optim
