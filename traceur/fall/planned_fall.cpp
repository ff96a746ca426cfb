#include "traceur/fall/planned_fall.h"

#include <algorithm>
#include <cmath>

namespace traceur::fall {
namespace {

using Eigen::VectorXd;

/// The support's limit, in weights [ours].
constexpr double kLift = 1.5;

}  // namespace

PlannedFall::PlannedFall(const FallContext& context)
    : context_(context),
      body_(&context.body),
      model_(context.body.model()),
      tracking_(&context.falls.tracking) {}

std::vector<std::string> PlannedFall::phases() const {
  std::vector<std::string> names;
  for (int i = 0; i <= made_; ++i) names.push_back("contact " + std::to_string(i + 1));
  return names;
}

void PlannedFall::begin(const motion::Moment& m, const control::JointTarget& /*held*/) {
  motion_ = {};
  stage_ = 0;
  made_ = node_ = 0;
  made_nodes_ = {0};
  way_ = {};
  noticed_ = begun_ = asked_ = m.s.time();
  target_ = control::targetOf(*model_, context_.stance);
  ask(m.s);
}

void PlannedFall::update(const motion::Moment& m) {
  const sim::Snapshot& s = m.s;
  if (!resting()) {
    const FallMotion::Stage& stage = motion_.stages[stage_];
    const double late = std::max(tracking_->least_wait, tracking_->late * stage.duration);
    const bool touched = touches(s, stage);
    if (!touched && s.time() - begun_ <= stage.duration + late) return;
    if (touched) {
      node_ = stage.node;
      made_nodes_.push_back(node_);
    }
    ++stage_;
    ++made_;
    if (!(touched && ask(s))) enter(s.time());
  } else if (s.time() - asked_ > tracking_->again && falling(s)) {
    asked_ = s.time();
    ask(s);
  }
}

void PlannedFall::command(const motion::Moment& m, motion::Senses& /*senses*/,
                          control::Command& c) {
  if (!way_.empty()) target_ = way_.at(m.s.time() - begun_);
  c.target = target_;
  const double quick = body_->setup().quick.stiffness;
  double stiffness = 1;
  double damping = 1;
  if (resting() && !waiting()) {
    stiffness = tracking_->rest_stiffness.value_or(quick);
    damping = tracking_->rest_damping;
  } else if (!waiting()) {
    stiffness = quick;
    damping = tracking_->damping;
  }
  c.stiffness.setConstant(target_.q.size(), stiffness);
  c.damping.setConstant(target_.q.size(), damping);
  // With PD control that holds against the support, Atlas's falls cost a fifth more.
  c.expected = false;
  c.forces.clear();
  if (tracking_->support > 0 && !resting()) addSupport(m.s, c.forces);
}

void PlannedFall::addSupport(const sim::Snapshot& s,
                             std::vector<control::VirtualForce>& forces) const {
  const PendulumState p = body_->pendulum(s, node_);
  const double g = model_->gravity();
  const double weight = model_->mass() * g;
  const double force =
      model_->mass() * (g * std::cos(p.theta) - p.r * p.theta_rate * p.theta_rate +
                        (motion_.stages[stage_].rod_rate - p.r_rate) / tracking_->rod_time);
  const auto& names = body_->setup().graph.nodes[node_].points;
  sim::Vector3d pivot = sim::Vector3d::Zero();
  for (const std::string& name : names) pivot += body_->point(s, name);
  const sim::Vector3d rod = s.com() - pivot / static_cast<double>(names.size());
  // The ground does not pull, and motors that could lift it faster than this there are none.
  const sim::Vector3d f =
      tracking_->support * std::clamp(force, 0.0, kLift * weight) * rod.normalized();
  forces.push_back({.f = f, .at_com = true});
  for (const std::string& name : names) {
    const sim::ContactPoint& at = model_->robot()->contacts.at(name);
    forces.push_back({.body = model_->body(at.body),
                      .p_BP = at.p_BP,
                      .f = -f / static_cast<double>(names.size())});
  }
}

/// Takes up what the plan says from here, if it says anything.
bool PlannedFall::ask(const sim::Snapshot& s) {
  const FallState start{node_, s.time() - noticed_, body_->pendulum(s, node_)};
  std::vector<PoseSolver::Goal> made;
  for (const int node : made_nodes_) {
    if (node != node_) made.push_back({node, body_->node(s, node) - body_->node(s, node_)});
  }
  std::optional<FallMotion> motion = context_.plan(start, made, {s.time(), s.q(), s.v()});
  if (!motion || (motion->stages.empty() && motion->rest.q.size() == 0)) return false;
  motion_ = std::move(*motion);
  stage_ = 0;
  enter(s.time());
  return true;
}

void PlannedFall::enter(double time) {
  begun_ = asked_ = time;
  if (resting()) {
    if (motion_.rest.q.size() == 0) return;
    way_ = {target_, {control::targetOf(*model_, motion_.rest)}, tracking_->rest};
    return;
  }
  std::vector<control::JointTarget> via;
  for (const sim::State& pose : motion_.stages[stage_].poses) {
    via.push_back(control::targetOf(*model_, pose));
  }
  way_ = {};
  if (via.empty()) return;
  way_ = {target_, std::move(via), tracking_->ramp * motion_.stages[stage_].duration};
}

/// Whether the extrapolated COM is past the node it should turn about.
bool PlannedFall::falling(const sim::Snapshot& s) const {
  const Vector2d com = body_->com(s);
  return com.x() + body_->comVelocity(s).x() * std::sqrt(com.y() / model_->gravity()) >
         body_->node(s, node_).x();
}

bool PlannedFall::touches(const sim::Snapshot& s, const FallMotion::Stage& stage) const {
  const auto contacts = s.robotContacts();
  return std::any_of(contacts.begin(), contacts.end(), [&](const sim::RobotContact& c) {
    const std::string part = body_->partAt(s, c.body, c.p_WC);
    return std::find(stage.points.begin(), stage.points.end(), part) != stage.points.end();
  });
}

}  // namespace traceur::fall
