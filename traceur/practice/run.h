// A run: a search and what it found, on disk. What the rows of a run file's meta say is written and
// read here; but for skill/part_source.cpp, where a run's best trial is a part of another skill.
// The tables stand in traceur/core/run_file.h.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "traceur/core/param.h"
#include "traceur/core/run_file.h"
#include "traceur/optim/minimise.h"
#include "traceur/sim/recording.h"

namespace traceur::practice {

using Eigen::VectorXd;

/// What is asked of a search. All of it decides the run's bits.
struct SearchOptions {
  std::uint64_t seed = 1;
  int budget = 2000;            ///< trials in all; the only one that may grow when resumed
  std::string optimiser = {};   ///< of optim::allOptimizers()
  int population = 0;           ///< trials per generation; 0: the optimiser's own
  double step_size = 0.3;       ///< as optim::CommonOptions::sigma
  VectorXd tasks = {};          ///< (M) rising, evenly spaced: a family; empty: one task
  std::string curve = {};       ///< of a family: "linear" or "cubic"
  std::string experience = {};  ///< a run file whose failures teach the optimiser; "" for none
  std::string from = {};        ///< a run file where the search begins; "" for none
  /// Of one task: the parameters that are searched, by name or a shell's pattern, "squat_*"; the
  /// others stay where they begin. Empty: all.
  std::vector<std::string> only = {};
  /// Of a skill with conditions: other ranges for them, as skill::underGiven reads them.
  std::vector<std::string> given = {};
  int draws = 0;  ///< drawn conditions that each trial is tried in; 0: the initial ones alone
};

/// What was searched, besides numbers: a skill's parameters …
struct SkillInRun {
  std::string name, file, text;  ///< skill::Skill's
  std::uint64_t robot = 0;       ///< fingerprint of its model
  std::uint64_t parts = 0;       ///< of the texts of the skills it is made of; 0: of none
  std::string engine;            ///< version that ran it
  double task = 0;               ///< of one task; 0 for a family
  std::string task_unit;
};
/// … or the arguments of another program.
struct CommandInRun {
  std::string command;    ///< and its arguments
  std::string variables;  ///< as they were asked for
};

/// What a run is. Exactly one of skill and command is there.
struct RunMeta {
  std::string traceur = {};  ///< version that began it
  SearchOptions search = {};
  ParamSpecs parameters = {};  ///< x; of files of before, whose text has no bounds, infinite ones
  std::vector<std::string> constraints = {};
  std::optional<SkillInRun> skill = {};
  std::optional<CommandInRun> command = {};
};

/// A number that has a name and a unit.
struct Quantity {
  std::string name;
  double value = 0;  ///< NaN: nothing was there to measure
  std::string unit;  ///< "": none, or not known
};

/// What a search ended with. All but `stop` is of the best trial for one task: a family has none.
struct Outcome {
  std::string stop;                     ///< why it ended, in words
  std::string ended = {};               ///< how the trial ended
  std::optional<double> achieved = {};  ///< in the task's unit; none for a skill that does not say
  std::optional<bool> reached = {};  ///< within tolerance; none as before, and in files of before
  std::uint64_t hash = 0;            ///< skill::Rollout::hash
  std::vector<Quantity> objectives = {}, measures = {};  ///< none in files of before
};

/// How the best curve's mean cost fell.
struct FamilyCost {
  int trials = 0;   ///< after so many …
  double cost = 0;  ///< … it was this
};

/// "push [N]", or the name alone where there is no unit.
std::vector<std::string> namesWithUnits(const ParamSpecs& parameters);

/// "target (2.1e-05, limit 0.0004)": why a search ended.
std::string words(const optim::Stop& stop);

class Run {
 public:
  /// Makes the file or, asked to resume, goes on with the one that is there; of that, all that
  /// decides bits must be as asked, but for the budget, which may grow.
  /// @throws InputError when the file exists and is not to be resumed, or was asked for otherwise
  static Run begin(const std::filesystem::path& file, const RunMeta& meta, bool resume);
  /// To look at.
  /// @throws InputError as RunFile::open, and for meta that is not a run's
  static Run open(const std::filesystem::path& file);

  const RunMeta& meta() const { return meta_; }
  /// As it begins a message.
  std::string name() const { return file_.path().string(); }
  bool isFamily() const { return meta_.search.tasks.size() > 0; }
  RunFile& file() { return file_; }
  const RunFile& file() const { return file_; }

  /// The trials as a state to resume from.
  optim::Progress progress() const;
  std::vector<optim::Trial> trials() const;

  /// Stores a generation, all or nothing.
  /// @param state     of the optimiser, to resume from
  /// @param progress  familyRows()
  void append(int generation, std::span<const optim::Trial> trials, std::string_view state,
              const RunFile::Meta& progress);

  /// None while the search has not ended.
  std::optional<Outcome> outcome() const;
  void setOutcome(const Outcome& outcome);
  /// Takes out what another generation makes outdated: the outcome and the best trial's recording.
  void forgetOutcome();

  /// The best curve, of which the bounds are not set, and whether it folds into the parameters'
  /// box; none before there is one.
  /// @throws InputError for one that cannot be read
  std::optional<std::pair<optim::Family, bool>> family() const;
  std::vector<FamilyCost> familyCosts() const;

  /// The best trial's recording.
  /// @throws InputError when there is none, with the reason
  sim::Recording recording() const;

 private:
  Run(RunFile file, RunMeta meta) : file_(std::move(file)), meta_(std::move(meta)) {}

  RunFile file_;
  RunMeta meta_;
};

/// The row that the best trial is kept in where it is none of those stored, as of a problem that
/// draws.
RunFile::Meta bestRow(const optim::Trial& best);

/// The rows that a family's progress is kept in.
RunFile::Meta familyRows(const optim::Family& family, const std::vector<FamilyCost>& costs);

}  // namespace traceur::practice
