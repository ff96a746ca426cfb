#include "traceur/skill/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "traceur/control/expression.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/skill/places.h"

namespace traceur::skill {
namespace {

/// More would take longer to check than a person waits, and nobody practises so many [ours].
constexpr int kMostExpressions = 5000;

/// What to do about a name in a text that expressions spell with quotes.
std::optional<std::string> quoting(const std::string& text, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    std::string plain = name;
    std::erase(plain, '\'');
    if (plain != name && text.find(plain) != std::string::npos) {
      return fmt::format(" Did you mean \"{}\"? Signs other than letters, digits and _ are quoted.",
                         name);
    }
  }
  return std::nullopt;
}

}  // namespace

void Words::declare(const TomlReader& row, std::string_view key, const std::string& name) {
  if (name.empty()) return;  // said to be missing already
  if (!control::Expression::isName(name) || name.find('.') != std::string::npos) {
    row.fail(key, fmt::format("\"{}\": expected a name of letters, digits and _, that is no "
                              "function",
                              name));
    return;
  }
  static const std::set<std::string> kOurs = {"task",       "horizon", "time",
                                              "phase_time", "stop",    "diverged"};
  if (kOurs.contains(name)) {
    row.fail(key, fmt::format("\"{}\" has a meaning of its own: expected another name", name));
  } else if (!names_.insert(name).second) {
    row.fail(key,
             fmt::format("\"{}\": two parameters, measures, failures, constants or parts have this "
                         "name",
                         name));
  }
}

std::optional<int> Words::phaseIndex(const TomlReader& row, const char* key,
                                     const std::string& name) {
  const std::vector<std::string> phases = skill_->phaseNames();
  const auto at = std::find(phases.begin(), phases.end(), name);
  if (at != phases.end()) return static_cast<int>(at - phases.begin());
  row.fail(key,
           fmt::format("\"{}\": no phase named \"{}\".{}", key, name, didYouMean(name, phases)));
  return std::nullopt;
}

std::vector<bool> Words::during(const TomlReader& row) {
  const std::vector<std::string> phases = skill_->phaseNames();
  std::vector<bool> in(phases.size(), !row.has("during"));
  if (!row.has("during")) return in;
  const std::vector<std::string> named = row.strings("during");
  if (named.empty() && row.find("during")->isArray()) {
    row.fail("during", "\"during\": expected at least one phase");
  }
  for (const std::string& name : named) {
    bool part = false;  // all of its phases
    for (const Part& p : skill_->parts) part = part || p.name == name;
    for (size_t i = 0; part && i < phases.size(); ++i) {
      if (phases[i].starts_with(name + ".")) in[i] = true;
    }
    if (part) continue;
    if (const auto phase = phaseIndex(row, "during", name)) in[*phase] = true;
  }
  return in;
}

std::pair<VectorXd, sim::Vector3d> Words::basePose(const TomlReader& row, const char* key) {
  const sim::Model& m = *skill_->model;
  VectorXd q = VectorXd::Zero(static_cast<Eigen::Index>(m.joints().size()));
  const std::string name = row.string(key, "zero");
  const auto pose = m.robot()->poses.find(name);
  if (pose == m.robot()->poses.end()) {
    if (name == "zero") return {q, sim::Vector3d::Zero()};
    std::vector<std::string> names = {"zero", "previous"};
    for (const auto& [known, unused] : m.robot()->poses) names.push_back(known);
    row.fail(key, fmt::format("\"{}\": {} has no pose \"{}\".{} Known: {}", key, m.robot()->name,
                              name, didYouMean(name, names), join(names)));
    return {q, sim::Vector3d::Zero()};
  }
  for (size_t i = 0; i < m.joints().size(); ++i) {
    const auto angle = pose->second.joints.find(m.joints()[i].name);
    if (angle != pose->second.joints.end()) q[static_cast<Eigen::Index>(i)] = angle->second;
  }
  return {q, pose->second.root_rpy};
}

std::vector<std::pair<int, double>> Words::joints(const TomlReader& row, const std::string& key,
                                                  const std::string& word) {
  const sim::Model& m = *skill_->model;
  std::vector<std::pair<int, double>> out;
  for (const sim::SignedJoint& j : m.robot()->jointsNamed(word)) {
    int index = -1;
    for (size_t i = 0; i < m.joints().size(); ++i) {
      if (m.joints()[i].name == j.joint) index = static_cast<int>(i);
    }
    if (index < 0) {
      std::vector<std::string> names;
      for (const auto& [pair, unused] : m.robot()->mirrored) names.push_back(pair);
      for (const sim::Joint& joint : m.joints()) names.push_back(joint.name);
      row.fail(key, fmt::format("no joint or pair of joints named \"{}\".{}", word,
                                didYouMean(word, names)));
    } else {
      out.emplace_back(index, j.sign);
    }
  }
  return out;
}

