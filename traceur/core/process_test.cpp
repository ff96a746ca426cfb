#include "traceur/core/process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <thread>

#include "traceur/core/file_lock.h"
#include "traceur/core/guarded.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/sanitized.h"
#include "traceur/core/test_folder.h"

namespace traceur {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kTalk = Process::Output::kTalk;

template <class Error, class F>
std::string messageOf(F&& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

/// Whether it comes true within 10 s.
bool soon(const std::function<bool()>& what) {
  for (int i = 0; i < 1000 && !what(); ++i) std::this_thread::sleep_for(10ms);
  return what();
}

bool lives(pid_t pid) {
  return kill(pid, 0) == 0;
}

/// Another process that does something, says "ready" and waits to be killed.
class Victim {
 public:
  explicit Victim(const std::function<std::string()>& work) {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    pid_ = fork();
    if (pid_ == 0) {
      std::string said = "nothing";
      // Its objects are never destroyed: it is killed.
      said = work() + "\n";
      if (write(ends[1], said.data(), said.size()) < 0) _exit(1);
      while (true) pause();
    }
    close(ends[1]);
    char c = 0;
    while (read(ends[0], &c, 1) == 1 && c != '\n') said_ += c;
    close(ends[0]);
  }
  ~Victim() { killIt(); }
  void killIt() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  const std::string& said() const { return said_; }

 private:
  pid_t pid_ = -1;
  std::string said_;
};

/// Says the numbers of itself, its keeper, and children: one of its group, one of a session of its
/// own, and one whose parent has ended.
const char* const kFamily =
    "sleep 1000 & a=$!; setsid sleep 1001 & b=$!; c=$(setsid sh -c 'sleep 1002 >&2 & echo $!'); "
    "echo $$ $PPID $a $b $c; read more; read more";

std::vector<pid_t> numbers(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<pid_t>(words), {}};
}

void expectGone(const std::vector<pid_t>& all) {
  for (const pid_t pid : all) EXPECT_TRUE(soon([&] { return !lives(pid); })) << pid;
}

TEST(Process, TalksLineByLine) {
  Process cat({"cat"}, kTalk);
  cat.write("1 2\nnext\r\n");
  EXPECT_EQ(cat.readLine(), "1 2");
  EXPECT_EQ(cat.readLine(), "next");
  cat.write("last\n");
  EXPECT_EQ(cat.readLine(), "last");
  cat.finish();
}

TEST(Process, SaysHowAProgramEndedInsteadOfAnswering) {
  const auto how = [](const char* script) {
    return messageOf<Process::Ended>([&] {
      Process program({"sh", "-c", script}, kTalk);
      program.write("1\n");
      program.readLine();
    });
  };
  EXPECT_EQ(how("read x; exit 3"), "sh failed (exit 3)");
  EXPECT_EQ(how("read x; exit 0"), "sh ended (exit 0) though an answer was due");
  EXPECT_EQ(how("read x; kill -SEGV $$"), "sh was stopped by signal 11");
  EXPECT_EQ(how("read x; kill -KILL $$"), "sh was stopped by signal 9");
  EXPECT_EQ(how("exec <&- >&-; sleep 1000"), "sh closed its input or output, and did not end");
  Process quiet({"sh", "-c", "echo words >&2; exit 4"});
  EXPECT_EQ(messageOf<Process::Ended>([&] { quiet.finish(); }), "sh failed (exit 4): words");
}

TEST(Process, SaysWhyAProgramCannotBeStarted) {
  const TestFolder dir;
  std::ofstream(dir / "text") << "#!/bin/sh\n";
  const auto why = [](const std::string& program) {
    return messageOf<SystemError>([&] { Process({program}, kTalk); });
  };
  EXPECT_NE(why("no-such-program").find("it is not on the PATH"), std::string::npos);
  EXPECT_NE(why(dir / "none").find("there is no such file"), std::string::npos);
  EXPECT_NE(why(dir / "text").find("Permission denied"), std::string::npos) << why(dir / "text");
  EXPECT_NE(why(dir.path()).find("Permission denied"), std::string::npos);
}

TEST(Process, NothingOfAProgramOutlivesUsKilled) {
  std::unique_ptr<Process> program;
  Victim victim([&] {
    program = std::make_unique<Process>(std::vector<std::string>{"sh", "-c", kFamily}, kTalk);
    return program->readLine();
  });
  const std::vector<pid_t> all = numbers(victim.said());
  ASSERT_EQ(all.size(), 5u) << victim.said();
  for (const pid_t pid : all) EXPECT_TRUE(lives(pid)) << pid;
  victim.killIt();
  expectGone(all);
}

TEST(Process, NothingOfAProgramOutlivesItOrItsProcess) {
  std::vector<pid_t> all;
  {
    Process program({"sh", "-c", kFamily}, kTalk);
    all = numbers(program.readLine());
  }
  ASSERT_EQ(all.size(), 5u);
  for (const pid_t pid : all) EXPECT_FALSE(lives(pid)) << pid;
  Process program({"sh", "-c", kFamily}, kTalk);
  all = numbers(program.readLine());
  ASSERT_EQ(all.size(), 5u);
  program.write("\n\n");
  program.finish();
  for (const pid_t pid : all) EXPECT_FALSE(lives(pid)) << pid;
}

TEST(Process, ItsKeeperHoldsNothingOfOurs) {
  const TestFolder dir;
  const FileLock lock = FileLock::take(dir / "a");
  Process program({"sh", "-c", kFamily}, kTalk);
  const std::vector<pid_t> all = numbers(program.readLine());
  ASSERT_EQ(all.size(), 5u);
  const auto open_files = [&] {
    return std::distance(fs::directory_iterator(fs::path("/proc") / std::to_string(all[1]) / "fd"),
                         fs::directory_iterator());
  };
  EXPECT_TRUE(soon([&] { return open_files() == 1; })) << open_files();
  kill(all[1], SIGTERM);  // not its business
  program.write("\n");
  EXPECT_TRUE(lives(all[1]));
  kill(all[1], SIGKILL);
  EXPECT_TRUE(soon([&] { return !lives(all[0]); }));
  for (size_t i = 2; i < all.size(); ++i) kill(all[i], SIGKILL);
}

TEST(Process, ALineHasALimit) {
  Process zeros({"cat", "/dev/zero"}, kTalk);
  EXPECT_EQ(messageOf<SystemError>([&] { zeros.readLine(); }),
            "cat answered with a line of more than 1048576 bytes");
  Process again({"cat", "/dev/zero"}, kTalk);
  EXPECT_NE(messageOf<SystemError>([&] { again.answersWithin(60); }), "");
}

TEST(Process, WaitsAreGivenUpWhenAsked) {
  std::stop_source source;
  Process deaf({"sleep", "1000"}, kTalk);
  deaf.heed(source.get_token(), 0.2);
  EXPECT_FALSE(deaf.answersWithin(0.1));
  source.request_stop();
  EXPECT_THROW(deaf.readLine(), Process::GivenUp);
  Process full({"sleep", "1000"}, kTalk);
  full.heed(source.get_token(), 0.2);
  EXPECT_THROW(full.write(std::string(1'000'000, 'x')), Process::GivenUp);
  Process endless({"sleep", "1000"});
  endless.heed(source.get_token(), 0.2);
  EXPECT_THROW(endless.finish(), Process::GivenUp);
  Process quick({"cat"}, kTalk);
  quick.heed(source.get_token(), 10);
  quick.write("1\n");
  EXPECT_EQ(quick.readLine(), "1");  // in time
}

/// An environment variable's value while it lives; null: none.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* old = getenv(name)) old_ = old;
    value ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Variable() { old_ ? setenv(name_, old_->c_str(), 1) : unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> old_;
};

void program(const fs::path& file, const std::string& text,
             fs::perms perms = fs::perms::owner_all) {
  std::ofstream(file) << "#!/bin/sh\n" << text << "\n";
  fs::permissions(file, perms);
}

/// All that a program says.
std::string saidBy(const std::vector<std::string>& argv, std::string_view hidden = {}) {
  Process p(argv, kTalk, hidden);
  std::string all;
  try {
    while (true) all += p.readLine() + "\n";
  } catch (const Process::Ended&) {
    return all;
  }
}

TEST(Process, IsLookedUpOnThePathAsAShellDoes) {
  const TestFolder one;
  const TestFolder two;
  program(one / "tool", "echo one");
  program(two / "tool", "echo two");
  program(two / "only", "echo only");
  const std::string first = one.path().string();
  const std::string second = two.path().string();
  const auto on = [](const std::string& path, const std::string& name) {
    const Variable with("PATH", path.c_str());
    try {
      return saidBy({name});
    } catch (const SystemError& e) {
      return std::string(e.what());
    }
  };
  EXPECT_EQ(on(first + ":" + second, "tool"), "one\n");
  EXPECT_EQ(on(second + ":" + first, "tool"), "two\n");
  EXPECT_EQ(on(first + ":" + second, "only"), "only\n");
  EXPECT_EQ(on(first + ":/nowhere:" + second, "only"), "only\n");
  EXPECT_EQ(on(first + ":" + (one / "tool").string() + ":" + second, "only"), "only\n");
  EXPECT_TRUE(on(first, "only").starts_with("cannot run only: it is not on the PATH"));
  // An empty folder is the one we work in, at the end, too.
  const fs::path was = fs::current_path();
  fs::current_path(two.path());
  EXPECT_EQ(on(first + ":", "only"), "only\n");
  EXPECT_EQ(on("::" + first, "only"), "only\n");
  EXPECT_EQ(on("", "only"), "only\n");
  EXPECT_TRUE(on(first, "only").starts_with("cannot run only"));
  fs::current_path(was);
  // One that may not be run is passed over, and named if it is the only one.
  program(one / "tool", "echo one", fs::perms::owner_read);
  EXPECT_EQ(on(first + ":" + second, "tool"), "two\n");
  EXPECT_EQ(on(first + ":/nowhere", "tool"), "cannot run tool: Permission denied");
  // What is no program of this machine ends the search.
  std::ofstream(one / "tool") << std::string(
      "\x7f"
      "ELF",
      4);
  fs::permissions(one / "tool", fs::perms::owner_all);
  EXPECT_EQ(on(first + ":" + second, "tool"), "cannot run tool: Exec format error");
  const Variable none("PATH", nullptr);
  EXPECT_EQ(saidBy({"echo", "found"}), "found\n");
  EXPECT_EQ(saidBy({"/bin/sh", "-c", "echo \"$0 $1\"", "a b", "*"}), "a b *\n");
  EXPECT_EQ(on("/nowhere", "gnuplot"),
            "cannot run gnuplot: it is not on the PATH. Install it (Debian: apt install "
            "gnuplot-nox)");
  EXPECT_EQ(on("/nowhere", "ffmpeg"),
            "cannot run ffmpeg: it is not on the PATH. Install it (Debian: apt install ffmpeg)");
}

TEST(Process, VariablesThatBeginSoAreKeptFromIt) {
  const Variable one("TRACEUR_TEST_ONE", "1");
  const Variable two("TRACEUR_TASTE", "2");
  EXPECT_NE(saidBy({"env"}).find("TRACEUR_TEST_ONE=1\n"), std::string::npos);
  const std::string said = saidBy({"env"}, "TRACEUR_TEST");
  EXPECT_EQ(said.find("TRACEUR_TEST"), std::string::npos);
  EXPECT_NE(said.find("TRACEUR_TASTE=2\n"), std::string::npos);
  EXPECT_NE(said.find("PATH="), std::string::npos);
}

TEST(Process, StartsWithNoSignalBlockedOrIgnored) {
  sigset_t ours;
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGUSR1);
  sigaddset(&blocked, SIGTERM);
  sigprocmask(SIG_BLOCK, &blocked, &ours);
  const auto pipe_was = signal(SIGPIPE, SIG_IGN);
  const auto size_was = signal(SIGXFSZ, SIG_IGN);
  const std::string status = saidBy({"cat", "/proc/self/status"});
  sigset_t now;
  sigprocmask(SIG_SETMASK, &ours, &now);
  EXPECT_EQ(sigismember(&now, SIGUSR1), 1);  // and ours are as they were
  EXPECT_EQ(sigismember(&now, SIGINT), 0);
  signal(SIGPIPE, pipe_was);
  signal(SIGXFSZ, size_was);
  const auto mask = [&](const std::string& what) {
    const size_t at = status.find("\n" + what + ":\t");
    EXPECT_NE(at, std::string::npos) << status;
    return std::stoull(status.substr(at + what.size() + 3), nullptr, 16);
  };
  EXPECT_EQ(mask("SigBlk"), 0U);
  EXPECT_EQ(mask("SigIgn") & (1U << (SIGPIPE - 1)), 0U);
  EXPECT_EQ(mask("SigIgn") & (1U << (SIGXFSZ - 1)), 0U);
}

