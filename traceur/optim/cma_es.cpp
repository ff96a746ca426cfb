#include "traceur/optim/cma_es.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <climits>
#include <cmath>
#include <numeric>

#include "traceur/core/hash.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/start.h"
#include "traceur/optim/state.h"

namespace traceur::optim {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr std::string_view kCmaEs = "cma-es";
constexpr std::uint64_t kCmaEsStateVersion = 4;

/// Generations beyond which stagnation no longer looks further back [Hansen2016, App. B.3].
constexpr std::uint64_t kLongestStagnation = 20000;
/// Eigenvalues below this fraction of the largest are noise of rounding; they are raised to it.
constexpr double kEigenvalueFloor = kEpsilon;
/// Condition of C above which T takes it over: the first time as late as doubles allow, so that
/// ordinary searches never know of it, later with all digits left.
constexpr double kDense = 1e14;
constexpr double kDenseAgain = 1e6;
/// Stands where the class of a told trial would.
constexpr std::uint64_t kUntold = UINT64_MAX;
/// Beyond these a restored number is no search's.
constexpr double kTiny = 1e-150;
constexpr double kHuge = 1e150;

void checkTolerance(std::string_view name, double value) {
  if (!(value >= 0)) refuse(kCmaEs, "expected {} ≥ 0, got {}", name, value);
}

/// Checks what a caller gave and fills in what was left to its default.
CmaEsOptions complete(CmaEsOptions o) {
  const int n = static_cast<int>(o.x0.size());
  completeStart(kCmaEs, o.x0, o.sigma, o.scale, o.lower, o.upper);
  if (o.lambda == 1 || o.lambda < 0 || o.lambda > kMaxLambda) {
    refuse(kCmaEs, "expected lambda in [2, {}], or 0 for the default, got {}", kMaxLambda,
           o.lambda);
  }
  if (o.hold_feasible && !o.feasible_first) refuse(kCmaEs, "hold_feasible needs feasible_first");
  if (o.choices < 1) refuse(kCmaEs, "expected choices ≥ 1, got {}", o.choices);
  if (o.max_draws < 1) refuse(kCmaEs, "expected max_draws ≥ 1, got {}", o.max_draws);

  CmaTermination& t = o.termination;
  checkTolerance("tolx", t.tolx);
  checkTolerance("tolfun", t.tolfun);
  checkTolerance("tolfunhist", t.tolfunhist);
  checkTolerance("tolflatfitness", t.tolflatfitness);
  checkTolerance("tolxup", t.tolxup);
  checkTolerance("tolupsigma", t.tolupsigma);
  checkTolerance("conditioncov", t.conditioncov);
  checkTolerance("tolstagnation", t.tolstagnation);
  checkTolerance("maxiter", t.maxiter);
  checkTolerance("tolallfailed", t.tolallfailed);

  o.lambda = cmaConstants(n, o.lambda, o.active).lambda;
  const auto whole = [](double x) { return static_cast<int>(std::min<double>(x, INT_MAX)); };
  if (t.tolstagnation == 0) t.tolstagnation = whole(100 + 100 * std::pow(n, 1.5) / o.lambda);
  if (t.maxiter == 0) t.maxiter = whole(100 + 150 * (n + 3.0) * (n + 3.0) / std::sqrt(o.lambda));
  return o;
}

double rangeOf(double low, double high) {
  return low == high ? 0 : high - low;
}

/// The median of the values, the upper one of two. Reorders them.
template <typename T>
T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

CmaEs::CmaEs(CmaEsOptions options)
    : options_(complete(std::move(options))),
      constants_(cmaConstants(dimension(), options_.lambda, options_.active)),
      bounds_(options_.lower, options_.upper, options_.sigma * options_.scale),
      history_window_(10 + static_cast<int>(std::ceil(30.0 * dimension() / constants_.lambda))),
      told_(constants_.lambda),
      Z_(dimension(), constants_.lambda),
      Y_(dimension(), constants_.lambda),
      X_(dimension(), constants_.lambda),
      order_(constants_.lambda),
      y_mean_(dimension()),
      z_mean_(dimension()),
      step_(dimension()),
      coefficients_(constants_.lambda),
      stretched_(dimension()),
      narrowing_(dimension()),
      likeliest_(3 * dimension()),
      chosen_(3 * dimension()),
      eigen_(dimension()) {
  const int n = dimension();
  state_.mean.resize(n);
  for (int i = 0; i < n; ++i) state_.mean[i] = bounds_.unfold(i, options_.x0[i]);
  state_.sigma = options_.sigma;
  state_.C = MatrixXd::Identity(n, n);
  state_.B = MatrixXd::Identity(n, n);
  state_.D = VectorXd::Ones(n);
  state_.p_sigma = VectorXd::Zero(n);
  state_.p_c = VectorXd::Zero(n);
}

VectorXd CmaEs::mean() const {
  VectorXd x(dimension());
  for (int i = 0; i < x.size(); ++i) x[i] = bounds_.fold(i, state_.mean[i]);
  return x;
}

MatrixXd CmaEs::covariance() const {
  const VectorXd s = state_.sigma * options_.scale;
  MatrixXd C = state_.C.selfadjointView<Eigen::Lower>();
  if (state_.lengths.size() > 0) {
    const MatrixXd T = state_.axes * state_.lengths.asDiagonal();
    C = T * C * T.transpose();
  }
  return s.asDiagonal() * C * s.asDiagonal();
}

std::vector<Candidate> CmaEs::ask() {
  if (!drawn_) drawSamples();
  std::vector<Candidate> candidates;
  candidates.reserve(told_.size() - told_count_);
  const std::uint64_t first = state_.generation * told_.size();
  for (int k = 0; k < constants_.lambda; ++k) {
    if (!told_[k]) candidates.push_back({first + k, X_.col(k)});
  }
  return candidates;
}

void CmaEs::drawSamples() {
  const int n = dimension();
  refused_now_ = 0;
  for (int k = 0; k < constants_.lambda; ++k) {
    Random random(options_.seed, state_.generation, k);
    draw(k, random);
    const bool start = options_.try_start && state_.generation == 0 && k == 0;
    if (!options_.promise || options_.choices == 1 || start) continue;
    double least = options_.promise(k, X_.col(k));
    for (int choice = 1; choice < options_.choices; ++choice) {
      chosen_ << Z_.col(k), Y_.col(k), X_.col(k);
      draw(k, random);
      const double cost = options_.promise(k, X_.col(k));
      if (cost < least) {
        least = cost;
        continue;
      }
      Z_.col(k) = chosen_.head(n);
      Y_.col(k) = chosen_.segment(n, n);
      X_.col(k) = chosen_.tail(n);
    }
  }
  drawn_ = true;
}

/// Candidate k: a draw that is accepted, or the best of max_draws that are not.
void CmaEs::draw(int k, Random& random) {
  const int n = dimension();
  auto z = Z_.col(k);
  auto y = Y_.col(k);
  auto x = X_.col(k);
  double best = -1;
  for (int draw = 1;; ++draw) {
    const bool start = options_.try_start && state_.generation == 0 && k == 0;
    for (int i = 0; i < n; ++i) z[i] = start ? 0 : random.normal();
    step_ = state_.D.cwiseProduct(z);
    y.noalias() = state_.B * step_;
    const auto step = stretched(y);
    for (int i = 0; i < n; ++i) {
      x[i] = bounds_.fold(i, state_.mean[i] + state_.sigma * options_.scale[i] * step[i]);
    }
    if (!options_.acceptance || start) return;
    const double p = options_.acceptance(k, x);
    if (p >= 1 || random.uniform() < p) return;
    ++refused_now_;
    if (p > best) {
      best = p;
      likeliest_ << z, y, x;
    }
    if (draw < options_.max_draws) continue;
    if (options_.likeliest) {
      z = likeliest_.head(n);
      y = likeliest_.segment(n, n);
      x = likeliest_.tail(n);
    }
    return;
  }
}

void CmaEs::tell(std::uint64_t id, const Evaluation& evaluation) {
  const std::uint64_t first = state_.generation * told_.size();
  if (id < first || id - first >= told_.size()) {
    refuse(kCmaEs, "no candidate {} in generation {}, which has {} to {}", id, state_.generation,
           first, first + told_.size() - 1);
  }
  std::optional<Told>& told = told_[id - first];
  if (told) refuse(kCmaEs, "candidate {} has been told already", id);
  if (!evaluation.meaningful()) {
    told = Told{2, 0};
  } else {
    told = Told{evaluation.feasible() || !options_.feasible_first ? 0 : 1, evaluation.cost};
  }
  if (++told_count_ == constants_.lambda) update();
}

void CmaEs::update() {
  if (!drawn_) drawSamples();  // restored, and told without being asked
  state_.refused += refused_now_;
  if (options_.hold_feasible) takeHeld();
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    return *told_[a] == *told_[b] ? a < b : *told_[a] < *told_[b];
  });
  int meaningful = constants_.lambda;
  while (meaningful > 0 && told_[order_[meaningful - 1]]->rank_class == 2) --meaningful;

  if (meaningful > 0) adapt(meaningful);
  if (options_.hold_feasible) hold();
  ++state_.generation;
  remember(meaningful);
  state_.stop = findStop(meaningful);
  std::fill(told_.begin(), told_.end(), std::nullopt);
  told_count_ = 0;
  drawn_ = false;
}

