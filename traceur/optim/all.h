// Every optimiser by name. A new one is a file of its own and a line in all.cpp.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/cma_c.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/one_plus_one.h"
#include "traceur/optim/restarts.h"

namespace traceur::optim {

/// What every optimiser understands.
struct CommonOptions {
  std::uint64_t seed = 1;
  int lambda = 0;  ///< trials per generation; 0: the optimiser's default. one-plus-one has 1
  /// The first standard deviation of variable i as a fraction of its box, upper - lower; of 1 where
  /// the box is not finite.
  double sigma = 0.3;
  VectorXd x0 = {};  ///< (n) where to begin; empty: the middle of the box. Without two bounds: 1
                     ///< inside the bound there is, or 0.
  bool feasible_first = true;  ///< rank feasible trials before infeasible ones, else all by cost
  /// Trials run earlier with the same variables and constraints, for optimisers that learn from
  /// failures (cma-c); others ignore them. New constraints of the problem come after the old ones.
  std::vector<Trial> experience = {};
};

struct OptimizerEntry {
  std::string name;  ///< the word a person types: "cma-es"
  std::string help;  ///< one sentence
  /// @throws InputError for options that do not suit the problem
  std::function<std::unique_ptr<Optimizer>(const Problem&, const CommonOptions&)> make;
};

const std::vector<OptimizerEntry>& allOptimizers();

/// @throws InputError with the names there are for one there is not
const OptimizerEntry& findOptimizer(std::string_view name);

/// The common options as those of CMA-ES, every variable scaled by its box: for a caller who wants
/// to change a detail.
CmaEsOptions cmaEsOptions(const Problem& problem, const CommonOptions& common);
CmaCOptions cmaCOptions(const Problem& problem, const CommonOptions& common);
OnePlusOneOptions onePlusOneOptions(const Problem& problem, const CommonOptions& common);

}  // namespace traceur::optim
