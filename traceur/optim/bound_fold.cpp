#include "traceur/optim/bound_fold.h"

#include <algorithm>
#include <cmath>

namespace traceur::optim {

BoundFold::BoundFold(const VectorXd& lower, const VectorXd& upper, const VectorXd& step)
    : lower_(lower), upper_(upper), margin_(step) {
  for (int i = 0; i < lower.size(); ++i) {
    any_ = any_ || std::isfinite(lower[i]) || std::isfinite(upper[i]);
    const double width = upper[i] - lower[i];
    if (std::isfinite(width)) margin_[i] = kMargin * width;
  }
}

double BoundFold::fold(int i, double y) const {
  if (!any_) return y;
  const double l = lower_[i];
  const double u = upper_[i];
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
  const double a = margin_[i];
  if (x < lower_[i] + a) return lower_[i] - a + 2 * std::sqrt(a * (x - lower_[i]));
  if (x > upper_[i] - a) return upper_[i] + a - 2 * std::sqrt(a * (upper_[i] - x));
  return x;
}

double BoundFold::unfoldNear(int i, double x, double to) const {
  const double y = unfold(i, x);
  if (!any_) return y;
  const double low = lower_[i] - margin_[i];
  const double high = upper_[i] + margin_[i];
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
