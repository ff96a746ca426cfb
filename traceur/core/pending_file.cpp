#include "traceur/core/pending_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "traceur/core/error.h"
#include "traceur/core/file_lock.h"

namespace traceur {
namespace {

std::string because(int error) {
  return std::generic_category().message(error);
}

constexpr std::string_view kEnding = ".part";

/// ".NAME.": what names beside a file begin with; a number, "-", a number and kEnding follow.
std::string beginningOf(const std::filesystem::path& file) {
  return fmt::format(".{}.", file.filename().string());
}

bool isPartOf(std::string_view name, std::string_view beginning) {
  if (name.size() < beginning.size() + kEnding.size()) return false;
  if (!name.starts_with(beginning) || !name.ends_with(kEnding)) return false;
  name.remove_prefix(beginning.size());
  name.remove_suffix(kEnding.size());
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  const size_t dash = std::min(name.find('-'), name.size() - 1);
  return is_number(name.substr(0, dash)) && is_number(name.substr(dash + 1));
}

/// Removes it unless a process has it locked: a living one, on whatever machine.
void removeIfAbandoned(const std::filesystem::path& part) {
  // To be written: some network disks lock nothing else.
  const int fd = open(part.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return;
  if (lockDescriptor(fd, part) == Locked::kYes) unlink(part.c_str());
  close(fd);
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
  sweep(path_);
  for (int n = 0; fd_ < 0; ++n) {
    beside_ =
        path_.parent_path() / fmt::format("{}{}-{}{}", beginningOf(path_), getpid(), n, kEnding);
    fd_ = open(beside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ < 0 && errno != EEXIST) fail(because(errno));
    if (fd_ < 0) continue;
    // Another process may have swept it before it was locked; a disk without locks has no sweeping.
    const Locked locked = lockDescriptor(fd_, beside_);
    if (locked == Locked::kYes || locked == Locked::kFailed) continue;
    close(fd_);
    fd_ = -1;
  }
}

void PendingFile::sweep(const std::filesystem::path& file) {
  const std::string beginning = beginningOf(file);
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code ignored;  // what cannot be looked at is left
  std::filesystem::directory_iterator entry(folder, ignored);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(ignored)) {
    if (isPartOf(entry->path().filename().string(), beginning)) removeIfAbandoned(entry->path());
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
