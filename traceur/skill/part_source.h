// Where a skill that is a part of another one comes from.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace traceur::skill {

/// A skill file, or the skill that a run has practised for one task, with its best trial's numbers.
struct PartSource {
  std::string text;
  std::filesystem::path file;   ///< of the text
  std::vector<double> learned;  ///< by the skill's parameters; empty: their initial values
  std::optional<double> task;   ///< that was learned; none: the skill's default

  /// @throws InputError when the file cannot be read, or is a run that has learned nothing of one
  static PartSource fromFile(const std::filesystem::path& file);
};

}  // namespace traceur::skill
