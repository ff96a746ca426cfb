// traceur perform --perturb: what a family withstands.
#pragma once

#include <cstdint>
#include <filesystem>

#include "traceur/practice/learned.h"

namespace traceur::cli {

struct PerturbOptions {
  std::filesystem::path run;  ///< the results are named after it
  int tasks = 0;              ///< evenly over the family's range, ≥ 2
  std::uint64_t seed = 1;     ///< of the disturbances drawn at random
  int threads = 0;
  bool picture = true;
  bool json = false;
};

/// Sweeps the family under each disturbance by itself, level by level, and under some drawn at
/// random of all of them together.
/// @return exit code
int perturb(const practice::LearnedFamily& family, const PerturbOptions& options);

}  // namespace traceur::cli
