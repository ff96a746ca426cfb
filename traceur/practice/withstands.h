// What a learned skill withstands: another mass, friction, delay and noise than it was learned
// with.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "traceur/practice/learned.h"

namespace traceur::practice {

/// The kinds of disturbance, in order, and what their levels are: "delay", "control delay [ms]".
struct DisturbanceKind {
  std::string name;
  std::string level;
};
const std::vector<DisturbanceKind>& disturbanceKinds();

/// A disturbance and what became of each performance under it.
struct Withstood {
  std::string kind;  ///< one of disturbanceKinds()
  double level = 0;  ///< as that says
  skill::Disturbance disturbance;
  std::vector<skill::Rollout> rollouts = {};  ///< by performance; empty when asked to stop before
};

struct WithstandOptions {
  std::uint64_t seed = 1;  ///< of the disturbances drawn at random
  int threads = 0;         ///< 0: one for each processor; changes no result
  std::stop_token stop = {};
  /// At the beginning, and after each disturbance, one at a time.
  std::function<void(int done, int of)> on_done = {};
};

/// Performs each under each disturbance by itself, level by level, and under some drawn at random
/// of all of them together.
/// @param what  at least one, all of one skill
std::vector<Withstood> withstands(std::span<const LearnedSkill> what,
                                  const WithstandOptions& options);

}  // namespace traceur::practice
