// What was learned, ready to be done again.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "traceur/optim/curve.h"
#include "traceur/practice/run.h"
#include "traceur/skill/rollout.h"

namespace traceur::practice {

/// Whether a trial did what was asked of it: it did not fail, and what it achieved is within the
/// task's tolerance. None for a skill that does not say what a trial achieved.
std::optional<bool> reached(const skill::Task& task, double asked, const skill::Rollout& r);

/// The terms of a trial's cost, and its measures with their units as far as they are known: the
/// file says them, or the measure is one signal alone, or 1.
std::vector<Quantity> objectivesOf(const skill::Skill& skill, const skill::Rollout& r);
std::vector<Quantity> measuresOf(const skill::Skill& skill, const skill::Rollout& r);

/// A skill with parameters for one task.
struct LearnedSkill {
  std::shared_ptr<const skill::Skill> skill;
  double task = 0;
  VectorXd parameters;       ///< (n) in the order and units of skill::Skill::parameters
  VectorXd conditions = {};  ///< in the order of skill::Skill::conditions; empty: the initial ones

  /// Does it once more: equal bits each time.
  skill::Rollout perform(sim::Recording* recording = nullptr) const;
};

/// A curve of parameters over a range of tasks.
struct LearnedFamily {
  std::shared_ptr<const skill::Skill> skill;
  VectorXd tasks;  ///< (M) trained
  optim::Family family;

  /// @throws InputError for a task outside the trained range
  LearnedSkill at(double task) const;
};

/// A fingerprint of the skills that a skill is made of, is like or starts after, and of the numbers
/// they are given; 0 for none.
std::uint64_t partsOf(const skill::Skill& skill);

/// The skill a run has practised, on the robot it has practised with.
/// @throws InputError for a run of numbers, and when the robot or a skill it is made of is not
/// found
///         or has changed since
std::shared_ptr<const skill::Skill> skillOf(const Run& run);

/// @throws InputError when the run is not one of a family or has found none yet, and as skillOf
LearnedFamily learnedFamily(const Run& run);

/// What a run has learned for a task: of a family it must be given, else it may.
/// @throws InputError for a task it was not learned for, a run without a trial that gave a cost,
/// and
///         as skillOf
LearnedSkill learnedSkill(const Run& run, std::optional<double> task = {});

/// A skill's text with what a run has learned: the parameters that it searched begin there, found
/// by their names. All else stays as it was written; a skill that is like another one gets those
/// that it did not say, first in its [parameters].
/// @param file    of the skill, for messages
/// @param digits  significant ones of each number, 1 to 17: all that there are
/// @throws InputError as learnedSkill, for a parameter that the text has not, and where the text is
///         no skill, before or after
std::string withLearned(const Run& run, std::optional<double> task, const std::string& text,
                        const std::string& file, int digits = 17);

/// The motion of a run to look at: of a family what it does for the task, else its best trial.
/// @throws InputError for a family without a task, a task without a family, and as Run::recording
sim::Recording recordingOf(const Run& run, std::optional<double> task);

/// Where a search begins that goes on from what another one found.
struct Beginning {
  ParamSpecs parameters;           ///< with new initial values
  std::vector<std::string> taken;  ///< by name, from the other run
  std::vector<std::string> moved;  ///< of those, into the bounds here
};

/// The parameters that the other run knows by name begin at its best trial's values; of a family,
/// at those for the task, or for the nearest it was learned for. The others keep their initial
/// value.
/// @throws InputError for a run that found nothing, one that knows none of the parameters or one in
///         another unit, and of a family as skillOf
Beginning beginningFrom(const Run& run, const ParamSpecs& parameters, double task);

}  // namespace traceur::practice
