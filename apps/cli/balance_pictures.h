// The bongo board on paper: a strip of model and machine side by side, and a map of what a policy
// balances from.
#pragma once

#include <filesystem>

#include "traceur/bias/bongo_learning.h"

namespace traceur::cli {

/// Two rows of panels, model above machine, from one start; a run that fails stays as it ended.
void writeBalanceStrip(const std::filesystem::path& file, const bias::BongoMachine& machine,
                       const Eigen::VectorXd& parameters, const Eigen::VectorXd& x0);

/// Runs the machine from a grid of wheel and board angles, `count` each way within ±`angle` [rad],
/// `tries` times from each, draws it, and writes the numbers beside it as CSV.
/// @return the part of runs that stayed up
double writeBalanceMap(const std::filesystem::path& file, const bias::BongoMachine& machine,
                       const Eigen::VectorXd& parameters, double angle, int count, int tries,
                       std::uint64_t seed);

}  // namespace traceur::cli
