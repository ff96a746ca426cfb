#include "traceur/fall/pendulum.h"

#include <cmath>

namespace traceur::fall {

Vector2d PendulumState::com() const {
  return {r * std::sin(theta), r * std::cos(theta)};
}

Vector2d PendulumState::comVelocity() const {
  const double s = std::sin(theta);
  const double c = std::cos(theta);
  return {r_rate * s + r * theta_rate * c, r_rate * c - r * theta_rate * s};
}

PendulumState PendulumState::of(const Vector2d& com, const Vector2d& velocity) {
  const double r = com.norm();
  return {.theta = std::atan2(com.x(), com.y()),
          .r = r,
          .theta_rate = (com.y() * velocity.x() - com.x() * velocity.y()) / (r * r),
          .r_rate = com.dot(velocity) / r};
}

void step(const PendulumModel& model, double rod_rate, PendulumState& s) {
  const double coriolis = (model.reversed_coriolis ? 2 : -2) * rod_rate * s.theta_rate;
  s.r_rate = rod_rate;
  s.theta_rate += model.step * (model.gravity * std::sin(s.theta) + coriolis) / s.r;
  s.theta += model.step * s.theta_rate;
  s.r += model.step * rod_rate;
}

std::optional<double> stopperLength(const PendulumState& s, double theta2) {
  static constexpr double kLongest = 100;
  const double down = -std::cos(s.theta + theta2);
  const double height = s.r * std::cos(s.theta);
  if (!(down > 0) || !(height > 0) || height > kLongest * s.r * down) return std::nullopt;
  return height / down;
}

std::optional<Impact> impact(const PendulumModel& model, const PendulumState& s, double theta2) {
  const std::optional<double> r2 = stopperLength(s, theta2);
  if (!r2) return std::nullopt;
  const double d = *r2 * std::sin(s.theta + theta2);
  const Vector2d p = s.com();
  const Vector2d v = s.comVelocity();
  const double tip = v.y() - d * s.theta_rate;
  if (!(tip < 0)) return std::nullopt;
  const double j = -tip / (1 / model.mass + d * d / model.inertia);
  const double after_y = v.y() + j / model.mass;
  const double omega = s.theta_rate - d * j / model.inertia;
  Impact hit{j, *r2, p.x() + d, {}};
  const Vector2d com(-d, p.y());  // from the tip
  hit.after = PendulumState::of(com, {v.x(), after_y});
  switch (model.post_impact) {
    case PostImpact::kComVelocity:
      break;
    case PostImpact::kBodyRate:
      hit.after.theta_rate = omega;
      break;
    case PostImpact::kSticking: {
      const double I = model.inertia;
      const double mr2 = model.mass * com.squaredNorm();
      hit.after.theta_rate =
          (model.mass * (com.y() * v.x() - com.x() * v.y()) + I * s.theta_rate) / (mr2 + I);
      break;
    }
  }
  return hit;
}

}  // namespace traceur::fall
