// Gaussian-process regression: what a function may be, given samples of it, and how sure that is.
#pragma once

#include <Eigen/Core>
#include <string>

namespace traceur::gp {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Squared exponential with a length for each input, and white noise [Rasmussen2006, Eq. 5.1]:
///
///     k(x, x') = α² exp(-½ Σ_j (x_j - x'_j)² / l_j²) + σ² δ
struct Kernel {
  VectorXd lengths;   ///< l (r) > 0, in the units of the inputs
  double signal = 1;  ///< α > 0, in the unit of the outputs
  double noise = 0;   ///< σ ≥ 0 of a sample, standard deviation, in the unit of the outputs

  /// α² exp(…), without noise.
  double operator()(const VectorXd& a, const VectorXd& b) const;
};

struct Prediction {
  VectorXd mean;        ///< (m)
  double variance = 0;  ///< of each output without noise; α² far from all samples
};

/// Zero-mean regression of m outputs that share one kernel, and so one variance.
///
///     mean(x) = Y K⁻¹ k(x),    variance(x) = α² - k(x)ᵀ K⁻¹ k(x),    K_ab = k(x_a, x_b) + σ² δ_ab
///
/// [Rasmussen2006, Alg. 2.1]. The Cholesky factor of K grows by a row with each sample.
class Regression {
 public:
  /// @throws InputError for a kernel that is none, or outputs < 1
  Regression(Kernel kernel, int outputs);

  /// Adds a sample in O(N²).
  /// @param x  (r)
  /// @param y  (m)
  /// @throws InputError for other sizes, for what is not finite, and for a sample so like an
  /// earlier
  ///         one that the noise cannot tell the two apart; nothing is added then
  void add(const VectorXd& x, const VectorXd& y);
  /// Another kernel for the same samples, in O(N³).
  /// @throws InputError as the constructor and add; the old kernel stays then
  void setKernel(Kernel kernel);

  int inputs() const { return static_cast<int>(kernel_.lengths.size()); }
  int outputs() const { return static_cast<int>(y_.rows()); }
  int size() const { return static_cast<int>(x_.cols()); }
  const Kernel& kernel() const { return kernel_; }
  const MatrixXd& x() const { return x_; }  ///< (r x N)
  const MatrixXd& y() const { return y_; }  ///< (m x N)
  /// L (N x N) with L Lᵀ = K; above the diagonal 0.
  const MatrixXd& factor() const { return factor_; }

  /// One prediction; Predictor is for many.
  Prediction predict(const VectorXd& x) const;

  /// Σ over outputs of log p(y | x) [Rasmussen2006, Eq. 2.30].
  /// @param gradient  when given: its derivatives by log l (r), log α, log σ, (r + 2)
  double logLikelihood(VectorXd* gradient = nullptr) const;

  /// JSON; doubles keep every bit.
  std::string save() const;
  /// @param where  names the text in messages
  /// @throws InputError for what save() did not write
  static Regression load(const std::string& text, const std::string& where);

 private:
  Kernel kernel_;
  MatrixXd x_, y_;
  MatrixXd factor_;
};

/// How a fit ended.
struct Fit {
  double before = 0;  ///< log likelihood
  double after = 0;   ///< never less
  int evaluations = 0;
};

struct FitOptions {
  int evaluations = 200;  ///< of the likelihood, at most [ours]
  double range = 1e3;     ///< each parameter stays within this factor of its start [ours]
};

/// Sets the kernel to the one that makes the samples most likely, from the present one, by NLopt's
/// L-BFGS over the logarithms of its parameters. Noise of 0 stays 0.
/// @throws InputError without samples
Fit fit(Regression& regression, const FitOptions& options = {});

/// A regression made ready for many predictions: constant, callable from several threads with a
/// scratch each. It computes in single precision, which is twice as fast; means and variances are
/// right to about 1e-5 of α and α² while σ is at least a hundredth of α.
class Predictor {
 public:
  explicit Predictor(const Regression& regression);

  struct Scratch {
    Eigen::VectorXf x, k, v, mean;
  };
  int size() const { return static_cast<int>(x_.rows()); }
  int outputs() const { return static_cast<int>(weights_.cols()); }

  /// @param x     (r)
  /// @param mean  (m), written
  void mean(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> mean, Scratch& scratch) const;
  /// The same, and the variance as Prediction::variance.
  double meanAndVariance(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> mean,
                         Scratch& scratch) const;

 private:
  float signal2_;
  VectorXd inverse_lengths_;
  Eigen::MatrixXf x_;        // (N x r), each input divided by its length
  Eigen::MatrixXf weights_;  // (N x m) K⁻¹ Yᵀ
  Eigen::MatrixXf inverse_;  // (N x N) L⁻¹, lower
};

}  // namespace traceur::gp
