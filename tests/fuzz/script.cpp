// A coach's script, for a small robot that lies beside it: read, and each phase compiled.
#include "traceur/coach/script.h"

#include "tests/fuzz/fuzz.h"
#include "traceur/coach/compile.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  fuzz::maybeRefused([&] {
    const auto s =
        coach::Script::fromText(std::string(fuzz::textOf(data, size)), "tests/fuzz/fuzzed.coach");
    for (size_t k = 0; k < s.phases.size(); ++k) coach::compilePhase(s, k, {}, {});
  });
  return 0;
}
