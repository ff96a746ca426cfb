#include "traceur/optim/cma_c.h"

#include <fmt/format.h>

#include <algorithm>
#include <climits>
#include <cmath>

#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/state.h"

namespace traceur::optim {
namespace {

constexpr std::string_view kCmaC = "cma-c";
constexpr std::uint64_t kCmaCStateVersion = 2;
/// Trials remembered at most, the latest: more would only slow training and swell the state [ours].
constexpr size_t kMostKnown = 4000;
/// Squared distances beyond this are no classifier's business: LIBSVM's sums would overflow.
constexpr double kFarthest = 1e300;
/// Weight of the latest trial in ClassifierReport::agreement [ours].
constexpr double kAgreementRate = 0.05;

void checkPositive(std::string_view name, double value) {
  if (!(value > 0 && std::isfinite(value))) {
    refuse(kCmaC, "expected a finite {} > 0, got {}", name, value);
  }
}

void checkCount(std::string_view name, int value, int least) {
  if (value < least) refuse(kCmaC, "expected {} ≥ {}, got {}", name, least, value);
}

/// Checks what CmaEs does not and fills in what was left to its default.
CmaCOptions complete(CmaCOptions o) {
  const auto n = static_cast<int>(o.cma.x0.size());
  checkCount("constraints", o.constraints, 0);
  checkPositive("alpha", o.alpha);
  checkCount("least_labels", o.least_labels, 1);
  checkPositive("wide_width", o.wide_width);
  checkPositive("wide_C", o.wide_C);
  checkPositive("near_width", o.near_width);
  checkPositive("near_C", o.near_C);
  checkCount("neighbours", o.neighbours, 0);
  checkCount("most_points", o.most_points, 0);
  if (!(o.least_agreement >= 0 && o.least_agreement <= 1)) {
    refuse(kCmaC, "expected least_agreement in [0, 1], got {}", o.least_agreement);
  }
  checkCount("restarts", o.restarts, 0);
  if (!(o.collapsed >= 0)) refuse(kCmaC, "expected collapsed ≥ 0, got {}", o.collapsed);
  checkCount("tours", o.tours, 0);
  checkCount("choices", o.choices, 1);
  checkPositive("model_width", o.model_width);
  checkPositive("model_noise", o.model_noise);
  if (!(o.model_caution >= 0 && std::isfinite(o.model_caution))) {
    refuse(kCmaC, "expected a finite model_caution ≥ 0, got {}", o.model_caution);
  }
  checkCount("model_points", o.model_points, 1);
  for (size_t i = 0; i < o.experience.size(); ++i) {
    const Trial& trial = o.experience[i];
    if (trial.x.size() != n) {
      refuse(kCmaC, "experience[{}] has {} variables, x0 has {}", i, trial.x.size(), n);
    }
    if (!trial.x.allFinite()) refuse(kCmaC, "experience[{}] is not finite", i);
    if (trial.evaluation.violated.size() > static_cast<size_t>(o.constraints)) {
      refuse(kCmaC, "experience[{}] reports on {} constraints, expected {} at most", i,
             trial.evaluation.violated.size(), o.constraints);
    }
  }
  if (o.neighbours == 0) o.neighbours = 20 + 2 * n;
  if (o.cma.scale.size() == 0) o.cma.scale = VectorXd::Ones(n);
  if (o.constraints > 0 && o.follow) {
    o.cma.hold_feasible = o.cma.feasible_first;
    o.cma.try_start = true;
  }
  return o;
}

}  // namespace

CmaCOptions dissertationCmaC(CmaEsOptions cma, int constraints) {
  cma.feasible_first = false;
  cma.likeliest = false;
  const double n = std::max<double>(1, static_cast<double>(cma.x0.size()));
  return {.cma = std::move(cma),
          .constraints = constraints,
          .balanced = false,
          .wide_width = 0.1 * std::sqrt(2 / n),  // a standard deviation of 0.1 σ for every n
          .width_at_first_use = true,
          .follow = false,
          .most_points = 0,
          .least_agreement = 0,
          .restarts = 0};
}

CmaCOptions modelCmaC(CmaCOptions options) {
  options.choices = 10;
  return options;
}

CmaC::CmaC(CmaCOptions options)
    : options_(complete(std::move(options))), cma_(makeDescent(0)), told_(cma_->options().lambda) {
  const CmaEsOptions& o = cma_->options();
  bounds_ = BoundFold(o.lower, o.upper, o.sigma * o.scale);
  s_.reports.resize(options_.constraints);
  s_.gamma.resize(options_.constraints);
  svm_.resize(options_.constraints);
  for (const Trial& trial : options_.experience) {
    addKnown({trial.x, labelsOf(trial.evaluation)});
  }
}

std::unique_ptr<CmaEs> CmaC::makeDescent(std::uint64_t descent) const {
  CmaEsOptions o = options_.cma;
  if (options_.constraints > 0) {
    o.acceptance = [this](int, const VectorXd& x) { return acceptance(x); };
  }
  o.choices = options_.choices;
  if (o.choices > 1) o.promise = [this](int, const VectorXd& x) { return promise(x); };
  if (descent > 0) {
    Random random(o.seed, kDescentStream, descent);
    for (int i = 0; i < o.x0.size(); ++i) {
      double& x = o.x0[i];
      x += o.sigma * o.scale[i] * random.normal();
      if (o.lower.size() > 0) x = std::max(x, o.lower[i]);
      if (o.upper.size() > 0) x = std::min(x, o.upper[i]);
    }
    o.seed = random.bits();
  }
  return std::make_unique<CmaEs>(std::move(o));
}

std::vector<CmaC::Label> CmaC::labelsOf(const Evaluation& evaluation) const {
  std::vector<Label> labels(options_.constraints, kUnknown);
  if (evaluation.failed) return labels;
  const std::vector<bool>& violated = evaluation.violated;
  for (int j = 0; j < options_.constraints; ++j) {
    if (violated.empty()) {
      labels[j] = kHolds;
    } else if (j < static_cast<int>(violated.size())) {
      labels[j] = violated[j] ? kViolated : kHolds;
    }
  }
  return labels;
}

void CmaC::addKnown(Labelled trial) {
  const bool useful = trial.cost || std::any_of(trial.labels.begin(), trial.labels.end(),
                                                [](Label label) { return label != kUnknown; });
  if (!useful) return;
  s_.known.push_back(std::move(trial));
  if (s_.known.size() > kMostKnown) s_.known.erase(s_.known.begin());
}

double CmaC::acceptance(const VectorXd& x) const {
  double p = 1;
  VectorXd z;
  for (int j = 0; j < options_.constraints; ++j) {
    if (!svm_[j] || s_.reports[j].agreement < options_.least_agreement) continue;
    if (z.size() == 0) z = inMetric(x);
    p /= 1 + std::exp(-options_.alpha * svm_[j]->decision(z));
  }
  return p;
}

void CmaC::setMetric() {
  const CmaState& s = cma_->state();
  const VectorXd unit = options_.cma.scale.cwiseInverse();
  local_ = options_.follow && s_.seen_feasible;
  center_ = s.mean;
  metric_ = unit.asDiagonal();
  if (local_) {
    if (s.lengths.size() > 0) {
      metric_ = s.lengths.cwiseInverse().asDiagonal() * s.axes.transpose() * metric_;
    }
    metric_ = (s.sigma * s.D).cwiseInverse().asDiagonal() * s.B.transpose() * metric_;
  }
}

VectorXd CmaC::inMetric(const VectorXd& x) const {
  VectorXd u(x.size());
  for (int i = 0; i < x.size(); ++i) {
    u[i] = bounds_.unfoldNear(i, x[i], center_[i]) - center_[i];
  }
  return metric_ * u;
}

void CmaC::prepare() {
  if (prepared_) return;
  if (options_.constraints > 0 || options_.choices > 1) {
    setMetric();
    MatrixXd Z(dimension(), s_.known.size());
    for (size_t i = 0; i < s_.known.size(); ++i) {
      Z.col(static_cast<Eigen::Index>(i)) = inMetric(s_.known[i].x);
    }
    for (int j = 0; j < options_.constraints; ++j) train(j, Z);
    if (options_.choices > 1) trainModel(Z);
  }
  x_.assign(told_.size(), {});
  const std::uint64_t first = cma_->state().generation * told_.size();
  for (Candidate& c : cma_->ask()) x_[c.id - first] = std::move(c.x);
  prepared_ = true;
}

void CmaC::train(int constraint, const MatrixXd& Z) {
  svm_[constraint].reset();
  // The nearest of each label, then in the order in which they were tried.
  std::vector<int> chosen;
  const int most = local_ ? options_.neighbours : options_.most_points;
  for (const Label label : {kHolds, kViolated}) {
    std::vector<std::pair<double, int>> all;
    for (size_t i = 0; i < s_.known.size(); ++i) {
      const auto k = static_cast<int>(i);
      if (s_.known[i].labels[constraint] != label) continue;
      const double distance = Z.col(k).squaredNorm();
      // Else so far off in the metric that numbers lose their meaning.
      if (distance < kFarthest) all.emplace_back(distance, k);
    }
    if (static_cast<int>(all.size()) < options_.least_labels) return;
    if (most > 0 && static_cast<int>(all.size()) > most) {
      std::nth_element(all.begin(), all.begin() + most, all.end());
      all.resize(most);
    }
    for (const auto& [distance, k] : all) chosen.push_back(k);
  }
  std::sort(chosen.begin(), chosen.end());

  MatrixXd X(dimension(), chosen.size());
  std::vector<bool> inside(chosen.size());
  for (size_t i = 0; i < chosen.size(); ++i) {
    X.col(static_cast<Eigen::Index>(i)) = Z.col(chosen[i]);
    inside[i] = s_.known[chosen[i]].labels[constraint] == kHolds;
  }
  const double n = dimension();
  SvmOptions svm{.C = options_.wide_C, .balanced = options_.balanced};
  if (local_) {
    svm.gamma = 1 / (2 * n * options_.near_width * options_.near_width);
    svm.C = options_.near_C;
  } else {
    double& gamma = s_.gamma[constraint];
    if (gamma == 0) {
      const double sigma = options_.width_at_first_use ? cma_->state().sigma : options_.cma.sigma;
      const double width = options_.wide_width * std::sqrt(n / 2) * sigma;
      gamma = 1 / (2 * width * width);
    }
    svm.gamma = gamma;
  }
  if (!(svm.gamma > 0 && std::isfinite(svm.gamma))) return;
  svm_[constraint].emplace(X, inside, svm);
}

void CmaC::trainModel(const MatrixXd& Z) {
  model_.reset();
  std::vector<std::pair<double, int>> all;
  for (size_t i = 0; i < s_.known.size(); ++i) {
    const auto k = static_cast<int>(i);
    const double distance = Z.col(k).squaredNorm();
    if (s_.known[i].cost && distance < kFarthest) all.emplace_back(distance, k);
  }
  if (static_cast<int>(all.size()) <= dimension()) return;  // not even a slope can be told
  std::sort(all.begin(), all.end());
  if (all.size() > static_cast<size_t>(options_.model_points)) all.resize(options_.model_points);
  MatrixXd X(dimension(), all.size());
  std::vector<double> costs(all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    X.col(static_cast<Eigen::Index>(i)) = Z.col(all[i].second);
    costs[i] = *s_.known[all[i].second].cost;
  }
  model_.emplace(std::move(X), costs,
                 CostModelOptions{.width = options_.model_width * std::sqrt(dimension()),
                                  .noise = options_.model_noise});
}

double CmaC::promise(const VectorXd& x) const {
  if (!model_) return 0;  // the first draw is as good as any
  const CostModel::Prediction p = model_->predict(inMetric(x));
  return p.mean - options_.model_caution * p.deviation;
}

std::vector<Candidate> CmaC::ask() {
  prepare();
  std::vector<Candidate> candidates;
  for (size_t k = 0; k < told_.size(); ++k) {
    if (!told_[k]) candidates.push_back({s_.generation * told_.size() + k, x_[k]});
  }
  return candidates;
}

void CmaC::tell(std::uint64_t id, const Evaluation& evaluation) {
  const std::uint64_t first = s_.generation * told_.size();
  if (id < first || id - first >= told_.size()) {
    refuse(kCmaC, "no candidate {} in generation {}, which has {} to {}", id, s_.generation, first,
           first + told_.size() - 1);
  }
  const std::uint64_t k = id - first;
  if (told_[k]) refuse(kCmaC, "candidate {} has been told already", id);
  const size_t reported = evaluation.violated.size();
  if (reported != 0 && reported != static_cast<size_t>(options_.constraints)) {
    refuse(kCmaC, "expected a trial to report on {} constraints, got {}", options_.constraints,
           reported);
  }
  prepare();
  told_[k] = Labelled{x_[k], labelsOf(evaluation)};
  const bool by_cost =
      options_.cma.feasible_first ? evaluation.feasible() : evaluation.meaningful();
  if (options_.choices > 1 && by_cost) told_[k]->cost = evaluation.cost;
  const bool feasible = evaluation.feasible();
  if (s_.generation == 0 && k == 0) s_.exploring = !feasible;
  s_.told_feasible = s_.told_feasible || feasible;

  const std::uint64_t generation = cma_->state().generation;
  const std::uint64_t refused = cma_->state().refused;
  cma_->tell(generation * told_.size() + k, evaluation);
  if (cma_->state().generation == generation) return;
  s_.refused += cma_->state().refused - refused;
  endGeneration();
}

void CmaC::endGeneration() {
  for (std::optional<Labelled>& trial : told_) {
    judge(*trial);
    addKnown(std::move(*trial));
    trial.reset();
  }
  s_.seen_feasible = s_.seen_feasible || s_.told_feasible;
  s_.told_feasible = false;
  ++s_.generation;
  prepared_ = false;
  if (options_.constraints > 0) endDescent();
}

void CmaC::judge(const Labelled& trial) {
  for (int j = 0; j < options_.constraints; ++j) {
    const Label label = trial.labels[j];
    s_.violated = s_.violated || label == kViolated;
    ClassifierReport& report = s_.reports[j];
    report.active = svm_[j].has_value();
    if (!report.active || label == kUnknown) continue;
    const bool agreed = (svm_[j]->decision(inMetric(trial.x)) > 0) == (label == kHolds);
    ++report.judged;
    report.agreed += agreed;
    report.agreement += kAgreementRate * ((agreed ? 1 : 0) - report.agreement);
  }
}

void CmaC::endDescent() {
  const CmaState& s = cma_->state();
  const bool stopped = s.stop.has_value();
  if (stopped && s.stop->reason == "tolallfailed") return;
  const bool collapsed = options_.cma.feasible_first &&
                         s.sigma * cma_->longestAxis() < options_.collapsed * options_.cma.sigma;
  const bool lost = collapsed && !s_.seen_feasible;
  if (!stopped && !collapsed) return;
  const auto left = [this] {
    return s_.violated && s_.descents <= static_cast<std::uint64_t>(options_.restarts);
  };
  if (s_.exploring && options_.follow && options_.cma.feasible_first) {
    if (s_.seen_feasible) {  // and so holds a feasible trial
      ++s_.toured;
      if (s_.best.empty() || s.held_cost < s_.best_cost) {
        s_.best_cost = s.held_cost;
        s_.best_descent = s_.descent;
        s_.best = cma_->save();
      }
    }
    if (left() && s_.toured <= static_cast<std::uint64_t>(options_.tours)) return beginDescent();
    s_.exploring = false;
    if (s_.best.empty()) return;
    s_.descent = s_.best_descent;
    s_.seen_feasible = true;
    cma_ = makeDescent(s_.descent);
    cma_->restore(s_.best);
    s_.best.clear();
    if (!cma_->stopped()) return;
  } else if (!stopped && !lost) {
    return;
  }
  if (!left()) return;
  s_.exploring = true;
  s_.toured = 0;
  beginDescent();
}

void CmaC::beginDescent() {
  s_.descent = s_.descents++;
  s_.seen_feasible = false;
  cma_ = makeDescent(s_.descent);
}

std::optional<Stop> CmaC::stopped() const {
  return cma_->stopped();
}

std::uint64_t CmaC::fingerprint() const {
  const CmaCOptions& o = options_;
  StateWriter w("options", kCmaCStateVersion);
  for (const double v :
       {o.alpha, o.wide_width, o.wide_C, o.near_width, o.near_C, o.least_agreement, o.collapsed}) {
    w.real(v);
  }
  for (const int v :
       {o.constraints, o.least_labels, int{o.balanced}, int{o.width_at_first_use}, int{o.follow},
        o.neighbours, o.most_points, o.restarts, o.tours, o.cma.max_draws}) {
    w.integer(v);
  }
  if (o.choices > 1) {
    for (const double v : {o.model_width, o.model_noise, o.model_caution}) w.real(v);
    for (const int v : {o.choices, o.model_points}) w.integer(v);
  }
  for (const Trial& trial : o.experience) {
    w.reals({trial.x.data(), static_cast<size_t>(trial.x.size())});
    for (const Label label : labelsOf(trial.evaluation)) w.integer(label);
  }
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

/// What a trial said of each constraint.
template <class IO, class Trial>
void CmaC::trialField(IO& io, Trial& trial) const {
  io.resize(trial.x, dimension());
  io.finite(numbers(trial.x));
  std::string labels;
  for (const Label label : trial.labels) labels += "-0+"[label + 1];
  io.text(labels);
  if constexpr (IO::kReads) {
    for (const char c : labels) {
      io.require(c == '+' || c == '-' || c == '0', "a trial has a label that is none");
      trial.labels.push_back(c == '+' ? kHolds : c == '-' ? kViolated : kUnknown);
    }
    if (static_cast<int>(trial.labels.size()) != options_.constraints) {
      io.fail(fmt::format("a trial has {} labels", trial.labels.size()));
    }
  }
  if (options_.choices > 1) io.optional(trial.cost, [&](auto& cost) { io.finite(cost); });
}

template <class IO, class Fields, class Trials>
void CmaC::fields(IO& io, Fields& s, Trials& told, std::string& inner) const {
  io.integer(s.generation, 0, kMostGenerations);
  io.integer(s.descents, 1, static_cast<std::uint64_t>(options_.restarts) + 1);
  io.integer(s.descent, 0, s.descents - 1);
  io.integer(s.refused, 0, kMostTrials);
  for (auto* flag : {&s.violated, &s.seen_feasible, &s.told_feasible, &s.exploring}) {
    io.boolean(*flag);
  }
  io.integer(s.toured, 0, s.descents);
  io.integer(s.best_descent, 0, s.descents - 1);
  io.finite(s.best_cost);
  io.text(s.best);
  io.resize(s.reports, options_.constraints);
  for (auto& report : s.reports) {
    io.boolean(report.active);
    io.integer(report.judged, 0, kMostTrials);
    io.integer(report.agreed, 0, report.judged);
    io.real(report.agreement, 0, 1);
  }
  io.resize(s.gamma, options_.constraints);
  io.finite(s.gamma);
  for (const double gamma : s.gamma) {
    if constexpr (IO::kReads) {
      if (gamma < 0) io.fail(fmt::format("a kernel has γ = {}", gamma));
    }
  }
  const auto each = [&](auto& trial) { trialField(io, trial); };
  io.list(s.known, 0, kMostKnown, each);
  for (auto& trial : told) io.optional(trial, each);
  io.text(inner);
}

std::string CmaC::save() const {
  StateWriter w(kCmaC, kCmaCStateVersion);
  w.integer(dimension());
  w.integer(told_.size());
  w.integer(fingerprint());
  std::string inner = cma_->save();
  fields(w, s_, told_, inner);
  return w.finish();
}

void CmaC::restore(std::string_view text) {
  StateReader r(text, kCmaC, kCmaCStateVersion);
  const std::uint64_t n = r.integer();
  const std::uint64_t lambda = r.integer();
  if (n != static_cast<std::uint64_t>(dimension()) || lambda != told_.size()) {
    refuse(kCmaC, "cannot restore a state of n = {}, lambda = {}; expected n = {}, lambda = {}", n,
           lambda, dimension(), told_.size());
  }
  if (r.integer() != fingerprint()) {
    refuse(kCmaC, "cannot restore a state saved under other options");
  }
  State s;
  std::vector<std::optional<Labelled>> all_told(told_.size());
  std::string inner;
  fields(r, s, all_told, inner);
  r.finish();
  std::unique_ptr<CmaEs> cma = makeDescent(s.descent);
  cma->restore(inner);
  for (size_t k = 0; k < all_told.size(); ++k) {
    if (all_told[k].has_value() != cma->isTold(static_cast<int>(k))) {
      refuse(kCmaC, "cannot restore a state that disagrees about who was told");
    }
  }
  if (!s.best.empty()) makeDescent(s.best_descent)->restore(s.best);  // throws now, not later

  s_ = std::move(s);
  cma_ = std::move(cma);
  told_ = std::move(all_told);
  prepared_ = false;
}

}  // namespace traceur::optim
