#include "traceur/fall/pendulum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace traceur::fall {
namespace {

PendulumModel atlas() {
  return {.mass = 150, .inertia = 28};
}

/// ½ m (ṙ² + r² θ̇²) + m g y, per unit of mass.
double energy(const PendulumModel& model, const PendulumState& s) {
  return s.comVelocity().squaredNorm() / 2 + model.gravity * s.com().y();
}

TEST(Pendulum, KeepsItsEnergyWhileTheRodKeepsItsLength) {
  PendulumModel model = atlas();
  model.step = 1e-5;
  PendulumState s{.theta = 0.1, .r = 1.05, .theta_rate = 0.4};
  const double before = energy(model, s);
  for (int i = 0; i < 60'000; ++i) step(model, 0, s);
  EXPECT_GT(s.theta, 0.5);
  EXPECT_NEAR(energy(model, s), before, 1e-4 * before);
}

TEST(Pendulum, KeepsAngularMomentumWithoutGravityWhileTheRodShortens) {
  PendulumModel model = atlas();
  model.gravity = 0;
  model.step = 1e-5;
  PendulumState s{.theta = 0, .r = 1, .theta_rate = 1};
  for (int i = 0; i < 50'000; ++i) step(model, -0.3, s);
  EXPECT_NEAR(s.r * s.r * s.theta_rate, 1, 1e-4);
}

TEST(Pendulum, MakesTheAuthorsTraceAgainWithItsSign) {
  // Times, θ₁, θ̇₁, r₁ of a plan that was published with the source of [Ha2015]. Its last row is
  // between two steps.
  const double rows[][4] = {{.025, .12509, .16757, .17885},
                            {.05, .13142, .33978, .17770},
                            {.075, .14217, .52249, .17655},
                            {.1, .15768, .72198, .17540},
                            {.125, .17846, .94508, .17425}};
  const auto at = [](double time, bool reversed) {
    const PendulumModel model{
        .mass = 1.6, .inertia = 0.0129, .step = 0.0005, .reversed_coriolis = reversed};
    PendulumState s{.theta = 0.123, .r = 0.18};
    for (int k = static_cast<int>(std::lround(time / model.step)); k > 0; --k) {
      step(model, -0.046023, s);
    }
    return s;
  };
  for (const auto& row : rows) {
    const PendulumState s = at(row[0], true);
    EXPECT_NEAR(s.theta_rate, row[2], 1e-4);
    EXPECT_NEAR(s.r, row[3], 1e-5);
    // The trace's angles are those of half a step before.
    EXPECT_NEAR(s.theta - 0.00025 * s.theta_rate, row[1], 1e-5);
  }
  EXPECT_NEAR((at(0.1435, true).theta_rate + at(0.144, true).theta_rate) / 2, 1.1324, 2e-4);
  EXPECT_GT(std::abs(at(0.144, false).theta_rate - 1.1324), 0.05);
}

TEST(Pendulum, AVerticalStopperTakesAllVerticalMomentum) {
  const PendulumModel model = atlas();
  PendulumState s{.theta = 0.4, .r = 1, .theta_rate = 2, .r_rate = -0.3};
  const auto hit = impact(model, s, std::numbers::pi - s.theta);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->impulse, -model.mass * s.comVelocity().y(), 1e-9);
  EXPECT_NEAR(hit->length, s.com().y(), 1e-12);
  EXPECT_NEAR(hit->advance, s.com().x(), 1e-12);
}

TEST(Pendulum, TheTipStopsVerticallyWhereverItHits) {
  const PendulumModel model = atlas();
  const PendulumState s{.theta = 0.3, .r = 0.9, .theta_rate = 2.5, .r_rate = 0.1};
  for (double theta2 = 2; theta2 < 3.2; theta2 += 0.1) {
    const auto hit = impact(model, s, theta2);
    if (!hit) continue;
    const double d = hit->advance - s.com().x();
    const double omega = s.theta_rate - d * hit->impulse / model.inertia;
    const double vertical = s.comVelocity().y() + hit->impulse / model.mass;
    EXPECT_NEAR(vertical - d * omega, 0, 1e-12);
    // Reading A: about the tip, the COM moves as the impulse left it.
    EXPECT_NEAR(hit->after.comVelocity().x(), s.comVelocity().x(), 1e-12);
    EXPECT_NEAR(hit->after.comVelocity().y(), vertical, 1e-12);
    EXPECT_NEAR(hit->after.com().y(), s.com().y(), 1e-12);
  }
}

TEST(Pendulum, ReadingsDifferAsTheirMomentaSay) {
  PendulumModel model = atlas();
  const PendulumState s{.theta = 0.3, .r = 0.9, .theta_rate = 2.5};
  const double theta2 = 2.6;
  const auto a = impact(model, s, theta2);
  model.post_impact = PostImpact::kBodyRate;
  const auto b = impact(model, s, theta2);
  model.post_impact = PostImpact::kSticking;
  const auto c = impact(model, s, theta2);
  ASSERT_TRUE(a && b && c);
  const double d = a->advance - s.com().x();
  EXPECT_DOUBLE_EQ(b->after.theta_rate, s.theta_rate - d * a->impulse / model.inertia);
  // A vertical impulse at the tip changes no angular momentum about it: C is the mean of A and B,
  // weighted by their inertias.
  const double mr2 = model.mass * a->length * a->length;
  EXPECT_NEAR(
      c->after.theta_rate,
      (mr2 * a->after.theta_rate + model.inertia * b->after.theta_rate) / (mr2 + model.inertia),
      1e-12);
}

TEST(Pendulum, AStopperIsNoLongerThanAHundredRods) {
  const PendulumState upright{.theta = 0, .r = 0.7};
  const double down = std::numbers::pi / 2;
  // -cos θ₂ is its part that leads down.
  for (const auto& [longer, there] : {std::pair(99.9, true), std::pair(100.1, false)}) {
    const double theta2 = down + std::asin(1 / longer);
    const auto length = stopperLength(upright, theta2);
    EXPECT_EQ(length.has_value(), there);
    if (there) {
      EXPECT_NEAR(*length, longer * 0.7, 1e-9);
    }
    EXPECT_EQ(impact(atlas(), {.theta = 0, .r = 0.7, .theta_rate = 1}, theta2).has_value(), there);
  }
  EXPECT_FALSE(stopperLength({.theta = 0, .r = 0}, 3));
  EXPECT_FALSE(stopperLength({.theta = 1.6, .r = 1}, 3));  // below the ground
  EXPECT_FALSE(stopperLength({.theta = 1.6, .r = 1}, 0));
  // What does not move makes no impact.
  EXPECT_FALSE(impact(atlas(), {.theta = 0, .r = 0.7}, 2.8));
}

TEST(Pendulum, ItsComMovesAsItsVelocitySays) {
  const PendulumModel model{.mass = 1, .inertia = 1, .gravity = 0, .step = 1e-6};
  PendulumState s{.theta = 0.4, .r = 0.8, .theta_rate = 1.3, .r_rate = 9};
  step(model, -0.6, s);
  EXPECT_EQ(s.r_rate, -0.6);  // at once
  const Vector2d before = s.com();
  const Vector2d velocity = s.comVelocity();
  step(model, -0.6, s);
  EXPECT_LT(((s.com() - before) / model.step - velocity).norm(), 1e-5);
  const PendulumState back = PendulumState::of(s.com(), s.comVelocity());
  EXPECT_NEAR(back.theta, s.theta, 1e-12);
  EXPECT_NEAR(back.r, s.r, 1e-12);
  EXPECT_NEAR(back.theta_rate, s.theta_rate, 1e-12);
  EXPECT_NEAR(back.r_rate, s.r_rate, 1e-12);
}

TEST(Pendulum, AStopperThatPointsUpOrLeavesTheGroundDoesNothing) {
  const PendulumModel model = atlas();
  const PendulumState s{.theta = 0.3, .r = 0.9, .theta_rate = 2.5};
  EXPECT_FALSE(stopperLength(s, 0.5));
  EXPECT_FALSE(impact(model, s, 0.5));
  const PendulumState rising{.theta = -0.3, .r = 0.9, .theta_rate = 2.5};
  EXPECT_FALSE(impact(model, rising, std::numbers::pi + 0.3));
}

}  // namespace
}  // namespace traceur::fall
