#include "traceur/core/file_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "traceur/core/error.h"

namespace traceur {
namespace {

std::filesystem::path lockOf(const std::filesystem::path& file) {
  return file.string() + "-lock";
}

[[noreturn]] void fail(const std::filesystem::path& name, int error) {
  throw SystemError(fmt::format("{}: cannot be locked: {}", name.string(),
                                std::generic_category().message(error)));
}

}  // namespace

Locked lockDescriptor(int fd, const std::filesystem::path& name) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    return errno == EWOULDBLOCK ? Locked::kNo : Locked::kFailed;
  }
  struct stat ours = {};
  struct stat named = {};
  const bool same = fstat(fd, &ours) == 0 && lstat(name.c_str(), &named) == 0 &&
                    ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
  return same ? Locked::kYes : Locked::kMoved;
}

std::optional<FileLock> FileLock::tryToTake(const std::filesystem::path& file) {
  const std::filesystem::path name = lockOf(file);
  while (true) {
    const int fd = open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0) fail(name, errno);
    const Locked locked = lockDescriptor(fd, name);
    const int error = errno;
    if (locked == Locked::kYes) return FileLock(name, fd);
    close(fd);
    if (locked == Locked::kNo) return std::nullopt;
    if (locked == Locked::kFailed) fail(name, error);
    // kMoved: its last holder removed it between our two calls.
  }
}

FileLock FileLock::take(const std::filesystem::path& file) {
  if (std::optional<FileLock> lock = tryToTake(file)) return std::move(*lock);
  throw InputError(fmt::format("{}: another process is writing it", file.string()));
}

void FileLock::sweep(const std::filesystem::path& file) {
  const std::filesystem::path name = lockOf(file);
  const int fd = open(name.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return;
  if (lockDescriptor(fd, name) == Locked::kYes) unlink(name.c_str());
  close(fd);
}

FileLock::~FileLock() {
  if (fd_ < 0) return;
  unlink(name_.c_str());  // while it is still locked: nobody else's
  close(fd_);
}

FileLock::FileLock(FileLock&& other) noexcept
    : name_(std::move(other.name_)), fd_(std::exchange(other.fd_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(fd_, other.fd_);
  return *this;
}

}  // namespace traceur
