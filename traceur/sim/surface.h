// Grounds that a body may come down on.
#pragma once

#include <string>
#include <vector>

#include "traceur/sim/scene.h"

namespace traceur::sim {

struct Surface {
  std::string name;
  std::string help;  ///< what it is, in a few words
  Material material;
};

/// Every surface; a new one is a line in surface.cpp.
const std::vector<Surface>& surfaces();
/// @throws InputError "no surface named …" with a suggestion
const Surface& findSurface(const std::string& name);

}  // namespace traceur::sim
