// A place for files that nobody keeps.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace traceur {

/// A new folder under the system's temporary one, which nobody else has; removed with all that is
/// in it.
class TemporaryFolder {
 public:
  /// @throws std::runtime_error when none can be made
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "traceur-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("cannot make " + name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace traceur
