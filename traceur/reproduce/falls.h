// Chapter 4's experiments: what a fall costs with a plan and without.
#pragma once

#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Largest impulses of BioloidGP, pushed forward from one foot [Ha2015, Tab. 3].
Table table3();
/// Largest impulses of Atlas [Ha2015, Tab. 4].
Table table4();
/// One plan, made for 5 N, followed after other pushes [Ha2015, §4.4.1.1].
Table fallRobustness();
/// The COM's path of the model and of the robot that follows one plan [Ha2015, Fig. 22].
Table figure22();
/// Random pushes in the published ranges, by robot and direction: not in the paper.
Table randomFalls();

}  // namespace traceur::reproduce
