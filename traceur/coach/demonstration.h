// A script from a motion that somebody showed.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "traceur/clip/clip.h"
#include "traceur/sim/model.h"

namespace traceur::coach {

/// The clip's motion by the robot: the root where the clip's is, by as much further or less as its
/// legs are longer or shorter, its hinges turned so that each
/// bone points as the clip's does (least squares within the hinges' limits, frame after frame).
/// A bone of the clip is a body of the robot by its name, or by what motion capture usually calls
/// it ("LeftUpLeg", "lShldr"). Where the clip's skeleton stands otherwise at rest, as with arms
/// stretched out, its bones' directions count, not its angles.
/// @param model  with a robot's file
/// @throws InputError where the root or a leg is not known among the bones
std::vector<sim::State> followed(const clip::Clip& clip,
                                 const std::shared_ptr<const sim::Model>& model);

/// A script of the jump that a clip shows: its phases by when the body flies, a key pose for each
/// from what the clip has there, and instructions with its numbers (how low, how fast off, where
/// feet and COM come down). Sides that differ by less than five degrees share a pose.
/// @param what  for the comment at its top
/// @throws InputError where nothing flies for a tenth of a second, or as followed
std::string scriptOf(const clip::Clip& clip, const std::shared_ptr<const sim::Model>& model,
                     const std::string& what);

}  // namespace traceur::coach
