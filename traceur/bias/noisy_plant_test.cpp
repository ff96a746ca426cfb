#include "traceur/bias/noisy_plant.h"

#include <gtest/gtest.h>

#include "traceur/bias/bongo_learning.h"
#include "traceur/bias/faulty_bongo_board.h"
#include "traceur/bias/test_states.h"
#include "traceur/core/random.h"

namespace traceur::bias {
namespace {

VectorXd variances() {
  VectorXd v(6);
  v << 1e-6, 2e-6, 3e-6, 1e-3, 2e-3, 3e-3;
  return v;
}

RunLog drive(Plant& plant, const VectorXd& x0) {
  RunLog log{plant.timeStep(), MatrixXd(6, 301), MatrixXd(1, 300)};
  plant.reset(x0);
  log.x.col(0) = plant.state();
  for (int t = 0; t < 300; ++t) {
    log.u(0, t) = 20 * std::sin(0.05 * t);
    plant.step(log.u.col(t));
    log.x.col(t + 1) = plant.state();
  }
  return log;
}

TEST(NoisyPlant, MovesAsThePlantAndShowsItWithNoise) {
  BongoBoard clean;
  NoisyPlant noisy(std::make_unique<BongoBoard>(), variances(), 5);
  const VectorXd x0 = bongoStart(0.001, 0.002);
  const MatrixXd noise = drive(noisy, x0).x - drive(clean, x0).x;
  const VectorXd seen = noise.array().square().rowwise().mean();
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(seen[i], variances()[i], 0.3 * variances()[i]) << i;
  EXPECT_EQ(drive(noisy, x0).x, drive(noisy, x0).x);
  // Another start sees other noise, and so does another seed.
  const VectorXd x1 = bongoStart(0.002, 0.001);
  EXPECT_GT((drive(noisy, x1).x - drive(clean, x1).x - noise).norm(), 0.5 * noise.norm());
  NoisyPlant other(std::make_unique<BongoBoard>(), variances(), 6);
  EXPECT_GT((drive(other, x0).x - drive(clean, x0).x - noise).norm(), 0.5 * noise.norm());
}

TEST(NoisyPlant, NoiseIsToldFromForcesThatTheModelHasNot) {
  BongoBoard model;
  const BongoModelFaults faults{.inertia_scale = 1.2, .delay = 0.005, .coulomb_friction = 2};
  FaultyBongoBoard faulty({}, faults);
  std::vector<RunLog> logs;
  logs.reserve(4);
  for (int i = 0; i < 4; ++i) logs.push_back(drive(faulty, bongoStart(0.001 * i, -0.001)));
  EXPECT_LT(readingNoise(logs, model, all).tail<3>().maxCoeff(), 1e-5);

  NoisyPlant noisy(std::make_unique<FaultyBongoBoard>(BongoParameters(), faults), variances(), 7);
  logs.clear();
  for (int i = 0; i < 4; ++i) logs.push_back(drive(noisy, bongoStart(0.001 * i, -0.001)));
  const VectorXd found = readingNoise(logs, model, all);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(found[i], variances()[i], 0.3 * variances()[i]) << i;
  EXPECT_EQ(readingNoise({}, model, all), VectorXd::Zero(6));
}

TEST(NoisyPlant, ItsNoiseIsASequenceOf8192Readings) {
  static constexpr int kReadings = 8192;
  BongoBoard clean;
  NoisyPlant noisy(std::make_unique<BongoBoard>(), VectorXd::Constant(6, 4), 5);
  const VectorXd push = VectorXd::Zero(1);
  MatrixXd noise(6, 2 * kReadings);
  noisy.reset(VectorXd::Zero(6));  // where it stays
  noise.col(0) = noisy.state();
  for (int t = 1; t < noise.cols(); ++t) {
    noisy.step(push);
    noise.col(t) = noisy.state();
  }
  EXPECT_EQ(noise.leftCols(kReadings), noise.rightCols(kReadings));
  for (int t = 1; t < kReadings; ++t) ASSERT_NE(noise(0, 0), noise(0, t)) << t;
  // What a seed gave once it gives for ever: somewhere among them are its first numbers.
  Random random(5, 0);
  VectorXd first(6);
  for (double& x : first) x = 2 * random.normal();
  EXPECT_LT((noise.colwise() - first).colwise().norm().minCoeff(), 1e-12);
}

/// By its definition, over neighbours of which all three readings may be used.
TEST(NoisyPlant, TheNoiseIsHowMuchNeighboursDiffer) {
  class Still : public Plant {  // so that a residual is the difference of two readings
   public:
    int states() const override { return 2; }
    int inputs() const override { return 1; }
    double timeStep() const override { return 1; }
    void reset(const VectorXd& x) override { x_ = x; }
    void step(const VectorXd&) override {}
    const VectorXd& state() const override { return x_; }

   private:
    VectorXd x_;
  } model;
  Random random(8);
  std::vector<RunLog> logs;
  for (const int steps : {12, 7, 2, 1}) {
    RunLog log{1, MatrixXd(2, steps + 1), MatrixXd::Zero(1, steps)};
    for (double& x : log.x.reshaped()) x = random.normal();
    logs.push_back(log);
  }
  logs[0].x(0, 5) = 50;  // these may not
  logs[1].x(0, 0) = 50;
  const auto keep = [](const VectorXd& x) { return x[0] < 40; };
  VectorXd sum = VectorXd::Zero(2);
  int count = 0;
  for (const RunLog& log : logs) {
    for (int t = 1; t < log.steps(); ++t) {
      if (!keep(log.x.col(t - 1)) || !keep(log.x.col(t)) || !keep(log.x.col(t + 1))) continue;
      sum -= (log.x.col(t + 1) - log.x.col(t)).cwiseProduct(log.x.col(t) - log.x.col(t - 1));
      ++count;
    }
  }
  ASSERT_EQ(count, 8 + 5 + 1);
  ASSERT_GT(sum.minCoeff(), 0);
  EXPECT_LT((readingNoise(logs, model, keep) - sum / count).norm(), 1e-12);
  // Neighbours that are alike show none, be they only two.
  RunLog rising{1, MatrixXd(2, 3), MatrixXd::Zero(1, 2)};
  rising.x << 0, 1, 2, 0, 1, 0;
  EXPECT_EQ(readingNoise({rising}, model, keep), Eigen::Vector2d(0, 1));
}

}  // namespace
}  // namespace traceur::bias
