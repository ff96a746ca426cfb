// The dissertation's optimiser for a whole range of tasks: one mean curve, a shape at every task.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/optim/bound_fold.h"
#include "traceur/optim/family.h"
#include "traceur/optim/success_covariance.h"

namespace traceur::optim {

using Eigen::MatrixXd;

/// What σ multiplies when a sample is drawn.
enum class StepSize {
  kDeviation,  ///< m(w) + σ N(0, C) [Ha2015, Eq. 40]
  kVariance,   ///< m(w) + N(0, σ C): the standard deviation moves with √σ, half as fast
};

/// How badly a group of points, one a task, fits a curve. In half the distance between a variable's
/// bounds, as the published policies are normalised to [-1, 1]; without two of them in its scale.
enum class FitError {
  kDistances,       ///< Σ_i ‖x_i - m(w_i)‖ [Ha2015, Eq. 42]
  kStandardErrors,  ///< those of the fitted coefficients, summed over all variables: with X the
                    ///< (M x K) basis, 1 and w for K = 2 and Bernstein's else,
                    ///< Σ_j √(RSS_j/(M-K)) Σ_k √((XᵀX)⁻¹)_kk; 0 for M = K
};

/// Defaults are what the dissertation's text says, where it says something, but for
/// normalised_steps; table11CurveCma() has what its table was made with.
struct CurveCmaOptions {
  VectorXd x0;             ///< (n) inside the bounds: the first curve is this point; its size is n
  VectorXd tasks;          ///< (M) Problem::tasks()
  double sigma = 0.3;      ///< > 0, the first standard deviation, in units of scale
  VectorXd scale = {};     ///< (n) > 0, the unit of each variable; empty: 1
  VectorXd lower = {};     ///< (n); empty: no lower bounds
  VectorXd upper = {};     ///< (n); empty: no upper bounds
  int control_points = 2;  ///< K ≥ 1, at most M are used; 2 linear, 4 cubic
  std::uint64_t seed = 1;  ///< equal seeds give equal runs

  int lambda = 16;    ///< λ ≥ 1, samples per iteration [Ha2015, §7.4]
  int elites = 8;     ///< ν ≥ 1, points remembered for each task: μ/M of μ = 48, M = 6
  int groups = 100;   ///< ≥ 1, combinations tried per iteration [Ha2015, §7.3.2.3]
  double alpha = 10;  ///< α ≥ 0, weight of the fit's error in a group's cost [Ha2015, Eq. 42]
  double failure_exponent = 0.25;  ///< r > 0: a failure divides σ by exp(1/3)^r [Ha2015, Eq. 44]

  StepSize step_size = StepSize::kDeviation;
  FitError fit_error = FitError::kDistances;
  /// The path learns steps in units of σ, as (1+1)-CMA does [Igel2007], so that C learns shape and
  /// leaves size to σ: 15 % fewer trials on a bent cigar than with the text's plain steps, as many
  /// on a sphere [ours; 15 seeds]. false: in units of the first standard deviation.
  bool normalised_steps = true;
  /// c_cov = 2/(n²+offset): 6 in [Igel2007].
  double c_cov_offset = 6;
  /// The success rate that the covariance goes by counts the success it learns from [Igel2007].
  bool fresh_success_rate = true;
  /// The first group tried is every task's best; the others are drawn.
  bool best_group_first = false;
  /// The points of the first curve may be elites.
  bool pool_first_curve = false;

  /// σ√C_jj below tolx times the first standard deviation for all tasks and variables. 0: off.
  double tolx = 1e-12;
  /// σ√C_jj above tolxup times it for some. ∞: off.
  double tolxup = 1e4;
  /// Iterations in a row after which some task still has no meaningful cost, or without any
  /// meaningful sample. INT_MAX: off.
  int tolallfailed = 20;
};

/// What Table 11 of the dissertation was made with, where it differs from the text [found in the
/// course of this reproduction: with these its six unimodal rows come out within 8 %, with the
/// text's a run takes 30 to 45 % more trials; traceur/reproduce/table_11.h]. Leaves x0, tasks,
/// bounds and seed to the caller.
CurveCmaOptions table11CurveCma();

/// Everything CurveCma remembers from one generation to the next, except the trials of this one.
struct CurveCmaState {
  struct Elite {
    double cost = 0;  ///< at the task it is kept for
    VectorXd x;       ///< (n)
  };

