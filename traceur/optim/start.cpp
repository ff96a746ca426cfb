#include "traceur/optim/start.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"

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

void completeStart(std::string_view who, const VectorXd& x0, double sigma, VectorXd& scale,
                   VectorXd& lower, VectorXd& upper) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", who, why));
  };
  const auto n = static_cast<int>(x0.size());
  if (n == 0) refuse("expected x0 of at least one variable, got none");
  if (!(sigma > 0 && std::isfinite(sigma))) {
    refuse(fmt::format("expected a finite sigma > 0, got {}", sigma));
  }
  if (scale.size() == 0) scale = VectorXd::Ones(n);
  if (scale.size() != n) {
    refuse(fmt::format("expected scale({}) as x0, got scale({})", n, scale.size()));
  }
  if (lower.size() == 0) lower = VectorXd::Constant(n, -kInfinity);
  if (upper.size() == 0) upper = VectorXd::Constant(n, kInfinity);
  checkBounds(who, lower, upper, n);
  for (int i = 0; i < n; ++i) {
    if (!std::isfinite(x0[i])) refuse(fmt::format("x0[{}] is {}", i, x0[i]));
    if (!(scale[i] > 0 && std::isfinite(scale[i]))) {
      refuse(fmt::format("expected a finite scale[{}] > 0, got {}", i, scale[i]));
    }
    if (!(lower[i] <= x0[i] && x0[i] <= upper[i])) {
      refuse(fmt::format("x0[{}] = {} is outside [{}, {}]", i, x0[i], lower[i], upper[i]));
    }
  }
}

}  // namespace traceur::optim
