#include "traceur/fall/pose_solver.h"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <numbers>
#include <span>

namespace traceur::fall {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weights of the way from where it begins, one after another: drawn in step by step, the search
/// ends at the nearest of the many solutions [ours].
constexpr double kNearness[] = {1e-1, 1e-2, 1e-3};
constexpr double kDepth = 10;

/// The cost of a pose and its slope, over x: the root's place in the plane in units of the height,
/// its turn towards the fall, and the angles.
class PoseCost {
 public:
  PoseCost(const SagittalBody& body, sim::World& world, const std::vector<MovedJoint>& joints,
           const std::vector<sim::ContactPoint>& points, double height, const sim::State& stance,
           const sim::State& from)
      : body_(&body),
        model_(body.model().get()),
        world_(&world),
        joints_(&joints),
        points_(&points),
        height_(height),
        sign_(body.setup().sign()),
        stance_(&stance),
        attitude_(from.q[3], from.q[4], from.q[5], from.q[6]),
        J_(3, model_->nv()) {}

  int size() const { return 3 + static_cast<int>(joints_->size()); }

  sim::State pose(const VectorXd& x) const {
    sim::State pose = *stance_;  // for the joints that are not moved
    pose.q[0] = sign_ * x[0] * height_;
    pose.q[2] = x[1] * height_;
    const Eigen::Quaterniond turned =
        Eigen::AngleAxisd(sign_ * x[2], sim::Vector3d::UnitY()) * attitude_;
    pose.q.segment<4>(3) << turned.w(), turned.x(), turned.y(), turned.z();
    for (size_t i = 0; i < joints_->size(); ++i) {
      const MovedJoint& joint = (*joints_)[i];
      pose.q[model_->joint(joint.name).q] = x[3 + i];
      if (!joint.other.empty()) pose.q[model_->joint(joint.other).q] = joint.sign * x[3 + i];
    }
    return pose;
  }

  const sim::Snapshot& at(const VectorXd& x) const {
    world_->place(pose(x));
    return world_->snapshot();
  }

  /// @param gradient  filled unless it is empty
  double operator()(const std::vector<double>& x, std::vector<double>& gradient) {
    const VectorXd now = Eigen::Map<const VectorXd>(x.data(), size());
    const sim::Snapshot& s = at(now);
    const MatrixXd along = moves(s);
    VectorXd slope = VectorXd::Zero(size());
    double value = goalsCost(s, along, slope);
    terms = value;
    addDepths(s, along, value, slope);
    const VectorXd away = (now - begin).tail(size() - 3);
    value += nearness * away.squaredNorm();
    slope.tail(size() - 3) += 2 * nearness * away;
    if (!gradient.empty()) Eigen::Map<VectorXd>(gradient.data(), size()) = slope;
    return value;
  }

  std::span<const PoseSolver::Goal> goals;
  Vector2d com;
  VectorXd begin;
  double nearness = 0;
  double terms = 0;  // of the last pose: the goals' alone

 private:
  /// dv/dx, (nv x n).
  MatrixXd moves(const sim::Snapshot& s) const {
    MatrixXd along = MatrixXd::Zero(model_->nv(), size());
    along(0, 0) = sign_ * height_;
    along(2, 1) = height_;
    along.block<3, 1>(3, 2) =
        s.bodyRotation(model_->root()).transpose() * (sign_ * sim::Vector3d::UnitY());
    for (size_t i = 0; i < joints_->size(); ++i) {
      const MovedJoint& joint = (*joints_)[i];
      along(model_->joint(joint.name).v, 3 + i) = 1;
      if (!joint.other.empty()) along(model_->joint(joint.other).v, 3 + i) = joint.sign;
    }
    return along;
  }