  std::uint64_t generation = 0;  ///< generations told
  std::uint64_t first_id = 0;    ///< of this generation's candidates
  bool measuring = true;         ///< this generation runs a curve's points; else it samples
  bool measured = false;         ///< the first curve has been run
  MatrixXd points;               ///< (n x K) control points of the mean curve
  MatrixXd proposed;             ///< (n x K) of the curve being measured
  double cost = 0;               ///< of the mean curve; ∞ if some task's trial failed
  VectorXd task_costs;           ///< (M) of the mean curve
  double sigma = 0;              ///< σ; kVariance: in the square of units of scale
  double p_success = 0;          ///< smoothed success rate
  std::vector<SuccessCovariance> shapes;   ///< (M)
  std::vector<std::vector<Elite>> elites;  ///< (M), each at most ν, best first
  int all_failed = 0;                      ///< iterations in a row, see tolallfailed
  std::optional<Stop> stop;                ///< as of the last told generation
};

/// The parameterised CMA of the dissertation [Ha2015, §7.3.2]. Over the tasks w_i lie a mean curve
/// m(w) = Σ_k b_k(w) p_k and a covariance C_i each. One iteration:
///
///     x_k = m(w_i) + σ L_i z,   L_i L_iᵀ = C_i,   i uniform, z ~ N(0, I),   k = 1 … λ
///     elites of w_i ← the ν least f(x; w_i) among them and the x_k
///     g* = argmin_g Σ_i f(x_i^g_i; w_i) + α e(x_1^g_1, …, x_M^g_M),  over random groups g
///     m′ = least squares through (w_i, x_i^g*_i),   f̂(m) = 1/M Σ_i f(m(w_i); w_i)
///     f̂(m′) < f̂(m):  m ← m′, σ ← σ exp(1/3), C_i learns m′(w_i) - m(w_i) (SuccessCovariance)
///     else:          σ ← σ / exp(1/3)^r
///
/// It takes two generations: λ samples, then the M points of m′. The second is left out, and the
/// iteration a failure, where no control point has moved. The first generation of all runs the M
/// points of the first curve.
///
/// Bounds. Samples are folded (BoundFold) about the mean's unfolded point. Of a line that leaves
/// the box at a task the ends are moved into it, variable by variable; of other curves, whose
/// control points may well lie outside, the variable is shrunk about the mean of what lies inside
/// [ours].
///
/// Failures. A trial that says nothing about a task cannot be its elite. While some task has none
/// there is no group, and the state waits. A curve of which a point fails is not accepted.
/// Constraints do not rank: costs are held against each other as they are.
class CurveCma : public FamilyOptimizer {
 public:
  /// @throws InputError for sizes that differ, no tasks, NaN, bounds reversed or not around x0,
  ///         σ₀ or scale not positive, and other numbers out of the ranges above
  explicit CurveCma(CurveCmaOptions options);

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override { return state_.stop; }
  /// The mean curve: of those accepted the last is the best.
  std::optional<Family> family() const override;
  std::string save() const override;
  void restore(std::string_view state) override;

  const CurveCmaOptions& options() const { return options_; }
  const CurveCmaState& state() const { return state_; }

 private:
  int n() const { return static_cast<int>(options_.x0.size()); }
  int taskCount() const { return static_cast<int>(w_.size()); }
  int count() const { return state_.measuring ? taskCount() : options_.lambda; }
  double deviation() const;
  VectorXd pointAt(const MatrixXd& points, int task) const;
  void draw();
  void update();
  void learnCurve();
  void learnSamples();
  void remember(int candidate);
  void judge(bool success);
  MatrixXd bestGroup() const;
  double fitError(const MatrixXd& group) const;
  void intoBox(MatrixXd& points) const;
  void findStop();
  std::uint64_t fingerprint() const;
  template <class IO, class State, class Told, class Costs>
  void fields(IO& io, State& s, Told& told, Costs& costs) const;

  CurveCmaOptions options_;
  SuccessConstants constants_;
  BoundFold bounds_;
  VectorXd fit_unit_;          // (n) see FitError
  VectorXd w_;                 // (M) the tasks in [0, 1]
  MatrixXd basis_;             // (M x K) b_k(w_i)
  MatrixXd fit_;               // (M x K): control points = group · fit_
  MatrixXd residual_;          // (M x M): group · residual_ is what the fit leaves
  double standard_error_ = 0;  // of a coefficient for residuals of unit length, summed over K

  CurveCmaState state_;
  MatrixXd costs_;          // (M x count) of this generation; NaN where a trial says nothing
  std::vector<bool> told_;  // (count)
  int told_count_ = 0;

  // Scratch: it follows from the state.
  bool drawn_ = false;
  MatrixXd X_;  // (n x count)
};

/// As registered: "curve". CommonOptions::lambda of 0 means 16.
std::unique_ptr<Optimizer> makeCurveCma(const Problem& problem, const CommonOptions& options);

}  // namespace traceur::optim
