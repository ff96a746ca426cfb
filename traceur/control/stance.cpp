#include "traceur/control/stance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace traceur::control {
namespace {

using sim::Anatomy;
using sim::BodyId;
using sim::Joint;
using sim::Mirroring;
using sim::Model;
using sim::Snapshot;
using sim::Vector3d;

constexpr double kStiffness = 10;      // of what topples [ours]
constexpr double kFrequency = 25;      // of what is carried [rad/s; ours]
constexpr double kDampingTime = 0.05;  // kd / kp [s]: of both robots under models/

/// Two digits: what is no better known reads better.
double rounded(double x) {
  if (!(x > 0)) return 0;
  const double digits = std::floor(std::log10(x)) - 1;
  const double unit = std::pow(10, std::abs(digits));
  return digits < 0 ? std::round(x * unit) / unit : std::round(x / unit) * unit;
}

/// A part of the robot: its mass and COM.
struct Load {
  double mass = 0;
  Vector3d moment = Vector3d::Zero();  ///< mass times COM
  Vector3d com() const { return moment / mass; }
};

double stiffnessOf(const Snapshot& s, const Model& model, const Joint& joint,
                   const std::vector<BodyId>& feet) {
  const BodyId moved = model.bodyOf(joint);
  const auto outward_feet = std::count_if(feet.begin(), feet.end(),
                                          [&](BodyId foot) { return model.hangsOn(foot, moved); });
  const bool stands_on_it = outward_feet > 0;
  Load load;
  for (int b = 1; b < model.bodies(); ++b) {
    if (!model.isRobot({b}) || model.hangsOn({b}, moved) == stands_on_it) continue;
    load.mass += model.bodyMass({b});
    load.moment += model.bodyMass({b}) * s.bodyCom({b});
  }
  double kp = kFrequency * kFrequency * s.jointInertia(joint);
  if (load.mass > 0 && !joint.slides) {
    const double d = (load.com() - s.jointAnchor(joint)).norm();
    const double legs =
        stands_on_it ? static_cast<double>(feet.size()) / static_cast<double>(outward_feet) : 1;
    kp = std::max(kp, kStiffness * load.mass * model.gravity() * d / legs);
  }
  return kp;
}

/// What bends a leg in the sagittal plane.
struct Bend {
  std::string left;
  std::string right;
  double left_sign = 1;  ///< +1: a positive angle turns what hangs on the joint backwards
  double right_sign = 1;
};

/// Hip, knee and ankle; nothing unless there are just three joints across the plane above the sole.
std::optional<std::array<Bend, 3>> bendsOf(const Snapshot& s, const Model& model,
                                           const Mirroring& mirroring, const Anatomy& anatomy) {
  static constexpr double kParallel = 0.95;  // least cosine [ours: 18 degrees]
  const auto leg = anatomy.limbs.find("left_leg");
  if (leg == anatomy.limbs.end()) return std::nullopt;
  const std::vector<BodyId> feet = feetOf(model, anatomy);
  std::vector<Bend> bends;
  for (const std::string& name : leg->second) {
    const BodyId body = model.body(name);
    for (const Joint& joint : model.joints()) {
      if (model.bodyOf(joint) != body || joint.slides) continue;
      const double cosine = s.jointAxis(joint).dot(mirroring.plane.left);
      if (std::abs(cosine) < kParallel) continue;
      for (const auto& [word, pair] : mirroring.pairs) {
        if (pair.left != joint.name) continue;
        const double sign = cosine > 0 ? 1 : -1;
        bends.push_back({pair.left, pair.right, sign, sign * pair.sign});
      }
    }
    if (std::find(feet.begin(), feet.end(), body) != feet.end()) break;  // toes come after it
  }
  if (bends.size() != 3) return std::nullopt;
  return std::array<Bend, 3>{bends[0], bends[1], bends[2]};
}

sim::Pose poseOf(const std::array<Bend, 3>& bends, const std::array<double, 3>& angles) {
  static constexpr double kDigits = 1e4;
  sim::Pose pose;
  for (size_t i = 0; i < bends.size(); ++i) {
    const double angle = std::round(angles[i] * kDigits) / kDigits;
    pose.joints[bends[i].left] = bends[i].left_sign * angle;
    pose.joints[bends[i].right] = bends[i].right_sign * angle;
  }
  return pose;
}

bool isWithinLimits(const Model& model, const sim::Pose& pose) {
  return std::all_of(pose.joints.begin(), pose.joints.end(), [&](const auto& entry) {
    const sim::JointLimit& limit = model.joint(entry.first).limit;
    return entry.second >= limit.min && entry.second <= limit.max;
  });
}

/// How far the COM is ahead of the middle of the soles' corners [m].
double lead(sim::World& world, const sim::Pose& pose, const Mirroring& mirroring,
            const Anatomy& anatomy) {
  const Model& model = world.model();
  world.place(model.stateOf(pose));
  const Snapshot& s = world.snapshot();
  Vector3d sum = Vector3d::Zero();
  int corners = 0;
  for (const auto& [name, point] : anatomy.contacts) {
    if (!name.ends_with("_outer") && !name.ends_with("_inner")) continue;
    const BodyId body = model.body(point.body);
    sum += s.bodyPosition(body) + s.bodyRotation(body) * point.p_BP;
    ++corners;
  }
  if (corners == 0) return std::numeric_limits<double>::quiet_NaN();
  const Vector3d forward = mirroring.plane.left.cross(Vector3d::UnitZ());
  return forward.dot(s.com() - sum / corners);
}

}  // namespace

