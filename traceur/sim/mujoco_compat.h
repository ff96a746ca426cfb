// Every difference between MuJoCo 2.2 and 3.x that concerns us, and nothing else.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace traceur::sim {

/// Compiles an MJCF or URDF text.
/// @return null on failure, with MuJoCo's words in error
/// @throws SystemError where the engine is not of the version Traceur was compiled with
mjModel* loadXmlText(const std::string& text, std::string& error);

/// Compiles a URDF text and writes it back as MJCF.
/// @return empty on failure, with MuJoCo's words in error
std::string urdfToMjcf(const std::string& urdf, std::string& error);

/// Attributes for `<size>`, where room has to be declared: for a robot on the ground and for
/// `contacts` more of `rows` constraints each.
std::string sizeAttributes(int contacts, int rows);

/// Whether a light shines from afar: MuJoCo 2 has a flag where 3 has a kind, 1 being directional.
template <class Light>
bool isDirectional(const Light& light) {
  if constexpr (requires { light.directional; }) {
    return light.directional != 0;
  } else {
    return light.type == 1;
  }
}

/// Sends MuJoCo's warnings nowhere (by default it appends to MUJOCO_LOG.TXT in the working
/// directory); divergence is read from mjData's counters instead. Called before any model exists.
void quietMujoco();

}  // namespace traceur::sim
