#include "traceur/fall/fall_motion.h"

#include <algorithm>
#include <cmath>

namespace traceur::fall {

FallMotion motionOf(const FallPlan& plan, const PendulumModel& model, const SagittalBody& body,
                    PoseSolver& poses, const FallTracking& tracking, const FallState& start,
                    const std::vector<PoseSolver::Goal>& made, const sim::State& pose) {
  FallMotion motion;
  // At rest over the middle of the last two parts that touched, a little lower, so that both are
  // reached.
  const auto body_of = [&](int node) {
    const std::string& point = body.setup().graph.nodes[node].points.front();
    return body.model()->robot()->contacts.at(point).body;
  };
  const auto rest = [&](const PoseSolver::Goal& last, const std::vector<PoseSolver::Goal>& before,
                        double height, const sim::State& near) {
    std::vector<PoseSolver::Goal> on = {last};
    for (auto b = before.rbegin(); b != before.rend() && on.size() < 2; ++b) {
      if (body_of(b->node) != body_of(last.node)) on.push_back(*b);
    }
    double least = 0;
    double most = 0;
    for (PoseSolver::Goal& g : on) {
      g.weight = 1;
      g.place.y() = 0;
      least = std::min(least, g.place.x());
      most = std::max(most, g.place.x());
    }
    return poses.solve(on, {(least + most) / 2, tracking.rest_height * height}, near);
  };
  if (plan.contacts.empty()) {
    if (start.contact == 0) return motion;
    motion.rest = rest({start.contact, Vector2d::Zero()}, made, start.pendulum.com().y(), pose);
    return motion;
  }
  std::vector<PoseSolver::Goal> kept = made;
  for (PoseSolver::Goal& k : kept) k.weight = tracking.kept;
  sim::State from = pose;
  for (const PlannedContact& c : plan.contacts) {
    const Vector2d tip(c.impact.advance, 0);
    FallMotion::Stage stage{c.action.contact,
                            body.setup().graph.nodes[c.action.contact].points,
                            c.action.duration,
                            c.action.rod_rate,
                            {}};
    std::vector<PoseSolver::Goal> goals = {{c.from.contact, Vector2d::Zero()},
                                           {c.action.contact, tip}};
    goals.insert(goals.end(), kept.begin(), kept.end());
    // Where the pendulum is on the way; the next part is drawn to its place more and more.
    PendulumState s = c.from.pendulum;
    const int steps = static_cast<int>(std::lround(c.action.duration / model.step));
    int done = 0;
    for (int k = 1; k <= tracking.waypoints; ++k) {
      for (; done < steps * k / tracking.waypoints; ++done) step(model, c.action.rod_rate, s);
      const double part = static_cast<double>(k) / tracking.waypoints;
      goals[1].weight = k == tracking.waypoints ? 1 : tracking.approach * part;
      from = poses.solve(goals, s.com(), from);
      stage.poses.push_back(from);
    }
    motion.stages.push_back(std::move(stage));
    kept.push_back({c.from.contact, Vector2d::Zero(), tracking.kept});
    for (PoseSolver::Goal& k : kept) k.place -= tip;
    if (&c == &plan.contacts.back()) {
      motion.rest = rest({c.action.contact, Vector2d::Zero()}, kept, c.before.com().y(), from);
    }
  }
  return motion;
}

}  // namespace traceur::fall
