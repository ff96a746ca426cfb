// What several tests of falls begin with.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/fall/embedded/fall_plan.h"
#include "traceur/fall/expansion.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/fall/plan_library.h"
#include "traceur/fall/value_table.h"

namespace traceur::fall {

inline std::shared_ptr<const FallRobot> fallsOf(const std::string& robot) {
  return std::make_shared<const FallRobot>(FallRobot::fromFile("models/" + robot + "/falls.toml"));
}

inline std::shared_ptr<const sim::Model> modelOf(const FallRobot& falls) {
  return sim::Model::fromScene({.robot = falls.robot});
}

/// A coarse problem, quick to plan even without pruning.
inline FallProblem coarse(const FallRobot& falls, const std::string& stance,
                          const std::string& direction) {
  const SagittalBody body(modelOf(falls), falls.setup(stance, direction));
  FallProblem p = fallProblem(body, falls, {.poses = 2000});
  p.grid.time *= 3;
  p.grid.angle *= 2;
  p.grid.rod_rates = 1;
  return p;
}

inline FallState randomStart(double r, int i) {
  Random random(1, 2, i);
  return {0, 0, {.theta = random.uniform(-0.1, 0.2), .r = r, .theta_rate = random.uniform(0.4, 2)}};
}

}  // namespace traceur::fall
