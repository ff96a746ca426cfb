// Falls by lot: how often a landing succeeds.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "traceur/landing/judge.h"
#include "traceur/skill/rollout.h"

namespace traceur::landing {

/// Ranges that falls are drawn from, by the names of a landing skill's [conditions]; what is not
/// named has its default.
struct FallSet {
  struct Range {
    std::string condition;
    double min = 0, max = 0;
  };
  std::string name;
  std::string help;
  std::vector<Range> ranges;
};

/// The sets that landings are measured on.
const std::vector<FallSet>& fallSets();
/// @throws InputError "no set of falls named …" with a suggestion
const FallSet& findFallSet(const std::string& name);

/// (count) conditions of a landing skill, fall k drawn by (seed, k).
/// @throws InputError for a set that names a condition which the skill lacks, or leaves its range
std::vector<VectorXd> drawFalls(const skill::Skill& skill, const FallSet& set, int count,
                                std::uint64_t seed);

/// A way to meet a fall: a skill with its numbers; and what happens on the way.
struct Way {
  std::shared_ptr<const skill::Skill> skill;
  VectorXd parameters;
  skill::Meddling meddling = {};
};

/// One fall, judged.
struct Fall {
  sim::State start;
  Verdict verdict;
  skill::Rollout rollout;
};

/// One thread's workspace for falls; made once, used for many.
class Faller {
 public:
  /// @throws InputError for a robot without the groups that a Judge looks at
  explicit Faller(Way way);

  /// @param conditions  of the skill; empty: its initial ones
  /// @param start       where it begins; none: where the skill says
  /// @param recording   filled when given
  Fall fall(const VectorXd& conditions, const std::optional<sim::State>& start = {},
            sim::Recording* recording = nullptr);
  /// Where the skill says that a fall begins.
  sim::State start(const VectorXd& conditions);

 private:
  Way way_;
  skill::Runner runner_;
  Judge judge_;
};

/// How many falls are made; changes no bit of them.
struct Execution {
  int threads = 0;                     ///< 0: one for each processor
  std::stop_token stop = {};           ///< asked, falls not begun are left out: as they were made
  std::function<void()> on_done = {};  ///< after each fall, one at a time
};

/// @param conditions  one of each fall; empty: the skill's initial ones
/// @param starts      where the falls begin; none: where the skill says
std::vector<Fall> fallAll(const Way& way, std::span<const VectorXd> conditions,
                          const Execution& how, std::span<const sim::State> starts = {});

/// The same falls, in another way.
std::vector<Fall> fallAgain(const Way& way, std::span<const Fall> falls, const Execution& how);

/// A share and its 95 % interval [Wilson1927].
struct Share {
  int of = 0, all = 0;
  double value() const { return all > 0 ? static_cast<double>(of) / all : 0; }
  double low() const;
  double high() const;
};

}  // namespace traceur::landing
