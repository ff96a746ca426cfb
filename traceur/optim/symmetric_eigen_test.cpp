#include "traceur/optim/symmetric_eigen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/random.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A matrix of the given eigenvalues whose axes are those of space, reflected at six random planes.
MatrixXd rotated(const VectorXd& eigenvalues, std::uint64_t seed) {
  Random random(seed);
  MatrixXd A = eigenvalues.asDiagonal();
  VectorXd v(eigenvalues.size());
  for (int i = 0; i < 6; ++i) {
    for (double& c : v) c = random.normal();
    v.normalize();
    A -= 2 * v * (v.transpose() * A);
    A -= 2 * (A * v) * v.transpose();
  }
  return (A + A.transpose()) / 2;
}

/// @param expected  the eigenvalues A was made of, in any order; empty: unknown
void expectDecomposes(SymmetricEigen& eigen, const MatrixXd& A, VectorXd expected = {}) {
  const auto n = static_cast<double>(A.rows());
  MatrixXd lower_only = A;
  lower_only.triangularView<Eigen::StrictlyUpper>().setConstant(NAN);
  eigen.compute(lower_only);
  const MatrixXd& B = eigen.vectors();
  EXPECT_LE((B * eigen.values().asDiagonal() * B.transpose() - A).norm(), 4e-15 * n * A.norm());
  EXPECT_LE((B.transpose() * B - MatrixXd::Identity(A.rows(), A.rows())).norm(), 4e-15 * n);

  if (expected.size() == 0) return;
  VectorXd found = eigen.values();
  std::sort(found.begin(), found.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_LE((found - expected).norm(), 4e-15 * n * A.norm());
}

TEST(SymmetricEigen, FindsTheEigenvaluesAMatrixWasMadeOf) {
  for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 16, 17, 31, 64, 100}) {
    SCOPED_TRACE(n);
    SymmetricEigen eigen(n);
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      VectorXd spread(n);
      Random random(seed, n);
      for (double& v : spread) v = random.normal();
      expectDecomposes(eigen, rotated(spread, seed), spread);
    }
  }
}

TEST(SymmetricEigen, HandlesHardSpectra) {
  for (const int n : {2, 5, 20, 50}) {
    SCOPED_TRACE(n);
    SymmetricEigen eigen(n);
    VectorXd graded(n);
    for (int i = 0; i < n; ++i) graded[i] = std::pow(10, -14.0 * i / std::max(1, n - 1));
    VectorXd two = VectorXd::Ones(n);
    two[0] = 1e6;
    VectorXd clustered = VectorXd::Ones(n);
    clustered[n - 1] += 1e-13;
    for (const VectorXd& v : {graded, VectorXd(graded.reverse()), two, clustered,
                              VectorXd(VectorXd::Zero(n)), VectorXd(-graded)}) {
      expectDecomposes(eigen, rotated(v, 5), v);
      expectDecomposes(eigen, v.asDiagonal(), v);
    }
    expectDecomposes(eigen, 1e-290 * rotated(graded, 5));
    expectDecomposes(eigen, 1e290 * rotated(graded, 5));
    MatrixXd one = MatrixXd::Identity(n, n);  // large in one row and column only
    one.row(0) *= 1e290;
    one(1, 0) = one(0, 1) = 1e289;
    expectDecomposes(eigen, one);
    // Graded, not rotated: large to small and back along the diagonal.
    for (const VectorXd& v : {graded, VectorXd(graded.reverse())}) {
      const VectorXd s = v.cwiseSqrt();
      const MatrixXd unit = rotated(VectorXd::LinSpaced(n, 1, 2), 6);
      expectDecomposes(eigen, s.asDiagonal() * unit * s.asDiagonal());
    }
  }
}

TEST(SymmetricEigen, DependsOnItsArgumentOnly) {
  const MatrixXd A = rotated(VectorXd::LinSpaced(12, 0.1, 4), 8);
  SymmetricEigen fresh(12);
  SymmetricEigen used(12);
  used.compute(rotated(VectorXd::LinSpaced(12, -3, 1), 9));
  fresh.compute(A);
  used.compute(A);
  EXPECT_EQ(fresh.vectors(), used.vectors());
  EXPECT_EQ(fresh.values(), used.values());
}

TEST(SymmetricEigen, EndsForNumbersThatAreNone) {
  SymmetricEigen eigen(6);
  eigen.compute(MatrixXd::Constant(6, 6, NAN));  // a bug of the caller's; it must not hang
  eigen.compute(MatrixXd::Constant(6, 6, INFINITY));
}

}  // namespace
}  // namespace traceur::optim
