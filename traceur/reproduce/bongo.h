// Chapter 8's experiments with the bongo board: how many runs of a simulated machine it takes to a
// policy that balances on it.
#pragma once

#include <cstdint>

#include "traceur/bias/bongo_learning.h"
#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Iterations to the first success, over noise and inertia [Ha2015, Tab. 13]; what its runs drew is
/// the cost over the iterations.
Table table13();
/// The worst cost of an iteration's runs over the iterations, at the noises and the inertia of the
/// three printed runs, and on a machine that breaks what the model teaches, each with no bias
/// learned beside it [Ha2015, Fig. 41].
Table figure41();
/// The same over faults that break what the model alone teaches, with the controls beside it: not
/// in the paper.
Table bongoFaults();

/// What a cell of theirs runs.
struct BongoRun {
  bias::BongoMachine machine;
  bias::BongoLearning learning = {};
};
BongoRun table13Run(int row, int column, std::uint64_t seed);
BongoRun figure41Run(int row, int column, std::uint64_t seed);
BongoRun bongoFaultsRun(int row, int column, std::uint64_t seed);

}  // namespace traceur::reproduce
