// Six constrained problems whose optimum lies on the boundary, where only yes or no is told.
#pragma once

#include <span>
#include <string>

#include "traceur/optim/problem.h"

namespace traceur::reproduce {

/// A problem with its start. TRn: a sphere whose best point lies on a plane [Arnold2012]; g06, g24:
/// two curves that meet at an angle [Liang2006]; balln: a slope in the unit ball.
struct Anchor {
  std::string name;  ///< "g06"
  int n = 0;
  double best = 0;         ///< f*, the least feasible cost
  double sigma = 0;        ///< first standard deviation
  Eigen::VectorXd start;   ///< (n) first mean
  double start_sigma = 0;  ///< each run starts at start + start_sigma N(0, I)
};

/// TR2, TR10, g06, g24, ball5, ball20.
std::span<const Anchor> anchors();

/// An anchor as a problem: the cost, and for each constraint whether it is violated.
class AnchorProblem : public optim::Problem {
 public:
  /// @throws InputError for an anchor there is not
  explicit AnchorProblem(int anchor);

  Eigen::VectorXd lower() const override { return lower_; }
  Eigen::VectorXd upper() const override { return upper_; }
  std::vector<std::string> constraints() const override;
  optim::Evaluation evaluate(const Eigen::VectorXd& x) const override;

 private:
  int anchor_;
  Eigen::VectorXd lower_, upper_;
};

/// A run is solved by a feasible trial with f ≤ f* + kAnchorGap max(1, |f*|), and given up after
/// kAnchorCap trials.
inline constexpr double kAnchorGap = 1e-6;
inline constexpr int kAnchorCap = 20000;

struct AnchorOutcome {
  int rollouts = 0;    ///< trials simulated, the infeasible ones among them
  int infeasible = 0;  ///< of these
  bool solved = false;
  double gap = 0;  ///< least feasible cost - f*; ∞ if no trial was feasible
};

struct AnchorAlgorithm {
  std::string name;  ///< "CMA-C"
  std::string help;  ///< one sentence
};

std::span<const AnchorAlgorithm> anchorAlgorithms();

/// One run. Equal seeds give every algorithm the same start.
/// @throws InputError for an anchor or an algorithm there is not
AnchorOutcome runAnchor(int anchor, int algorithm, std::uint64_t seed);

}  // namespace traceur::reproduce
