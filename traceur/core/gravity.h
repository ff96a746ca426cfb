// The gravity of every model that does not say otherwise.
#pragma once

namespace traceur {

inline constexpr double kGravity = 9.81;  ///< [m/s²], as simulators and robots' files round it

}  // namespace traceur
