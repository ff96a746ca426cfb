// How a search that knows no bounds hands out only points inside a box.
#pragma once

#include <vector>

#include "traceur/optim/problem.h"

namespace traceur::optim {

/// The exponent k of the unit 2^k in which a variable is folded, and searched (inSafeUnits): 0,
/// which is its own, unless
///
///     its box is wider than 2^333 or narrower than 2^-333 (about 1e±100): that of its width;
///     or it has one bound, so large that the next number is more than 1 away: 2^-40 of that.
///
/// All that is computed, to fourth powers of the width, then stays among the numbers; and to
/// multiply by a power of two changes no digit.
int unitExponent(double lower, double upper);

/// Folds the real line into [l, u], variable by variable: the identity where it matters, a parabola
/// in a margin a beside each bound, mirrored beyond. With t the distance from l - a:
///
///     fold(y) = l + t²/(4a)   for 0 ≤ t < 2a;   y   for l + a ≤ y ≤ u - a;
///     even about y = l - a, likewise at u, hence periodic between two bounds
///
/// The function the search sees, f(fold(y)), is continuously differentiable. A minimum on a bound,
/// where f is a slope, becomes a smooth valley, which a plain mirror would leave a kink and
/// clipping a plateau. Every y counts; none is rejected, and the search needs no penalty.
class BoundFold {
 public:
  /// The margin of a variable with two bounds, as a fraction of the distance between them
  /// [ours; a tenth of the box is bent in all].
  static constexpr double kMargin = 0.05;

  /// No variable has bounds.
  BoundFold() = default;
  /// @param lower, upper  (n), lower < upper; infinite where there is none
  /// @param step          (n) > 0, margin of the variables with one bound: the size of a first step
  BoundFold(const VectorXd& lower, const VectorXd& upper, const VectorXd& step);

  /// @return value inside [l, u] of variable i; y itself, to the bit, away from the bounds. Finite,
  ///         even where a search has run off the numbers and y is not
  double fold(int i, double y) const;
  /// The y nearest to the box's inside with fold(i, y) = x, for l ≤ x ≤ u.
  double unfold(int i, double x) const;

  /// Of all y with fold(i, y) = x, the one nearest to `to`: a search may have gone through mirrors.
  double unfoldNear(int i, double x, double to) const;

  /// Whether any variable is bounded: otherwise fold() is the identity.
  bool any() const { return any_; }
  /// u - l; infinite without two bounds.
  double width(int i) const;
  /// a, how far outside a bound the mirror stands. Of bounded variables.
  double margin(int i) const;

 private:
  // In units of 2^exponent, where squares of widths are numbers.
  double foldInside(int i, double y) const;
  double unfoldInside(int i, double x) const;
  double unfoldNearInside(int i, double x, double to) const;
  double outward(int i, double y) const;
  double nearestNumber(int i, double x) const;

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  bool any_ = false;
  VectorXd lower_, upper_;
  VectorXd low_, high_, margin_;  // in units of 2^exponent
  std::vector<int> exponents_;
};

}  // namespace traceur::optim
