// Robots' files of others, one a line on standard input: whether the engine alone loads them, what
// becomes of them here, and whether they stay on the ground when they are dropped from 10 cm with
// their motors off. One line of tab-separated values for each.
#include <fmt/format.h>

#include <iostream>

#include "traceur/core/error.h"
#include "traceur/core/guarded.h"
#include "traceur/core/printable.h"
#include "traceur/sim/engine.h"
#include "traceur/sim/world.h"

namespace {

using namespace traceur;

/// @return empty, or what the engine says
std::string engineAlone(const std::string& file) {
  try {
    return guarded("", [&] {
      sim::quietMujoco();
      char words[1024] = "";
      mjModel* model = mj_loadXML(file.c_str(), nullptr, words, sizeof words);
      return model ? std::string() : std::string(words);
    });
  } catch (const std::exception& e) {
    return e.what();
  }
}

std::string dropped(const std::shared_ptr<const sim::Model>& model) {
  static constexpr double kHeight = 0.1;  // [m]
  static constexpr double kTime = 3;      // [s]
  if (model->rootDofs() != 6) return "does not float";
  if (!model->canTouchWorld()) return "nothing of it can touch the ground";
  sim::World world(model);
  sim::State start = model->stateOf({});
  const int root = model->raw()->jnt_qposadr[model->raw()->body_jntadr[model->root().value]];
  start.q[root + 2] += kHeight;
  world.reset(start);
  double deepest = 0;  // of a contact [m]
  while (world.snapshot().time() < start.time + kTime) {
    world.step({Eigen::VectorXd::Zero(model->nu())});
    if (world.diverged()) return fmt::format("diverges after {:.2f} s", world.snapshot().time());
    if (world.overflowed()) return "too many contacts";
    for (int i = 0; i < world.raw()->ncon; ++i) {
      deepest = std::max(deepest, -static_cast<double>(world.raw()->contact[i].dist));
    }
  }
  const double height = world.snapshot().com().z();
  if (height < 0 || !world.snapshot().touchesWorld()) return "is not on the ground";
  return fmt::format("rests, COM {:.2f} m, {:.1f} mm deep at most", height, 1000 * deepest);
}

}  // namespace

int main() {
  for (std::string file; std::getline(std::cin, file);) {
    const std::string alone = engineAlone(file);
    std::string ours;
    std::string drop = "-";
    try {
      const auto robot = std::make_shared<const sim::Robot>(sim::Robot::fromFile(file));
      const auto model = sim::Model::fromScene({.robot = robot});
      int motors = 0;
      for (const sim::Joint& j : model->joints()) motors += j.motor >= 0;
      ours = fmt::format("{:.4g} kg, {} joints, {} motors", model->mass(), model->joints().size(),
                         motors);
      drop = dropped(model);
    } catch (const std::exception& e) {
      ours = std::string("refused: ") + e.what();
    }
    std::cout << file << '\t' << (alone.empty() ? "yes" : printable(alone)) << '\t'
              << printable(ours) << '\t' << drop << std::endl;
  }
}
