#include "traceur/landing/falls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "traceur/core/error.h"
#include "traceur/core/lender.h"
#include "traceur/core/random.h"
#include "traceur/core/text.h"
#include "traceur/core/thread_pool.h"

namespace traceur::landing {

const std::vector<FallSet>& fallSets() {
  static const std::vector<FallSet> kSets = {
      {"easy",
       "planar, from 2.2 to 3.2 m",
       {{"height", 2.2, 3.2}, {"forward", 1.5, 4}, {"pitch_rate", 0, 1.5}, {"miss", -0.3, 0.3}}},
      {"platform",
       "off a platform of 1.1 m, hardly any spin",
       {{"height", 2.0, 2.0}, {"forward", 1, 3}, {"pitch_rate", -0.2, 0.2}, {"miss", -0.3, 0.3}}},
      {"m2",
       "from 2.2 to 5 m, a little of everything",
       {{"height", 2.2, 5},
        {"forward", 0, 5},
        {"pitch_rate", -0.5, 2},
        {"lateral", -0.5, 0.5},
        {"roll_rate", -0.5, 0.5},
        {"yaw_rate", -0.5, 0.5},
        {"miss", -0.3, 0.3},
        {"roll", -0.3, 0.3},
        {"yaw", -0.3, 0.3}}},
      {"m3",
       "from 2.2 to 8 m with large spins",
       {{"height", 2.2, 8},
        {"forward", -1, 6},
        {"pitch_rate", -1, 4},
        {"lateral", -1, 1},
        {"roll_rate", -1, 1},
        {"yaw_rate", -2, 2},
        {"miss", -0.3, 0.3},
        {"roll", -0.3, 0.3},
        {"yaw", -0.3, 0.3}}},
      // Arms overhead, a person turns 0.83 times as fast as with hanging ones: 1 to 5 rad/s then.
      {"hands",
       "planar, hands first, from 2 to 6 m",
       {{"height", 2, 6},
        {"forward", 2, 6},
        {"pitch_rate", 1.2, 6},
        {"miss", -0.3, 0.3},
        {"hands", 1, 1}}},
  };
  return kSets;
}

const FallSet& findFallSet(const std::string& name) {
  std::vector<std::string> names;
  for (const FallSet& set : fallSets()) {
    if (set.name == name) return set;
    names.push_back(set.name);
  }
  throw InputError(fmt::format("no set of falls named \"{}\".{} Known: {}", name,
                               didYouMean(name, names), join(names)));
}

std::vector<VectorXd> drawFalls(const skill::Skill& skill, const FallSet& set, int count,
                                std::uint64_t seed) {
  std::vector<VectorXd> all(static_cast<size_t>(count), skill.initialConditions());
  for (size_t r = 0; r < set.ranges.size(); ++r) {
    const FallSet::Range& range = set.ranges[r];
    const auto found = std::find_if(skill.conditions.begin(), skill.conditions.end(),
                                    [&](const ParamSpec& c) { return c.name == range.condition; });
    if (found == skill.conditions.end() || range.min < found->min || range.max > found->max) {
      throw InputError(fmt::format("{}: expected a condition \"{}\" whose range holds [{}, {}]",
                                   skill.file.string(), range.condition, range.min, range.max));
    }
    for (size_t k = 0; k < all.size(); ++k) {
      all[k][found - skill.conditions.begin()] = Random(seed, k, r).uniform(range.min, range.max);
    }
  }
  return all;
}

Faller::Faller(Way way) : way_(std::move(way)), runner_(way_.skill), judge_(way_.skill->model) {
  runner_.meddledWith(way_.meddling);
}

Fall Faller::fall(const VectorXd& conditions, const std::optional<sim::State>& start,
                  sim::Recording* recording) {
  const double task = way_.skill->task.initial;
  runner_.watchedBy({&judge_}, true);
  runner_.under(conditions);
  runner_.beginsAt(start);
  Fall fall;
  fall.start = runner_.start(way_.parameters, task);
  fall.rollout = runner_.run(way_.parameters, task, recording);
  fall.verdict = judge_.verdict();
  return fall;
}

sim::State Faller::start(const VectorXd& conditions) {
  runner_.under(conditions);
  runner_.beginsAt({});
  return runner_.start(way_.parameters, way_.skill->task.initial);
}

std::vector<Fall> fallAll(const Way& way, std::span<const VectorXd> conditions,
                          const Execution& how, std::span<const sim::State> starts) {
  std::vector<Fall> falls(conditions.size());
  ThreadPool pool(how.threads);
  Lender<Faller> fallers([&] { return std::make_unique<Faller>(way); });
  std::mutex mutex;
  pool.forEach(static_cast<int>(conditions.size()), [&](int n) {
    if (how.stop.stop_requested()) return;
    const auto k = static_cast<size_t>(n);
    fallers.with([&](Faller& faller) {
      falls[k] = faller.fall(conditions[k],
                             starts.empty() ? std::nullopt : std::optional<sim::State>(starts[k]));
    });
    const std::lock_guard lock(mutex);
    if (how.on_done) how.on_done();
  });
  return falls;
}

std::vector<Fall> fallAgain(const Way& way, std::span<const Fall> falls, const Execution& how) {
  std::vector<sim::State> starts;
  for (const Fall& f : falls) starts.push_back(f.start);
  return fallAll(way, std::vector<VectorXd>(falls.size()), how, starts);
}

namespace {

/// Wilson's interval with z of 95 %.
double wilson(int of, int all, double sign) {
  static constexpr double kZ = 1.959963984540054;
  if (all == 0) return sign < 0 ? 0 : 1;
  const double n = all;
  const double p = of / n;
  const double half = kZ * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  return std::clamp((p + kZ * kZ / (2 * n) + sign * half) / (1 + kZ * kZ / n), 0.0, 1.0);
}

}  // namespace

double Share::low() const {
  return wilson(of, all, -1);
}

double Share::high() const {
  return wilson(of, all, 1);
}

}  // namespace traceur::landing
