#include "traceur/optim/restarts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/refuse.h"
#include "traceur/optim/state.h"

namespace traceur::optim {
namespace {

constexpr std::string_view kRestarts = "restarts";
constexpr std::uint64_t kRestartsStateVersion = 1;

}  // namespace

Restarts::Restarts(CmaEsOptions options, RestartOptions restarts)
    : options_(std::move(options)), restarts_(restarts) {
  if (restarts_.restarts < 0) {
    refuse(kRestarts, "expected restarts ≥ 0, got {}", restarts_.restarts);
  }
  if (!(restarts_.growth >= 1 && std::isfinite(restarts_.growth))) {
    refuse(kRestarts, "expected growth ≥ 1, got {}", restarts_.growth);
  }
  const CmaEsOptions full = CmaEs(options_).options();  // checked, defaults filled in
  options_.scale = full.scale;
  options_.lower = full.lower;
  options_.upper = full.upper;
  options_.lambda = full.lambda;
  s_.lambda = full.lambda;
  s_.sigma = full.sigma;
  cma_ = make(s_);
}

std::unique_ptr<CmaEs> Restarts::make(const State& state) const {
  CmaEsOptions o = options_;
  const std::uint64_t descent = state.descents - 1;
  if (descent > 0) {
    Random random(o.seed, kDescentStream, descent);
    o.seed = random.bits();
    o.lambda = static_cast<int>(state.lambda);
    o.sigma = state.sigma;
    for (int i = 0; i < o.x0.size(); ++i) {
      const double l = o.lower[i];
      const double u = o.upper[i];
      if (std::isfinite(u - l)) {
        o.x0[i] = std::clamp(random.uniform(l, u), l, u);
      } else {
        o.x0[i] = std::clamp(o.x0[i] + options_.sigma * o.scale[i] * random.normal(), l, u);
      }
    }
  }
  return std::make_unique<CmaEs>(std::move(o));
}

std::vector<Candidate> Restarts::ask() {
  std::vector<Candidate> candidates = cma_->ask();
  for (Candidate& c : candidates) c.id += s_.first_id;
  return candidates;
}

void Restarts::tell(std::uint64_t id, const Evaluation& evaluation) {
  if (id < s_.first_id) {
    refuse(kRestarts, "no candidate {}, the descent began at {}", id, s_.first_id);
  }
  const std::uint64_t generation = cma_->state().generation;
  cma_->tell(id - s_.first_id, evaluation);
  if (cma_->state().generation != generation) endGeneration();
}

/// λ of the k-th large descent after the first.
double Restarts::grown(std::uint64_t k) const {
  return std::min<double>(kMaxLambda, std::floor(options_.lambda * std::pow(restarts_.growth, k)));
}

void Restarts::endGeneration() {
  const std::uint64_t used = cma_->state().generation * s_.lambda;
  const bool spent = s_.small && 2 * used >= s_.latest_large;
  const std::optional<Stop>& stop = cma_->state().stop;
  if (stop ? stop->reason == "tolallfailed" : !spent) return;

  State next = s_;
  next.first_id += used;
  next.used[s_.small] += used;
  if (!s_.small) next.latest_large = used;
  ++next.descents;
  // After the first descent a large one, whose trials are counted together with the first's.
  next.small = restarts_.bipop && s_.grown > 0 && next.used[1] < next.used[0];
  if (next.small) {
    Random random(options_.seed, kDescentStream + 1, next.descents);
    const double u = random.uniform();
    const double ratio = grown(s_.grown) / (2.0 * options_.lambda);
    next.lambda = static_cast<std::uint64_t>(
        std::max(2.0, std::floor(options_.lambda * std::pow(ratio, u * u))));
    next.sigma = options_.sigma * std::pow(10, -2 * random.uniform());
  } else {
    if (s_.grown >= static_cast<std::uint64_t>(restarts_.restarts)) return;
    next.grown = s_.grown + 1;
    next.lambda = static_cast<std::uint64_t>(grown(next.grown));
    next.sigma = options_.sigma;
  }
  s_ = next;
  cma_ = make(s_);
}

std::uint64_t Restarts::fingerprint() const {
  StateWriter w("options", kRestartsStateVersion);
  w.integer(restarts_.restarts);
  w.real(restarts_.growth);
  w.integer(restarts_.bipop);
  w.integer(options_.seed);
  w.integer(options_.lambda);
  w.real(options_.sigma);
  for (const VectorXd* v : {&options_.x0, &options_.scale, &options_.lower, &options_.upper}) {
    w.reals(numbers(*v));
  }
  Hash hash;
  hash.add(w.finish());
  return hash.value();
}

template <class IO, class Fields>
void Restarts::fields(IO& io, Fields& s, std::string& inner) const {
  io.integer(s.descents, 1, kMostTrials);
  io.integer(s.grown, 0, restarts_.restarts);
  io.boolean(s.small);
  io.integer(
      s.lambda, 2,
      static_cast<std::uint64_t>(std::max(grown(s.grown), static_cast<double>(options_.lambda))));
  for (auto* v : {&s.first_id, &s.used[0], &s.used[1], &s.latest_large}) {
    io.integer(*v, 0, kMostTrials);
  }
  io.real(s.sigma, std::numeric_limits<double>::denorm_min(), options_.sigma);
  io.text(inner);
}

std::string Restarts::save() const {
  StateWriter w(kRestarts, kRestartsStateVersion);
  w.integer(fingerprint());
  std::string inner = cma_->save();
  fields(w, s_, inner);
  return w.finish();
}

void Restarts::restore(std::string_view text) {
  StateReader r(text, kRestarts, kRestartsStateVersion);
  if (r.integer() != fingerprint()) {
    refuse(kRestarts, "cannot restore a state saved under other options");
  }
  State s;
  std::string inner;
  fields(r, s, inner);
  r.finish();
  if (s.descents == 1 && s.lambda != static_cast<std::uint64_t>(options_.lambda)) {
    r.fail("its first descent has another population");
  }
  if (s.lambda > inner.size()) r.fail("its population is larger than what it remembers of it");
  std::unique_ptr<CmaEs> cma = make(s);
  cma->restore(inner);
  s_ = s;
  cma_ = std::move(cma);
}

}  // namespace traceur::optim
