// A fall problem and its value table as one file: planning on a microcontroller, and a table that
// need not be made twice.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "traceur/fall/value_table.h"

namespace traceur::fall {

/// Of all that decides a table: equal problems and grids have equal fingerprints, in any process.
std::uint64_t fingerprintOf(const FallProblem& problem, const ValueGrid& grid = {});

/// What a library says it was made for.
struct LibraryLabel {
  std::string robot;      ///< at most 31 bytes; longer ones are cut
  std::string stance;     ///< the same
  std::string direction;  ///< at most 11
};

/// The file that embedded/fall_plan.h lays out and reads.
/// @throws InputError for a pendulum other than the default one, which is all the reader knows
std::string compileLibrary(const FallProblem& problem, const ValueTable& table,
                           const LibraryLabel& label);

/// The value table of such a file.
/// @param name  of the file, for messages
/// @throws InputError for bytes that are no library, of another version, damaged, or made for
///         another robot, stance or options than the problem
ValueTable tableFromLibrary(std::string_view bytes, const FallProblem& problem,
                            const std::string& name);

/// The problem's table from `folder`, where it is kept under its fingerprint, or made anew and put
/// there. A folder that cannot be written, or a damaged file, costs the time to make it again.
ValueTable cachedTable(const FallProblem& problem, const LibraryLabel& label,
                       const std::filesystem::path& folder);

/// Where such tables are kept: traceur/falls under $XDG_CACHE_HOME, or ~/.cache; empty if neither
/// is an absolute path.
std::filesystem::path tableCache();

}  // namespace traceur::fall
