// What a skill's file says of a trial: its measures, failures, end and verdict.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "traceur/motion/controller.h"
#include "traceur/skill/bound.h"

namespace traceur::skill {

class Measures : public motion::Observer {
 public:
  /// @param controller  whose phases the file speaks of
  Measures(const Skill& skill, Places& places, const motion::Controller& controller);

  void begin(const motion::Moment& m) override;
  std::string_view ends(const motion::Moment& m) override;
  void see(const motion::Moment& m, bool last) override;

  /// The terms of the cost, for the task in the places; NaN where a measure that it needs saw
  /// nothing.
  std::vector<double> terms() const;
  /// In the task's unit; NaN for a skill that does not say.
  double achieved() const;
  /// Whether "task" is read by a cost.
  bool costDependsOnTask() const { return task_costs_; }

 private:
  struct Taken {
    control::Expression of;
    std::optional<control::Expression> when;
    int seen = 0;  // steps
  };
  /// What is said of a whole trial: nothing where a measure it names has no value, also where its
  /// text would hide that, as comparisons and max do.
  struct Verdict {
    control::Expression of;
    std::vector<const double*> measures;

    double value() const;
  };
  Verdict verdict(const std::string& text, bool cost);

  const Skill* skill_;
  Places* places_;
  const motion::Controller* controller_;
  int steps_ = 0;        // of the horizon
  double interval_ = 0;  // between the moments that are looked at [s]
  bool task_costs_ = false;
  std::vector<Taken> measures_;
  std::vector<control::Expression> failures_;
  std::optional<control::Expression> stop_;
  std::vector<Verdict> terms_;
  std::optional<Verdict> achieved_;
};

}  // namespace traceur::skill
