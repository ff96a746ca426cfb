#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <set>
#include <thread>

#include "traceur/core/error.h"
#include "traceur/core/file_lock.h"
#include "traceur/core/hash.h"
#include "traceur/core/lender.h"
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

TEST(Random, BelowAnyNumberIsFair) {
  // Of more than half of all numbers, those beyond are drawn again.
  const std::uint64_t n = 3ULL << 62;
  Random random(5);
  Random bits(5);
  int again = 0;
  for (int i = 0; i < 200; ++i) {
    std::uint64_t b = bits.bits();
    for (; b >= n; b = bits.bits()) ++again;
    EXPECT_EQ(random.below(n), b);
  }
  EXPECT_NEAR(again, 200 / 3.0, 45);  // a quarter of all
}

TEST(Lender, MakesAsManyAsAreInUseAtOnce) {
  int made = 0;
  Lender<int> lender([&] { return std::make_unique<int>(++made); });
  EXPECT_EQ(lender.with([](int& i) { return i; }), 1);
  lender.with([](int& i) { i = 7; });
  EXPECT_EQ(lender.with([](int i) { return i; }), 7) << "the same one, as it was left";
  lender.with([&](int outer) {
    EXPECT_EQ(outer, 7);
    lender.with([&](int inner) { EXPECT_EQ(inner, 2); });
  });
  EXPECT_EQ(made, 2);
  EXPECT_THROW(lender.with([](int) { throw InputError("no"); }), InputError);
  EXPECT_EQ(made, 2);
  lender.with([&](int) { lender.with([](int) {}); });
  EXPECT_EQ(made, 3) << "one was lost to what threw";
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

TEST(ThreadPool, AFailureIsOfItsOwnCall) {
  ThreadPool pool(2);
  for (const int at : {3, 7}) {
    const auto work = [&](int i) {
      if (i >= at) throw InputError(std::to_string(i));
    };
    EXPECT_EQ(messageOf([&] { pool.forEach(10, work); }), std::to_string(at));
  }
  EXPECT_EQ(messageOf([&] { pool.forEach(10, [](int) {}); }), "");
}

TEST(ThreadPool, WorksAtOnceAndIsDoneWhenAllAre) {
  for (const int threads : {0, -1, 1}) {
    const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    EXPECT_EQ(ThreadPool(threads).threads(), threads == 1 ? 1 : processors);
  }
  ThreadPool pool(3);
  std::atomic<int> begun = 0;
  std::atomic<int> ended = 0;
  const auto caller = std::this_thread::get_id();
  pool.forEach(3, [&](int) {
    ++begun;
    // Only where all three have begun does any go on.
    for (int i = 0; i < 1000 && begun < 3; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (std::this_thread::get_id() != caller) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    if (begun == 3) ++ended;
  });
  EXPECT_EQ(ended, 3);
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

/// Edits that turn a into b, by trying everything.
int edits(std::string_view a, std::string_view b) {
  if (a.empty() || b.empty()) return static_cast<int>(a.size() + b.size());
  int least = std::min({edits(a.substr(1), b) + 1, edits(a, b.substr(1)) + 1,
                        edits(a.substr(1), b.substr(1)) + (a[0] == b[0] ? 0 : 1)});
  if (a.size() > 1 && b.size() > 1 && a[0] == b[1] && a[1] == b[0]) {
    least = std::min(least, edits(a.substr(2), b.substr(2)) + 1);
  }
  return least;
}

TEST(Text, TheNearestIsThatOfTheFewestEdits) {
  Random random(7);
  const auto word = [&](size_t least) {
    std::string text(least + random.below(3), ' ');
    for (char& c : text) c = static_cast<char>('a' + random.below(3));
    return text;
  };
  for (const size_t size : {1, 2, 4}) {
    for (int i = 0; i < 60; ++i) {
      const std::string said = word(size);
      const std::vector<std::string> names = {word(size), word(size), word(size)};
      int least = std::max(1, static_cast<int>(said.size()) / 3) + 1;
      std::string expected;
      for (const std::string& name : names) {
        const int d = said.size() >= 3 && name.starts_with(said) ? 1 : edits(said, name);
        if (d < least) {
          least = d;
          expected = " Did you mean \"" + name + "\"?";
        }
      }
      EXPECT_EQ(didYouMean(said, names), expected) << said << ": " << join(names);
    }
  }
}

TEST(Text, OnlyWordsOfUpToAHundredBytesAreCompared) {
  const auto is_near = [](size_t word, size_t name) {
    const std::vector<std::string> names = {std::string(name, 'a')};
    return !didYouMean(std::string(word, 'a'), names).empty();
  };
  EXPECT_TRUE(is_near(100, 99));
  EXPECT_TRUE(is_near(99, 100));
  EXPECT_FALSE(is_near(101, 100));
  EXPECT_FALSE(is_near(100, 101));
}

TEST(Text, ANumberIsTheWholeText) {
  const std::pair<const char*, double> numbers[] = {
      {"0", 0},    {"-1.5", -1.5},      {"+2e3", 2000},
      {".5", 0.5}, {"1e999", INFINITY}, {"-inf", -INFINITY}};
  for (const auto& [text, value] : numbers) EXPECT_EQ(parseNumber(text), value) << text;
  EXPECT_TRUE(std::isnan(parseNumber("nan").value_or(0)));
  EXPECT_EQ(toNumber("1e3", "here"), 1000);
  EXPECT_EQ(toNumber("-inf", "here"), -INFINITY);
  for (const char* text : {"", "nan", "1 ", "x"}) EXPECT_THROW(toNumber(text, "here"), InputError);
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

TEST(Diagnostics, AreDataForAnEditor) {
  Diagnostics d("f.toml");
  d.add(2, 7, "second");
  d.add(0, 0, "whole");
  d.add(1, 3, "first");
  try {
    d.throwIfAny();
    FAIL();
  } catch (const InputError& e) {
    const InputError copy = e;
    ASSERT_EQ(copy.mistakes().size(), 3u);
    EXPECT_EQ(copy.mistakes()[0].line, 0);
    EXPECT_EQ(copy.mistakes()[1].text, "first");
    EXPECT_EQ(copy.mistakes()[2].file, "f.toml");
    EXPECT_EQ(copy.mistakes()[2].line, 2);
    EXPECT_EQ(copy.mistakes()[2].column, 7);
  }
  EXPECT_TRUE(InputError("any other").mistakes().empty());
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

TEST(Toml, EachAccessorReadsItsKindAndRefusesOthers) {
  const TomlValue doc = parseToml(
      "n = 2.5\nflag = true\nword = \"x\"\nwords = [\"a\", \"b\"]\npair = [1, -2]\nday = "
      "1979-05-27\n"
      "[t]\nz = 1\ny = 2\n[[list]]\ni = 1\n[[list]]\ni = 2\n",
      "f");
  Diagnostics d("f");
  const TomlReader r(doc, d);
  EXPECT_TRUE(r.has("n"));
  EXPECT_FALSE(r.has("m"));
  EXPECT_EQ(r.number("n"), 2.5);
  EXPECT_EQ(r.number("m", 7), 7);
  EXPECT_EQ(r.numberOrInfinity("n"), 2.5);
  EXPECT_TRUE(r.boolean("flag", false));
  EXPECT_FALSE(r.boolean("none", false));
  EXPECT_TRUE(r.boolean("none", true));
  EXPECT_EQ(r.string("word"), "x");
  EXPECT_EQ(r.string("none", "y"), "y");
  EXPECT_EQ(r.string("day"), "a date");
  EXPECT_EQ(r.strings("words"), std::vector<std::string>({"a", "b"}));
  EXPECT_EQ(r.numbers("pair", 2), std::vector<double>({1, -2}));
  EXPECT_EQ(r.table("t").names(), std::vector<std::string>({"z", "y"}));
  EXPECT_EQ(r.table("t").number("y"), 2);
  EXPECT_TRUE(r.table("none").names().empty());
  const auto list = r.tables("list");
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1].number("i"), 2);
  EXPECT_TRUE(r.tables("none").empty());
  r.finish();
  r.table("t").finish();
  EXPECT_EQ(messageOf([&] { d.throwIfAny(); }),
            "f:8:5: \"z\": no such key here. Known: \nf:9:5: \"y\": no such key here. Known: ");

  /// What is said of a wrong key, and that reading goes on with nothing in its place.
  const auto said = [&](const auto& read) {
    Diagnostics wrong("f");
    read(TomlReader(doc, wrong));
    return messageOf([&] { wrong.throwIfAny(); });
  };
  using R = const TomlReader&;
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.number("flag"), 0); }),
            "f:2:8: \"flag\": expected a finite number, got true or false");
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.number("none"), 0); }),
            "f:1:1: \"none\" is missing: expected a number");
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.numberOrInfinity("words"), 0); }),
            "f:4:9: \"words\": expected a finite number, got a list");
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.string("n"), ""); }),
            "f:1:5: \"n\": expected text, got a number");
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.string("t", "other"), "other"); }),
            "f:7:1: \"t\": expected text, got a table");
  EXPECT_EQ(said([](R w) { EXPECT_TRUE(w.boolean("word", true)); }),
            "f:3:8: \"word\": expected true or false, got text");
  EXPECT_EQ(said([](R w) { EXPECT_TRUE(w.strings("none").empty()); }),
            "f:1:1: \"none\" is missing: expected a list of names");
  EXPECT_EQ(said([](R w) { w.strings("pair"); }), "f:5:8: \"pair\": expected a list of names");
  EXPECT_EQ(said([](R w) { w.strings("word"); }), "f:3:8: \"word\": expected a list of names");
  EXPECT_EQ(said([](R w) { EXPECT_EQ(w.numbers("none", 2), std::vector<double>(2)); }),
            "f:1:1: \"none\" is missing: expected a list of 2 finite numbers");
  EXPECT_EQ(said([](R w) { w.numbers("n", 1); }),
            "f:1:5: \"n\": expected a list of 1 finite numbers, got a number");
  EXPECT_EQ(said([](R w) { w.numbers("pair", 1); }),
            "f:5:8: \"pair\": expected a list of 1 finite numbers");
  EXPECT_EQ(said([](R w) { w.numbers("words", 2); }),
            "f:4:9: \"words\": expected a list of 2 finite numbers");
  EXPECT_EQ(said([](R w) { EXPECT_TRUE(w.table("n").names().empty()); }),
            "f:1:5: \"n\": expected a table, got a number");
  EXPECT_EQ(said([](R w) { w.table("none").number("x"); }),
            "f: \"x\" is missing: expected a number");
  EXPECT_EQ(said([](R w) { EXPECT_TRUE(w.tables("t").empty()); }),
            "f:7:1: \"t\": expected [[t]] tables, got a table");
  EXPECT_EQ(said([](R w) { EXPECT_TRUE(w.tables("pair").empty()); }),
            "f:5:9: \"pair\": expected a table, got a number\n"
            "f:5:12: \"pair\": expected a table, got a number");
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

