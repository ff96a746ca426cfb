#include "traceur/core/printable.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace traceur {
namespace {

std::string utf8(char32_t c) {
  std::string bytes;
  if (c < 0x80) {
    bytes = {static_cast<char>(c)};
  } else if (c < 0x800) {
    bytes = {static_cast<char>(0xC0 | c >> 6), static_cast<char>(0x80 | (c & 0x3F))};
  } else if (c < 0x10000) {
    bytes = {static_cast<char>(0xE0 | c >> 12), static_cast<char>(0x80 | (c >> 6 & 0x3F)),
             static_cast<char>(0x80 | (c & 0x3F))};
  } else {
    bytes = {static_cast<char>(0xF0 | c >> 18), static_cast<char>(0x80 | (c >> 12 & 0x3F)),
             static_cast<char>(0x80 | (c >> 6 & 0x3F)), static_cast<char>(0x80 | (c & 0x3F))};
  }
  return bytes;
}

/// First and last of a range of characters.
using Ranges = std::vector<std::pair<char32_t, char32_t>>;

/// Calls it with each range's ends and the characters beside them, and whether they are inside.
void forEachEdge(const Ranges& ranges, const std::function<void(char32_t, bool)>& check) {
  const auto inside = [&](char32_t c) {
    return std::any_of(ranges.begin(), ranges.end(),
                       [&](const auto& r) { return c >= r.first && c <= r.second; });
  };
  for (const auto& [first, last] : ranges) {
    for (const std::uint32_t c :
         {first - 1U, first + 0U, first + 1U, last - 1U, last + 0U, last + 1U}) {
      if (c > 0x10FFFF || (c >= 0xD800 && c <= 0xDFFF)) continue;
      check(c, inside(c));
    }
  }
}

TEST(Printable, LeavesWhatPeopleWrite) {
  for (const char* text :
       {"", "left knee", "Hüfte 膝 N·m → 🤖", R"(C:\new \x1b "quoted")"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, ShowsWhatATerminalObeys) {
  EXPECT_EQ(printable("a\x1b[31m\x07"), "a\\x1b[31m\\x07");
  EXPECT_EQ(printable("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(printable(std::string_view("a\0b\x7f", 4)), "a\\x00b\\x7f");
  EXPECT_EQ(printable("\xC2\x80\xC2\x9B"), "\\u0080\\u009b");  // C1: ESC [ in one character
  EXPECT_EQ(printable("\u202A\u202E\u2066\u2069\u2028\u2029"),
            "\\u202a\\u202e\\u2066\\u2069\\u2028\\u2029");
}

TEST(Printable, KnowsWhatIsObeyedToTheLetter) {
  const Ranges obeyed = {{0, 0x1F}, {0x7F, 0x9F}, {0x2028, 0x202E}, {0x2066, 0x2069}};
  forEachEdge(obeyed, [](char32_t c, bool is_obeyed) {
    EXPECT_EQ(printable(utf8(c)) != utf8(c), is_obeyed) << std::hex << static_cast<unsigned>(c);
  });
}

TEST(Printable, ShowsBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("a\xFF\x9B"), "a\\xff\\x9b");
  EXPECT_EQ(printable("\xE2\x82"), "\\xe2\\x82");           // cut off
  EXPECT_EQ(printable("\xC2z"), "\\xc2z");                  // what follows is not swallowed
  EXPECT_EQ(printable("\xC0\x9B"), "\\xc0\\x9b");           // ESC, spelled longer than needed
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // above U+10FFFF
}

TEST(Printable, KeepsTheLinesOfATextThatHasThem) {
  EXPECT_EQ(printableLines("one\x1b\n\n  two\r\n"), "one\\x1b\n\n  two\\r\n");
  EXPECT_EQ(printableLines(""), "");
}

TEST(FileNamePart, LeavesOrdinaryNames) {
  for (const char* name : {"jump", "two_feet", "v1.2-b", "Sprung-höhe", "跳"}) {
    EXPECT_EQ(fileNamePart(name), name);
  }
}

TEST(FileNamePart, IsNeverAPath) {
  EXPECT_EQ(fileNamePart("x/../../../ESCAPED"), "x-..-..-..-ESCAPED");
  EXPECT_EQ(fileNamePart("../../X"), "-.-..-X");
  EXPECT_EQ(fileNamePart("/etc/passwd"), "-etc-passwd");
  EXPECT_EQ(fileNamePart(".."), "-.");
  EXPECT_EQ(fileNamePart("."), "-");
  EXPECT_EQ(fileNamePart(".hidden"), "-hidden");
  EXPECT_EQ(fileNamePart("a\\b|c;d`e$(f)\n\x1b\xff"
                         "g"),
            "a-b-c-d-e-f-g");
  EXPECT_EQ(fileNamePart("kick \u202Eball\u2028"), "kick-ball-");
  EXPECT_EQ(fileNamePart(""), "unnamed");
}

TEST(FileNamePart, KnowsWhatHasInkToTheLetter) {
  const Ranges named = {{'a', 'z'}, {'A', 'Z'}, {'0', '9'}, {'_', '_'}, {'-', '.'}};
  forEachEdge(named, [](char32_t c, bool is_named) {
    EXPECT_EQ(fileNamePart("x" + utf8(c)), is_named ? "x" + utf8(c) : "x-")
        << static_cast<unsigned>(c);
  });
  const Ranges blank = {{0x7F, 0xA0},     {0xAD, 0xAD},     {0x1680, 0x1680}, {0x2000, 0x206F},
                        {0x3000, 0x3000}, {0xFEFF, 0xFEFF}, {0xFFF0, 0xFFFF}, {0xE0000, 0x10FFFF}};
  forEachEdge(blank, [](char32_t c, bool is_blank) {
    if (c < 0x7F) return;
    EXPECT_EQ(fileNamePart("x" + utf8(c)), is_blank ? "x-" : "x" + utf8(c))
        << std::hex << static_cast<unsigned>(c);
  });
}

TEST(FileNamePart, IsShort) {
  EXPECT_EQ(fileNamePart(std::string(100, 'a')).size(), 100);
  EXPECT_EQ(fileNamePart(std::string(99, 'a') + "ü").size(), 99);
  EXPECT_EQ(fileNamePart(std::string(1000, 'a')).size(), 100);
  std::string wide;
  for (int i = 0; i < 50; ++i) wide += "跳";  // of 3 bytes: none is cut in two
  EXPECT_EQ(fileNamePart(wide).size(), 99);
  EXPECT_EQ(printable(fileNamePart(wide)), fileNamePart(wide));
}

TEST(Columns, CountsLettersNotBytes) {
  EXPECT_EQ(columnsOf("Hüfte …"), 7);
  EXPECT_EQ(columnsOf("跳b"), 3);
}

TEST(Columns, CutsBetweenLetters) {
  EXPECT_EQ(cutToColumns("Hüfte", 5), "Hüfte");
  EXPECT_EQ(cutToColumns("Hüfte", 3), "Hü…");
  EXPECT_EQ(cutToColumns("a跳跳", 3), "a…");
  EXPECT_EQ(cutToColumns("a跳跳", 4), "a跳…");
  EXPECT_EQ(cutToColumns("abc", 1), "…");
  EXPECT_EQ(cutToColumns("abc", 0), "");
  EXPECT_EQ(cutToColumns("", 0), "");
}

TEST(Columns, WideLettersTakeTwo) {
  const Ranges wide = {{0x1100, 0x115F}, {0x2E80, 0xA4CF},   {0xAC00, 0xD7A3},
                       {0xF900, 0xFAFF}, {0xFE30, 0xFE6F},   {0xFF00, 0xFF60},
                       {0xFFE0, 0xFFE6}, {0x1F300, 0x1FAFF}, {0x20000, 0x3FFFD}};
  forEachEdge(wide, [](char32_t c, bool is_wide) {
    EXPECT_EQ(columnsOf(utf8(c)), is_wide ? 2 : 1) << std::hex << static_cast<unsigned>(c);
    EXPECT_EQ(cutToColumns(utf8(c) + "ab", 2), is_wide ? "…" : utf8(c) + "…");
  });
  EXPECT_EQ(columnsOf("\xE8\xB7"), 2);  // two bytes of one that is cut off
  EXPECT_EQ(cutToColumns("abc", -1), "");
  EXPECT_EQ(cutToColumns("\xE8\xB7zz", 2), "\xE8…");
}

}  // namespace
}  // namespace traceur
