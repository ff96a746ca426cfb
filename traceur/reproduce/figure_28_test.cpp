#include "traceur/reproduce/figure_28.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/optim/cma_c.h"
#include "traceur/reproduce/toy_constraints.h"

namespace traceur::reproduce {
namespace {

TEST(Figure28, HoldsWhatWasLearnedAgainstTheTruthCellByCell) {
  const LearnedRegion r = learnRegion("CMA-C", 1);
  static constexpr int kCells = LearnedRegion::kCells;
  ASSERT_EQ(r.truth.size(), static_cast<size_t>(kCells * kCells));
  ASSERT_EQ(r.learned.size(), r.truth.size());
  const auto last = runToy(9, 2, 1);
  EXPECT_EQ(static_cast<int>(r.x.size()), last.first.evaluations);
  EXPECT_EQ(std::count(r.feasible.begin(), r.feasible.end(), false), last.first.infeasible);
  const auto& cma_c = dynamic_cast<const optim::CmaC&>(*last.second);
  double learned = 0, truth = 0, both = 0;
  for (int k = 0; k < kCells * kCells; ++k) {
    const double x = 3.01 + 0.02 * (k % kCells);
    const int row = k / kCells;
    const double y = 3.01 + 0.02 * row;
    EXPECT_EQ(r.truth[k], x < 4 && y < 4 && (x > 3.5 || y > 3.5)) << x << ' ' << y;
    const double odds = cma_c.acceptance(Eigen::Vector2d(x, y));
    if (std::abs(odds - 0.5) > 1e-6) {
      EXPECT_EQ(r.learned[k], odds > 0.5) << x << ' ' << y;
    }
    learned += r.learned[k];
    truth += r.truth[k];
    both += r.learned[k] && r.truth[k];
  }
  ASSERT_GT(learned, 0);
  EXPECT_DOUBLE_EQ(r.precision, both / learned);
  EXPECT_DOUBLE_EQ(r.recall, both / truth);
  for (size_t i = 0; i < r.x.size(); ++i) {
    if (!r.feasible[i]) continue;
    EXPECT_LE(std::max(r.x[i], r.y[i]), 4);
    EXPECT_GE(std::min(r.x[i], r.y[i]), 3);
  }
  EXPECT_NE(r.x, r.y);
}

TEST(Figure28, IsTheLAndWhatWasLearnedOfIt) {
  const LearnedRegion r = learnRegion("CMA-C 2015", 1);
  const auto truth = std::count(r.truth.begin(), r.truth.end(), true);
  // [3, 4]² less a quarter of it, of [3, 5]²
  EXPECT_NEAR(static_cast<double>(truth) / static_cast<double>(r.truth.size()), 0.75 / 4, 0.005);
  EXPECT_EQ(r.x.size(), r.feasible.size());
  EXPECT_GT(r.precision, 2 * 0.75 / 4);  // better than guessing
  EXPECT_GT(r.recall, 0.2);
  EXPECT_THROW(learnRegion("CMA-ES", 1), InputError);
  EXPECT_THROW(learnRegion("nobody", 1), InputError);
}

}  // namespace
}  // namespace traceur::reproduce
