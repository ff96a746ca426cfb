#include "traceur/core/process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <thread>

#include "traceur/core/file_lock.h"
#include "traceur/core/pending_file.h"
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
  EXPECT_FALSE(fs::exists(victim.said()));
  EXPECT_TRUE(fs::exists(file));
  EXPECT_EQ(count(), 6);
}

}  // namespace
}  // namespace traceur
