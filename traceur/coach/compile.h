// A script becomes skill text: one skill for each phase, and one of them all.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "traceur/coach/script.h"

namespace traceur::coach {

/// What became of an instruction: the columns of [Ha2015, Table 6].
struct Reading {
  std::string phase;
  std::string said, means;
  int line = 0;
  std::vector<std::string> rigs;  ///< "IKPose<contact, root>"
  std::string term;               ///< of the objective; empty: none
  std::string constraint;         ///< empty: none
  std::string note;               ///< where it is read otherwise than printed
};

/// Numbers of the motion as it was before the instructions, by the names of the phase's measures.
using Before = std::map<std::string, double>;

struct CompiledPhase {
  std::string text;  ///< a skill file
  std::vector<Reading> readings;
};

/// @param previous  the run whose trial's end is where the phase begins; empty: the script's start
/// @param before    measures of the phase with its key pose alone; empty: not known yet, and the
///                  text is then only good for measuring them
CompiledPhase compilePhase(const Script& script, size_t phase,
                           const std::filesystem::path& previous, const Before& before);

/// What has been practised of a phase.
struct LearnedPhase {
  std::filesystem::path skill;  ///< its file
  std::vector<std::pair<std::string, double>> parameters;
};

/// All phases one after another, with what was learned as initial parameters: "leaning_root_pitch".
/// @param learned  of the first phases, at least one
std::string wholeText(const Script& script, const std::vector<LearnedPhase>& learned);

}  // namespace traceur::coach