std::vector<JointValue> Words::jointValues(const TomlReader& row,
                                           const std::set<std::string>& except, Scope scope) {
  std::vector<JointValue> out;
  for (const std::string& key : row.names()) {
    if (except.contains(key)) continue;
    const std::string text = expression(*row.find(key), scope);
    for (const auto& [joint, sign] : joints(row, key, key)) out.push_back({joint, sign, text});
  }
  return out;
}

std::vector<sim::BodyId> Words::bodiesNamed(const std::string& name) const {
  const sim::Model& m = *skill_->model;
  const auto group = m.robot()->bodies.find(name);
  bool body = false;
  for (int b = 0; b < m.bodies(); ++b) body = body || m.bodyName({b}) == name;
  if (body || group == m.robot()->bodies.end()) return {m.body(name)};
  std::vector<sim::BodyId> all;
  for (const std::string& one : group->second) all.push_back(m.body(one));
  return all;
}

std::vector<sim::BodyId> Words::bodies(const TomlReader& row, const char* key) {
  std::vector<sim::BodyId> out;
  const TomlValue* list = row.find(key);
  if (list && list->isArray() && list->array().empty()) {
    row.fail(key, fmt::format("\"{}\": expected at least one body", key));
  }
  for (const std::string& name : row.strings(key)) {
    try {
      for (const sim::BodyId body : bodiesNamed(name)) out.push_back(body);
    } catch (const InputError& e) {
      row.fail(key, fmt::format("\"{}\": {}", key, e.what()));
    }
  }
  return out;
}

control::Place Words::place(const TomlReader& row, const char* key) {
  control::Place place;
  const std::string name = row.string(key);
  if (name.empty()) return place;
  try {
    if (name == "com") {
      place.com = true;
    } else if (skill_->model->robot()->contacts.contains(name)) {
      place.points.push_back(skill_->model->contactPoint(name));
    } else {
      for (const sim::BodyId body : bodiesNamed(name)) place.points.push_back({body});
    }
  } catch (const InputError& e) {
    row.fail(key,
             fmt::format("\"{}\": expected \"com\", a contact point, a body or a group of them: "
                         "{}",
                         key, e.what()));
  }
  return place;
}

std::string Words::expression(const TomlReader& row, const char* key, const char* otherwise,
                              Scope scope) {
  const TomlValue* v = row.find(key);
  return v ? expression(*v, scope) : otherwise;
}

VectorText Words::vector(const TomlReader& row, const char* key, Scope scope) {
  VectorText text;
  const TomlValue* v = row.find(key);
  if (!v) return text;
  if (!v->isArray() || v->array().size() != 3) {
    row.fail(key, fmt::format("\"{}\": expected a list of 3 numbers or expressions", key));
    return text;
  }
  std::string* const parts[] = {&text.x, &text.y, &text.z};
  for (int i = 0; i < 3; ++i) *parts[i] = expression(v->array()[i], scope);
  return text;
}

double Words::value(const TomlReader& row, const char* key, double otherwise) {
  const TomlValue* v = row.find(key);
  return v ? value(*v) : otherwise;
}

double Words::value(const TomlValue& v) {
  const double value = constant(expression(v, Scope::kConstant)).value_or(0);
  if (std::isfinite(value)) return value;
  diagnostics_->add(v.line, v.column, "expected a finite number");
  return 0;
}

