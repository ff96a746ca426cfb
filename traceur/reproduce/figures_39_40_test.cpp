#include "traceur/reproduce/figures_39_40.h"

#include <gtest/gtest.h>

namespace traceur::reproduce {
namespace {

TEST(Figure40, PredictsRunsItWasNotTrainedOn) {
  const std::vector<BiasField> fields = biasFields(1);
  ASSERT_EQ(fields.size(), 2U);
  for (const BiasField& f : fields) {
    SCOPED_TRACE(f.machine);
    EXPECT_LE(f.training.size(), 100U);
    EXPECT_GT(f.truth.size(), 20U);
    ASSERT_EQ(f.predicted.size(), f.truth.size());
    ASSERT_EQ(f.explained.size(), 3);
    // R² by hand, of the board's rate.
    double left = 0, whole = 0;
    for (size_t i = 0; i < f.truth.size(); ++i) {
      const double truth = f.truth[i].difference[4];
      left += (truth - f.predicted[i][4]) * (truth - f.predicted[i][4]);
      whole += truth * truth;
    }
    EXPECT_NEAR(f.explained[1], 1 - left / whole, 1e-9);
  }
  EXPECT_GT(fields[0].explained.minCoeff(), 0.9);
  // Dry friction is harder to predict; two runs were kept apart for the truth of each.
  EXPECT_EQ(fields[0].machine, "inertia +20 %");
  EXPECT_EQ(fields[1].machine, "friction 2 N·m");
  EXPECT_EQ(fields[0].training.size(), 100U);
  EXPECT_EQ(fields[0].truth.size(), 156U);
  EXPECT_EQ(fields[1].truth.size(), 124U);
  const double explained[2][3] = {{0.99826, 0.99759, 0.99815}, {0.83277, 0.84674, 0.84175}};
  for (int field = 0; field < 2; ++field) {
    for (int rate = 0; rate < 3; ++rate) {
      EXPECT_NEAR(fields[field].explained[rate], explained[field][rate], 1e-4);
    }
  }
}

/// Of seed 1, rounded.
TEST(Figure39, TheModelsPolicyFallsOnTheMachineAndTheLearnedOneHolds) {
  bias::VectorXd of_model(5), learned(5);
  of_model << 6.6685, -0.55492, -5.40503, -1.33384, -0.37071;
  learned << 6.55094, 3.07995, -5.40913, -0.5577, -3.48223;
  const std::vector<BalanceTrial> trials = trialsOf(of_model, learned, figure39Machine());
  ASSERT_EQ(trials.size(), 4U);
  EXPECT_EQ(trials[0].failure, "");
  EXPECT_EQ(trials[0].log.steps(), 5000);
  EXPECT_EQ(trials[1].failure, "distance");
  EXPECT_LT(trials[1].log.steps(), 5000);
  EXPECT_EQ(trials[2].failure, "");
  const char* policies[] = {"model's", "model's", "learned", "learned"};
  const char* plants[] = {"model", "machine", "machine", "model"};
  const bias::VectorXd start = bias::bongoStart(0.3 * M_PI / 180, 0.3 * M_PI / 180);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(trials[i].policy, policies[i]);
    EXPECT_EQ(trials[i].plant, plants[i]);
    EXPECT_TRUE(trials[i].log.x.col(0).isApprox(start, 1e-5)) << i;
  }
}

}  // namespace
}  // namespace traceur::reproduce
