// Figure 42 of the dissertation: from where a policy balances, trained without noise and with.
#pragma once

#include <cstdint>
#include <memory>

#include "traceur/bias/bongo_hardware.h"
#include "traceur/bias/policy_search.h"
#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// The share of starts that policies balance from on a noisy machine [Ha2015, Fig. 42]: a column
/// trained without noise, one with, and their difference seed by seed. A row trained on the
/// machine, as the caption has it, and one trained on the model, as the loop does it.
Table figure42();

/// Variances of Figure 42's machine. The paper prints none: the middle one of the three of its
/// Fig. 41.
bias::BongoFaults figure42Noise();

/// The squares of its map, ±0.035 rad as printed, with 12 squares each way in place of 20.
Map figure42Map();

/// The machine with the same noise in every episode that begins alike, so that a policy costs the
/// same whenever a search asks.
std::unique_ptr<Plant> machineOfSameNoise(const bias::BongoFaults& faults, std::uint64_t seed);

/// The policy that costs least from wheel and board within half a degree.
/// @param on_machine  searched on the machine itself, else on the model
/// @param noise       of the plant it is searched on
/// @param stop        asks the search to end; then it may have found nothing
bias::FoundPolicy trainedWith(bool on_machine, const bias::BongoFaults& noise, std::uint64_t seed,
                              const std::stop_token& stop = {});

}  // namespace traceur::reproduce
