#include "traceur/fall/fall_experiment.h"

#include <algorithm>
#include <cmath>

#include "traceur/fall/plan_library.h"

namespace traceur::fall {

FallExperiment::FallExperiment(std::shared_ptr<const FallRobot> falls, const FallSetup& setup,
                               FallExperimentOptions options)
    : falls_(std::move(falls)),
      options_(std::move(options)),
      simulator_(*falls_, setup, options_.protocol),
      problem_(fallProblem(simulator_.body(), *falls_, options_.problem)),
      poses_(simulator_.body(), *falls_),
      world_(simulator_.body().model()) {
  simulator_.checkStance();
}

FallPlan FallExperiment::plan(const FallState& start) {
  if (options_.exact) return planExactly(problem_, start);
  if (!table_) {
    const FallSetup& setup = body().setup();
    table_ = cachedTable(problem_, {falls_->robot->name, setup.stance, setup.direction},
                         options_.tables);
  }
  return planQuickly(problem_, *table_, start);
}

double FallExperiment::heldCost(const FallState& start, const sim::State& pose) {
  world_.place(pose);
  const std::vector<HeldPart> parts = heldParts(body(), world_.snapshot(), start.contact);
  double most = 0;
  for (const HeldImpact& h : heldFall(problem_, parts, start)) most = std::max(most, h.impulse);
  return most;
}

FallExperiment::Outcome FallExperiment::run(const Push& push, std::string_view way,
                                            const motion::TrialOptions& more,
                                            const FallPlan* plan) {
  Outcome outcome;
  bool first = true;
  const auto next = [&](const FallState& start, const std::vector<PoseSolver::Goal>& made,
                        const sim::State& pose) -> std::optional<FallMotion> {
    if (!first && (plan || !options_.replans)) return std::nullopt;
    const FallPlan found = first && plan ? *plan : this->plan(start);
    // As printed, a plan is followed whatever it costs.
    const bool refused = !(first && plan) && options_.problem.stall == Stall::kStops &&
                         !found.contacts.empty() && heldCost(start, pose) < found.cost;
    if (first) {
      outcome.plan = found;
      outcome.refused = refused;
    }
    first = false;
    if (refused || std::isinf(found.cost)) return std::nullopt;
    return motionOf(found, problem_.model, body(), poses_, falls_->tracking, start, made, pose);
  };
  outcome.trial = simulator_.run(push, way, next, more);
  return outcome;
}

}  // namespace traceur::fall
