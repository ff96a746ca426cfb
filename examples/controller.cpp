// A controller of one's own, moved by the one loop, with a push, and a film of it.
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>

#include "traceur/motion/session.h"

using namespace traceur;

/// Waves an arm.
class Wave : public motion::Controller {
 public:
  explicit Wave(int joint) : joint_(joint) {}
  void begin(const motion::Moment& /*m*/, const control::JointTarget& held) override {
    held_ = held;
  }
  void command(const motion::Moment& m, motion::Senses& /*senses*/, control::Command& c) override {
    c.target = held_;
    c.target.q[joint_] += 0.5 * std::sin(6 * m.time);
  }
  std::vector<std::string> phases() const override { return {"wave"}; }

 private:
  int joint_;
  control::JointTarget held_;
};

int main() {
  try {
    const auto robot =
        std::make_shared<const sim::Robot>(sim::Robot::fromFile("models/bioloid-gp/robot.toml"));
    const auto model = sim::Model::fromScene({.robot = robot});
    sim::World world(model);
    control::Actuation actuation(control::defaultController(model));
    Wave wave(model->joint("r_shoulder").v - model->rootDofs());
    motion::Session session(world, actuation, wave, {});
    sim::Recording film;
    const motion::Push push{.body = model->root(), .force = {2, 0, 0}, .start = 0.5};
    const motion::Trial trial = session.run(model->stateOf(robot->poses.at("stand")),
                                            {.horizon = 2, .pushes = {push}, .recording = &film});
    std::printf("%s after %g s, %zu frames\n", trial.ended.c_str(), trial.time, film.frames.size());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
