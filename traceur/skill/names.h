// Which names an expression of a skill file may use, by where it stands.
#pragma once

namespace traceur::skill {

/// kSetup: parameters, task, horizon. kRunning: also time, phase_time and every control::Signals
/// name. kVerdict: kSetup, time, measures and failures.
enum class Scope { kSetup, kRunning, kVerdict };

}  // namespace traceur::skill
