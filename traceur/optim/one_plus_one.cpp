#include "traceur/optim/one_plus_one.h"

#include <algorithm>
#include <cmath>

#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/start.h"
#include "traceur/optim/state.h"

namespace traceur::optim {
namespace {

constexpr std::string_view kOnePlusOne = "one-plus-one";
constexpr std::uint64_t kOnePlusOneStateVersion = 1;
/// A trial worse than the parent so many successes ago is worth unlearning [Arnold2010].
constexpr size_t kAncestors = 5;

OnePlusOneOptions complete(OnePlusOneOptions o) {
  const auto n = static_cast<int>(o.x0.size());
  completeStart(kOnePlusOne, o.x0, o.sigma, o.scale, o.lower, o.upper);
  if (!(o.tolx >= 0)) refuse(kOnePlusOne, "expected tolx ≥ 0, got {}", o.tolx);
  if (!(o.tolxup >= 0)) refuse(kOnePlusOne, "expected tolxup ≥ 0, got {}", o.tolxup);
  if (o.constraints < 0) refuse(kOnePlusOne, "expected constraints ≥ 0, got {}", o.constraints);
  if (o.tolallfailed < 0) refuse(kOnePlusOne, "expected tolallfailed ≥ 0, got {}", o.tolallfailed);
  if (o.restarts < 0) refuse(kOnePlusOne, "expected restarts ≥ 0, got {}", o.restarts);
  if (o.tolallfailed == 0) o.tolallfailed = 20 * cmaConstants(n).lambda;
  return o;
}

}  // namespace

OnePlusOne::OnePlusOne(OnePlusOneOptions options)
    : options_(complete(std::move(options))),
      constants_(successConstants(dimension())),
      bounds_(options_.lower, options_.upper, options_.sigma * options_.scale),
      z_(dimension()),
      step_(dimension()),
      x_(dimension()) {
  begin(0);
}

void OnePlusOne::begin(std::uint64_t descent) {
  const int n = dimension();
  const std::uint64_t trial = state_.trial;
  state_ = {};
  state_.trial = trial;
  state_.descent = descent;
  state_.parent.resize(n);
  Random random(options_.seed, kDescentStream, descent);
  for (int i = 0; i < n; ++i) {
    double x = options_.x0[i];
    if (descent > 0) x += options_.sigma * options_.scale[i] * random.normal();
    state_.parent[i] = bounds_.unfold(i, std::clamp(x, options_.lower[i], options_.upper[i]));
  }
  state_.sigma = options_.sigma;
  state_.p_success = constants_.p_target;
  state_.shape = SuccessCovariance(n);
  state_.fading = MatrixXd::Zero(n, options_.constraints + 1);
}

std::vector<Candidate> OnePlusOne::ask() {
  draw();
  return {{state_.trial, x_}};
}

void OnePlusOne::draw() {
  if (drawn_) return;
  Random random(options_.seed, 0, state_.trial);
  for (double& z : z_) z = state_.has_parent ? random.normal() : 0;
  step_ = state_.shape.L.triangularView<Eigen::Lower>() * z_;
  for (int i = 0; i < dimension(); ++i) {
    x_[i] = bounds_.fold(i, state_.parent[i] + state_.sigma * options_.scale[i] * step_[i]);
  }
  drawn_ = true;
}

void OnePlusOne::tell(std::uint64_t id, const Evaluation& evaluation) {
  if (id != state_.trial) refuse(kOnePlusOne, "no candidate {}, only {}", id, state_.trial);
  const size_t reported = evaluation.violated.size();
  if (reported != 0 && reported != static_cast<size_t>(options_.constraints)) {
    refuse(kOnePlusOne, "expected a trial to report on {} constraints, got {}",
           options_.constraints, reported);
  }
  draw();  // restored, and told without being asked
  OnePlusOneState& s = state_;
  const bool meaningful = evaluation.meaningful();
  const double cost = meaningful ? evaluation.cost : 0;
  int violations = 0;
  if (!meaningful) {
    violations = options_.constraints + 1;
  } else if (options_.feasible_first) {
    violations =
        static_cast<int>(std::count(evaluation.violated.begin(), evaluation.violated.end(), true));
  }
  s.all_failed = meaningful ? 0 : s.all_failed + 1;

  if (!s.has_parent) {
    s.has_parent = true;
    s.violations = violations;
    s.cost = cost;
  } else if (violations > 0 && s.violations == 0) {
    learnFailure(evaluation);
  } else if (meaningful) {
    const bool success = violations != s.violations ? violations < s.violations : !(cost > s.cost);
    s.p_success = updateSuccessRate(constants_, s.p_success, success);
    if (success) {
      learnSuccess(violations, cost);
    } else if (violations == s.violations && s.ancestors.size() == kAncestors &&
               cost > s.ancestors.front()) {
      learnWorse();
    }
    s.sigma *= stepFactor(constants_, s.p_success);
    limitToBox();
  }
  ++s.trial;
  drawn_ = false;
  s.stop = findStop();
  const bool failed = s.stop && s.stop->reason == "tolallfailed";
  if (s.stop && !failed && s.descent < static_cast<std::uint64_t>(options_.restarts)) {
    begin(s.descent + 1);
  }
}

void OnePlusOne::learnSuccess(int violations, double cost) {
  OnePlusOneState& s = state_;
  s.ancestors.push_back(s.cost);
  if (violations != s.violations) s.ancestors.clear();  // costs of another kind
  if (s.ancestors.size() > kAncestors) s.ancestors.erase(s.ancestors.begin());
  s.parent += s.sigma * options_.scale.cwiseProduct(step_);
  s.violations = violations;
  s.cost = cost;
  s.shape.learn(constants_, step_, s.p_success);
}

void OnePlusOne::learnWorse() {
  if (!options_.active) return;
  const double length = z_.squaredNorm();
  double rate = 0.4 / (std::pow(dimension(), 1.6) + 1);
  if (2 * length - 1 > 0) rate = std::min(rate, 1 / (2 * length - 1));
  state_.shape.L *= std::sqrt(1 + rate);
  updateCholesky(state_.shape.L, step_, -rate);
}

void OnePlusOne::learnFailure(const Evaluation& evaluation) {
  if (!options_.active_constraints) return;
  OnePlusOneState& s = state_;
  const int n = dimension();
  std::vector<int> which;
  if (!evaluation.meaningful()) {
    which.push_back(options_.constraints);
  } else {
    for (int j = 0; j < options_.constraints; ++j) {
      if (evaluation.violated[j]) which.push_back(j);
    }
  }
  const double c = 1.0 / (n + 2);
  const double beta = 0.1 / (n + 2) / static_cast<double>(which.size());
  for (const int j : which) s.fading.col(j) = (1 - c) * s.fading.col(j) + c * step_;
  for (const int j : which) {
    const VectorXd w = s.shape.L.triangularView<Eigen::Lower>().solve(s.fading.col(j));
    const double length = w.squaredNorm();
    if (length > 0) updateCholesky(s.shape.L, s.fading.col(j), -(2 * beta - beta * beta) / length);
  }
}

void OnePlusOne::limitToBox() {
  OnePlusOneState& s = state_;
  for (int i = 0; i < dimension(); ++i) {
    const double width = bounds_.width(i);
    if (!std::isfinite(width)) continue;
    const double widest = std::max(kWidestStep * width, options_.sigma * options_.scale[i]);
    const double now = s.sigma * options_.scale[i] * s.shape.L.row(i).head(i + 1).norm();
    if (now > widest) s.sigma *= widest / now;
  }
}

std::optional<Stop> OnePlusOne::findStop() const {
  const OnePlusOneState& s = state_;
  if (s.all_failed >= options_.tolallfailed) {
    return Stop{"tolallfailed", static_cast<double>(s.all_failed),
                static_cast<double>(options_.tolallfailed)};
  }
  double widest = 0;
  for (int i = 0; i < dimension(); ++i) {
    widest = std::max(widest, s.shape.L.row(i).head(i + 1).norm());
  }
  const double growth = s.sigma / options_.sigma * widest;
  if (growth < options_.tolx) return Stop{"tolx", growth, options_.tolx};
  if (growth > options_.tolxup) return Stop{"tolxup", growth, options_.tolxup};
  return std::nullopt;
}

std::uint64_t OnePlusOne::fingerprint() const {
  StateWriter w("options", kOnePlusOneStateVersion);
  const OnePlusOneOptions& o = options_;
  for (const VectorXd* v : {&o.x0, &o.scale, &o.lower, &o.upper}) w.reals(numbers(*v));
  for (const double v : {o.sigma, o.tolx, o.tolxup}) w.real(v);
  for (const int v : {o.constraints, int{o.active}, int{o.active_constraints},
                      int{o.feasible_first}, o.tolallfailed, o.restarts}) {
    w.integer(v);
  }
  w.integer(o.seed);
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

template <class IO, class State>
void OnePlusOne::fields(IO& io, State& s) const {
  io.integer(s.trial, 0, kMostTrials);
  io.integer(s.descent, 0, options_.restarts);
  io.finite(numbers(s.parent));
  io.boolean(s.has_parent);
  io.integer(s.violations, 0, options_.constraints + 1);
  io.finite(s.cost);
  io.positive(s.sigma);
  io.real(s.p_success, 0, 1);
  io.finite(numbers(s.shape.p_c));
  io.finite(numbers(s.shape.L));
  io.require(s.shape.L.diagonal().minCoeff() > 0, "its covariance is none");
  io.finite(numbers(s.fading));
  io.list(s.ancestors, 0, kAncestors, [&](auto& cost) { io.finite(cost); });
  io.integer(s.all_failed, 0, kMostInARow);
  field(io, s.stop);
}

std::string OnePlusOne::save() const {
  StateWriter w(kOnePlusOne, kOnePlusOneStateVersion);
  w.integer(dimension());
  w.integer(fingerprint());
  fields(w, state_);
  return w.finish();
}

void OnePlusOne::restore(std::string_view text) {
  StateReader r(text, kOnePlusOne, kOnePlusOneStateVersion);
  const std::uint64_t n = r.integer();
  if (n != static_cast<std::uint64_t>(dimension())) {
    refuse(kOnePlusOne, "cannot restore a state of n = {}; expected n = {}", n, dimension());
  }
  if (r.integer() != fingerprint()) {
    refuse(kOnePlusOne, "cannot restore a state saved under other options");
  }
  OnePlusOneState s = state_;
  fields(r, s);
  r.finish();
  state_ = std::move(s);
  drawn_ = false;
}

}  // namespace traceur::optim
