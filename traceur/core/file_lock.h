// Only one process at a time writes a file.
#pragma once

#include <filesystem>
#include <optional>

namespace traceur {

/// Whether the open descriptor could be locked, and still is what the name stands for. The lock
/// ends with the process, however that ends.
enum class Locked { kYes, kNo, kMoved, kFailed };  ///< kFailed: errno says why
Locked lockDescriptor(int fd, const std::filesystem::path& name);

/// While one lives, no other of the same file can be had, in this process or another. The lock is
/// on FILE-lock beside the file, which goes with it: SQLite loses its own locks when anyone in the
/// process closes a descriptor of the file itself. What a killed process left locks nobody out.
class FileLock {
 public:
  /// @return nothing when somebody else has it
  /// @throws SystemError "FILE-lock: cannot be locked: …"
  static std::optional<FileLock> tryToTake(const std::filesystem::path& file);
  /// @throws InputError "FILE: another process is writing it"; SystemError as above
  static FileLock take(const std::filesystem::path& file);
  /// Removes what a killed process left of its lock, if it can be.
  static void sweep(const std::filesystem::path& file);
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;

 private:
  FileLock(std::filesystem::path name, int fd) : name_(std::move(name)), fd_(fd) {}

  std::filesystem::path name_;
  int fd_ = -1;
};

}  // namespace traceur
