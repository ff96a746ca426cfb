// A range of tasks as people write it.
#pragma once

#include <Eigen/Core>
#include <string>

namespace traceur::practice {

/// "FIRST:LAST:COUNT" as COUNT values in [2, 1000], evenly spaced and rising.
/// @param where  begins the message
/// @throws InputError for anything else
Eigen::VectorXd toTasks(const std::string& text, const std::string& where);

/// The same as text in one spelling; "" for none.
std::string tasksText(const Eigen::VectorXd& tasks);

/// How many control points a "linear" or "cubic" curve has: 2 or 4.
/// @throws InputError for a curve with more of them than there are tasks
int controlPointsOf(const std::string& curve, int tasks);

}  // namespace traceur::practice