TEST(PendingFile, AppearsWholeWhenItIsCommitted) {
  const fs::path dir = scratch();
  const fs::path file = dir / "a";
  const std::string large(300000, 'x');
  {
    PendingFile first(file);
    PendingFile second(file);  // beside the other, not over it
    EXPECT_NE(first.beside(), second.beside());
    first.write(large);
    second.write("short");
    second.write("");
    std::ofstream(first.plainName(), std::ios::app) << "end";
    EXPECT_FALSE(fs::exists(file));
    first.commit();
    EXPECT_EQ(readFile(file), large + "end");
    EXPECT_FALSE(fs::exists(first.beside()));
    second.commit();
    EXPECT_EQ(readFile(file), "short");
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(dir), {}), 1);
  const mode_t mask = umask(0);
  umask(mask);
  EXPECT_EQ(static_cast<unsigned>(fs::status(file).permissions()), 0666U & ~mask);
  // What is never committed leaves what was there.
  { PendingFile(file).write("lost"); }
  EXPECT_EQ(readFile(file), "short");
  EXPECT_EQ(std::distance(fs::directory_iterator(dir), {}), 1);
}

TEST(PendingFile, SaysWhyItCannotBeWritten) {
  const fs::path dir = scratch();
  const auto why = [&](const fs::path& file) {
    return messageOf([&] {
      PendingFile pending(file);
      pending.commit();
    });
  };
  EXPECT_EQ(why(""), "cannot write : no file name");
  EXPECT_EQ(why(dir), "cannot write " + dir.string() + ": it is a directory");
  EXPECT_EQ(why(dir.string() + "/"), "cannot write " + dir.string() + "/: it is a directory");
  EXPECT_TRUE(why(dir / "no" / "a").ends_with(": No such file or directory"));
  PendingFile pending(dir / "a");
  fs::create_directory(dir / "a");
  EXPECT_TRUE(messageOf([&] { pending.commit(); }).ends_with("Is a directory"));
  // A file without a folder is in the one we work in.
  const fs::path was = fs::current_path();
  fs::current_path(dir);
  std::ofstream(".b.1-0.part") << "of a process long gone";
  PendingFile::sweep("b");
  EXPECT_FALSE(fs::exists(".b.1-0.part"));
  {
    PendingFile here("b");
    here.write("x");
    here.commit();
  }
  EXPECT_EQ(readFile(dir / "b"), "x");
  fs::current_path(was);
}

