// A family of skills as a run file holds it: a curve of parameters over a range of tasks.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "traceur/core/run_file.h"
#include "traceur/optim/family.h"
#include "traceur/sim/recording.h"
#include "traceur/skill/skill.h"

namespace traceur::cli {

/// A learnt family and what is needed to perform it.
struct FamilyRun {
  std::shared_ptr<const skill::Skill> skill;
  Eigen::VectorXd tasks;  ///< (M) trained
  optim::Family family;
  Eigen::VectorXd lower, upper;  ///< (n) the skill's ranges

  /// (n) the parameters for a task, in the order and units of Skill::parameters.
  /// @throws InputError naming the option for a task outside the trained range
  Eigen::VectorXd at(double task) const;
};

/// Meta "family": a JSON object with `kind` ("bezier" or "polyline"), `points` (K lists of n
/// numbers), `folded` (whether x is the curve folded into the skill's ranges, or the curve itself),
/// `cost` and `task_costs`.
std::string toText(const optim::Family& family);

/// What that meta says, by itself: its skill need not be found.
struct StoredFamily {
  Eigen::VectorXd tasks;  ///< (M) trained
  optim::Family family;   ///< its curve's bounds are not set
  bool folded = false;
};

/// @throws InputError when the run has no such meta, or another than toText() gives
StoredFamily storedFamily(const RunFile& run);

/// @throws InputError when the run is not one of a family, or has found none yet
FamilyRun readFamily(const RunFile& run);

/// The motion of a run to look at: of a family what it does for the task, else the best trial.
/// @throws InputError for a family without a task, a task without a family, and as bestRecording
sim::Recording recordingOf(const RunFile& run, const std::optional<double>& task);

/// @throws InputError for a skill that does not say what a trial achieved
void requireAchieved(const skill::Skill& skill);

/// What is made of a run, in its folder: "a/jump.run" and "-sweep.csv" give "a/jump-sweep.csv".
std::filesystem::path beside(const std::filesystem::path& run, const std::string& ending);

}  // namespace traceur::cli
