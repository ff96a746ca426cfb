// Contextual CMA-ES: one normal distribution whose mean is a curve over the tasks, and every trial
// teaches it about all of them.
#pragma once

#include <memory>

#include "traceur/core/random.h"
#include "traceur/optim/bound_fold.h"
#include "traceur/optim/family.h"
#include "traceur/optim/symmetric_eigen.h"

namespace traceur::optim {

using Eigen::MatrixXd;

struct ContextualCmaOptions {
  VectorXd tasks;          ///< (M) rising
  VectorXd x0;             ///< (n) where every task begins, inside the bounds
  double sigma = 0.3;      ///< σ₀ > 0, the first standard deviation, in units of scale
  VectorXd scale = {};     ///< (n) > 0, the unit of each variable; empty: 1
  VectorXd lower = {};     ///< (n); empty: no lower bounds
  VectorXd upper = {};     ///< (n); empty: no upper bounds
  int control_points = 2;  ///< K ≥ 1 of the mean's Bézier curve; K ≤ M
  int lambda = 0;          ///< λ ≥ 4, samples per generation of the first run; 0: the default
  std::uint64_t seed = 1;  ///< equal seeds give equal runs
  /// Trials that run the points of the mean curve, which is all that family() reports, for each
  /// sample; one curve a generation at most [ours: a fifth; where costs are rough even neighbouring
  /// curves differ, and a good one has to be met: of a tenth and a fifth the latter is sooner at
  /// the end, later on a smooth cost by as much as it takes].
  double curve_share = 0.2;
  /// Generations whose best samples take part once more; 0: off [ours; of 40 searches past the
  /// ledge of the test GoesWhereALuckySampleWas 27 arrive with 5, 4 with 0, 28 with 10].
  int elite_generations = 5;
  /// A run ends when σ·√(largest eigenvalue of C) falls below tolx·σ₀, or when it has settled and
  /// the least cost of its last stagnation_curves curves is not lower by the fraction tolstagnation
  /// than the least before. The next one begins anew with lambda_factor times as many samples:
  /// elsewhere, or, every other time and if those last curves' costs still differ, about the best
  /// curve. Ranks tell so rough a cost from chance with more samples only [ours; of the nine jumps
  /// of figure-32 eight come to 1.1e-4 within 5000 trials, without it seeds 2 and 5 do not].
  double tolx = 1e-9;
  double tolstagnation = 1e-3;  ///< 0: off
  int stagnation_curves = 0;    ///< 0: 5 + n/4 [ours]
  int max_restarts = 9;         ///< as pycma's IPOP
  double lambda_factor = 2;
};

/// Everything it remembers from one generation to the next, in units of scale.
struct ContextualCmaState {
  std::uint64_t generation = 0;  ///< generations told
  std::uint64_t trials = 0;      ///< of all generations told: the next candidate's id
  int restarts = 0;
  int lambda = 0;             ///< samples per generation of this run
  std::uint64_t updates = 0;  ///< of this run
  std::uint64_t samples = 0;  ///< of this run
  std::uint64_t curves = 0;   ///< of this run: curves run
  MatrixXd A;                 ///< (n x K) control points of the mean, before folding
  double sigma = 0;           ///< step size
  MatrixXd C;                 ///< (n x n) covariance of shape
  MatrixXd p_sigma;           ///< (n x K) path of the step size
  MatrixXd p_c;               ///< (n x K) path of the covariance
  int all_failed = 0;         ///< generations in a row without any meaningful cost
  /// A sample that was some task's best in its generation.
  struct Elite {
    std::uint64_t generation = 0;  ///< told in
    VectorXd x;                    ///< (n) before folding
    std::vector<double> costs;     ///< (M), NaN where it says nothing
  };
  std::vector<Elite> elites;  ///< of this run's last elite_generations, oldest first
  std::vector<double> costs;  ///< of this run's curves, in order
  std::optional<Stop> stop;
};

/// A generation is about M tasks: all there are, or of many one from each stretch. With
/// φ_i = bernstein(K, w_i), the mean of task i is m_i = A φ_i, and sample k of a generation is
/// drawn for one of the tasks, each in turn: x_k ~ N(m_i(k), σ²C). Its cost is known for all tasks,
/// so it stands in for a sample of each task i with the importance of its place,
///
///     r_ki = p_i(x_k) / (1/M Σ_j p_j(x_k)),        p_i = N(m_i, σ²C)
///
/// While the means lie together every task sees all λ samples; when they have moved apart, each
/// sees its own. For each task the samples are ranked by its cost and laid along u ∈ [0, 1], each
/// as long as its share of the importance, and CMA's logarithmic weights of rank become
///
///     w_ki ∝ ∫ max(0, -ln 2u) du over its length,  Σ_k w_ki = 1
///
/// with negative ones from the other half of u; positive ones are among what has a cost, negative
/// ones among all. A sample that alone has a cost gets all the weight, one of hardly any importance
/// hardly any.
///
/// The best sample of task i among the last generations is one more of its samples, with r = 1
/// (0 for tasks of which it is not the best), while it lies within √n + 2n/(n+2) standard
/// deviations of m_i, the bound to which [Hansen2011] clips what is injected: a lucky one, the
/// first jump that lands, is not lost with its generation. Beyond a bound its image on the curve's
/// side does it.
///
/// One least-squares fit moves the curve, each task weighted by h_i, Σ h_i = 1: how much importance
/// its meaningful samples have, up to half of λ. CMA-ES [Hansen2016] does the rest:
///
///     Δ_i = Σ_k w_ki (x_k - m_i),  G = Σ_i h_i φ_i φ_iᵀ,  ΔA = Σ_i h_i Δ_i φ_iᵀ G⁻¹
///     p_σ ← (1-c_σ) p_σ + √(c_σ (2-c_σ) μ_w) C^(-1/2) ΔA G^(1/2)/σ
///     p_c ← (1-c_c) p_c + h_σ √(c_c (2-c_c) μ_w) ΔA G^(1/2)/σ
///     C   ← (1 + c_1 (1-h_σ) c_c (2-c_c) - c_1 - c_μ Σw) C + c_1 p_c p_cᵀ/K
///           + c_μ Σ_ki h_i w_ki y_ki y_kiᵀ
///     σ   ← σ exp(min(1, c_σ/d_σ (‖p_σ‖/χ_nK - 1)))
///
/// with y_ki = (x_k - m_i)/σ. μ_w = K / tr(G⁻¹ Φ S Φᵀ), S_ij = h_i h_j Σ_k w_ki w_kj, makes p_σ
/// standard normal under random ranks: it counts samples that serve several tasks once.
///
/// Linear-in-features means and one covariance as in contextual CMA-ES [Abdolmaleki2017]; that
/// every sample is scored and weighted for every task, the elites and the restarts are ours.
///
/// Failures, bounds and scale as in CmaEs: a failed trial never gets a positive weight. A curve
/// with a bound between its tasks is handed out broken, folded there: the control points beyond are
/// replaced by their mirror images, which at the ends of a line are the same parameters [ours].
class ContextualCma : public FamilyOptimizer {
 public:
  /// @throws InputError for sizes that differ, NaN, fewer tasks than control points, tasks that do
  ///         not rise, reversed bounds, x0 outside them, σ₀ or scale not positive, λ < 4,
  ///         elite_generations < 0
  explicit ContextualCma(ContextualCmaOptions options);

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return state_.stop; }
  std::optional<Family> family() const override { return best_; }
  std::string save() const override;
  void restore(std::string_view state) override;

