// Searching some of a problem's variables; the others stay.
#pragma once

#include <memory>
#include <vector>

#include "traceur/optim/all.h"

namespace traceur::optim {

/// Makes an optimiser, by make, of n' ≤ n variables: those that move, as if there were no others.
/// Its candidates have all n, the others as in options.x0.
/// @param options  x0 (n), given; no experience
/// @param moves    indices, rising, at least one; all: what make makes
/// @throws InputError where tasks are learned for: a curve would need points of all variables
std::unique_ptr<Optimizer> inPart(const Problem& problem, const CommonOptions& options,
                                  const std::vector<int>& moves,
                                  const decltype(OptimizerEntry::make)& make);

}  // namespace traceur::optim
