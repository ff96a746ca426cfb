// Planning a fall while it happens: what is left to pay from any state, computed beforehand.
#pragma once

#include <vector>

#include "traceur/fall/planner.h"

namespace traceur::fall {

/// How finely the value is tabulated over time, angle, length and rate [ours].
struct ValueGrid {
  int times = 6;
  int angles = 13;
  int lengths = 5;
  int rates = 11;
};

/// v(contact, t, θ₁, r₁, θ̇₁) on a grid for each node of a problem's graph, filled backwards from
/// the nodes that nothing follows; in between multilinear, outside as at the edge. A state from
/// which nothing can stop the fall has the value of falling flat from its node's greatest length,
/// m √(2 g r), so that interpolation stays finite. Four bytes a value.
class ValueTable {
 public:
  /// Of the values: to be raised when a change of this file, of the planner or of the pendulum
  /// moves one, so that tables kept on disk are made again.
  static constexpr int kVersion = 2;

  explicit ValueTable(const FallProblem& problem, const ValueGrid& grid = {});
  /// One that was made before.
  /// @param values  as values()
  ValueTable(const FallProblem& problem, const ValueGrid& grid, const float* values);

  double at(const FallState& x) const;
  size_t bytes() const { return values_.size() * sizeof(float); }

  struct Axis {
    double min = 0;
    double max = 0;
    int n = 0;
    double at(int i) const { return min + (max - min) * i / (n - 1); }
  };
  struct Node {
    Axis time, theta, r, rate;
    size_t first = 0;  ///< of its values: [time][theta][r][rate]
  };
  const ValueGrid& grid() const { return grid_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<float>& values() const { return values_; }

 private:
  void layOut(const FallProblem& problem);

  ValueGrid grid_;
  std::vector<Node> nodes_;
  std::vector<float> values_;
};

/// How many actions are looked at: those that promise most, by impulse and table, at the first
/// contact, the second and each one after [ours].
struct QuickSearch {
  int first = 24;
  int second = 4;
  int later = 1;
};

/// A plan as planExactly's from fewer looks ahead: branch and bound over the actions that the table
/// recommends. Its cost is that of its own contacts, each computed, never the table's; infinite
/// where none of what it looked at stops the fall.
FallPlan planQuickly(const FallProblem& problem, const ValueTable& table, const FallState& start,
                     const QuickSearch& search = {});

}  // namespace traceur::fall
