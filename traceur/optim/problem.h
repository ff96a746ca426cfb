// What is minimised, and what one trial of it says.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "traceur/core/param.h"

namespace traceur::optim {

using Eigen::VectorXd;

/// What one trial says. A trial that failed is a value like any other.
struct Evaluation {
  double cost = std::numeric_limits<double>::infinity();  ///< lower is better
  std::vector<bool> violated = {};  ///< per Problem::constraints(); empty: none violated
  bool failed = false;  ///< the trial gave no meaningful cost (diverged, NaN): ranks last
  /// (M) the trial's cost for each of Problem::tasks(), and cost is their mean; empty for a problem
  /// without tasks. Not finite: the trial says nothing about that task, though it may about others.
  std::vector<double> task_costs = {};

  /// Not failed, and the cost is finite (isCost).
  bool meaningful() const;
  /// Meaningful, and no constraint is violated.
  bool feasible() const;
};

/// The one order of trials: feasible before infeasible before failed, then by cost. Failed ones are
/// all equal. A strict weak order whatever the costs are.
bool better(const Evaluation& a, const Evaluation& b);

/// A point and what trying it said.
struct Trial {
  VectorXd x;             ///< (n)
  Evaluation evaluation;  ///< from minimise(): a cost that was not finite reads +∞, failed is set
};

/// A function to minimise inside a box. Implementations are called from several threads at once.
class Problem {
 public:
  virtual ~Problem() = default;

  /// Lower and upper bound of each variable, (n) and (n); infinite where there is none.
  virtual VectorXd lower() const = 0;
  virtual VectorXd upper() const = 0;
  /// (n) what the variables are: names, units, the same bounds, and where a search begins that is
  /// not told otherwise. Unless said otherwise "x1", "x2", … without units, beginning as startOf()
  /// says.
  virtual ParamSpecs parameters() const;
  /// The names of the yes/no constraints, known only by running a trial; may be empty.
  virtual std::vector<std::string> constraints() const { return {}; }
  /// (M) rising: the tasks that one trial is scored for all at once, such as heights to jump to.
  /// Empty: there is only one.
  virtual VectorXd tasks() const { return {}; }
  /// Runs one trial at x, (n), inside the box. Pure: equal x give equal bits on any thread.
  virtual Evaluation evaluate(const VectorXd& x) const = 0;

  /// Whether a trial's cost depends on what is drawn, as the falls that a landing is tried in: the
  /// draws of a round are the same for all x, so that trials can be compared within it. minimise()
  /// then goes to another round now and then, and looks at where the optimiser stands in round 0.
  virtual bool draws() const { return false; }
  /// evaluate() is of round 0. Pure: equal x and round give equal bits.
  virtual Evaluation evaluateIn(int /*round*/, const VectorXd& x) const { return evaluate(x); }

  int dimension() const { return static_cast<int>(lower().size()); }
};

/// @param who  begins the message: "minimise", "cma-es"
/// @throws InputError unless lower and upper are both (n), free of NaN, and lower < upper
void checkBounds(std::string_view who, const VectorXd& lower, const VectorXd& upper, int n);

}  // namespace traceur::optim
