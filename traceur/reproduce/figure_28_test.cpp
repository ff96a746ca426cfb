#include "traceur/reproduce/figure_28.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "traceur/core/error.h"

namespace traceur::reproduce {
namespace {

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
