#include "apps/cli/progress.h"

#include <gtest/gtest.h>

#include "traceur/core/printable.h"

namespace traceur::cli {
namespace {

const std::string kText = "320/2000  best 0.0123  41.0 trials/s  41 s left";

TEST(ProgressText, IsTitleBarAndNumbersWhereThereIsRoom) {
  EXPECT_EQ(progressText("jump", 0.25, kText, 200), "jump [======                  ] " + kText);
  EXPECT_EQ(progressText("jump", 1.5, kText, 200), "jump [" + std::string(24, '=') + "] " + kText);
}

TEST(ProgressText, IsAlwaysOneLineOfTheTerminal) {
  const std::string long_title(300, 'x');
  std::string wide_title;
  for (int i = 0; i < 100; ++i) wide_title += "跳";
  for (const std::string& title : {std::string("jump"), long_title, wide_title}) {
    for (const std::string& text : {kText, kText + std::string(500, '7')}) {
      for (int columns = 1; columns < 300; ++columns) {
        ASSERT_LT(columnsOf(progressText(title, 0.5, text, columns)), columns);
      }
    }
  }
}

TEST(ProgressText, GivesUpTheBarThenTheTitleThenTheNumbers) {
  EXPECT_EQ(progressText("jump", 0.5, kText, 70), "jump [=======       ] " + kText);
  EXPECT_EQ(progressText("jump", 0.5, kText, 61), "jump " + kText);
  EXPECT_EQ(progressText("a very long skill's name", 0.5, kText, 64), "a very long sk… " + kText);
  EXPECT_EQ(progressText("a very long skill's name", 0.5, kText, 40),
            "a very long… 320/2000  best 0.0123  41…");
}

TEST(Duration, IsReadAsAClock) {
  EXPECT_EQ(duration(12.4), "12 s");
  EXPECT_EQ(duration(64), "1:04");
}

}  // namespace
}  // namespace traceur::cli
