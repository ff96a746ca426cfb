// Whether a landing runs live: how much faster than real time a whole fall is with everything on,
// at steps of 0.2 ms on one core, and how much of that is not the engine; how long planning in the
// air takes.
//
//     build/release/bench/bench_landing
#include <cstdio>
#include <filesystem>
#include <vector>

#include "bench/bare.h"
#include "traceur/core/toml.h"
#include "traceur/landing/falls.h"

using namespace traceur;
using namespace traceur::bench;

int main() {
  static constexpr double kStep = 0.0002;  // [s] [Ha2015, §3.6]
  static constexpr int kPairs = 15;
  const std::filesystem::path file = skill::findSkill("human", "land");
  skill::Disturbance steps;
  steps.time_step = kStep;
  const auto skill = skill::Skill::fromText(readFile(file), file, steps);
  landing::Faller faller({skill, skill->initialParameters()});
  const auto falls = landing::drawFalls(*skill, landing::findFallSet("m2"), kPairs, 1);
  const mjModel* m = skill->model->raw();
  mjData* d = mj_makeData(m);

  std::vector<double> faster, own;
  for (const Eigen::VectorXd& x : falls) {
    sim::Recording recording;
    faller.fall(x, {}, &recording);
    const double bare = bareStep(m, d, recording, motion::Session::kInterval);
    const double begun = cpuSeconds();
    const landing::Fall fall = faller.fall(x);
    const double whole = (cpuSeconds() - begun) / (fall.rollout.time / kStep);
    faster.push_back(kStep / whole);
    own.push_back(1 - bare / whole);
  }
  mj_deleteData(d);
  print("a fall of m2, times faster than real time", faster);
  print("share of it that is not the engine", own);

  const skill::Phase& flight = *std::find_if(skill->phases.begin(), skill->phases.end(),
                                             [](const auto& p) { return p.flight.has_value(); });
  flight::FlightPlanner planner(skill->model, flight.flight->poses);
  planner.landIn(flight.base);
  sim::World world(skill->model);
  std::vector<double> plans;
  for (const Eigen::VectorXd& x : falls) {
    world.reset(faller.start(x));
    const double begun = cpuSeconds();
    planner.plan(
        world.snapshot(), [](const flight::TouchDown&) { return 0.3; }, 0);
    plans.push_back(1000 * (cpuSeconds() - begun));
  }
  print("a plan of all poses [ms]", plans);
  std::vector<double> holds;
  for (const Eigen::VectorXd& x : falls) {
    world.reset(faller.start(x));
    const double begun = cpuSeconds();
    planner.plan(
        world.snapshot(), [](const flight::TouchDown&) { return 0.3; }, 0, 0);
    holds.push_back(1000 * (cpuSeconds() - begun));
  }
  print("a plan of how long to hold one [ms]", holds);
}
