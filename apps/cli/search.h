// A search into a run file: begun, resumed, shown as it goes.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "traceur/core/run_file.h"
#include "traceur/optim/minimise.h"

namespace traceur::cli {

/// Makes the run file, or opens it to go on.
/// @param meta  every option that decides the run's bits; "budget" may grow
/// @throws InputError when the file exists and resume is not set, or was made with other options
RunFile openRun(const std::string& file, const RunFile::Meta& meta, bool resume);

struct SearchOptions {
  std::string title;  ///< begins the progress line
  int threads = 0;
  int budget = 0;
  double target = -std::numeric_limits<double>::infinity();
  std::stop_token stop;
  std::function<void(const optim::Broken&)> on_broken = {};  ///< see optim::MinimiseOptions
  bool quiet = false;
};

/// Runs minimise() from where the file stands, storing every generation in it. Of a run that was
/// begun here and ends with an exception before a trial gave a cost, no file is left.
optim::Summary search(RunFile& run, const optim::Problem& problem, optim::Optimizer& optimiser,
                      const SearchOptions& options);

/// The meta rows and, with the recording "best", what a search ended with. The first generation
/// after them makes them outdated, and search() takes them out.
const std::vector<std::string>& outcomeKeys();

/// Whether a stored trial violated the constraint of this name.
bool violates(const TrialRow& row, const std::string& name);

/// The stored trials as a state to resume from.
optim::Progress progressOf(const RunFile& run, const std::vector<std::string>& constraints);

/// The trials of an earlier run, to learn from where constraints are violated.
/// @param file         "" for none
/// @param optimiser    of the search at hand
/// @param parameters   of the search at hand, as its run file names them
/// @param constraints  its constraints. What is learnt from are those at the front that the earlier
///                     run knew by the same name; new ones come after
/// @throws InputError for an optimiser that does not learn from it, a file that is no run, or one
/// with other variables or constraints
std::vector<optim::Trial> experienceOf(const std::string& file, const std::string& optimiser,
                                       const std::string& parameters,
                                       const std::vector<std::string>& constraints);

/// A value stored in meta.
/// @throws InputError when the run does not have it
std::string required(const RunFile& run, const std::string& key);

/// "target (2.1e-05, limit 0.0004)": why a search ended.
std::string words(const optim::Stop& stop);

}  // namespace traceur::cli
