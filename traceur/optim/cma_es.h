// CMA-ES: a normal distribution that learns where the better half of its samples lies.
#pragma once

#include <functional>

#include "traceur/optim/bound_fold.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/optimizer.h"
#include "traceur/optim/symmetric_eigen.h"

namespace traceur {
class Random;
}

namespace traceur::optim {

using Eigen::MatrixXd;

/// When CMA-ES has nothing more to gain [Hansen2016, App. B.3]. Names are the literature's, and the
/// reason a run reports. g counts generations, h those with at least one meaningful cost; the
/// history window is w = 10 + ⌈30 n/λ⌉ of the latter. A cost of a generation is its best one's.
struct CmaTermination {
  /// σ·max(√C_ii, |p_c,i|) below tolx·σ₀ in every coordinate. 0: off.
  double tolx = 1e-12;
  /// Costs of the last w generations and all costs of this one within tolfun. 0: off.
  double tolfun = 1e-11;
  /// Costs of the last w generations within tolfunhist. 0: off.
  double tolfunhist = 1e-12;
  /// Costs of the last w generations are equal.
  bool equalfunvals = true;
  /// More than so many generations in a row whose costs are all equal [ours: a plateau, where every
  /// trial says the same, is crossed with growing steps before it is given up; pycma stops at 1].
  int tolflatfitness = 10;
  /// σ·√(largest eigenvalue of C) above tolxup·σ₀: the search runs away. ∞: off.
  double tolxup = 1e4;
  /// σ/σ₀ above tolupsigma·√(largest eigenvalue of C): σ grows while C shrinks. ∞: off.
  double tolupsigma = 1e20;
  /// The condition number of T C Tᵀ above this, as far as it is known: C's while T is the identity,
  /// then that of T Tᵀ. ∞: off [ours: at 1e28 the shortest axis is worth a hundredth of a rounding
  /// error of the longest].
  double conditioncov = 1e28;
  /// A step of 0.1·σ along an axis of the ellipsoid, axis g mod n, does not change the mean.
  bool noeffectaxis = true;
  /// A step of 0.2·σ·√C_ii does not change the mean in some coordinate i.
  bool noeffectcoord = true;
  /// Over the last max(tolstagnation, min(h/5, 20000)) generations, neither the best nor the median
  /// cost has a better median in the last 30 % than in the first 30 %. Tested every
  /// ⌈tolstagnation/20⌉ generations. 0: 100 + ⌊100 n^1.5/λ⌋ as pycma; INT_MAX: off.
  int tolstagnation = 0;
  /// Generations in all. 0: 100 + ⌊150 (n+3)²/√λ⌋ as pycma; INT_MAX: off.
  int maxiter = 0;
  /// So many generations in a row without a meaningful cost [ours]. INT_MAX: off.
  int tolallfailed = 20;
};

struct CmaEsOptions {
  VectorXd x0;          ///< (n) the first mean, inside the bounds; its size is n
  double sigma = 0.3;   ///< σ₀ > 0, the first standard deviation, in units of scale
  VectorXd scale = {};  ///< (n) > 0, the unit of each variable; empty: 1, and σ₀ is in that of x
  VectorXd lower = {};  ///< (n); empty: no lower bounds
  VectorXd upper = {};  ///< (n); empty: no upper bounds
  int lambda = 0;       ///< λ ≥ 2, trials per generation; 0: 4 + ⌊3 ln n⌋
  bool active = true;   ///< also learn from the worse half, by negative weights
  std::uint64_t seed = 1;  ///< equal seeds give equal runs
  /// Rank every feasible trial before every infeasible one; false: all by cost, for costs that
  /// carry their own penalties, so that a good motion that ends in a fall can lead the way.
  bool feasible_first = true;
  CmaTermination termination = {};

  /// Once a feasible trial is known, stay with it: feasible trials alone pull the mean, and a
  /// generation without one learns from the best feasible trial so far in place of its worst.
  /// Needs feasible_first.
  bool hold_feasible = false;
  /// The first trial is x0 itself: whether it is feasible is worth more than one sample.
  bool try_start = false;

