// Chapter 3's experiments: whether a person lands, and what its joints bear.
#pragma once

#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Eight falls, hands first and feet first [Ha2015, Tab. 2].
Table table2();
/// What joints bear in a landing and limp [Ha2015, Fig. 17].
Table figure17();
/// The landing condition from samples of touch-downs [Ha2015, Fig. 10, 11].
Table landingCondition();
/// How near the planner comes to what is wanted at touch-down, by how many poses it may take: not
/// in the paper.
Table landingFlight();
/// Whether what was learned helps in the air: not in the paper.
Table landingLean();
/// Success over drop height, forward speed and spin: not in the paper.
Table landingAtlas();

}  // namespace traceur::reproduce
