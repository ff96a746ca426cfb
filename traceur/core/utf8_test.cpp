#include "traceur/core/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace traceur {
namespace {

TEST(Utf8, TellsCharactersFromOtherBytes) {
  const std::pair<const char*, char32_t> characters[] = {{"a", U'a'},
                                                         {"ü", U'ü'},
                                                         {"€", U'€'},
                                                         {"🤸 cartwheel", U'🤸'},
                                                         {"\xf4\x8f\xbf\xbf", 0x10FFFF}};
  for (const auto& [text, code] : characters) {
    const Character c = firstCharacter(text);
    EXPECT_TRUE(c.valid) << text;
    EXPECT_EQ(c.code, code);
    EXPECT_EQ(c.bytes, code < 0x80 ? 1u : code < 0x800 ? 2u : code < 0x10000 ? 3u : 4u);
  }
  for (const char* wrong :
       {"\x80", "\xc3", "\xc0\xaf", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
        "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xe2\x82", "\xe2\x28\xa1", "\xff", "\xbf\xbf",
        "\xa2\x80", "\xf8\x90\x80\x80", "\xfc\x80\x80\x80", "\xed\xbf\xbf"}) {
    const Character c = firstCharacter(wrong);
    EXPECT_FALSE(c.valid) << wrong;
    EXPECT_EQ(c.bytes, 1u);
    EXPECT_EQ(c.code, static_cast<unsigned char>(wrong[0]));
  }
  EXPECT_TRUE(isUtf8("héllo €"));
  EXPECT_TRUE(isUtf8(""));
  EXPECT_FALSE(isUtf8("fine until \xe9"));
}

TEST(Utf8, EveryCharacterIsReadAsItIsWritten) {
  for (char32_t code = 1; code <= 0x10FFFF; ++code) {
    const size_t bytes = code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    std::string text(bytes, '\0');
    char32_t rest = code;
    for (size_t i = bytes - 1; i > 0; --i, rest >>= 6) {
      text[i] = static_cast<char>(0x80 | (rest & 0x3F));
    }
    const unsigned char leads[] = {0, 0xC0, 0xE0, 0xF0};
    text[0] = static_cast<char>(leads[bytes - 1] | rest);
    const Character c = firstCharacter(text);
    const bool surrogate = code >= 0xD800 && code < 0xE000;
    ASSERT_EQ(c.valid, !surrogate) << static_cast<unsigned>(code);
    if (surrogate) continue;
    ASSERT_EQ(c.code, code);
    ASSERT_EQ(c.bytes, bytes);
  }
}

}  // namespace
}  // namespace traceur
