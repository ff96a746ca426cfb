#include <gtest/gtest.h>
#include <sqlite3.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/random.h"
#include "traceur/core/run_file.h"
#include "traceur/core/test_folder.h"
#include "traceur/core/text.h"
#include "traceur/core/thread_pool.h"
#include "traceur/core/toml.h"

namespace traceur {
namespace {

namespace fs = std::filesystem;

/// A new folder, empty; removed when the tests have ended.
fs::path scratch() {
  static std::vector<std::unique_ptr<TestFolder>> folders;
  folders.push_back(std::make_unique<TestFolder>());
  return folders.back()->path();
}

template <class F>
std::string messageOf(F&& f) {
  try {
    f();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

TEST(Random, EqualSeedsGiveEqualNumbersAndOthersDoNot) {
  Random a(3, 1, 4);
  Random b(3, 1, 4);
  std::set<std::uint64_t> first;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.bits(), b.bits());
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (std::uint64_t stream = 0; stream < 10; ++stream) {
      for (std::uint64_t index = 0; index < 10; ++index) {
        first.insert(Random(seed, stream, index).bits());
      }
    }
  }
  EXPECT_EQ(first.size(), 1000u);
}

/// The generators as their authors printed them.
std::uint64_t splitMix64(std::uint64_t& x) {
  std::uint64_t z = (x += 0x9e3779b97f4a7c15);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

struct Xoshiro256pp {
  std::uint64_t s[4];
  std::uint64_t next() {
    const auto rotl = [](std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); };
    const std::uint64_t result = rotl(s[0] + s[3], 23) + s[0];
    const std::uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotl(s[3], 45);
    return result;
  }
};

TEST(Random, IsXoshiroSeededThroughSplitMix) {
  // Published first numbers of either.
  std::uint64_t seed = 1234567;
  for (const std::uint64_t x : {6457827717110365317u, 3203168211198807973u, 9817491932198370423u}) {
    EXPECT_EQ(splitMix64(seed), x);
  }
  Xoshiro256pp small{{1, 2, 3, 4}};
  for (const std::uint64_t x : {41943041u, 58720359u}) EXPECT_EQ(small.next(), x);

  std::uint64_t state = 3;
  state = splitMix64(state) ^ 1;
  state = splitMix64(state) ^ 4;
  Xoshiro256pp reference{};
  for (std::uint64_t& word : reference.s) word = splitMix64(state);
  Random bits(3, 1, 4);
  Xoshiro256pp same = reference;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(bits.bits(), same.next());

  const auto uniform = [](Xoshiro256pp& x) { return std::ldexp(double(x.next() >> 11), -53); };
  Random numbers(3, 1, 4);
  same = reference;
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(numbers.uniform(), uniform(same));
    EXPECT_EQ(numbers.uniform(-2, 5), -2 + 7 * uniform(same));
    EXPECT_EQ(numbers.below(7), same.next() % 7);
  }
  // Marsaglia's polar method gives two at a time.
  for (int i = 0; i < 100; ++i) {
    double u = 0, v = 0;
    do {
      u = 2 * uniform(same) - 1;
      v = 2 * uniform(same) - 1;
    } while (u * u + v * v >= 1);
    const double scale = std::sqrt(-2 * std::log(u * u + v * v) / (u * u + v * v));
    EXPECT_DOUBLE_EQ(numbers.normal(), u * scale);
    EXPECT_DOUBLE_EQ(numbers.normal(), v * scale);
  }
}

TEST(Random, NormalHasTheMomentsOfANormal) {
  Random r(1);
  const int n = 200000;
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0;
  for (int i = 0; i < n; ++i) {
    const double x = r.normal();
    m1 += x;
    m2 += x * x;
    m3 += x * x * x;
    m4 += x * x * x * x;
  }
  // Five standard errors each.
  EXPECT_NEAR(m1 / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(m2 / n, 1, 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(m3 / n, 0, 5 * std::sqrt(15.0 / n));
  EXPECT_NEAR(m4 / n, 3, 5 * std::sqrt(96.0 / n));
}

TEST(Random, BelowIsUniform) {
  Random r(2);
  int count[5] = {};
  for (int i = 0; i < 50000; ++i) ++count[r.below(5)];
  for (const int c : count) EXPECT_NEAR(c, 10000, 5 * std::sqrt(8000));
}

TEST(ThreadPool, RunsEachIndexOnce) {
  for (const int threads : {1, 2, 7}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (const int n : {0, 1, 5, 1000}) {
      std::vector<std::atomic<int>> seen(n);
      pool.forEach(n, [&](int i) { ++seen[i]; });
      for (const auto& s : seen) EXPECT_EQ(s, 1);
    }
  }
}

TEST(ThreadPool, RethrowsTheSmallestIndexAndGoesOn) {
  ThreadPool pool(3);
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::atomic<int> done = 0;
    EXPECT_EQ(messageOf([&] {
                pool.forEach(50, [&](int i) {
                  ++done;
                  if (i % 10 == 3) throw InputError(std::to_string(i));
                });
              }),
              "3");
    EXPECT_EQ(done, 50);
  }
}

TEST(Text, SuggestsTheNearestNameOrNone) {
  const std::vector<std::string> names = {"thigh", "shin", "heel"};
  EXPECT_EQ(didYouMean("tihgh", names), " Did you mean \"thigh\"?");
  EXPECT_EQ(didYouMean("THIGH", names), " Did you mean \"thigh\"?");
  EXPECT_EQ(didYouMean("thi", names), " Did you mean \"thigh\"?");
  EXPECT_EQ(didYouMean("banana", names), "");
}

TEST(Text, NearIsAThirdOfTheLengthOrOneEdit) {
  const auto near = [](const std::string& word, const std::string& name) {
    const std::vector<std::string> names = {name};
    return !didYouMean(word, names).empty();
  };
  // One edit of each kind: changed, left out, put in, swapped.
  for (const char* word : {"ab", "xb", "b", "abc", "ba"}) EXPECT_TRUE(near(word, "ab")) << word;
  for (const char* word : {"xy", "", "abcd", "xa"}) EXPECT_FALSE(near(word, "ab")) << word;
  EXPECT_TRUE(near("abcxyf", "abcdef"));   // two of six
  EXPECT_FALSE(near("abcxyz", "abcdef"));  // three
  EXPECT_TRUE(near("badcef", "abcdef"));   // two swaps
  EXPECT_FALSE(near("badcfe", "abcdef"));
  EXPECT_TRUE(near("abc", "abcdefgh"));  // begins it
  EXPECT_FALSE(near("ab", "abcdefgh"));
  EXPECT_FALSE(near("bcd", "abcdefgh"));
  EXPECT_TRUE(near("ABCDEF", "abcdef"));
  const std::vector<std::string> names = {"abcxyf", "abcdxf", "abcdyf"};
  EXPECT_EQ(didYouMean("abcdef", names), " Did you mean \"abcdxf\"?");  // nearest, then first
}

TEST(Text, ANumberIsTheWholeText) {
  const std::pair<const char*, double> numbers[] = {
      {"0", 0},    {"-1.5", -1.5},      {"+2e3", 2000},
      {".5", 0.5}, {"1e999", INFINITY}, {"-inf", -INFINITY}};
  for (const auto& [text, value] : numbers) EXPECT_EQ(parseNumber(text), value) << text;
  EXPECT_TRUE(std::isnan(parseNumber("nan").value_or(0)));
  for (const char* text : {"", " 1", "1 ", "1x", "x", "-", "1,5", "1e"}) {
    EXPECT_FALSE(parseNumber(text)) << text;
  }
}

TEST(Text, JoinsWithSeparators) {
  const std::vector<std::string> words = {"a", "b c", "d"};
  EXPECT_EQ(join(words), "a, b c, d");
  EXPECT_EQ(join(words, ""), "ab cd");
  EXPECT_EQ(join(std::span(words).first(1)), "a");
  EXPECT_EQ(join({}), "");
}

TEST(Diagnostics, AreSortedByPlaceAndSaidOnce) {
  Diagnostics d("f");
  EXPECT_NO_THROW(d.throwIfAny());
  d.add(2, 1, "c");
  d.add(1, 9, "b");
  d.add(1, 9, "b");
  d.add(1, 9, "another");
  d.add(1, 2, "b");
  d.add(2, 9, "b");
  d.add(0, 0, "whole");
  EXPECT_EQ(messageOf([&] { d.throwIfAny(); }),
            "f: whole\nf:1:2: b\nf:1:9: b\nf:1:9: another\nf:2:1: c\nf:2:9: b");
}

TEST(Hash, IsFnv1a) {
  const auto of = [](std::string_view text) {
    Hash h;
    h.add(text);
    return h.value();
  };
  // The published values of these texts.
  EXPECT_EQ(of(""), 0xcbf29ce484222325u);
  EXPECT_EQ(of("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(of("foobar"), 0x85944171f73967e8u);
}

TEST(Hash, NoticesOrderAndSign) {
  const auto of = [](std::vector<double> x) {
    Hash h;
    h.add(x);
    return h.value();
  };
  EXPECT_NE(of({1, 2}), of({2, 1}));
  EXPECT_NE(of({0.0}), of({-0.0}));
  EXPECT_EQ(of({1, 2}), of({1, 2}));
}

TEST(Toml, CollectsAllMistakesWithTheirPlaces) {
  const TomlValue doc = parseToml(
      "a = \"x\"\nb = [1, 2]\nc = 3\nspedd = 1\ne = nan\nf = [0, -inf]\ng = inf\n", "f.toml");
  Diagnostics d("f.toml");
  const TomlReader r(doc, d);
  r.number("a");
  r.numbers("b", 3);
  EXPECT_EQ(r.number("e", 2), 2);
  r.numbers("f", 2);
  EXPECT_EQ(r.numberOrInfinity("g"), INFINITY);
  r.string("missing");
  EXPECT_EQ(r.number("c"), 3);
  r.number("speed", 0);
  r.finish();
  EXPECT_EQ(messageOf([&] { d.throwIfAny(); }),
            "f.toml:1:1: \"missing\" is missing: expected text\n"
            "f.toml:1:5: \"a\": expected a finite number, got text\n"
            "f.toml:2:5: \"b\": expected a list of 3 finite numbers\n"
            "f.toml:4:9: \"spedd\": no such key here. Did you mean \"speed\"? Known: a, b, c, "
            "e, f, g, missing, speed\n"
            "f.toml:5:5: \"e\": expected a finite number, got nan\n"
            "f.toml:6:5: \"f\": expected a list of 2 finite numbers");
}

TEST(Toml, SyntaxErrorsNameLineAndColumn) {
  const std::string message = messageOf([] { parseToml("a = 1\nb = \n", "f.toml"); });
  EXPECT_TRUE(message.starts_with("f.toml:2:")) << message;
}

TEST(Toml, MissingFileAndFolderAreNamed) {
  EXPECT_NE(
      messageOf([] { readFile("no/such.toml"); }).find("no/such.toml: cannot be read: No such"),
      std::string::npos);
  EXPECT_NE(messageOf([] { readFile("."); }).find("got a folder"), std::string::npos);
}

const RunFile::Meta kMeta = {{"skill", "jump"}, {"seed", "1"}};

TEST(PendingFile, AFolderIsMadeOnceOrNamed) {
  const fs::path dir = scratch();
  makeFolder(dir / "a" / "b");
  makeFolder(dir / "a" / "b");
  EXPECT_TRUE(fs::is_directory(dir / "a" / "b"));
  std::ofstream(dir / "file") << "x";
  const std::string message = messageOf([&] { makeFolder(dir / "file" / "c"); });
  EXPECT_NE(message.find("file/c: cannot make the folder"), std::string::npos) << message;
  EXPECT_EQ(messageOf([] { makeFolder(""); }), "");
}

TEST(RunFile, KeepsWhatItWasGiven) {
  const fs::path file = scratch() / "deep" / "a.run";
  {
    RunFile run = RunFile::create(file, kMeta);
    const TrialRow rows[] = {{0, 0, 1.5, false, "", {1, 2}},
                             {0, 1, INFINITY, true, "fall,slip", {-0.0, 1e-300}}};
    run.appendGeneration(0, rows, "state-0", {{"evaluations", "2"}});
    run.putRecording("best", std::string("\0\1\2", 3));
  }
  const RunFile run = RunFile::open(file, false);
  EXPECT_EQ(run.meta("skill"), "jump");
  EXPECT_EQ(run.meta("evaluations"), "2");
  EXPECT_EQ(run.meta("none"), std::nullopt);
  const auto trials = run.trials();
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].cost, 1.5);
  EXPECT_EQ(trials[1].cost, INFINITY);
  EXPECT_EQ(trials[1].violated, "fall,slip");
  EXPECT_TRUE(std::signbit(trials[1].x[0]));
  EXPECT_EQ(run.state(), "state-0");
  EXPECT_EQ(run.recording("best"), std::string("\0\1\2", 3));
  EXPECT_EQ(run.recording("worst"), std::nullopt);
}

TEST(RunFile, KeepsEveryCostATrialCanHave) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double costs[] = {NAN,   kInfinity, -kInfinity, 0,    -1.5,   0.1,
                          1e300, -1e300,    5e-324,     1e16, 1.0 / 3};
  RunFile run = RunFile::create(scratch() / "a.run", kMeta);
  std::vector<TrialRow> rows;
  for (const double cost : costs) {
    const int i = static_cast<int>(rows.size());
    rows.push_back({4, i, cost, i % 3 == 0, i % 2 == 0 ? "" : "fall", {cost, -cost}});
  }
  run.appendGeneration(4, std::vector<TrialRow>(rows.rbegin(), rows.rend()), "state", {});
  const std::vector<TrialRow> earlier = {{2, 7, 3, false, "", {1, 2}}};
  run.appendGeneration(2, earlier, "state", {});
  rows.insert(rows.begin(), earlier[0]);  // read in order, however they were stored
  const std::vector<TrialRow> back = run.trials();
  ASSERT_EQ(back.size(), rows.size());
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(rows[i].cost);
    EXPECT_EQ(back[i].generation, rows[i].generation);
    EXPECT_EQ(back[i].number, rows[i].number);
    EXPECT_TRUE(same(back[i].cost, rows[i].cost)) << back[i].cost;
    EXPECT_EQ(back[i].failed, rows[i].failed);
    EXPECT_EQ(back[i].violated, rows[i].violated);
    EXPECT_TRUE(
        std::equal(back[i].x.begin(), back[i].x.end(), rows[i].x.begin(), rows[i].x.end(), same));
  }
}

