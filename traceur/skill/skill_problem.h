// Practising a skill for one task, as something to minimise.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "traceur/optim/problem.h"
#include "traceur/skill/rollout.h"

namespace traceur::skill {

/// x are the skill's parameters in their own units; the constraints are its failures.
class SkillProblem : public optim::Problem {
 public:
  SkillProblem(std::shared_ptr<const Skill> skill, double task);

  VectorXd lower() const override;
  VectorXd upper() const override;
  std::vector<std::string> constraints() const override;
  optim::Evaluation evaluate(const VectorXd& x) const override;

 private:
  std::shared_ptr<const Skill> skill_;
  double task_;
  // Runners not in use; as many as there were ever threads at once.
  mutable std::mutex mutex_;
  mutable std::vector<Runner> idle_;
};

}  // namespace traceur::skill
