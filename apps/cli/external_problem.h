// A function that another program computes, one line a trial.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <stop_token>
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
/// The answer must depend on the line only. What else can happen:
///
///   - It ends, or its line does not begin with as many numbers as there are costs: optim::Broken,
///     this trial's fault.
///   - It names a constraint that there is not, answers with a second line, or with one longer than
///     Process::kMostLine: InputError; it was not written for these questions.
///   - It cannot be started: SystemError.
///
/// Each quotes the question and, if there is one, the answer. After a trial that is Broken the
/// command is started anew. With secondChance(), so that Broken depends on the question alone, a
/// command that had answered before is not believed: a new one gets the same question.
class ExternalProblem : public optim::Problem {
 public:
  explicit ExternalProblem(ExternalFunction function);

  ParamSpecs parameters() const override { return function_.variables; }
  Eigen::VectorXd lower() const override { return lowerOf(function_.variables); }
  Eigen::VectorXd upper() const override { return upperOf(function_.variables); }
  Eigen::VectorXd tasks() const override { return function_.tasks; }
  std::vector<std::string> constraints() const override { return function_.constraints; }
  optim::Evaluation evaluate(const Eigen::VectorXd& x) const override;

  /// Before the first trial, as heed(): asked to end, a trial is optim::Abandoned, answer or not.
  void secondChance(bool given) { second_chance_ = given; }
  void heed(std::stop_token stop) { stop_ = std::move(stop); }

  /// What a line of answer says.
  /// @throws optim::Broken, InputError for one that is not as above
  optim::Evaluation parse(const std::string& answer) const;

 private:
  std::unique_ptr<Process> start() const;
  std::unique_ptr<Process> takeIdle() const;
  std::string ask(Process& process, bool is_new, const std::string& question) const;

  ExternalFunction function_;
  bool second_chance_ = false;
  std::stop_token stop_;
  mutable std::atomic<bool> warned_ = false;  // of an answer that takes long, once
  // Commands not in use; as many as there were ever threads at once.
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Process>> idle_;
};

}  // namespace traceur::cli
