// How much of a rollout is the physics engine? Ratios within one run, so that the machine's mood
// cancels: the whole rollout loop against a bare mj_step loop with the same model, time step and
// torques; two threads against one; props at rest against none.
//
//     build/release/bench/bench_rollout [SKILL.toml ...]        default: jump, kick and walk
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/bare.h"
#include "traceur/core/random.h"
#include "traceur/core/thread_pool.h"
#include "traceur/core/toml.h"
#include "traceur/sim/world.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"

namespace {

using namespace traceur;
using namespace traceur::bench;

constexpr int kPairs = 101;  // single pairs scatter by a tenth on a machine that others use, too

void measure(const std::string& file) {
  const auto skill = skill::Skill::fromFile(file);
  skill::Runner runner(skill);
  const Eigen::VectorXd x = skill->initialParameters();
  sim::Recording recording;
  const skill::Rollout once = runner.run(x, skill->task.initial, &recording);
  const mjModel* m = skill->model->raw();
  mjData* d = mj_makeData(m);

  std::printf("%s: %d steps of %g s\n", skill->name.c_str(),
              static_cast<int>(std::lround(once.time / m->opt.timestep)), m->opt.timestep);
  std::vector<double> loop;
  for (int pair = 0; pair < kPairs; ++pair) {
    const double bare = bareStep(m, d, recording, skill::Runner::kInterval);
    const double t = cpuSeconds();
    const skill::Rollout r = runner.run(x, skill->task.initial);
    const double whole = (cpuSeconds() - t) / (r.time / m->opt.timestep);
    loop.push_back(bare / whole);
    if (pair == 0) {
      std::printf("first pair: bare %.2f us/step, rollout %.2f us/step\n", 1e6 * bare, 1e6 * whole);
    }
  }
  print("rollout loop, steps/s relative to a bare mj_step loop", loop);

  // Rollouts like those of a search: scattered parameters, many of which fall early.
  std::vector<Eigen::VectorXd> trials;
  for (int i = 0; i < 64; ++i) {
    Random random(1, 0, i);
    Eigen::VectorXd p = x;
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const ParamSpec& spec = skill->parameters[static_cast<size_t>(k)];
      p[k] = std::clamp(p[k] + 0.1 * (spec.max - spec.min) * random.normal(), spec.min, spec.max);
    }
    trials.push_back(p);
  }
  const skill::SkillProblem problem(skill, skill->task.initial);
  std::vector<double> threads;
  for (int pair = 0; pair < 5; ++pair) {
    double seconds[2];
    for (const int n : {1, 2}) {
      ThreadPool pool(n);
      const double t = wallSeconds();
      pool.forEach(static_cast<int>(trials.size()), [&](int i) { problem.evaluate(trials[i]); });
      seconds[n - 1] = wallSeconds() - t;
    }
    threads.push_back(seconds[0] / seconds[1]);
    if (pair == 0)
      std::printf("1 thread: %.1f rollouts/s\n", static_cast<double>(trials.size()) / seconds[0]);
  }
  print("2 threads, rollouts/s relative to 1", threads);
  mj_deleteData(d);
}

/// CPU seconds of rollouts of a skill among so many boxes at rest, relative to none.
void measureProps(const std::string& file) {
  const auto among = [&](int boxes, bool sleep) {
    std::string text = readFile(file);
    std::string rows = sleep ? "sleep = true\n" : "";
    for (int i = 0; i < boxes; ++i) {
      rows += "[[scene.box]]\nname = \"box " + std::to_string(i) + "\"\nsize = [0.1, 0.1, 0.1]\n" +
              "mass = 1\nat = [" + std::to_string(2 + 0.3 * i) + ", 2, 0.05]\n";
    }
    const std::string scene = "[scene]\nfriction = 1.0\n";
    text.insert(text.find(scene) + scene.size(), rows);
    return std::make_unique<skill::Runner>(skill::Skill::fromText(text, file));
  };
  const auto alone = among(0, false);
  const auto seconds = [](skill::Runner& runner, const skill::Skill& skill) {
    const double t = cpuSeconds();
    runner.run(skill.initialParameters(), skill.task.initial);
    return cpuSeconds() - t;
  };
  const auto skill = skill::Skill::fromFile(file);
  for (const bool sleep : {false, true}) {
    const auto crowd = among(20, sleep);
    std::vector<double> ratios;
    for (int pair = 0; pair < kPairs; ++pair) {
      const double without = seconds(*alone, *skill);
      ratios.push_back(seconds(*crowd, *skill) / without);
    }
    print(sleep ? "20 boxes at rest that may sleep, CPU relative to none"
                : "20 boxes at rest that may not, CPU relative to none",
          ratios);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> files(argv + 1, argv + argc);
  if (files.empty()) {
    for (const char* name : {"jump", "kick", "walk"}) {
      files.push_back(std::string("skills/bioloid-gp/") + name + ".toml");
    }
  }
  for (const std::string& file : files) measure(file);
  measureProps("skills/bioloid-gp/jump.toml");
}