TEST(RunFile, AGenerationIsStoredWholeOrNotAtAll) {
  RunFile run = RunFile::create(scratch() / "a.run", kMeta);
  const TrialRow good[] = {{0, 0, 1, false, "", {1}}};
  run.appendGeneration(0, good, "zero", {{"evaluations", "1"}});
  const TrialRow twice[] = {{0, 0, 1, false, "", {1}}, {0, 0, 2, false, "", {2}}};
  EXPECT_THROW(run.appendGeneration(1, twice, "one", {{"evaluations", "3"}}), SystemError);
  EXPECT_EQ(run.trials().size(), 1u);
  EXPECT_EQ(run.state(), "zero");
  EXPECT_EQ(run.meta("evaluations"), "1");
}

TEST(RunFile, RefusesWhatIsNotARunAndLeavesItAlone) {
  const fs::path dir = scratch();
  EXPECT_NE(messageOf([&] { RunFile::open(dir / "none.run", true); }).find("no such run file"),
            std::string::npos);
  std::ofstream(dir / "text.run") << "this is a letter to my aunt, longer than a header";
  EXPECT_NE(messageOf([&] { RunFile::open(dir / "text.run", true); }).find("not a database"),
            std::string::npos);
  EXPECT_EQ(readFile(dir / "text.run").substr(0, 4), "this");
  RunFile::create(dir / "a.run", kMeta);
  EXPECT_NE(messageOf([&] { RunFile::create(dir / "a.run", kMeta); }).find("exists already"),
            std::string::npos);
}

