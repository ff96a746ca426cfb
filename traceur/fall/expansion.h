// What can be done from a state of a fall.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "traceur/fall/planner.h"

namespace traceur::fall {

/// All that may happen next, without what a fall that stops by itself makes needless.
struct Expansion {
  bool stops = false;                    ///< some ṙ₁ ends the fall without another contact
  std::vector<PlannedContact> contacts;  ///< none where it stops
};

/// Tries every action; fills `out`, whose memory is used again.
void expand(const FallProblem& problem, const FallState& from, Expansion& out);

/// Whether an impact ended the fall: the pendulum is thrown back, or, where stalling stops it, has
/// not the energy to pass over its new pivot.
bool stopped(const FallProblem& problem, const PendulumState& after);

/// v(x) of planExactly, depth first, with a memory for each depth.
class PlanSearch {
 public:
  /// Which of the contacts at `depth` (0: from the start) to try, in which order, where only a cost
  /// below `bound` is of use.
  using Choose =
      std::function<void(size_t depth, double bound, const std::vector<PlannedContact>& all,
                         std::vector<const PlannedContact*>& chosen)>;

  /// @param prunes  skips contacts whose impulse is not below the best cost found: equal results
  PlanSearch(const FallProblem& problem, bool prunes, Choose choose)
      : problem_(problem), prunes_(prunes), choose_(std::move(choose)) {}

  FallPlan plan(const FallState& start);

  PlanEffort effort;

 private:
  struct Level {
    Expansion expansion;
    std::vector<const PlannedContact*> chosen;
    std::vector<PlannedContact> deeper, best;
  };

  /// The least cost below `bound` and its contacts in reverse; `bound` and nothing if there is
  /// none.
  double costToGo(const FallState& x, double bound, size_t depth,
                  std::vector<PlannedContact>& plan);

  const FallProblem& problem_;
  bool prunes_;
  Choose choose_;
  std::vector<std::unique_ptr<Level>> levels_;
};

}  // namespace traceur::fall
