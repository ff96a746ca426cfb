#include "traceur/fall/fall_problem.h"

#include <algorithm>
#include <cmath>

namespace traceur::fall {

FallProblem fallProblem(const SagittalBody& body, const FallRobot& falls,
                        const FallProblemOptions& options) {
  const ContactGraph& graph = body.setup().graph;
  const sim::State stance = body.model()->stateOf(falls.robot->poses.at(body.setup().stance));
  sim::World world(body.model());
  world.reset(stance);
  const sim::Snapshot& s = world.snapshot();
  FallProblem p;
  p.model.mass = body.model()->mass();
  p.model.inertia = body.inertia(stance);
  p.model.post_impact = options.post_impact;
  p.graph = graph;
  p.rod_speed = body.setup().quick.rod_speed;
  p.stopper_speed = body.setup().quick.stopper_speed;
  p.least_interval = falls.least_interval;
  p.stall = options.stall;
  const double r1 = body.pendulum(s, 0).r;
  const double eighth = std::sqrt(r1 / p.model.gravity) / 8;
  p.grid.time = std::max(1.0, std::round(eighth / p.model.step)) * p.model.step;
  p.reach = sampleReach(body, falls, {options.poses, options.seed, r1 / 20}, &p.lengths);
  for (size_t i = 0; i < graph.nodes.size(); ++i) {
    p.first_angle.emplace_back();
    for (const int to : graph.edges[i]) {
      p.first_angle[i].push_back(body.stopperAngle(s, static_cast<int>(i), to));
    }
  }
  return p;
}

std::vector<HeldPart> heldParts(const SagittalBody& body, const sim::Snapshot& s, int pivot) {
  const Vector2d com = body.com(s);
  const Vector2d rod = com - body.node(s, pivot);
  const std::vector<std::string>& standing = body.setup().graph.nodes[pivot].points;
  std::vector<HeldPart> parts;
  for (const auto& [name, unused] : body.model()->robot()->contacts) {
    if (std::find(standing.begin(), standing.end(), name) != standing.end()) continue;
    const Vector2d stopper = body.inPlane(body.point(s, name)) - com;
    parts.push_back({name, stopper.norm(),
                     wrapped(std::atan2(stopper.x(), stopper.y()) - std::atan2(rod.x(), rod.y()))});
  }
  return parts;
}

}  // namespace traceur::fall
