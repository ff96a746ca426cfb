// Boxes so wide, or so narrow, that the squares of their numbers are none.
#pragma once

#include <memory>

#include "traceur/optim/all.h"

namespace traceur::optim {

/// Makes an optimiser, by make, that searches the problem in units of 2^unitExponent of each
/// variable. Its candidates and curves are in those of the problem, finite and inside the bounds.
/// Where all units are 1 it is what make makes; its state is that of the optimiser inside.
std::unique_ptr<Optimizer> inSafeUnits(const Problem& problem, const CommonOptions& options,
                                       const decltype(OptimizerEntry::make)& make);

}  // namespace traceur::optim
