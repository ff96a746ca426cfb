// Practising a skill for one task, or for a range of them, as something to minimise.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "traceur/optim/problem.h"
#include "traceur/skill/rollout.h"

namespace traceur::skill {

/// The first standard deviation of a search unless told otherwise, as a fraction of each
/// parameter's range [ours].
inline constexpr double kStepSize = 0.2;

/// x are the skill's parameters in their own units; the constraints are its failures.
class SkillProblem : public optim::Problem {
 public:
  SkillProblem(std::shared_ptr<const Skill> skill, double task);
  /// One trial is scored for all tasks at once.
  /// @param tasks  (M) rising, M ≥ 2
  /// @throws InputError when the skill's motion depends on the task, so that one trial cannot be
  SkillProblem(std::shared_ptr<const Skill> skill, VectorXd tasks);

  ParamSpecs parameters() const override;
  VectorXd lower() const override;
  VectorXd upper() const override;
  std::vector<std::string> constraints() const override;
  VectorXd tasks() const override { return tasks_; }
  optim::Evaluation evaluate(const VectorXd& x) const override;

 private:
  std::shared_ptr<const Skill> skill_;
  VectorXd tasks_;  // (M); empty: only task_
  double task_ = 0;
  // Runners not in use; as many as there were ever threads at once.
  mutable std::mutex mutex_;
  mutable std::vector<Runner> idle_;
};

}  // namespace traceur::skill
