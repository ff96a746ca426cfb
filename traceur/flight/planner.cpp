#include "traceur/flight/planner.h"

#include <Eigen/LU>
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
  Matrix3d R;  // of the root now
  Vector3d L;
  Matrix3d inertia;   // now, root's axes
  double time = 0;    // until touch-down [s]
  Vector3d velocity;  // then
};

FlightPlanner::FlightPlanner(std::shared_ptr<const sim::Model> model, std::vector<FlightPose> poses)
    : model_(std::move(model)), poses_(std::move(poses)), world_(model_) {}

void FlightPlanner::landIn(const VectorXd& joints) {
  if (landing_.joints.size() == joints.size() && landing_.joints == joints) return;
  landing_ = flightPose(world_, joints);
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
  Flight f;
  f.R = s.bodyRotation(model_->root());
  f.L = s.angularMomentum();
  f.inertia = f.R.transpose() * s.inertia() * f.R;
  f.velocity = s.comVelocity();
  // When depends on how, and how on when: the wish at the last guess of the time, twice.
  const double rise = s.comVelocity().z();
  double somersault = 0;
  for (int k = 0; k < 2; ++k) {
    f.time = fallTime(s.com().z() - ground - height(somersault), rise, model_->gravity());
    f.velocity.z() = rise - model_->gravity() * f.time;
    somersault = wanted(arrive(f, f.R));
  }

  const auto cost_of = [&](const TouchDown& t) {
    const double off = std::remainder(t.turn.somersault - wanted(t), kTurn);
    return off * off + t.turn.tilt * t.turn.tilt;
  };
  FlightPlan best;
  best.cost = std::numeric_limits<double>::infinity();
  const auto consider = [&](int pose, double hold, const Matrix3d& R) {
    const TouchDown t = arrive(f, R);
    const double cost = cost_of(t);
    if (cost < best.cost) best = {pose, hold, t, cost};
    return cost;
  };
  const auto land = [&](const Matrix3d& R, const Matrix3d& inertia, double left) {
    const double blend = std::min(kSwitch, left);
    return turned(turned(R, f.L, inertia, landing_.inertia, blend), f.L, landing_.inertia,
                  landing_.inertia, left - blend);
  };
  if (!only || *only < 0) consider(-1, 0, land(f.R, f.inertia, f.time));
  const double longest = f.time - 2 * kSwitch;
  if (longest <= 0) {
    if (best.pose < 0 && std::isfinite(best.cost)) return best;
    consider(-1, 0, land(f.R, f.inertia, f.time));
    return best;
  }
  for (int p = 0; p < static_cast<int>(poses_.size()); ++p) {
    if (only && *only != p) continue;
    const Matrix3d& I = poses_[static_cast<size_t>(p)].inertia;
    const Matrix3d taken = turned(f.R, f.L, f.inertia, I, kSwitch);
    const auto at = [&](double hold) {
      return consider(p, kSwitch + hold,
                      land(turned(taken, f.L, I, I, hold), I, f.time - kSwitch - hold));
    };
    // Spins of several turns have several minima: a grid, then golden section about its best.
    int least = 0;
    double least_cost = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kCoarse; ++k) {
      const double cost = at(longest * k / kCoarse);
      if (cost < least_cost) {
        least_cost = cost;
        least = k;
      }
    }
    double a = longest * std::max(0, least - 1) / kCoarse;
    double b = longest * std::min(kCoarse, least + 1) / kCoarse;
    static constexpr double kGolden = 0.6180339887498949;
    double x = b - kGolden * (b - a);
    double y = a + kGolden * (b - a);
    double fx = at(x);
    double fy = at(y);
    for (int k = 0; k < kFine; ++k) {
      if (fx < fy) {
        b = y;
        y = x;
        fy = fx;
        x = b - kGolden * (b - a);
        fx = at(x);
      } else {
        a = x;
        x = y;
        fx = fy;
        y = a + kGolden * (b - a);
        fy = at(y);
      }
    }
  }
  return best;
}

}  // namespace traceur::flight
