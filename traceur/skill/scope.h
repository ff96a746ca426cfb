// Which names an expression of a skill file may use, by where it stands.
#pragma once

namespace traceur::skill {

/// kConstant: the file's constants. kSetup: those, parameters, conditions, task, horizon and values
/// made of them. kRunning: also values of signals, time,
/// phase_time, in.PHASE, ended.PHASE and every control::Signals name. kVerdict: kSetup, time,
/// measures and failures, and those of parts.
enum class Scope { kConstant, kSetup, kRunning, kVerdict };

}  // namespace traceur::skill
