#include "traceur/skill/bound.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace traceur::skill {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

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

BoundFlight::BoundFlight(const Flight& flight, const std::shared_ptr<const sim::Model>& model,
                         Places& places)
    : places_(&places),
      root_(model->root()),
      gravity_(model->gravity()),
      planner_(model, flight.poses),
      somersault_(flight.somersault, places.in(Scope::kRunning)),
      ground_(flight.ground, places.in(Scope::kRunning)),
      counting_(places.in(Scope::kRunning)("somersault.root")) {}

void BoundFlight::begin(const VectorXd& landing) {
  landing_ = landing;
  planner_.landIn(landing);
  target_ = kNone;
}

/// Whether something else than gravity has moved the body since it was planned, or turned it since
/// it was seen.
bool BoundFlight::disturbed(const sim::Snapshot& s, double since) const {
  // More than integration errs by, less than a push that matters leaves [ours].
  static constexpr double kVelocity = 0.05;  // [m/s]
  static constexpr double kPlace = 0.03;     // [m]
  static constexpr double kSpin = 0.03;      // about an axis with the trace of the inertia [rad/s]
  static constexpr double kTurning = 25;     // faster than limbs turn the root [rad/s]
  const double t = s.time() - planned_;
  const Vector3d g(0, 0, gravity_);
  if ((s.comVelocity() - (velocity_ - t * g)).norm() > kVelocity) return true;
  if ((s.com() - (com_ + t * velocity_ - t * t / 2 * g)).norm() > kPlace) return true;
  const sim::Matrix3d turn = turned_.transpose() * s.bodyRotation(root_);
  if (Eigen::AngleAxisd(turn).angle() > kTurning * since) return true;
  return (s.angularMomentum() - momentum_).norm() > kSpin * planner_.landing().inertia.trace();
}

void BoundFlight::plan(const sim::Snapshot& s, std::optional<int> only) {
  const double ground = ground_.value();
  plan_ = planner_.plan(
      s,
      [&](const flight::TouchDown& t) {
        places_->foresee(t);
        if (places_->values_foresee) places_->follow();
        const double wanted = somersault_.value();
        return std::isfinite(wanted) ? wanted : 0;
      },
      std::isfinite(ground) ? ground : 0, only);
  planned_ = s.time();
  com_ = s.com();
  velocity_ = s.comVelocity();
  momentum_ = s.angularMomentum();
}

/// The touch-down with its somersault counted on from that of now, to the nearest.
flight::TouchDown BoundFlight::counted() const {
  flight::TouchDown t = plan_.touch_down;
  t.turn.somersault = *counting_ + std::remainder(t.turn.somersault - *counting_, kTurn);
  return t;
}

const VectorXd* BoundFlight::update(const sim::Snapshot& s) {
  static constexpr double kEps = 1e-9;
  const bool first = target_ == kNone;
  if (first || s.time() - seen_ >= kReplan - kEps) {
    const bool meddled = !first && disturbed(s, s.time() - seen_);
    seen_ = s.time();
    turned_ = s.bodyRotation(root_);
    const double left = plan_.touch_down.time - (s.time() - planned_);
    if (first || meddled || (left > kSettle && s.time() - chosen_ >= kChoose - kEps)) {
      plan(s, {});
      chosen_ = s.time();
    } else if (left > kSettle) {
      plan(s, target_);
    }
  }
  const double since = s.time() - planned_;
  places_->foresee(counted());
  places_->touch_down[0] = std::max(0.0, plan_.touch_down.time - since);
  if (places_->values_foresee) places_->follow();
  const int target = plan_.pose >= 0 && since < plan_.hold - kEps ? plan_.pose : -1;
  if (target == target_) return nullptr;
  target_ = target;
  return target < 0 ? &landing_ : &planner_.poses()[static_cast<size_t>(target)].joints;
}

}  // namespace traceur::skill
