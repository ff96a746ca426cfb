// What the fuzz targets share. Each takes bytes from a stranger where the program takes them, and
// holds that they are refused with an InputError or used: anything else is a finding.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "traceur/core/error.h"

/// libFuzzer's entry.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace traceur::fuzz {

inline std::string_view textOf(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Runs what may throw InputError; any other exception ends the target.
/// @return the refusal's words
template <typename Work>
std::string maybeRefused(const Work& work) {
  try {
    work();
  } catch (const InputError& e) {  // as it should be
    return e.what();
  }
  return "";
}

/// A folder in memory that lives as long as the target.
inline const std::filesystem::path& folder() {
  static const std::filesystem::path kFolder = [] {
    const std::filesystem::path shared = "/dev/shm";
    std::string name =
        ((std::filesystem::is_directory(shared) ? shared : std::filesystem::temp_directory_path()) /
         "traceur-fuzz-XXXXXX")
            .string();
    if (!mkdtemp(name.data())) std::abort();
    static std::string kept;
    kept = name;
    std::atexit([] {
      std::error_code ignored;
      std::filesystem::remove_all(kept, ignored);
    });
    return std::filesystem::path(name);
  }();
  return kFolder;
}

/// The bytes as a file of that name.
inline std::filesystem::path fileOf(std::string_view bytes, const std::string& name) {
  const std::filesystem::path file = folder() / name;
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

}  // namespace traceur::fuzz
