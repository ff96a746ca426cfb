// Recordings as glTF 2.0, which 3D programs, game engines and browsers show.
#pragma once

#include <string>

#include "traceur/sim/recording.h"

namespace traceur::render {

/// The bytes of a .glb file: a node for each body by its name, with its visible shapes as
/// triangles (but for height fields), and one animation that has where bodies are on their parents
/// at each frame. Metres; y up, z forward, x left, by the turn of the one node that holds all
/// others.
/// @throws InputError for a recording whose scene cannot be made again
std::string toGlb(const sim::Recording& recording);

}  // namespace traceur::render
