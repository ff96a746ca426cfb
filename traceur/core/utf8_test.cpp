#include "traceur/core/utf8.h"

#include <gtest/gtest.h>

namespace traceur {
namespace {

TEST(Utf8, TellsCharactersFromOtherBytes) {
  EXPECT_EQ(utf8Length("a"), 1u);
  EXPECT_EQ(utf8Length("ü"), 2u);
  EXPECT_EQ(utf8Length("€"), 3u);
  EXPECT_EQ(utf8Length("\U0001F938 cartwheel"), 4u);
  for (const char* wrong :
       {"", "\x80", "\xc3", "\xc0\xaf", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80",
        "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf5\x80", "\xe2\x82", "\xe2\x28\xa1", "\xff"}) {
    EXPECT_EQ(utf8Length(wrong), 0u) << wrong;
  }
  EXPECT_EQ(utf8Length("\xf4\x8f\xbf\xbf"), 4u);  // the last of Unicode's
  EXPECT_TRUE(isUtf8("héllo €"));
  EXPECT_TRUE(isUtf8(""));
  EXPECT_FALSE(isUtf8("fine until \xe9"));
}

}  // namespace
}  // namespace traceur
