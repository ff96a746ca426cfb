// How a robot of which nothing is known but its model stands: gains, a pose, and the proof.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "traceur/control/stable_pd.h"
#include "traceur/sim/anatomy.h"

namespace traceur::control {

/// Gains by physics, by index in model.joints(). A joint parts the robot in two; what it has to
/// carry is the part without feet, or, where both have some, the part that the legs share:
///
///     kp = max(10 m g d / n, (25 rad/s)² I),   kd = kp · 0.05 s
///
/// m the mass of that part, d the distance of its centre of mass from the joint: a weight that
/// topples over it does so with m g d at most. n the number of legs that share it. I the inertia
/// outwards of the joint, its motor's too. 10 and 0.05 s are those of the Atlas under models/,
/// 25 rad/s is that of its arms [ours]. Left and right get the same, all two digits.
/// @param world  at joint angles 0
/// @param factor  on all gains
std::vector<sim::JointGain> gainsByPhysics(const sim::World& world, const sim::Mirroring& mirroring,
                                           const sim::Anatomy& anatomy, double factor = 1);

/// Legs bent in three parallel joints across the sagittal plane, hip, knee and ankle: the knees by
/// `bend` [rad], the others so that the soles are as level as at joint angles 0 and the COM is over
/// the middle of the soles' corners. Nothing where a leg has not three such joints, or where their
/// ranges do not allow it.
std::optional<sim::Pose> bentPose(sim::World& world, const sim::Mirroring& mirroring,
                                  const sim::Anatomy& anatomy, double bend);

/// How long a pose was held in simulation.
struct Standing {
  bool stands = false;
  /// Until something but the feet touched the ground, the COM was off by more than kMostDrift of
  /// its height, or the end [s].
  double time = 0;
  double drift = 0;  ///< of the COM until then, at most [m]
  double speed = 0;  ///< of a joint in the second half, at most [rad/s | m/s]
};

/// A robot that stands keeps its COM within this part of its height [ours], and its joints in the
/// second half slower than this [rad/s, m/s; ours]: it does not shake.
inline constexpr double kMostDrift = 0.05;
inline constexpr double kMostShaking = 0.1;

/// After half a second the robot is pushed for a tenth of one, ahead and to the left, with this
/// part of its weight [ours]: what is balanced on a needle's point falls, what stands sways by a
/// hundredth of its height.
inline constexpr double kNudge = 0.05;

/// Holds a pose by StablePd within the joints' limits, and nudges the robot.
/// @param feet  bodies that may touch the ground, with what hangs on them
Standing hold(const std::shared_ptr<const sim::Model>& model, const sim::Pose& pose,
              const std::vector<sim::JointGain>& gains, const std::vector<sim::BodyId>& feet,
              double seconds);

/// The bodies of the group "feet".
std::vector<sim::BodyId> feetOf(const sim::Model& model, const sim::Anatomy& anatomy);

}  // namespace traceur::control
