#include "traceur/optim/all.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/text.h"

namespace traceur::optim {

const std::vector<OptimizerEntry>& allOptimizers() {
  static const std::vector<OptimizerEntry> kAll = {
      {"cma-es", "Active CMA-ES: learns a normal distribution from the ranks of its samples.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaEs>(cmaEsOptions(problem, common));
       }},
  };
  return kAll;
}

const OptimizerEntry& findOptimizer(std::string_view name) {
  std::vector<std::string> names;
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (entry.name == name) return entry;
    names.push_back(entry.name);
  }
  throw InputError(fmt::format("no optimiser \"{}\".{} There is: {}", name, didYouMean(name, names),
                               join(names)));
}

CmaEsOptions cmaEsOptions(const Problem& problem, const CommonOptions& common) {
  CmaEsOptions options{.x0 = common.x0,
                       .sigma = common.sigma,
                       .lower = problem.lower(),
                       .upper = problem.upper(),
                       .lambda = common.lambda,
                       .seed = common.seed,
                       .feasible_first = common.feasible_first};
  const int n = problem.dimension();
  checkBounds("optimiser", options.lower, options.upper, n);
  options.scale = VectorXd::Ones(n);
  VectorXd middle(n);
  for (int i = 0; i < n; ++i) {
    const double l = options.lower[i];
    const double u = options.upper[i];
    if (std::isfinite(u - l)) {
      options.scale[i] = u - l;
      middle[i] = l + (u - l) / 2;
    } else if (std::isfinite(l) && std::isfinite(u)) {  // a box wider than the largest number
      middle[i] = l / 2 + u / 2;
    } else {
      middle[i] = std::isfinite(l) ? l + 1 : std::isfinite(u) ? u - 1 : 0;
    }
  }
  if (options.x0.size() == 0) options.x0 = middle;
  if (options.x0.size() != n) {
    throw InputError(
        fmt::format("optimiser: the problem has {} variables, x0 has {}", n, options.x0.size()));
  }
  return options;
}

}  // namespace traceur::optim
