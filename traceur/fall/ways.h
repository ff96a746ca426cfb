// What a robot may do once it falls.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "traceur/fall/fall_motion.h"
#include "traceur/motion/controller.h"

namespace traceur::fall {

/// What a way to fall may know. What it refers to outlives the way.
struct FallContext {
  const FallRobot& falls;
  const SagittalBody& body;
  sim::State stance;  ///< what the robot stood in
  /// Makes the motion from a state; nothing where none is needed or known: what was begun then goes
  /// on. It is asked when the fall is noticed, at the first touch of a planned part (its impulse is
  /// still to come, as measured states have it), and again when the last has not stopped the fall.
  using Plan = std::function<std::optional<FallMotion>(
      const FallState& start, const std::vector<PoseSolver::Goal>& made, const sim::State& pose)>;
  Plan plan;  ///< of the way that follows one
};

/// A way to fall: a controller that begins when the fall is noticed.
struct WayToFall {
  std::string_view name;
  std::string_view help;  ///< what the robot does, for a person
  std::function<std::unique_ptr<motion::Controller>(const FallContext&)> make;
};

/// In the order in which they are shown.
const std::vector<WayToFall>& allWays();
/// @throws InputError naming what there is
const WayToFall& wayNamed(std::string_view name);

}  // namespace traceur::fall
