// A scene as what the engine compiles.
#pragma once

#include "traceur/sim/engine.h"
#include "traceur/sim/model_file.h"
#include "traceur/sim/scene.h"

namespace traceur::sim {

/// What the robot's file says; null without a robot.
/// @throws InputError naming file and line
std::shared_ptr<const ModelFile> sourceOf(const Scene& scene);

/// The scene as the engine steps it: the robot's file with its masses scaled, its limits and one
/// plain motor per driven joint put in place of its own actuators; ground, props, lights and sky in
/// place of its own. Names of ours give way to the file's. A motor's forcerange holds what the file
/// says of the torque; nothing limits it. What is only seen is left out.
/// @throws InputError naming the file and what is wrong in it
ModelPointer composePhysics(const Scene& scene, const ModelFile* source);

/// The same with all that is seen, as MJCF text: its numbers have six digits, its paths are
/// absolute. Meshes make this up to a thousand times slower.
std::string composeMjcf(const Scene& scene, const ModelFile* source);

/// The robot's file as it is, without what is only seen.
/// @throws InputError naming the file and what is wrong in it
ModelPointer compileAlone(const ModelFile& source);

/// Compiles without what is only seen. Geoms that cannot touch anything took a quarter of a step of
/// a robot with 52 of them, in kinematics and in the search for contacts.
/// @return null on failure, with the engine's words in error
ModelPointer compilePhysics(mjSpec& spec, std::string& error);

/// Name of the `<numeric>` with the number of props, whose bodies are the document's last: what is
/// before them is the robot's.
inline constexpr const char* kPropsName = "traceur_props";

}  // namespace traceur::sim