  double goalsCost(const sim::Snapshot& s, const MatrixXd& along, VectorXd& slope) {
    double value = 0;
    for (const PoseSolver::Goal& goal : goals) {
      const Vector2d off = (body_->node(s, goal.node) - goal.place) / height_;
      value += goal.weight * off.squaredNorm();
      const auto& names = body_->setup().graph.nodes[goal.node].points;
      for (const std::string& name : names) {
        const sim::ContactPoint& p = model_->robot()->contacts.at(name);
        J_.setZero();
        s.pointJacobian(model_->body(p.body), p.p_BP, J_);
        slope +=
            2 * goal.weight / height_ / static_cast<double>(names.size()) *
            (along.transpose() * (sign_ * off.x() * J_.row(0) + off.y() * J_.row(2)).transpose());
      }
    }
    const Vector2d off = (body_->com(s) - com) / height_;
    value += off.squaredNorm();
    J_.setZero();
    s.comJacobian(J_);
    slope += 2 / height_ *
             (along.transpose() * (sign_ * off.x() * J_.row(0) + off.y() * J_.row(2)).transpose());
    return value;
  }

  void addDepths(const sim::Snapshot& s, const MatrixXd& along, double& value, VectorXd& slope) {
    for (const sim::ContactPoint& p : *points_) {
      const sim::BodyId body = model_->body(p.body);
      const double depth = -(s.bodyPosition(body) + s.bodyRotation(body) * p.p_BP).z() / height_;
      if (!(depth > 0)) continue;
      value += kDepth * depth * depth;
      J_.setZero();
      s.pointJacobian(body, p.p_BP, J_);
      slope -= 2 * kDepth * depth / height_ * (along.transpose() * J_.row(2).transpose());
    }
  }

  const SagittalBody* body_;
  const sim::Model* model_;
  sim::World* world_;
  const std::vector<MovedJoint>* joints_;
  const std::vector<sim::ContactPoint>* points_;
  double height_;
  double sign_;
  const sim::State* stance_;
  Eigen::Quaterniond attitude_;
  sim::Matrix3Xd J_;
};

}  // namespace

PoseSolver::PoseSolver(const SagittalBody& body, const FallRobot& falls)
    : body_(&body), world_(body.model()), joints_(movedJoints(body, falls)) {
  for (const auto& [name, point] : falls.robot->contacts) points_.push_back(point);
  stance_ = body.model()->stateOf(falls.robot->poses.at(body.setup().stance));
  world_.place(stance_);
  height_ = body.com(world_.snapshot()).y();
}

sim::State PoseSolver::solve(const std::vector<Goal>& goals, const Vector2d& com,
                             const sim::State& from, double* error) {
  const sim::Model& model = *body_->model();
  PoseCost cost(*body_, world_, joints_, points_, height_, stance_, from);
  const int n = cost.size();
  VectorXd x = VectorXd::Zero(n);
  VectorXd lower(n);
  VectorXd upper(n);
  for (int i = 0; i < 3; ++i) {
    lower[i] = i == 2 ? -2 * std::numbers::pi : -20;
    upper[i] = -lower[i];
  }
  for (size_t i = 0; i < joints_.size(); ++i) {
    lower[3 + i] = joints_[i].min;
    upper[3 + i] = joints_[i].max;
    x[3 + i] = std::clamp(from.q[model.joint(joints_[i].name).q], lower[3 + i], upper[3 + i]);
  }
  // Begins where the pivot is on its place.
  const Vector2d pivot = body_->node(cost.at(x), goals.front().node) - goals.front().place;
  x[0] = -pivot.x() / height_;
  x[1] = -pivot.y() / height_;
  cost.goals = goals;
  cost.com = com;
  cost.begin = x;

  nlopt::opt search(nlopt::LD_SLSQP, n);
  search.set_lower_bounds({lower.data(), lower.data() + n});
  search.set_upper_bounds({upper.data(), upper.data() + n});
  search.set_min_objective([](const std::vector<double>& at, std::vector<double>& gradient,
                              void* f) { return (*static_cast<PoseCost*>(f))(at, gradient); },
                           &cost);
  search.set_ftol_rel(1e-6);
  search.set_maxeval(300);
  std::vector<double> at(x.data(), x.data() + n);
  double least = 0;
  for (const double weight : kNearness) {
    cost.nearness = weight;
    try {
      search.optimize(at, least);
    } catch (const nlopt::roundoff_limited&) {  // as near as it gets
    }
  }
  std::vector<double> none;
  cost(at, none);
  if (error) *error = std::sqrt(cost.terms) * height_;
  return cost.pose(Eigen::Map<const VectorXd>(at.data(), n));
}

}  // namespace traceur::fall
