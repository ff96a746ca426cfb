// Ask and tell: the optimiser is only mathematics; threads, budgets and files live in minimise().
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  /// The whole state as bytes.
  virtual std::string save() const = 0;
  virtual void restore(std::string_view state) = 0;
};

}  // namespace traceur::optim
