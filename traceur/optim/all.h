// Every optimiser by name. A new one is a file of its own and a line in all.cpp.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/cma_c.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/one_plus_one.h"
#include "traceur/optim/restarts.h"

namespace traceur::optim {

struct OptimizerEntry {
  std::string name;  ///< the word a person types: "cma-es"
  std::string help;  ///< one sentence
  /// @throws InputError for options that do not suit the problem, and for one without tasks where
  ///         families are learned
  std::function<std::unique_ptr<Optimizer>(const Problem&, const CommonOptions&)> make;
  /// Seeks a curve over Problem::tasks(), Optimizer::family(); the others one point.
  bool learns_families = false;
  bool learns_from_experience = false;  ///< CommonOptions::experience
};

const std::vector<OptimizerEntry>& allOptimizers();

/// @param families  whether it is to learn families; not given: any
/// @throws InputError with the names there are for one there is not
const OptimizerEntry& findOptimizer(std::string_view name, std::optional<bool> families = {});

/// The common options as those of CMA-ES, every variable scaled by its box: for a caller who wants
/// to change a detail.
CmaEsOptions cmaEsOptions(const Problem& problem, const CommonOptions& common);
CmaCOptions cmaCOptions(const Problem& problem, const CommonOptions& common);
OnePlusOneOptions onePlusOneOptions(const Problem& problem, const CommonOptions& common);

}  // namespace traceur::optim
