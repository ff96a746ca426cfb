#include "traceur/optim/problem.h"

#include <fmt/format.h>

#include <algorithm>

#include "traceur/core/error.h"
#include "traceur/optim/cost.h"
#include "traceur/optim/start.h"

namespace traceur::optim {

bool Evaluation::meaningful() const {
  return !failed && isCost(cost);
}

bool Evaluation::feasible() const {
  return meaningful() && std::find(violated.begin(), violated.end(), true) == violated.end();
}

ParamSpecs Problem::parameters() const {
  const VectorXd least = lower();
  const VectorXd most = upper();
  const VectorXd x0 = startOf(*this).x0;
  ParamSpecs all;
  for (Eigen::Index i = 0; i < x0.size(); ++i) {
    all.push_back({fmt::format("x{}", i + 1), "", least[i], most[i], x0[i], ""});
  }
  return all;
}

bool better(const Evaluation& a, const Evaluation& b) {
  if (!a.meaningful() || !b.meaningful()) return a.meaningful() && !b.meaningful();
  const bool a_feasible = a.feasible();
  return a_feasible == b.feasible() ? a.cost < b.cost : a_feasible;
}

void checkBounds(std::string_view who, const VectorXd& lower, const VectorXd& upper, int n) {
  if (lower.size() != n || upper.size() != n) {
    throw InputError(
        fmt::format("{}: expected bounds lower({}), upper({}), got lower({}), upper({})", who, n, n,
                    lower.size(), upper.size()));
  }
  for (int i = 0; i < n; ++i) {
    if (!(lower[i] < upper[i])) {  // nor is NaN
      throw InputError(fmt::format("{}: expected lower[{}] < upper[{}], got {} and {}", who, i, i,
                                   lower[i], upper[i]));
    }
  }
}

}  // namespace traceur::optim
