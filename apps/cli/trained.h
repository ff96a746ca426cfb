// A learning run as its file holds it: what was asked, how far it got, what it found.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "traceur/core/run_file.h"
#include "traceur/optim/minimise.h"
#include "traceur/sim/recording.h"
#include "traceur/skill/skill.h"

namespace traceur::cli {

/// The options that decide a run's bits. Threads are not among them.
struct LearnOptions {
  std::string skill_file;
  double task = 0;
  std::uint64_t seed = 1;
  int budget = 2000;
  std::string optimiser = "cma-es";
  int population = 16;     ///< even, for two threads; the dissertation's λ [Ha2015, §7.4]
  double step_size = 0.2;  ///< first standard deviation, as a fraction of each range [ours]
};

RunFile::Meta toMeta(const LearnOptions& options, const skill::Skill& skill);

/// @throws InputError naming the first option that differs from the stored one. The budget may
/// grow.
void requireSameOptions(const RunFile& run, const RunFile::Meta& asked);

/// The stored trials as a state to resume from.
optim::Progress progressOf(const RunFile& run, const std::vector<std::string>& constraints);

/// A value stored by toMeta or while learning.
/// @throws InputError when the run does not have it
std::string required(const RunFile& run, const std::string& key);

/// The best trial's recording.
/// @throws InputError when the run was cut off before it had one
sim::Recording bestRecording(const RunFile& run);

}  // namespace traceur::cli
