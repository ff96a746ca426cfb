// A whole robot pushed over in the simulator, by one way or another of meeting the ground.
#pragma once

#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "traceur/fall/impulse_meter.h"
#include "traceur/fall/ways.h"
#include "traceur/motion/session.h"

namespace traceur::fall {

/// A constant force on the push body at its COM, horizontal, along the fall, from the start on.
struct Push {
  double force = 0;       ///< [N]
  double duration = 0.1;  ///< [s] [Ha2015, §4.4.1.1]
};

struct FallTrial : Impacts {
  bool fell = false;   ///< whether the fall was noticed; without, nothing else means much
  double noticed = 0;  ///< when [s]
  FallState start;     ///< what a plan begins from then
  bool diverged = false;
  std::vector<Vector2d> com;  ///< in the plane, from the first pivot, every 10 ms from `noticed` on
};

/// One thread's workspace for trials of one setup.
class FallSimulator {
 public:
  FallSimulator(const FallRobot& falls, FallSetup setup, FallProtocol protocol = {});

  const SagittalBody& body() const { return body_; }

  /// @throws InputError for a stance that does not stand on its first node, or that should
  ///         stand still but, unpushed, begins to fall within half a second
  void checkStance() const;

  using Plan = FallContext::Plan;
  /// A whole trial. Equal arguments give equal bits.
  /// @param way   one of allWays()
  /// @param plan  of the way that follows one
  /// @param more  a recording, delay, the sensors' noise, pushes beside the one; its horizon counts
  ///              only where it ends the trial sooner
  /// @throws InputError for another way
  FallTrial run(const Push& push, std::string_view way, const Plan& plan = {},
                const motion::TrialOptions& more = {});

 private:
  const FallRobot* falls_;
  FallProtocol protocol_;
  SagittalBody body_;
  sim::State stance_;
};

}  // namespace traceur::fall
