#include "traceur/skill/places.h"

#include <algorithm>
#include <optional>

namespace traceur::skill {
namespace {

/// The index of the row of this name, if there is one.
std::optional<Eigen::Index> placeOf(const auto& rows, const std::string& name) {
  const auto at =
      std::find_if(rows.begin(), rows.end(), [&](const auto& row) { return row.name == name; });
  if (at == rows.end()) return std::nullopt;
  return at - rows.begin();
}

}  // namespace

Places::Places(const Skill& skill)
    : parameters(VectorXd::Zero(static_cast<Eigen::Index>(skill.parameters.size()))),
      horizon(skill.horizon),
      measures(skill.measures.size()),
      failed(skill.failures.size()),
      signals(skill.model),
      skill_(&skill) {
  const std::vector<std::string> stages = skill.stageNames();
  in_stage.resize(stages.size());
  ended_stage.resize(stages.size());
  for (size_t i = 0; i < stages.size(); ++i) {
    stages_["in." + stages[i]] = &in_stage[i];
    stages_["ended." + stages[i]] = &ended_stage[i];
  }
  forget();
}

void Places::forget() {
  time = phase_time = 0;
  for (size_t i = 0; i < measures.size(); ++i) measures[i] = skill_->measures[i].otherwise;
  std::fill(failed.begin(), failed.end(), 0.0);
  std::fill(in_stage.begin(), in_stage.end(), 0.0);
  std::fill(ended_stage.begin(), ended_stage.end(), 0.0);
  signals.begin();
  for (size_t i = 0; i < parts.size(); ++i) {
    parts[i]->forget();
    parts[i]->cost = skill_->parts[i].otherwise;
  }
}

const double* Places::findOfPart(const std::string& name) {
  for (size_t i = 0; i < parts.size(); ++i) {
    const std::string& part = skill_->parts[i].name;
    if (!name.starts_with(part + ".")) continue;
    const std::string rest = name.substr(part.size() + 1);
    return rest == "cost" ? &parts[i]->cost : parts[i]->find(Scope::kVerdict, rest);
  }
  return nullptr;
}

const double* Places::find(Scope scope, const std::string& name) {
  for (const auto& [constant, value] : skill_->constants) {
    if (constant == name) return &value;
  }
  if (scope == Scope::kConstant) return nullptr;
  if (const auto i = placeOf(skill_->parameters, name)) return &parameters[*i];
  if (name == "task") {
    task_moves = task_moves || scope != Scope::kVerdict;
    return &task;
  }
  if (name == "horizon") return &horizon;
  if (scope == Scope::kSetup) return nullptr;
  if (name == "time") return &time;
  if (scope == Scope::kRunning) {
    if (name == "phase_time") return &phase_time;
    if (const auto stage = stages_.find(name); stage != stages_.end()) return stage->second;
    return signals.find(name);
  }
  if (const auto i = placeOf(skill_->measures, name)) return &measures[*i];
  if (const auto i = placeOf(skill_->failures, name)) return &failed[*i];
  return findOfPart(name);
}

bool Places::readJointForces() const {
  return signals.readsJointForces() ||
         std::any_of(parts.begin(), parts.end(), [](auto* p) { return p->readJointForces(); });
}

bool Places::isMeasure(const double* place) const {
  return std::any_of(measures.begin(), measures.end(), [&](auto& m) { return &m == place; }) ||
         std::any_of(parts.begin(), parts.end(),
                     [&](auto* p) { return &p->cost == place || p->isMeasure(place); });
}

control::Expression::Lookup Places::in(Scope scope) {
  return [this, scope](const std::string& name) { return find(scope, name); };
}

}  // namespace traceur::skill
