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
      skill_(&skill) {}

const double* Places::find(Scope scope, const std::string& name) {
  if (const auto i = placeOf(skill_->parameters, name)) return &parameters[*i];
  if (name == "task") {
    task_moves = task_moves || scope != Scope::kVerdict;
    return &task;
  }
  if (name == "horizon") return &horizon;
  if (scope == Scope::kSetup) return nullptr;
  if (name == "time") return &time;
  if (scope == Scope::kRunning) return name == "phase_time" ? &phase_time : signals.find(name);
  if (const auto i = placeOf(skill_->measures, name)) return &measures[*i];
  if (const auto i = placeOf(skill_->failures, name)) return &failed[*i];
  return nullptr;
}

control::Expression::Lookup Places::in(Scope scope) {
  return [this, scope](const std::string& name) { return find(scope, name); };
}

}  // namespace traceur::skill