void CmaEs::takeHeld() {
  CmaState& s = state_;
  if (s.held.size() == 0) return;
  int worst = 0;
  bool meaningful = false;
  for (int k = 0; k < constants_.lambda; ++k) {
    if (told_[k]->rank_class == 0) return;
    meaningful = meaningful || told_[k]->rank_class == 1;
    if (*told_[worst] < *told_[k]) worst = k;
  }
  if (!meaningful) return;  // a generation that says nothing moves nothing
  const int n = dimension();
  for (int i = 0; i < n; ++i) {
    const double y = bounds_.unfoldNear(i, s.held[i], s.mean[i]);
    step_[i] = (y - s.mean[i]) / (s.sigma * options_.scale[i]);
  }
  auto z = Z_.col(worst);
  if (s.lengths.size() > 0) step_ = (s.axes.transpose() * step_).cwiseQuotient(s.lengths).eval();
  z.noalias() = s.B.transpose() * step_;
  z = z.cwiseQuotient(s.D);
  const double longest = std::sqrt(n) + 2.0 * n / (n + 2);
  const double length = z.norm();
  if (length > longest) z *= longest / length;
  step_ = s.D.cwiseProduct(z);
  Y_.col(worst).noalias() = s.B * step_;
  X_.col(worst) = s.held;
  told_[worst] = Told{0, s.held_cost};
}

