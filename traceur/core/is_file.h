#pragma once

#include <filesystem>
#include <system_error>

namespace traceur {

/// Whether a regular file is there. A name that no file can have (too long, a loop of links) is
/// none: std::filesystem would throw what is no InputError.
inline bool isFile(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_regular_file(path, none);
}

}  // namespace traceur
