#include "traceur/optim/success_covariance.h"

#include <cassert>
#include <cmath>

namespace traceur::optim {

SuccessConstants successConstants(int n) {
  assert(n >= 1);
  return {.d = 1 + n / 2.0,
          .p_target = 2.0 / 11,
          .c_p = 1.0 / 12,
          .c_c = 2.0 / (n + 2),
          .c_cov = 2.0 / (n * static_cast<double>(n) + 6),
          .p_threshold = 0.44};
}

double updateSuccessRate(const SuccessConstants& c, double p_success, bool success) {
  return (1 - c.c_p) * p_success + (success ? c.c_p : 0);
}

double stepFactor(const SuccessConstants& c, double p_success) {
  return std::exp((p_success - c.p_target) / (c.d * (1 - c.p_target)));
}

bool updateCholesky(Eigen::MatrixXd& L, Eigen::VectorXd v, double a) {
  // Column by column: C' = l lᵀ + (rest), where l takes from v all that acts in row j, and what is
  // left of v acts with weight a/b on the columns still to come.
  const Eigen::Index n = L.rows();
  const Eigen::VectorXd w = L.triangularView<Eigen::Lower>().solve(v);
  if (!(1 + a * w.squaredNorm() > 0)) return false;
  double b = 1;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double next = b + a * w[j] * w[j];
    const double growth = std::sqrt(next / b);
    auto below = L.col(j).tail(n - j - 1);
    auto rest = v.tail(n - j - 1);
    rest -= w[j] * below;
    below = growth * below + a * w[j] / (b * growth) * rest;
    L(j, j) *= growth;
    b = next;
  }
  return true;
}

SuccessCovariance::SuccessCovariance(int n)
    : p_c(Eigen::VectorXd::Zero(n)), L(Eigen::MatrixXd::Identity(n, n)) {}

void SuccessCovariance::learn(const SuccessConstants& c, const Eigen::VectorXd& y,
                              double p_success) {
  const double kept = c.c_c * (2 - c.c_c);
  double decay = 1 - c.c_cov;
  p_c *= 1 - c.c_c;
  if (p_success < c.p_threshold) {
    p_c += std::sqrt(kept) * y;
  } else {
    decay += c.c_cov * kept;
  }
  L *= std::sqrt(decay);
  updateCholesky(L, p_c, c.c_cov);
}

Eigen::MatrixXd SuccessCovariance::covariance() const {
  const Eigen::MatrixXd lower = L.triangularView<Eigen::Lower>();
  return lower * lower.transpose();
}

}  // namespace traceur::optim