/// A run as a process killed inside a commit leaves it: its journal beside it, pages of the file
/// already overwritten.
std::filesystem::path cutOffInACommit(const std::filesystem::path& dir) {
  const auto file = dir / "whole.run";
  {
    RunFile run = RunFile::create(file, kMeta);
    for (int g = 0; g < 20; ++g) {
      const std::vector<TrialRow> rows = {{g, 0, 1.0, false, "", std::vector<double>(500, g)}};
      run.appendGeneration(g, rows, "state", {});
    }
  }
  sqlite3* db = nullptr;
  EXPECT_EQ(sqlite3_open(file.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(
      sqlite3_exec(db,
                   "PRAGMA cache_size = 1; BEGIN; UPDATE trial SET cost = 7, x = zeroblob(4000);"
                   "UPDATE trial SET x = zeroblob(3000)",
                   nullptr, nullptr, nullptr),
      SQLITE_OK);
  auto cut = dir / "cut.run";
  std::filesystem::copy_file(file, cut);
  std::filesystem::copy_file(file.string() + "-journal", cut.string() + "-journal");
  sqlite3_close(db);
  return cut;
}

TEST(RunFile, IsReadRightAfterAKillInsideACommit) {
  const auto dir = scratch();
  const auto file = cutOffInACommit(dir);
  sqlite3* db = nullptr;
  sqlite3_open_v2(file.c_str(), &db, SQLITE_OPEN_READONLY, nullptr);
  EXPECT_EQ(sqlite3_exec(db, "SELECT * FROM trial", nullptr, nullptr, nullptr), SQLITE_READONLY);
  sqlite3_close(db);
  {
    const RunFile run = RunFile::open(file, false);
    ASSERT_EQ(run.trials().size(), 20u);
    EXPECT_EQ(run.trials()[7].cost, 1);
    EXPECT_EQ(run.trials()[7].x, std::vector<double>(500, 7));
  }
  EXPECT_FALSE(std::filesystem::exists(file.string() + "-journal"));
  EXPECT_FALSE(std::filesystem::exists(file.string() + "-lock"));
}

TEST(RunFile, OneWriterAtATimeAndReadersBesideIt) {
  const auto file = scratch() / "a.run";
  {
    RunFile run = RunFile::create(file, kMeta);
    EXPECT_NE(messageOf([&] { RunFile::open(file, true); }).find("another process is writing it"),
              std::string::npos);
    EXPECT_EQ(RunFile::open(file, false).meta("seed"), "1");
    const std::vector<TrialRow> rows = {{0, 0, 1.0, false, "", {1}}};
    run.appendGeneration(0, rows, "state", {});
  }
  EXPECT_EQ(RunFile::open(file, true).trials().size(), 1u);
  EXPECT_FALSE(std::filesystem::exists(file.string() + "-lock"));
}

TEST(RunFile, ALockThatCannotBeMadeIsTheMachinesRefusal) {
  const auto dir = scratch();
  const auto file = dir / "a.run";
  RunFile::create(file, kMeta);
  std::filesystem::create_directory(file.string() + "-lock");
  EXPECT_THROW(RunFile::open(file, true), SystemError);
  EXPECT_EQ(RunFile::open(file, false).meta("seed"), "1");
  // A run that could not be made leaves nothing, and one that is there stays.
  std::filesystem::create_directory(dir / "b.run-lock");
  EXPECT_THROW(RunFile::create(dir / "b.run", kMeta), SystemError);
  EXPECT_FALSE(std::filesystem::exists(dir / "b.run"));
}

TEST(RunFile, AnEmptyFileNeverBegan) {
  const auto dir = scratch();
  std::ofstream(dir / "a.run").flush();
  EXPECT_NE(messageOf([&] { RunFile::create(dir / "a.run", kMeta); }).find("exists already"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(dir / "a.run"));
  EXPECT_NE(messageOf([&] { RunFile::open(dir / "a.run", true); }).find("before it began"),
            std::string::npos);
  EXPECT_TRUE(RunFile::neverBegan(dir / "a.run"));
  RunFile::create(dir / "b.run", kMeta);
  EXPECT_FALSE(RunFile::neverBegan(dir / "b.run"));
}

TEST(RunFile, ForgetsWhatNoLongerHolds) {
  RunFile run = RunFile::create(scratch() / "a.run", kMeta);
  run.putRecording("best", "bytes");
  run.forget({"best"}, {"seed"});
  EXPECT_FALSE(run.recording("best"));
  EXPECT_FALSE(run.meta("seed"));
  EXPECT_EQ(run.meta("skill"), "jump");
}

TEST(Text, SplitsAtASeparator) {
  EXPECT_EQ(split("", ','), std::vector<std::string>());
  EXPECT_EQ(split("a", ','), std::vector<std::string>({"a"}));
  EXPECT_EQ(split("a,b c,d", ','), std::vector<std::string>({"a", "b c", "d"}));
}

TEST(RunFile, RefusesANewerVersionAndADamagedFile) {
  const fs::path file = scratch() / "a.run";
  { RunFile::create(file, {{"text", std::string(200000, 'x')}}); }
  std::string bytes = readFile(file);
  const auto put = [&](const std::string& content) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << content;
  };
  std::string newer = bytes;
  newer[63] = RunFile::kVersion + 1;  // user_version, at 60..63 of the SQLite header, big-endian
  put(newer);
  EXPECT_NE(messageOf([&] {
              RunFile::open(file, true);
            }).find(std::to_string(RunFile::kVersion + 1) + ", this program reads up to"),
            std::string::npos);
  std::string foreign = bytes;
  foreign[68] = 0;  // application_id, at 68..71
  put(foreign);
  EXPECT_NE(messageOf([&] { RunFile::open(file, true); }).find("not a Traceur run"),
            std::string::npos);
  std::string damaged = bytes;
  for (size_t i = 4096; i < 12288; ++i) damaged[i] = 'z';
  put(damaged);
  EXPECT_NE(messageOf([&] { RunFile::open(file, true); }).find("left as it is"), std::string::npos);
  EXPECT_EQ(readFile(file), damaged);
}

TEST(RunFile, NoPermissionLeavesNothingBehind) {
  const fs::path dir = scratch();
  EXPECT_THROW(RunFile::create("/proc/nowhere/a.run", kMeta), SystemError);
  std::ofstream(dir / "file") << "x";
  EXPECT_THROW(RunFile::create(dir / "file" / "a.run", kMeta), SystemError);
  EXPECT_FALSE(fs::exists(dir / "a.run"));
}

}  // namespace
}  // namespace traceur
