#include "traceur/optim/curve_cma.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/cost.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/start.h"
#include "traceur/optim/state.h"
#include "traceur/optim/task_positions.h"

namespace traceur::optim {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view kCurve = "curve";
constexpr std::uint64_t kCurveStateVersion = 2;

/// A success multiplies σ by this [Ha2015, Eq. 44].
const double kGrowth = std::exp(1.0 / 3);
/// A fit that moves the control points by less than this, in units of scale, has found nothing new:
/// the 1e-10 of the dissertation's runs.
constexpr double kUnmoved = 1e-10;
/// Costs beyond this are added up in smaller units: some thousands of tasks' would overflow.
constexpr double kHugeCost = 1e300;
/// A typing error rather than a number of samples, elites or groups.
constexpr int kMany = 1'000'000;

void checkCount(std::string_view name, int value) {
  if (value < 1 || value > kMany) {
    refuse(kCurve, "expected {} in [1, {}], got {}", name, kMany, value);
  }
}

/// Checks what a caller gave and fills in what was left to its default.
CurveCmaOptions complete(CurveCmaOptions o) {
  completeStart(kCurve, o.x0, o.sigma, o.scale, o.lower, o.upper);
  checkCount("control_points", o.control_points);
  checkCount("lambda", o.lambda);
  checkCount("elites", o.elites);
  checkCount("groups", o.groups);
  checkCount("tolallfailed", std::min(o.tolallfailed, kMany));
  for (const auto& [name, value] :
       {std::pair("alpha", o.alpha), std::pair("tolx", o.tolx), std::pair("tolxup", o.tolxup),
        std::pair("c_cov_offset", o.c_cov_offset)}) {
    if (!(value >= 0)) refuse(kCurve, "expected {} ≥ 0, got {}", name, value);
  }
  if (!(o.failure_exponent > 0 && std::isfinite(o.failure_exponent))) {
    refuse(kCurve, "expected a finite failure_exponent > 0, got {}", o.failure_exponent);
  }
  return o;
}

}  // namespace

CurveCmaOptions table11CurveCma() {
  CurveCmaOptions o;
  o.sigma = 1;
  o.groups = 64;
  o.step_size = StepSize::kVariance;
  o.fit_error = FitError::kStandardErrors;
  o.normalised_steps = false;
  o.c_cov_offset = 2;
  o.fresh_success_rate = false;
  o.best_group_first = true;
  o.pool_first_curve = true;
  return o;
}

CurveCma::CurveCma(CurveCmaOptions options)
    : options_(complete(std::move(options))),
      constants_(successConstants(n())),
      bounds_(options_.lower, options_.upper, options_.sigma * options_.scale),
      fit_unit_(options_.scale),
      w_(taskPositions(kCurve, options_.tasks)) {
  for (int j = 0; j < n(); ++j) {
    const double width = options_.upper[j] - options_.lower[j];
    if (std::isfinite(width)) fit_unit_[j] = width / 2;
  }
  constants_.c_cov = 2 / (static_cast<double>(n()) * n() + options_.c_cov_offset);
  const int K = std::min(options_.control_points, taskCount());
  basis_.resize(taskCount(), K);
  for (int i = 0; i < taskCount(); ++i) basis_.row(i) = bernstein(K, w_[i]).transpose();
  const MatrixXd inverse = basis_.completeOrthogonalDecomposition().pseudoInverse();
  fit_ = inverse.transpose();
  residual_ = MatrixXd::Identity(taskCount(), taskCount()) - fit_ * basis_.transpose();
  if (taskCount() > K) {
    MatrixXd X = basis_;
    if (K == 2) X.col(0).setOnes();  // x = p_1 + (p_2 - p_1) w
    const MatrixXd X_inverse = X.completeOrthogonalDecomposition().pseudoInverse();
    // (XᵀX)⁻¹ = X⁺ X⁺ᵀ
    standard_error_ = X_inverse.rowwise().norm().sum() / std::sqrt(taskCount() - K);
  }

  CurveCmaState& s = state_;
  s.points = options_.x0.replicate(1, K);
  s.proposed = s.points;
  s.cost = kInfinity;
  s.task_costs = VectorXd::Constant(taskCount(), kNaN);
  s.sigma =
      options_.step_size == StepSize::kVariance ? options_.sigma * options_.sigma : options_.sigma;
  s.p_success = constants_.p_target;
  s.shapes.assign(taskCount(), SuccessCovariance(n()));
  s.elites.resize(taskCount());
  costs_ = MatrixXd::Constant(taskCount(), count(), kNaN);
  told_.assign(count(), false);
}

