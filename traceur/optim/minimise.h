// The one loop: every optimiser, every problem, threads, budget, progress, resume and a clean stop.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>

#include "traceur/core/error.h"
#include "traceur/optim/evaluator.h"
#include "traceur/optim/optimizer.h"

namespace traceur::optim {

/// What has been found so far. Also the part of a run that is stored beside the optimiser's state.
struct Progress {
  int generation = 0;   ///< generations told
  int evaluations = 0;  ///< trials run
  int failed = 0;       ///< of those, trials without a meaningful cost
  /// Best by better(), never a failed one; the first of equals. Where trials draw, of the
  /// optimiser's favourites after the first generation of each round, all judged in round 0.
  std::optional<Trial> best;
};

/// One generation, handed out after it was told: enough to store and to resume from.
struct Generation {
  const Progress& progress;
  const std::vector<Trial>& trials;  ///< in the order of their ids
  const Optimizer& optimizer;        ///< save() gives the state to resume from
};

/// Thrown by Problem::evaluate, which knows MinimiseOptions::stop, too, and was asked to end: the
/// trial says nothing and is dropped, with its generation.
class Abandoned : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by Problem::evaluate: what should compute the trial broke down on it. Equal x break down
/// equally.
class Broken : public InputError {
 public:
  using InputError::InputError;
};

struct MinimiseOptions {
  int threads = 1;                 ///< 0: one for each processor
  Evaluator* evaluator = nullptr;  ///< who runs the trials; none: so many threads
  int budget = 10000;  ///< trials in all, resumed ones included; the last generation is finished
  /// Stop at Optimizer::achieved() ≤ this, or where it says nothing, at a feasible cost ≤ this.
  double target = -std::numeric_limits<double>::infinity();
  /// Asked to end: trials under way finish, no new one starts, and a generation left incomplete is
  /// dropped, not told. The optimiser then still stands where the last told generation left it.
  std::stop_token stop = {};
  std::function<void(const Generation&)> on_generation = {};  ///< after each told generation
  /// Given: a trial that is Broken is failed, and this told of it, from whichever thread. Not
  /// given: Broken passes through, as all that a trial throws.
  std::function<void(const Broken&)> on_broken = {};
};

/// [ours: as many as a small first generation has]
inline constexpr int kFirstTrials = 10;

/// Generations of a round of Problem::draws() [ours]. After the first of each the favourite is
/// judged; its trial counts in no budget.
inline constexpr int kRoundGenerations = 3;

enum class End { kTarget, kBudget, kOptimizer, kInterrupted };

struct Summary {
  Progress progress;
  End end = End::kBudget;
  /// The reason in words, with its value and limit, whatever the end was: the optimiser's own, or
  /// "target" (cost, target), "budget" (evaluations, budget), "interrupted" (evaluations, budget).
  Stop stop;
};

/// Runs ask → evaluate → tell until the target, the budget, the optimiser's own stop or a request
/// to end; of several at once, the target is reported first, then the request, the optimiser's stop
/// and the budget. Results do not depend on options.threads, nor
/// on who runs the trials. What Problem::evaluate throws passes
/// through (of several, the one of the smallest id) and leaves the generation untold. A run that
/// begins with kFirstTrials trials that are all Broken ends with an InputError: it is not the
/// trials that are wrong.
/// @param start  where an interrupted run was, with the optimiser already restored
/// @throws InputError for a budget or threads out of range, a NaN target, bounds that are NaN or
///         reversed, a candidate of another dimension or outside the problem's bounds, a trial that
///         reports another number of constraints or of tasks than the problem has, or when all of
///         the first trials are Broken
Summary minimise(const Problem& problem, Optimizer& optimizer, const MinimiseOptions& options,
                 const Progress& start = {});

}  // namespace traceur::optim