TEST(Process, ItsKeeperIsInNobodysWay) {
  const TestFolder folder;
  const fs::path was = fs::current_path();
  fs::current_path(folder.path());
  Process program({"sh", "-c", "echo $$ $PPID; pwd; read more"}, kTalk);
  const std::vector<pid_t> pids = numbers(program.readLine());
  ASSERT_EQ(pids.size(), 2U);
  EXPECT_EQ(program.readLine(), folder.path().string());
  fs::current_path(was);
  const fs::path keeper = fs::path("/proc") / std::to_string(pids[1]);
  EXPECT_TRUE(soon([&] { return fs::read_symlink(keeper / "cwd") == "/"; }));
  std::string name;
  std::ifstream(keeper / "comm") >> name;
  EXPECT_EQ(name, "keeper");
  // Each is the first of a group: what is sent to ours reaches neither.
  EXPECT_EQ(getpgid(pids[0]), pids[0]);
  EXPECT_EQ(getpgid(pids[1]), pids[1]);
}

TEST(Process, WorksWhereTheStandardStreamsAreClosed) {
  Victim victim([] {
    const int kept = fcntl(0, F_DUPFD, 100);
    for (int fd = 0; fd < 3; ++fd) close(fd);
    Process cat({"sh", "-c", "read x; echo \"heard $x\""}, kTalk);
    cat.write("us\n");
    const std::string said = cat.readLine();
    Process quiet({"sh", "-c", "echo lost; echo words >&2"});
    const std::string words = quiet.finish();
    close(kept);
    return said + ", " + words;
  });
  EXPECT_EQ(victim.said(), "heard us, words");
}

