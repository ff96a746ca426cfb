// A robot practises a skill: a file, an optimiser, the one loop. No window.
#include <cstdio>
#include <exception>

#include "traceur/optim/all.h"
#include "traceur/optim/minimise.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"

using namespace traceur;

int main(int argc, char** argv) {
  try {
    const auto skill = skill::Skill::fromFile(argc > 1 ? argv[1] : "skills/bioloid-gp/jump.toml");
    const double task = skill->task.initial;

    const skill::SkillProblem problem(skill, task);
    const auto cma = optim::findOptimizer("cma-es").make(problem, {.seed = 1});
    const optim::Summary found = optim::minimise(problem, *cma, {.threads = 0, .budget = 48});

    if (!found.progress.best) {
      std::fprintf(stderr, "%s: no trial gave a cost\n", skill->name.c_str());
      return 1;
    }
    const skill::Rollout best = skill::Runner(skill).run(found.progress.best->x, task);
    std::printf("%s: asked %g %s, got %g %s after %d trials\n", skill->name.c_str(), task,
                skill->task.unit.c_str(), best.achieved, skill->task.unit.c_str(),
                found.progress.evaluations);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