void CmaEs::hold() {
  const int best = order_[0];
  if (told_[best]->rank_class != 0) return;
  if (state_.held.size() > 0 && !(told_[best]->cost < state_.held_cost)) return;
  state_.held = X_.col(best);
  state_.held_cost = told_[best]->cost;
}

void CmaEs::adapt(int meaningful) {
  const CmaConstants& c = constants_;
  const int n = dimension();
  CmaState& s = state_;

  // The better half of the meaningful shares the positive weights; of these, if options_ say so,
  // the feasible.
  int mu = std::max(1, std::min(c.mu, meaningful / 2));
  if (options_.hold_feasible) {
    int feasible = 0;
    while (feasible < mu && told_[order_[feasible]]->rank_class == 0) ++feasible;
    if (feasible > 0) mu = feasible;
  }
  const auto positive = c.weights.head(mu);
  const double sum = positive.sum();
  const double mu_eff = sum * sum / positive.squaredNorm();
  y_mean_.setZero();
  z_mean_.setZero();
  for (int i = 0; i < mu; ++i) {
    y_mean_ += positive[i] / sum * Y_.col(order_[i]);
    z_mean_ += positive[i] / sum * Z_.col(order_[i]);
  }
  s.mean += s.sigma * options_.scale.cwiseProduct(stretched(y_mean_));
  ++s.updates;

  step_.noalias() = s.B * z_mean_;
  s.p_sigma = (1 - c.c_sigma) * s.p_sigma + std::sqrt(c.c_sigma * (2 - c.c_sigma) * mu_eff) * step_;
  const double length = s.p_sigma.norm();
  const double settled = std::sqrt(1 - std::pow(1 - c.c_sigma, 2 * static_cast<double>(s.updates)));
  const bool h_sigma = length / settled < (1.4 + 2.0 / (n + 1)) * c.chi_n;
  s.p_c *= 1 - c.c_c;
  if (h_sigma) s.p_c += std::sqrt(c.c_c * (2 - c.c_c) * mu_eff) * y_mean_;

  // C ← decay C + c_1 p_c p_cᵀ + Σ coefficient_k y_k y_kᵀ, lower triangle.
  double weight_sum = 0;
  coefficients_.setZero();
  for (int i = 0; i < c.lambda; ++i) {
    double w = i < mu ? positive[i] / sum : i < c.mu ? 0 : c.weights[i];
    if (i >= meaningful) w *= kWeightOfFailure;
    weight_sum += w;
    const int k = order_[i];
    if (w < 0) w *= n / std::max(Z_.col(k).squaredNorm(), kEpsilon);
    coefficients_[k] = c.c_mu * w;
  }
  const double delta = h_sigma ? 0 : c.c_c * (2 - c.c_c);
  const double decay = 1 + c.c_1 * delta - c.c_1 - c.c_mu * weight_sum;
  for (int j = 0; j < n; ++j) {
    auto column = s.C.col(j).tail(n - j);
    column = decay * column + c.c_1 * s.p_c[j] * s.p_c.tail(n - j);
    for (int k = 0; k < c.lambda; ++k) {
      column += coefficients_[k] * Y_(j, k) * Y_.col(k).tail(n - j);
    }
  }

  double exponent = std::min(1.0, c.c_sigma / c.d_sigma * (length / c.chi_n - 1));
  const int most = static_cast<int>(std::ceil(0.7 * c.lambda)) - 1;
  if (*told_[order_[0]] == *told_[order_[most]]) exponent += 0.2 + c.c_sigma / c.d_sigma;
  s.sigma *= std::exp(exponent);

  const bool narrowed = limitToBox();
  if (!narrowed && static_cast<double>(s.generation + 1 - s.decomposed) < c.eigen_gap) return;
  decompose();
  const bool moved = s.lengths.size() > 0;
  const bool dense = s.condition > (moved ? kDenseAgain : kDense);
  const bool may = options_.termination.conditioncov > kDense;
  if ((dense && may) || (moved && narrowed)) moveBasis();
}

