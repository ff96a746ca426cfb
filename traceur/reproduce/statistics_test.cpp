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
  constexpr int kTrials = 400;
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

}  // namespace
}  // namespace traceur::reproduce