TEST(PendingFile, OnlyItsOwnPartsAreSwept) {
  const fs::path dir = scratch();
  const char* const others[] = {".a.part",      ".a..part",     ".a.1.part",     ".a.-.part",
                                ".a.-1.part",   ".a.1-.part",   ".a.1-2-3.part", ".a.1x-2.part",
                                ".a.1-2x.part", ".a.1-2.parts", "a.1-2.part",    ".ab.1-2.part",
                                ".a.1-2",       ".a.1-2part"};
  for (const char* other : others) std::ofstream(dir / other).flush();
  for (const char* own : {".a.1-2.part", ".a.0-0.part", ".a.9876543210-19.part"}) {
    std::ofstream(dir / own).flush();
  }
  PendingFile::sweep(dir / "a");
  EXPECT_EQ(std::distance(fs::directory_iterator(dir), {}), std::ssize(others));
  for (const char* other : others) EXPECT_TRUE(fs::exists(dir / other)) << other;
  PendingFile::sweep(dir / "no" / "a");  // nothing there: nothing to do
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
  EXPECT_EQ(run.path(), file);
}

TEST(RunFile, WaitsForAnotherThatReadsAndClosesAll) {
  const fs::path file = scratch() / "a.run";
  const auto open_files = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  const auto before = open_files();
  {
    RunFile run = RunFile::create(file, kMeta);
    const mode_t mask = umask(0);
    umask(mask);
    EXPECT_EQ(static_cast<unsigned>(fs::status(file).permissions()), 0666U & ~mask);
    sqlite3* db = nullptr;
    sqlite3_open(file.c_str(), &db);
    sqlite3_exec(db, "BEGIN; SELECT * FROM meta", nullptr, nullptr, nullptr);
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      sqlite3_exec(db, "COMMIT", nullptr, nullptr, nullptr);
    });
    EXPECT_NO_THROW(run.setMeta({{"seed", "3"}}));
    other.join();
    sqlite3_close(db);
  }
  EXPECT_EQ(RunFile::open(file, false).meta("seed"), "3");
  EXPECT_FALSE(RunFile::neverBegan(file));
  EXPECT_EQ(open_files(), before);
}

