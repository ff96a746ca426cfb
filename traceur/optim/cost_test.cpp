#include "traceur/optim/cost.h"

#include <gtest/gtest.h>

namespace traceur::optim {
namespace {

using Eigen::VectorXd;

TEST(IsCost, IsForFiniteNumbersOnly) {
  for (const double cost : {0.0, -1.0, 1e308, -1e308, 5e-324}) EXPECT_TRUE(isCost(cost));
  for (const float cost : {NAN, INFINITY, -INFINITY}) EXPECT_FALSE(isCost(cost));
}

TEST(MeanCost, IsFiniteForHugeCosts) {
  EXPECT_EQ(meanCost(VectorXd{{1, 2, 6}}), 3);
  EXPECT_DOUBLE_EQ(meanCost(VectorXd{{1.7e308, 1.7e308, 1.7e308}}), 1.7e308);
  EXPECT_NEAR(meanCost(VectorXd{{1.7e308, 1.7e308, -1.7e308, -1.7e308}}), 0, 1e293);
  EXPECT_TRUE(std::isnan(meanCost(VectorXd{{1, NAN}})));
}

}  // namespace
}  // namespace traceur::optim
