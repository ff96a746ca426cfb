// A robot, the ground, a controller: simulation and control alone, a step at a time.
#include <cstdio>
#include <exception>

#include "traceur/control/actuation.h"

using namespace traceur;

int main() {
  try {
    const auto robot =
        std::make_shared<const sim::Robot>(sim::Robot::fromFile("models/bioloid-gp/robot.toml"));
    const auto model = sim::Model::fromScene({.robot = robot});
    const sim::State stand = model->stateOf(robot->poses.at("stand"));

    sim::World world(model);
    world.reset(stand);
    control::Actuation actuation(control::defaultController(model));
    control::Command command;
    command.target = control::targetOf(*model, stand);
    sim::Torque torque;
    for (int i = 0; i < 1000; ++i) {  // a second
      actuation.torque(world.snapshot(), command, torque);
      world.step(torque);
    }
    const sim::Snapshot& s = world.snapshot();
    std::printf("%s stands: COM %.3f m high, %zu contacts\n", robot->name.c_str(), s.com().z(),
                s.contacts().size());
    return s.com().z() > 0.15 ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
