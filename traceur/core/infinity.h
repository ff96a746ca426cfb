// What no number exceeds.
#pragma once

#include <limits>

namespace traceur {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace traceur
