// Skill files that are another one with other numbers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "traceur/core/error.h"
#include "traceur/core/toml.h"

namespace traceur::skill {

/// What a skill file says together with that which it is like. `like = "other.toml"` makes it the
/// other one, but for the name, the description, the robot and other single values that it says
/// itself, and for what it says in [controller], [scene], [start], [constants], [parameters] and
/// [conditions], key by key. A number alone is a parameter's initial value, a condition's default.
/// Phases and what belongs to them are the other one's.
struct LikeDocument {
  TomlValue document;  ///< lines of the other file count on after those of the own one
  std::string others;  ///< the texts that it is like, from the nearest on; empty: none

  /// @param diagnostics  of the own file; told which lines are another's, and of what cannot be
  /// @param open         files that are being read, to which it adds those it is like
  /// @throws InputError  where a text is not TOML
  static LikeDocument read(const std::string& text, const std::filesystem::path& file,
                           Diagnostics& diagnostics, std::vector<std::filesystem::path>& open);
};

}  // namespace traceur::skill
