// A tunable number, declared once: the optimiser's bounds, the file's checks and the docs' table
// all read this row.
#pragma once

#include <string>
#include <vector>

namespace traceur {

struct ParamSpec {
  std::string name;
  std::string unit;    ///< SI, as printed: "rad", "N"; "" for a pure number
  double min = 0;      ///< in unit
  double max = 0;      ///< in unit, > min
  double initial = 0;  ///< in unit, min ≤ initial ≤ max
  std::string help;    ///< one sentence
};

using ParamSpecs = std::vector<ParamSpec>;

}  // namespace traceur
