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
  EXPECT_DOUBLE_EQ(median(Sample{100, 1, 3, 2}), 2.5);
  EXPECT_DOUBLE_EQ(median(Sample{7}), 7);
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

/// Of a statistic whose values are known: the k-th call gives `calls` - k, for 1000 down to 0.
TEST(Bootstrap, CutsOffAFortiethAtEitherEnd) {
  const Sample any = {1, 2};
  int calls = 0;
  const Interval i = bootstrap(
      {&any, 1}, [&](std::span<const Sample>) { return 1000.0 - calls++; }, 1001);
  EXPECT_EQ(calls, 1001);
  EXPECT_EQ(i.low, 25);
  EXPECT_EQ(i.high, 975);
  calls = 0;
  bootstrap({&any, 1}, [&](std::span<const Sample>) { return 0.0 * calls++; });
  EXPECT_EQ(calls, 4000);
}

/// The committed intervals rest on which values are drawn: of seed 1, a stream for each resample
/// and sample.
TEST(Bootstrap, DrawsEachSampleFromAStreamOfItsOwn) {
  const std::vector<Sample> samples = {{10, 11, 12}, {20, 21, 22, 23, 24}};
  int resample = 0;
  bootstrap(
      samples,
      [&](std::span<const Sample> drawn) {
        for (const size_t s : {0, 1}) {
          Random random(1, resample, s);
          Sample expected(samples[s].size());
          for (double& v : expected) v = samples[s][random.below(samples[s].size())];
          EXPECT_EQ(drawn[s], expected) << resample << ' ' << s;
        }
        return static_cast<double>(resample++);
      },
      20);
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

TEST(PairedDifference, OfSixteenPairsIsExact) {
  EXPECT_DOUBLE_EQ(pairedDifference(Sample(16, 1.0)).p, 2.0 / 65536);
}

/// The draws done here again: a sign a bit, 64 of them a number; what was seen is a draw, too.
TEST(PairedDifference, OfMorePairsIsOf65536Draws) {
  Random random(1);
  int alike = 0;
  for (int i = 0; i < 65536; ++i) {
    const std::uint64_t bits = random.bits() % (1 << 17);
    alike += bits == 0 || bits == (1 << 17) - 1;
  }
  EXPECT_DOUBLE_EQ(pairedDifference(Sample(17, 1.0)).p, (alike + 1) / 65537.0);

  // Of 3, nothing, 1 the sum is as far from 0 where the signs of the first and the 65th agree.
  Sample two(65, 0.0);
  two.front() = 3;
  two.back() = 1;
  Random again(1);
  int agree = 0;
  for (int i = 0; i < 65536; ++i) {
    const std::uint64_t first = again.bits();
    agree += first % 2 == again.bits() % 2;
  }
  EXPECT_DOUBLE_EQ(pairedDifference(two).p, (agree + 1) / 65537.0);
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
