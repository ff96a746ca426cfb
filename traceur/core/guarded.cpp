#include "traceur/core/guarded.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>

#include "traceur/core/error.h"
#include "traceur/core/sanitized.h"

#if defined(TRACEUR_SANITIZE_ADDRESS) || defined(TRACEUR_SANITIZE_THREAD)
#define TRACEUR_SANITIZED
#endif

namespace traceur {
namespace {

// The first byte of an answer.
constexpr char kDone = 'd';
constexpr char kInput = 'i';
constexpr char kSystem = 's';
constexpr char kEnds = 'e';  // by words of what it uses, which know of no file
constexpr char kMemory = 'm';

int answer_to = -1;  // in the copy: where its answer goes

/// Async-signal-safe.
void say(char kind, std::string_view words) {
  std::string_view parts[] = {{&kind, 1}, words};
  for (std::string_view& rest : parts) {
    while (!rest.empty()) {
      const ssize_t n = write(answer_to, rest.data(), rest.size());
      if (n < 0 && errno != EINTR) _exit(1);  // nobody listens
      if (n > 0) rest.remove_prefix(n);
    }
  }
}

/// Of this process, [bytes].
rlim_t memoryInUse() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return static_cast<rlim_t>(pages) * sysconf(_SC_PAGESIZE);
}

#ifdef TRACEUR_SANITIZED
/// With more than one, a copy of a sanitized process may wait for ever: for a lock of the
/// sanitizer's that another thread had.
long threads() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                       std::filesystem::directory_iterator());
}
#endif

void limit(const GuardLimits& limits, rlim_t in_use) {
  const rlim_t seconds = limits.seconds;
  const rlimit cpu{seconds, seconds + 1};
  setrlimit(RLIMIT_CPU, &cpu);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
#ifndef TRACEUR_SANITIZED  // they map terabytes
  const rlimit memory{in_use + limits.memory, in_use + limits.memory};
  setrlimit(RLIMIT_AS, &memory);
#else
  (void)in_use;
#endif
}

[[noreturn]] void doAndAnswer(const std::function<std::string()>& work) {
  try {
    say(kDone, work());
  } catch (const InputError& e) {
    say(kInput, e.what());
  } catch (const std::bad_alloc&) {
    say(kMemory, "");
  } catch (const std::exception& e) {
    say(kSystem, e.what());
  }
  _exit(0);
}

/// All that comes until the other end is closed; less where it takes longer.
std::string hear(int from, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::string answer;
  while (true) {
    const std::chrono::duration<double, std::milli> left = end - std::chrono::steady_clock::now();
    pollfd wait{from, POLLIN, 0};
    const int ready = poll(&wait, 1, std::max(0, static_cast<int>(left.count())));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return answer;
    char buffer[1 << 16];
    const ssize_t n = read(from, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return answer;
    answer.append(buffer, n);
  }
}

}  // namespace

std::string guarded(std::string_view what, const std::function<std::string()>& work,
                    const GuardLimits& limits) {
#ifdef TRACEUR_SANITIZED
  if (threads() > 1) return work();
#endif
  int ends[2];
  const rlim_t in_use = memoryInUse();
  const pid_t copy = pipe2(ends, O_CLOEXEC) == 0 ? fork() : -1;
  if (copy < 0) {
    throw SystemError(
        fmt::format("{}: cannot be read in a process of its own: {}", what, std::strerror(errno)));
  }
  if (copy == 0) {
    answer_to = ends[1];
    close(ends[0]);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    limit(limits, in_use);
    doAndAnswer(work);
  }
  close(ends[1]);
  const std::string answer = hear(ends[0], 10.0 * limits.seconds);
  close(ends[0]);
  kill(copy, SIGKILL);  // of one that has answered and ended, nothing is left to kill
  int status = 0;
  while (waitpid(copy, &status, 0) < 0 && errno == EINTR) {
  }
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", what, why));
  };
  const bool ended = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  std::string words = answer.substr(answer.empty() ? 0 : 1);
  if (ended && !answer.empty()) {
    switch (answer[0]) {
      case kInput:
        throw InputError(words);
      case kSystem:
        throw SystemError(words);
      case kEnds:
        refuse(words);
        break;
      case kMemory:
        refuse(fmt::format("needs more than {} MB of memory", limits.memory / 1'000'000));
        break;
      default:
        return words;
    }
  }
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    refuse(fmt::format("takes more than {} s to make ready", limits.seconds));
  }
  refuse(WIFSIGNALED(status)
             ? fmt::format("crashes what makes it ready (signal {}, {}), as too much for {} MB of "
                           "memory may, too",
                           WTERMSIG(status), strsignal(WTERMSIG(status)), limits.memory / 1'000'000)
             : fmt::format("ends what makes it ready (exit {})", WEXITSTATUS(status)));
  return {};
}

void failGuarded(const char* words) {
  if (answer_to < 0) {
    fmt::print(stderr, "{}\n", words);
    std::abort();
  }
  say(kEnds, words);
  _exit(0);
}

}  // namespace traceur
