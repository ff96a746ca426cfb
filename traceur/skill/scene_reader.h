// The [scene] of a skill file.
#pragma once

#include <vector>

#include "traceur/core/toml.h"
#include "traceur/sim/scene.h"

namespace traceur::skill {

/// A table's list of three numbers.
sim::Vector3d readVector(const TomlReader& r, const char* key);

/// Ground and props; mistakes are noted in the reader's diagnostics.
/// @return each prop's place in the text, by index in scene.props
std::vector<TomlReader> readScene(const TomlReader& s, sim::Scene& scene);

}  // namespace traceur::skill
