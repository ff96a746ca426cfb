#include "traceur/skill/bound.h"

#include <cmath>

namespace traceur::skill {
namespace {

std::optional<double> valueOf(const std::optional<control::Expression>& e) {
  if (!e) return std::nullopt;
  const double x = e->value();
  if (!std::isfinite(x)) return std::nullopt;  // a signal without a value leaves the axis free
  return x;
}

}  // namespace

BoundReach::BoundReach(const Reach& reach, const std::shared_ptr<const sim::Model>& model,
                       Places& places)
    : reach_(&reach), model_(model), solver_(model, reach.joints) {
  const auto lookup = places.in(Scope::kRunning);
  for (const ReachGoal& g : reach.goals) {
    goals_.push_back({&g, maybeBound(g.x, lookup), maybeBound(g.y, lookup), maybeBound(g.z, lookup),
                      maybeBound(g.distance, lookup), maybeBound(g.roll, lookup),
                      maybeBound(g.pitch, lookup), maybeBound(g.yaw, lookup),
                      control::Expression(g.weight, lookup)});
  }
}

void BoundReach::solve(const sim::Snapshot& s, const VectorXd& wanted,
                       control::JointTarget& target) {
  std::vector<control::PoseGoal> goals;
  for (const Goal& g : goals_) {
    control::PoseGoal goal{.of = g.goal->of,
                           .from = g.goal->from,
                           .x = valueOf(g.x),
                           .y = valueOf(g.y),
                           .z = valueOf(g.z),
                           .distance = valueOf(g.distance),
                           .weight = g.weight.value() > 0 ? g.weight.value() : 0};
    if (g.roll || g.pitch || g.yaw) {
      const sim::Matrix3d now = s.bodyRotation(goal.of.points.front().body);
      const Vector3d is = sim::rpyOf(now);
      goal.attitude =
          sim::rotationOf({valueOf(g.roll).value_or(is.x()), valueOf(g.pitch).value_or(is.y()),
                           valueOf(g.yaw).value_or(is.z())})
              .toRotationMatrix();
    }
    goals.push_back(std::move(goal));
  }
  for (const sim::BodyId body : reach_->hold) {
    const Vector3d at = s.bodyPosition(body);
    goals.push_back({.of = {.points = {{body}}},
                     .x = at.x(),
                     .y = at.y(),
                     .z = at.z(),
                     .attitude = s.bodyRotation(body)});
  }
  const sim::State pose =
      solver_.solve(goals, {s.time(), VectorXd(s.q()), VectorXd(s.v())}, wanted);
  for (const int joint : reach_->joints) target.q[joint] = pose.q[model_->joints()[joint].q];
}

}  // namespace traceur::skill
