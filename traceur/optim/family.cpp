#include "traceur/optim/family.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/contextual_cma.h"
#include "traceur/optim/cost.h"
#include "traceur/optim/curve_cma.h"
#include "traceur/optim/family_baselines.h"
#include "traceur/optim/safe_units.h"

namespace traceur::optim {

namespace {

std::vector<FamilyOptimizerEntry> inSafeUnits(std::vector<FamilyOptimizerEntry> entries) {
  for (FamilyOptimizerEntry& entry : entries) {
    entry.make = [make = std::move(entry.make)](const Problem& problem, const FamilyOptions& o) {
      return inSafeUnits(problem, o, make);
    };
  }
  return entries;
}

}  // namespace

const std::vector<FamilyOptimizerEntry>& allFamilyOptimizers() {
  static const std::vector<FamilyOptimizerEntry> kAll = inSafeUnits({
      {"contextual", "One normal distribution along a curve; every trial teaches all tasks.",
       makeContextualCma},
      {"curve", "The dissertation's: a curve of means, a covariance for each task, elites.",
       makeCurveCma},
      {"cma", "CMA-ES over the curve's control points: each curve costs a trial for each task.",
       makePhiCma},
      {"individual", "CMA-ES for each task on its own, joined by straight lines.",
       makeIndividualCma},
      {"neighbours", "The same in turn, each beginning where its neighbour ended.",
       makeNeighbourCma},
  });
  return kAll;
}

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

const FamilyOptimizerEntry& findFamilyOptimizer(std::string_view name) {
  std::vector<std::string> names;
  for (const FamilyOptimizerEntry& entry : allFamilyOptimizers()) {
    if (entry.name == name) return entry;
    names.push_back(entry.name);
  }
  throw InputError(fmt::format("no optimiser of families \"{}\".{} There is: {}", name,
                               didYouMean(name, names), join(names)));
}

}  // namespace traceur::optim
