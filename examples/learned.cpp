// Practice into a run file, and the learned skill done again: a landing from 20 cm.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "traceur/practice/learn.h"

using namespace traceur;

int main(int argc, char** argv) {
  try {
    const auto skill = skill::Skill::fromFile("skills/bioloid-gp/land.toml");
    const std::filesystem::path file = argc > 1 ? argv[1] : "runs/example.run";
    std::filesystem::remove(file);
    practice::SearchOptions options = practice::learningOptions();
    options.budget = 64;
    practice::learn(skill, 0.2, options, file, false, {});

    const practice::LearnedSkill landing = practice::learnedSkill(practice::Run::open(file));
    const skill::Rollout r = landing.perform();
    std::printf("%s: %s after %g s\n", skill->name.c_str(), r.ended.c_str(), r.time);
    for (const practice::Quantity& q : practice::measuresOf(*skill, r)) {
      std::printf("  %-8s %.3g %s\n", q.name.c_str(), q.value, q.unit.c_str());
    }
    return r.failed() ? 1 : 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
