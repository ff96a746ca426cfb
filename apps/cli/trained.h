// A learning run as its file holds it: what was asked, how far it got, what it found.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/cli/search.h"
#include "traceur/sim/recording.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::cli {

/// Trials per generation of one task: even, for two threads; the dissertation's λ [Ha2015, §7.4].
inline constexpr int kPopulation = 16;

/// The options that decide a run's bits. Threads are not among them.
struct LearnOptions {
  std::string skill_file;
  double task = 0;
  std::string tasks;  ///< "FIRST:LAST:COUNT": a family is learned; "" for one task
  std::string curve;  ///< of a family: "linear" or "cubic"
  std::uint64_t seed = 1;
  int budget = 2000;
  std::string optimiser;   ///< "": cma-es, of a family contextual
  std::string experience;  ///< a run file whose failures teach the optimiser; "" for none
  int population = -1;  ///< trials per generation; -1: kPopulation, of a family the optimiser's own
  double step_size = skill::kStepSize;
};

RunFile::Meta toMeta(const LearnOptions& options, const skill::Skill& skill);

/// The skill a run has practised, on the robot it has practised with.
/// @throws InputError when the robot is not found, or has changed since
std::shared_ptr<const skill::Skill> skillOf(const RunFile& run);

/// The best trial's recording.
/// @throws InputError when the run was cut off before it had one
sim::Recording bestRecording(const RunFile& run);

}  // namespace traceur::cli
