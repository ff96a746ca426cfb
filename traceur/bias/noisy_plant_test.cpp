#include "traceur/bias/noisy_plant.h"

#include <gtest/gtest.h>

#include "traceur/bias/bongo_learning.h"
#include "traceur/bias/faulty_bongo_board.h"

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

bool all(const VectorXd&) {
  return true;
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

}  // namespace
}  // namespace traceur::bias
