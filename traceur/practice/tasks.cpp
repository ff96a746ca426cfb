#include "traceur/practice/tasks.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/text.h"

namespace traceur::practice {

Eigen::VectorXd toTasks(const std::string& text, const std::string& where) {
  static constexpr double kMostTasks = 1000;  // more are a slip of the keyboard
  const std::vector<std::string> parts = split(text, ':');
  if (parts.size() != 3 || text.back() == ':') {
    throw InputError(fmt::format("{}: expected FIRST:LAST:COUNT, got \"{}\"", where, text));
  }
  const double first = toNumber(parts[0], where);
  const double last = toNumber(parts[1], where);
  const double count = toNumber(parts[2], where);
  if (!(std::isfinite(first) && std::isfinite(last) && first < last)) {
    throw InputError(
        fmt::format("{}: expected FIRST below LAST, got {} and {}", where, first, last));
  }
  if (!(count >= 2 && count <= kMostTasks && count == std::floor(count))) {
    throw InputError(
        fmt::format("{}: expected a COUNT in [2, {}], got {}", where, kMostTasks, parts[2]));
  }
  return Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(count), first, last);
}

std::string tasksText(const Eigen::VectorXd& tasks) {
  if (tasks.size() == 0) return "";
  return fmt::format("{}:{}:{}", tasks[0], tasks[tasks.size() - 1], tasks.size());
}

int controlPointsOf(const std::string& curve, int tasks) {
  const int points = curve == "cubic" ? 4 : 2;
  if (points <= tasks) return points;
  throw InputError(
      fmt::format("curve {}: expected at least {} tasks, got {}", curve, points, tasks));
}

}  // namespace traceur::practice
