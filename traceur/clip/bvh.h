// Clips as Biovision Hierarchy files, which animation programs read.
#pragma once

#include <string>
#include <string_view>

#include "traceur/clip/clip.h"

namespace traceur::clip {

/// Centimetres and y up, z forward, x left, as those programs take a file of no stated unit to be.
/// Seven digits after the point of angles [deg], five of lengths.
std::string toBvh(const Clip& clip);

/// Any order of channels, any number of them. Where a file's skeleton stands at rest is at [0, 0,
/// 0] turned nowhere: many have the arms stretched out.
/// @param name   of the file, for messages
/// @param metre  the file's lengths of one metre: 100 are centimetres
/// @throws InputError with the line: what was expected, what stands there
Clip fromBvh(std::string_view text, const std::string& name, double metre = 100);

}  // namespace traceur::clip
