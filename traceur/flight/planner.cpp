#include "traceur/flight/planner.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace traceur::flight {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
/// Of the heights of the COM by somersault.
constexpr int kHeights = 24;
/// Durations of a pose that are looked at before the best is searched around [ours].
constexpr int kCoarse = 10;
/// Golden section steps; the interval shrinks to 2 % [ours].
constexpr int kFine = 8;

}  // namespace

double fallTime(double height, double velocity, double gravity) {
  const double root = velocity * velocity + 2 * gravity * height;
  return root > 0 ? std::max(0.0, (velocity + std::sqrt(root)) / gravity) : 0;
}

struct FlightPlanner::Flight {
  Vector3d L;
  double time = 0;    // until touch-down [s]
  Vector3d velocity;  // then
};

FlightPlanner::FlightPlanner(std::shared_ptr<const sim::Model> model, std::vector<FlightPose> poses)
    : model_(std::move(model)), poses_(std::move(poses)), world_(model_) {
  for (const FlightPose& pose : poses_) shapes_.push_back(shapeOf(pose.joints));
}

FlightPlanner::Shape FlightPlanner::shapeOf(const sim::Snapshot& s) const {
  const auto& joints = model_->joints();
  const Matrix3d R = s.bodyRotation(model_->root());
  Eigen::Matrix3Xd all(3, model_->nv());
  s.angularMomentumJacobian(all);
  Shape shape;
  shape.joints.resize(static_cast<Eigen::Index>(joints.size()));
  shape.momentum.resize(3, shape.joints.size());
  for (Eigen::Index i = 0; i < shape.joints.size(); ++i) {
    const sim::Joint& joint = joints[static_cast<size_t>(i)];
    shape.joints[i] = s.q()[joint.q];
    shape.momentum.col(i) = R.transpose() * all.col(joint.v);
  }
  shape.inertia = R.transpose() * s.inertia() * R;
  return shape;
}

FlightPlanner::Shape FlightPlanner::shapeOf(const VectorXd& joints) {
  flightPose(world_, joints);
  return shapeOf(world_.snapshot());
}

PoseChange FlightPlanner::change(const Shape& from, const Shape& to) {
  const VectorXd way = to.joints - from.joints;
  const Shape middle = shapeOf(VectorXd(from.joints + way / 2));
  const auto at = [&](const Shape& shape) { return Changing{shape.inertia, shape.momentum * way}; };
  return {at(from), at(middle), at(to)};
}

void FlightPlanner::landIn(const VectorXd& joints) {
  if (landing_.joints.size() == joints.size() && landing_.joints == joints) return;
  landing_ = flightPose(world_, joints);
  landing_shape_ = shapeOf(joints);
  to_landing_.clear();
  for (const Shape& shape : shapes_) to_landing_.push_back(change(shape, landing_shape_));
  sim::Pose pose;
  for (size_t i = 0; i < model_->joints().size(); ++i) {
    pose.joints[model_->joints()[i].name] = joints[static_cast<Eigen::Index>(i)];
  }
  heights_.clear();
  for (int k = 0; k <= kHeights; ++k) {
    const double somersault = kTurn * k / kHeights;
    pose.root_rpy = {0, somersault, 0};
    world_.place(model_->stateOf(pose));
    heights_.emplace_back(somersault, world_.snapshot().com().z());
  }
}

double FlightPlanner::height(double somersault) {
  const double at = (somersault / kTurn - std::floor(somersault / kTurn)) * kHeights;
  const auto k = static_cast<size_t>(std::min<double>(at, kHeights - 1));
  return std::lerp(heights_[k].second, heights_[k + 1].second, at - static_cast<double>(k));
}

TouchDown FlightPlanner::arrive(const Flight& f, const Matrix3d& R) const {
  TouchDown t;
  t.time = f.time;
  t.velocity = f.velocity;
  t.spin = R * (landing_.inertia.inverse() * (R.transpose() * f.L));
  t.turn = sim::Turn::of(R);
  return t;
}

FlightPlan FlightPlanner::plan(const sim::Snapshot& s, const Wanted& wanted, double ground,
                               std::optional<int> only) {
  const Matrix3d R = s.bodyRotation(model_->root());
  const Shape shape = shapeOf(s);
  Flight f;
  f.L = s.angularMomentum();
  f.velocity = s.comVelocity();
  // When depends on how, and how on when: the wish at the last guess of the time, twice.
  const double rise = s.comVelocity().z();
  double somersault = 0;
  for (int k = 0; k < 2; ++k) {
    f.time = fallTime(s.com().z() - ground - height(somersault), rise, model_->gravity());
    f.velocity.z() = rise - model_->gravity() * f.time;
    somersault = wanted(arrive(f, R));
  }

  const auto cost_of = [&](const TouchDown& t) {
    const double off = std::remainder(t.turn.somersault - wanted(t), kTurn);
    return off * off + t.turn.tilt * t.turn.tilt;
  };
  FlightPlan best;
  best.cost = std::numeric_limits<double>::infinity();
  const auto consider = [&](int pose, double hold, const Matrix3d& then) {
    const TouchDown t = arrive(f, then);
    const double cost = cost_of(t);
    if (cost < best.cost) best = {pose, hold, t, cost};
    return cost;
  };
  const auto land = [&](const Matrix3d& from, const PoseChange& by, double in) {
    const double blend = std::min(kSwitch, in);
    return turned(turned(from, f.L, by, blend), f.L, landing_.inertia, in - blend);
  };
  const double longest = f.time - kLag - 2 * kSwitch;
  const Matrix3d soon = turned(R, f.L, shape.inertia, std::min(kLag, f.time));
  const double left = f.time - kLag;
  if (!only || *only < 0 || longest <= 0) {
    consider(-1, 0, land(soon, change(shape, landing_shape_), left));
  }
  if (longest <= 0) return best;
  for (int p = 0; p < static_cast<int>(poses_.size()); ++p) {
    if (only && *only != p) continue;
    const auto index = static_cast<size_t>(p);
    const Matrix3d& I = poses_[index].inertia;
    const auto at = [&](double hold, const Matrix3d& held) {
      return consider(p, kSwitch + hold, land(held, to_landing_[index], left - kSwitch - hold));
    };
    // Spins of several turns have several minima: a grid, then golden section about its best.
    const double every = longest / kCoarse;
    std::array<Matrix3d, kCoarse + 1> held;
    int least = 0;
    double least_cost = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kCoarse; ++k) {
      const auto i = static_cast<size_t>(k);
      held[i] = k > 0 ? turned(held[i - 1], f.L, I, every)
                      : turned(soon, f.L, change(shape, shapes_[index]), kSwitch);
      const double cost = at(every * k, held[i]);
      if (cost < least_cost) {
        least_cost = cost;
        least = k;
      }
    }
    const int before = std::max(0, least - 1);
    const auto between = [&](double hold) {
      return at(hold, turned(held[static_cast<size_t>(before)], f.L, I, hold - every * before));
    };
    double a = every * before;
    double b = every * std::min(kCoarse, least + 1);
    static constexpr double kGolden = 0.6180339887498949;
    double x = b - kGolden * (b - a);
    double y = a + kGolden * (b - a);
    double fx = between(x);
    double fy = between(y);
    for (int k = 0; k < kFine; ++k) {
      if (fx < fy) {
        b = y;
        y = x;
        fy = fx;
        x = b - kGolden * (b - a);
        fx = between(x);
      } else {
        a = x;
        x = y;
        fx = fy;
        y = a + kGolden * (b - a);
        fy = between(y);
      }
    }
  }
  return best;
}

}  // namespace traceur::flight
