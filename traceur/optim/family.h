// Optimisers that learn one skill for a whole range of tasks.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/curve.h"
#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// A curve and what running its points at the problem's tasks cost.
struct Family {
  Curve curve;                     ///< of x inside the bounds at every task
  double cost = 0;                 ///< mean over the tasks of f(x(w_i); w_i)
  std::vector<double> task_costs;  ///< (M)
};

/// Seeks a curve x(w) with the least mean cost over Problem::tasks(). Candidates are single trials
/// as ever, each scored for all tasks at once; a trial costs one evaluation whatever it is for, the
/// points of the curve itself included. For each task, trials rank by its cost alone: what
/// violating a constraint costs, the cost must say. Contract: Optimizer's.
class FamilyOptimizer : public Optimizer {
 public:
  /// The best curve whose points have all been run, the first of equals; nothing before the first.
  virtual std::optional<Family> best() const = 0;

  /// +∞ before the first: what a single trial costs is no family's.
  std::optional<double> achieved() const override {
    const std::optional<Family> family = best();
    return family ? family->cost : std::numeric_limits<double>::infinity();
  }
};

/// (M) what a trial says about each task: its cost, NaN where it says nothing. A trial that failed
/// says nothing; one without a cost may leave its tasks' out.
/// @throws InputError, which begins with who it is told to, for costs of another number of tasks
std::vector<double> costsOfTasks(std::string_view who, const Evaluation& evaluation, int tasks);

struct FamilyOptions {
  std::uint64_t seed = 1;
  int control_points = 2;  ///< K ≤ M of the Bézier curve: 2 linear, 4 cubic
  int lambda = 0;          ///< trials per generation; 0: the optimiser's default
  /// The first standard deviation of variable i as a fraction of its box, upper - lower; of 1 where
  /// the box is not finite.
  double sigma = 0.3;
  VectorXd x0 = {};  ///< (n) where every task begins; empty: as CommonOptions::x0
};

struct FamilyOptimizerEntry {
  std::string name;  ///< the word a person types: "contextual"
  std::string help;  ///< one sentence
  /// @throws InputError for a problem without tasks, or options that do not suit it
  std::function<std::unique_ptr<FamilyOptimizer>(const Problem&, const FamilyOptions&)> make;
};

const std::vector<FamilyOptimizerEntry>& allFamilyOptimizers();

/// @throws InputError with the names there are for one there is not
const FamilyOptimizerEntry& findFamilyOptimizer(std::string_view name);

}  // namespace traceur::optim
