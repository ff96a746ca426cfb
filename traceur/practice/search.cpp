#include "traceur/practice/search.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/part.h"
#include "traceur/practice/tasks.h"

namespace traceur::practice {
namespace {

/// The trials of an earlier run, with their verdicts of those constraints at the front that it knew
/// by the same name.
std::vector<optim::Trial> experienceOf(const std::string& file, const optim::Problem& problem) {
  const Run run = Run::open(file);
  const std::vector<std::string> ours = namesWithUnits(problem.parameters());
  if (const std::vector<std::string> theirs = namesWithUnits(run.meta().parameters);
      theirs != ours) {
    throw InputError(fmt::format("{}: expected a run of the same parameters, {}, got one of {}",
                                 file, join(ours), join(theirs)));
  }
  const std::vector<std::string> constraints = problem.constraints();
  const std::vector<std::string>& knows = run.meta().constraints;
  size_t known = 0;
  std::vector<size_t> place;  // of ours, in theirs
  for (; known < constraints.size(); ++known) {
    const auto found = std::find(knows.begin(), knows.end(), constraints[known]);
    if (found == knows.end()) break;
    place.push_back(found - knows.begin());
  }
  if (known == 0) {
    throw InputError(fmt::format("{}: knows nothing of the first constraint here: it has {}", file,
                                 join(knows)));
  }
  std::vector<optim::Trial> trials = run.trials();
  for (optim::Trial& t : trials) {
    std::vector<bool> violated;
    violated.reserve(place.size());
    for (const size_t i : place) violated.push_back(t.evaluation.violated[i]);
    t.evaluation.violated = std::move(violated);
  }
  return trials;
}

}  // namespace

std::vector<int> namedBy(const std::vector<std::string>& only, const ParamSpecs& parameters) {
  std::vector<std::string> names;
  names.reserve(parameters.size());
  for (const ParamSpec& p : parameters) names.push_back(p.name);
  std::vector<bool> named(names.size(), only.empty());
  for (const std::string& pattern : only) {
    bool found = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (fnmatch(pattern.c_str(), names[i].c_str(), 0) != 0) continue;
      found = named[i] = true;
    }
    if (!found) {
      throw InputError(fmt::format("only: no parameter named \"{}\".{} Known: {}", pattern,
                                   didYouMean(pattern, names), join(names)));
    }
  }
  std::vector<int> indices;
  for (size_t i = 0; i < names.size(); ++i) {
    if (named[i]) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

std::unique_ptr<optim::Optimizer> optimiserFor(const optim::Problem& problem, const VectorXd& x0,
                                               const SearchOptions& o, bool feasible_first) {
  const bool family = o.tasks.size() > 0;
  const optim::OptimizerEntry& entry = optim::findOptimizer(o.optimiser, family);
  optim::CommonOptions common{.seed = o.seed,
                              .lambda = o.population,
                              .sigma = o.step_size,
                              .x0 = x0,
                              .feasible_first = feasible_first};
  if (family) common.control_points = controlPointsOf(o.curve, static_cast<int>(o.tasks.size()));
  if (!o.experience.empty()) {
    if (!entry.learns_from_experience) {
      std::vector<std::string> names;
      for (const optim::OptimizerEntry& e : optim::allOptimizers()) {
        if (e.learns_from_experience) names.push_back(e.name);
      }
      throw InputError(fmt::format("experience: {} does not learn from it: expected optimiser {}",
                                   o.optimiser, join(names, " or ")));
    }
    common.experience = experienceOf(o.experience, problem);
  }
  if (o.only.empty()) return entry.make(problem, common);
  if (!o.experience.empty()) {
    throw InputError("only: experience is of all parameters: expected one of the two");
  }
  return optim::inPart(problem, common, namedBy(o.only, problem.parameters()), entry.make);
}

optim::Summary search(Run& run, const optim::Problem& problem, optim::Optimizer& optimiser,
                      double target, const Execution& how) {
  const optim::Progress start = run.progress();
  if (const auto state = run.file().state()) {
    try {
      optimiser.restore(*state);
    } catch (const InputError& e) {  // the person's options are the same
      const bool taught = !run.meta().search.experience.empty();
      throw InputError(fmt::format(
          "{}: cannot be resumed: {}it was made by another version: {}", run.name(),
          taught ? "the run given as experience has changed since, or " : "", e.what()));
    }
  }
  std::vector<FamilyCost> costs = run.familyCosts();
  if (how.on_generation) {
    const auto family = run.family();
    how.on_generation(start, family ? std::optional(family->first) : std::nullopt);
  }
  bool of_use = start.evaluations > 0;
  bool forgot = false;
  const auto store = [&](const optim::Generation& g) {
    const optim::Progress& p = g.progress;
    of_use = of_use || p.failed < p.evaluations;
    // What was found before is no longer the outcome.
    if (!std::exchange(forgot, true)) run.forgetOutcome();
    const std::optional<optim::Family> family = g.optimizer.family();
    if (family && (costs.empty() || family->cost < costs.back().cost)) {
      costs.push_back({p.evaluations, family->cost});
    }
    RunFile::Meta rows = family ? familyRows(*family, costs) : RunFile::Meta();
    if (problem.draws() && p.best) rows = bestRow(*p.best);
    run.append(p.generation - 1, g.trials, g.optimizer.save(), rows);
    if (how.on_generation) how.on_generation(p, family);
  };
  try {
    return optim::minimise(problem, optimiser,
                           {.threads = how.threads,
                            .budget = run.meta().search.budget,
                            .target = target,
                            .stop = how.stop,
                            .on_generation = store,
                            .on_broken = how.on_broken},
                           start);
  } catch (...) {
    if (!of_use) std::filesystem::remove(run.file().path());
    throw;
  }
}

}  // namespace traceur::practice
