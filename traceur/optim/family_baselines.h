// What a family optimiser has to beat: CMA-ES over whole curves, and CMA-ES for each task by
// itself.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/cma_es.h"
#include "traceur/optim/family.h"

namespace traceur::optim {

/// CMA-ES over the control points φ = (p_1, …, p_K) of a Bézier curve [Ha2015, §7.3.1]. A candidate
/// curve costs M trials, one at each task, and its cost is their mean; it has failed if one says
/// nothing about its task. A generation is λ M trials: the points of the first curve, then of the
/// next. Control points inside the box keep the curve inside.
///
/// Constraints do not rank: costs are held against each other as they are.
class PhiCma : public FamilyOptimizer {
 public:
  /// @param tasks           (M) Problem::tasks()
  /// @param control_points  K ≥ 1, at most M are used
  /// @param cma             of one control point: x0, scale and bounds are (n), and hold for all
  /// @param phi0            (n x K) the first mean; empty: x0 throughout
  /// @throws InputError for tasks that are none, not finite or not rising, and as CmaEs
  PhiCma(const VectorXd& tasks, int control_points, const CmaEsOptions& cma,
         const MatrixXd& phi0 = {});

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return cma_.stopped(); }
  std::optional<Family> family() const override { return best_; }
  std::string save() const override;
  void restore(std::string_view state) override;

  const CmaEs& cma() const { return cma_; }

 private:
  int taskCount() const { return static_cast<int>(w_.size()); }
  int count() const { return cma_.constants().lambda * taskCount(); }
  std::uint64_t firstId() const { return cma_.state().generation * count(); }
  VectorXd pointAt(const VectorXd& phi, int task) const;
  void update();
  template <class IO, class Best, class Trials>
  void fields(IO& io, std::string& inner, Best& best, Trials& told) const;

  VectorXd w_;  // (M) the tasks in [0, 1]
  int n_;
  CmaEs cma_;
  std::vector<std::optional<double>> told_;  // (λ M) the cost at its task, NaN: none
  int told_count_ = 0;
  std::optional<Family> best_;
};

struct IndividualCmaOptions {
  VectorXd tasks;    ///< (M) Problem::tasks()
  CmaEsOptions cma;  ///< of one task
  /// A task is done once its best cost is at most this.
  double target = -std::numeric_limits<double>::infinity();
  /// 0: all tasks are searched side by side. Else the tasks take turns of so many generations,
  /// first to last, over and over, and each begins its first where the task before has its best,
  /// with half of σ₀ [ours].
  int turn = 0;
};

/// Every task by itself with CMA-ES [Ha2015, §7.4.1]: what a trial costs at other tasks is not
/// looked at. A task's search ends for CmaEs's own reasons or at the target; the last one to end
/// gives stopped(), and nothing is left to try.
///
/// family() is the polyline through the best point of every task, all of them run; it speaks once
/// every task has a meaningful cost. The polyline's knots are evenly spaced
/// (Curve), so the tasks must lie on an even grid.
///
/// Constraints do not rank: costs are held against each other as they are.
class IndividualCma : public FamilyOptimizer {
 public:
  /// @throws InputError for tasks that are none, not finite, not rising or not on an even grid of
  ///         1000 steps at most; a negative turn, a NaN target; and as CmaEs
  explicit IndividualCma(IndividualCmaOptions options);

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return stop_; }
  std::optional<Family> family() const override { return best_; }
  std::string save() const override;
  void restore(std::string_view state) override;

 private:
  struct Search {
    std::unique_ptr<CmaEs> cma;                             // none before its first turn
    VectorXd x0;                                            // where it began
    double cost = std::numeric_limits<double>::infinity();  // the best of its task alone
    VectorXd best;                                          // its point; empty before there is one
    std::optional<Stop> stop;
  };
  /// One candidate of this generation.
  struct Asked {
    int task = 0;
    std::uint64_t inner = 0;  // the search's own id
    VectorXd x;
    std::optional<double> cost;  // at the task; NaN if the trial says nothing about it
  };

  int taskCount() const { return static_cast<int>(w_.size()); }
  std::unique_ptr<CmaEs> searchFrom(int task, const VectorXd& x0) const;
  std::vector<Asked> gather() const;
  void update();
  void passTurn();
  void join();
  std::uint64_t fingerprint() const;
  template <class IO, class Begun>
  void searchField(IO& io, Begun& search, int task) const;
  template <class IO, class Self>
  void fields(IO& io, Self& s) const;

  IndividualCmaOptions options_;
  VectorXd w_;     // (M) the tasks in [0, 1]
  int knots_ = 0;  // of the polyline
  std::vector<Search> searches_;
  std::uint64_t generation_ = 0;
  std::uint64_t first_id_ = 0;
  int current_ = 0;  // with turns: whose it is
  int left_ = 0;     // generations of it
  std::optional<Stop> stop_;
  std::optional<Family> best_;
  std::vector<Asked> asked_;
  int told_count_ = 0;
};

/// As registered: "cma", "individual", "neighbours".
/// CommonOptions::lambda of 0 means 16 [Ha2015, §7.4].
std::unique_ptr<Optimizer> makePhiCma(const Problem& problem, const CommonOptions& options);
std::unique_ptr<Optimizer> makeIndividualCma(const Problem& problem, const CommonOptions& options);
std::unique_ptr<Optimizer> makeNeighbourCma(const Problem& problem, const CommonOptions& options);

}  // namespace traceur::optim
