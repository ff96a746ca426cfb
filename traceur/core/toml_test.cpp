// Texts that nobody wrote by hand: refused soon, in a sentence.
#include "traceur/core/toml.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "traceur/core/test_folder.h"
#include "traceur/core/text.h"

namespace traceur {
namespace {

std::string refusal(const std::string& text) {
  try {
    parseToml(text, "f.toml");
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST(HostileToml, KeysWithoutEndAreRefusedWhereTheyStand) {
  EXPECT_TRUE(refusal("a = 1\n" + repeated("a.", 30000) + "b = 1\n").starts_with("f.toml:2:1: "));
  EXPECT_TRUE(refusal("[" + repeated("a.", 100000) + "b]\n").starts_with("f.toml:1:1: "));
  // Text that does not end, ends with its line.
  const std::string deep = repeated("a.", 30) + "b = 1\n";
  EXPECT_TRUE(refusal("a = \"open\n" + deep).starts_with("f.toml:2:1: "));
  EXPECT_TRUE(refusal("a = 'open\n\n" + deep).starts_with("f.toml:3:1: "));
  EXPECT_TRUE(refusal("a = '''open\n'''\n" + deep).starts_with("f.toml:3:1: "));
  EXPECT_NE(refusal("a = { " + repeated("\"b\" . ", 100) + "c = 1 }\n"), "");
  EXPECT_NE(refusal("a = " + repeated("[", 100000)), "");
  EXPECT_NE(refusal("a = " + repeated("{b=", 100000)), "");
}

TEST(HostileToml, DotsElsewhereAreNoKey) {
  const std::string dots = repeated(".", 100);
  EXPECT_EQ(refusal("a.b.c.d = \"" + dots + "\\\"" + dots + "\"  # " + dots + "\n" + "e = '" +
                    dots + "'\nf = \"\"\"\n" + dots + "\n\"\"\"\ng = '''" + dots + "'''\nh = [" +
                    repeated("1.5, ", 100) + "]\n" + repeated("[x.y]\n", 1)),
            "");
}

TEST(HostileToml, AKeyHasAtMostSixteenDots) {
  const std::string deep = repeated("a.", 17) + "b";
  EXPECT_EQ(refusal(repeated("a.", 16) + "b = 1\n"), "");
  EXPECT_EQ(refusal(deep + " = 1\n"), "f.toml:1:1: a key of more than 16 dots: expected fewer");
  // Wherever a text ends, what follows it on its line counts.
  for (const char* text : {"''", "'x'", "'x\\'", "'\"'", "\"\"", "\"x\"", "\"'\"", "\"x\\\"y\"",
                           "\"x\\\\\"", "'''x'''", "'''x'y''z'''", "''''''",
                           "\"\"\"x\"y\"\"z\"\"\"", "\"\"\"\\\"\"\"\"", "1", "[1]", "{c = 1}"}) {
    EXPECT_TRUE(refusal("a = {x = " + std::string(text) + ", " + deep + " = 1}")
                    .starts_with("f.toml:1:1: a key"))
        << text;
  }
  // The lines within texts, and those of comments, are counted.
  EXPECT_TRUE(
      refusal("a = '''\n\n'''\n# it's \"\n" + deep + " = 1").starts_with("f.toml:5:1: a key"));
  EXPECT_TRUE(refusal("a = 'open\n" + deep + " = 1").starts_with("f.toml:2:1: a key"));
  EXPECT_TRUE(
      refusal("x = 1\n\ny = \"\"\"\n\"\"\"\n" + deep + " = 1").starts_with("f.toml:5:1: a key"));
  EXPECT_EQ(refusal("# " + deep), "");
  EXPECT_EQ(refusal("x = '" + deep + "'"), "");
  EXPECT_EQ(refusal("x = 'a\\'  # " + deep), "");
  // Other keys and numbers begin anew.
  const std::string ten = repeated("a.", 10) + "b";
  EXPECT_EQ(
      refusal(ten + " = 1.5\n[" + ten + "x]\n" + ten + " = [1.5, 2.5]\nc = {" + ten + " = 1.5}"),
      "");
}

TEST(HostileToml, WhatIsTooLongIsNotRead) {
  const std::string most = "#" + std::string((1U << 20) - 1, ' ');
  EXPECT_EQ(refusal(most), "");
  EXPECT_EQ(refusal(most + " "), "f.toml: 1048577 bytes: expected at most 1048576");
  std::string many;
  for (int i = 0; many.size() <= (1u << 20); ++i) many += fmt::format("k{} = 1\n", i);
  EXPECT_NE(refusal(many).find("expected at most 1048576"), std::string::npos);
}

TEST(HostileToml, TheHundredthMistakeIsTheLast) {
  std::string many;
  for (int i = 0; i < 50000; ++i) many += fmt::format("key{} = 1\n", i);
  const TomlValue document = parseToml(many, "f.toml");
  Diagnostics diagnostics("f.toml");
  const TomlReader reader(document, diagnostics);
  try {
    reader.finish();
    FAIL() << "all was read";
  } catch (const InputError& e) {
    const std::string words = e.what();
    EXPECT_EQ(std::count(words.begin(), words.end(), '\n'), 100);
    EXPECT_TRUE(words.ends_with("f.toml: 100 mistakes: the rest was not looked at"));
  }
}

TEST(HostileToml, ALongWordIsNotCompared) {
  const std::vector<std::string> names = {"thigh", std::string(1'000'000, 'x')};
  EXPECT_EQ(didYouMean(std::string(1'000'000, 'x'), names), "");
  EXPECT_EQ(didYouMean("thihg", names), " Did you mean \"thigh\"?");
}

std::string readingOf(const std::filesystem::path& file) {
  try {
    return readFile(file);
  } catch (const InputError& e) {
    return e.what();
  }
}

TEST(ReadFile, ADeviceIsNoFileAndAPipeIsReadToItsEnd) {
  EXPECT_EQ(readingOf("/dev/zero"), "/dev/zero: expected a file, got a device");
  const TestFolder folder;
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(pipe) << "name = 1\n"; });
  EXPECT_EQ(readingOf(pipe), "name = 1\n");
  writer.join();
}

TEST(ReadFile, APipeWithoutAWriterIsNotWaitedForForEver) {
  const TestFolder folder;
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(readingOf(pipe).ends_with("a pipe that is not at its end within 5 s"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(8));
}

TEST(ReadFile, MoreThanAnyTextIsRefused) {
  const TestFolder folder;
  std::ofstream(folder / "large") << "";
  std::filesystem::resize_file(folder / "large", (64 << 20) + 1);
  EXPECT_TRUE(readingOf(folder / "large").ends_with("expected at most 64 MiB"));
  std::filesystem::resize_file(folder / "large", 64 << 20);
  EXPECT_EQ(readingOf(folder / "large").size(), 64U << 20);
  // And each file is closed again.
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                         std::filesystem::directory_iterator());
  };
  const auto before = open_files();
  readingOf(folder / "large");
  readingOf(folder.path());
  EXPECT_EQ(open_files(), before);
}

TEST(TomlNumbers, AreWrittenAnewWhereTheyStand) {
  const std::string text =
      "# ein Maß\n[parameters]\n\"a·b\" = { unit = \"rad·s/m\", initial = -0.25, max = 1e3 }#x\r\n"
      "b = 7 # too\n[parameters.c]\ninitial=0.1\n[[list]]\nx = 1";
  const std::vector<TomlNumber> numbers = {{{"parameters", "c", "initial"}, 1.0 / 3},
                                           {{"parameters", "a·b", "initial"}, 12345.5},
                                           {{"parameters", "a·b", "max"}, -1},
                                           {{"parameters", "b"}, 0}};
  EXPECT_EQ(
      withNumbers(text, "f.toml", numbers),
      "# ein Maß\n[parameters]\n\"a·b\" = { unit = \"rad·s/m\", initial = 12345.5, max = -1 }#x\r\n"
      "b = 0 # too\n[parameters.c]\ninitial=0.3333333333333333\n[[list]]\nx = 1");
  EXPECT_EQ(withNumbers(text, "f.toml", {}), text);
  for (const TomlNumber& none :
       {TomlNumber{{"parameters", "d"}, 1}, TomlNumber{{"parameters", "c"}, 1},
        TomlNumber{{"parameters", "a·b", "unit"}, 1}, TomlNumber{{"list", "x"}, 1}}) {
    EXPECT_THROW(withNumbers(text, "f.toml", {&none, 1}), InputError);
  }
}

}  // namespace
}  // namespace traceur
