// A motion for tests: a robot that turns all its joints and falls.
#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "traceur/core/random.h"
#include "traceur/sim/recording.h"
#include "traceur/sim/world.h"

namespace traceur::clip {

inline sim::Recording tumbling(const std::string& robot_name) {
  const auto robot =
      std::make_shared<sim::Robot>(sim::Robot::fromFile("models/" + robot_name + "/robot.toml"));
  const auto model = sim::Model::fromScene({.robot = robot});
  sim::World world(model);
  sim::State s = model->initialState();
  Random random(1, 2, 3);
  for (const sim::Joint& j : model->joints()) s.v[j.v] = 2 * random.normal();
  s.v.segment<3>(model->rootV() + 3) << 2, -3, 1;
  s.q[model->rootQ() + 2] += 1;
  world.reset(s);
  sim::Recording recording;
  recording.mjcf = model->mjcf();
  const sim::Torque none{Eigen::VectorXd::Zero(model->nu())};
  const int every = static_cast<int>(std::lround(0.01 / model->timeStep()));
  for (int step = 0; step < 40 * every; ++step) {
    if (step % every == 0) {
      recording.frames.push_back(sim::frameOf(world.snapshot(), 0, none.tau));
    }
    world.step(none);
  }
  return recording;
}

}  // namespace traceur::clip
