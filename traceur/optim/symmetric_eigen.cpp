#include "traceur/optim/symmetric_eigen.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace traceur::optim {
namespace {

/// Two are usual; more than this is a sign of numbers that are none.
constexpr int kSweepsPerValue = 30;

/// Applies rotation i = last-1, …, first to columns i and i+1 of rows [row, row + kRows) of B. What
/// a column is between two rotations stays in registers.
template <int kRows>
void rotateRows(Eigen::MatrixXd& B, Eigen::Index row, int first, int last, const double* c,
                const double* s) {
  using Rows = Eigen::Array<double, kRows, 1>;
  const Eigen::Index stride = B.rows();
  double* p = B.data() + last * stride + row;
  Rows carried = Eigen::Map<const Rows>(p);
  for (int i = last - 1; i >= first; --i) {
    p -= stride;
    const Rows here = Eigen::Map<const Rows>(p);
    Eigen::Map<Rows> next(p + stride);
    next = s[i] * here + c[i] * carried;
    carried = c[i] * here - s[i] * carried;
  }
  Eigen::Map<Rows> left(p);
  left = carried;
}

}  // namespace

SymmetricEigen::SymmetricEigen(int n)
    : B_(n, n), d_(n), e_(n), tau_(n), work_(n), cos_(n), sin_(n) {}

void SymmetricEigen::compute(const Eigen::MatrixXd& A) {
  const auto n = static_cast<int>(d_.size());
  // Scaled by a power of two, which changes no digit, so that squares neither over- nor underflow.
  double largest = 0;
  for (int j = 0; j < n; ++j) {
    largest = std::max(largest, A.col(j).tail(n - j).cwiseAbs().maxCoeff());
  }
  const bool ordinary = largest > 0 && std::isfinite(largest);
  const int exponent = ordinary ? std::clamp(std::ilogb(largest), -1000, 1000) : 0;
  const double scale = std::ldexp(1.0, -exponent);
  for (int j = 0; j < n; ++j) B_.col(j).tail(n - j) = scale * A.col(j).tail(n - j);
  reduce();
  accumulate();
  const double epsilon = std::numeric_limits<double>::epsilon();
  int sweeps = kSweepsPerValue * n;
  for (int first = 0; first < n; ++first) {
    while (sweeps-- > 0) {
      int last = first;  // of the block that still hangs together
      while (last < n - 1 &&
             std::abs(e_[last]) > epsilon * (std::abs(d_[last]) + std::abs(d_[last + 1]))) {
        ++last;
      }
      if (last == first) break;
      sweep(first, last);
    }
  }
  d_ /= scale;
}

/// A → tridiagonal (d, e); the reflections stay in B's columns.
void SymmetricEigen::reduce() {
  const Eigen::Index n = d_.size();
  for (Eigen::Index k = 0; k + 1 < n; ++k) {
    const Eigen::Index m = n - 1 - k;
    auto v = B_.col(k).tail(m);
    const double first = v[0];
    const double others = v.tail(m - 1).squaredNorm();
    double tau = 0;
    double norm = first;
    if (others > 0) {
      norm = -std::copysign(std::sqrt(first * first + others), first);
      tau = (norm - first) / norm;
      v.tail(m - 1) /= first - norm;
    }
    v[0] = 1;
    d_[k] = B_(k, k);
    e_[k] = norm;
    tau_[k] = tau;
    if (tau == 0) continue;
    auto rest = B_.bottomRightCorner(m, m);
    auto w = work_.head(m);
    w.noalias() = rest.selfadjointView<Eigen::Lower>() * v;
    w *= tau;
    w -= (0.5 * tau * w.dot(v)) * v;
    rest.selfadjointView<Eigen::Lower>().rankUpdate(v, w, -1);
  }
  d_[n - 1] = B_(n - 1, n - 1);
  e_[n - 1] = 0;
}

/// The reflections in B's columns → their product H_0 H_1 … in B, from the last one back.
void SymmetricEigen::accumulate() {
  const Eigen::Index n = d_.size();
  for (Eigen::Index k = n - 2; k >= 0; --k) {
    const Eigen::Index m = n - 1 - k;
    const auto v = B_.col(k).tail(m);
    B_.row(k + 1).tail(m - 1).setZero();
    auto rest = B_.bottomRightCorner(m, m - 1);
    auto projection = work_.head(m - 1);
    projection.noalias() = rest.transpose() * v;
    projection *= tau_[k];
    rest.noalias() -= v * projection.transpose();
    auto next = B_.col(k + 1).tail(m);
    next = -tau_[k] * v;
    next[0] += 1;
  }
  B_.row(0).setZero();
  B_.col(0).setZero();
  B_(0, 0) = 1;
}

void SymmetricEigen::sweep(int first, int last) {
  // Wilkinson's shift: the eigenvalue of the leading 2 x 2 block nearer to its corner.
  const double half = (d_[first + 1] - d_[first]) / (2 * e_[first]);
  double g =
      d_[last] - d_[first] + e_[first] / (half + std::copysign(std::sqrt(half * half + 1), half));
  double s = 1;
  double c = 1;
  double p = 0;
  int i = last - 1;
  for (; i >= first; --i) {
    const double f = s * e_[i];
    const double b = c * e_[i];
    const double square = f * f + g * g;
    const double r = std::sqrt(square);
    e_[i + 1] = r;
    if (!(square > 0)) break;  // the block falls apart here
    const double inverse = 1 / r;
    s = f * inverse;
    c = g * inverse;
    g = d_[i + 1] - p;
    const double q = (d_[i] - g) * s + 2 * c * b;
    p = s * q;
    d_[i + 1] = g + p;
    g = c * q - b;
    cos_[i] = c;
    sin_[i] = s;
  }
  if (i >= first) {
    d_[i + 1] -= p;
  } else {
    d_[first] -= p;
    e_[first] = g;
  }
  e_[last] = 0;

  const int reached = i + 1;
  if (reached == last) return;
  const Eigen::Index n = d_.size();
  Eigen::Index row = 0;
  for (; row + 8 <= n; row += 8) rotateRows<8>(B_, row, reached, last, cos_.data(), sin_.data());
  for (; row + 4 <= n; row += 4) rotateRows<4>(B_, row, reached, last, cos_.data(), sin_.data());
  for (; row + 2 <= n; row += 2) rotateRows<2>(B_, row, reached, last, cos_.data(), sin_.data());
  if (row < n) rotateRows<1>(B_, row, reached, last, cos_.data(), sin_.data());
}

}  // namespace traceur::optim
