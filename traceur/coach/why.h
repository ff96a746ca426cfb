// Why a phase was not learned, and what to say to the athlete.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "traceur/coach/lesson.h"

namespace traceur::coach {

struct Why {
  std::string what;   ///< "hands touch 0.03 s into landing, the trunk leaning 85 deg forward"
  std::string often;  ///< "152 of 192 trials failed: 120 touches, 32 hops"
  std::string phase;  ///< that the advice is for
  std::string say;    ///< an instruction; empty: none is known
};

/// From the best trial's ending and measures, and from how the trials failed.
/// @param lesson  of the phase, which failed
/// @param before  the name of the phase before it; empty: none
Why why(const PhaseLesson& lesson, std::string_view before);

}  // namespace traceur::coach