TEST(Process, WhatOneThatTalksComplainsOfIsOurs) {
  const TestFolder dir;
  Victim victim([&] {
    const int to = open((dir / "errors").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    dup2(to, 2);
    Process program({"sh", "-c", "echo words >&2; echo done"}, kTalk);
    return program.readLine();
  });
  EXPECT_EQ(victim.said(), "done");
  std::string words;
  std::ifstream(dir / "errors") >> words;
  EXPECT_EQ(words, "words");
}

/// Interrupts this process's waits every few milliseconds while it lives.
class Interruptions {
 public:
  Interruptions() {
    struct sigaction nothing = {};
    nothing.sa_handler = [](int) {};
    sigaction(SIGALRM, &nothing, &was_);
    const itimerval often = {{0, 3000}, {0, 3000}};
    setitimer(ITIMER_REAL, &often, nullptr);
  }
  ~Interruptions() {
    const itimerval never = {};
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &was_, nullptr);
  }
  Interruptions(const Interruptions&) = delete;
  Interruptions& operator=(const Interruptions&) = delete;

 private:
  struct sigaction was_ = {};
};

TEST(Process, AnInterruptedWaitGoesOn) {
  std::string first;
  std::string rest;
  std::string words;
  std::string guarded_words;
  {
    const Interruptions interruptions;
    Process slow({"sh", "-c", "sleep 0.05; echo one; sleep 0.05; read x; echo $x | wc -c"}, kTalk);
    first = slow.readLine();
    slow.write(std::string(500'000, 'x') + "\n");
    rest = slow.readLine();
    Process quiet({"sh", "-c", "sleep 0.05; echo two >&2; exec >&- 2>&- <&-; sleep 0.05"});
    words = quiet.finish();
    guarded_words = guarded("file", [] {
      std::this_thread::sleep_for(50ms);
      return std::string("three");
    });
  }
  EXPECT_EQ(first, "one");
  EXPECT_EQ(rest, "500001");
  EXPECT_EQ(words, "two");
  EXPECT_EQ(guarded_words, "three");
}

/// How many files this process has open.
std::ptrdiff_t openFiles() {
  return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
}

TEST(Process, WithoutDescriptorsItSaysSoAndKeepsNone) {
#ifdef TRACEUR_SANITIZE_ADDRESS
  GTEST_SKIP() << "the sanitizer itself needs descriptors";
#endif
  rlimit ours;
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  const auto before = openFiles();
  for (int free = 0; free < 7; ++free) {
    const rlimit few = {static_cast<rlim_t>(before) + 40, ours.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
    std::vector<int> taken;
    for (int fd = 0; (fd = open("/dev/null", O_RDONLY)) >= 0;) taken.push_back(fd);
    for (int i = 0; i < free; ++i) {
      close(taken.back());
      taken.pop_back();
    }
    EXPECT_EQ(messageOf<SystemError>([] { Process({"true"}); }),
              "cannot run true: Too many open files")
        << free;
    for (const int fd : taken) close(fd);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &ours), 0);
    EXPECT_EQ(openFiles(), before) << free;
  }
  EXPECT_EQ(Process({"true"}).finish(), "");
  EXPECT_EQ(openFiles(), before);
  messageOf<SystemError>([] { Process({"/no/such/program"}); });
  EXPECT_EQ(openFiles(), before);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);  // and no child is left
}

