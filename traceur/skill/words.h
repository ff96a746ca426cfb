// What the words of a skill file mean while it is being read.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "traceur/control/signals.h"
#include "traceur/core/toml.h"
#include "traceur/skill/scope.h"
#include "traceur/skill/skill.h"

namespace traceur::skill {

/// Looks up names in a skill that is half read. What it does not find is noted at its place with a
/// suggestion, and something neutral returned.
class Words {
 public:
  Words(const Skill& skill, Diagnostics& diagnostics)
      : skill_(&skill), diagnostics_(&diagnostics) {}

  /// The skill has its phases or parts now.
  void stagesKnown();
  /// The skill has its model now.
  void modelKnown() { signals_ = std::make_unique<control::Signals>(skill_->model); }

  /// Notes at `key` a name that cannot be spelled or that means two things: a trial's end is a
  /// failure's name, and expressions name parameters, constants, measures, failures and parts.
  void declare(const TomlReader& row, std::string_view key, const std::string& name);

  /// A number or an expression, checked: the text that control::Expression takes.
  std::string expression(const TomlValue& v, Scope scope);
  std::string expression(const TomlReader& row, const char* key, const char* otherwise,
                         Scope scope);
  /// A list of three of them; zeros where there is none.
  VectorText vector(const TomlReader& row, const char* key, Scope scope);
  /// The value of an expression of constants.
  double value(const TomlReader& row, const char* key, double otherwise);
  double value(const TomlValue& v);
  /// Whether a checked expression names nothing that changes in a trial.
  bool isSetup(const std::string& expression);
  /// The value of an expression that names nothing that changes; nothing for another.
  std::optional<double> constant(const std::string& expression) const;

  /// The joints a word means, with signs.
  std::vector<std::pair<int, double>> joints(const TomlReader& row, const std::string& key,
                                             const std::string& word);
  std::vector<JointValue> jointValues(const TomlReader& row, const std::set<std::string>& except,
                                      Scope scope);
  /// The bodies that a list of bodies and groups means; a name of both is the body's.
  std::vector<sim::BodyId> bodies(const TomlReader& row, const char* key);
  /// "com", a contact point, a body or a group of them.
  control::Place place(const TomlReader& row, const char* key);
  /// The robot's pose that key names ("zero" is always there): joint angles and attitude.
  std::pair<VectorXd, sim::Vector3d> basePose(const TomlReader& row, const char* key);

  /// Those of the names that there are, by phase; all without the key.
  std::vector<bool> during(const TomlReader& row);
  /// The phase of this name; nothing after complaining about `key`.
  std::optional<int> phaseIndex(const TomlReader& row, const char* key, const std::string& name);

 private:
  std::vector<sim::BodyId> bodiesNamed(const std::string& name) const;
  bool known(Scope scope, const std::string& name);
  std::vector<std::string> plainNames(Scope scope) const;
  std::vector<std::string> names(Scope scope) const;

  const Skill* skill_;
  Diagnostics* diagnostics_;
  std::unique_ptr<control::Signals> signals_;
  int expressions_ = 0;           // checked so far
  std::set<std::string> names_;   // declared
  std::set<std::string> stages_;  // in.NAME, ended.NAME
};

}  // namespace traceur::skill
