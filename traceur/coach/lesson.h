// Practising a script: each phase from where the one before it ended.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "traceur/coach/compile.h"
#include "traceur/optim/minimise.h"
#include "traceur/practice/run.h"

namespace traceur::coach {

struct LessonOptions {
  std::uint64_t seed = 1;
  std::optional<int> budget = {};  ///< instead of the script's
  bool resume = false;
  /// Another script's folder: a phase of the same number and name begins with what was found there.
  std::filesystem::path from = {};
  /// The last phase ends with its first trial that succeeds.
  bool until_it_succeeds = false;
  int threads = 0;  ///< 0: one for each processor; changes no result
  std::stop_token stop = {};
  /// Of a phase: its name, its trials in all, and how far the search is.
  std::function<void(const std::string&, int, const optim::Progress&)> on_progress = {};
};

/// What came of a phase.
struct PhaseLesson {
  std::string phase;
  std::filesystem::path skill, run;
  std::vector<Reading> readings;
  int trials = 0;
  double cost = 0;
  std::string ended;  ///< how the best trial ended
  bool failed = false;
  double time = 0;                                    ///< when [s]
  std::vector<practice::Quantity> terms, measures;    ///< of the best trial
  std::vector<std::pair<std::string, int>> failures;  ///< how many trials failed so
};

struct Lesson {
  std::vector<PhaseLesson> phases;  ///< up to the first that failed, that one included
  std::filesystem::path whole;      ///< the run of all phases; empty: not all were learned
  std::string ended;                ///< how it ended when all was done at once
  bool failed = false;
  bool interrupted = false;
  int trials = 0;
};

/// Practises a script into a folder: for each phase a skill file and a run, then one of them all.
/// With resume, what the folder has of a phase goes on. A phase that the script has changed is
/// practised anew from what was found before, which is kept beside it as "1-leaning.before.run":
/// its failures teach where not to try, where both have the same parameters and ways to fail. So
/// are those after it.
/// Equal scripts and seeds give equal bits for any number of threads, and after a resume.
/// @throws InputError for what cannot be compiled, a `from` that has none of its phases, and as
/// practice::learn
Lesson practise(const Script& script, const std::filesystem::path& folder,
                const LessonOptions& options);

}  // namespace traceur::coach
