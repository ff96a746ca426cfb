#include "traceur/reproduce/bongo.h"

#include <gtest/gtest.h>

namespace traceur::reproduce {
namespace {

TEST(Bongo, Table13TellsIterationsAndRuns) {
  const Table table = table13();
  ASSERT_EQ(table.rows.size(), 12U);
  Results runs(table);
  runs.add({0, 1, 1}, {3, false, {{1, 4e5}, {2, 300}, {3, 12}}});
  runs.add({0, 1, 2}, {10, true, {}});
  const std::vector<Results> read = table.readings(runs);
  ASSERT_EQ(read.size(), 2U);
  const Summary iterations = summarise(read[0]);
  EXPECT_EQ(iterations.cells[0][1].value, 6.5);
  EXPECT_EQ(iterations.cells[0][1].missed, 1);
  EXPECT_EQ(iterations.cells[0][1].printed, 2.8);
  EXPECT_EQ(summarise(read[1]).cells[0][1].value, 13);
}

TEST(Bongo, FaultsTellHowOftenTheLastPolicyBalances) {
  const Table table = bongoFaults();
  Results runs(table);
  runs.add({1, 0, 1}, {2, false, {{100, 97}}});
  const std::vector<Results> read = table.readings(runs);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(summarise(read[0]).cells[1][0].value, 2);
  EXPECT_EQ(summarise(read[1]).cells[1][0].value, 97);
}

TEST(Bongo, Figure41HasThePrintedCostsBesideOurs) {
  const Table table = figure41();
  ASSERT_EQ(table.rows.size(), 4U);
  const std::vector<Point> printed = table.printed_points(1, 0);
  ASSERT_EQ(printed.size(), 4U);
  EXPECT_EQ(printed[0].x, 0);
  EXPECT_EQ(printed[3].y, 91);
  EXPECT_TRUE(table.printed_points(1, 1).empty());  // it printed no control
  EXPECT_TRUE(table.printed_points(3, 0).empty());
}

/// A machine without faults: one iteration, the same for the same seed.
TEST(Bongo, AFaultlessMachineIsBalancedAtOnce) {
  const Table table = table13();
  const Outcome outcome = table.run(0, 0, 4, {});
  EXPECT_FALSE(outcome.missed);
  EXPECT_EQ(outcome.value, 1);
  const Outcome again = table.run(0, 0, 4, {});
  ASSERT_EQ(again.points.size(), outcome.points.size());
  for (size_t i = 0; i < again.points.size(); ++i) {
    EXPECT_EQ(again.points[i].y, outcome.points[i].y);
  }
}

}  // namespace
}  // namespace traceur::reproduce
