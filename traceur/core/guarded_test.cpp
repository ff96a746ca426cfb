#include "traceur/core/guarded.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "traceur/core/error.h"
#include "traceur/core/sanitized.h"

namespace traceur {
namespace {

std::string refusal(const std::function<std::string()>& work, const GuardLimits& limits = {}) {
  try {
    guarded("file", work, limits);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Guarded, BringsBackWhatTheWorkReturnsAndNothingElse) {
  int here = 1;
  const std::string large(1'000'000, 'x');
  EXPECT_EQ(guarded("file",
                    [&] {
                      here = 2;
                      return std::string(large);
                    }),
            large);
  EXPECT_EQ(here, 1);
  EXPECT_EQ(guarded("file", [] { return std::string(); }), "");
}

TEST(Guarded, ErrorsOfTheWorkAreThoseOfTheCaller) {
  EXPECT_EQ(refusal([]() -> std::string { throw InputError("line 3: wrong"); }), "line 3: wrong");
  EXPECT_EQ(refusal([]() -> std::string { failGuarded("the engine's words"); }),
            "file: the engine's words");
  EXPECT_THROW(guarded("file", []() -> std::string { throw SystemError("no disk"); }), SystemError);
}

TEST(Guarded, ACrashIsARefusal) {
  const std::string words = refusal([]() -> std::string {
    std::signal(SIGSEGV, SIG_DFL);  // a sanitizer's own handler would tell a story
    raise(SIGSEGV);
    return "";
  });
  EXPECT_TRUE(words.starts_with("file: crashes")) << words;
  EXPECT_TRUE(refusal([]() -> std::string { _exit(7); }).starts_with("file: ends")) << words;
}

TEST(Guarded, SaysWhatEndedTheWork) {
  const std::string killed = refusal([]() -> std::string {
    std::signal(SIGABRT, SIG_DFL);
    std::abort();
  });
  EXPECT_EQ(
      killed,
      "file: crashes what makes it ready (signal 6, Aborted), as too much for 1000 MB of memory "
      "may, too");
  EXPECT_EQ(refusal([]() -> std::string { _exit(7); }), "file: ends what makes it ready (exit 7)");
  EXPECT_EQ(refusal([]() -> std::string { _exit(0); }), "file: ends what makes it ready (exit 0)");
  try {
    guarded("file", []() -> std::string { throw std::logic_error("a word"); });
    FAIL() << "nothing was thrown";
  } catch (const SystemError& e) {
    EXPECT_STREQ(e.what(), "a word");
  }
}

TEST(Guarded, NothingIsLeftOfIt) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                         std::filesystem::directory_iterator());
  };
  const auto before = open_files();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(guarded("file", [&] { return std::to_string(open_files()); }),
              std::to_string(before + 1));  // where its answer goes
  }
  EXPECT_EQ(open_files(), before);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
}

TEST(Guarded, WordsOfAnEngineOutsideAbort) {
  EXPECT_EXIT(failGuarded("the engine's words"), testing::KilledBySignal(SIGABRT),
              "the engine's words");
}

TEST(Guarded, WorkThatWaitsForEverIsARefusal) {
  const auto sleep = [] {
    while (true) pause();
    return std::string();
  };
  EXPECT_EQ(refusal(sleep, {.seconds = 0}), "file: takes more than 0 s to make ready");
}

TEST(Guarded, WorkWithoutEndIsARefusal) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string words = refusal(
      [] {
        std::atomic<unsigned> steps = 0;
        while (++steps > 0 || steps == 0) {
        }
        return std::string();
      },
      {.seconds = 1});
  EXPECT_EQ(words, "file: takes more than 1 s to make ready");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(15));
}

#if !defined(TRACEUR_SANITIZE_ADDRESS) && !defined(TRACEUR_SANITIZE_THREAD)
TEST(Guarded, HungerForMemoryIsARefusal) {
  const auto xs = [](size_t n) {
    std::string text;
    text.resize(n, 'x');
    return text;
  };
  const std::string words = refusal([&] { return xs(200'000'000); }, {.memory = 100'000'000});
  EXPECT_EQ(words, "file: needs more than 100 MB of memory");
  EXPECT_EQ(guarded("file", [&] { return xs(50'000'000).substr(0, 1); }, {.memory = 100'000'000}),
            "x");
}
#endif

}  // namespace
}  // namespace traceur
