// Uses what an installed Traceur offers: headers, libraries and the models beside them.
#include <cstdio>

#include "traceur/optim/all.h"
#include "traceur/render/figure.h"
#include "traceur/skill/skill.h"

int main() {
  const auto path = traceur::skill::findRobot("bioloid-gp", DATA);
  const auto robot =
      std::make_shared<const traceur::sim::Robot>(traceur::sim::Robot::fromFile(path));
  const auto model = traceur::sim::Model::fromScene({.robot = robot});
  std::printf("%s %.3f kg, %zu optimisers\n", robot->name.c_str(), model->mass(),
              traceur::optim::allOptimizers().size());
  return model->joints().size() == 16 ? 0 : 1;
}
