// Table 7's three real motions: leaning, thrusting and landing of a jump, practised by optimisers.
#pragma once

#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Trials until one that does not fail costs at most the skill's target_cost [Ha2015, Tab. 7]. The
/// skills are skills/athlete/jump-leaning.toml, jump-thrusting.toml and jump-landing.toml, each
/// with its fixed start.
Table jumpPhases();

}  // namespace traceur::reproduce
