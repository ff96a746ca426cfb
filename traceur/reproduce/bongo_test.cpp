#include "traceur/reproduce/bongo.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>

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
  EXPECT_EQ(read[0].table().rows[11].quantity, "iterations");
  EXPECT_EQ(read[1].table().rows[11].quantity, "runs of the machine");
  EXPECT_EQ(summarise(read[1]).cells[11][0].printed, 4);
}

TEST(Bongo, FaultsTellHowOftenTheLastPolicyBalances) {
  const Table table = bongoFaults();
  Results runs(table);
  runs.add({1, 0, 1}, {2, false, {{100, 97}}});
  const std::vector<Results> read = table.readings(runs);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(summarise(read[0]).cells[1][0].value, 2);
  EXPECT_EQ(summarise(read[1]).cells[1][0].value, 97);
  EXPECT_EQ(read[0].table().rows[3].quantity, "iterations");
  EXPECT_EQ(read[1].table().rows[3].quantity, "starts balanced of 100");
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

bool same(const bias::BongoFaults& a, const bias::BongoFaults& b) {
  for (const bias::BongoFaultField& f : bias::bongoFaultFields()) {
    if (a.*f.value != b.*f.value) return false;
  }
  return true;
}

/// The machine has the faults in its row's name, in its column's and no others.
TEST(Bongo, MachinesAreAsTheyAreCalled) {
  const Table table = table13();
  for (int row = 0; row < 12; ++row) {
    bias::BongoFaults expected;
    std::istringstream(table.rows[row].name) >> expected.torque_variance >>
        expected.angle_variance >> expected.rate_variance;
    EXPECT_TRUE(same(table13Run(row, 0, 1).machine.faults, expected)) << table.rows[row].name;
    expected.inertia_scale = 1.2;
    EXPECT_TRUE(same(table13Run(row, 1, 1).machine.faults, expected)) << table.rows[row].name;
  }

  const Table figure = figure41();
  for (int row = 0; row < 4; ++row) {
    const std::string& name = figure.rows[row].name;
    bias::BongoFaults expected;
    if (name == "COM offset 2 mm") {
      expected.com_offset = 0.002;
    } else {
      std::istringstream(name) >> expected.torque_variance >> expected.angle_variance >>
          expected.rate_variance;
    }
    if (name.ends_with("inertia +20 %")) expected.inertia_scale = 1.2;
    for (const int column : {0, 1}) {
      EXPECT_TRUE(same(figure41Run(row, column, 1).machine.faults, expected)) << name;
    }
  }

  const std::pair<const char*, double bias::BongoFaults::*> faults[] = {
      {"inertia +20 %", &bias::BongoFaults::inertia_scale},
      {"delay 5 ms", &bias::BongoFaults::delay},
      {"friction 2 N m", &bias::BongoFaults::coulomb_friction},
      {"COM offset 2 mm", &bias::BongoFaults::com_offset}};
  const double values[] = {1.2, 0.005, 2, 0.002};
  for (int row = 0; row < 4; ++row) {
    EXPECT_EQ(bongoFaults().rows[row].name, faults[row].first);
    bias::BongoFaults expected;
    expected.*faults[row].second = values[row];
    EXPECT_TRUE(same(bongoFaultsRun(row, 0, 1).machine.faults, expected)) << faults[row].first;
  }
}

TEST(Bongo, LearnAsTheirColumnsAreCalled) {
  using enum bias::BongoMethod;
  EXPECT_EQ(table13Run(0, 0, 7).learning.seed, 7U);
  EXPECT_EQ(table13Run(0, 1, 7).learning.method, kBias);
  EXPECT_EQ(figure41Run(1, 0, 7).learning.seed, 7U);
  EXPECT_EQ(figure41Run(1, 0, 7).learning.method, kBias);
  EXPECT_EQ(figure41Run(1, 1, 7).learning.method, kNone);
  const Table table = bongoFaults();
  for (int column = 0; column < static_cast<int>(table.columns.size()); ++column) {
    const std::string& name = table.columns[column].name;
    const bias::BongoLearning learning = bongoFaultsRun(2, column, 7).learning;
    EXPECT_EQ(learning.seed, 7U);
    EXPECT_EQ(learning.method, name == "identify"         ? kIdentify
                               : name == "randomise"      ? kRandomise
                               : name == "published"      ? kPublished
                               : name.starts_with("bias") ? kBias
                                                          : kNone)
        << name;
    EXPECT_EQ(learning.search, name.starts_with("published") || name.ends_with("one start")
                                   ? bias::BongoSearch::kPublished
                                   : bias::BongoSearch::kStarts)
        << name;
  }
}

TEST(Bongo, AskedToStopTheyEndSoon) {
  std::stop_source stop;
  stop.request_stop();
  const Outcome faults = bongoFaults().run(0, 0, 1, stop.get_token());
  EXPECT_EQ(faults.value, 0);
  EXPECT_TRUE(faults.points.empty());
  for (const Table& table : {table13(), figure41()}) {
    EXPECT_TRUE(table.run(0, 0, 1, stop.get_token()).missed);
  }
}

}  // namespace
}  // namespace traceur::reproduce
