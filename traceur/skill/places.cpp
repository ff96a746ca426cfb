#include "traceur/skill/places.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
      conditions(skill.initialConditions()),
      values(skill.values.size(), std::numeric_limits<double>::quiet_NaN()),
      horizon(skill.horizon),
      touch_down(touchDownNames().size()),
      measures(skill.measures.size()),
      failed(skill.failures.size()),
      signals(skill.model),
      skill_(&skill) {
  const std::vector<std::string> stages = skill.stageNames();
  in_stage.resize(stages.size());
  ended_stage.resize(stages.size());
  entered_stage.resize(stages.size());
  for (size_t i = 0; i < stages.size(); ++i) {
    stages_["in." + stages[i]] = &in_stage[i];
    stages_["ended." + stages[i]] = &ended_stage[i];
    stages_["entered." + stages[i]] = &entered_stage[i];
  }
  bound_.reserve(skill.values.size());
  for (const Value& v : skill.values) {  // each names only those before it
    bound_.emplace_back(v.expression, in(v.running ? Scope::kRunning : Scope::kSetup));
    for (const std::string& name : control::Expression::namesIn(v.expression)) {
      values_foresee = values_foresee || name.starts_with("touch_down.");
    }
  }
  forget();
}

void Places::settle() {
  for (size_t i = 0; i < values.size(); ++i) {
    if (!skill_->values[i].running) values[i] = bound_[i].value();
  }
}

void Places::look(const sim::Snapshot& s) {
  signals.update(s);
  follow();
}

void Places::follow() {
  for (size_t i = 0; i < values.size(); ++i) {
    if (skill_->values[i].running) values[i] = bound_[i].value();
  }
}

void Places::forget() {
  time = phase_time = 0;
  std::fill(touch_down.begin(), touch_down.end(), std::numeric_limits<double>::quiet_NaN());
  for (size_t i = 0; i < measures.size(); ++i) measures[i] = skill_->measures[i].otherwise;
  std::fill(failed.begin(), failed.end(), 0.0);
  std::fill(in_stage.begin(), in_stage.end(), 0.0);
  std::fill(ended_stage.begin(), ended_stage.end(), 0.0);
  std::fill(entered_stage.begin(), entered_stage.end(), 0.0);
  signals.begin();
  for (size_t i = 0; i < parts.size(); ++i) {
    parts[i]->forget();
    parts[i]->cost = skill_->parts[i].otherwise;
  }
}

const std::vector<std::string>& Places::touchDownNames() {
  static const std::vector<std::string> kNames = {
      "touch_down.time",          "touch_down.somersault", "touch_down.tilt",
      "touch_down.heading",       "touch_down.velocity.z", "touch_down.velocity.forward",
      "touch_down.velocity.left", "touch_down.spin.z",     "touch_down.spin.forward",
      "touch_down.spin.left"};
  return kNames;
}

void Places::foresee(const flight::TouchDown& t) {
  const double c = std::cos(t.turn.heading);
  const double s = std::sin(t.turn.heading);
  const auto forward = [&](const Vector3d& v) { return c * v.x() + s * v.y(); };
  const auto left = [&](const Vector3d& v) { return c * v.y() - s * v.x(); };
  touch_down = {t.time,          t.turn.somersault,   t.turn.tilt,      t.turn.heading,
                t.velocity.z(),  forward(t.velocity), left(t.velocity), t.spin.z(),
                forward(t.spin), left(t.spin)};
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
  if (const auto i = placeOf(skill_->conditions, name)) return &conditions[*i];
  if (const auto i = placeOf(skill_->values, name)) {
    if (!skill_->values[*i].running || scope == Scope::kRunning) return &values[*i];
    return nullptr;
  }
  if (name == "task") {
    task_moves = task_moves || scope != Scope::kVerdict;
    return &task;
  }
  if (name == "horizon") return &horizon;
  if (scope == Scope::kSetup) return nullptr;
  if (name == "time") return &time;
  if (scope == Scope::kRunning) {
    if (name == "phase_time") return &phase_time;
    const auto& foreseen = touchDownNames();
    if (const auto at = std::find(foreseen.begin(), foreseen.end(), name); at != foreseen.end()) {
      return &touch_down[static_cast<size_t>(at - foreseen.begin())];
    }
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
