// A family of tasks with a known answer, for tests and first programs.
#pragma once

#include <functional>
#include <utility>

#include "traceur/optim/problem.h"

namespace traceur::optim {

/// f(x; w) = ‖x - c(w)‖², least 0 where x lies on the curve c; w is the task itself.
class SegmentProblem : public Problem {
 public:
  /// @param c  (n) of w, pure; in the box where 0 is to be reached
  SegmentProblem(VectorXd lower, VectorXd upper, VectorXd tasks,
                 std::function<VectorXd(double w)> c)
      : lower_(std::move(lower)),
        upper_(std::move(upper)),
        tasks_(std::move(tasks)),
        c_(std::move(c)) {}

  VectorXd lower() const override { return lower_; }
  VectorXd upper() const override { return upper_; }
  VectorXd tasks() const override { return tasks_; }
  Evaluation evaluate(const VectorXd& x) const override {
    Evaluation evaluation{.cost = 0};
    for (const double w : tasks_) evaluation.task_costs.push_back((x - c_(w)).squaredNorm());
    for (const double cost : evaluation.task_costs) {
      evaluation.cost += cost / static_cast<double>(tasks_.size());
    }
    return evaluation;
  }

 private:
  VectorXd lower_;
  VectorXd upper_;
  VectorXd tasks_;
  std::function<VectorXd(double)> c_;
};

}  // namespace traceur::optim
