#include "traceur/optim/family.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/optim/cost.h"

namespace traceur::optim {

std::vector<double> costsOfTasks(std::string_view who, const Evaluation& evaluation, int tasks) {
  std::vector<double> costs(tasks, NAN);
  if (evaluation.failed || (!evaluation.meaningful() && evaluation.task_costs.empty())) {
    return costs;
  }
  if (evaluation.task_costs.size() != costs.size()) {
    throw InputError(fmt::format("{}: expected a trial's costs of {} tasks, got {}", who, tasks,
                                 evaluation.task_costs.size()));
  }
  for (int i = 0; i < tasks; ++i) {
    const double cost = evaluation.task_costs[i];
    if (isCost(cost)) costs[i] = cost;
  }
  return costs;
}

}  // namespace traceur::optim
