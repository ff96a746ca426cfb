#include "traceur/reproduce/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/random.h"

namespace traceur::reproduce {
namespace {

TEST(Statistics, AreWhatTheirNamesSay) {
  const Sample s = {4, 1, 100, 2, 3};
  EXPECT_DOUBLE_EQ(mean(s), 22);
  EXPECT_DOUBLE_EQ(median(s), 3);
  EXPECT_DOUBLE_EQ(trimmedMean(s, 0.2), 3);
  EXPECT_DOUBLE_EQ(trimmedMean(s, 0.1), 22);  // less than one of five
  EXPECT_NEAR(geometricMean(Sample{1, 10, 100}), 10, 1e-12);
  // Nine runs, best and worst dropped.
  EXPECT_DOUBLE_EQ(trimmedMean(Sample{9, 1, 2, 3, 4, 5, 6, 7, 8}, 1.0 / 9), 5);
}

TEST(Bootstrap, CoversTheTruthAsOftenAsItSays) {
  int covered = 0;
  static constexpr int kTrials = 400;
  for (int t = 0; t < kTrials; ++t) {
    Random random(7, t);
    Sample s(40);
    for (double& v : s) v = random.normal();
    const Interval i = bootstrap(
        {&s, 1}, [](const auto& d) { return mean(d[0]); }, 300);
    covered += i.low <= 0 && 0 <= i.high;
  }
  EXPECT_GT(covered, 0.91 * kTrials);
  EXPECT_LT(covered, 0.98 * kTrials);
}

TEST(Bootstrap, IsAPointForEqualRunsAndAPureFunction) {
  const std::vector<Sample> equal = {{3, 3, 3}, {2, 2}};
  const auto ratio = [](std::span<const Sample> d) { return mean(d[0]) / mean(d[1]); };
  const Interval i = bootstrap(equal, ratio);
  EXPECT_DOUBLE_EQ(i.low, 1.5);
  EXPECT_DOUBLE_EQ(i.high, 1.5);
  const std::vector<Sample> spread = {{3, 4, 9}, {2, 1}};
  EXPECT_EQ(bootstrap(spread, ratio).low, bootstrap(spread, ratio).low);
  EXPECT_LT(bootstrap(spread, ratio).low, bootstrap(spread, ratio).high);
}

TEST(PairedDifference, CountsTheSignsThatGoAsFar) {
  // Of the 16 signs of 1, 2, 3, 4 only all alike give a sum of ±10.
  const PairedDifference d = pairedDifference({1, 2, 3, 4});
  EXPECT_EQ(d.pairs, 4);
  EXPECT_DOUBLE_EQ(d.mean, 2.5);
  EXPECT_DOUBLE_EQ(d.p, 2.0 / 16);
  EXPECT_GE(d.interval.low, 1);
  EXPECT_LE(d.interval.high, 4);
  EXPECT_DOUBLE_EQ(pairedDifference({-1, -2, -3, -4}).p, 2.0 / 16);
  EXPECT_DOUBLE_EQ(pairedDifference({1, -1}).p, 1);
  EXPECT_DOUBLE_EQ(pairedDifference({0, 0, 0}).p, 1);
  // 0.1 + 0.2 - 0.3 is 0 but for rounding.
  EXPECT_DOUBLE_EQ(pairedDifference({0.1, 0.2, -0.3}).p, 1);
}

TEST(PairedDifference, OfManyPairsIsDrawnAndStillRight) {
  EXPECT_LT(pairedDifference(Sample(30, 1.0)).p, 1e-4);
  // Of noise, a p below 0.1 in a tenth of all samples.
  int low = 0;
  static constexpr int kTrials = 100;
  for (int t = 0; t < kTrials; ++t) {
    Random random(9, t);
    Sample s(18);
    for (double& v : s) v = random.normal();
    low += pairedDifference(s).p < 0.1;
  }
  EXPECT_GT(low, 2);
  EXPECT_LT(low, 20);
}

}  // namespace
}  // namespace traceur::reproduce
