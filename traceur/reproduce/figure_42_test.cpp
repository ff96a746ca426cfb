#include "traceur/reproduce/figure_42.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "traceur/bias/bongo_learning.h"

namespace traceur::reproduce {
namespace {

/// Of the committed runs; CommittedRuns in table_test.cpp makes some again.
TEST(Figure42, IsAMapOfStarts) {
  const Table table = figure42();
  const Map map = figure42Map();
  const Results runs = Results::read(table, "docs/reproduction/unfinished/figure-42.csv");
  for (const auto& [key, outcome] : runs.outcomes()) {
    ASSERT_EQ(outcome.points.size(), static_cast<size_t>(map.count * map.count));
    double good = 0;
    for (size_t k = 0; k < outcome.points.size(); ++k) {
      EXPECT_EQ(outcome.points[k].x, static_cast<double>(k));
      good += outcome.points[k].y;
    }
    EXPECT_DOUBLE_EQ(outcome.value, 100 * good / (map.count * map.count));
  }
  EXPECT_EQ(map.low, -map.high);
  EXPECT_EQ(map.high, 0.035);
  EXPECT_EQ(table.map.count, 12);
  EXPECT_EQ(table.map.ylabel, map.ylabel);
  EXPECT_NE(table.protocol.find("12 x 12 squares of +-0.035 rad"), std::string::npos);
  EXPECT_NE(table.protocol.find("variances 0.1 N2m2, 4e-06 rad2 and 0.004 rad2/s2"),
            std::string::npos);
}

/// The middle is balanced; the corner where both lean right by two degrees never was.
TEST(Figure42, PoliciesBalanceAboutTheMiddle) {
  const Map map = figure42Map();
  const int middle = map.count / 2;
  const Outcome outcome = figure42().run(1, 0, 2, {});
  EXPECT_EQ(outcome.points[middle * map.count + middle].y, 1);
  EXPECT_EQ(outcome.points.back().y, 0);
  EXPECT_FALSE(outcome.missed);
  const Results runs = Results::read(figure42(), "docs/reproduction/unfinished/figure-42.csv");
  EXPECT_DOUBLE_EQ(outcome.value, runs.outcomes().at({1, 0, 2}).value);
}

/// What a machine reads while it is pushed for ten steps.
std::vector<bias::VectorXd> readings(Plant& machine, const bias::VectorXd& start) {
  std::vector<bias::VectorXd> all;
  machine.reset(start);
  for (int step = 0; step < 10; ++step) {
    all.push_back(machine.state());
    machine.step(bias::VectorXd::Constant(1, 0.5));
  }
  return all;
}

TEST(Figure42, MachinesHaveTheSameNoiseWheneverAnEpisodeBeginsAlike) {
  const bias::VectorXd start = bias::bongoStart(0.01, 0.005);
  const bias::VectorXd other = bias::bongoStart(0.01, 0.006);
  const bias::BongoFaults faults = figure42Noise();
  const auto machine = machineOfSameNoise(faults, 3);
  EXPECT_EQ(machine->states(), 6);
  EXPECT_EQ(machine->inputs(), 1);
  EXPECT_EQ(machine->timeStep(), 0.001);
  EXPECT_EQ(machine->state().size(), 6);
  const auto first = readings(*machine, start);
  const auto between = readings(*machine, other);
  EXPECT_EQ(readings(*machine, start), first);
  EXPECT_NE(readings(*machineOfSameNoise(faults, 4), start), first);
  // The noise that is on one start's readings is not on another's.
  const auto exact = machineOfSameNoise({}, 3);
  const auto of_start = readings(*exact, start);
  const auto of_other = readings(*exact, other);
  EXPECT_NEAR(first[0][0], start[0], 0.02);
  EXPECT_NE((first[0] - of_start[0]).eval(), (between[0] - of_other[0]).eval());
  EXPECT_GT((first[9] - of_start[9]).tail(3).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT((of_start[9] - of_start[0]).cwiseAbs().maxCoeff(), 1e-4);  // it has moved
}

TEST(Figure42, AskedToStopItEndsSoon) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(figure42().run(0, 0, 1, stop.get_token()).points.empty());
  EXPECT_LE(trainedWith(false, {}, 1, stop.get_token()).trials, 1);
}

}  // namespace
}  // namespace traceur::reproduce
