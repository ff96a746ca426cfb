#include "traceur/core/keeper.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>

namespace traceur {
namespace {

/// Until the kernel has closed what was killed, ask again so often [ns, ours].
constexpr long kBetweenRounds = 5'000'000;

/// Everything that is needed after fork(), where memory may not be allocated.
struct Prepared {
  const Launch* launch;
  std::vector<char*> argv;
  std::vector<char*> environment;
  std::vector<const char*> paths;  ///< where argv[0] may lie
  int life;                        ///< the keeper's end
  int report;                      ///< takes errno when the program cannot be started
};

// From here to startKept(): after fork() in a process that had threads, only async-signal-safe
// calls.

void writeReport(int report, int error) {
  while (write(report, &error, sizeof error) < 0 && errno == EINTR) {
  }
}

/// @return why none of the paths could be run, as execvp() chooses among several reasons
int tryToRun(const Prepared& p) {
  int why = ENOENT;
  for (const char* path : p.paths) {
    execve(path, p.argv.data(), p.environment.data());
    if (errno == EACCES) {
      why = EACCES;
    } else if (errno != ENOENT && errno != ENOTDIR && errno != ESTALE && errno != ENODEV &&
               errno != ETIMEDOUT) {
      return errno;
    }
  }
  return why;
}

[[noreturn]] void becomeProgram(const Prepared& p, pid_t keeper) {
  setpgid(0, 0);
  // Should somebody kill the keeper itself.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != keeper) _exit(127);
  // Above the three that are replaced, should ours be closed.
  const auto above = [](int fd) { return fcntl(fd, F_DUPFD_CLOEXEC, STDERR_FILENO + 1); };
  const Launch& l = *p.launch;
  const int report = above(p.report);
  const int input = above(l.input);
  const int output = above(l.output >= 0 ? l.output : open("/dev/null", O_WRONLY | O_CLOEXEC));
  const int error = l.error >= 0 ? above(l.error) : -1;
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  if (error >= 0) dup2(error, STDERR_FILENO);
  for (const int s : {SIGPIPE, SIGCHLD, SIGXFSZ}) signal(s, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  writeReport(report, tryToRun(p));
  _exit(127);
}

void wakeUp(int) {}

/// Keeps nothing of ours open but fd, which becomes 0: no lock, no database, no terminal.
void closeAllBut(int fd) {
  dup2(fd, 0);
  if (close_range(1, ~0U, 0) == 0) return;
  for (int i = 1; i < 65536; ++i) close(i);  // an old kernel
}

/// Waits for a child's end, and for our maker's when life is not -1, or for so long.
/// @return whether our maker ended
bool waitForAnEnd(int life, const timespec* longest) {
  sigset_t but_children;
  sigfillset(&but_children);
  sigdelset(&but_children, SIGCHLD);
  pollfd maker{life, POLLIN, 0};
  return ppoll(&maker, 1, longest, &but_children) > 0;
}

/// Whether a child has ended; takes others that did off the list of the dead.
bool hasEnded(pid_t child) {
  while (true) {
    siginfo_t info = {};
    if (waitid(P_ALL, 0, &info, WEXITED | WNOHANG | WNOWAIT) != 0) return errno == ECHILD;
    if (info.si_pid == 0) return false;
    if (info.si_pid == child) return true;
    waitpid(info.si_pid, nullptr, 0);
  }
}

bool killChild(pid_t pid) {
  // /proc may be another name space's: only a number that is a child's is meant.
  siginfo_t info = {};
  if (waitid(P_PID, pid, &info, WEXITED | WNOHANG | WNOWAIT) != 0) return false;
  return kill(pid, SIGKILL) == 0;
}

/// @return how many were killed; those that they leave are children in the next round
int killChildren() {
  const int list = open("/proc/thread-self/children", O_RDONLY | O_CLOEXEC);
  if (list < 0) return 0;
  int killed = 0;
  char text[512];
  pid_t pid = 0;
  ssize_t n = 0;
  while ((n = read(list, text, sizeof text)) > 0) {
    for (ssize_t i = 0; i < n; ++i) {
      if (text[i] >= '0' && text[i] <= '9') {
        pid = 10 * pid + (text[i] - '0');
      } else if (pid > 0) {
        killed += killChild(pid) ? 1 : 0;
        pid = 0;
      }
    }
  }
  close(list);
  return killed;
}

/// Ends the program and all that came of it.
/// @return how the program ended
int endAll(pid_t program) {
  kill(-program, SIGKILL);  // before it is taken off the list: the number is still its own
  kill(program, SIGKILL);
  int status = 0;
  while (true) {
    int s = 0;
    const pid_t dead = waitpid(-1, &s, WNOHANG);
    if (dead == program) status = s;
    if (dead > 0) continue;
    if (dead < 0) return status;
    if (killChildren() == 0) return status;  // another user's: they are not ours to end
    const timespec pause{0, kBetweenRounds};
    waitForAnEnd(-1, &pause);
  }
}

[[noreturn]] void endAs(int status) {
  if (!WIFSIGNALED(status)) _exit(WEXITSTATUS(status));
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);  // the program's own core is the one to look at
  prctl(PR_SET_DUMPABLE, 0);      // likewise where cores go to another program
  const int s = WTERMSIG(status);
  signal(s, SIG_DFL);
  sigset_t this_one;
  sigemptyset(&this_one);
  sigaddset(&this_one, s);
  kill(getpid(), s);
  sigprocmask(SIG_UNBLOCK, &this_one, nullptr);
  _exit(128 + s);
}

[[noreturn]] void keep(const Prepared& p) {
  prctl(PR_SET_NAME, "keeper");
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  setpgid(0, 0);  // what is sent to our maker's group does not end the keeper
  struct sigaction child_ended = {};
  child_ended.sa_handler = wakeUp;
  sigaction(SIGCHLD, &child_ended, nullptr);
  const pid_t keeper = getpid();
  const pid_t program = fork();
  if (program == 0) becomeProgram(p, keeper);
  if (program < 0) {
    writeReport(p.report, errno);
    _exit(127);
  }
  setpgid(program, program);  // whoever of the two is first
  closeAllBut(p.life);
  if (chdir("/") != 0) _exit(127);  // or a disk could not be unmounted
  while (!hasEnded(program) && !waitForAnEnd(0, nullptr)) {
  }
  endAs(endAll(program));
}

/// As execvp() looks a program up.
std::vector<std::string> pathsOf(const std::string& program) {
  if (program.empty() || program.find('/') != std::string::npos) return {program};
  const char* path = getenv("PATH");
  std::string folders = path ? path : "/bin:/usr/bin";
  std::vector<std::string> paths;
  for (size_t from = 0; from <= folders.size();) {
    const size_t to = std::min(folders.find(':', from), folders.size());
    const std::string folder = folders.substr(from, to - from);
    paths.push_back((std::filesystem::path(folder) / program).string());
    from = to + 1;
  }
  return paths;
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

void closeBoth(const int ends[2]) {
  close(ends[0]);
  close(ends[1]);
}

}  // namespace

Keeper startKept(const Launch& launch) {
  Keeper kept;
  int life[2];
  int report[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, life) != 0) return {.error = errno};
  if (pipe2(report, O_CLOEXEC) != 0) {
    const int error = errno;
    closeBoth(life);
    return {.error = error};
  }
  const std::vector<std::string> paths = pathsOf(launch.argv.at(0));
  Prepared p{&launch, {}, environmentWithout(launch.hidden), {}, life[1], report[1]};
  for (const std::string& path : paths) p.paths.push_back(path.c_str());
  for (const std::string& a : launch.argv) p.argv.push_back(const_cast<char*>(a.c_str()));
  p.argv.push_back(nullptr);

  sigset_t all;
  sigset_t ours;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &ours);  // none of our handlers runs in the keeper
  kept.pid = fork();
  kept.error = kept.pid < 0 ? errno : 0;
  if (kept.pid == 0) keep(p);
  pthread_sigmask(SIG_SETMASK, &ours, nullptr);

  close(life[1]);
  close(report[1]);
  // Closed unread when the program runs.
  while (kept.pid > 0 && read(report[0], &kept.error, sizeof kept.error) < 0 && errno == EINTR) {
  }
  close(report[0]);
  kept.life = life[0];
  if (kept.error != 0) {
    close(kept.life);
    while (kept.pid > 0 && waitpid(kept.pid, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  return kept;
}

}  // namespace traceur
