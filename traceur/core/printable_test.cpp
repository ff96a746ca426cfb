#include "traceur/core/printable.h"

#include <gtest/gtest.h>

namespace traceur {
namespace {

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

TEST(FileNamePart, IsShort) {
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

}  // namespace
}  // namespace traceur