double CurveCma::deviation() const {
  return options_.step_size == StepSize::kVariance ? std::sqrt(state_.sigma) : state_.sigma;
}

VectorXd CurveCma::pointAt(const MatrixXd& points, int task) const {
  // As Curve::at() has it, to the bit.
  const VectorXd x = points * bernstein(static_cast<int>(points.cols()), w_[task]);
  // Of control points on a bound the sum may round to a point beyond it.
  return x.cwiseMax(options_.lower).cwiseMin(options_.upper);
}

std::vector<Candidate> CurveCma::ask() {
  if (!drawn_) draw();
  std::vector<Candidate> candidates;
  candidates.reserve(count() - told_count_);
  for (int k = 0; k < count(); ++k) {
    if (!told_[k]) candidates.push_back({state_.first_id + k, X_.col(k)});
  }
  return candidates;
}

void CurveCma::draw() {
  X_.resize(n(), count());
  if (state_.measuring) {
    for (int i = 0; i < taskCount(); ++i) X_.col(i) = pointAt(state_.proposed, i);
  } else {
    VectorXd z(n());
    for (int k = 0; k < count(); ++k) {
      Random random(options_.seed, state_.generation, k);
      const int task = static_cast<int>(random.below(taskCount()));
      for (double& value : z) value = random.normal();
      const VectorXd y = state_.shapes[task].L.triangularView<Eigen::Lower>() * z;
      const VectorXd mean = pointAt(state_.points, task);
      for (int i = 0; i < n(); ++i) {
        X_(i, k) =
            bounds_.fold(i, bounds_.unfold(i, mean[i]) + deviation() * options_.scale[i] * y[i]);
      }
    }
  }
  drawn_ = true;
}

void CurveCma::tell(std::uint64_t id, const Evaluation& evaluation) {
  if (id < state_.first_id || id - state_.first_id >= told_.size()) {
    refuse(kCurve, "no candidate {} in generation {}, which has {} to {}", id, state_.generation,
           state_.first_id, state_.first_id + told_.size() - 1);
  }
  const auto k = static_cast<int>(id - state_.first_id);
  if (told_[k]) refuse(kCurve, "candidate {} has been told already", id);
  const std::vector<double> costs = costsOfTasks(kCurve, evaluation, taskCount());
  costs_.col(k) = Eigen::Map<const VectorXd>(costs.data(), taskCount());
  told_[k] = true;
  if (++told_count_ == count()) update();
}

void CurveCma::update() {
  if (!drawn_) draw();  // restored, and told without being asked
  const int told = count();
  if (state_.measuring) {
    learnCurve();
  } else {
    learnSamples();
  }
  ++state_.generation;
  state_.first_id += told;
  findStop();
  costs_ = MatrixXd::Constant(taskCount(), count(), kNaN);
  told_.assign(count(), false);
  told_count_ = 0;
  drawn_ = false;
}

void CurveCma::remember(int candidate) {
  for (int i = 0; i < taskCount(); ++i) {
    const double cost = costs_(i, candidate);
    if (!isCost(cost)) continue;
    auto& elites = state_.elites[i];
    const auto place = std::upper_bound(elites.begin(), elites.end(), cost,
                                        [](double c, const auto& elite) { return c < elite.cost; });
    elites.insert(place, {cost, X_.col(candidate)});
    if (static_cast<int>(elites.size()) > options_.elites) elites.pop_back();
  }
}

void CurveCma::learnCurve() {
  CurveCmaState& s = state_;
  const VectorXd task_costs = costs_.diagonal();
  double cost = kInfinity;
  if (std::all_of(task_costs.begin(), task_costs.end(), isCost)) cost = meanCost(task_costs);
  if (!isCost(cost)) cost = kInfinity;
  s.measuring = false;

  const bool first = !s.measured;
  if (first && options_.pool_first_curve) {
    for (int i = 0; i < taskCount(); ++i) remember(i);
  }
  if (!first) judge(cost < s.cost);
  if (first || cost < s.cost) {
    s.points = s.proposed;
    s.cost = cost;
    s.task_costs = task_costs;
  }
  s.measured = true;
}

