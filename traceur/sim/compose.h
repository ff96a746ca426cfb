// A scene as what the engine compiles.
#pragma once

#include "traceur/sim/engine.h"
#include "traceur/sim/scene.h"

namespace traceur::sim {

/// The robot's file with its masses scaled, its limits and one plain motor per driven joint put in
/// place of its own actuators; ground, props, lights and sky in place of its own. Names of ours
/// give way to the file's. A motor's forcerange holds what the file says of the torque; nothing
/// limits it.
/// @throws InputError naming the file and what is wrong in it
SpecPointer compose(const Scene& scene);

/// Name of the `<numeric>` with the number of props, whose bodies are the document's last: what is
/// before them is the robot's.
inline constexpr const char* kPropsName = "traceur_props";

}  // namespace traceur::sim
