// Eigenvalues and eigenvectors of a symmetric matrix, over and over at the same size.
#pragma once

#include <Eigen/Core>

namespace traceur::optim {

/// A = B diag(d) Bᵀ by Householder reflections to a tridiagonal matrix and implicit QL with
/// Wilkinson's shift [Golub2013, §8.3]. Most of CMA-ES's own time goes here; the rotations of one
/// QL sweep are therefore applied to B together, eight rows at a time, which at n = 100 saves a
/// quarter of the time of Eigen's SelfAdjointEigenSolver.
class SymmetricEigen {
 public:
  explicit SymmetricEigen(int n);

  /// Reads the lower triangle of A, (n x n), finite. Allocates nothing.
  void compute(const Eigen::MatrixXd& A);

  const Eigen::VectorXd& values() const { return d_; }   ///< (n), in no order
  const Eigen::MatrixXd& vectors() const { return B_; }  ///< (n x n) orthonormal columns

 private:
  void reduce();
  void accumulate();
  void sweep(int first, int last);

  Eigen::MatrixXd B_;
  Eigen::VectorXd d_;          // (n) diagonal
  Eigen::VectorXd e_;          // (n) e_i couples i and i+1; the last is 0
  Eigen::VectorXd tau_;        // (n) reflection k is I - τ_k v vᵀ, v in column k of B below d_k
  Eigen::VectorXd work_;       // (n)
  Eigen::VectorXd cos_, sin_;  // (n) rotations of one sweep
};

}  // namespace traceur::optim