  /// The probability with which a draw at x becomes candidate k, asked before any trial is run:
  /// refusing costs none. Depends on k and x only, until the generation has been told.
  std::function<double(int k, const VectorXd& x)> acceptance = {};
  int max_draws = 100;    ///< after so many refused draws one of them is taken all the same
  bool likeliest = true;  ///< the likeliest of them; false: the last
  /// What a trial at x promises to cost, on any scale; asked as acceptance is. Empty: not known.
  std::function<double(int k, const VectorXd& x)> promise = {};
  int choices = 1;  ///< of so many draws the one that promises to cost least becomes a candidate
};

/// Everything CMA-ES remembers from one generation to the next. C, B, D and the paths are in the
/// coordinates of y; D, B are of the last decomposition, at most eigen_gap generations old.
struct CmaState {
  std::uint64_t generation = 0;  ///< generations told
  std::uint64_t updates = 0;     ///< of those, the ones that changed the distribution
  VectorXd mean;                 ///< (n) in the unit of x, before folding into the bounds
  double sigma = 0;              ///< step size
  MatrixXd C;                    ///< (n x n) covariance of shape; the lower triangle only
  MatrixXd B;                    ///< (n x n) its axes, in columns
  VectorXd D;                    ///< (n) √ of its eigenvalues, in no order
  VectorXd p_sigma;              ///< (n) path of the step size
  VectorXd p_c;                  ///< (n) path of the covariance
  MatrixXd axes;                 ///< (n x n) U of T = U diag(lengths); empty: T is the identity
  VectorXd lengths;              ///< (n) > 0; empty as axes
  double condition = 1;  ///< of C at the last decomposition; ∞ if rounding made it singular
  std::uint64_t decomposed = 0;  ///< generation of the last decomposition
  int flat = 0;                  ///< generations in a row with equal costs only
  int all_failed = 0;            ///< generations in a row with failed trials only
  std::uint64_t refused = 0;     ///< draws that acceptance refused, in the told generations
  VectorXd held;                 ///< (n) the best feasible trial of hold_feasible; empty: none yet
  double held_cost = 0;          ///< its cost
  std::optional<Stop> stop;      ///< as of the last told generation
};

/// Active CMA-ES with cumulative step-size adaptation [Hansen2016]. One generation, with weights w
/// of the ranked trials 1 … λ:
///
///     x_k = m + σ T y_k,   y_k = B D z_k,   z_k ~ N(0, I)
///     m  ← m + σ T ⟨y⟩,                                          ⟨y⟩ = Σ w⁺_k y_k
///     p_σ ← (1-c_σ) p_σ + √(c_σ (2-c_σ) μ_eff) B ⟨z⟩
///     p_c ← (1-c_c) p_c + h_σ √(c_c (2-c_c) μ_eff) ⟨y⟩
///     C  ← (1 + c_1 δ - c_1 - c_μ Σw) C + c_1 p_c p_cᵀ + c_μ Σ w°_k y_k y_kᵀ
///     σ  ← σ exp(min(1, c_σ/d_σ (‖p_σ‖/χ_n - 1)))
///
/// with w° = w for w ≥ 0, else w n/‖z_k‖² (so that a far bad trial cannot make C indefinite),
/// h_σ = 0 while ‖p_σ‖ is large, and δ = (1-h_σ) c_c (2-c_c). If the best and the ⌈0.7 λ⌉-th trial
/// cost the same, σ grows by a factor exp(0.2 + c_σ/d_σ) more.
///
/// Condition. T is the identity until the condition number of C, which doubles can hold to about
/// 1e16, is above 1e14; then, and whenever it is above 1e6 later, T takes over what C has learned:
///
///     T B D = U diag(s) Vᵀ;   T ← U diag(s),  C ← I,  p_c ← Vᵀ D⁻¹ Bᵀ p_c,  p_σ ← Vᵀ Bᵀ p_σ
///
/// The distribution and both paths stay what they were, and the next factor 1e14 is again resolved
/// to all digits. Ill-conditioned costs are common, as of units of different kinds, and the search
/// that once stopped here solves those of condition 1e18. pycma does likewise, from 1e12.
///
/// Scale. All of the above is in units of options.scale: the first standard deviation of x_i is
/// σ₀·scale_i.
///
/// Bounds. The search itself is unbounded; what it hands out is folded (BoundFold). In a coordinate
/// with two bounds the standard deviation is kept below a third of their distance, or below where
/// it began if that is more: wider, folding would leave nothing to tell trials apart.
///
/// Failures. Trials rank by better(), or by cost alone (options.feasible_first), failed ones last,
/// ties by id. A failed trial never gets a positive weight, and
/// half of a negative one: the better half of the trials with a meaningful cost share the positive
/// weights, as if only these had been tried. If there are none, only the generation counter moves.
///
/// Held trial (options.hold_feasible). In a generation without a feasible trial the best feasible
/// one so far, x_h, takes the place of the worst, with y = (x_h - m)/σ, shortened to
/// ‖z‖ ≤ √n + 2n/(n+2) as for any injected solution [Hansen2011]: the search cannot lose the
/// feasible region once it has seen it.
///
/// Life: ask and tell as in Optimizer. stopped() is advice; after it, ask and tell still work.
class CmaEs : public Optimizer {
 public:
  /// @throws InputError for sizes that differ, NaN, reversed bounds, x0 outside them, σ₀ or scale
  ///         not positive, λ = 1 or negative, tolerances that are NaN or negative
  explicit CmaEs(CmaEsOptions options);

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return state_.stop; }
  std::string save() const override;
  void restore(std::string_view state) override;

