#include "traceur/reproduce/landing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace traceur::reproduce {
namespace {

TEST(LandingTables, SayOfAFallWhatTheyShould) {
  const Table falls = table2();
  ASSERT_EQ(falls.rows.size(), 8U);
  const Outcome feet = falls.run(5, 1, 1, {});
  EXPECT_TRUE(feet.value == 0 || feet.value == 1);
  EXPECT_TRUE(feet.value == 0 || !feet.missed);
  EXPECT_EQ(feet.value, falls.run(5, 1, 2, {}).value);  // nothing is drawn

  const Table stress = figure17();
  int neck = 0;
  while (stress.rows[static_cast<size_t>(neck)].name != "neck") ++neck;
  const Outcome limp = stress.run(neck, 0, 1, {});
  EXPECT_GT(limp.value, 0.05);
  EXPECT_LT(limp.value, 100);
  EXPECT_NE(stress.run(neck, 1, 1, {}).value, limp.value);
  EXPECT_EQ(stress.columns[1].printed[static_cast<size_t>(neck)], 5.0);
}

TEST(LandingTables, FlyWithAsManyPosesAsTheySay) {
  const Table flight = landingFlight();
  const double many = flight.run(0, 0, 3, {}).value;
  EXPECT_GE(many, 0);
  EXPECT_LT(many, 2);
  EXPECT_NE(flight.run(0, 2, 3, {}).value, many);
}

TEST(AirPoses, AreSixteenAndChosenInFlight) {
  const AirPoses air = airPoses(1);
  ASSERT_EQ(air.poses.size(), 16U);
  ASSERT_EQ(air.chosen.size(), 16U);
  EXPECT_EQ(std::accumulate(air.chosen.begin(), air.chosen.end(), air.none), 100);
  // What is chosen depends on the fall.
  EXPECT_GE(std::count_if(air.chosen.begin(), air.chosen.end(), [](int n) { return n > 0; }), 4);
  EXPECT_NE(airPoses(2).chosen, air.chosen);
  for (const sim::State& pose : air.poses) {
    EXPECT_EQ(std::count_if(air.poses.begin(), air.poses.end(),
                            [&](const sim::State& other) { return other.q == pose.q; }),
              1);
  }
}

}  // namespace
}  // namespace traceur::reproduce