TEST(Process, ItsWordsAreTheLastAndTrimmed) {
  const auto words = [](const std::string& script) {
    return Process({"sh", "-c", "{ " + script + "; } >&2"}).finish();
  };
  EXPECT_EQ(words("true"), "");
  EXPECT_EQ(words("echo; echo '  two words '; echo"), "two words");
  EXPECT_EQ(words("echo ' '"), "");
  EXPECT_EQ(words("printf '%02000d' 7"), std::string(1999, '0') + "7");
  EXPECT_EQ(words("printf 'x%02000d' 7"), std::string(1999, '0') + "7");
  // What it prints is nobody's business.
  Process loud({"sh", "-c", "echo lost; cat >/dev/null"});
  loud.write("x");
  EXPECT_EQ(loud.finish(), "");
}

TEST(Process, KnowsWhetherItWasAnswered) {
  Process program({"sh", "-c", "read x; printf 'one\\ntwo\\n'; read x; printf 'cut'; exec >&- <&-"},
                  kTalk);
  EXPECT_FALSE(program.hasMore());
  EXPECT_FALSE(program.answersWithin(0.02));
  program.write("\n");
  EXPECT_TRUE(program.answersWithin(60));
  EXPECT_TRUE(program.hasMore());
  EXPECT_EQ(program.readLine(), "one");
  EXPECT_TRUE(program.answersWithin(0));
  EXPECT_TRUE(program.hasMore());
  EXPECT_EQ(program.readLine(), "two");
  EXPECT_FALSE(program.hasMore());
  EXPECT_FALSE(program.answersWithin(0));
  program.write("\n");
  EXPECT_TRUE(soon([&] { return program.hasMore(); }));  // not yet heard, but said
  EXPECT_TRUE(program.answersWithin(60));                // its end
  EXPECT_EQ(messageOf<Process::Ended>([&] { program.readLine(); }),
            "sh ended (exit 0) though an answer was due");
  // More than fits a pipe goes both ways.
  Process counter({"wc", "-c"}, kTalk);
  counter.write(std::string(3'000'000, 'x'));
  EXPECT_FALSE(counter.hasMore());
  Process cat({"cat"}, kTalk);
  const std::string line(90'000, 'y');
  cat.write(line + "\n" + line + "\r\n\n");
  EXPECT_EQ(cat.readLine(), line);
  EXPECT_EQ(cat.readLine(), line);
  EXPECT_EQ(cat.readLine(), "");
  Process deaf({"sh", "-c", "exec <&-; sleep 0.1; echo why >&2; exit 5"});
  EXPECT_EQ(messageOf<Process::Ended>([&] { deaf.write(std::string(1'000'000, 'x')); }),
            "sh failed (exit 5): why");
  Process sated({"sh", "-c", "exit 0"});
  EXPECT_EQ(messageOf<Process::Ended>([&] { sated.write(std::string(1'000'000, 'x')); }),
            "sh stopped before it had read everything");
}

TEST(FileLock, IsGivenBackOnceByWhoeverHasIt) {
  const TestFolder dir;
  const fs::path a = dir / "a";
  const fs::path b = dir / "b";
  const auto is_free = [](const fs::path& file) { return FileLock::tryToTake(file).has_value(); };
  const auto files = openFiles();
  std::optional<FileLock> first = FileLock::take(a);
  {
    const FileLock moved = std::move(*first);
    first.reset();
    const mode_t mask = umask(0);
    umask(mask);
    EXPECT_EQ(static_cast<unsigned>(fs::status(a.string() + "-lock").permissions()), 0666U & ~mask);
    EXPECT_FALSE(is_free(a));
  }
  EXPECT_TRUE(is_free(a));
  {
    FileLock one = FileLock::take(a);
    FileLock two = FileLock::take(b);
    one = std::move(two);
    EXPECT_FALSE(is_free(b));
  }
  EXPECT_TRUE(is_free(a));
  EXPECT_TRUE(is_free(b));
  EXPECT_TRUE(fs::is_empty(dir.path()));
  // A link is not followed when what is left behind is swept.
  std::ofstream(dir / "other") << "x";
  fs::create_symlink(dir / "other", dir / "c-lock");
  FileLock::sweep(dir / "c");
  EXPECT_TRUE(fs::exists(dir / "other"));
  EXPECT_TRUE(fs::is_symlink(dir / "c-lock"));
  FileLock::sweep(dir / "none");
  std::ofstream(dir / "e-lock").flush();
  FileLock::sweep(dir / "e");
  EXPECT_FALSE(fs::exists(dir / "e-lock"));
  EXPECT_EQ(openFiles(), files);
  // A file that no longer has its name is another's.
  const int fd = open((dir / "d").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  EXPECT_EQ(lockDescriptor(fd, dir / "d"), Locked::kYes);
  const int again = open((dir / "d").c_str(), O_RDWR | O_CLOEXEC);
  EXPECT_EQ(lockDescriptor(again, dir / "d"), Locked::kNo);
  EXPECT_EQ(lockDescriptor(fd, dir / "other"), Locked::kMoved);
  EXPECT_EQ(lockDescriptor(fd, dir / "gone"), Locked::kMoved);
  EXPECT_EQ(lockDescriptor(-1, dir / "d"), Locked::kFailed);
  close(fd);
  close(again);
  EXPECT_NE(messageOf<SystemError>([&] {
              FileLock::take(dir / "no" / "a");
            }).find("a-lock: cannot be locked: No such"),
            std::string::npos);
}

TEST(FileLock, OneAtATimeUntilItsProcessEnds) {
  const TestFolder dir;
  const fs::path file = dir / "a";
  std::optional<FileLock> theirs;
  Victim victim([&] {
    theirs = FileLock::tryToTake(file);
    return std::string(theirs ? "locked" : "refused");
  });
  EXPECT_EQ(victim.said(), "locked");
  EXPECT_FALSE(FileLock::tryToTake(file));
  EXPECT_EQ(messageOf<InputError>([&] { FileLock::take(file); }),
            file.string() + ": another process is writing it");
  FileLock::sweep(file);
  EXPECT_TRUE(fs::exists(file.string() + "-lock"));
  victim.killIt();
  { const FileLock ours = FileLock::take(file); }
  EXPECT_FALSE(fs::exists(file.string() + "-lock"));
  std::ofstream(file.string() + "-lock").flush();
  FileLock::sweep(file);
  EXPECT_FALSE(fs::exists(file.string() + "-lock"));
}

TEST(PendingFile, RemovesWhatKilledProcessesLeftAndNothingElse) {
  const TestFolder dir;
  const fs::path file = dir / "a";
  const auto count = [&] {
    return std::distance(fs::directory_iterator(dir.path()), fs::directory_iterator());
  };
  const auto files = openFiles();
  std::unique_ptr<PendingFile> theirs;
  Victim victim([&] {
    theirs = std::make_unique<PendingFile>(file);
    theirs->write("half");
    return theirs->beside().string();
  });
  const std::string others[] = {dir / ".a.png.12-0.part", dir / ".a.12-.part", dir / ".a.1-2.parts",
                                dir / ".a..part", dir / "a.1-2.part"};
  for (const std::string& other : others) std::ofstream(other).flush();
  std::ofstream(dir / ".a.1-0.part") << "of a process long gone";
  { PendingFile ours(file); }
  EXPECT_TRUE(fs::exists(victim.said()));
  EXPECT_FALSE(fs::exists(dir / ".a.1-0.part"));
  EXPECT_EQ(count(), 6);
  victim.killIt();
  {
    PendingFile ours(file);
    ours.write("whole");
    ours.commit();
  }
  { PendingFile(file).write("lost"); }
  EXPECT_EQ(openFiles(), files);
  EXPECT_FALSE(fs::exists(victim.said()));
  EXPECT_TRUE(fs::exists(file));
  EXPECT_EQ(count(), 6);
}

}  // namespace
}  // namespace traceur
