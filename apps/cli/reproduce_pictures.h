// The pictures of what was reproduced.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "traceur/reproduce/table.h"

namespace traceur::cli {

/// A published figure that no table stands behind: each time it is drawn anew.
struct Drawing {
  std::string_view name;  ///< the word a person types: "figure-28"
  bool pixels;            ///< it can be a .png only, not an .svg
  /// Draws it and tells its numbers, with a sentence as "summary" where there is one.
  std::function<nlohmann::ordered_json(std::uint64_t seed, const std::filesystem::path& file)> draw;
};

const std::vector<Drawing>& drawings();

/// What a table's runs drew, as its Table::drawn says.
/// @throws InputError when there are no runs
void drawTable(const reproduce::Results& results, const std::filesystem::path& file);

}  // namespace traceur::cli
