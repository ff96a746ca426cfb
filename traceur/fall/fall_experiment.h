// A robot, a stance and a push: everything it takes to let it fall in any way.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "traceur/fall/fall_problem.h"
#include "traceur/fall/fall_trial.h"
#include "traceur/fall/value_table.h"

namespace traceur::fall {

struct FallExperimentOptions {
  FallProblemOptions problem;
  FallProtocol protocol;
  /// Plans anew whenever a contact has been made, and when the last has not ended the fall;
  /// without, the first plan is followed to its end, as published.
  bool replans = true;
  /// Plans by planExactly instead of planQuickly.
  bool exact = false;
  /// Where value tables are kept from one process to the next; empty: made anew.
  std::filesystem::path tables = {};
};

/// One thread's experiments with one setup; made once, used for many.
class FallExperiment {
 public:
  /// @throws InputError for a stance that does not stand, as FallSimulator::checkStance
  FallExperiment(std::shared_ptr<const FallRobot> falls, const FallSetup& setup,
                 FallExperimentOptions options = {});
  FallExperiment(const FallExperiment&) = delete;  // its parts know one another by address
  FallExperiment& operator=(const FallExperiment&) = delete;

  struct Outcome {
    FallTrial trial;
    FallPlan plan;         ///< the first, where the way to fall plans
    bool refused = false;  ///< it is not followed: by the model keeping the pose costs less
  };

  /// @param way   one of allWays()
  /// @param plan  follow this one, whatever the fall is like, instead of planning
  /// @param more  as FallSimulator::run
  Outcome run(const Push& push, std::string_view way, const motion::TrialOptions& more = {},
              const FallPlan* plan = nullptr);

  const FallProblem& problem() const { return problem_; }
  const SagittalBody& body() const { return simulator_.body(); }

 private:
  /// The first makes the value table, in seconds.
  FallPlan plan(const FallState& start);
  /// What the pose costs if it is kept from a state on, by the model [N·s].
  double heldCost(const FallState& start, const sim::State& pose);

  std::shared_ptr<const FallRobot> falls_;
  FallExperimentOptions options_;
  FallSimulator simulator_;
  FallProblem problem_;
  std::optional<ValueTable> table_;
  PoseSolver poses_;
  sim::World world_;  // for kinematics
};

}  // namespace traceur::fall
