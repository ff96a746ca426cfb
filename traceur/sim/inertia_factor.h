// Solves with the mass matrix of a kinematic tree, plus a diagonal.
#pragma once

#include <cstddef>
#include <vector>

struct mjModel_;  // NOLINT(readability-identifier-naming): MuJoCo's name

namespace traceur::sim {

/// The sparse LᵀDL of M + diag(d) [Featherstone2008, §6.5], row by row: a row takes what all its
/// descendants do to it at once, so that it stays in registers. Bit for bit what taking the rows
/// from each descendant in turn gives.
class InertiaFactor {
 public:
  explicit InertiaFactor(const mjModel_& m);
  /// Solves (M + diag(d)) x = b in place; M as the engine stores it (nC), d ≥ 0 and b (nv).
  void solve(const double* M, const double* d, double* b);

 private:
  /// Of one degree of freedom.
  struct Row {
    int begin = 0;            // in rows_ and scaled_; padded to whole blocks
    int length = 0;           // of its non-zeros: its ancestors from the root on, last itself
    int from = 0;             // in M
    int last = 0;             // its last descendant; all between are its, too
    const int* columns = {};  // the engine's
  };
  template <int kSize>
  void take(size_t k, double* b);

  std::vector<Row> row_;
  /// Rows, ancestors before descendants, branches by turns: a row waits for the one below it in its
  /// branch, and meanwhile the processor works at another branch's.
  std::vector<size_t> order_;
  std::vector<double> M_;  // and a block more, as rows are read in whole blocks
  std::vector<double> rows_, scaled_, inverse_;
};

}  // namespace traceur::sim
