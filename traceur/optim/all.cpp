#include "traceur/optim/all.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/contextual_cma.h"
#include "traceur/optim/curve_cma.h"
#include "traceur/optim/family_baselines.h"
#include "traceur/optim/safe_units.h"
#include "traceur/optim/start.h"

namespace traceur::optim {

namespace {

/// One of every kind in safe units: boxes may be as wide or narrow as numbers are.
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
      {.name = "cma-es",
       .help = "Active CMA-ES: learns a normal distribution from the ranks of its samples.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaEs>(cmaEsOptions(problem, common));
       }},
      {.name = "cma-c",
       .help =
           "CMA-ES with a classifier for each constraint: learns from failures where not to try.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaC>(cmaCOptions(problem, common));
       },
       .learns_from_experience = true},
      {.name = "cma-c-gp",
       .help = "cma-c that also learns the cost and tries what promises most: for dear trials.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<CmaC>(modelCmaC(cmaCOptions(problem, common)));
       },
       .learns_from_experience = true},
      {.name = "one-plus-one",
       .help = "(1+1)-CMA-ES: one trial at a time; strong where constraints meet in a corner.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<OnePlusOne>(onePlusOneOptions(problem, common));
       }},
      {.name = "ipop-cma-es",
       .help = "CMA-ES that starts anew with a doubled population when it is stuck.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<Restarts>(cmaEsOptions(problem, common));
       }},
      {.name = "bipop-cma-es",
       .help = "As ipop-cma-es, with small populations and steps in between.",
       .make = [](const Problem& problem,
                  const CommonOptions& common) -> std::unique_ptr<Optimizer> {
         return std::make_unique<Restarts>(cmaEsOptions(problem, common),
                                           RestartOptions{.bipop = true});
       }},
      {.name = "contextual",
       .help = "One normal distribution along a curve; every trial teaches all tasks.",
       .make = makeContextualCma,
       .learns_families = true},
      {.name = "curve",
       .help = "The dissertation's: a curve of means, a covariance for each task, elites.",
       .make = makeCurveCma,
       .learns_families = true},
      {.name = "cma",
       .help = "CMA-ES over the curve's control points: each curve costs a trial for each task.",
       .make = makePhiCma,
       .learns_families = true},
      {.name = "individual",
       .help = "CMA-ES for each task on its own, joined by straight lines.",
       .make = makeIndividualCma,
       .learns_families = true},
      {.name = "neighbours",
       .help = "The same in turn, each beginning where its neighbour ended.",
       .make = makeNeighbourCma,
       .learns_families = true},
  });
  return kAll;
}

const OptimizerEntry& findOptimizer(std::string_view name, std::optional<bool> families) {
  std::vector<std::string> names;
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (families && entry.learns_families != *families) continue;
    if (entry.name == name) return entry;
    names.push_back(entry.name);
  }
  throw InputError(fmt::format("no optimiser {}\"{}\".{} There is: {}",
                               families.value_or(false) ? "of families " : "", name,
                               didYouMean(name, names), join(names)));
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
