// A skill file's text, for a small robot that lies beside it: read, and begun.
#include "traceur/skill/skill.h"

#include <algorithm>

#include "tests/fuzz/fuzz.h"
#include "traceur/skill/rollout.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  fuzz::maybeRefused([&] {
    const auto read =
        skill::Skill::fromText(std::string(fuzz::textOf(data, size)), "tests/fuzz/fuzzed.toml");
    skill::Skill begun = *read;
    begun.horizon = std::min(begun.horizon, 5 * begun.model->timeStep());
    skill::Runner runner(std::make_shared<const skill::Skill>(std::move(begun)));
    runner.run(read->initialParameters(), read->task.initial);
  });
  return 0;
}
