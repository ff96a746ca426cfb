#include "traceur/optim/start.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::optim {

Start startOf(const Problem& problem, const VectorXd& x0) {
  const VectorXd lower = problem.lower();
  const VectorXd upper = problem.upper();
  const int n = problem.dimension();
  checkBounds("optimiser", lower, upper, n);
  Start start{x0, VectorXd::Ones(n)};
  VectorXd middle(n);
  for (int i = 0; i < n; ++i) {
    const double l = lower[i];
    const double u = upper[i];
    if (std::isfinite(u - l)) {
      start.scale[i] = u - l;
      middle[i] = l + (u - l) / 2;
    } else if (std::isfinite(l) && std::isfinite(u)) {  // a box wider than the largest number
      middle[i] = l / 2 + u / 2;
    } else {
      middle[i] = std::isfinite(l) ? l + 1 : std::isfinite(u) ? u - 1 : 0;
    }
  }
  if (x0.size() == 0) start.x0 = middle;
  if (start.x0.size() != n) {
    throw InputError(
        fmt::format("optimiser: the problem has {} variables, x0 has {}", n, start.x0.size()));
  }
  return start;
}

}  // namespace traceur::optim
