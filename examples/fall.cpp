// A robot is pushed over: what the ground does to it with a plan, and without.
#include <cstdio>
#include <exception>

#include "traceur/fall/fall_experiment.h"

using namespace traceur;

int main() {
  try {
    const auto falls = std::make_shared<const fall::FallRobot>(
        fall::FallRobot::fromFile("models/bioloid-gp/falls.toml"));
    fall::FallExperiment experiment(falls, falls->setup("one_foot", "forward"));
    for (const char* way : {"hold", "planned"}) {
      const fall::FallTrial trial = experiment.run({.force = 5}, way).trial;
      std::printf("%-8s %.2f N s, %zu contacts\n", way, trial.impulse, trial.contacts.size());
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
