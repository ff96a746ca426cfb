// The physics engine's parser and compiler, and its ways to fail.
#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "traceur/core/guarded.h"

namespace traceur::sim {

using ModelPointer = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;
using SpecPointer = std::unique_ptr<mjSpec, decltype(&mj_deleteSpec)>;

/// Does work that compiles in a process of its own (core/guarded.h): files from strangers can crash
/// the engine, and can ask for more time or memory than there is.
/// @param what  begins the message: the robot's file
std::string compiledApart(std::string_view what, const std::function<std::string()>& work,
                          const GuardLimits& limits = {});

/// What the engine reads: an MJCF or URDF file, and a text of either. Paths in a text are absolute.
/// @return null on failure, with the engine's words in error
/// @throws SystemError where the engine is not of the version Traceur was compiled with
SpecPointer parseFile(const std::filesystem::path& file, std::string& error);
SpecPointer parseText(const std::string& text, std::string& error);
/// @return null on failure, with the engine's words in error
ModelPointer compile(mjSpec& spec, std::string& error);
ModelPointer compileText(const std::string& text, std::string& error);
/// A compiled specification as MJCF, its numbers with six digits.
/// @return empty on failure, with the engine's words in error
std::string toXml(const mjSpec& spec, std::string& error);

/// A compiled model as bytes of this engine's version on this machine, and back.
std::string toBytes(const mjModel& model);
ModelPointer toModel(std::string_view bytes);

/// Does calls of the engine alone (its errors jump out of them: no destructor would run).
/// @return false where an error of the engine ended them, such as too little room; its mjData may
///         then only be reset
bool completes(void (*calls)(const mjModel*, mjData*), const mjModel* model, mjData* data);

/// Sends MuJoCo's warnings nowhere (by default it appends to MUJOCO_LOG.TXT in the working
/// directory); divergence is read from mjData's counters instead. Its errors end completes(), else
/// guarded work, else the program. Called before any model exists.
void quietMujoco();

}  // namespace traceur::sim
