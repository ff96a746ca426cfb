#include "traceur/optim/family_baselines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/cost.h"
#include "traceur/optim/start.h"
#include "traceur/optim/state.h"
#include "traceur/optim/task_positions.h"

namespace traceur::optim {
namespace {

constexpr std::uint64_t kBaselinesStateVersion = 2;
constexpr std::string_view kPhi = "cma";
constexpr std::string_view kIndividual = "individual";
/// Trials or curves per generation of the dissertation's baselines [Ha2015, §7.4].
constexpr int kLambda = 16;
/// Generations of a turn [ours: long enough to leave the first step size, short enough that six
/// tasks of 16 trials a generation have all had theirs after a thousand trials].
constexpr int kTurn = 10;
/// First step size of a task that begins at its neighbour's best, of the first task's [ours].
constexpr double kWarmSigma = 0.5;
/// Steps of the finest grid that tasks may lie on.
constexpr int kFinest = 1000;

/// The place of id in a generation.
/// @throws InputError for an id that is not of this generation
size_t placeOf(std::string_view who, std::uint64_t id, std::uint64_t first, size_t count) {
  if (id < first || id - first >= count) {
    throw InputError(
        fmt::format("{}: no candidate {} in a generation of {} from {}", who, id, count, first));
  }
  return id - first;
}

[[noreturn]] void refuseAgain(std::string_view who, std::uint64_t id) {
  throw InputError(fmt::format("{}: candidate {} has been told already", who, id));
}

/// Of finite numbers, (n x columns).
template <class IO, class Matrix>
void matrixField(IO& io, Matrix& m, Eigen::Index n, Eigen::Index columns) {
  io.integer(n, n, n);
  io.integer(columns, columns, columns);
  io.resize(m, n, columns);
  io.finite(numbers(m));
}

/// A curve of that kind, (n x columns), and its costs of the tasks.
template <class IO, class Best>
void familyField(IO& io, Best& best, Curve::Kind kind, int n, int columns, int tasks) {
  io.optional(best, [&](auto& family) {
    bool polyline = kind == Curve::Kind::kPolyline;
    io.boolean(polyline);
    io.require(polyline == (kind == Curve::Kind::kPolyline), "its curve is of another kind");
    if constexpr (IO::kReads) family.curve.kind = kind;
    matrixField(io, family.curve.points, n, columns);
    io.finite(family.cost);
    io.resize(family.task_costs, tasks);
    io.finite(family.task_costs);
  });
}

/// What a trial said of its task: nothing yet; NaN; or a cost.
template <class IO, class Told>
void toldField(IO& io, Told& told) {
  bool is_told = told.has_value();
  double cost = told.value_or(0);
  io.boolean(is_told);
  io.real(cost);
  io.require(!is_told || !std::isinf(cost), "a trial has an infinite cost");
  if constexpr (IO::kReads) {
    if (is_told) told = cost;
  }
}

/// Options of CMA-ES in n variables as those in K copies of them.
CmaEsOptions repeat(const CmaEsOptions& one, int K, const MatrixXd& phi0) {
  CmaEsOptions all = one;
  for (VectorXd* v : {&all.x0, &all.scale, &all.lower, &all.upper}) {
    const VectorXd once = *v;
    *v = once.replicate(K, 1);
  }
  if (phi0.size() > 0) all.x0 = phi0.reshaped();
  return all;
}

/// The steps of the coarsest even grid that all w lie on.
int gridSteps(const VectorXd& w) {
  if (w.size() == 1) return 0;
  for (int steps = static_cast<int>(w.size()) - 1; steps <= kFinest; ++steps) {
    const Eigen::ArrayXd at = w.array() * steps;
    if (((at - at.round()).abs() < 1e-9).all()) return steps;
  }
  throw InputError(fmt::format(
      "individual: expected tasks on an even grid of at most {} steps, as the knots of a polyline "
      "are",
      kFinest));
}

}  // namespace

// ---- Curves as candidates.

PhiCma::PhiCma(const VectorXd& tasks, int control_points, const CmaEsOptions& cma,
               const MatrixXd& phi0)
    : w_(taskPositions(kPhi, tasks)), n_(static_cast<int>(cma.x0.size())), cma_([&] {
        const int K = std::min(control_points, taskCount());
        if (K < 1) throw InputError(fmt::format("cma: expected control points ≥ 1, got {}", K));
        if (phi0.size() > 0 && (phi0.rows() != n_ || phi0.cols() != K)) {
          throw InputError(fmt::format("cma: expected phi0({} x {}), got ({} x {})", n_, K,
                                       phi0.rows(), phi0.cols()));
        }
        return repeat(cma, K, phi0);
      }()) {
  told_.resize(count());
}

VectorXd PhiCma::pointAt(const VectorXd& phi, int task) const {
  const Eigen::Map<const MatrixXd> points(phi.data(), n_, phi.size() / n_);
  const VectorXd x = points * bernstein(static_cast<int>(points.cols()), w_[task]);
  // Of control points on a bound the sum may round to a point beyond it.
  const CmaEsOptions& o = cma_.options();
  return x.cwiseMax(o.lower.head(n_)).cwiseMin(o.upper.head(n_));
}

std::vector<Candidate> PhiCma::ask() {
  std::vector<Candidate> candidates;
  candidates.reserve(count() - told_count_);
  const std::vector<Candidate> curves = cma_.ask();
  for (int i = 0; i < count(); ++i) {
    if (!told_[i])
      candidates.push_back({firstId() + i, pointAt(curves[i / taskCount()].x, i % taskCount())});
  }
  return candidates;
}

void PhiCma::tell(std::uint64_t id, const Evaluation& evaluation) {
  const size_t i = placeOf(kPhi, id, firstId(), told_.size());
  if (told_[i]) refuseAgain(kPhi, id);
  told_[i] = costsOfTasks(kPhi, evaluation, taskCount())[i % taskCount()];
  if (++told_count_ == count()) update();
}

void PhiCma::update() {
  const std::vector<Candidate> curves = cma_.ask();
  for (size_t k = 0; k < curves.size(); ++k) {
    VectorXd costs(taskCount());
    for (int i = 0; i < taskCount(); ++i) costs[i] = *told_[k * taskCount() + i];
    const Evaluation evaluation{.cost = meanCost(costs)};  // NaN if one is
    if (evaluation.meaningful() && (!best_ || evaluation.cost < best_->cost)) {
      best_.emplace();
      best_->curve.points = curves[k].x.reshaped(n_, curves[k].x.size() / n_);
      best_->cost = evaluation.cost;
      best_->task_costs.assign(costs.begin(), costs.end());
    }
    cma_.tell(curves[k].id, evaluation);
  }
  std::fill(told_.begin(), told_.end(), std::nullopt);
  told_count_ = 0;
}

template <class IO, class Best, class Trials>
void PhiCma::fields(IO& io, std::string& inner, Best& best, Trials& told) const {
  io.text(inner);
  const int K = static_cast<int>(cma_.options().x0.size()) / n_;
  familyField(io, best, Curve::Kind::kBezier, n_, K, taskCount());
  for (auto& cost : told) toldField(io, cost);
}

std::string PhiCma::save() const {
  StateWriter w(kPhi, kBaselinesStateVersion);
  w.reals(numbers(w_));
  std::string inner = cma_.save();
  fields(w, inner, best_, told_);
  return w.finish();
}

void PhiCma::restore(std::string_view text) {
  StateReader r(text, kPhi, kBaselinesStateVersion);
  std::vector<double> tasks;
  r.reals(tasks);
  if (tasks != std::vector<double>(w_.begin(), w_.end())) {
    throw InputError("cma: cannot restore a state saved for other tasks");
  }
  std::string inner;
  std::optional<Family> best;
  std::vector<std::optional<double>> told(told_.size());
  fields(r, inner, best, told);
  r.finish();
  const auto told_count = static_cast<int>(
      std::count_if(told.begin(), told.end(), [](const auto& cost) { return cost.has_value(); }));
  if (told_count == count()) r.fail("its generation is over, and was not learned from");
  CmaEs cma(cma_.options());
  cma.restore(inner);
  if (cma.toldCount() > 0) r.fail("its curves are told before their points are");

  cma_ = std::move(cma);
  best_ = std::move(best);
  told_ = std::move(told);
  told_count_ = told_count;
}

// ---- Tasks by themselves.

IndividualCma::IndividualCma(IndividualCmaOptions options)
    : options_(std::move(options)), w_(taskPositions(kIndividual, options_.tasks)) {
  const auto refuse = [](std::string_view name, std::string_view expected, double got) {
    throw InputError(fmt::format("individual: expected {} {}, got {}", name, expected, got));
  };
  if (options_.turn < 0) refuse("turn", "≥ 0", options_.turn);
  if (std::isnan(options_.target)) refuse("target", "a number", options_.target);
  knots_ = gridSteps(w_) + 1;
  searches_.resize(taskCount());
  for (int i = 0; i < taskCount(); ++i) {
    if (options_.turn > 0 && i > 0) continue;
    searches_[i].x0 = options_.cma.x0;
    searches_[i].cma = searchFrom(i, options_.cma.x0);
  }
  const std::uint64_t seed = options_.cma.seed;
  options_.cma = searches_[0].cma->options();  // defaults filled in
  options_.cma.seed = seed;
  left_ = options_.turn;
  asked_ = gather();
}

std::unique_ptr<CmaEs> IndividualCma::searchFrom(int task, const VectorXd& x0) const {
  CmaEsOptions o = options_.cma;
  o.x0 = x0;
  if (options_.turn > 0 && task > 0) o.sigma *= kWarmSigma;
  o.seed = Random(options_.cma.seed, task).bits();
  return std::make_unique<CmaEs>(std::move(o));
}

/// The candidates of the generation that begins, in the order of their ids.
std::vector<IndividualCma::Asked> IndividualCma::gather() const {
  std::vector<Asked> asked;
  for (int i = 0; i < taskCount(); ++i) {
    const Search& search = searches_[i];
    if (!search.cma || search.stop || (options_.turn > 0 && i != current_)) continue;
    for (Candidate& c : search.cma->ask()) asked.push_back({i, c.id, std::move(c.x), {}});
  }
  return asked;
}

std::vector<Candidate> IndividualCma::ask() {
  std::vector<Candidate> candidates;
  for (size_t k = 0; k < asked_.size(); ++k) {
    if (!asked_[k].cost) candidates.push_back({first_id_ + k, asked_[k].x});
  }
  return candidates;
}

void IndividualCma::tell(std::uint64_t id, const Evaluation& evaluation) {
  Asked& asked = asked_[placeOf(kIndividual, id, first_id_, asked_.size())];
  if (asked.cost) refuseAgain(kIndividual, id);
  asked.cost = costsOfTasks(kIndividual, evaluation, taskCount())[asked.task];
  if (++told_count_ == static_cast<int>(asked_.size())) update();
}

void IndividualCma::update() {
  for (const Asked& asked : asked_) {
    const double cost = *asked.cost;
    Search& search = searches_[asked.task];
    if (cost < search.cost) {
      search.cost = cost;
      search.best = asked.x;
    }
    search.cma->tell(asked.inner, {.cost = cost});
  }
  std::optional<Stop> last;
  for (Search& search : searches_) {
    if (!search.cma || search.stop) continue;
    if (search.cost <= options_.target) {
      search.stop = Stop{"target", search.cost, options_.target};
    } else {
      search.stop = search.cma->stopped();
    }
    if (search.stop) last = search.stop;
  }
  if (options_.turn > 0) passTurn();
  if (std::none_of(searches_.begin(), searches_.end(),
                   [](const Search& search) { return search.best.size() == 0; })) {
    join();
  }

  ++generation_;
  first_id_ += asked_.size();
  told_count_ = 0;
  asked_ = gather();
  if (asked_.empty()) stop_ = last ? last : searches_.back().stop;
}

/// Goes to the next task once the turn of the current one, or its search, is over.
void IndividualCma::passTurn() {
  if (--left_ > 0 && !searches_[current_].stop) return;
  left_ = options_.turn;
  for (int step = 1; step <= taskCount(); ++step) {
    const int next = (current_ + step) % taskCount();
    Search& search = searches_[next];
    if (search.stop) continue;
    if (!search.cma) {
      const Search& before = searches_[next - 1];  // the first task has its search from the start
      search.x0 = before.best.size() > 0 ? before.best : options_.cma.x0;
      search.cma = searchFrom(next, search.x0);
    }
    current_ = next;
    return;
  }
}

/// The polyline through every task's best.
void IndividualCma::join() {
  Family family;
  family.curve.kind = Curve::Kind::kPolyline;
  family.curve.points.resize(options_.cma.x0.size(), knots_);
  double sum = 0;
  for (int i = 0, knot = 0; i < taskCount(); ++i) {
    const int last = static_cast<int>(std::lround(w_[i] * (knots_ - 1)));
    const int first = knot;
    for (; knot <= last; ++knot) {  // knots between two tasks lie on the straight line
      const double t = last == first ? 1 : (knot - first + 1.0) / (last - first + 1);
      family.curve.points.col(knot) =
          t == 1 ? searches_[i].best
                 : VectorXd((1 - t) * searches_[i - 1].best + t * searches_[i].best);
    }
    family.task_costs.push_back(searches_[i].cost);
    sum += searches_[i].cost;
  }
  family.cost = isCost(sum)
                    ? sum / taskCount()
                    : meanCost(Eigen::Map<const VectorXd>(family.task_costs.data(), taskCount()));
  if (!best_ || family.cost < best_->cost) best_ = std::move(family);
}

std::uint64_t IndividualCma::fingerprint() const {
  StateWriter w("options", kBaselinesStateVersion);
  w.reals(numbers(options_.tasks));
  w.integer(options_.turn);
  w.real(options_.target);
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

/// A task's search; what is read is `search`'s, begun anew.
template <class IO, class Begun>
void IndividualCma::searchField(IO& io, Begun& search, int task) const {
  bool begun = search.cma != nullptr;
  io.boolean(begun);
  if constexpr (IO::kReads) {
    io.require(begun || (task > 0 && options_.turn > 0), "a task has no search");
    search = {};
  }
  if (!begun) return;
  const auto n = options_.cma.x0.size();
  io.resize(search.x0, n);
  io.finite(numbers(search.x0));
  std::string inner;
  if constexpr (!IO::kReads) inner = search.cma->save();
  io.text(inner);
  if constexpr (IO::kReads) {
    search.cma = searchFrom(task, search.x0);
    search.cma->restore(inner);
    io.require(search.cma->toldCount() == 0, "a search was told more than its task");
  }
  io.real(search.cost, std::numeric_limits<double>::lowest(), kInfinity);
  const bool has_best = isCost(search.cost);
  matrixField(io, search.best, has_best ? n : 0, 1);
  if (has_best) {
    io.require((search.best.array() >= options_.cma.lower.array()).all() &&
                   (search.best.array() <= options_.cma.upper.array()).all(),
               "a task's best lies outside the bounds");
  }
  field(io, search.stop);
}

template <class IO, class Self>
void IndividualCma::fields(IO& io, Self& s) const {
  io.integer(s.generation_, 0, kMostGenerations);
  io.integer(s.first_id_, 0, kMostTrials);
  io.integer(s.current_, 0, taskCount() - 1);
  io.integer(s.left_, 0, options_.turn);
  for (int i = 0; i < taskCount(); ++i) searchField(io, s.searches_[i], i);
  field(io, s.stop_);
  familyField(io, s.best_, Curve::Kind::kPolyline, static_cast<int>(options_.cma.x0.size()), knots_,
              taskCount());
  if constexpr (IO::kReads) s.asked_ = s.gather();
  std::uint64_t asked = s.asked_.size();
  io.integer(asked, 0, UINT64_MAX);
  io.require(asked == s.asked_.size(), "it is of another number of candidates");
  for (auto& trial : s.asked_) toldField(io, trial.cost);
}

std::string IndividualCma::save() const {
  StateWriter w(kIndividual, kBaselinesStateVersion);
  w.integer(fingerprint());
  fields(w, *this);
  return w.finish();
}

void IndividualCma::restore(std::string_view text) {
  StateReader r(text, kIndividual, kBaselinesStateVersion);
  if (r.integer() != fingerprint()) {
    throw InputError("individual: cannot restore a state saved under other options");
  }
  IndividualCma other(options_);
  fields(r, other);
  r.finish();
  other.told_count_ =
      static_cast<int>(std::count_if(other.asked_.begin(), other.asked_.end(),
                                     [](const Asked& asked) { return asked.cost.has_value(); }));
  if (!other.asked_.empty() && other.told_count_ == static_cast<int>(other.asked_.size())) {
    r.fail("its generation is over, and was not learned from");
  }
  *this = std::move(other);
}

// ---- As registered.

namespace {

CmaEsOptions cmaOptionsOf(const Problem& problem, const CommonOptions& options) {
  Start start = startOf(problem, options.x0);
  CmaEsOptions o;
  o.x0 = std::move(start.x0);
  o.sigma = options.sigma;
  o.scale = std::move(start.scale);
  o.lower = problem.lower();
  o.upper = problem.upper();
  o.lambda = options.lambda == 0 ? kLambda : options.lambda;
  o.seed = options.seed;
  return o;
}

void requireLines(const CommonOptions& options) {
  if (options.control_points == 2) return;
  throw InputError(
      fmt::format("individual and neighbours join the tasks by straight lines: a curve of {} "
                  "control points, such as a cubic one, is not theirs",
                  options.control_points));
}

}  // namespace

std::unique_ptr<Optimizer> makePhiCma(const Problem& problem, const CommonOptions& options) {
  return std::make_unique<PhiCma>(problem.tasks(), options.control_points,
                                  cmaOptionsOf(problem, options));
}

std::unique_ptr<Optimizer> makeIndividualCma(const Problem& problem, const CommonOptions& options) {
  requireLines(options);
  IndividualCmaOptions o;
  o.tasks = problem.tasks();
  o.cma = cmaOptionsOf(problem, options);
  return std::make_unique<IndividualCma>(std::move(o));
}

std::unique_ptr<Optimizer> makeNeighbourCma(const Problem& problem, const CommonOptions& options) {
  requireLines(options);
  IndividualCmaOptions o;
  o.tasks = problem.tasks();
  o.cma = cmaOptionsOf(problem, options);
  o.turn = kTurn;
  return std::make_unique<IndividualCma>(std::move(o));
}

}  // namespace traceur::optim