  const CmaEsOptions& options() const { return options_; }  ///< defaults of 0 filled in
  const CmaConstants& constants() const { return constants_; }
  const CmaState& state() const { return state_; }

  /// (n) the mean folded into the bounds: of a noisy cost a better answer than the best trial.
  VectorXd mean() const;
  std::optional<VectorXd> favourite() const override { return mean(); }
  /// (n x n) of x as it is searched, before folding: σ² S T C Tᵀ S with S = diag(scale).
  MatrixXd covariance() const;
  /// √ of the largest eigenvalue of T C Tᵀ, as of the last decomposition.
  double longestAxis() const;
  /// Candidates of the current generation that have been told.
  int toldCount() const { return told_count_; }
  bool isTold(int k) const { return told_[k].has_value(); }

 private:
  /// What is kept of an evaluation: its rank, by class and then by cost.
  struct Told {
    int rank_class = 0;  // 0 feasible, or any if feasible_first is off; 1 infeasible; 2 failed
    double cost = 0;     // 0 if failed
    bool operator<(const Told& other) const {
      return rank_class == other.rank_class ? cost < other.cost : rank_class < other.rank_class;
    }
    bool operator==(const Told& other) const {
      return rank_class == other.rank_class && cost == other.cost;
    }
  };
  /// The told costs of generations with a meaningful one, the latest last.
  struct History {
    std::uint64_t count = 0;   // ever added
    std::vector<Told> best;    // at least the longest window, if so many were added
    std::vector<Told> median;  // same size
  };

  int dimension() const { return static_cast<int>(options_.x0.size()); }
  std::uint64_t fingerprint() const;
  void drawSamples();
  void draw(int k, Random& random);
  void update();
  void takeHeld();
  void hold();
  void adapt(int meaningful);
  bool limitToBox();
  void decompose();
  void moveBasis();
  Eigen::Ref<const VectorXd> stretched(const Eigen::Ref<const VectorXd>& y);
  double deviation(int i) const;
  void remember(int meaningful);
  size_t stagnationWindow(std::uint64_t count) const;
  size_t historyNeeded(std::uint64_t count) const;
  template <class IO>
  static void toldField(IO& io, std::optional<Told>& told);
  template <class IO, class State, class Trials, class Generations>
  void fields(IO& io, State& s, Trials& trials, Generations& history) const;
  std::optional<Stop> findStop(int meaningful) const;
  std::optional<Stop> findHistoryStop(int meaningful) const;

  CmaEsOptions options_;
  CmaConstants constants_;
  BoundFold bounds_;
  int history_window_ = 0;  // w

  CmaState state_;
  History history_;
  std::vector<std::optional<Told>> told_;  // (λ) of the current generation
  int told_count_ = 0;

  // Scratch: all of it follows from the state.
  bool drawn_ = false;
  MatrixXd Z_, Y_, X_;      // (n x λ)
  std::vector<int> order_;  // (λ) best first
  VectorXd y_mean_, z_mean_, step_;
  VectorXd coefficients_;          // (λ)
  VectorXd stretched_;             // (n)
  VectorXd narrowing_;             // (n) factors of the box's
  VectorXd likeliest_;             // (3n) z, y, x of the likeliest refused draw
  VectorXd chosen_;                // (3n) likewise of the most promising draw
  std::uint64_t refused_now_ = 0;  // draws refused for the current generation
  SymmetricEigen eigen_;
};

}  // namespace traceur::optim
