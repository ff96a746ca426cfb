#include "traceur/practice/learn.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/optim/cost.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::practice {
namespace {

using skill::Skill;
using skill::SkillProblem;

void check(const Skill& skill, double task, const SearchOptions& o) {
  if (o.draws > 0 && o.tasks.size() > 0) {
    throw InputError("draws: a family's trials are all under the skill's initial conditions");
  }
  if (o.tasks.size() == 0) {
    if (!o.curve.empty()) throw InputError("a curve is for a family: expected tasks");
    return requireInRange(skill, task);
  }
  if (!o.experience.empty()) {
    throw InputError("experience: families do not learn from violated constraints");
  }
  if (!(skill.task.min < skill.task.max)) {
    throw InputError(fmt::format("tasks: {} has no [task] with a range to learn a family for",
                                 skill.file.string()));
  }
  requireInRange(skill, o.tasks[0]);
  requireInRange(skill, o.tasks[o.tasks.size() - 1]);
}

RunMeta metaOf(const Skill& skill, double task, const SearchOptions& options,
               const ParamSpecs& parameters, const optim::Problem& problem) {
  return {.search = options,
          .parameters = parameters,
          .constraints = problem.constraints(),
          .skill = SkillInRun{.name = skill.name,
                              .file = skill.file.string(),
                              .text = skill.text,
                              .robot = skill.model->fingerprint(),
                              .parts = partsOf(skill),
                              .engine = sim::engineVersion(),
                              .task = task,
                              .task_unit = skill.task.unit}};
}

/// Stores what a trial did, and its recording, as what the search ended with.
void record(Run& run, const LearnedSkill& what, const skill::Rollout& r,
            const sim::Recording& recording, const std::string& stop) {
  run.file().putRecording("best", recording.encode());
  Outcome o{.stop = stop, .ended = r.ended};
  if (!what.skill->task.achieved.empty()) o.achieved = r.achieved;
  o.reached = reached(what.skill->task, what.task, r);
  o.hash = r.hash;
  o.objectives = objectivesOf(*what.skill, r);
  o.measures = measuresOf(*what.skill, r);
  run.setOutcome(o);
}

}  // namespace

void requireInRange(const Skill& skill, double task) {
  if (task >= skill.task.min && task <= skill.task.max) return;
  throw InputError(fmt::format("task {} {}: {} asks for {} within [{}, {}]", task, skill.task.unit,
                               skill.name, skill.task.name, skill.task.min, skill.task.max));
}

void keep(const LearnedSkill& what, const skill::Rollout& r, const sim::Recording& recording,
          const std::filesystem::path& file) {
  const SkillProblem problem(what.skill, what.task);
  const SearchOptions one{.budget = 1, .population = 1, .step_size = skill::kStepSize};
  Run run =
      Run::begin(file, metaOf(*what.skill, what.task, one, what.skill->parameters, problem), false);
  const bool failed = r.diverged || !optim::isCost(r.cost);
  const optim::Trial trial{
      what.parameters,
      {failed ? std::numeric_limits<double>::infinity() : r.cost, r.violated, failed, {}}};
  run.append(0, {&trial, 1}, "", {});
  record(run, what, r, recording, words({"tried", 1, 1}));
}

SearchOptions learningOptions(const VectorXd& tasks) {
  const bool family = tasks.size() > 0;
  return {.optimiser = family ? "contextual" : "cma-es",
          .population = family ? 0 : kPopulation,
          .step_size = skill::kStepSize,
          .tasks = tasks,
          .curve = family ? "linear" : ""};
}

Learned learn(const std::shared_ptr<const Skill>& as_written, double task,
              const SearchOptions& options, const std::filesystem::path& file, bool resume,
              const Execution& how) {
  const auto skill = skill::underGiven(as_written, options.given);
  check(*skill, task, options);
  const bool family = options.tasks.size() > 0;
  const SkillProblem problem = family ? SkillProblem(skill, options.tasks)
                                      : SkillProblem(skill, task, options.draws, options.seed);
  Learned learned;
  ParamSpecs parameters = problem.parameters();
  if (!options.from.empty()) {
    const double nearest = family ? options.tasks[options.tasks.size() / 2] : task;
    learned.beginning = beginningFrom(Run::open(options.from), parameters, nearest);
    parameters = learned.beginning->parameters;
  }
  // A skill's cost says itself what a failure costs.
  const auto optimiser = optimiserFor(problem, initialOf(parameters), options, false);
  Run run =
      Run::begin(file, metaOf(*skill, family ? 0 : task, options, parameters, problem), resume);
  learned.summary = search(run, problem, *optimiser, skill->target_cost, how);
  const auto& best = learned.summary.progress.best;
  if (family) {
    learned.family = optimiser->family();
    if (std::isfinite(skill->target_cost) && learned.family) {
      learned.reached = learned.family->cost <= skill->target_cost;
    }
  }
  if (!family && best) {
    const LearnedSkill what{skill, task, best->x};
    sim::Recording recording;
    learned.best = what.perform(&recording);
    record(run, what, *learned.best, recording, words(learned.summary.stop));
    learned.reached = reached(skill->task, task, *learned.best);
  } else if (best || learned.summary.end != optim::End::kInterrupted) {
    run.setOutcome({.stop = words(learned.summary.stop), .reached = learned.reached});
  }
  return learned;
}

}  // namespace traceur::practice
