#include "traceur/motion/joint_path.h"

#include <algorithm>
#include <cassert>

namespace traceur::motion {

JointPath::JointPath(control::JointTarget from, std::vector<control::JointTarget> via,
                     double duration)
    : from_(std::move(from)), via_(std::move(via)), duration_(duration) {
  assert(!via_.empty());
}

control::JointTarget JointPath::at(double t) const {
  const auto n = static_cast<double>(via_.size());
  const double along = duration_ > 0 ? std::clamp(t / duration_, 0.0, 1.0) * n : n;
  const size_t next = std::min(static_cast<size_t>(along), via_.size() - 1);
  const Eigen::VectorXd& before = next == 0 ? from_.q : via_[next - 1].q;
  return {before + (along - static_cast<double>(next)) * (via_[next].q - before)};
}

}  // namespace traceur::motion
