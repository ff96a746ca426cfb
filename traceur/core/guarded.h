// Work on what a stranger wrote, which may crash, hang or eat all memory.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace traceur {

/// What such work may take.
struct GuardLimits {
  int seconds = 4;              ///< of a processor; of waiting, ten times as many
  long memory = 1'000'000'000;  ///< more than there is already [bytes]; not under sanitizers
};

/// Does the work in a copy of this process, so that nothing it does or breaks is seen here but what
/// it returns. Locks that it takes must be free, or held by the caller. Under sanitizers a process
/// of several threads does it here, without limits.
/// @param what  begins the message: "robot.xml"
/// @throws InputError, SystemError: those of the work. InputError "WHAT: …" where it crashed, took
///         longer or needed more memory; SystemError where there can be no other process
std::string guarded(std::string_view what, const std::function<std::string()>& work,
                    const GuardLimits& limits = {});

/// Ends guarded work with an InputError "WHAT: …" of these words, from where nothing may be thrown,
/// such as an engine's own error handler. Elsewhere the words go to standard error and the program
/// aborts.
[[noreturn]] void failGuarded(const char* words);

}  // namespace traceur
