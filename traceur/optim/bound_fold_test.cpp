#include "traceur/optim/bound_fold.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/random.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

BoundFold foldOf(double lower, double upper, double step = 1) {
  return {VectorXd::Constant(1, lower), VectorXd::Constant(1, upper), VectorXd::Constant(1, step)};
}

TEST(BoundFold, IsTheIdentityWithoutBounds) {
  for (const double y : {-1e300, -1.0, 0.0, 3.5}) {
    EXPECT_EQ(BoundFold().fold(0, y), y);
    EXPECT_EQ(foldOf(-kInf, kInf).fold(0, y), y);
  }
}

TEST(BoundFold, KeepsEveryBitAwayFromTheBounds) {
  const BoundFold fold = foldOf(-1e10, 2e10);
  for (const double y : {0.1, -3e8, 1e-300}) {
    EXPECT_EQ(fold.fold(0, y), y);
    EXPECT_EQ(fold.unfold(0, y), y);
  }
}

TEST(BoundFold, NeverLeavesTheBox) {
  Random random(3);
  for (const auto& [l, u] : {std::pair(-2.0, 3.0), std::pair(0.0, kInf), std::pair(-kInf, -7.0),
                             std::pair(-1e308, 1e308), std::pair(5.0, 5.0 + 1e-12)}) {
    const BoundFold fold = foldOf(l, u, 0.3);
    for (int i = 0; i < 2000; ++i) {
      const double y = random.normal() * std::pow(10, random.uniform(-15, 300));
      const double x = fold.fold(0, y);
      ASSERT_TRUE(l <= x && x <= u) << "fold(" << y << ") = " << x;
    }
  }
}

TEST(BoundFold, FoldsBoxesWhoseSquaresOverflow) {
  for (const auto& [l, u] : {std::pair(-1.6e308, 1.6e308), std::pair(-1e300, 1e300),
                             std::pair(0.0, 1e200), std::pair(-1e-310, 1e-310)}) {
    const BoundFold fold = foldOf(l, u);
    const double half = u / 2 - l / 2;
    for (const double share : {0.0, 0.01, 0.3, 0.9, 1.0}) {
      const double x = std::clamp(l + share * half, l, u);
      const double back = fold.fold(0, fold.unfold(0, x));
      EXPECT_NEAR(back / half, x / half, 1e-13) << l << " " << share;
      EXPECT_NEAR(fold.fold(0, fold.unfoldNear(0, x, 0)) / half, x / half, 1e-13);
    }
    // As the same box of unit size, to the bit where no number is denormal.
    if (u < 1e-300 || u > 1e308) continue;
    const double unit = std::ldexp(1.0, unitExponent(l, u));
    const BoundFold plain = foldOf(l / unit, u / unit);
    for (const double y : {-0.6, -0.01, 0.02, 0.4, 1.3}) {
      EXPECT_EQ(fold.fold(0, y * unit), plain.fold(0, y) * unit) << l << " " << y;
    }
  }
}

TEST(BoundFold, OfWhatIsNoNumberMakesOneInsideTheBox) {
  for (const double y : {kInf, -kInf, static_cast<double>(NAN)}) {
    EXPECT_TRUE(std::isfinite(BoundFold().fold(0, y)));
    EXPECT_TRUE(std::isfinite(foldOf(-kInf, kInf).fold(0, y)));
    const double x = foldOf(2, 3).fold(0, y);
    EXPECT_TRUE(2 <= x && x <= 3) << y;
    EXPECT_GE(foldOf(2, kInf).fold(0, y), 2);
  }
}

TEST(UnitExponent, IsZeroForAllOrdinaryBoxes) {
  for (const auto& [l, u] : {std::pair(-1e100, 0.0), std::pair(0.0, 1e-100), std::pair(1.0, kInf),
                             std::pair(-kInf, 1e15), std::pair(-kInf, kInf), std::pair(1.0, 1.001),
                             std::pair(0.0, kInf)}) {
    EXPECT_EQ(unitExponent(l, u), 0) << l << " " << u;
  }
  EXPECT_EQ(unitExponent(-1e300, 1e300), std::ilogb(2e300));
  EXPECT_EQ(unitExponent(-1.7e308, 1.7e308), 1024);
  EXPECT_EQ(unitExponent(0, 5e-324), -1074);
  EXPECT_EQ(unitExponent(1e308, kInf), std::ilogb(1e308) - 40);
}

