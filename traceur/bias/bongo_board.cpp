#include "traceur/bias/bongo_board.h"

#include <cmath>
#include <numbers>

namespace traceur::bias {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

}  // namespace

BongoBoard::BongoBoard(const BongoParameters& p, double time_step) : p_(p), time_step_(time_step) {
  const double scale = p.inertia_scale;
  const double r = p.wheel_radius;
  const auto rod = [&](double mass, double length) {
    return mass / 12 * (length * length + p.thickness * p.thickness);
  };
  const double wheel_mass = scale * std::numbers::pi * r * r * p.wheel_density;
  const double m1 = scale * p.leg_mass;
  const double m2 = scale * p.pelvis_mass;
  const double l1 = p.leg_length;
  const double l2 = p.pelvis_length;
  mass_ = scale * p.board_mass + 2 * m1 + 2 * m2;  // all that the wheel carries
  k_ = mass_ * r * r;
  S_ = (m1 + 2 * m2) * l1;
  s_ = S_ * r;
  Jw_ = 1.5 * wheel_mass * r * r;  // about the ground
  Jf_ = rod(scale * p.board_mass, p.board_length) + 2 * rod(m2, l2) + 2 * m1 * l2 * l2;
  Jp_ = 2 * rod(m1, l1) + m1 * l1 * l1 / 2 + 2 * m2 * l1 * l1;
}

BongoBoard::Inertia BongoBoard::inertia(double ab, double sf, double cf, double cp, double st,
                                        double ct) const {
  return {.a11 = Jw_ + 2 * k_ * (1 + cf),
          .a12 = k_ * ab * sf,
          .a13 = s_ * (cp + ct),
          .a22 = Jf_ + k_ * ab * ab,
          .a23 = -s_ * ab * st,
          .a33 = Jp_};
}

Vector3d BongoBoard::acceleration(const State& x, double torque, double board_moment) const {
  const double ab = x[1];
  const double th = x[2];
  const double f = x[0] + ab;
  const double p = f + th;
  const double va = x[3];
  const double vf = va + x[4];
  const double vp = vf + x[5];
  const double sf = std::sin(f), cf = std::cos(f);
  const double sp = std::sin(p), cp = std::cos(p);
  const double st = std::sin(th), ct = std::cos(th);
  const double g = p_.gravity;

  const auto [a11, a12, a13, a22, a23, a33] = inertia(ab, sf, cf, cp, st, ct);
  const double h1 =
      k_ * (sf * vf * vf - 2 * sf * va * vf + ab * (1 + cf) * vf * vf) - s_ * (sp + st) * vp * vp;
  const double h2 = k_ * ab * (vf * vf - 2 * va * vf) - s_ * ab * ct * vp * vp;
  const double h3 = s_ * (2 * st * va * vf + (ab * ct - st) * vf * vf);
  const double weight = g * k_ / p_.wheel_radius;  // m g r
  const double b1 = weight * sf - h1;
  const double b2 = board_moment - torque - h2 - weight * ab * cf;
  const double b3 = torque - h3 + g * S_ * sp;

  // Cramer's rule: A is symmetric, small and far from singular.
  const double c11 = a22 * a33 - a23 * a23;
  const double c12 = a13 * a23 - a12 * a33;
  const double c13 = a12 * a23 - a13 * a22;
  const double c22 = a11 * a33 - a13 * a13;
  const double c23 = a12 * a13 - a11 * a23;
  const double c33 = a11 * a22 - a12 * a12;
  const double inverse = 1 / (a11 * c11 + a12 * c12 + a13 * c13);
  const double wa = inverse * (c11 * b1 + c12 * b2 + c13 * b3);
  const double wf = inverse * (c12 * b1 + c22 * b2 + c23 * b3);
  const double wp = inverse * (c13 * b1 + c23 * b2 + c33 * b3);
  return {wa, wf - wa, wp - wf};
}

BongoBoard::State BongoBoard::stepped(const State& x, double torque, double board_moment) const {
  const double h = time_step_;
  const auto rate = [&](const State& at) {
    State d;
    d << at.tail<3>(), acceleration(at, torque, board_moment);
    return d;
  };
  const State k1 = rate(x);
  const State k2 = rate(x + h / 2 * k1);
  const State k3 = rate(x + h / 2 * k2);
  const State k4 = rate(x + h * k3);
  return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
}

double BongoBoard::energy(const State& x) const {
  const double ab = x[1];
  const double f = x[0] + ab;
  const double p = f + x[2];
  const Vector3d v(x[3], x[3] + x[4], x[3] + x[4] + x[5]);
  const auto [a11, a12, a13, a22, a23, a33] =
      inertia(ab, std::sin(f), std::cos(f), std::cos(p), std::sin(x[2]), std::cos(x[2]));
  const double kinetic = 0.5 * (a11 * v[0] * v[0] + a22 * v[1] * v[1] + a33 * v[2] * v[2]) +
                         a12 * v[0] * v[1] + a13 * v[0] * v[2] + a23 * v[1] * v[2];
  const double height = p_.wheel_radius * (std::cos(f) + ab * std::sin(f) - 1);
  return kinetic + p_.gravity * (mass_ * height + S_ * (std::cos(p) - 1));
}

BongoPose poseOf(const BongoParameters& q, const BongoBoard::State& x) {
  const double r = q.wheel_radius;
  const double f = x[0] + x[1];
  const double p = f + x[2];
  const Vector2d along(std::cos(f), std::sin(f));
  BongoPose pose;
  pose.wheel = {-r * x[0], r};
  pose.board = pose.wheel + r * Vector2d(-std::sin(f), std::cos(f)) + r * x[1] * along;
  const Vector2d leg = q.leg_length * Vector2d(-std::sin(p), std::cos(p));
  pose.left_foot = pose.board - q.pelvis_length * along;
  pose.right_foot = pose.board + q.pelvis_length * along;
  pose.left_hip = pose.left_foot + leg;
  pose.right_hip = pose.right_foot + leg;
  pose.pelvis = pose.board + leg;
  return pose;
}

double boardHeight(const BongoParameters& q, const BongoBoard::State& x) {
  const double f = x[0] + x[1];
  const double middle =
      q.wheel_radius + q.wheel_radius * std::cos(f) + q.wheel_radius * x[1] * std::sin(f);
  return middle - q.board_length / 2 * std::abs(std::sin(f));
}

double pelvisVelocity(const BongoParameters& q, const BongoBoard::State& x) {
  const double r = q.wheel_radius;
  const double f = x[0] + x[1];
  const double p = f + x[2];
  const double vf = x[3] + x[4];
  return -r * x[3] - r * std::cos(f) * vf + r * x[4] * std::cos(f) - r * x[1] * std::sin(f) * vf -
         q.leg_length * std::cos(p) * (vf + x[5]);
}

}  // namespace traceur::bias
