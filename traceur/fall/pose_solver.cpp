#include "traceur/fall/pose_solver.h"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <numbers>

namespace traceur::fall {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weights of the way from where it begins, one after another: drawn in step by step, the search
/// ends at the nearest of the many solutions [ours].
constexpr double kNearness[] = {1e-1, 1e-2, 1e-3};
constexpr double kDepth = 10;

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
  const double sign = body_->setup().sign();
  const int n = 3 + static_cast<int>(joints_.size());
  const Eigen::Quaterniond attitude(from.q[3], from.q[4], from.q[5], from.q[6]);

  // x: the root's place in the plane in units of the height, its turn towards the fall, the angles.
  const auto pose_of = [&](const VectorXd& x) {
    sim::State pose = stance_;  // for the joints that are not moved
    pose.q[0] = sign * x[0] * height_;
    pose.q[2] = x[1] * height_;
    const Eigen::Quaterniond turned =
        Eigen::AngleAxisd(sign * x[2], sim::Vector3d::UnitY()) * attitude;
    pose.q.segment<4>(3) << turned.w(), turned.x(), turned.y(), turned.z();
    for (size_t i = 0; i < joints_.size(); ++i) {
      pose.q[model.joint(joints_[i].name).q] = x[3 + i];
      if (!joints_[i].other.empty()) {
        pose.q[model.joint(joints_[i].other).q] = joints_[i].sign * x[3 + i];
      }
    }
    return pose;
  };

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
  world_.place(pose_of(x));
  const Vector2d pivot = body_->node(world_.snapshot(), goals.front().node) - goals.front().place;
  x[0] = -pivot.x() / height_;
  x[1] = -pivot.y() / height_;
  const VectorXd begin = x;

  sim::Matrix3Xd J(3, model.nv());
  MatrixXd along(model.nv(), n);  // dv/dx
  double terms = 0;
  double nearness = 0;
  const auto cost = [&](const std::vector<double>& at, std::vector<double>& gradient) {
    const VectorXd now = Eigen::Map<const VectorXd>(at.data(), n);
    world_.place(pose_of(now));
    const sim::Snapshot& s = world_.snapshot();
    along.setZero();
    along(0, 0) = sign * height_;
    along(2, 1) = height_;
    along.block<3, 1>(3, 2) =
        s.bodyRotation(model.root()).transpose() * (sign * sim::Vector3d::UnitY());
    for (size_t i = 0; i < joints_.size(); ++i) {
      along(model.joint(joints_[i].name).v, 3 + i) = 1;
      if (!joints_[i].other.empty()) {
        along(model.joint(joints_[i].other).v, 3 + i) = joints_[i].sign;
      }
    }
    VectorXd slope = VectorXd::Zero(n);
    double value = 0;
    for (const Goal& goal : goals) {
      const Vector2d off = (body_->node(s, goal.node) - goal.place) / height_;
      value += goal.weight * off.squaredNorm();
      const auto& names = body_->setup().graph.nodes[goal.node].points;
      for (const std::string& name : names) {
        const sim::ContactPoint& p = model.robot()->contacts.at(name);
        J.setZero();
        s.pointJacobian(model.body(p.body), p.p_BP, J);
        slope += 2 * goal.weight / height_ / static_cast<double>(names.size()) *
                 (along.transpose() * (sign * off.x() * J.row(0) + off.y() * J.row(2)).transpose());
      }
    }
    const Vector2d off = (body_->com(s) - com) / height_;
    value += off.squaredNorm();
    J.setZero();
    s.comJacobian(J);
    slope += 2 / height_ *
             (along.transpose() * (sign * off.x() * J.row(0) + off.y() * J.row(2)).transpose());
    terms = value;
    for (const sim::ContactPoint& p : points_) {
      const sim::BodyId body = model.body(p.body);
      const double depth = -(s.bodyPosition(body) + s.bodyRotation(body) * p.p_BP).z() / height_;
      if (!(depth > 0)) continue;
      value += kDepth * depth * depth;
      J.setZero();
      s.pointJacobian(body, p.p_BP, J);
      slope -= 2 * kDepth * depth / height_ * (along.transpose() * J.row(2).transpose());
    }
    const VectorXd away = (now - begin).tail(n - 3);
    value += nearness * away.squaredNorm();
    slope.tail(n - 3) += 2 * nearness * away;
    if (!gradient.empty()) Eigen::Map<VectorXd>(gradient.data(), n) = slope;
    return value;
  };

  nlopt::opt search(nlopt::LD_SLSQP, n);
  search.set_lower_bounds({lower.data(), lower.data() + n});
  search.set_upper_bounds({upper.data(), upper.data() + n});
  using Cost = decltype(cost);
  search.set_min_objective([](const std::vector<double>& at, std::vector<double>& gradient,
                              void* f) { return (*static_cast<Cost*>(f))(at, gradient); },
                           const_cast<void*>(static_cast<const void*>(&cost)));
  search.set_ftol_rel(1e-6);
  search.set_maxeval(300);
  std::vector<double> at(x.data(), x.data() + n);
  double least = 0;
  for (const double weight : kNearness) {
    nearness = weight;
    try {
      search.optimize(at, least);
    } catch (const nlopt::roundoff_limited&) {  // as near as it gets
    }
  }
  std::vector<double> none;
  cost(at, none);
  if (error) *error = std::sqrt(terms) * height_;
  return pose_of(Eigen::Map<const VectorXd>(at.data(), n));
}

}  // namespace traceur::fall