Eigen::Ref<const VectorXd> CmaEs::stretched(const Eigen::Ref<const VectorXd>& y) {
  if (state_.lengths.size() == 0) return y;
  stretched_.noalias() = state_.axes * state_.lengths.cwiseProduct(y);
  return stretched_;
}

/// √(T C Tᵀ)_ii
double CmaEs::deviation(int i) const {
  const CmaState& s = state_;
  if (s.lengths.size() == 0) return std::sqrt(s.C(i, i));
  const VectorXd t = s.lengths.cwiseProduct(s.axes.row(i).transpose());
  return std::sqrt(t.dot(s.C.selfadjointView<Eigen::Lower>() * t));
}

double CmaEs::longestAxis() const {
  const CmaState& s = state_;
  if (s.lengths.size() == 0) return s.D.maxCoeff();
  const MatrixXd T = s.lengths.asDiagonal() * s.B * s.D.asDiagonal();  // U turns it only
  return Eigen::JacobiSVD<MatrixXd>(T).singularValues()[0];
}

bool CmaEs::limitToBox() {
  const int n = dimension();
  bool narrowed = false;
  narrowing_.setOnes();
  for (int i = 0; i < n; ++i) {
    const double width = bounds_.width(i);
    if (!std::isfinite(width)) continue;
    const double widest = std::max(kWidestStep * width, options_.sigma * options_.scale[i]);
    const double now = state_.sigma * options_.scale[i] * deviation(i);
    if (!(now > widest)) continue;
    const double factor = widest / now;
    narrowed = true;
    if (state_.lengths.size() > 0) {  // moveBasis() does it
      narrowing_[i] = factor;
      continue;
    }
    state_.C.row(i).head(i + 1) *= factor;
    state_.C.col(i).tail(n - i) *= factor;  // C_ii has now been scaled twice, as it should
    state_.p_c[i] *= factor;
  }
  return narrowed;
}

void CmaEs::decompose() {
  CmaState& s = state_;
  eigen_.compute(s.C);
  const VectorXd& eigenvalues = eigen_.values();
  const double smallest = eigenvalues.minCoeff();
  const double largest = eigenvalues.maxCoeff();
  s.B = eigen_.vectors();
  s.condition = smallest > 0 ? largest / smallest : kInfinity;
  if (smallest >= kEigenvalueFloor * largest && smallest > 0) {
    s.D = eigenvalues.cwiseSqrt();
  } else {
    const double least = std::max(kEigenvalueFloor * largest, kTiny);
    s.D = eigenvalues.cwiseMax(least).cwiseSqrt();
    s.C.triangularView<Eigen::Lower>() = s.B * s.D.cwiseAbs2().asDiagonal() * s.B.transpose();
  }
  s.decomposed = s.generation + 1;
}

