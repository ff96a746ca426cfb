// Goals that cannot both be reached.
#pragma once

#include "traceur/coach/instruction.h"

namespace traceur::coach {

/// Whether two instructions of a phase want what one motion cannot have: relations that exclude
/// each other, one thing in two places, a body that stands still and moves. Practice then seeks a
/// compromise [Ha2015, §5.2]. Where the later one replaces the earlier, nothing is opposed.
bool opposed(const Instruction& a, const Instruction& b);

}  // namespace traceur::coach
