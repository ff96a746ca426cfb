#include "traceur/fall/sagittal_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "traceur/core/error.h"

namespace traceur::fall {
namespace {

/// Whether a contact point moves with a joint.
bool hangsOn(const sim::Snapshot& s, const sim::Model& model, const sim::ContactPoint& point,
             const std::string& joint) {
  sim::Matrix3Xd J = sim::Matrix3Xd::Zero(3, model.nv());
  s.pointJacobian(model.body(point.body), point.p_BP, J);
  return J.col(model.joint(joint).v).norm() > 0;
}

}  // namespace

double wrapped(double angle) {
  angle = std::remainder(angle, 2 * std::numbers::pi);
  return angle <= -std::numbers::pi ? angle + 2 * std::numbers::pi : angle;
}

SagittalBody::SagittalBody(std::shared_ptr<const sim::Model> model, FallSetup setup)
    : model_(std::move(model)), setup_(std::move(setup)), sign_(setup_.sign()) {}

sim::Vector3d SagittalBody::point(const sim::Snapshot& s, const std::string& name) const {
  const sim::ContactPoint& point = model_->robot()->contacts.at(name);
  const sim::BodyId body = model_->body(point.body);
  return s.bodyPosition(body) + s.bodyRotation(body) * point.p_BP;
}

std::string SagittalBody::partAt(const sim::Snapshot& s, sim::BodyId body,
                                 const sim::Vector3d& p_W) const {
  const sim::Vector3d at = s.bodyRotation(body).transpose() * (p_W - s.bodyPosition(body));
  const std::string name = model_->bodyName(body);
  const std::string* nearest = &name;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [point, place] : model_->robot()->contacts) {
    const double d = (place.p_BP - at).norm();
    if (place.body != name || d >= least) continue;
    least = d;
    nearest = &point;
  }
  return *nearest;
}

Vector2d SagittalBody::node(const sim::Snapshot& s, int node) const {
  const std::vector<std::string>& points = setup_.graph.nodes[node].points;
  Vector2d mean = Vector2d::Zero();
  for (const std::string& name : points) mean += inPlane(point(s, name));
  return mean / static_cast<double>(points.size());
}

PendulumState SagittalBody::pendulum(const sim::Snapshot& s, int node) const {
  return PendulumState::of(com(s) - this->node(s, node), comVelocity(s));
}

double SagittalBody::stopperAngle(const sim::Snapshot& s, int from, int to) const {
  const Vector2d rod = com(s) - node(s, from);
  const Vector2d stopper = node(s, to) - com(s);
  return wrapped(std::atan2(stopper.x(), stopper.y()) - std::atan2(rod.x(), rod.y()));
}

double SagittalBody::inertia(const sim::State& state) const {
  // A unit rate about the world's y: the angular momentum about the COM is the inertia.
  sim::World world(model_);
  sim::State turning = state;
  turning.v.setZero();
  world.reset(turning);
  const sim::Matrix3d R = world.snapshot().bodyRotation(model_->root());
  turning.v.segment<3>(3) = R.transpose() * sim::Vector3d::UnitY();
  world.reset(turning);
  return world.snapshot().angularMomentum().y();
}

std::vector<MovedJoint> movedJoints(const SagittalBody& body, const FallRobot& falls) {
  const sim::Model& model = *body.model();
  const sim::World world(body.model());
  std::vector<MovedJoint> moved;
  const auto add = [&](const std::string& name, const std::string& other, double sign) {
    const sim::JointLimit& limit = model.joint(name).limit;
    MovedJoint joint{name, other, sign, limit.min, limit.max};
    if (const auto range = falls.ranges.find(name); range != falls.ranges.end()) {
      joint.min = std::max(joint.min, range->second.first);
      joint.max = std::min(joint.max, range->second.second);
      if (!(joint.min < joint.max)) {
        throw InputError(
            fmt::format("falls.toml of {}: the range of {}, {:g} to {:g} rad, is outside of its "
                        "limits, {:g} to "
                        "{:g} rad",
                        falls.robot->name, name, range->second.first, range->second.second,
                        limit.min, limit.max));
      }
    }
    if (!(std::isfinite(joint.min) && std::isfinite(joint.max))) {
      throw InputError(fmt::format(
          "falls.toml of {}: the joint {} has no limits: expected some in [ranges], or in [limits] "
          "of its robot.toml",
          falls.robot->name, name));
    }
    moved.push_back(std::move(joint));
  };
  for (const std::string& word : falls.joints) {
    const std::vector<sim::SignedJoint> joints = falls.robot->jointsNamed(word);
    if (joints.size() == 1) {
      add(joints[0].joint, "", 1);
      continue;
    }
    bool alike = true;
    for (const ContactNode& node : body.setup().graph.nodes) {
      int left = 0;
      int right = 0;
      for (const std::string& point : node.points) {
        const sim::ContactPoint& at = falls.robot->contacts.at(point);
        left += hangsOn(world.snapshot(), model, at, joints[0].joint);
        right += hangsOn(world.snapshot(), model, at, joints[1].joint);
      }
      alike = alike && left == right;
    }
    if (alike) {
      add(joints[0].joint, joints[1].joint, joints[1].sign);
    } else {
      for (const sim::SignedJoint& j : joints) add(j.joint, "", 1);
    }
  }
  return moved;
}

}  // namespace traceur::fall
