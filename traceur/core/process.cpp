#include "traceur/core/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include "traceur/core/error.h"

namespace traceur {
namespace {

constexpr off_t kMostWords = 2000;  // of a failed program's complaints, the last ones [ours]

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

/// Ours, without the variables that begin so; ends in a null, as a program expects it.
std::vector<char*> environmentWithout(std::string_view hidden) {
  std::vector<char*> variables;
  for (char** v = environ; *v; ++v) {
    if (hidden.empty() || !std::string_view(*v).starts_with(hidden)) variables.push_back(*v);
  }
  variables.push_back(nullptr);
  return variables;
}

}  // namespace

Process::Process(const std::vector<std::string>& argv, Output output, std::string_view hidden)
    : name_(argv.at(0)), output_(output) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) failToRun(name_, errno);
  input_ = ends[0];
  words_ = memfd_create("words", MFD_CLOEXEC);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
  if (output == Output::kTalk) {
    posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&files, words_, STDERR_FILENO);
  }
  // The program starts with no signal blocked or ignored, whatever ours are.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  sigset_t pipe = none;
  sigaddset(&pipe, SIGPIPE);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &pipe);
  short flags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
  if (output == Output::kTalk) {
    // Ctrl-C on the terminal is ours to answer: a program of its own group does not see it.
    posix_spawnattr_setpgroup(&attributes, 0);
    flags |= POSIX_SPAWN_SETPGROUP;
  }
  posix_spawnattr_setflags(&attributes, flags);

  std::vector<char*> args;
  args.reserve(argv.size() + 1);
  for (const std::string& a : argv) args.push_back(const_cast<char*>(a.c_str()));
  args.push_back(nullptr);
  const std::vector<char*> environment = environmentWithout(hidden);
  const int error =
      posix_spawnp(&pid_, args[0], &files, &attributes, args.data(), environment.data());
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  close(ends[1]);
  if (error != 0) {
    close(input_);
    close(words_);
    failToRun(name_, error);
  }
}

Process::~Process() {
  if (pid_ > 0) {
    // One that talks leads a group of its own: a shell's simulation must not outlive the shell.
    kill(output_ == Output::kTalk ? -pid_ : pid_, SIGKILL);
    wait();
  }
  closeInput();
  close(words_);
}

void Process::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) bytes.remove_prefix(n);
    if (n >= 0 || errno == EINTR) continue;
    finish();  // the program's own words say more than "broken pipe"
    throw SystemError(fmt::format("{} stopped before it had read everything", name_));
  }
}

std::string Process::readLine() {
  while (true) {
    if (const size_t end = heard_.find('\n'); end != std::string::npos) {
      std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      return line;
    }
    char buffer[4096];
    const ssize_t n = recv(input_, buffer, sizeof buffer, 0);
    if (n > 0) heard_.append(buffer, n);
    if (n > 0 || (n < 0 && errno == EINTR)) continue;
    finish();
    throw SystemError(fmt::format("{} ended (exit 0) though an answer was due", name_));
  }
}

bool Process::hasMore() {
  char byte = 0;
  return !heard_.empty() || recv(input_, &byte, 1, MSG_DONTWAIT | MSG_PEEK) > 0;
}

bool Process::answersWithin(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (heard_.find('\n') == std::string::npos) {
    const std::chrono::duration<double, std::milli> left = end - std::chrono::steady_clock::now();
    pollfd wait{input_, POLLIN, 0};
    const int ready = poll(&wait, 1, std::max(0, static_cast<int>(left.count())));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return false;
    char buffer[4096];
    const ssize_t n = recv(input_, buffer, sizeof buffer, 0);
    if (n <= 0) break;  // its end; readLine() says so
    heard_.append(buffer, n);
  }
  return true;
}

std::string Process::finish() {
  closeInput();
  const int status = wait();
  std::string said = words();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return said;
  const std::string how = WIFSIGNALED(status)
                              ? fmt::format("was stopped by signal {}", WTERMSIG(status))
                              : fmt::format("failed (exit {})", WEXITSTATUS(status));
  throw SystemError(fmt::format("{} {}{}{}", name_, how, said.empty() ? "" : ": ", said));
}

void Process::closeInput() {
  if (input_ >= 0) close(input_);
  input_ = -1;
}

int Process::wait() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
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
