#include "traceur/skill/skill_problem.h"

namespace traceur::skill {

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, double task)
    : skill_(std::move(skill)), task_(task) {}

VectorXd SkillProblem::lower() const {
  VectorXd x(skill_->parameters.size());
  for (size_t i = 0; i < skill_->parameters.size(); ++i) {
    x[static_cast<Eigen::Index>(i)] = skill_->parameters[i].min;
  }
  return x;
}

VectorXd SkillProblem::upper() const {
  VectorXd x(skill_->parameters.size());
  for (size_t i = 0; i < skill_->parameters.size(); ++i) {
    x[static_cast<Eigen::Index>(i)] = skill_->parameters[i].max;
  }
  return x;
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
  lock.lock();
  idle_.push_back(std::move(runner));
  return {rollout.cost, rollout.violated, rollout.diverged};
}

}  // namespace traceur::skill