  const ContextualCmaOptions& options() const { return options_; }  ///< defaults of 0 filled in
  const ContextualCmaState& state() const { return state_; }

 private:
  int dimension() const { return static_cast<int>(options_.x0.size()); }
  int tasks() const { return static_cast<int>(options_.tasks.size()); }
  bool curveIsDue(const ContextualCmaState& s) const;
  int candidates(const ContextualCmaState& s) const {
    return s.lambda + (curveIsDue(s) ? tasks() : 0);
  }
  int lambdaAfter(int restarts) const;
  void beginRun();
  void draw();
  void update();
  struct Seen;
  struct Rates {
    double c_1, c_mu, mu, delta;
  };
  Eigen::RowVectorXd squaredLengths(const MatrixXd& x, const VectorXd& mean) const;
  Seen seen(const MatrixXd& all_costs, const MatrixXd& Phi) const;
  static void weigh(int i, Seen& seen);
  void adapt(const MatrixXd& all_costs);
  void learnCovariance(const Seen& seen, const MatrixXd& A, const MatrixXd& Phi,
                       const Rates& rates);
  void narrow();
  void keepElites(const MatrixXd& all_costs);
  MatrixXd unbroken(MatrixXd A) const;
  void noteCurve();
  void endRunIfDone(bool anything);
  Curve curve() const;
  std::uint64_t fingerprint() const;
  template <class IO, class Costs>
  void costs(IO& io, Costs& of_tasks, bool may_be_none) const;
  template <class IO, class State, class Best, class Told>
  void fields(IO& io, State& s, Best& best, Told& told) const;

  ContextualCmaOptions options_;
  BoundFold bounds_;
  VectorXd w_;    // (M) the tasks along the curve
  MatrixXd Phi_;  // (K x M) φ_i in columns
  ContextualCmaState state_;
  std::optional<Family> best_;
  // Of the current generation: (M) costs of each candidate, NaN where it says nothing.
  std::vector<std::optional<std::vector<double>>> told_;
  int told_count_ = 0;

  // Scratch: all of it follows from the state.
  bool drawn_ = false;
  SymmetricEigen eigen_;
  std::vector<int> anchors_;  // the tasks this generation is about, rising
  VectorXd D_;                // (n) √ of C's eigenvalues
  MatrixXd X_;                // (n x λ) samples before folding, in units of scale
};

/// The registry's maker.
std::unique_ptr<Optimizer> makeContextualCma(const Problem& problem, const CommonOptions& options);

}  // namespace traceur::optim
