// What joints bear in a landing, against what they bear in the same fall limp [Ha2015, §3.6.1].
#pragma once

#include <string>
#include <vector>

#include "traceur/landing/judge.h"

namespace traceur::landing {

/// A joint, or a left and a right one, and all that hangs on it.
struct StressedJoint {
  std::string name;                ///< "hip" of hip_flex, hip_abduct and hip_rotate
  std::vector<sim::BodyId> moves;  ///< the body that it moves, or the two
  double carries = 0;              ///< mass of all that hangs on one of them [kg]
  bool meets_first = false;        ///< carries nothing but a foot or a hand

  /// The larger of both sides' [N].
  double stress(const VectorXd& by_body) const;
};

/// The joints of a robot, from the root outwards.
std::vector<StressedJoint> stressedJoints(const sim::Model& model);

/// How many times as much the joints bore limp. What bore nothing in the landing does not count.
struct StressRatio {
  double mean = 0;       ///< over joints of limp / landing: the dissertation's claim is 4
  double geometric = 0;  ///< the geometric mean of the same
  double sums = 0;       ///< Σ limp / Σ landing
  double worst = 0;      ///< the least of limp / landing
};

/// @param limp, landing  Verdict::stress
StressRatio compared(const std::vector<StressedJoint>& joints, const VectorXd& limp,
                     const VectorXd& landing);

/// Those that carry more than a foot or a hand: "end-effectors that come into contact first" are
/// left out of the dissertation's claim.
std::vector<StressedJoint> withoutEnds(std::vector<StressedJoint> joints);

}  // namespace traceur::landing
