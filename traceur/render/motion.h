// Reading a recording between its frames, and finding the moments that tell its story.
#pragma once

#include <string>
#include <vector>

#include "traceur/sim/model.h"
#include "traceur/sim/recording.h"

namespace traceur::render {

/// @throws InputError for a recording without frames, or whose frames are not of its model, lack a
/// number or do not go forward in time
void checkRecording(const sim::Model& model, const sim::Recording& recording);

/// The world at a time: positions and velocities between the two nearest frames, contacts, torques
/// and phase of the last frame up to then. Outside the recording its first or last frame.
sim::Frame frameAt(const sim::Model& model, const sim::Recording& recording, double time);

/// When a phase begins [s] and its name.
struct PhaseStart {
  double time = 0;
  std::string name;
};

/// The phases in the order they are entered, the first at the start.
std::vector<PhaseStart> phaseStarts(const sim::Recording& recording);
/// "" for a frame without a named phase.
std::string phaseName(const sim::Recording& recording, const sim::Frame& frame);

/// `count` times that show what happens, in order. Taken as long as there is room: start, end, then
/// for each flight (the robot touches nothing fixed for at least 0.03 s) the apex, the touchdown
/// and the take-off, the longest flight first, then beginnings of phases, each time the farthest
/// from what is taken, so that a gait is shown to its end. A moment that nearly repeats another (a
/// quarter of an even spacing) is left out; what is missing halves the longest gap, again and
/// again.
std::vector<double> tellingTimes(const sim::Model& model, const sim::Recording& recording,
                                 int count);

}  // namespace traceur::render
