// Practising a skill into a run file, for one task or for a range of them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "traceur/practice/learned.h"
#include "traceur/practice/search.h"

namespace traceur::practice {

/// Trials per generation of one task: even, for two threads; the dissertation's λ [Ha2015, §7.4].
inline constexpr int kPopulation = 16;

/// Conditions that a trial of a skill that has any is tried in [ours].
inline constexpr int kDraws = 8;

/// How a skill is practised unless told otherwise.
/// @param tasks  of a family; empty: for one task
SearchOptions learningOptions(const VectorXd& tasks = {});

/// @throws InputError for a task outside the skill's range
void requireInRange(const skill::Skill& skill, double task);

/// Keeps one trial in a run file of its own, to be looked at, exported or begun from.
/// @param r, recording  what performing it gave
/// @throws InputError when the file exists
void keep(const LearnedSkill& what, const skill::Rollout& r, const sim::Recording& recording,
          const std::filesystem::path& file);

/// What practice came to.
struct Learned {
  optim::Summary summary;
  std::optional<skill::Rollout> best = {};   ///< of one task: the best trial, once there is one
  std::optional<optim::Family> family = {};  ///< of a family: the best curve, likewise
  std::optional<bool> reached = {};          ///< the task; of a family the skill's target_cost
  std::optional<Beginning> beginning = {};   ///< with SearchOptions::from
};

/// Searches the skill's parameters until its target_cost, the budget or the optimiser's end, from
/// the beginning or, with resume, from where the file stands. The run then holds what it ended with
/// and, of one task, the best trial's recording.
/// @param task  of one task; a family's are in the options
/// @throws InputError for tasks outside the skill's range, options that do not suit it or each
/// other,
///         and as Run::begin; nothing is left of a file that it has made then
Learned learn(const std::shared_ptr<const skill::Skill>& skill, double task,
              const SearchOptions& options, const std::filesystem::path& file, bool resume,
              const Execution& how);

}  // namespace traceur::practice
