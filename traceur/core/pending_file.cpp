#include "traceur/core/pending_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "traceur/core/error.h"

namespace traceur {
namespace {

std::string because(int error) {
  return std::generic_category().message(error);
}

}  // namespace

void makeFolder(const std::filesystem::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error) return;
  throw SystemError(
      fmt::format("{}: cannot make the folder: {}", folder.string(), error.message()));
}

PendingFile::PendingFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (path_.filename().empty() || std::filesystem::is_directory(path_, ignored)) {
    fail(path_.empty() ? "no file name" : "it is a directory");
  }
  for (int n = 0; fd_ < 0; ++n) {
    beside_ =
        path_.parent_path() / fmt::format(".{}.{}-{}.part", path_.filename().string(), getpid(), n);
    fd_ = open(beside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ < 0 && errno != EEXIST) fail(because(errno));
  }
}

PendingFile::~PendingFile() {
  if (fd_ < 0) return;
  close(fd_);
  unlink(beside_.c_str());
}

std::filesystem::path PendingFile::plainName() const {
  return fmt::format("/proc/{}/fd/{}", getpid(), fd_);
}

void PendingFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
    if (n < 0 && errno != EINTR) fail(because(errno));
    if (n > 0) bytes.remove_prefix(n);
  }
}

void PendingFile::commit() {
  // Some file systems report a full disk only here.
  if (fsync(fd_) != 0 && errno != EINVAL && errno != EROFS) fail(because(errno));
  if (rename(beside_.c_str(), path_.c_str()) != 0) fail(because(errno));
  close(fd_);
  fd_ = -1;
}

void PendingFile::fail(std::string_view why) const {
  throw SystemError(fmt::format("cannot write {}: {}", path_.string(), why));
}

}  // namespace traceur
