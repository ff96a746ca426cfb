#include "traceur/skill/skill_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/core/text.h"
#include "traceur/optim/cost.h"

namespace traceur::skill {

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, double task)
    : skill_(std::move(skill)), task_(task) {}

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, double task, int draws,
                           std::uint64_t seed)
    : skill_(std::move(skill)), task_(task), draws_(draws), seed_(seed) {
  if (draws > 0 && skill_->conditions.empty()) {
    throw InputError(fmt::format("{}: it has no [conditions] to draw from", skill_->name));
  }
}

SkillProblem::SkillProblem(std::shared_ptr<const Skill> skill, VectorXd tasks)
    : skill_(std::move(skill)), tasks_(std::move(tasks)), task_(tasks_[0]) {
  const bool moves = runners_.with([](const Runner& r) { return r.motionDependsOnTask(); });
  if (moves) {
    throw InputError(fmt::format(
        "{}: \"task\" stands elsewhere than in costs and \"achieved\", so that one trial cannot be "
        "scored for several tasks; let the cost alone depend on it",
        skill_->name));
  }
  if (!runners_.with([](const Runner& r) { return r.costDependsOnTask(); })) {
    throw InputError(
        fmt::format("{}: no cost depends on \"task\": all tasks would be one", skill_->name));
  }
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
  if (draws_ > 0) return evaluateIn(0, x);
  return runners_.with([&](Runner& runner) {
    const Rollout rollout = runner.run(x, task_);
    optim::Evaluation evaluation{rollout.cost, rollout.violated, rollout.diverged, {}};
    if (tasks_.size() > 0 && !rollout.diverged) {
      for (const double task : tasks_) evaluation.task_costs.push_back(runner.costOf(task));
      evaluation.cost =
          optim::meanCost(Eigen::Map<const VectorXd>(evaluation.task_costs.data(), tasks_.size()));
    }
    return evaluation;
  });
}

optim::Evaluation SkillProblem::evaluateIn(int round, const VectorXd& x) const {
  const auto all = drawnConditions(*skill_, round == 0 ? kJudged * draws_ : draws_, seed_, round);
  std::vector<int> violated(skill_->failures.size());
  VectorXd costs(static_cast<Eigen::Index>(all.size()));
  bool diverged = false;
  runners_.with([&](Runner& runner) {
    for (size_t k = 0; k < all.size(); ++k) {
      runner.under(all[k]);
      const Rollout r = runner.run(x, task_);
      costs[static_cast<Eigen::Index>(k)] = r.cost;
      diverged = diverged || r.diverged;
      for (size_t i = 0; i < violated.size(); ++i) violated[i] += r.violated[i];
    }
    runner.under({});
  });
  optim::Evaluation evaluation{optim::meanCost(costs), {}, diverged, {}};
  for (const int times : violated) {
    evaluation.violated.push_back(2 * times > static_cast<int>(all.size()));
  }
  return evaluation;
}

std::shared_ptr<const Skill> underGiven(std::shared_ptr<const Skill> skill,
                                        const std::vector<std::string>& given) {
  if (given.empty()) return skill;
  auto under = std::make_shared<Skill>(*skill);
  std::vector<std::string> names;
  for (const ParamSpec& c : under->conditions) names.push_back(c.name);
  for (const std::string& text : given) {
    const size_t is = text.find('=');
    if (is == std::string::npos) {
      throw InputError(
          fmt::format("given {}: expected NAME=VALUE or NAME=MIN:MAX, as height=2:5", text));
    }
    const std::string name = text.substr(0, is);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      throw InputError(fmt::format("given {}: {} has no condition \"{}\".{} It has: {}", text,
                                   skill->name, name, didYouMean(name, names),
                                   names.empty() ? "none" : join(names)));
    }
    const size_t c = found - names.begin();
    ParamSpec& own = under->conditions[c];
    const size_t to = text.find(':', is);
    const double least = toNumber(text.substr(is + 1, to - is - 1), "given " + text);
    const double most =
        to == std::string::npos ? least : toNumber(text.substr(to + 1), "given " + text);
    if (!(own.min <= least && least <= most && most <= own.max)) {
      throw InputError(fmt::format("given {}: expected a range within [{}, {}]{}{}", text, own.min,
                                   own.max, own.unit.empty() ? "" : " ", own.unit));
    }
    under->drawn[c] = {least, most};
    own.initial = std::clamp(own.initial, least, most);
  }
  return under;
}

std::vector<VectorXd> drawnConditions(const Skill& skill, int count, std::uint64_t seed,
                                      int round) {
  std::vector<VectorXd> all(static_cast<size_t>(count), skill.initialConditions());
  for (size_t c = 0; c < skill.conditions.size(); ++c) {
    const auto [least, most] = skill.drawn[c];
    Random random(seed, static_cast<std::uint64_t>(round), c);
    std::vector<int> part(all.size());
    std::iota(part.begin(), part.end(), 0);
    for (size_t k = part.size(); k > 1; --k) std::swap(part[k - 1], part[random.below(k)]);
    for (size_t k = 0; k < all.size(); ++k) {
      const double share = (part[k] + random.uniform()) / count;
      all[k][static_cast<Eigen::Index>(c)] = least + share * (most - least);
    }
  }
  return all;
}

}  // namespace traceur::skill
