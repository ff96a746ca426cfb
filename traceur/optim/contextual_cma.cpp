#include "traceur/optim/contextual_cma.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "traceur/core/hash.h"
#include "traceur/core/infinity.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/start.h"
#include "traceur/optim/state.h"
#include "traceur/optim/task_positions.h"

namespace traceur::optim {
namespace {

constexpr std::string_view kContextual = "contextual";
constexpr std::uint64_t kContextualStateVersion = 6;

/// Samples of a generation [ours; of 16, 24 and 32 on the functions of [Ha2015, Tab. 11] the last
/// is as fast on the unimodal ones and far surer on the others].
constexpr int kDefaultLambda = 32;
/// Tasks that a generation draws samples for, a share of λ: with few samples each, ranks
/// say little once the tasks have moved apart. Of more tasks, one of each stretch [ours].
constexpr double kTasksPerSample = 3.0 / 16;
/// Eigenvalues below this fraction of the largest are noise of rounding; they are raised to it.
constexpr double kSmallestEigenvalue = 1e-14;
/// σ·√(largest eigenvalue of C)/σ₀ beyond which the search runs away, as CmaEs.
constexpr double kTolXUp = 1e4;
/// The same below which a run may count as stagnating: it has settled somewhere [ours].
constexpr double kSettled = 0.1;
/// Costs are rough where half of the last stagnation_curves curves cost more than the best of them
/// by this fraction; on a smooth floor they come to agree to tolstagnation [ours].
constexpr double kRough = 0.1;
/// σ/σ₀ of a run about the best curve [ours, of one value tried].
constexpr double kSigmaAboutBest = 0.2;
/// Generations in a row without a meaningful cost, as CmaEs.
constexpr int kTolAllFailed = 20;

ContextualCmaOptions complete(ContextualCmaOptions o) {
  const auto n = o.x0.size();
  completeStart(kContextual, o.x0, o.sigma, o.scale, o.lower, o.upper);
  // Throws before control points are held against their number.
  taskPositions(kContextual, o.tasks);
  if (o.control_points < 1 || o.control_points > o.tasks.size()) {
    refuse(kContextual, "expected control points in [1, {}], the number of tasks, got {}",
           o.tasks.size(), o.control_points);
  }
  if (o.lambda == 0) o.lambda = kDefaultLambda;
  if (o.lambda < 4 || o.lambda > kMaxLambda) {
    refuse(kContextual, "expected lambda in [4, {}], or 0 for the default, got {}", kMaxLambda,
           o.lambda);
  }
  if (!(o.curve_share > 0 && o.curve_share < 1)) {
    refuse(kContextual, "expected curve_share in (0, 1), got {}", o.curve_share);
  }
  if (o.stagnation_curves == 0) o.stagnation_curves = 5 + static_cast<int>(n) / 4;
  if (o.stagnation_curves < 1) {
    refuse(kContextual, "expected stagnation_curves ≥ 1, or 0 for the default, got {}",
           o.stagnation_curves);
  }
  if (o.elite_generations < 0) {
    refuse(kContextual, "expected elite_generations ≥ 0, got {}", o.elite_generations);
  }
  if (!(o.tolstagnation >= 0)) {
    refuse(kContextual, "expected tolstagnation ≥ 0, got {}", o.tolstagnation);
  }
  if (!(o.tolx >= 0)) refuse(kContextual, "expected tolx ≥ 0, got {}", o.tolx);
  if (o.max_restarts < 0) refuse(kContextual, "expected max_restarts ≥ 0, got {}", o.max_restarts);
  if (!(o.lambda_factor >= 1)) {
    refuse(kContextual, "expected lambda_factor ≥ 1, got {}", o.lambda_factor);
  }
  return o;
}

}  // namespace

ContextualCma::ContextualCma(ContextualCmaOptions options)
    : options_(complete(std::move(options))),
      bounds_(options_.lower, options_.upper, options_.sigma * options_.scale),
      w_(taskPositions(kContextual, options_.tasks)),
      Phi_(options_.control_points, w_.size()),
      eigen_(static_cast<int>(options_.x0.size())) {
  for (Eigen::Index i = 0; i < w_.size(); ++i) {
    Phi_.col(i) = bernstein(options_.control_points, w_[i]);
  }
  state_.lambda = options_.lambda;
  beginRun();
}

void ContextualCma::beginRun() {
  const int n = dimension();
  const int K = options_.control_points;
  ContextualCmaState& s = state_;
  s.updates = s.samples = s.curves = 0;
  s.costs.clear();
  s.elites.clear();
  s.sigma = options_.sigma;
  s.C = MatrixXd::Identity(n, n);
  s.p_sigma = MatrixXd::Zero(n, K);
  s.p_c = MatrixXd::Zero(n, K);
  VectorXd start(n);
  Random random(options_.seed, UINT64_MAX, s.restarts);
  for (int i = 0; i < n; ++i) {
    const double l = options_.lower[i];
    const double u = options_.upper[i];
    double x = options_.x0[i];
    if (s.restarts > 0) {  // somewhere else
      x = std::isfinite(u - l)
              ? random.uniform(l, u)
              : std::clamp(x + s.sigma * options_.scale[i] * random.normal(), l, u);
    }
    start[i] = bounds_.unfold(i, x) / options_.scale[i];
  }
  s.A = start.replicate(1, K);
  told_.assign(candidates(state_), std::nullopt);
  told_count_ = 0;
  drawn_ = false;
}

bool ContextualCma::curveIsDue(const ContextualCmaState& s) const {
  return options_.curve_share * static_cast<double>(s.samples) >=
         static_cast<double>(s.curves + 1) * tasks();
}

/// λ of the run after so many restarts.
int ContextualCma::lambdaAfter(int restarts) const {
  int lambda = options_.lambda;
  for (int i = 0; i < restarts; ++i) {
    const int next =
        static_cast<int>(std::min<double>(lambda * options_.lambda_factor, kMaxLambda));
    if (next == lambda) break;
    lambda = next;
  }
  return lambda;
}

Curve ContextualCma::curve() const {
  return {Curve::Kind::kBezier, options_.scale.asDiagonal() * state_.A, bounds_};
}

void ContextualCma::draw() {
  const int n = dimension();
  const int M = tasks();
  eigen_.compute(state_.C);
  D_ = eigen_.values().cwiseMax(kSmallestEigenvalue * eigen_.values().maxCoeff()).cwiseSqrt();
  X_.resize(n, state_.lambda);
  // One task of each stretch of tasks, in an order of its own each generation, so that a λ that is
  // no multiple of their number favours none.
  const int few =
      std::clamp(static_cast<int>(kTasksPerSample * state_.lambda), options_.control_points, M);
  Random pick(options_.seed, state_.generation, UINT64_MAX);
  anchors_.resize(few);
  for (int a = 0; a < few; ++a) {
    const int first = a * M / few;
    anchors_[a] = first + static_cast<int>(pick.below((a + 1) * M / few - first));
  }
  std::vector<int> order = anchors_;
  for (int i = few - 1; i > 0; --i) std::swap(order[i], order[pick.below(i + 1)]);
  VectorXd z(n);
  for (int k = 0; k < state_.lambda; ++k) {
    Random random(options_.seed, state_.generation, k);
    for (int i = 0; i < n; ++i) z[i] = D_[i] * random.normal();
    X_.col(k) = state_.A * Phi_.col(order[k % few]) + state_.sigma * (eigen_.vectors() * z);
  }
  drawn_ = true;
}

std::vector<Candidate> ContextualCma::ask() {
  if (!drawn_) draw();
  std::vector<Candidate> asked;
  const Curve mean = curve();
  for (int k = 0; k < static_cast<int>(told_.size()); ++k) {
    if (told_[k]) continue;
    VectorXd x(dimension());
    if (k < state_.lambda) {
      for (int i = 0; i < x.size(); ++i) x[i] = bounds_.fold(i, options_.scale[i] * X_(i, k));
    } else {
      x = mean.at(w_[k - state_.lambda]);
    }
    asked.push_back({state_.trials + k, std::move(x)});
  }
  return asked;
}

void ContextualCma::tell(std::uint64_t id, const Evaluation& evaluation) {
  if (id < state_.trials || id - state_.trials >= told_.size()) {
    refuse(kContextual, "no candidate {} in this generation, which has {} to {}", id, state_.trials,
           state_.trials + told_.size() - 1);
  }
  auto& told = told_[id - state_.trials];
  if (told) refuse(kContextual, "candidate {} has been told already", id);
  told = costsOfTasks(kContextual, evaluation, tasks());
  if (++told_count_ == static_cast<int>(told_.size())) update();
}

void ContextualCma::update() {
  if (!drawn_) draw();  // restored, and told without being asked
  const int M = tasks();
  if (static_cast<int>(told_.size()) > state_.lambda) noteCurve();
  MatrixXd costs(M, state_.lambda);
  bool anything = false;
  for (int k = 0; k < state_.lambda; ++k) {
    costs.col(k) = Eigen::Map<const VectorXd>(told_[k]->data(), M);
    anything = anything || !costs.col(k).array().isNaN().all();
  }
  if (anything) {
    adapt(costs);
    keepElites(costs);
  }
  ++state_.generation;
  state_.trials += told_.size();
  state_.samples += state_.lambda;
  endRunIfDone(anything);
  told_.assign(candidates(state_), std::nullopt);
  told_count_ = 0;
  drawn_ = false;
}

void ContextualCma::noteCurve() {
  Family family{curve(), 0, {}};
  for (int i = 0; i < tasks(); ++i) {
    const double cost = (*told_[state_.lambda + i])[i];
    family.task_costs.push_back(cost);
    family.cost += cost / tasks();
  }
  ++state_.curves;
  state_.costs.push_back(std::isnan(family.cost) ? kInfinity : family.cost);
  if (family.cost < (best_ ? best_->cost : kInfinity)) best_ = std::move(family);
}

/// What an update learns from: for each of M tasks the samples of the generation, and behind them
/// the elites.
struct ContextualCma::Seen {
  MatrixXd X;         // (n x λ')
  MatrixXd costs;     // (M x λ')
  MatrixXd squared;   // (M x λ') ‖C^(-1/2)(x_k - m_i)/σ‖²
  MatrixXd r;         // (M x λ') importance
  MatrixXd W;         // (M x λ') positive weights, rows sum to 1
  MatrixXd negative;  // (M x λ'), rows sum to -1
  /// (M) how much a task has to say: nothing without samples near it, and no more than all others.
  VectorXd heard;
};

Eigen::RowVectorXd ContextualCma::squaredLengths(const MatrixXd& x, const VectorXd& mean) const {
  const MatrixXd y = D_.cwiseInverse().asDiagonal() *
                     (eigen_.vectors().transpose() * (x.colwise() - mean)) / state_.sigma;
  return y.colwise().squaredNorm();
}

ContextualCma::Seen ContextualCma::seen(const MatrixXd& all_costs, const MatrixXd& Phi) const {
  const ContextualCmaState& s = state_;
  const int n = dimension();
  const int M = static_cast<int>(anchors_.size());
  // The samples, and behind them each task's elite: once, however many tasks it is the best of.
  const double farthest = std::sqrt(n) + 2.0 * n / (n + 2);
  // Where the curve was mirrored, its image is the same sample on the curve's side.
  std::vector<ContextualCmaState::Elite> remembered = s.elites;
  const VectorXd middle = (s.A * Phi_.rowwise().mean()).cwiseProduct(options_.scale);
  for (ContextualCmaState::Elite& e : remembered) {
    for (int j = 0; j < n; ++j) {
      const double x = options_.scale[j] * e.x[j];
      const double near = bounds_.unfoldNear(j, bounds_.fold(j, x), middle[j]);
      if (near != x) e.x[j] = near / options_.scale[j];
    }
  }
  std::vector<const ContextualCmaState::Elite*> elites;
  std::vector<std::pair<int, int>> serves;  // an anchor and which elite
  for (int i = 0; i < M; ++i) {
    const ContextualCmaState::Elite* best = nullptr;
    for (const auto& e : remembered) {
      const double cost = e.costs[anchors_[i]];
      if (!std::isnan(cost) && (!best || cost < best->costs[anchors_[i]])) best = &e;
    }
    if (!best || squaredLengths(best->x, s.A * Phi.col(i))[0] > farthest * farthest) continue;
    const auto known = std::find(elites.begin(), elites.end(), best);
    serves.push_back({i, static_cast<int>(known - elites.begin())});
    if (known == elites.end()) elites.push_back(best);
  }
  const int lambda = s.lambda + static_cast<int>(elites.size());
  Seen seen;
  seen.X.resize(n, lambda);
  seen.costs.resize(M, lambda);
  seen.X.leftCols(s.lambda) = X_;
  seen.costs.leftCols(s.lambda) = all_costs(anchors_, Eigen::all);
  for (int k = s.lambda; k < lambda; ++k) {
    const ContextualCmaState::Elite& e = *elites[k - s.lambda];
    seen.X.col(k) = e.x;
    seen.costs.col(k) = Eigen::Map<const VectorXd>(e.costs.data(), tasks())(anchors_);
  }
  // Importance of each sample for each task, and its distance in units of the distribution.
  seen.squared.resize(M, lambda);
  for (int i = 0; i < M; ++i) seen.squared.row(i) = squaredLengths(seen.X, s.A * Phi.col(i));
  seen.r = MatrixXd::Zero(M, lambda);
  for (int k = 0; k < s.lambda; ++k) {
    const double nearest = seen.squared.col(k).minCoeff();
    seen.r.col(k) = (-(seen.squared.col(k).array() - nearest) / 2).exp();
    seen.r.col(k) /= seen.r.col(k).mean();
  }
  for (const auto& [i, e] : serves) seen.r(i, s.lambda + e) = 1;
  return seen;
}

/// Ranks a task's samples by cost and weighs them.
void ContextualCma::weigh(int i, Seen& seen) {
  // ∫ -ln 2u du over the better half and over the worse.
  const auto logarithmic = [](double u) { return u > 0 ? u - u * std::log(2 * u) : 0; };
  const auto best = [&](double u) { return logarithmic(std::min(u, 0.5)); };
  const auto worst = [&](double u) { return logarithmic(std::max(u, 0.5)); };
  const auto lambda = static_cast<int>(seen.X.cols());
  std::vector<int> order(lambda);
  std::iota(order.begin(), order.end(), 0);
  const auto meaningful = std::stable_partition(
      order.begin(), order.end(), [&](int k) { return !std::isnan(seen.costs(i, k)); });
  std::stable_sort(order.begin(), meaningful,
                   [&](int a, int b) { return seen.costs(i, a) < seen.costs(i, b); });
  double total = 0;
  for (auto k = order.begin(); k != meaningful; ++k) total += seen.r(i, *k);
  if (!(total > 0)) return;
  const double all = seen.r.row(i).sum();
  double before = 0;
  for (auto k = order.begin(); k != order.end(); ++k) {
    const double after = before + seen.r(i, *k);
    if (k < meaningful) {
      seen.W(i, *k) = std::max(0.0, best(after / total) - best(before / total));
    }
    seen.negative(i, *k) = std::min(0.0, worst(after / all) - worst(before / all));
    before = after;
  }
  const double sum = seen.W.row(i).sum();
  if (!(sum > 0)) {
    seen.W.row(i).setZero();
    seen.negative.row(i).setZero();
    return;
  }
  seen.heard[i] = std::min(1.0, total / (0.5 * lambda));
  seen.W.row(i) /= sum;
  const double below = -seen.negative.row(i).sum();
  if (below > 0) seen.negative.row(i) /= below;
}

void ContextualCma::adapt(const MatrixXd& all_costs) {
  ContextualCmaState& s = state_;
  const int n = dimension();
  const int M = static_cast<int>(anchors_.size());
  const int K = options_.control_points;
  const MatrixXd& B = eigen_.vectors();
  const MatrixXd Phi = Phi_(Eigen::all, anchors_);
  Seen seen = this->seen(all_costs, Phi);
  const auto lambda = seen.X.cols();
  seen.W = MatrixXd::Zero(M, lambda);
  seen.negative = MatrixXd::Zero(M, lambda);
  seen.heard = VectorXd::Zero(M);
  for (int i = 0; i < M; ++i) weigh(i, seen);
  if (!(seen.heard.sum() > 0)) return;
  seen.heard /= seen.heard.sum();
  const VectorXd& heard = seen.heard;

  // The curve's step. A trace of ridge keeps G regular when few tasks have anything to say.
  MatrixXd G = MatrixXd::Zero(K, K);
  MatrixXd moved = MatrixXd::Zero(n, K);  // Σ Δ_i φ_iᵀ
  for (int i = 0; i < M; ++i) {
    if (!(heard[i] > 0)) continue;
    const VectorXd m = s.A * Phi.col(i);
    moved += heard[i] * (seen.X * seen.W.row(i).transpose() - m) * Phi.col(i).transpose();
    G += heard[i] * Phi.col(i) * Phi.col(i).transpose();
  }
  G += 1e-8 * G.trace() * MatrixXd::Identity(K, K);
  const Eigen::LLT<MatrixXd> llt(G);
  const MatrixXd delta_A = llt.solve(moved.transpose()).transpose();
  const MatrixXd G_root = llt.matrixL();  // G = L Lᵀ: ΔA L has the norm of ΔA G^(1/2)
  const MatrixXd PhiW = Phi * heard.asDiagonal() * seen.W;  // (K x λ)
  const double mu_w = K / (llt.solve(PhiW * PhiW.transpose())).trace();
  const VectorXd pooled = seen.W.transpose() * heard;
  const double mu = 1 / pooled.squaredNorm();

  const double N = n * K;
  // The path forgets as fast as in n dimensions, though it has nK: a linear curve's other n follow
  // a few samples each, and waiting for them costs a fifth of the trials [ours; Table 11's
  // spheres].
  const double c_sigma = (mu_w + 2) / (n + mu_w + 3);
  const double d_sigma = 1 + 2 * std::max(0.0, std::sqrt((mu_w - 1) / (N + 1)) - 1) + c_sigma;
  const double chi = std::sqrt(N) * (1 - 1 / (4 * N) + 1 / (21 * N * N));
  const double c_c = (4 + mu / n) / (n + 4 + 2 * mu / n);
  const double c_1 = 2 / ((n + 1.3) * (n + 1.3) + mu);
  const double c_mu =
      std::min(1 - c_1, 2 * (0.25 + mu + 1 / mu - 2) / ((n + 2.0) * (n + 2.0) + mu));

  const MatrixXd step = delta_A * G_root / s.sigma;  // (n x K)
  const MatrixXd whitened = B * (D_.cwiseInverse().asDiagonal() * (B.transpose() * step));
  const MatrixXd old_A = s.A;
  s.A = unbroken(s.A + delta_A);
  ++s.updates;
  s.p_sigma = (1 - c_sigma) * s.p_sigma + std::sqrt(c_sigma * (2 - c_sigma) * mu_w) * whitened;
  const double length = s.p_sigma.norm();
  const double settled = std::sqrt(1 - std::pow(1 - c_sigma, 2 * static_cast<double>(s.updates)));
  const bool h_sigma = length / settled < (1.4 + 2 / (N + 1)) * chi;
  s.p_c *= 1 - c_c;
  if (h_sigma) s.p_c += std::sqrt(c_c * (2 - c_c) * mu_w) * step;

  learnCovariance(seen, old_A, Phi,
                  {.c_1 = c_1, .c_mu = c_mu, .mu = mu, .delta = h_sigma ? 0 : c_c * (2 - c_c)});
  s.sigma *= std::exp(std::min(1.0, c_sigma / d_sigma * (length / chi - 1)));

  narrow();
}

/// The covariance's path and its samples. Negative weights as in CMA-ES: their sum bounded, each
/// step scaled to the length of a sample.
void ContextualCma::learnCovariance(const Seen& seen, const MatrixXd& A, const MatrixXd& Phi,
                                    const Rates& rates) {
  ContextualCmaState& s = state_;
  const int n = dimension();
  const int K = options_.control_points;
  const auto& [c_1, c_mu, mu, delta] = rates;
  const double negative_norm = (seen.negative.transpose() * seen.heard).squaredNorm();
  const double mu_minus = negative_norm > 0 ? 1 / negative_norm : 0;
  const double alpha =
      std::min({1 + c_1 / c_mu, 1 + 2 * mu_minus / (mu + 2), (1 - c_1 - c_mu) / (n * c_mu)});
  MatrixXd learned = MatrixXd::Zero(n, n);
  double weight_sum = 0;
  for (int i = 0; i < seen.heard.size(); ++i) {
    if (!(seen.heard[i] > 0)) continue;
    const MatrixXd Y = (seen.X.colwise() - A * Phi.col(i)) / s.sigma;
    VectorXd w = seen.W.row(i).transpose();
    for (int k = 0; k < seen.X.cols(); ++k) {
      double low = alpha * seen.negative(i, k);
      if (std::isnan(seen.costs(i, k))) low *= kWeightOfFailure;
      weight_sum += seen.heard[i] * (w[k] + low);
      w[k] += low * n / std::max(seen.squared(i, k), 1e-300);
    }
    learned += Y * (seen.heard[i] * w).asDiagonal() * Y.transpose();
  }
  s.C = (1 + c_1 * delta - c_1 - c_mu * weight_sum) * s.C + c_1 / K * s.p_c * s.p_c.transpose() +
        c_mu * learned;
  s.C = (s.C + s.C.transpose()).eval() / 2;
}

/// Keeps the distribution from growing far beyond the box.
void ContextualCma::narrow() {
  ContextualCmaState& s = state_;
  const int n = dimension();
  for (int i = 0; i < n; ++i) {
    const double width = bounds_.width(i);
    if (!std::isfinite(width)) continue;
    const double widest = std::max(kWidestStep * width / options_.scale[i], options_.sigma);
    const double now = s.sigma * std::sqrt(s.C(i, i));
    if (!(now > widest)) continue;
    s.C.row(i) *= widest / now;
    s.C.col(i) *= widest / now;
    s.p_c.row(i) *= widest / now;
  }
}

void ContextualCma::keepElites(const MatrixXd& all_costs) {
  ContextualCmaState& s = state_;
  std::erase_if(s.elites, [&](const ContextualCmaState::Elite& e) {
    return e.generation + options_.elite_generations <= s.generation;
  });
  if (options_.elite_generations == 0) return;
  std::vector<int> kept;
  for (int i = 0; i < tasks(); ++i) {
    int best = -1;
    for (int k = 0; k < s.lambda; ++k) {
      if (std::isnan(all_costs(i, k))) continue;
      if (best < 0 || all_costs(i, k) < all_costs(i, best)) best = k;
    }
    if (best >= 0 && std::find(kept.begin(), kept.end(), best) == kept.end()) kept.push_back(best);
  }
  for (const int k : kept) {
    const auto costs = all_costs.col(k);
    s.elites.push_back({s.generation, X_.col(k), {costs.begin(), costs.end()}});
  }
}

MatrixXd ContextualCma::unbroken(MatrixXd A) const {
  for (int i = 0; i < dimension(); ++i) {
    const Eigen::RowVectorXd means = A.row(i) * Phi_;
    const double middle = means[means.size() / 2];
    // Between which mirrors the middle of the curve lies; the fold repeats itself twice a period.
    double low = bounds_.unfold(i, options_.lower[i]) / options_.scale[i];
    double high = bounds_.unfold(i, options_.upper[i]) / options_.scale[i];
    if (std::isfinite(low) && std::isfinite(high)) {
      const double cell = high - low;
      low += cell * std::floor((middle - low) / cell);
      high = low + cell;
    } else if (middle < low) {
      high = std::exchange(low, -kInfinity);
    } else if (middle > high) {
      low = std::exchange(high, kInfinity);
    }
    if (means.minCoeff() >= low && means.maxCoeff() <= high) continue;
    for (double& point : A.row(i)) {
      if (point < low) point = std::min(2 * low - point, high);
      if (point > high) point = std::max(2 * high - point, low);
    }
  }
  return A;
}

void ContextualCma::endRunIfDone(bool anything) {
  ContextualCmaState& s = state_;
  s.all_failed = anything ? 0 : s.all_failed + 1;
  std::optional<Stop> end;
  eigen_.compute(s.C);
  const double smallest = eigen_.values().minCoeff();
  const double largest = eigen_.values().maxCoeff();
  const double size = s.sigma * std::sqrt(std::max(0.0, largest)) / options_.sigma;
  if (s.all_failed >= kTolAllFailed) {
    end = Stop{"tolallfailed", static_cast<double>(s.all_failed), kTolAllFailed};
  } else if (!(smallest > kSmallestEigenvalue * largest)) {
    end = Stop{"conditioncov", smallest > 0 ? largest / smallest : kInfinity,
               1 / kSmallestEigenvalue};
  } else if (size < options_.tolx) {
    end = Stop{"tolx", size, options_.tolx};
  } else if (size > kTolXUp) {
    end = Stop{"tolxup", size, kTolXUp};
  } else if (const size_t half = options_.stagnation_curves;
             options_.tolstagnation > 0 && s.costs.size() > 2 * half && size < kSettled) {
    const double before = *std::min_element(s.costs.begin(), s.costs.end() - half);
    const double now = *std::min_element(s.costs.end() - half, s.costs.end());
    // Curves none of which is complete are no gain over each other.
    const double gain = now < before ? (before - now) / std::max(std::abs(before), 1e-300) : 0;
    if (gain < options_.tolstagnation) end = Stop{"tolstagnation", gain, options_.tolstagnation};
  }
  if (!end) return;
  // Where nothing was ever found, another beginning will not find it either.
  const bool hopeless = end->reason == "tolallfailed" && !best_;
  if (s.restarts >= options_.max_restarts || hopeless) {
    s.stop = end;
    return;
  }
  bool about_best = false;
  if (best_ && end->reason == "tolstagnation" && s.restarts % 2 == 0) {
    std::vector<double> last(s.costs.end() - options_.stagnation_curves, s.costs.end());
    std::sort(last.begin(), last.end());
    about_best = last[last.size() / 2] - last.front() > kRough * std::abs(last.front());
  }
  ++s.restarts;
  s.all_failed = 0;
  s.lambda = lambdaAfter(s.restarts);
  beginRun();
  if (about_best) {
    s.A = options_.scale.cwiseInverse().asDiagonal() * best_->curve.points;
    s.sigma = kSigmaAboutBest * options_.sigma;
  }
}

std::uint64_t ContextualCma::fingerprint() const {
  StateWriter w("options", kContextualStateVersion);
  const ContextualCmaOptions& o = options_;
  for (const VectorXd* v : {&o.tasks, &o.x0, &o.scale, &o.lower, &o.upper}) w.reals(numbers(*v));
  for (const double v : {o.sigma, o.curve_share, o.tolx, o.tolstagnation, o.lambda_factor})
    w.real(v);
  for (const int v :
       {o.control_points, o.lambda, o.max_restarts, o.stagnation_curves, o.elite_generations})
    w.integer(v);
  w.integer(o.seed);
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

/// Costs of the tasks, NaN where a trial says nothing.
template <class IO, class Costs>
void ContextualCma::costs(IO& io, Costs& of_tasks, bool may_be_none) const {
  io.reals(of_tasks);
  if constexpr (IO::kReads) {
    if (may_be_none && of_tasks.empty()) return;
    if (of_tasks.size() != static_cast<size_t>(tasks())) {
      io.fail(fmt::format("a trial has costs of {} tasks", of_tasks.size()));
    }
    for (const double cost : of_tasks) {
      io.require(!std::isinf(cost), "a trial has an infinite cost");
    }
  }
}

template <class IO, class State, class Best, class Told>
void ContextualCma::fields(IO& io, State& s, Best& best, Told& told) const {
  io.integer(s.generation, 0, kMostGenerations);
  io.integer(s.trials, 0, kMostTrials);
  io.integer(s.updates, 0, s.generation);
  io.integer(s.samples, 0, kMostTrials);
  io.integer(s.curves, 0, s.generation);
  io.integer(s.restarts, 0, options_.max_restarts);
  io.integer(s.lambda, lambdaAfter(s.restarts), lambdaAfter(s.restarts));
  io.integer(s.all_failed, 0, kMostInARow);
  io.positive(s.sigma);
  for (auto* m : {&s.A, &s.C, &s.p_sigma, &s.p_c}) io.finite(numbers(*m));
  io.require(s.C.diagonal().minCoeff() > 0, "its covariance is none");
  io.reals(s.costs);
  io.require(s.costs.size() == s.curves, "it has costs of another number of curves");
  for (const double cost : s.costs) io.require(!std::isnan(cost), "the cost of a curve is NaN");
  io.list(s.elites, [&](auto& elite) {
    io.integer(elite.generation, 0, s.generation);
    io.resize(elite.x, dimension());
    io.finite(numbers(elite.x));
    costs(io, elite.costs, false);
  });
  field(io, s.stop);
  io.optional(best, [&](auto& family) {
    if constexpr (IO::kReads) {
      family.curve = {Curve::Kind::kBezier, MatrixXd(dimension(), options_.control_points),
                      bounds_};
    }
    io.finite(numbers(family.curve.points));
    io.finite(family.cost);
    io.resize(family.task_costs, tasks());
    io.finite(family.task_costs);
  });
  io.list(told, [&](auto& trial) {
    auto of_tasks = trial.value_or(std::vector<double>());
    costs(io, of_tasks, true);
    if constexpr (IO::kReads) {
      if (!of_tasks.empty()) trial = std::move(of_tasks);
    }
  });
  io.require(told.size() == static_cast<size_t>(candidates(s)),
             fmt::format("it has {} candidates, expected {}", told.size(), candidates(s)));
}

std::string ContextualCma::save() const {
  StateWriter w(kContextual, kContextualStateVersion);
  w.integer(dimension());
  w.integer(tasks());
  w.integer(fingerprint());
  fields(w, state_, best_, told_);
  return w.finish();
}

void ContextualCma::restore(std::string_view text) {
  StateReader r(text, kContextual, kContextualStateVersion);
  const std::uint64_t n = r.integer();
  const std::uint64_t M = r.integer();
  if (n != static_cast<std::uint64_t>(dimension()) || M != static_cast<std::uint64_t>(tasks())) {
    refuse(kContextual, "cannot restore a state of n = {}, {} tasks; expected n = {}, {} tasks", n,
           M, dimension(), tasks());
  }
  if (r.integer() != fingerprint()) {
    refuse(kContextual,
           "cannot restore a state saved under other options (seed, x0, sigma, bounds, …)");
  }
  ContextualCmaState s = state_;
  std::optional<Family> best;
  std::vector<std::optional<std::vector<double>>> all_told;
  fields(r, s, best, all_told);
  r.finish();
  const auto count = static_cast<int>(std::count_if(
      all_told.begin(), all_told.end(), [](const auto& told) { return told.has_value(); }));
  if (count == static_cast<int>(all_told.size())) {
    r.fail("its generation is over, and was not learned from");
  }
  state_ = std::move(s);
  best_ = std::move(best);
  told_ = std::move(all_told);
  told_count_ = count;
  drawn_ = false;
}

std::unique_ptr<Optimizer> makeContextualCma(const Problem& problem, const CommonOptions& options) {
  Start start = startOf(problem, options.x0);
  return std::make_unique<ContextualCma>(
      ContextualCmaOptions{.tasks = problem.tasks(),
                           .x0 = std::move(start.x0),
                           .sigma = options.sigma,
                           .scale = std::move(start.scale),
                           .lower = problem.lower(),
                           .upper = problem.upper(),
                           .control_points = options.control_points,
                           .lambda = options.lambda,
                           .seed = options.seed});
}

}  // namespace traceur::optim
