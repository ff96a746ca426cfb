#include "traceur/optim/all.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/safe_units.h"
#include "traceur/optim/start.h"

namespace traceur::optim {

namespace {

std::vector<OptimizerEntry> inSafeUnits(std::vector<OptimizerEntry> entries) {
  for (OptimizerEntry& entry : entries) {
    entry.make = [make = std::move(entry.make)](const Problem& problem, const CommonOptions& o) {
      return inSafeUnits(problem, o, make);
    };
  }
  return entries;
}

}  // namespace

const std::vector<OptimizerEntry>& allOptimizers() {
  static const std::vector<OptimizerEntry> kAll = inSafeUnits({
      {"cma-es", "Active CMA-ES: learns a normal distribution from the ranks of its samples.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaEs>(cmaEsOptions(problem, common));
       }},
      {"cma-c",
       "CMA-ES with a classifier for each constraint: learns from failures where not to try.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaC>(cmaCOptions(problem, common));
       }},
      {"one-plus-one",
       "(1+1)-CMA-ES: one trial at a time; strong where constraints meet in a corner.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<OnePlusOne>(onePlusOneOptions(problem, common));
       }},
      {"ipop-cma-es", "CMA-ES that starts anew with a doubled population when it is stuck.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<Restarts>(cmaEsOptions(problem, common));
       }},
      {"bipop-cma-es", "As ipop-cma-es, with small populations and steps in between.",
       [](const Problem& problem, const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<Restarts>(cmaEsOptions(problem, common),
                                           RestartOptions{.bipop = true});
       }},
  });
  return kAll;
}

const OptimizerEntry& findOptimizer(std::string_view name) {
  std::vector<std::string> names;
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (entry.name == name) return entry;
    names.push_back(entry.name);
  }
  throw InputError(fmt::format("no optimiser \"{}\".{} There is: {}", name, didYouMean(name, names),
                               join(names)));
}

CmaEsOptions cmaEsOptions(const Problem& problem, const CommonOptions& common) {
  Start start = startOf(problem, common.x0);
  return {.x0 = std::move(start.x0),
          .sigma = common.sigma,
          .scale = std::move(start.scale),
          .lower = problem.lower(),
          .upper = problem.upper(),
          .lambda = common.lambda,
          .seed = common.seed,
          .feasible_first = common.feasible_first};
}

CmaCOptions cmaCOptions(const Problem& problem, const CommonOptions& common) {
  return {.cma = cmaEsOptions(problem, common),
          .constraints = static_cast<int>(problem.constraints().size()),
          .experience = common.experience};
}

OnePlusOneOptions onePlusOneOptions(const Problem& problem, const CommonOptions& common) {
  if (common.lambda < 0) {
    throw InputError(fmt::format("one-plus-one: expected lambda ≥ 0, got {}", common.lambda));
  }
  Start start = startOf(problem, common.x0);
  return {.x0 = std::move(start.x0),
          .sigma = common.sigma,
          .scale = std::move(start.scale),
          .lower = problem.lower(),
          .upper = problem.upper(),
          .constraints = static_cast<int>(problem.constraints().size()),
          .seed = common.seed,
          .feasible_first = common.feasible_first};
}

}  // namespace traceur::optim
