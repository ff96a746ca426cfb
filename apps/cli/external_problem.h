// A function that another program computes, one line a trial.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "traceur/core/param.h"
#include "traceur/core/process.h"
#include "traceur/optim/problem.h"

namespace traceur::cli {

struct ExternalFunction {
  std::vector<std::string> command;  ///< program and arguments; run without a shell
  ParamSpecs variables;              ///< min, max: bounds, infinite where there is none
  std::vector<std::string> constraints;
  Eigen::VectorXd tasks;  ///< (M) rising; empty: a single cost
};

/// Starts the command once for each thread and keeps it. A trial is one line to its standard input,
/// the values of the variables in order, and one line back:
///
///     COST                 a number; with tasks, one for each, in order
///     COST NAME ...        the same, and these constraints were violated
///     failed               the trial gave no cost; so does a cost that is nan or inf
///
/// The answer must depend on the line only. Other answers, and a command that ends, end the search
/// with an InputError that quotes question and answer.
class ExternalProblem : public optim::Problem {
 public:
  explicit ExternalProblem(ExternalFunction function);

  Eigen::VectorXd lower() const override;
  Eigen::VectorXd upper() const override;
  Eigen::VectorXd tasks() const override { return function_.tasks; }
  std::vector<std::string> constraints() const override { return function_.constraints; }
  optim::Evaluation evaluate(const Eigen::VectorXd& x) const override;

  /// What a line of answer says.
  /// @throws InputError for one that is not as above
  optim::Evaluation parse(const std::string& answer) const;

 private:
  std::unique_ptr<Process> take() const;

  ExternalFunction function_;
  mutable std::atomic<bool> warned_ = false;  // of an answer that takes long, once
  // Commands not in use; as many as there were ever threads at once.
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Process>> idle_;
};

}  // namespace traceur::cli
