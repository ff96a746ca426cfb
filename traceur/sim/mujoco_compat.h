// Every difference between MuJoCo 2.2 and 3.x that concerns us, and nothing else.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace traceur::sim {

using ModelPointer = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;

/// Does work that compiles in a process of its own (core/guarded.h): files from strangers can crash
/// the engine, and can ask for more time or memory than there is.
/// @param what  begins the message: the robot's file
std::string compiledApart(std::string_view what, const std::function<std::string()>& work);

/// A compiled model as bytes of this engine's version on this machine, and back.
std::string toBytes(const mjModel& model);
ModelPointer toModel(std::string_view bytes);

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
/// directory); divergence is read from mjData's counters instead. Its errors end guarded work, else
/// the program. Called before any model exists.
void quietMujoco();

}  // namespace traceur::sim
