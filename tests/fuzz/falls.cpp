// A falls.toml beside a robot that is as it should be.
#include "tests/fuzz/fuzz.h"
#include "traceur/fall/fall_robot.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  static const bool kLinked = [] {
    const auto models = std::filesystem::absolute("models/bioloid-gp");
    for (const char* name : {"robot.toml", "robot.xml"}) {
      std::filesystem::create_symlink(models / name, fuzz::folder() / name);
    }
    return true;
  }();
  (void)kLinked;
  fuzz::maybeRefused([&] {
    const auto falls =
        fall::FallRobot::fromFile(fuzz::fileOf(fuzz::textOf(data, size), "falls.toml"));
    for (const fall::FallSetup& s : falls.setups) falls.setup(s.stance, s.direction);
  });
  return 0;
}
