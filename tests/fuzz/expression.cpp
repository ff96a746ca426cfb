// An expression of a skill file: checked as the reader checks it, then evaluated.
#include "traceur/control/expression.h"

#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  const std::string text(fuzz::textOf(data, size));
  static double values[] = {0.5, -2, 1e300};
  fuzz::maybeRefused([&] {
    control::Expression::isName(text);
    control::Expression::namesIn(text);
    int n = 0;
    const control::Expression e(text, [&](const std::string&) { return &values[n++ % 3]; });
    e.value();
    for (double& v : values) v = -v;
    e.holds();
  });
  return 0;
}
