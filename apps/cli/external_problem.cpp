#include "apps/cli/external_problem.h"
#include "apps/cli/output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "traceur/core/error.h"
#include "traceur/core/text.h"

namespace traceur::cli {

using Eigen::VectorXd;

namespace {

/// After so long [s] a person wonders [ours].
constexpr double kPatience = 10;

}  // namespace

ExternalProblem::ExternalProblem(ExternalFunction function) : function_(std::move(function)) {}

VectorXd ExternalProblem::lower() const {
  VectorXd x(function_.variables.size());
  std::transform(function_.variables.begin(), function_.variables.end(), x.begin(),
                 [](const ParamSpec& p) { return p.min; });
  return x;
}

VectorXd ExternalProblem::upper() const {
  VectorXd x(function_.variables.size());
  std::transform(function_.variables.begin(), function_.variables.end(), x.begin(),
                 [](const ParamSpec& p) { return p.max; });
  return x;
}

std::unique_ptr<Process> ExternalProblem::take() const {
  const std::scoped_lock lock(mutex_);
  if (idle_.empty()) {
    return std::make_unique<Process>(function_.command, Process::Output::kTalk);
  }
  std::unique_ptr<Process> process = std::move(idle_.back());
  idle_.pop_back();
  return process;
}

optim::Evaluation ExternalProblem::evaluate(const VectorXd& x) const {
  std::unique_ptr<Process> process = take();
  std::string question;
  for (const double v : x) question += fmt::format("{}{}", question.empty() ? "" : " ", v);
  optim::Evaluation evaluation;
  try {
    if (process->hasMore()) {
      throw InputError(
          fmt::format("{} answered a trial with more than one line", function_.command[0]));
    }
    process->write(question + "\n");
    if (!process->answersWithin(kPatience) && !warned_.exchange(true)) {
      note(
          "traceur: no answer from {} for {:g} s; still waiting. Does it flush its output "
          "after each line?\n",
          function_.command[0], kPatience);
    }
    evaluation = parse(process->readLine());
  } catch (const std::runtime_error& e) {
    throw InputError(fmt::format("{}\n  asked: {}", e.what(), question));
  }
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(process));
  return evaluation;
}

optim::Evaluation ExternalProblem::parse(const std::string& answer) const {
  std::istringstream words(answer);
  std::vector<std::string> all{std::istream_iterator<std::string>(words), {}};
  if (all == std::vector<std::string>{"failed"}) return {.failed = true};

  const size_t costs = std::max<size_t>(1, function_.tasks.size());
  const auto fail = [&](const std::string& why) {
    throw InputError(fmt::format("{} answered \"{}\": {}", function_.command[0], answer, why));
  };
  if (all.size() < costs) {
    fail(costs == 1 ? "expected a cost" : fmt::format("expected {} costs", costs));
  }
  optim::Evaluation evaluation;
  evaluation.cost = 0;
  for (size_t i = 0; i < costs; ++i) {
    const std::optional<double> number = parseNumber(all[i]);
    if (!number) fail(fmt::format("\"{}\" is not a number", all[i]));
    const double cost = *number;
    evaluation.cost += cost / static_cast<double>(costs);
    if (function_.tasks.size() > 0) evaluation.task_costs.push_back(cost);
  }
  evaluation.violated.resize(function_.constraints.size());
  for (size_t i = costs; i < all.size(); ++i) {
    const auto& names = function_.constraints;
    const auto found = std::find(names.begin(), names.end(), all[i]);
    if (found == names.end()) {
      fail(fmt::format("no --constraint \"{}\".{}", all[i], didYouMean(all[i], names)));
    }
    evaluation.violated[found - names.begin()] = true;
  }
  return evaluation;
}

}  // namespace traceur::cli
