#include "traceur/core/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "traceur/core/keeper.h"

namespace traceur {
namespace {

using namespace std::chrono_literals;

constexpr off_t kMostWords = 2000;  // of a failed program's complaints, the last ones [ours]
/// A program that closed its input or output gets so long to end by itself, and say why [ours].
constexpr auto kToEnd = 2s;
/// A request to stop is noticed so soon [ours].
constexpr auto kStopNoticed = 50ms;

[[noreturn]] void failToRun(const std::string& program, int error) {
  if (error == ENOENT && program.find('/') != std::string::npos) {
    throw SystemError(fmt::format("cannot run {}: there is no such file", program));
  }
  throw SystemError(
      error == ENOENT
          ? fmt::format("cannot run {0}: it is not on the PATH. Install it (Debian: "
                        "apt install {0}{1})",
                        program, program == "gnuplot" ? "-nox" : "")
          : fmt::format("cannot run {}: {}", program, std::generic_category().message(error)));
}

}  // namespace

Process::Process(const std::vector<std::string>& argv, Output output, std::string_view hidden)
    : name_(argv.at(0)) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) failToRun(name_, errno);
  input_ = ends[0];
  words_ = memfd_create("words", MFD_CLOEXEC);
  const bool talks = output == Output::kTalk;
  const Keeper keeper = startKept({.argv = argv,
                                   .input = ends[1],
                                   .output = talks ? ends[1] : -1,
                                   .error = talks ? -1 : words_,
                                   .hidden = hidden});
  close(ends[1]);
  if (keeper.error != 0) {
    close(input_);
    close(words_);
    failToRun(name_, keeper.error);
  }
  keeper_ = keeper.pid;
  life_ = keeper.life;
}

Process::~Process() {
  if (keeper_ > 0) wait();
  closeInput();
  close(words_);
}

void Process::heed(std::stop_token stop, double grace) {
  stop_ = std::move(stop);
  grace_ = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(grace));
}

/// Waits until fd is ready for the events, or closed.
/// @return whether it is
bool Process::ready(int fd, short events, Clock::time_point until) {
  while (true) {
    const Clock::time_point now = Clock::now();
    if (stop_.stop_requested()) {
      if (!patience_) patience_ = now + grace_;
      if (now >= *patience_) throw GivenUp(fmt::format("{}: asked to stop", name_));
    }
    Clock::duration longest = std::max(until - now, Clock::duration::zero());
    if (stop_.stop_possible()) longest = std::min<Clock::duration>(longest, kStopNoticed);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(longest);
    pollfd wait{fd, events, 0};
    // In slices that fit an int.
    const int n = poll(&wait, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 60'000)));
    if (n > 0) return true;
    if (n == 0 && Clock::now() >= until) return false;
  }
}

void Process::write(std::string_view bytes) {
  while (!bytes.empty()) {
    ready(input_, POLLOUT, Clock::time_point::max());
    const ssize_t n = send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) bytes.remove_prefix(n);
    if (n >= 0 || errno == EINTR || errno == EAGAIN) continue;
    missing("stopped before it had read everything");
  }
}

/// Hears more of a line that has no end yet.
/// @return whether the line, or the program's end, came in time
bool Process::hear(Clock::time_point until) {
  size_t searched = 0;
  while (heard_.find('\n', searched) == std::string::npos && !silent_) {
    searched = heard_.size();
    if (searched > kMostLine) {
      throw SystemError(
          fmt::format("{} answered with a line of more than {} bytes", name_, kMostLine));
    }
    if (!ready(input_, POLLIN, until)) return false;
    char buffer[65536];
    const ssize_t n = recv(input_, buffer, sizeof buffer, MSG_DONTWAIT);
    if (n > 0) heard_.append(buffer, n);
    silent_ = n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN);
  }
  return true;
}

std::string Process::readLine() {
  hear(Clock::time_point::max());
  const size_t end = heard_.find('\n');
  if (end == std::string::npos) missing("ended (exit 0) though an answer was due");
  std::string line = heard_.substr(0, end);
  heard_.erase(0, end + 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

bool Process::hasMore() {
  char byte = 0;
  return !heard_.empty() || recv(input_, &byte, 1, MSG_DONTWAIT | MSG_PEEK) > 0;
}

bool Process::answersWithin(double seconds) {
  return hear(Clock::now() +
              std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
}

std::string Process::finish() {
  closeInput();
  ready(life_, POLLIN, Clock::time_point::max());
  const int status = wait();
  std::string said = words();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return said;
  const std::string how = WIFSIGNALED(status)
                              ? fmt::format("was stopped by signal {}", WTERMSIG(status))
                              : fmt::format("failed (exit {})", WEXITSTATUS(status));
  throw Ended(fmt::format("{} {}{}{}", name_, how, said.empty() ? "" : ": ", said));
}

/// What the program was to do next it will not do.
/// @throws Ended in the program's own words where there are some: they say more than "broken pipe"
void Process::missing(const std::string& why) {
  closeInput();
  if (!ready(life_, POLLIN, Clock::now() + kToEnd)) {
    throw Ended(fmt::format("{} closed its input or output, and did not end", name_));
  }
  finish();
  throw Ended(fmt::format("{} {}", name_, why));
}

void Process::closeInput() {
  if (input_ >= 0) close(input_);
  input_ = -1;
}

/// Ends the program if it has not ended.
/// @return how it ended
int Process::wait() {
  close(life_);
  int status = 0;
  while (waitpid(keeper_, &status, 0) < 0 && errno == EINTR) {
  }
  keeper_ = -1;
  return status;
}

std::string Process::words() const {
  std::string text;
  const off_t size = lseek(words_, 0, SEEK_END);
  if (size <= 0) return text;
  const off_t from = std::max<off_t>(0, size - kMostWords);
  text.resize(size - from);
  const ssize_t n = pread(words_, text.data(), text.size(), from);
  text.resize(n > 0 ? n : 0);
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  while (!text.empty() && (text.front() == '\n' || text.front() == ' ')) text.erase(0, 1);
  return text;
}

}  // namespace traceur
