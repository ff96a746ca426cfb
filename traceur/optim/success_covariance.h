// What single successful steps teach a normal distribution: the covariance update of elitist CMA.
#pragma once

#include <Eigen/Core>

namespace traceur::optim {

/// Strategy constants of the (1+1)-CMA-ES for n variables [Igel2007, Tab. 1, λ = 1].
struct SuccessConstants {
  double d = 0;            ///< 1 + n/2, damping of the step size
  double p_target = 0;     ///< 2/11, the success rate at which the step size rests
  double c_p = 0;          ///< 1/12, learning rate of the success rate
  double c_c = 0;          ///< 2/(n+2), learning rate of the path
  double c_cov = 0;        ///< 2/(n²+6), learning rate of the covariance
  double p_threshold = 0;  ///< 0.44, the success rate from which the path stalls
};

/// @param n  ≥ 1
SuccessConstants successConstants(int n);

/// The smoothed success rate after one more attempt: (1-c_p) p + c_p [success] [Igel2007, Eq. 3].
double updateSuccessRate(const SuccessConstants& c, double p_success, bool success);

/// The factor of the step size, exp((p - p_target) / (d (1 - p_target))) [Igel2007, Eq. 4].
double stepFactor(const SuccessConstants& c, double p_success);

/// C ← C + a v vᵀ for C = L Lᵀ and any sign of a, in O(n²).
/// @param L  (n x n) lower triangular, positive diagonal; what is above it is not touched
/// @param v  (n), used as scratch
/// @return false, and L unchanged, if the result would not be positive definite
bool updateCholesky(Eigen::MatrixXd& L, Eigen::VectorXd v, double a);

/// Shape and path of a search that keeps its parent. A success, a step y in units of the step size
/// (y = (m_new - m_old)/σ, so that C learns shape and leaves size to σ), teaches
///
///     p < p_threshold:  p_c ← (1-c_c) p_c + √(c_c (2-c_c)) y
///                       C   ← (1-c_cov) C + c_cov p_c p_cᵀ
///     else:             p_c ← (1-c_c) p_c
///                       C   ← (1-c_cov + c_cov c_c (2-c_c)) C + c_cov p_c p_cᵀ    [Igel2007]
///
/// With a high success rate p the step size is about to grow, and the path waits for it. Kept as
/// L Lᵀ = C: a sample is m + σ L z, and no update costs more than O(n²).
struct SuccessCovariance {
  Eigen::VectorXd p_c;  ///< (n) path, 0 at first
  Eigen::MatrixXd L;    ///< (n x n) lower triangular, the identity at first

  explicit SuccessCovariance(int n);

  /// One success.
  /// @param y          (n)
  /// @param p_success  the success rate that decides whether the path stalls
  void learn(const SuccessConstants& c, const Eigen::VectorXd& y, double p_success);

  /// (n x n) C, both triangles.
  Eigen::MatrixXd covariance() const;
};

}  // namespace traceur::optim
