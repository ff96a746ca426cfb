// Where a trial starts that starts in the air.
#pragma once

#include <optional>

#include "traceur/skill/bound.h"

namespace traceur::skill {

/// A skill's Launch, bound to a trial's parameters and task.
class LaunchState {
 public:
  /// @param skill  that has a launch
  LaunchState(const Skill& skill, Places& places);

  /// The pose as a rigid body in flight, with the numbers that the places hold now.
  sim::State state() const;

 private:
  const Skill* skill_;
  control::Expression height_;
  BoundVector velocity_, spin_;
  std::optional<control::Expression> angles_[3];
};

}  // namespace traceur::skill