void CurveCma::learnSamples() {
  CurveCmaState& s = state_;
  for (int k = 0; k < count(); ++k) remember(k);
  const bool nothing = costs_.array().isNaN().all();
  const bool blind = std::any_of(s.elites.begin(), s.elites.end(),
                                 [](const auto& elites) { return elites.empty(); });
  s.all_failed = nothing || blind ? s.all_failed + 1 : 0;
  if (blind) return;

  s.proposed = bestGroup() * fit_;
  intoBox(s.proposed);
  const MatrixXd moved = options_.scale.cwiseInverse().asDiagonal() * (s.proposed - s.points);
  if (moved.norm() < kUnmoved) {
    judge(false);
  } else {
    s.measuring = true;
  }
}

/// The end of an iteration: step size, success rate, and on success every task's shape.
void CurveCma::judge(bool success) {
  CurveCmaState& s = state_;
  const double updated = updateSuccessRate(constants_, s.p_success, success);
  if (success) {
    const double p = options_.fresh_success_rate ? updated : s.p_success;
    const double unit = options_.normalised_steps ? deviation() : options_.sigma;
    for (int i = 0; i < taskCount(); ++i) {
      const VectorXd step = pointAt(s.proposed, i) - pointAt(s.points, i);
      s.shapes[i].learn(constants_, step.cwiseQuotient(options_.scale) / unit, p);
    }
  }
  s.p_success = updated;
  s.sigma *= success ? kGrowth : std::pow(kGrowth, -options_.failure_exponent);
}

/// (n x M) the least costly of the groups tried, the first of equals.
MatrixXd CurveCma::bestGroup() const {
  Random random(options_.seed, state_.generation, options_.lambda);  // no sample has this number
  MatrixXd group(n(), taskCount());
  MatrixXd best(n(), taskCount());
  double least = kInfinity;
  // A part of huge costs so small that their sum cannot overflow; all of others, to the bit.
  double largest = 0;
  for (const auto& elites : state_.elites) {
    for (const auto& elite : elites) largest = std::max(largest, std::abs(elite.cost));
  }
  const double part = largest < kHugeCost ? 1 : 0x1p-64;
  for (int g = 0; g < options_.groups; ++g) {
    double cost = 0;
    for (int i = 0; i < taskCount(); ++i) {
      const auto& elites = state_.elites[i];
      const bool top = g == 0 && options_.best_group_first;
      const auto& elite = elites[top ? 0 : random.below(elites.size())];
      cost += part * elite.cost;
      group.col(i) = elite.x;
    }
    cost += part * (options_.alpha * fitError(group));
    if (g == 0 || cost < least) {
      best = group;
      least = cost;
    }
  }
  return best;
}

double CurveCma::fitError(const MatrixXd& group) const {
  const MatrixXd left = fit_unit_.cwiseInverse().asDiagonal() * (group * residual_);
  return options_.fit_error == FitError::kDistances ? left.colwise().norm().sum()
                                                    : left.rowwise().norm().sum() * standard_error_;
}

void CurveCma::intoBox(MatrixXd& points) const {
  const MatrixXd at = points * basis_.transpose();
  for (int j = 0; j < n(); ++j) {
    const double l = options_.lower[j];
    const double u = options_.upper[j];
    if (at.row(j).minCoeff() >= l && at.row(j).maxCoeff() <= u) continue;
    if (points.cols() <= 2) {  // its control points are its ends
      points.row(j) = points.row(j).cwiseMax(l).cwiseMin(u);
      continue;
    }
    const double inside = at.row(j).cwiseMax(l).cwiseMin(u).mean();
    const double above = at.row(j).maxCoeff() - inside;
    const double below = inside - at.row(j).minCoeff();
    double shrink = 1;
    if (above > 0) shrink = std::min(shrink, (u - inside) / above);
    if (below > 0) shrink = std::min(shrink, (inside - l) / below);
    points.row(j) = inside + shrink * (points.row(j).array() - inside);
  }
}

void CurveCma::findStop() {
  CurveCmaState& s = state_;
  s.stop.reset();
  if (s.all_failed >= options_.tolallfailed) {
    s.stop = Stop{"tolallfailed", static_cast<double>(s.all_failed),
                  static_cast<double>(options_.tolallfailed)};
    return;
  }
  double widest = 0;
  for (const SuccessCovariance& shape : s.shapes) {
    for (int j = 0; j < n(); ++j) widest = std::max(widest, shape.L.row(j).head(j + 1).norm());
  }
  widest *= deviation() / options_.sigma;
  if (widest < options_.tolx) s.stop = Stop{"tolx", widest, options_.tolx};
  if (!(widest <= options_.tolxup)) s.stop = Stop{"tolxup", widest, options_.tolxup};
}

