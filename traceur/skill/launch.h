// Where a trial starts that starts in the air.
#pragma once

#include <optional>

#include "traceur/sim/world.h"
#include "traceur/skill/bound.h"

namespace traceur::skill {

/// A skill's Launch, bound to a trial's parameters and task.
class LaunchState {
 public:
  /// @param skill  that has a launch
  LaunchState(const Skill& skill, Places& places);

  /// The pose as a rigid body in flight, with the numbers that the places hold now.
  sim::State state();

 private:
  double landing(const sim::State& state, double wanted);
  sim::State launched(const sim::Pose& pose);

  const Skill* skill_;
  sim::World world_;  // scratch
  control::Expression height_;
  BoundVector velocity_, spin_;
  std::optional<control::Expression> angles_[3];
  std::optional<control::Expression> lands_;
  control::Expression ground_;
};

}  // namespace traceur::skill
