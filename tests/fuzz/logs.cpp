// What the bongo board's verbs read: the first byte chooses between a log, a policy and a machine.
#include "tests/fuzz/fuzz.h"
#include "traceur/bias/bongo_learning.h"
#include "traceur/bias/policy_file.h"
#include "traceur/bias/run_log_file.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  if (size == 0) return 0;
  const std::filesystem::path file = fuzz::fileOf(fuzz::textOf(data + 1, size - 1), "fuzzed");
  fuzz::maybeRefused([&] {
    switch (data[0] % 3) {
      case 0:
        bias::readLog(file, bias::bongoLogFormat());
        break;
      case 1:
        bias::readPolicy(file);
        break;
      default:
        bias::readBongoMachine(file);
    }
  });
  return 0;
}
