// Numbers that the tests hand to optimisers which cannot use them.
#pragma once

#include <limits>

namespace traceur::optim {

inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace traceur::optim
