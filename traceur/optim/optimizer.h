// Ask and tell: the optimiser is only mathematics; threads, budgets and files live in minimise().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/curve.h"
#include "traceur/optim/problem.h"

namespace traceur::optim {

/// A point the optimiser wants tried.
struct Candidate {
  std::uint64_t id = 0;  ///< names the candidate in tell(); never reused within a run
  VectorXd x;            ///< (n), inside the bounds
};

/// Why an optimiser ended by itself, and the number that decided it.
struct Stop {
  std::string reason;  ///< the literature's name: "tolx", "tolfunhist", "conditioncov", …
  double value = 0;    ///< what was measured
  double limit = 0;    ///< what it was held against
};

/// What every optimiser understands.
struct CommonOptions {
  std::uint64_t seed = 1;
  /// Of those that learn families: K ≤ M control points of the curve, 2 linear, 4 cubic.
  int control_points = 2;
  int lambda = 0;  ///< trials per generation; 0: the optimiser's default. one-plus-one has 1
  /// The first standard deviation of variable i as a fraction of its box, upper - lower; of 1 where
  /// the box is not finite.
  double sigma = 0.3;
  VectorXd x0 = {};  ///< (n) where to begin; empty: the middle of the box. Without two bounds: 1
                     ///< inside the bound there is, or 0.
  bool feasible_first = true;  ///< rank feasible trials before infeasible ones, else all by cost;
                               ///< those that learn families rank by cost
  /// Trials run earlier with the same variables and constraints, for those that learn from
  /// experience. New constraints of the problem come after the old ones.
  std::vector<Trial> experience = {};
};

/// Contract, checked for every optimiser in allOptimizers() by tests/contract/optimizer_test.cpp:
///   1. ask() returns the current generation's candidates that have not been told yet. It is
///      idempotent: asking twice gives equal bits.
///   2. tell() may come in any order; the last one of a generation updates the state, which does
///      not depend on the order. Telling an unknown id throws InputError and changes nothing.
///   3. save() at any time, also mid-generation; restore() of it into an optimiser built with equal
///      options continues with equal bits. Text that is not such a state throws InputError.
///   4. Equal options give equal runs, whatever other instances do.
///   5. A generation in which every trial failed leaves the state finite and is reported by
///      stopped() if it cannot go on.
class Optimizer {
 public:
  virtual ~Optimizer() = default;

  virtual std::vector<Candidate> ask() = 0;
  virtual void tell(std::uint64_t id, const Evaluation& evaluation) = 0;
  /// Set once the optimiser has nothing more to try.
  virtual std::optional<Stop> stopped() const = 0;
  /// The cost of what is sought where that is more than one trial, as a family's mean over its
  /// tasks; minimise() holds it against the target instead of the best trial's cost.
  virtual std::optional<double> achieved() const { return std::nullopt; }
  /// What an optimiser that learns families has found: the best curve whose points have all been
  /// run, the first of equals. None before the first, and of others.
  virtual std::optional<Family> family() const { return std::nullopt; }
  /// (n) what it would answer now where costs are noisy, so that the best trial was the luckiest;
  /// none: the best of the last generation serves.
  virtual std::optional<VectorXd> favourite() const { return std::nullopt; }
  /// The whole state as bytes.
  virtual std::string save() const = 0;
  virtual void restore(std::string_view state) = 0;
};

}  // namespace traceur::optim
