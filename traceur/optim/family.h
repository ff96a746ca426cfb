// Optimisers that learn one skill for a whole range of tasks.
#pragma once

#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// Seeks a curve x(w) with the least mean cost over Problem::tasks(). Candidates are single trials
/// as ever, each scored for all tasks at once; a trial costs one evaluation whatever it is for, the
/// points of the curve itself included. For each task, trials rank by its cost alone: what
/// violating a constraint costs, the cost must say. Contract: Optimizer's.
class FamilyOptimizer : public Optimizer {
 public:
  std::optional<Family> family() const override = 0;

  /// +∞ before the first: what a single trial costs is no family's.
  std::optional<double> achieved() const override {
    const std::optional<Family> best = family();
    return best ? best->cost : std::numeric_limits<double>::infinity();
  }
};

/// (M) what a trial says about each task: its cost, NaN where it says nothing. A trial that failed
/// says nothing; one without a cost may leave its tasks' out.
/// @throws InputError, which begins with who it is told to, for costs of another number of tasks
std::vector<double> costsOfTasks(std::string_view who, const Evaluation& evaluation, int tasks);

}  // namespace traceur::optim
