// Falls by lot: how often a landing succeeds.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
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

/// One fall, judged.
struct Fall {
  Verdict verdict;
  skill::Rollout rollout;
};

/// Falls under the conditions, with the parameters, on so many threads; the result does not depend
/// on them.
/// @param told  called after each fall, from any thread, one at a time
std::vector<Fall> fallAll(const std::shared_ptr<const skill::Skill>& skill,
                          const VectorXd& parameters, std::span<const VectorXd> conditions,
                          int threads, const std::function<void(size_t done)>& told = {});

/// A share and its 95 % interval [Wilson1927].
struct Share {
  int of = 0, all = 0;
  double value() const { return all > 0 ? static_cast<double>(of) / all : 0; }
  double low() const;
  double high() const;
};

}  // namespace traceur::landing