TEST(RunFile, WhatIsSaidAgainReplaces) {
  const fs::path file = scratch() / "a.run";
  {
    RunFile run = RunFile::create(file, kMeta);
    EXPECT_EQ(run.state(), std::nullopt);
    EXPECT_TRUE(run.trials().empty());
    run.setMeta({{"seed", "2"}, {"more", "ü"}});
    EXPECT_THROW(run.setMeta({{"a", "b"}, {"bad", "\xff"}}), InputError);
    EXPECT_EQ(run.meta("a"), std::nullopt);  // all or nothing
    run.setMeta({{"last", "1"}});
    for (const int g : {0, 1}) {
      const TrialRow rows[] = {{g, 0, 1.5, true, "", {1, 2}}, {g, 1, 2, false, "", {3, 4}}};
      run.appendGeneration(g, rows, "state-" + std::to_string(g), {});
      run.putRecording("best", "bytes" + std::to_string(g));
    }
    EXPECT_THROW(run.appendGeneration(2, {}, "lost", {{"bad", "\xff"}}), InputError);
  }
  RunFile run = RunFile::open(file, true);
  EXPECT_EQ(run.meta("seed"), "2");
  EXPECT_EQ(run.meta("more"), "ü");
  EXPECT_EQ(run.meta("skill"), "jump");
  EXPECT_EQ(run.meta("last"), "1");
  EXPECT_EQ(run.state(), "state-1");
  EXPECT_EQ(run.recording("best"), "bytes1");
  const auto trials = run.trials();
  ASSERT_EQ(trials.size(), 4U);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(trials[i].generation, static_cast<int>(i / 2));
    EXPECT_EQ(trials[i].number, static_cast<int>(i % 2));
    EXPECT_EQ(trials[i].failed, i % 2 == 0);
    EXPECT_EQ(trials[i].x, std::vector<double>(i % 2 == 0 ? std::vector<double>{1, 2}
                                                          : std::vector<double>{3, 4}));
  }
  run.putRecording("other", "");
  run.forget({"best", "none"}, {"seed", "more"});
  EXPECT_EQ(run.recording("other"), "");
  EXPECT_EQ(run.recording("best"), std::nullopt);
  EXPECT_EQ(run.meta("more"), std::nullopt);
  EXPECT_EQ(run.meta("skill"), "jump");
  // Which generation the state is of, others may read.
  sqlite3* db = nullptr;
  sqlite3_open(file.c_str(), &db);
  std::string generation;
  const auto keep = [](void* text, int, char** values, char**) {
    *static_cast<std::string*>(text) = values[0];
    return 0;
  };
  sqlite3_exec(db, "SELECT generation FROM resume", keep, &generation, nullptr);
  sqlite3_close(db);
  EXPECT_EQ(generation, "1");
}

