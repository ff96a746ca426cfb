#include "traceur/optim/task_positions.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::optim {

VectorXd taskPositions(std::string_view who, const VectorXd& tasks) {
  const int M = static_cast<int>(tasks.size());
  if (M == 0) throw InputError(fmt::format("{}: expected a problem with tasks, got none", who));
  for (int i = 0; i < M; ++i) {
    if (!std::isfinite(tasks[i]))
      throw InputError(fmt::format("{}: task {} is {}", who, i, tasks[i]));
    if (i > 0 && !(tasks[i] > tasks[i - 1])) {
      throw InputError(
          fmt::format("{}: expected rising tasks, got {} after {}", who, tasks[i], tasks[i - 1]));
    }
  }
  VectorXd w = VectorXd::Zero(M);
  // Halved, so that the distance of two huge tasks is still a number.
  const double range = tasks[M - 1] / 2 - tasks[0] / 2;
  for (int i = 1; i < M; ++i) w[i] = i == M - 1 ? 1 : (tasks[i] / 2 - tasks[0] / 2) / range;
  return w;
}

}  // namespace traceur::optim