/// T takes over what C has learned since, and the box's narrowing_; C begins again at the identity.
void CmaEs::moveBasis() {
  CmaState& s = state_;
  MatrixXd T = s.B * s.D.asDiagonal();
  if (s.lengths.size() > 0) T = s.axes * (s.lengths.asDiagonal() * T).eval();
  T = narrowing_.asDiagonal() * T;
  if (!T.allFinite()) return;  // the search has run off the numbers; findStop() will say so
  const Eigen::JacobiSVD<MatrixXd> svd(T, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();  // falling
  const MatrixXd& V = svd.matrixV();
  s.p_sigma = V.transpose() * (s.B.transpose() * s.p_sigma).eval();
  s.p_c = V.transpose() * (s.B.transpose() * s.p_c).cwiseQuotient(s.D).eval();
  s.axes = svd.matrixU();
  s.lengths = values.cwiseMax(std::max(kTiny * values[0], std::numeric_limits<double>::min()));
  s.C.setIdentity();
  s.B.setIdentity();
  s.D.setOnes();
  s.condition = 1;
}

void CmaEs::remember(int meaningful) {
  if (meaningful == 0) {
    ++state_.all_failed;
    return;
  }
  const Told& best = *told_[order_[0]];
  state_.all_failed = 0;
  state_.flat = best == *told_[order_[meaningful - 1]] ? state_.flat + 1 : 0;
  history_.best.push_back(best);
  history_.median.push_back(*told_[order_[meaningful / 2]]);
  ++history_.count;
  const size_t needed = historyNeeded(history_.count);
  if (history_.best.size() > 2 * needed) {
    const auto excess = static_cast<std::ptrdiff_t>(history_.best.size() - needed);
    history_.best.erase(history_.best.begin(), history_.best.begin() + excess);
    history_.median.erase(history_.median.begin(), history_.median.begin() + excess);
  }
}

size_t CmaEs::stagnationWindow(std::uint64_t count) const {
  return std::max<size_t>(options_.termination.tolstagnation,
                          std::min(count / 5, kLongestStagnation));
}

size_t CmaEs::historyNeeded(std::uint64_t count) const {
  const bool stagnation = options_.termination.tolstagnation < INT_MAX;
  return std::max<size_t>(history_window_, stagnation ? stagnationWindow(count) : 0);
}

std::optional<Stop> CmaEs::findStop(int meaningful) const {
  const CmaTermination& t = options_.termination;
  const CmaState& s = state_;
  const int n = dimension();

  if (s.all_failed >= t.tolallfailed) {
    return Stop{"tolallfailed", static_cast<double>(s.all_failed),
                static_cast<double>(t.tolallfailed)};
  }
  double condition = s.condition;
  if (s.lengths.size() > 0) {
    const double ratio = s.lengths.maxCoeff() / s.lengths.minCoeff();
    condition = ratio * ratio;
  }
  if (condition > t.conditioncov) return Stop{"conditioncov", condition, t.conditioncov};

  const double growth = s.sigma / options_.sigma;
  const double largest = longestAxis();
  if (growth * largest > t.tolxup) return Stop{"tolxup", growth * largest, t.tolxup};
  if (growth > t.tolupsigma * largest) return Stop{"tolupsigma", growth / largest, t.tolupsigma};

  VectorXd path = s.p_c;
  if (s.lengths.size() > 0) path = s.axes * s.lengths.cwiseProduct(path).eval();
  double widest = 0;
  for (int i = 0; i < n; ++i) widest = std::max({widest, deviation(i), std::abs(path[i])});
  if (growth * widest < t.tolx) return Stop{"tolx", growth * widest, t.tolx};

  if (t.noeffectcoord) {
    for (int i = 0; i < n; ++i) {
      const double step = 0.2 * s.sigma * options_.scale[i] * deviation(i);
      if (s.mean[i] + step == s.mean[i]) {
        return Stop{"noeffectcoord", step, kEpsilon * std::abs(s.mean[i])};
      }
    }
  }
  if (t.noeffectaxis) {
    const int axis = static_cast<int>(s.generation % n);
    const double step = 0.1 * s.sigma * s.D[axis];
    VectorXd along = s.B.col(axis);
    if (s.lengths.size() > 0) along = s.axes * s.lengths.cwiseProduct(along).eval();
    bool effect = false;
    for (int i = 0; i < n && !effect; ++i) {
      effect = s.mean[i] + step * options_.scale[i] * along[i] != s.mean[i];
    }
    if (!effect) return Stop{"noeffectaxis", step, kEpsilon * s.mean.cwiseAbs().maxCoeff()};
  }

  if (s.flat > t.tolflatfitness) {
    return Stop{"tolflatfitness", static_cast<double>(s.flat),
                static_cast<double>(t.tolflatfitness)};
  }
  if (std::optional<Stop> stop = findHistoryStop(meaningful)) return stop;
  if (s.generation >= static_cast<std::uint64_t>(t.maxiter)) {
    return Stop{"maxiter", static_cast<double>(s.generation), static_cast<double>(t.maxiter)};
  }
  return std::nullopt;
}

std::optional<Stop> CmaEs::findHistoryStop(int meaningful) const {
  const CmaTermination& t = options_.termination;
  if (history_.count >= static_cast<std::uint64_t>(history_window_)) {
    const auto [low, high] =
        std::minmax_element(history_.best.end() - history_window_, history_.best.end());
    if (low->rank_class == high->rank_class) {
      const double range = rangeOf(low->cost, high->cost);
      if (t.equalfunvals && range == 0) return Stop{"equalfunvals", 0, 0};
      if (meaningful > 0) {
        const Told& worst = std::max(*high, *told_[order_[meaningful - 1]]);
        const double all = rangeOf(low->cost, worst.cost);
        if (worst.rank_class == low->rank_class && all < t.tolfun) {
          return Stop{"tolfun", all, t.tolfun};
        }
      }
      if (range < t.tolfunhist) return Stop{"tolfunhist", range, t.tolfunhist};
    }
  }

  if (t.tolstagnation == INT_MAX) return std::nullopt;
  const std::uint64_t every = (t.tolstagnation + 19) / 20;
  const size_t window = stagnationWindow(history_.count);
  if (history_.count < window || history_.count % every != 0) return std::nullopt;
  const auto part =
      std::max<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(0.3 * static_cast<double>(window)));
  const auto ends = [&](const std::vector<Told>& all) {
    const auto begin = all.end() - static_cast<std::ptrdiff_t>(window);
    std::vector<Told> first(begin, begin + part);
    std::vector<Told> last(all.end() - part, all.end());
    return std::pair(median(first), median(last));
  };
  const auto [first_best, last_best] = ends(history_.best);
  const auto [first_median, last_median] = ends(history_.median);
  if (last_best < first_best || last_median < first_median) return std::nullopt;
  return Stop{"tolstagnation", last_best.cost, first_best.cost};
}