TEST(BoundFold, UnfoldInvertsFoldUpToTheBoundsThemselves) {
  for (const auto& [l, u] : {std::pair(-2.0, 3.0), std::pair(-2.0, kInf), std::pair(-kInf, 3.0)}) {
    const BoundFold fold = foldOf(l, u, 0.3);
    for (const double x : {-2.0, -1.99, -1.5, 0.0, 2.9, 2.999999, 3.0}) {
      EXPECT_NEAR(fold.fold(0, fold.unfold(0, x)), x, 1e-15 * 3);
      EXPECT_LE(std::abs(fold.unfold(0, x) - x), 0.3 + 1e-12);  // not behind a mirror
    }
  }
}

TEST(BoundFold, UnfoldsNearWhereTheSearchIs) {
  Random random(4);
  for (const auto& [l, u] : {std::pair(-2.0, 3.0), std::pair(-2.0, kInf), std::pair(-kInf, 3.0)}) {
    const BoundFold fold = foldOf(l, u, 0.3);
    for (int k = 0; k < 500; ++k) {
      const double to = random.uniform(-20, 20);
      const double x = fold.fold(0, to);
      // Where the fold is not level, the place itself.
      EXPECT_NEAR(fold.fold(0, fold.unfoldNear(0, x, to)), x, 1e-14);
      EXPECT_NEAR(fold.unfoldNear(0, x, to), to, 1e-6);
      const double other = random.uniform(-2, 3);
      const double y = fold.unfoldNear(0, other, to);
      EXPECT_NEAR(fold.fold(0, y), other, 1e-14);
      EXPECT_LE(std::abs(y - to), std::abs(fold.unfold(0, other) - to));
    }
    EXPECT_EQ(fold.unfoldNear(0, 0.3, 0.4), 0.3);
  }
  EXPECT_EQ(BoundFold().unfoldNear(0, 0.3, 9), 0.3);
}

TEST(BoundFold, HasNoKinkAnywhere) {
  const BoundFold fold = foldOf(-2, 3);
  const double h = 1e-5;
  for (double y = -9; y < 9; y += 0.01) {
    const double left = (fold.fold(0, y) - fold.fold(0, y - h)) / h;
    const double right = (fold.fold(0, y + h) - fold.fold(0, y)) / h;
    EXPECT_NEAR(left, right, 2e-4) << y;  // the steepest bend is 1/(2a) = 2 per unit
  }
}

TEST(BoundFold, MirrorsAtTheOuterEdgeOfTheMargin) {
  const BoundFold fold = foldOf(0, 10);
  const double a = BoundFold::kMargin * 10;
  EXPECT_EQ(fold.fold(0, -a), 0);
  EXPECT_EQ(fold.fold(0, 10 + a), 10);
  for (const double t : {0.1, 0.7, 2.0, 5.0}) {
    EXPECT_NEAR(fold.fold(0, -a - t), fold.fold(0, -a + t), 1e-14);
    EXPECT_NEAR(fold.fold(0, 10 + a + t), fold.fold(0, 10 + a - t), 1e-14);
    EXPECT_NEAR(fold.fold(0, t + 2 * (10 + 2 * a)), fold.fold(0, t), 1e-14);  // period
  }
}

