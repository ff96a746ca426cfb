// Joint targets on their way.
#pragma once

#include <vector>

#include "traceur/control/stable_pd.h"

namespace traceur::motion {

/// A way of joint targets, evenly in time and straight from each to the next:
///
///     q*(t) = q_k + (n t / T − k) (q_{k+1} − q_k),   k = ⌊n t / T⌋,   q_n after T
class JointPath {
 public:
  JointPath() = default;
  /// @param via       n ≥ 1 targets after `from`, the last its end
  /// @param duration  T ≥ 0 [s]; 0: at once
  JointPath(control::JointTarget from, std::vector<control::JointTarget> via, double duration);

  bool empty() const { return via_.empty(); }
  /// @param t  since it began [s]
  control::JointTarget at(double t) const;
  bool over(double t) const { return !(duration_ > 0 && t < duration_); }
  /// Where it leads; may be changed on the way.
  control::JointTarget& end() { return via_.back(); }
  const control::JointTarget& end() const { return via_.back(); }

 private:
  control::JointTarget from_;
  std::vector<control::JointTarget> via_;
  double duration_ = 0;
};

}  // namespace traceur::motion
