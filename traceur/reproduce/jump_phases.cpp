#include "traceur/reproduce/jump_phases.h"

#include <fmt/format.h>

#include <array>
#include <memory>
#include <string>

#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/core/toml.h"
#include "traceur/optim/all.h"
#include "traceur/sim/model.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::reproduce {
namespace {

constexpr std::array kPhases = {"jump-leaning", "jump-thrusting", "jump-landing"};

/// Trials at which a search is given up and counted as this many: twice what random search needs
/// in the mean [ours].
constexpr int kCap = 1000;
constexpr int kLambda = 10;         // 5 of 10 [Ha2015, Tab. 7]
constexpr double kHalfRange = 0.5;  // a step size of 1 in [-1, 1] [Ha2015, §6.4], of the range

struct Motion {
  std::shared_ptr<const skill::Skill> skill;
  std::unique_ptr<skill::SkillProblem> problem;
};
const Motion& motionOf(int row) {
  static const auto kMotions = [] {
    std::array<Motion, kPhases.size()> all;
    for (size_t i = 0; i < kPhases.size(); ++i) {
      all[i].skill = skill::Skill::fromFile(skill::findSkill("athlete", kPhases[i]));
      all[i].problem = std::make_unique<skill::SkillProblem>(all[i].skill, 0.0);
    }
    return all;
  }();
  return kMotions[static_cast<size_t>(row)];
}

std::string phasePrints() {
  Hash hash;
  for (const char* name : {"jump-leaning", "jump-thrusting", "jump-airborne", "jump-landing"}) {
    hash.add(readFile(skill::findSkill("athlete", name)));
  }
  hash.add(fmt::format("{}", motionOf(0).skill->model->fingerprint()));
  return fmt::format("{} athlete {:08x}", sim::engineVersion(), hash.value() & 0xffffffff);
}

using Make = std::unique_ptr<optim::Optimizer> (*)(const optim::Problem&,
                                                   const optim::CommonOptions&);
struct Search {
  const char* name;
  bool feasible_first;
  Make make;  ///< null: draws evenly from the box
};
constexpr std::array kSearches = {
    Search{"CMA-ES", false,
           [](const optim::Problem& p, const optim::CommonOptions& o) {
             return optim::findOptimizer("cma-es").make(p, o);
           }},
    Search{"CMA-ES feasible first", true,
           [](const optim::Problem& p, const optim::CommonOptions& o) {
             return optim::findOptimizer("cma-es").make(p, o);
           }},
    Search{"CMA-C 2015", false,
           [](const optim::Problem& p,
              const optim::CommonOptions& o) -> std::unique_ptr<optim::Optimizer> {
             return std::make_unique<optim::CmaC>(optim::dissertationCmaC(
                 optim::cmaEsOptions(p, o), static_cast<int>(p.constraints().size())));
           }},
    Search{"CMA-C", true,
           [](const optim::Problem& p, const optim::CommonOptions& o) {
             return optim::findOptimizer("cma-c").make(p, o);
           }},
    Search{"random", true, nullptr},
    Search{"CMA-C with a cost model", true,
           [](const optim::Problem& p, const optim::CommonOptions& o) {
             return optim::findOptimizer("cma-c-gp").make(p, o);
           }},
};

/// Of the box, evenly.
optim::VectorXd drawn(const optim::Problem& problem, Random& random) {
  optim::VectorXd x = problem.lower();
  const optim::VectorXd upper = problem.upper();
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = random.uniform(x[i], upper[i]);
  return x;
}

Outcome searched(const Motion& motion, const Search& how, std::uint64_t seed,
                 const std::stop_token& stop) {
  const optim::Problem& problem = *motion.problem;
  const auto reached = [&](const optim::Evaluation& e) {
    return e.feasible() && e.cost <= motion.skill->target_cost;
  };
  int trials = 0;
  if (how.make == nullptr) {
    Random random(seed);
    while (trials < kCap && !stop.stop_requested()) {
      ++trials;
      if (reached(problem.evaluate(drawn(problem, random)))) return {.value = double(trials)};
    }
    return {.value = kCap, .missed = true};
  }
  for (std::uint64_t start = 0; trials < kCap && !stop.stop_requested(); ++start) {
    // Who has nothing more to try begins anew: fair, and better for it than to stop.
    const auto optimizer = how.make(problem, {.seed = seed + 1'000'000 * start,
                                              .lambda = kLambda,
                                              .sigma = kHalfRange,
                                              .feasible_first = how.feasible_first});
    while (!optimizer->stopped() && trials < kCap && !stop.stop_requested()) {
      for (const optim::Candidate& c : optimizer->ask()) {
        const optim::Evaluation e = problem.evaluate(c.x);
        ++trials;
        if (reached(e)) return {.value = double(trials)};
        optimizer->tell(c.id, e);
      }
    }
  }
  return {.value = kCap, .missed = true};
}

}  // namespace

Table jumpPhases() {
  Table t;
  t.name = "table-7-motions";
  t.title = "CMA-C against CMA-ES on a jump's leaning, thrusting, landing [Ha2015, Tab. 7].";
  t.protocol =
      "Trials until one that does not fail costs at most the skill's target_cost, at most 1000, "
      "counted as 1000 when missed. 10 in a generation, first in the middle, step size half of "
      "each parameter's range; whoever has collapsed begins anew. Costs are the printed ones: "
      "squared distances, and 1000 (2 s - time) for who fails. Starts and targets, of which the "
      "text has none, are ours: one of 500 trials drawn at random is good enough (of 3000 drawn).";
  for (const char* name : {"leaning", "thrusting", "landing"}) {
    t.rows.push_back({name, name, "trials"});
  }
  for (const Search& s : kSearches) t.columns.push_back({s.name, 3, 30, {}});
  t.columns[0].printed = {126.25, 101.25, 105.0};
  t.columns[2].printed = t.columns[3].printed = {23.75, 77.5, 22.5};
  t.ratios = {{"CMA-ES / CMA-C 2015", 0, 2},
              {"CMA-ES / CMA-C", 0, 3},
              {"CMA-ES feasible first / CMA-C", 1, 3},
              {"CMA-ES / CMA-C with a cost model", 0, 5}};
  t.made_with = phasePrints;
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    return searched(motionOf(row), kSearches[static_cast<size_t>(column)], seed, stop);
  };
  return t;
}

}  // namespace traceur::reproduce
