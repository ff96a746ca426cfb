#include "traceur/skill/skill_problem.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/optim/cost.h"

namespace traceur::skill {

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, double task)
    : skill_(std::move(skill)), task_(task) {}

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, VectorXd tasks)
    : skill_(std::move(skill)), tasks_(std::move(tasks)), task_(tasks_[0]) {
  Runner runner(skill_);
  if (runner.motionDependsOnTask()) {
    throw InputError(fmt::format(
        "{}: \"task\" stands elsewhere than in costs and \"achieved\", so that one trial cannot be "
        "scored for several tasks; let the cost alone depend on it",
        skill_->name));
  }
  if (!runner.costDependsOnTask()) {
    throw InputError(
        fmt::format("{}: no cost depends on \"task\": all tasks would be one", skill_->name));
  }
  idle_.push_back(std::move(runner));
}

ParamSpecs SkillProblem::parameters() const {
  return skill_->parameters;
}

VectorXd SkillProblem::lower() const {
  return lowerOf(skill_->parameters);
}

VectorXd SkillProblem::upper() const {
  return upperOf(skill_->parameters);
}

std::vector<std::string> SkillProblem::constraints() const {
  std::vector<std::string> names;
  for (const Failure& f : skill_->failures) names.push_back(f.name);
  return names;
}

optim::Evaluation SkillProblem::evaluate(const VectorXd& x) const {
  std::unique_lock lock(mutex_);
  if (idle_.empty()) {
    lock.unlock();
    Runner made(skill_);
    lock.lock();
    idle_.push_back(std::move(made));
  }
  Runner runner = std::move(idle_.back());
  idle_.pop_back();
  lock.unlock();
  const Rollout rollout = runner.run(x, task_);
  optim::Evaluation evaluation{rollout.cost, rollout.violated, rollout.diverged, {}};
  if (tasks_.size() > 0 && !rollout.diverged) {
    for (const double task : tasks_) evaluation.task_costs.push_back(runner.costOf(task));
    evaluation.cost =
        optim::meanCost(Eigen::Map<const VectorXd>(evaluation.task_costs.data(), tasks_.size()));
  }
  lock.lock();
  idle_.push_back(std::move(runner));
  return evaluation;
}

}  // namespace traceur::skill
