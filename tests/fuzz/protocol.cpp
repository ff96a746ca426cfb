// What another program answers to a trial.
#include "apps/cli/external_problem.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  static const cli::ExternalProblem kOne({{"f"}, {{"x", "", 0, 1}}, {"fell", "slipped"}, {}});
  static const cli::ExternalProblem kFamily(
      {{"f"}, {{"x", "", 0, 1}}, {}, Eigen::VectorXd::LinSpaced(3, 0, 1)});
  const std::string answer(fuzz::textOf(data, size));
  for (const auto* problem : {&kOne, &kFamily}) {
    fuzz::maybeRefused([&] { problem->parse(answer); });
  }
  return 0;
}
