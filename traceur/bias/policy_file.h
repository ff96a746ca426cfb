// A balance policy as a file, to keep, to carry to a machine, and to compile into its program.
#pragma once

#include <filesystem>
#include <string>

#include "traceur/bias/balance.h"

namespace traceur::bias {

/// Writes
///
///     {"format": "traceur policy", "version": 1, "plant": "bongo board",
///      "parameters": [ĥ_1 … ĥ_5], "gains": {"place": {"value": H_1, "unit": "N"}, …},
///      "most_torque": 100, "torque": "…in words…"}
///
/// Only format, plant and parameters are read again; the rest is for people and other programs.
void writePolicy(const std::filesystem::path& file, const VectorXd& parameters);

/// @return the parameters (5)
/// @throws InputError naming file and key for what is no such file, or parameters out of bounds
VectorXd readPolicy(const std::filesystem::path& file);

/// A C header with the gains and a function that computes the torque from the six readings: no
/// heap, single precision, math.h alone.
std::string cHeader(const VectorXd& parameters, const BongoParameters& board = {});

}  // namespace traceur::bias
