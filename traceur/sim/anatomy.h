// Which bodies of a robot are its legs, feet, arms and hands.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "traceur/sim/mirror.h"

namespace traceur::sim {

/// The names of a robot.toml for what a model has.
struct Anatomy {
  /// left_leg, right_leg, left_arm, right_arm (left_arm_2 … where there are more), from the root
  /// outwards.
  std::map<std::string, std::vector<std::string>> limbs;
  std::map<std::string, std::vector<std::string>> bodies;  ///< trunk, head, feet, hands, legs, arms
  /// Corners of the soles, left_toe_outer, left_toe_inner, left_heel_outer …, and finger tips,
  /// left_hand …
  std::map<std::string, ContactPoint> contacts;
};

/// A limb begins with a body that a mirrored joint moves against the trunk. It is a leg if it
/// reaches the ground at joint angles 0, else an arm, which ends where it branches: in a hand with
/// fingers.
/// @param world  at joint angles 0
Anatomy anatomyOf(const World& world, const Mirroring& mirroring);

}  // namespace traceur::sim
