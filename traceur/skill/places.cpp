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
    : parameters(skill.parameters.size()),
      horizon(skill.horizon),
      measures(skill.measures.size()),
      failed(skill.failures.size()),
      signals(skill.model),
      in_stage(skill.stageNames().size()),
      ended_stage(in_stage.size()),
      skill_(&skill) {}

const double* Places::findStage(const std::string& name) {
  const std::vector<std::string> stages = skill_->stageNames();
  for (size_t i = 0; i < stages.size(); ++i) {
    if (name == "in." + stages[i]) return &in_stage[i];
    if (name == "ended." + stages[i]) return &ended_stage[i];
  }
  return nullptr;
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
    if (const double* stage = findStage(name)) return stage;
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
         std::any_of(parts.begin(), parts.end(), [&](auto* p) { return p->isMeasure(place); });
}

control::Expression::Lookup Places::in(Scope scope) {
  return [this, scope](const std::string& name) { return find(scope, name); };
}

}  // namespace traceur::skill
