// A script becomes skill text: one skill for each phase, and one of them all.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "traceur/coach/rigs.h"
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

/// A failure of a phase's trial.
struct DraftFailure {
  std::string name, when;
  bool asked = false;  ///< by a relation: it ends practice's trials, not the motion when it is done
};

/// What a skill file has of a phase.
struct PhaseDraft {
  std::string name;  ///< as expressions have it: "follow_through"
  SkillDraft draft;
  std::string phase;  ///< the [[phase]]
  std::vector<DraftFailure> failures;
  std::vector<std::pair<std::string, std::string>> terms;  ///< name, cost
};

struct CompiledPhase {
  std::string text;  ///< a skill file of the phase alone
  PhaseDraft draft;
  std::vector<Reading> readings;
  bool informed = false;  ///< its search begins with a guess, near which it is to look
};

/// Cost at which a phase's practice ends [ours]; what failed trials cost at least. In metres and
/// metres per second the terms of others are below it.
inline constexpr double kGoodEnough = 0.02, kFailedCost = 3;

/// @param previous  the run whose trial's end is where the phase begins; empty: the script's start
/// @param before    measures of the phase with its key pose alone; empty: not known yet, and the
///                  text is then only good for measuring them
/// @param enough    cost at which its practice ends
CompiledPhase compilePhase(const Script& script, size_t phase,
                           const std::filesystem::path& previous, const Before& before,
                           double enough = kGoodEnough);

/// One skill of all phases: what is a phase's has its name before it, "leaning_root_pitch". What
/// relations asked for is not asked of it any more.
/// @param phases   compiled, of the first phases, at least one
/// @param learned  of each, by its parameters
std::string wholeText(const Script& script, const std::vector<PhaseDraft>& phases,
                      const std::vector<Eigen::VectorXd>& learned);

}  // namespace traceur::coach
