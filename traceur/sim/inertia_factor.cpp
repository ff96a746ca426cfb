#include "traceur/sim/inertia_factor.h"

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <numeric>

namespace traceur::sim {
namespace {

constexpr int kWidth = 4;  // numbers of a block [ours]: two of SSE2's registers
template <int kSize>
using Numbers = Eigen::Array<double, kSize, 1>;

int padded(int length) {
  return (length + kWidth - 1) / kWidth * kWidth;
}

}  // namespace

InertiaFactor::InertiaFactor(const mjModel_& m)
    : M_(static_cast<size_t>(m.nC + kWidth)), inverse_(static_cast<size_t>(m.nv)) {
  int begin = 0;
  for (int k = 0; k < m.nv; ++k) {
    const int* columns = m.M_colind + m.M_rowadr[k];
    row_.push_back({begin, m.M_rownnz[k], m.M_rowadr[k], k, columns});
    begin += padded(m.M_rownnz[k]);
    for (int at = 0; at < m.M_rownnz[k]; ++at) {
      Row& ancestor = row_[static_cast<size_t>(columns[at])];
      assert(ancestor.last >= k - 1 && ancestor.length == at + 1);  // the tree, depth first
      ancestor.last = k;
    }
  }
  order_.resize(row_.size());
  std::iota(order_.begin(), order_.end(), size_t{0});
  std::stable_sort(order_.begin(), order_.end(),
                   [&](size_t a, size_t b) { return row_[a].length < row_[b].length; });
  rows_.resize(static_cast<size_t>(begin));
  scaled_.resize(static_cast<size_t>(begin));
}

/// Row k, of kSize numbers or (Eigen::Dynamic) of any, and of the right side what is above it.
template <int kSize>
void InertiaFactor::take(size_t k, double* b) {
  const Row& row = row_[k];
  const Eigen::Index size = padded(row.length);
  Numbers<kSize> mine = Eigen::Map<const Numbers<kSize>>(M_.data() + row.from, size);
  double right = b[k];
  const double* const factor = scaled_.data() + row.length - 1;
  for (auto c = static_cast<size_t>(row.last); c > k; --c) {
    const double a = factor[row_[c].begin];
    mine -= a * Eigen::Map<const Numbers<kSize>>(rows_.data() + row_[c].begin, size);
    right -= a * b[c];
  }
  b[k] = right;
  Eigen::Map<Numbers<kSize>>(rows_.data() + row.begin, size) = mine;
  inverse_[k] = 1 / rows_[static_cast<size_t>(row.begin + row.length - 1)];
  Eigen::Map<Numbers<kSize>>(scaled_.data() + row.begin, size) = inverse_[k] * mine;
}

void InertiaFactor::solve(const double* M, const double* d, double* b) {
  std::copy_n(M, M_.size() - kWidth, M_.data());
  for (size_t k = 0; k < row_.size(); ++k) {
    M_[static_cast<size_t>(row_[k].from + row_[k].length - 1)] += d[k];
  }
  for (size_t i = order_.size(); i-- > 0;) {
    const size_t k = order_[i];
    // Rows of known size stay in registers.
    switch (padded(row_[k].length)) {
      case kWidth:
        take<kWidth>(k, b);
        break;
      case 2 * kWidth:
        take<2 * kWidth>(k, b);
        break;
      case 3 * kWidth:
        take<3 * kWidth>(k, b);
        break;
      case 4 * kWidth:
        take<4 * kWidth>(k, b);
        break;
      case 5 * kWidth:
        take<5 * kWidth>(k, b);
        break;
      case 6 * kWidth:
        take<6 * kWidth>(k, b);
        break;
      default:
        take<Eigen::Dynamic>(k, b);
        break;
    }
  }
  for (const size_t k : order_) {
    const Row& row = row_[k];
    const double* const scaled = scaled_.data() + row.begin;
    double sum = b[k] * inverse_[k];
    for (int at = row.length - 2; at >= 0; --at) sum -= scaled[at] * b[row.columns[at]];
    b[k] = sum;
  }
}

}  // namespace traceur::sim
