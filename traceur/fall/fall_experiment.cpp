#include "traceur/fall/fall_experiment.h"

#include <cmath>

namespace traceur::fall {

FallExperiment::FallExperiment(std::shared_ptr<const FallRobot> falls, const FallSetup& setup,
                               FallExperimentOptions options)
    : falls_(std::move(falls)),
      options_(options),
      simulator_(*falls_, setup, options.protocol),
      problem_(fallProblem(simulator_.body(), *falls_, options.problem)),
      poses_(simulator_.body(), *falls_) {
  simulator_.checkStance();
}

FallExperiment::Outcome FallExperiment::run(const Push& push, Strategy strategy,
                                            sim::Recording* recording, const FallPlan* plan) {
  Outcome outcome;
  bool first = true;
  const auto next = [&](const FallState& start, const std::vector<PoseSolver::Goal>& made,
                        const sim::State& pose) -> std::optional<FallMotion> {
    if (!first && (plan || !options_.replans)) return std::nullopt;
    FallPlan found = first && plan ? *plan : planExactly(problem_, start);
    if (first) outcome.plan = found;
    first = false;
    if (std::isinf(found.cost)) return std::nullopt;
    return motionOf(found, problem_.model, body(), poses_, falls_->tracking, start, made, pose);
  };
  outcome.trial = simulator_.run(push, strategy, next, recording);
  return outcome;
}

}  // namespace traceur::fall
