// A robot's file of another's making: the first byte chooses between MJCF or URDF, and robot.toml
// beside a small robot. What loads is put on the ground and moved.
#include "traceur/sim/model.h"

#include "tests/fuzz/fuzz.h"
#include "traceur/sim/world.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace traceur;
  if (size == 0) return 0;
  static const bool kCopied = [] {
    return std::filesystem::copy_file("tests/fuzz/tiny.xml", fuzz::folder() / "tiny.xml");
  }();
  (void)kCopied;
  const std::string_view text = fuzz::textOf(data + 1, size - 1);
  const std::string refusal = fuzz::maybeRefused([&] {
    sim::Scene scene;
    scene.robot = std::make_shared<const sim::Robot>(
        sim::Robot::fromFile(fuzz::fileOf(text, data[0] % 4 == 0 ? "robot.toml" : "robot.xml")));
    const auto model = sim::Model::fromScene(scene);
    sim::World world(model);
    world.reset(model->stateOf({}));
    for (int i = 0; i < 3; ++i) {
      world.step({Eigen::VectorXd::Zero(model->nu())});
      world.snapshot().contacts();
    }
  });
  // Robots are read in a copy of the target, which a sanitizer may have ended.
  for (const char* name : {"robot.xml", "tiny.xml"}) {
    const std::string file = (fuzz::folder() / name).string();
    if (refusal == file + ": ends what makes it ready (exit 1)") std::abort();
  }
  return 0;
}
