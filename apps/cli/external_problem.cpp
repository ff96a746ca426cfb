#include "apps/cli/external_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "apps/cli/output.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/minimise.h"

namespace traceur::cli {

using Eigen::VectorXd;

namespace {

/// After so long [s] a person wonders [ours].
constexpr double kPatience = 10;
/// Asked to end, we wait so long [s] for an answer that may be on its way [ours].
constexpr double kGrace = 0.5;

}  // namespace

ExternalProblem::ExternalProblem(ExternalFunction function) : function_(std::move(function)) {}

std::unique_ptr<Process> ExternalProblem::start() const {
  auto process = std::make_unique<Process>(function_.command, Process::Output::kTalk);
  process->heed(stop_, kGrace);
  return process;
}

std::unique_ptr<Process> ExternalProblem::takeIdle() const {
  const std::scoped_lock lock(mutex_);
  if (idle_.empty()) return nullptr;
  std::unique_ptr<Process> process = std::move(idle_.back());
  idle_.pop_back();
  return process;
}

std::string ExternalProblem::ask(Process& process, bool is_new, const std::string& question) const {
  if (process.hasMore()) {
    throw InputError(fmt::format("{} {}", function_.command[0],
                                 is_new ? "said something before it was asked"
                                        : "answered a trial with more than one line"));
  }
  process.write(question + "\n");
  if (!process.answersWithin(kPatience) && !warned_.exchange(true)) {
    note(
        "traceur: no answer from {} for {:g} s; still waiting. Does it flush its output "
        "after each line?\n",
        function_.command[0], kPatience);
  }
  return process.readLine();
}

optim::Evaluation ExternalProblem::evaluate(const VectorXd& x) const {
  std::string question;
  for (const double v : x) question += fmt::format("{}{}", question.empty() ? "" : " ", v);
  const auto quoting = [&](const std::exception& e) {
    return fmt::format("{}\n  asked: {}", e.what(), question);
  };
  std::unique_ptr<Process> process = takeIdle();
  while (true) {
    const bool is_new = !process;
    if (is_new) process = start();
    try {
      optim::Evaluation evaluation = parse(ask(*process, is_new, question));
      const std::scoped_lock lock(mutex_);
      idle_.push_back(std::move(process));
      return evaluation;
    } catch (const Process::GivenUp& e) {
      throw optim::Abandoned(e.what());
    } catch (const Process::Ended& e) {
      if (is_new || !second_chance_) throw optim::Broken(quoting(e));
    } catch (const optim::Broken& e) {
      if (is_new || !second_chance_) throw optim::Broken(quoting(e));
    } catch (const std::runtime_error& e) {
      throw InputError(quoting(e));
    }
    process.reset();
  }
}

optim::Evaluation ExternalProblem::parse(const std::string& answer) const {
  std::istringstream words(answer);
  std::vector<std::string> all{std::istream_iterator<std::string>(words), {}};
  if (all == std::vector<std::string>{"failed"}) return {.failed = true};

  const size_t costs = std::max<size_t>(1, function_.tasks.size());
  const auto because = [&](const std::string& why) {
    return fmt::format("{} answered \"{}\": {}", function_.command[0], answer, why);
  };
  if (all.size() < costs) {
    throw optim::Broken(
        because(costs == 1 ? "expected a cost" : fmt::format("expected {} costs", costs)));
  }
  optim::Evaluation evaluation;
  evaluation.cost = 0;
  for (size_t i = 0; i < costs; ++i) {
    const std::optional<double> number = parseNumber(all[i]);
    if (!number) throw optim::Broken(because(fmt::format("\"{}\" is not a number", all[i])));
    const double cost = *number;
    evaluation.cost += cost / static_cast<double>(costs);
    if (function_.tasks.size() > 0) evaluation.task_costs.push_back(cost);
  }
  evaluation.violated.resize(function_.constraints.size());
  for (size_t i = costs; i < all.size(); ++i) {
    const auto& names = function_.constraints;
    const auto found = std::find(names.begin(), names.end(), all[i]);
    if (found == names.end()) {
      throw InputError(
          because(fmt::format("no --constraint \"{}\".{}", all[i], didYouMean(all[i], names))));
    }
    evaluation.violated[found - names.begin()] = true;
  }
  return evaluation;
}

}  // namespace traceur::cli
