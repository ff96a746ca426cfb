// (1+1)-CMA-ES: one parent, one trial at a time, and a normal distribution that learns from both.
#pragma once

#include <vector>

#include "traceur/optim/bound_fold.h"
#include "traceur/optim/optimizer.h"
#include "traceur/optim/success_covariance.h"

namespace traceur::optim {

using Eigen::MatrixXd;

struct OnePlusOneOptions {
  VectorXd x0;          ///< (n) tried first, inside the bounds; its size is n
  double sigma = 0.3;   ///< σ₀ > 0, the first standard deviation, in units of scale
  VectorXd scale = {};  ///< (n) > 0, the unit of each variable; empty: 1
  VectorXd lower = {};  ///< (n); empty: no lower bounds
  VectorXd upper = {};  ///< (n); empty: no upper bounds
  int constraints = 0;  ///< that a trial reports on
  std::uint64_t seed = 1;
  bool active = true;  ///< also learn from trials worse than the fifth ancestor [Arnold2010]
  /// Learn from infeasible trials, constraint by constraint, where not to step [Arnold2012].
  bool active_constraints = true;
  /// A trial with fewer violated constraints is better, whatever it costs; false: by cost alone.
  bool feasible_first = true;

  /// Stop at σ·max √C_ii below tolx·σ₀, …
  double tolx = 1e-12;
  /// … above tolxup·σ₀: all the trials on a plateau are successes, …
  double tolxup = 1e4;
  /// … or after so many trials in a row without a meaningful cost. 0: 20 (4 + ⌊3 ln n⌋), as many
  /// as CMA-ES lets pass.
  int tolallfailed = 0;
  /// Instead of stopping, so many fresh starts are made, x0 + σ₀ N(0, I) inside the bounds (but not
  /// after trials that all failed).
  int restarts = 0;
};

/// Everything (1+1)-CMA-ES remembers from one trial to the next.
struct OnePlusOneState {
  std::uint64_t trial = 0;    ///< trials told
  std::uint64_t descent = 0;  ///< 0, 1, … of restarts
  VectorXd parent;            ///< (n) in the unit of x, before folding into the bounds
  bool has_parent = false;    ///< false: the next trial is the start itself
  int violations = 0;         ///< of the parent's constraints; with a failed parent, one more
  double cost = 0;            ///< the parent's
  double sigma = 0;
  double p_success = 0;
  SuccessCovariance shape{0};     ///< in units of scale
  MatrixXd fading;                ///< (n x constraints+1) v_j; the last column is of failures
  std::vector<double> ancestors;  ///< costs of at most five, oldest first
  int all_failed = 0;             ///< trials in a row
  std::optional<Stop> stop;
};

/// Elitist CMA-ES with success-rule step size [Igel2007]. The parent x and C = L Lᵀ give one trial
///
///     y = x + σ L z,   z ~ N(0, I)
///
/// A feasible one counts as a success if it is no worse than x: it moves σ (stepFactor), and a
/// success C (SuccessCovariance). One worse than the fifth-last parent takes from C instead
/// [Arnold2010]:
///
///     C ← (1 + c⁻) C - c⁻ L z zᵀ Lᵀ,   c⁻ = min(0.4/(n^1.6 + 1), 1/(2‖z‖² - 1))
///
/// An infeasible one, while x is feasible, teaches nothing but where the m constraints it violates
/// are [Arnold2012]; each fades in a vector v_j, along which C shrinks:
///
///     v_j ← (1 - c) v_j + c L z,   c = 1/(n+2)
///     C ← C - (2β - β²) v_j v_jᵀ / (v_jᵀ C⁻¹ v_j),   β = 0.1/((n+2) m)
///
/// (printed for L and all j at once; one after the other agrees to first order in β). A failed
/// trial counts as one more constraint. Before a feasible parent is known, a success is a trial
/// with fewer violated constraints, or as many and no greater cost [ours].
///
/// Strong where the optimum is a corner; on noisy costs a lucky parent misleads it. λ is 1: trials
/// come one at a time.
class OnePlusOne : public Optimizer {
 public:
  /// @throws InputError as CmaEs does
  explicit OnePlusOne(OnePlusOneOptions options);

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return state_.stop; }
  std::string save() const override;
  void restore(std::string_view state) override;

  const OnePlusOneOptions& options() const { return options_; }
  const OnePlusOneState& state() const { return state_; }

 private:
  int dimension() const { return static_cast<int>(options_.x0.size()); }
  void begin(std::uint64_t descent);
  void draw();
  void learnFailure(const Evaluation& evaluation);
  void learnSuccess(int violations, double cost);
  void learnWorse();
  void limitToBox();
  std::optional<Stop> findStop() const;
  std::uint64_t fingerprint() const;
  template <class IO, class State>
  void fields(IO& io, State& s) const;

  OnePlusOneOptions options_;
  SuccessConstants constants_;
  BoundFold bounds_;
  OnePlusOneState state_;

  // Scratch: all of it follows from the state.
  bool drawn_ = false;
  VectorXd z_, step_, x_;  // (n), step_ = L z
};

}  // namespace traceur::optim
