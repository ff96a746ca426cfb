#include "traceur/landing/condition.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"

namespace traceur::landing {
namespace {

/// min over planes of Σ ρ(θ - plane), ρ(r) = share · r above, (1 - share) · -r below: by weighted
/// least squares whose weights are ρ(r) / r², again and again.
Plane quantile(const Eigen::MatrixX4d& X, const VectorXd& theta, double share) {
  static constexpr int kRounds = 100;
  static constexpr double kSmall = 1e-4;  // [rad]
  Eigen::Vector4d x = X.colPivHouseholderQr().solve(theta);
  for (int k = 0; k < kRounds; ++k) {
    const VectorXd r = theta - X * x;
    VectorXd root(r.size());
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      root[i] = std::sqrt((r[i] > 0 ? share : 1 - share) / std::max(std::abs(r[i]), kSmall));
    }
    x = (root.asDiagonal() * X).colPivHouseholderQr().solve(root.cwiseProduct(theta));
  }
  return {x[0], x[1], x[2], x[3]};
}

}  // namespace

Plane LandingCondition::wanted() const {
  return {(least.up + most.up) / 2, (least.forward + most.forward) / 2,
          (least.spin + most.spin) / 2, (least.constant + most.constant) / 2};
}

LandingCondition learnCondition(std::span<const Fall> falls) {
  std::vector<const Verdict*> good;
  for (const Fall& f : falls) {
    if (f.verdict.touch_down && f.verdict.stands()) good.push_back(&f.verdict);
  }
  if (static_cast<int>(good.size()) < kLeast) {
    throw InputError(
        fmt::format("landing condition: {} of {} falls stand: expected {} to learn it from",
                    good.size(), falls.size(), kLeast));
  }
  Eigen::MatrixX4d X(good.size(), 4);
  VectorXd theta(good.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const Verdict& v = *good[static_cast<size_t>(i)];
    X.row(i) << -v.touch_down_speed, v.touch_down_forward, v.touch_down_spin, 1;
    theta[i] = v.touch_down_somersault;
  }
  return {quantile(X, theta, kOutside), quantile(X, theta, 1 - kOutside)};
}

std::vector<VectorXd> drawTouchDowns(const skill::Skill& skill, int count, std::uint64_t seed,
                                     bool hands) {
  const double first = hands ? 1 : 0;
  // So low that it has time for the landing's pose and for nothing else.
  const FallSet set{"touch-downs",
                    "",
                    {{"height", 1.8, 1.8},
                     {"up", -9, -3},
                     {"forward", -0.5, 6},
                     {"pitch_rate", -1, 4},
                     {"miss", -0.9, 0.9},
                     {"hands", first, first}}};
  return drawFalls(skill, set, count, seed);
}

}  // namespace traceur::landing
