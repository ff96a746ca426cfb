#include "traceur/reproduce/coach_faults.h"

#include <gtest/gtest.h>

#include <stop_token>

namespace traceur::reproduce {
namespace {

/// Each is put in once, and can be read. A line that is no longer in its script is our mistake.
TEST(CoachFaults, AreScriptsThatCanBeRead) {
  const Table t = coachFaults();
  EXPECT_EQ(t.rows.size(), 5U);
  EXPECT_NE(t.made_with(), "");
}

TEST(CoachFaults, StopWhenAskedTo) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(coachFaults().run(0, 0, 1, source.get_token()).value, 0);
}

}  // namespace
}  // namespace traceur::reproduce
