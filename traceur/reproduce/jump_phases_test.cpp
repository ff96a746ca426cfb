#include "traceur/reproduce/jump_phases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>

namespace traceur::reproduce {
namespace {

/// Equal seeds give equal counts, other searches others; what is counted is trials, not
/// generations.
TEST(JumpPhases, CountTrialsUntilOneIsGoodEnough) {
  const Table t = jumpPhases();
  ASSERT_EQ(t.columns[1].name, "CMA-ES feasible first");
  const Outcome found = t.run(1, 1, 2, {});
  EXPECT_FALSE(found.missed);
  EXPECT_GT(found.value, 10);
  EXPECT_LT(found.value, 1000);
  EXPECT_NE(std::fmod(found.value, 10), 0);
  EXPECT_EQ(t.run(1, 1, 2, {}).value, found.value);
  EXPECT_NE(t.run(1, 3, 2, {}).value, found.value);
}

TEST(JumpPhases, StopWhenAskedTo) {
  std::stop_source source;
  source.request_stop();
  for (const int column : {0, 4}) {
    EXPECT_TRUE(jumpPhases().run(0, column, 1, source.get_token()).missed);
  }
}

}  // namespace
}  // namespace traceur::reproduce