std::optional<double> Words::constant(const std::string& expression) const {
  try {
    return control::Expression(expression,
                               [&](const std::string& name) {
                                 for (const auto& [known, value] : skill_->constants) {
                                   if (known == name) return &value;
                                 }
                                 return static_cast<const double*>(nullptr);
                               })
        .value();
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void Words::stagesKnown() {
  for (const std::string& stage : skill_->stageNames()) {
    stages_.insert("in." + stage);
    stages_.insert("ended." + stage);
    stages_.insert("entered." + stage);
  }
}

bool Words::isSetup(const std::string& expression) {
  const auto names = control::Expression::namesIn(expression);
  return std::all_of(names.begin(), names.end(),
                     [&](const std::string& name) { return known(Scope::kSetup, name); });
}

std::string Words::expression(const TomlValue& v, Scope scope) {
  const auto fail = [&](std::string_view message) {
    diagnostics_->add(v.line, v.column, message);
    return std::string("0");
  };
  if (v.isNumber()) {
    if (!std::isfinite(v.number())) return fail("expected a finite number");
    return fmt::format("({})", v.number());
  }
  if (!v.isString()) {
    return fail(fmt::format("expected a number or an expression, got {}", v.kind()));
  }
  if (++expressions_ > kMostExpressions) {
    fail(fmt::format("the {}. expression: expected at most {}", expressions_, kMostExpressions));
    diagnostics_->throwIfAny();
  }
  const double somewhere = 1;
  try {
    for (const std::string& name : control::Expression::namesIn(v.string())) {
      if (known(scope, name)) continue;
      const std::vector<std::string> candidates = names(scope);
      if (scope == Scope::kConstant) {
        return fail(
            fmt::format("\"{}\": the same in every trial: expected a number, or one of "
                        "constants above it.{}",
                        v.string(), didYouMean(name, candidates)));
      }
      if (scope == Scope::kVerdict && signals_ && signals_->find(name)) {
        return fail(
            fmt::format("\"{}\": \"{}\" is a signal: expected names of measures, which "
                        "are taken from signals",
                        v.string(), name));
      }
      return fail(
          fmt::format("\"{}\": nothing here is named \"{}\".{}", v.string(), name,
                      quoting(v.string(), candidates).value_or(didYouMean(name, candidates))));
    }
    const control::Expression checked(v.string(), [&](auto&) { return &somewhere; });
  } catch (const InputError& e) {
    return fail(e.what());
  }
  return v.string();
}

namespace {

bool has(const auto& rows, const std::string& name) {
  return std::any_of(rows.begin(), rows.end(), [&](const auto& row) { return row.name == name; });
}

/// Whether a verdict of the skill may have the name.
bool knownInVerdict(const Skill& skill, const std::string& name) {
  if (name == "task" || name == "horizon" || name == "time") return true;
  for (const auto& [known, unused] : skill.constants) {
    if (known == name) return true;
  }
  if (has(skill.parameters, name) || has(skill.conditions, name) || has(skill.measures, name) ||
      has(skill.failures, name)) {
    return true;
  }
  for (const Value& v : skill.values) {
    if (v.name == name) return !v.running;
  }
  return std::any_of(skill.parts.begin(), skill.parts.end(), [&](const Part& part) {
    if (!name.starts_with(part.name + ".")) return false;
    const std::string rest = name.substr(part.name.size() + 1);
    return rest == "cost" || knownInVerdict(*part.skill, rest);
  });
}

}  // namespace

bool Words::known(Scope scope, const std::string& name) {
  if (name == "pi") return true;
  for (const auto& [constant, unused] : skill_->constants) {
    if (constant == name) return true;
  }
  if (scope == Scope::kConstant) return false;
  if (scope == Scope::kVerdict) return knownInVerdict(*skill_, name);
  if (name == "task" || name == "horizon" || has(skill_->parameters, name)) return true;
  if (has(skill_->conditions, name)) return true;
  for (const Value& v : skill_->values) {
    if (v.name == name) return !v.running || scope == Scope::kRunning;
  }
  if (scope == Scope::kSetup) return false;
  const auto& foreseen = Places::touchDownNames();
  if (std::find(foreseen.begin(), foreseen.end(), name) != foreseen.end()) return true;
  return name == "time" || name == "phase_time" || stages_.contains(name) || signals_->find(name);
}

std::vector<std::string> Words::plainNames(Scope scope) const {
  std::vector<std::string> out = {"pi"};
  for (const auto& [name, unused] : skill_->constants) out.push_back(name);
  if (scope == Scope::kConstant) return out;
  out.insert(out.end(), {"task", "horizon"});
  for (const ParamSpec& p : skill_->parameters) out.push_back(p.name);
  for (const ParamSpec& p : skill_->conditions) out.push_back(p.name);
  for (const Value& v : skill_->values) {
    if (!v.running || scope == Scope::kRunning) out.push_back(v.name);
  }
  if (scope == Scope::kRunning) {
    out.insert(out.end(), {"time", "phase_time"});
    out.insert(out.end(), stages_.begin(), stages_.end());
    out.insert(out.end(), Places::touchDownNames().begin(), Places::touchDownNames().end());
  }
  if (scope == Scope::kVerdict) {
    out.push_back("time");
    for (const Measure& m : skill_->measures) out.push_back(m.name);
    for (const Failure& f : skill_->failures) out.push_back(f.name);
  }
  return out;
}

std::vector<std::string> Words::names(Scope scope) const {
  std::vector<std::string> out = plainNames(scope);
  for (std::string& name : out) name = control::Expression::spelled(name);
  if (scope == Scope::kRunning) {
    for (const std::string& s : signals_->names()) out.push_back(s);
  }
  return out;
}

}  // namespace traceur::skill
