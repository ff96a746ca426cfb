// Whole curves about the best one, run point by point until they can no longer win.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "traceur/optim/state.h"

namespace traceur::optim {

/// How long ago a cost last fell by a fifth [ours].
struct Gain {
  double from = std::numeric_limits<double>::infinity();  ///< the cost it fell to
  std::uint64_t since = 0;                                ///< of what is counted: curves, trials

  void note(double cost, std::uint64_t passed);
};

/// Elitist search for a curve of less mean cost over M tasks. A few curves race at a time, drawn
/// about the best one with the step size σ_r. In a generation one point of each is run, first the
/// task that costs the best curve most. A curve drops out as soon as it could not win even if its
/// other points were as good as any trial was there,
///
///     Σ_run f_i + Σ_left min f_i ≥ Σ_i f_i(best)
///
/// so that a hopeless one costs a trial or two instead of M. A winner is the new best, and σ_r
/// grows by a half; for a loser it shrinks by 4 %, from 0.03 back to 1 [ours]. A point that fails
/// loses.
class CurveRace {
 public:
  struct Curve {
    Eigen::MatrixXd points;                                 ///< (n x K) control points
    double cost = std::numeric_limits<double>::infinity();  ///< mean over the tasks
    std::vector<double> task_costs;                         ///< (M)
  };
  struct Entrant {
    Eigen::MatrixXd points;     ///< (n x K)
    std::vector<int> order;     ///< the tasks, as its points are run
    std::vector<double> costs;  ///< of those that have been

    int nextTask() const { return order[costs.size()]; }
  };
  /// (n x K) a curve about the best one, for a step size and its number in the generation.
  using Draw = std::function<Eigen::MatrixXd(double step_size, int number)>;

  explicit CurveRace(int tasks);

  const Curve& best() const { return best_; }
  const std::vector<Entrant>& entrants() const { return entrants_; }
  bool isOn() const { return !entrants_.empty(); }
  /// Of best() since begin(), in trials.
  const Gain& gain() const { return gain_; }
  /// Trials so far.
  std::uint64_t trials() const { return trials_; }

  /// What any trial cost: (M), NaN where it says nothing.
  void see(const std::vector<double>& task_costs);
  /// A curve whose every point has been run; NaN for one that says nothing.
  void offer(const Curve& curve);
  void begin(const Draw& draw);
  /// @param costs  of each entrant's nextTask(), NaN for a failure; fill() or end() comes next
  void tell(const std::vector<double>& costs);
  void fill(const Draw& draw);
  void end() { entrants_.clear(); }

  void save(StateWriter& writer) const;
  /// @param n  variables
  /// @param K  control points
  void restore(StateReader& reader, int n, int K);

 private:
  Curve best_;
  std::vector<double> least_;  // (M) of all trials seen
  std::vector<Entrant> entrants_;
  double step_size_ = 1;
  Gain gain_;
  std::uint64_t trials_ = 0;
};

}  // namespace traceur::optim
