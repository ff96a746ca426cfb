#include "traceur/core/utf8.h"

#include <gtest/gtest.h>

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
        "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xe2\x82", "\xe2\x28\xa1", "\xff"}) {
    const Character c = firstCharacter(wrong);
    EXPECT_FALSE(c.valid) << wrong;
    EXPECT_EQ(c.bytes, 1u);
    EXPECT_EQ(c.code, static_cast<unsigned char>(wrong[0]));
  }
  EXPECT_TRUE(isUtf8("héllo €"));
  EXPECT_TRUE(isUtf8(""));
  EXPECT_FALSE(isUtf8("fine until \xe9"));
}

}  // namespace
}  // namespace traceur
