#include "traceur/optim/bound_fold.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace traceur::optim {

int unitExponent(double lower, double upper) {
  static constexpr int kWidest = 333;
  static constexpr int kFar = 52;    // of 2^52 the next number is 1 away
  static constexpr int kShare = 40;  // far from rounding, and from the bound itself
  if (std::isfinite(lower) && std::isfinite(upper)) {
    const double width = upper - lower;
    const int k = std::isfinite(width) ? std::ilogb(width) : std::ilogb(upper / 2 - lower / 2) + 1;
    return std::abs(k) <= kWidest ? 0 : k;
  }
  const double bound = std::isfinite(lower) ? lower : upper;
  if (!std::isfinite(bound) || bound == 0) return 0;
  const int k = std::ilogb(bound);
  return k <= kFar ? 0 : k - kShare;
}

BoundFold::BoundFold(const VectorXd& lower, const VectorXd& upper, const VectorXd& step)
    : lower_(lower),
      upper_(upper),
      low_(lower),
      high_(upper),
      margin_(step),
      exponents_(static_cast<size_t>(lower.size())) {
  for (int i = 0; i < lower.size(); ++i) {
    any_ = any_ || std::isfinite(lower[i]) || std::isfinite(upper[i]);
    exponents_[i] = unitExponent(lower[i], upper[i]);
    for (VectorXd* v : {&low_, &high_, &margin_}) (*v)[i] = std::ldexp((*v)[i], -exponents_[i]);
    const double width = high_[i] - low_[i];
    if (std::isfinite(width)) margin_[i] = kMargin * width;
  }
}

double BoundFold::width(int i) const {
  return any_ ? std::ldexp(high_[i] - low_[i], exponents_[i]) : kInfinity;
}

double BoundFold::margin(int i) const {
  return std::ldexp(margin_[i], exponents_[i]);
}

double BoundFold::fold(int i, double y) const {
  if (!std::isfinite(y)) return nearestNumber(i, y);
  if (!any_) return y;
  const int k = exponents_[i];
  if (k == 0) return foldInside(i, y);
  return nearestNumber(i, std::ldexp(foldInside(i, std::ldexp(y, -k)), k));
}

double BoundFold::nearestNumber(int i, double x) const {
  static constexpr double kMax = std::numeric_limits<double>::max();
  const double l = any_ ? std::max(lower_[i], -kMax) : -kMax;
  const double u = any_ ? std::min(upper_[i], kMax) : kMax;
  return std::clamp(std::isnan(x) ? 0 : x, l, u);
}

double BoundFold::foldInside(int i, double y) const {
  const double l = low_[i];
  const double u = high_[i];
  const double a = margin_[i];
  if (l + a <= y && y <= u - a) return y;

  // Bring y into [l - a, u + a], the stretch that maps once onto [l, u].
  const double period = 2 * (u - l + 2 * a);
  if (std::isfinite(period)) {
    y -= period * std::floor((y - (l - a)) / period);
    if (y > u + a) y = 2 * (u + a) - y;
  } else if (y < l - a) {
    y = 2 * (l - a) - y;
  } else if (y > u + a) {
    y = 2 * (u + a) - y;
  }
  const double below = y - (l - a);
  const double above = (u + a) - y;
  double x = y;
  if (below < 2 * a) {
    x = l + below * below / (4 * a);
  } else if (above < 2 * a) {
    x = u - above * above / (4 * a);
  }
  return std::clamp(x, l, u);
}

double BoundFold::unfold(int i, double x) const {
  if (!any_) return x;
  const int k = exponents_[i];
  return k == 0 ? unfoldInside(i, x) : outward(i, unfoldInside(i, std::ldexp(x, -k)));
}

double BoundFold::unfoldNear(int i, double x, double to) const {
  if (!any_) return x;
  const int k = exponents_[i];
  if (k == 0) return unfoldNearInside(i, x, to);
  return outward(i, unfoldNearInside(i, std::ldexp(x, -k), std::ldexp(to, -k)));
}

/// Of what lies beyond the numbers, the last of them.
double BoundFold::outward(int i, double y) const {
  static constexpr double kMax = std::numeric_limits<double>::max();
  return std::clamp(std::ldexp(y, exponents_[i]), -kMax, kMax);
}

double BoundFold::unfoldInside(int i, double x) const {
  const double a = margin_[i];
  if (x < low_[i] + a) return low_[i] - a + 2 * std::sqrt(a * (x - low_[i]));
  if (x > high_[i] - a) return high_[i] + a - 2 * std::sqrt(a * (high_[i] - x));
  return x;
}

double BoundFold::unfoldNearInside(int i, double x, double to) const {
  const double y = unfoldInside(i, x);
  const double low = low_[i] - margin_[i];
  const double high = high_[i] + margin_[i];
  const double period = 2 * (high - low);
  double nearest = y;
  for (const double image : {y, 2 * low - y, 2 * high - y}) {
    if (!std::isfinite(image)) continue;
    const double turns = std::isfinite(period) ? std::round((to - image) / period) : 0;
    const double there = turns == 0 ? image : image + turns * period;
    if (std::abs(there - to) < std::abs(nearest - to)) nearest = there;
  }
  return nearest;
}

}  // namespace traceur::optim
