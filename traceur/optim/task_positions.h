// The tasks of a problem as places along a curve.
#pragma once

#include <string_view>

#include "traceur/optim/problem.h"

namespace traceur::optim {

/// (M) w_i = (t_i - t_1) / (t_M - t_1), from 0 to 1; 0 for a single task.
/// @param who    begins the message
/// @param tasks  (M) Problem::tasks()
/// @throws InputError unless there is a task, and all are finite and each is above the one before
VectorXd taskPositions(std::string_view who, const VectorXd& tasks);

}  // namespace traceur::optim
