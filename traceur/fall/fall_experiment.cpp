#include "traceur/fall/fall_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

FallPlan FallExperiment::plan(const FallState& start, const sim::State& pose) {
  FallPlan found;
  if (options_.exact) {
    found = planExactly(problem_, start);
  } else {
    if (!table_) {
      const FallSetup& setup = body().setup();
      table_ = cachedTable(problem_, {falls_->robot->name, setup.stance, setup.direction},
                           options_.tables);
    }
    found = planQuickly(problem_, *table_, start);
  }
  if (found.contacts.empty()) return found;
  world_.place(pose);
  const std::vector<HeldPart> parts = heldParts(body(), world_.snapshot(), start.contact);
  double held = 0;
  for (const HeldImpact& h : heldFall(problem_, parts, start)) held = std::max(held, h.impulse);
  if (held < found.cost) found = {std::numeric_limits<double>::infinity(), {}};
  return found;
}

FallExperiment::Outcome FallExperiment::run(const Push& push, Strategy strategy,
                                            sim::Recording* recording, const FallPlan* plan) {
  Outcome outcome;
  bool first = true;
  const auto next = [&](const FallState& start, const std::vector<PoseSolver::Goal>& made,
                        const sim::State& pose) -> std::optional<FallMotion> {
    if (!first && (plan || !options_.replans)) return std::nullopt;
    FallPlan found = first && plan ? *plan : this->plan(start, pose);
    if (first) outcome.plan = found;
    first = false;
    if (std::isinf(found.cost)) return std::nullopt;
    return motionOf(found, problem_.model, body(), poses_, falls_->tracking, start, made, pose);
  };
  outcome.trial = simulator_.run(push, strategy, next, recording);
  return outcome;
}

}  // namespace traceur::fall
