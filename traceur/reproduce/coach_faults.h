// Faults put into scripts on purpose: whether they are named, and whether what is advised helps.
#pragma once

#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Forty scripts under skills/athlete, each with one line that is wrong: too weak, too late,
/// slippery, out of reach, or a contradiction; eight of each.
Table coachFaults();

}  // namespace traceur::reproduce