TEST(BoundFold, OfSeveralVariablesIsThatOfEach) {
  const VectorXd lower{{-2, -kInf, 0, -1e300, -kInf}};
  const VectorXd upper{{3, 7, kInf, 1e300, kInf}};
  const VectorXd step{{0.1, 0.2, 0.3, 0.4, 0.5}};
  const BoundFold all(lower, upper, step);
  EXPECT_TRUE(all.any());
  EXPECT_FALSE(BoundFold().any());
  EXPECT_EQ(BoundFold().width(0), kInf);
  EXPECT_EQ(all.width(0), 5);
  EXPECT_EQ(all.width(1), kInf);
  EXPECT_EQ(all.width(3), 2e300);
  EXPECT_EQ(all.margin(0), 0.25);
  EXPECT_EQ(all.margin(1), 0.2);
  EXPECT_DOUBLE_EQ(all.margin(3), 1e299);
  for (int i = 0; i < 4; ++i) {
    const BoundFold one = foldOf(lower[i], upper[i], step[i]);
    for (const double y : {-9.0, -2.0, 0.1, 2.95, 6.9, 11.0, 1.1e300}) {
      EXPECT_EQ(all.fold(i, y), one.fold(0, y)) << i << " " << y;
      const double x = one.fold(0, y);
      EXPECT_EQ(all.unfold(i, x), one.unfold(0, x)) << i << " " << y;
      EXPECT_EQ(all.unfoldNear(i, x, y), one.unfoldNear(0, x, y)) << i << " " << y;
    }
  }
  for (const double y : {-1e300, 0.0, 5.0}) {
    EXPECT_EQ(all.fold(4, y), y);
    EXPECT_EQ(all.unfold(4, y), y);
    EXPECT_EQ(all.unfoldNear(4, y, 7), y);
  }
}

TEST(BoundFold, OfWhatIsNoNumberMakesTheNearest) {
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ(foldOf(-1, 3).fold(0, NAN), 0);
  EXPECT_EQ(foldOf(2, 3).fold(0, NAN), 2);
  EXPECT_EQ(foldOf(-1, 3).fold(0, kInf), 3);
  EXPECT_EQ(foldOf(-1, 3).fold(0, -kInf), -1);
  EXPECT_EQ(foldOf(-1, kInf).fold(0, kInf), most);
  EXPECT_EQ(foldOf(-kInf, 3).fold(0, -kInf), -most);
  EXPECT_EQ(BoundFold().fold(0, kInf), most);
  EXPECT_EQ(BoundFold().fold(0, -kInf), -most);
  // The unfolded upper bound of a box as wide as numbers are lies beyond them.
  EXPECT_EQ(foldOf(-most, most).unfold(0, most), most);
  EXPECT_EQ(foldOf(-most, most).unfoldNear(0, -most, -most), -most);
}

TEST(BoundFold, OfOneBoundMirrorsAtItsStep) {
  for (const double step : {0.3, 2.0}) {
    for (const double t : {0.1, 0.7, 5.0}) {
      EXPECT_NEAR(foldOf(1, kInf, step).fold(0, 1 - step - t),
                  foldOf(1, kInf, step).fold(0, 1 - step + t), 1e-14);
      EXPECT_NEAR(foldOf(-kInf, 1, step).fold(0, 1 + step + t),
                  foldOf(-kInf, 1, step).fold(0, 1 + step - t), 1e-14);
    }
    EXPECT_EQ(foldOf(1, kInf, step).fold(0, 1 - step), 1);
    EXPECT_DOUBLE_EQ(foldOf(1, kInf, step).fold(0, 1), 1 + step / 4);  // (y - l + a)² / 4a
    EXPECT_EQ(foldOf(1, kInf, step).fold(0, 1 + step), 1 + step);
  }
}

TEST(UnitExponent, BeginsWhereSquaresMightBeNone) {
  const auto power = [](int k) { return std::ldexp(1.0, k); };
  EXPECT_EQ(unitExponent(0, power(333)), 0);
  EXPECT_EQ(unitExponent(0, power(334)), 334);
  EXPECT_EQ(unitExponent(0, power(-333)), 0);
  EXPECT_EQ(unitExponent(0, power(-334)), -334);
  EXPECT_EQ(unitExponent(power(52), kInf), 0);
  EXPECT_EQ(unitExponent(power(53), kInf), 13);
  EXPECT_EQ(unitExponent(-kInf, -power(60)), 20);
  EXPECT_EQ(unitExponent(-kInf, 0), 0);
  EXPECT_EQ(unitExponent(-power(1023), 0.5 * power(1023)), 1023);
  EXPECT_EQ(unitExponent(-power(1023), power(1023)), 1024);
}

}  // namespace
}  // namespace traceur::optim
