// A search into a run: begun, resumed, told of as it goes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "traceur/optim/all.h"
#include "traceur/practice/run.h"

namespace traceur::practice {

/// How a search is executed; changes no bit of what it finds.
struct Execution {
  int threads = 0;            ///< 0: one for each processor
  std::stop_token stop = {};  ///< asked to end: optim::MinimiseOptions::stop
  /// At the beginning, and after each generation that was stored.
  std::function<void(const optim::Progress&, const std::optional<optim::Family>&)> on_generation =
      {};
  std::function<void(const optim::Broken&)> on_broken = {};  ///< optim::MinimiseOptions::on_broken
};

/// The indices, rising, of the parameters that SearchOptions::only means: all, where it is empty.
/// @throws InputError for a name that none has
std::vector<int> namedBy(const std::vector<std::string>& only, const ParamSpecs& parameters);

/// The optimiser that the options ask for, at its beginning. They name it, and of a family its
/// curve.
/// @param x0              (n) where it begins
/// @param feasible_first  as optim::CommonOptions
/// @throws InputError for options that do not suit the problem or each other, and for experience
///         that is no run, or one of other parameters or constraints
std::unique_ptr<optim::Optimizer> optimiserFor(const optim::Problem& problem, const VectorXd& x0,
                                               const SearchOptions& options, bool feasible_first);

/// Runs minimise() from where the run stands, storing every generation in it. Of a run that was
/// begun here and ends with an exception before a trial gave a cost, no file is left.
/// @param target  as optim::MinimiseOptions
optim::Summary search(Run& run, const optim::Problem& problem, optim::Optimizer& optimiser,
                      double target, const Execution& how);

}  // namespace traceur::practice
