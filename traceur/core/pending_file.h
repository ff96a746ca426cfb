// A file that appears under its name only when it is complete.
#pragma once

#include <filesystem>
#include <string_view>

namespace traceur {

/// Makes a folder and those above it, where there are none. "": nothing to make.
/// @throws SystemError "PATH: cannot make the folder: …"
void makeFolder(const std::filesystem::path& folder);

/// Life of a pending file:
///   1. The constructor makes an empty file beside the final one, under another name.
///   2. Either write() fills it, or another program does through beside() or plainName().
///   3. commit() gives it its name, replacing what was there; without it the destructor removes it.
/// All throw SystemError "cannot write PATH: …". What a killed process left under the other name,
/// the next pending file of the same final name removes; a lock tells it from what is being
/// written.
class PendingFile {
 public:
  explicit PendingFile(std::filesystem::path path);
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  /// Removes what killed processes left beside a file; what cannot be removed stays.
  static void sweep(const std::filesystem::path& file);

  const std::filesystem::path& beside() const { return beside_; }
  /// The same file under a name that has no odd letters, whatever its own has: for a program that
  /// finds a meaning in some. Good while this object lives.
  std::filesystem::path plainName() const;
  void write(std::string_view bytes);
  void commit();

 private:
  [[noreturn]] void fail(std::string_view why) const;

  std::filesystem::path path_;
  std::filesystem::path beside_;
  int fd_ = -1;
};

}  // namespace traceur
