#include "traceur/optim/cma_constants.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::optim {

CmaConstants cmaConstants(int n, int lambda, bool active) {
  assert(n >= 1 && (lambda == 0 || lambda >= 2));
  CmaConstants c;
  c.lambda = lambda > 0 ? lambda : 4 + static_cast<int>(3 * std::log(n));
  c.mu = c.lambda / 2;

  Eigen::VectorXd w(c.lambda);
  for (int i = 0; i < c.lambda; ++i) w[i] = std::log((c.lambda + 1) / 2.0) - std::log(i + 1.0);
  auto positive = w.head(c.mu);
  auto negative = w.tail(c.lambda - c.mu);
  c.mu_eff = positive.sum() * positive.sum() / positive.squaredNorm();
  c.mu_eff_minus = negative.sum() * negative.sum() / negative.squaredNorm();

  c.c_sigma = (c.mu_eff + 2) / (n + c.mu_eff + 3);
  c.d_sigma = 1 + 2 * std::max(0.0, std::sqrt((c.mu_eff - 1) / (n + 1)) - 1) + c.c_sigma;
  c.c_c = (4 + c.mu_eff / n) / (n + 4 + 2 * c.mu_eff / n);
  c.c_1 = std::min(1.0, c.lambda / 6.0) * 2 / ((n + 1.3) * (n + 1.3) + c.mu_eff);
  c.c_mu = std::min(1 - c.c_1,
                    2 * (0.25 + c.mu_eff + 1 / c.mu_eff - 2) / ((n + 2.0) * (n + 2.0) + c.mu_eff));
  c.chi_n = std::sqrt(n) * (1 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  c.eigen_gap = std::max(1.0, 1 / (10.0 * n * (c.c_1 + c.c_mu)));

  positive /= positive.sum();
  // The negative weights sum to minus the least of three bounds [Hansen2016, Tab. 1]: the first
  // keeps the sum of all updates of C at zero, the second answers their greater variance, the third
  // keeps C positive definite.
  const double alpha = std::min({1 + c.c_1 / c.c_mu, 1 + 2 * c.mu_eff_minus / (c.mu_eff + 2),
                                 (1 - c.c_1 - c.c_mu) / (n * c.c_mu)});
  negative *= active ? alpha / -negative.sum() : 0;
  c.weights = std::move(w);
  return c;
}

}  // namespace traceur::optim
