// Where the numbers live that a skill's expressions name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "traceur/control/expression.h"
#include "traceur/control/signals.h"
#include "traceur/skill/scope.h"
#include "traceur/skill/skill.h"

namespace traceur::skill {

/// One trial's numbers, by name. Expressions that were bound to them live no longer than they do.
class Places {
 public:
  explicit Places(const Skill& skill);
  Places(const Places&) = delete;
  Places& operator=(const Places&) = delete;

  /// A trial begins: nothing of the last one is left, nor of its parts'; parameters and task stay.
  void forget();
  /// Parameters, task and conditions have been set: works out what follows from them alone.
  void settle();
  /// The trial is at this moment: signals, and the values that are made of them.
  void look(const sim::Snapshot& s);
  /// The values anew, where a phase has changed.
  void follow();
  /// null where nothing of this scope has the name
  const double* find(Scope scope, const std::string& name);
  control::Expression::Lookup in(Scope scope);

  VectorXd parameters;
  VectorXd conditions;
  std::vector<double> values;  ///< by Skill::values
  double task = 0;
  double horizon = 0;     ///< [s]
  double time = 0;        ///< [s]
  double phase_time = 0;  ///< [s]
  /// How the body will meet the ground, by a phase's flight; afterwards as was foreseen last. By
  /// touchDownNames(); not numbers before a flight.
  std::vector<double> touch_down;
  std::vector<double> measures;  ///< by Skill::measures
  std::vector<double> failed;    ///< by Skill::failures: 0 or 1
  control::Signals signals;
  /// By Skill::stageNames: whether it lasts; whether it ended now; how often it has begun.
  std::vector<double> in_stage, ended_stage, entered_stage;
  double cost = 0;  ///< of a part, once it was begun and is over; else what Part::otherwise says
  /// By Skill::parts, what their verdicts may be asked of.
  std::vector<Places*> parts;
  /// Whether some expression reads a joint's force.
  bool readJointForces() const;
  /// Whether this is the place of a measure, of a part's too.
  bool isMeasure(const double* place) const;

  /// The names of what touch_down holds.
  static const std::vector<std::string>& touchDownNames();
  void foresee(const flight::TouchDown& t);
  /// Whether a value is made of touch_down.
  bool values_foresee = false;

  /// Whether an expression that is not a verdict's reads the task.
  bool task_moves = false;

 private:
  const double* findOfPart(const std::string& name);

  const Skill* skill_;
  std::vector<control::Expression> bound_;       // by Skill::values
  std::map<std::string, const double*> stages_;  // in.NAME, ended.NAME, entered.NAME
};

}  // namespace traceur::skill
