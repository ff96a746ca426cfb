// traceur coach --session: an instruction, a search, a film strip, and the next one.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <utility>

#include "traceur/coach/why.h"

namespace traceur::cli {

/// What a session does with a script that has changed.
struct SessionHooks {
  std::function<coach::Lesson(const coach::Script&)> practise;
  std::function<void(const coach::Lesson&, const coach::Script&)> report;
  std::function<void(const coach::Script&, const coach::Why&)> help;  ///< tries, and tells
  std::function<void(const coach::Lesson&)> draw;
  /// Two folders of lessons, with their names: says what each phase came to, and draws both.
  std::function<void(const std::pair<std::string, std::filesystem::path>&,
                     const std::pair<std::string, std::filesystem::path>&)>
      compare;
};

/// Reads lines until their end or "quit": an instruction, with its phase before it or for the phase
/// that was named last, or a command. What is not understood changes nothing.
/// @param script  as it begins; its text is kept in `folder` as it changes
/// @return exit code
int runSession(const coach::Script& script, const std::filesystem::path& folder, std::istream& in,
               const SessionHooks& hooks);

}  // namespace traceur::cli