TEST(RunFile, KeepsEveryCostATrialCanHave) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double costs[] = {NAN,   infinity, -infinity, 0,    -1.5,   0.1,
                          1e300, -1e300,   5e-324,    1e16, 1.0 / 3};
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
  const auto open_files = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  const auto files = open_files();
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
  EXPECT_EQ(open_files(), files);
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
  EXPECT_FALSE(RunFile::neverBegan(dir / "none.run"));
  EXPECT_FALSE(RunFile::neverBegan(dir));
  {
    const FileLock lock = FileLock::take(dir / "a.run");
    EXPECT_FALSE(RunFile::neverBegan(dir / "a.run"));  // it may be just beginning
  }
  EXPECT_TRUE(RunFile::neverBegan(dir / "a.run"));
  EXPECT_FALSE(fs::exists(dir / "a.run-lock"));
  std::ofstream(dir / "text.run") << "not empty";
  EXPECT_FALSE(RunFile::neverBegan(dir / "text.run"));
  RunFile::create(dir / "b.run", kMeta);
  EXPECT_FALSE(RunFile::neverBegan(dir / "b.run"));
  std::ofstream(dir / "b.run-journal") << "of no use";
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
  EXPECT_EQ(split(",a,,b", ','), std::vector<std::string>({"", "a", "", "b"}));
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
