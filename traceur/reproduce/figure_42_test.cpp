#include "traceur/reproduce/figure_42.h"

#include <gtest/gtest.h>

namespace traceur::reproduce {
namespace {

TEST(Figure42, IsAMapOfStarts) {
  const Table table = figure42();
  const Map map = figure42Map();
  const Outcome outcome = table.run(1, 0, 2, {});
  ASSERT_EQ(outcome.points.size(), static_cast<size_t>(map.count * map.count));
  double good = 0;
  for (size_t k = 0; k < outcome.points.size(); ++k) {
    EXPECT_EQ(outcome.points[k].x, static_cast<double>(k));
    good += outcome.points[k].y;
  }
  EXPECT_DOUBLE_EQ(outcome.value, 100 * good / (map.count * map.count));
  // The middle is balanced; the corner where both lean right by two degrees never was.
  const int middle = map.count / 2;
  EXPECT_EQ(outcome.points[middle * map.count + middle].y, 1);
  EXPECT_EQ(outcome.points.back().y, 0);
}

TEST(Figure42, WhatIsTrainedFollowsFromSeedAndNoise) {
  EXPECT_EQ(trainedWith(false, {}, 2).parameters, trainedWith(false, {}, 2).parameters);
  EXPECT_NE(trainedWith(false, {}, 2).parameters,
            trainedWith(false, figure42Noise(), 2).parameters);
}

TEST(Figure42, AskedToStopItEndsSoon) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(figure42().run(0, 0, 1, stop.get_token()).points.empty());
}

}  // namespace
}  // namespace traceur::reproduce
