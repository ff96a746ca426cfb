// Text of a TOML document: read, and every value asked for as every kind.
#include "traceur/core/toml.h"

#include "tests/fuzz/fuzz.h"

namespace {

using namespace traceur;

void askAll(const TomlReader& reader, int depth) {
  for (const std::string& key : reader.names()) {
    reader.number(key, 0);
    reader.numberOrInfinity(key);
    reader.string(key, "");
    reader.boolean(key, false);
    reader.numbers(key, 3);
    reader.strings(key);
    reader.tables(key);
    if (depth < 4) askAll(reader.table(key), depth + 1);
  }
  reader.finish();
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::maybeRefused([&] {
    const TomlValue document = parseToml(fuzz::textOf(data, size), "fuzzed.toml");
    Diagnostics diagnostics("fuzzed.toml");
    askAll(TomlReader(document, diagnostics), 0);
    diagnostics.throwIfAny();
  });
  return 0;
}