std::vector<BodyId> feetOf(const Model& model, const Anatomy& anatomy) {
  std::vector<BodyId> feet;
  const auto group = anatomy.bodies.find("feet");
  if (group == anatomy.bodies.end()) return feet;
  for (const std::string& name : group->second) feet.push_back(model.body(name));
  return feet;
}

std::vector<sim::JointGain> gainsByPhysics(const sim::World& world, const Mirroring& mirroring,
                                           const Anatomy& anatomy, double factor) {
  const Model& model = world.model();
  const std::vector<BodyId> feet = feetOf(model, anatomy);
  std::map<std::string, double> stiffness;
  for (const Joint& j : model.joints()) {
    stiffness[j.name] = stiffnessOf(world.snapshot(), model, j, feet);
  }
  for (const auto& [name, pair] : mirroring.pairs) {
    double& left = stiffness[pair.left];
    double& right = stiffness[pair.right];
    left = right = std::max(left, right);
  }
  std::vector<sim::JointGain> in_order;
  for (const Joint& j : model.joints()) {
    const double kp = rounded(factor * stiffness[j.name]);
    in_order.push_back({kp, rounded(kp * kDampingTime)});
  }
  return in_order;
}

std::optional<sim::Pose> bentPose(sim::World& world, const Mirroring& mirroring,
                                  const Anatomy& anatomy, double bend) {
  const Model& model = world.model();
  world.reset(model.stateOf({}));
  const auto bends = bendsOf(world.snapshot(), model, mirroring, anatomy);
  if (!bends) return std::nullopt;
  // The three turn about one direction: soles stay level if their angles add up to nothing.
  const auto leaning = [&](double lean) {
    return poseOf(*bends, {-bend / 2 + lean, bend, -bend / 2 - lean});
  };
  const auto lead_at = [&](double lean) { return lead(world, leaning(lean), mirroring, anatomy); };
  static constexpr double kMostLean = 0.5;  // [rad; ours]
  double low = -kMostLean;
  double high = kMostLean;
  const double lead_low = lead_at(low);
  if (!(lead_low * lead_at(high) < 0)) return std::nullopt;
  static constexpr int kHalvings = 20;  // 1 rad to 1e-6
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (lead_at(middle) * lead_low > 0 ? low : high) = middle;
  }
  const sim::Pose pose = leaning(low);
  if (!isWithinLimits(model, pose)) return std::nullopt;
  return pose;
}

Standing hold(const std::shared_ptr<const Model>& model, const sim::Pose& pose,
              const std::vector<sim::JointGain>& gains, const std::vector<BodyId>& feet,
              double seconds) {
  sim::World world(model);
  const sim::State start = model->stateOf(pose);
  world.reset(start);
  StablePd pd(model, gains);
  const JointTarget target = targetOf(*model, start);
  const Snapshot& s = world.snapshot();
  const Vector3d com = s.com();
  const auto is_foot = [&](BodyId body) {
    return std::any_of(feet.begin(), feet.end(),
                       [&](BodyId foot) { return model->hangsOn(body, foot); });
  };
  sim::Torque command;
  VectorXd tau(model->nv());
  Standing standing;
  const auto steps = std::lround(seconds / model->timeStep());
  const long nudged = std::lround(0.5 / model->timeStep());
  const long released = std::lround(0.6 / model->timeStep());
  const double nudge = kNudge * model->mass() * model->gravity() / std::sqrt(2);
  for (long i = 0; i < steps; ++i) {
    if (i == nudged) world.push(model->root(), {nudge, nudge, 0});
    if (i == released) world.push(model->root(), Vector3d::Zero());
    tau.setZero();
    pd.addTorque(s, target, tau);
    toMotors(*model, tau, command);
    world.step(command);
    if (world.diverged() || world.overflowed()) return standing;
    const bool fell = std::any_of(s.robotContacts().begin(), s.robotContacts().end(),
                                  [&](const auto& c) { return !is_foot(c.body); });
    standing.drift = std::max(standing.drift, (s.com() - com).norm());
    if (fell || standing.drift > kMostDrift * com.z()) return standing;
    standing.time = static_cast<double>(i + 1) * model->timeStep();
    if (2 * i < steps) continue;
    for (const Joint& j : model->joints()) {
      standing.speed = std::max(standing.speed, std::abs(s.v()[j.v]));
    }
  }
  standing.stands = standing.speed <= kMostShaking;
  return standing;
}

}  // namespace traceur::control
