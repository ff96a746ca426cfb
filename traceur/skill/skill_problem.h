// Practising a skill for one task, or for a range of them, as something to minimise.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "traceur/core/lender.h"
#include "traceur/optim/problem.h"
#include "traceur/skill/rollout.h"

namespace traceur::skill {

/// The first standard deviation of a search unless told otherwise, as a fraction of each
/// parameter's range [ours].
inline constexpr double kStepSize = 0.2;

/// (count) conditions of the skill, drawn evenly: of each the range is cut into as many parts as
/// there are draws, and each part has one.
std::vector<VectorXd> drawnConditions(const Skill& skill, int count, std::uint64_t seed, int round);

/// The skill under other conditions: practice draws them from there, and of none asked for the
/// initial one lies there, too.
/// @param given  each "NAME=VALUE" or "NAME=MIN:MAX", within the condition's own range
/// @throws InputError for what is not one
std::shared_ptr<const Skill> underGiven(std::shared_ptr<const Skill> skill,
                                        const std::vector<std::string>& given);

/// x are the skill's parameters in their own units; the constraints are its failures.
class SkillProblem : public optim::Problem {
 public:
  SkillProblem(std::shared_ptr<const Skill> skill, double task);
  /// Of a skill with conditions: each trial is one fall for each of `draws` drawn conditions, of
  /// which cost is the mean; a constraint is violated where more than half of them violate it.
  /// Within a round conditions are spread evenly over each range, as a Latin hypercube [McKay1979];
  /// round 0 has kJudged times as many.
  SkillProblem(std::shared_ptr<const Skill> skill, double task, int draws, std::uint64_t seed);
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
  bool draws() const override { return draws_ > 0; }
  optim::Evaluation evaluateIn(int round, const VectorXd& x) const override;

  /// [ours: less noise than a trial has, at a twelfth of a round's price for 16 candidates]
  static constexpr int kJudged = 4;

 private:
  std::shared_ptr<const Skill> skill_;
  VectorXd tasks_;  // (M); empty: only task_
  double task_ = 0;
  int draws_ = 0;
  std::uint64_t seed_ = 0;
  mutable Lender<Runner> runners_{[this] { return std::make_unique<Runner>(skill_); }};
};

}  // namespace traceur::skill