std::optional<Family> CurveCma::family() const {
  if (!isCost(state_.cost)) return std::nullopt;
  Family family;
  family.curve.points = state_.points;
  family.cost = state_.cost;
  family.task_costs.assign(state_.task_costs.begin(), state_.task_costs.end());
  return family;
}

std::uint64_t CurveCma::fingerprint() const {
  StateWriter w("options", kCurveStateVersion);
  const CurveCmaOptions& o = options_;
  for (const VectorXd* v : {&o.x0, &o.tasks, &o.scale, &o.lower, &o.upper}) w.reals(numbers(*v));
  for (const double v : {o.sigma, o.alpha, o.failure_exponent, o.c_cov_offset, o.tolx, o.tolxup}) {
    w.real(v);
  }
  for (const int v :
       {o.control_points, o.lambda, o.elites, o.groups, static_cast<int>(o.step_size),
        static_cast<int>(o.fit_error), int{o.normalised_steps}, int{o.fresh_success_rate},
        int{o.best_group_first}, int{o.pool_first_curve}, o.tolallfailed}) {
    w.integer(v);
  }
  w.integer(o.seed);
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

template <class IO, class State, class Told, class Costs>
void CurveCma::fields(IO& io, State& s, Told& told, Costs& costs) const {
  io.integer(s.generation, 0, kMostGenerations);
  io.integer(s.first_id, 0, kMostTrials);
  io.boolean(s.measuring);
  io.boolean(s.measured);
  io.finite(numbers(s.points));
  io.finite(numbers(s.proposed));
  io.real(s.cost, std::numeric_limits<double>::lowest(), kInfinity);
  io.reals(numbers(s.task_costs));
  io.require(!isCost(s.cost) || s.task_costs.allFinite(), "a task of its curve has no cost");
  io.positive(s.sigma);
  io.real(s.p_success, 0, 1);
  for (auto& shape : s.shapes) {
    io.finite(numbers(shape.p_c));
    io.finite(numbers(shape.L));
    io.require(shape.L.diagonal().minCoeff() > 0, "a task's covariance is none");
  }
  for (auto& elites : s.elites) {
    io.list(elites, 0, options_.elites, [&](auto& elite) {
      io.finite(elite.cost);
      io.resize(elite.x, n());
      io.finite(numbers(elite.x));
    });
  }
  io.integer(s.all_failed, 0, kMostInARow);
  field(io, s.stop);
  const int size = s.measuring ? taskCount() : options_.lambda;
  io.resize(told, size);
  for (int k = 0; k < size; ++k) {
    bool is_told = told[k];
    io.boolean(is_told);
    if constexpr (IO::kReads) told[k] = is_told;
  }
  io.resize(costs, taskCount(), size);
  io.reals(numbers(costs));
  io.require(!costs.array().isInf().any(), "a trial has an infinite cost");
}

std::string CurveCma::save() const {
  StateWriter w(kCurve, kCurveStateVersion);
  w.integer(fingerprint());
  fields(w, state_, told_, costs_);
  return w.finish();
}

void CurveCma::restore(std::string_view text) {
  StateReader r(text, kCurve, kCurveStateVersion);
  if (r.integer() != fingerprint()) {
    refuse(kCurve,
           "cannot restore a state saved under other options (seed, x0, sigma, bounds, tasks …)");
  }
  CurveCmaState s = state_;
  std::vector<bool> told;
  MatrixXd costs;
  fields(r, s, told, costs);
  r.finish();
  if (std::find(told.begin(), told.end(), false) == told.end()) {
    r.fail("its generation is over, and was not learned from");
  }

  state_ = std::move(s);
  costs_ = std::move(costs);
  told_ = std::move(told);
  told_count_ = static_cast<int>(std::count(told_.begin(), told_.end(), true));
  drawn_ = false;
}

std::unique_ptr<Optimizer> makeCurveCma(const Problem& problem, const CommonOptions& options) {
  Start start = startOf(problem, options.x0);
  CurveCmaOptions o;
  o.x0 = std::move(start.x0);
  o.tasks = problem.tasks();
  o.sigma = options.sigma;
  o.scale = std::move(start.scale);
  o.lower = problem.lower();
  o.upper = problem.upper();
  o.control_points = options.control_points;
  o.seed = options.seed;
  if (options.lambda != 0) o.lambda = options.lambda;
  return std::make_unique<CurveCma>(std::move(o));
}

}  // namespace traceur::optim