std::uint64_t CmaEs::fingerprint() const {
  StateWriter w("options", kCmaEsStateVersion);
  const CmaEsOptions& o = options_;
  const CmaTermination& t = o.termination;
  for (const VectorXd* v : {&o.x0, &o.scale, &o.lower, &o.upper}) w.reals(numbers(*v));
  for (const double v :
       {o.sigma, t.tolx, t.tolfun, t.tolfunhist, t.tolxup, t.tolupsigma, t.conditioncov}) {
    w.real(v);
  }
  for (const int v : {o.lambda, int{o.active}, t.tolflatfitness, int{t.equalfunvals},
                      int{t.noeffectaxis}, int{t.noeffectcoord}, t.tolstagnation, t.maxiter,
                      t.tolallfailed, o.acceptance ? o.max_draws : 0, int{o.likeliest},
                      int{o.feasible_first}, int{o.hold_feasible}, int{o.try_start}}) {
    w.integer(v);
  }
  w.integer(o.seed);
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

/// A trial, told or not.
template <class IO>
void CmaEs::toldField(IO& io, std::optional<Told>& told) {
  std::uint64_t rank_class = told ? told->rank_class : kUntold;
  double cost = told ? told->cost : 0;
  io.integer(rank_class, 0, kUntold);
  io.finite(cost);
  io.require(rank_class <= 2 || rank_class == kUntold,
             fmt::format("no trial ranks in class {}", rank_class));
  told.reset();
  if (rank_class != kUntold) told = Told{static_cast<int>(rank_class), cost};
}

template <class IO, class State, class Trials, class Generations>
void CmaEs::fields(IO& io, State& s, Trials& trials, Generations& history) const {
  const int n = dimension();
  io.integer(s.generation, 0, kMostGenerations);
  io.integer(s.updates, 0, s.generation);
  io.real(s.sigma, std::numeric_limits<double>::denorm_min(), kHuge);
  for (auto* v : {&s.mean, &s.D, &s.p_sigma, &s.p_c}) io.finite(numbers(*v));
  io.finite(numbers(s.C));
  io.finite(numbers(s.B));
  bool moved = s.lengths.size() > 0;
  io.boolean(moved);
  io.resize(s.axes, moved ? n : 0, moved ? n : 0);
  io.resize(s.lengths, moved ? n : 0);
  if (moved) {
    io.finite(numbers(s.axes));
    io.positive(numbers(s.lengths));
  }
  io.require(s.D.minCoeff() >= kTiny && s.D.maxCoeff() <= kHuge && s.C.diagonal().minCoeff() > 0 &&
                 s.C.cwiseAbs().maxCoeff() <= kHuge && s.B.cwiseAbs().maxCoeff() <= 2,
             "its covariance is none");
  io.real(s.condition, 1, kInfinity);
  io.integer(s.decomposed, 0, s.generation);
  io.integer(s.flat, 0, kMostInARow);
  io.integer(s.all_failed, 0, kMostInARow);
  io.integer(s.refused, 0, kMostTrials);
  bool held = s.held.size() > 0;
  io.boolean(held);
  io.resize(s.held, held ? n : 0);
  if (held) {
    io.finite(numbers(s.held));
    io.require((s.held.array() >= options_.lower.array()).all() &&
                   (s.held.array() <= options_.upper.array()).all(),
               "the trial it holds lies outside the bounds");
  }
  io.finite(s.held_cost);
  field(io, s.stop);

  for (auto& trial : trials) {
    std::optional<Told> told = trial;
    toldField(io, told);
    if constexpr (IO::kReads) trial = told;
  }
  io.integer(history.count, 0, s.generation);
  const std::uint64_t needed = historyNeeded(history.count);
  std::uint64_t kept = std::min<std::uint64_t>(history.best.size(), needed);
  io.integer(kept, 0, kMostGenerations);
  io.require(kept == std::min(history.count, needed),
             fmt::format("it keeps {} of {} generations", kept, history.count));
  for (std::uint64_t left = kept; left > 0; --left) {
    for (auto* costs : {&history.best, &history.median}) {
      std::optional<Told> told;
      if constexpr (!IO::kReads) told = *(costs->end() - left);
      toldField(io, told);
      io.require(told.has_value(), "a generation of its history has no cost");
      if constexpr (IO::kReads) costs->push_back(*told);
    }
  }
}

std::string CmaEs::save() const {
  StateWriter w(kCmaEs, kCmaEsStateVersion);
  w.integer(dimension());
  w.integer(constants_.lambda);
  w.integer(fingerprint());
  fields(w, state_, told_, history_);
  return w.finish();
}

void CmaEs::restore(std::string_view text) {
  StateReader r(text, kCmaEs, kCmaEsStateVersion);
  const int n = dimension();
  const std::uint64_t stored_n = r.integer();
  const std::uint64_t stored_lambda = r.integer();
  if (stored_n != static_cast<std::uint64_t>(n) || stored_lambda != told_.size()) {
    refuse(kCmaEs, "cannot restore a state of n = {}, lambda = {}; expected n = {}, lambda = {}",
           stored_n, stored_lambda, n, told_.size());
  }
  if (r.integer() != fingerprint()) {
    refuse(kCmaEs,
           "cannot restore a state saved under other options (seed, x0, sigma, bounds, stops …)");
  }

  CmaState s = state_;
  std::vector<std::optional<Told>> all_told(told_.size());
  History history;
  fields(r, s, all_told, history);
  r.finish();
  const auto count = static_cast<int>(std::count_if(
      all_told.begin(), all_told.end(), [](const auto& told) { return told.has_value(); }));
  if (count == constants_.lambda) r.fail("its generation is over, and was not learned from");

  state_ = std::move(s);
  history_ = std::move(history);
  told_ = std::move(all_told);
  told_count_ = count;
  drawn_ = false;
}

}  // namespace traceur::optim
