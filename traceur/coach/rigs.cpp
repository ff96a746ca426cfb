#include "traceur/coach/rigs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>

#include "traceur/control/expression.h"
#include "traceur/core/text.h"
#include "traceur/sim/world.h"

namespace traceur::coach {
namespace {

std::string quoted(std::span<const std::string> words) {
  std::vector<std::string> out;
  for (const std::string& w : words) out.push_back('"' + w + '"');
  return join(out);
}

void parameter(SkillDraft& d, std::string_view name, std::string_view unit, double min, double max,
               double initial, std::string_view help) {
  d.parameters.push_back({std::string(name), std::string(unit), min, max,
                          std::clamp(initial, min, max), std::string(help)});
}

void targetJoints(const RigUse& u, SkillDraft& d) {
  for (const std::string& j : u.joints) d.pose.emplace_back(j, fmt::format("{:.6g}", u.value));
}

// Over the feet the root is placed: how high, how far ahead, how inclined. The ranges are about the
// key pose's [ours: what the legs reach; more pitch, and the trunk falls over].
constexpr double kUpDown = 0.25, kAlong = 0.3, kPitch = 0.3;  // m, m, rad

void ikStanding(const RigUse& u, SkillDraft& d) {
  const Vector3d key = u.body->rootFromSoles(u.phase->pose);
  parameter(d, "root_height", "m", std::max(0.3, key.z() - kUpDown), key.z() + kUpDown, key.z(),
            "Of the root over the soles.");
  parameter(d, "root_forward", "m", key.x() - kAlong, key.x() + kAlong, key.x(),
            "Of the root from the soles.");
  parameter(d, "root_pitch", "rad", key.y() - kPitch, key.y() + kPitch, key.y(), "Of the root.");
  d.reach.push_back(fmt::format("hold = [\"{}\"]", u.phase->bears));
  d.reach.push_back(fmt::format("joints = [{}]", quoted(u.body->leg_joints)));
  d.reach.push_back(
      fmt::format("[[phase.reach.goal]]\nof = \"{}\"\nfrom = \"{}\"\n{}\nz = "
                  "\"root_height\"\npitch = \"root_pitch\"",
                  u.body->root, u.body->soles[0],
                  u.body->headed("root_forward", fmt::format("{:.6g}", -u.body->side[0]))));
}

// In the air the feet are placed under the COM, in the world's axes: however the trunk has turned,
// they meet the ground where they should. Solved so often [s]:
constexpr double kAgain = 0.02;
constexpr double kSide = 0.25;  // m [ours: as far as the hips let the feet]

void ikFlying(const RigUse& u, SkillDraft& d) {
  if (u.wall) {
    // Bent to nearly straight legs, from level with the COM down [ours].
    parameter(d, "leg", "m", 0, 0.7, 0.35, "Of the COM over the feet.");
    parameter(d, "feet_forward", "m", 0.2, 0.8, 0.5, "Of the feet from the COM.");
  } else {
    parameter(d, "leg", "m", 0.35, 0.8, 0.6, "Of the COM over the feet.");
    // From a wall it comes down backward, and fast: where 2.4 m/s can be caught [ours].
    parameter(d, "feet_forward", "m", u.from_wall ? -0.55 : -0.25, 0.3, 0.05,
              "Of the feet from the COM.");
  }
  std::vector<std::string> joints = u.body->leg_joints;
  std::string flat = fmt::format("pitch = {}", u.wall ? "-1.5708" : "0");
  if (u.twist != 0) {
    // Who turns in the air goes on the way that was ahead, which is sideways by then.
    parameter(d, "feet_left", "m", -kSide, kSide, 0, "Of the feet from the COM.");
    joints.insert(joints.end(), u.body->side_joints.begin(), u.body->side_joints.end());
    flat += "\nroll = 0";
  }
  d.reach.push_back(fmt::format("hold = [\"{}\"]", u.body->root));
  d.reach.push_back(fmt::format("joints = [{}]", quoted(joints)));
  d.reach.push_back(fmt::format("every = {}", kAgain));
  const auto side = [&](size_t i) {
    const std::string own = fmt::format("{:.6g}", u.body->side[i]);
    return u.twist != 0 ? "(feet_left + " + own + ")" : own;
  };
  for (size_t i = 0; i < u.body->soles.size(); ++i) {
    d.reach.push_back(
        fmt::format("[[phase.reach.goal]]\nof = \"{0}\"\nfrom = \"com\"\n{1}\nz = \"-leg\"\n"
                    "[[phase.reach.goal]]\nof = \"{0}\"\n{2}\nweight = 0.1",
                    u.body->soles[i], u.body->headed("feet_forward", side(i)), flat));
  }
}

void ikPose(const RigUse& u, SkillDraft& d) {
  u.phase->bears.empty() ? ikFlying(u, d) : ikStanding(u, d);
}

void stiffness(const RigUse& u, SkillDraft& d) {
  if (u.value > 0) {
    for (const std::string& j : u.joints) {
      // Of what the phase has, which for the legs may be less than the robot's.
      const bool leg = std::ranges::find(u.body->leg_joints, j) != u.body->leg_joints.end();
      d.stiffness.emplace_back(
          j, fmt::format("{:.6g}", u.value * (leg ? u.phase->kind->stiffness : 1)));
    }
    return;
  }
  parameter(d, "give", "1", 0.1, 2, 0.4, "Stiffness of the legs.");
  for (const std::string& j : u.joints) d.stiffness.emplace_back(j, "give");
}

// A jump of 0.8 m needs half of this beside PD control [ours].
constexpr double kPush = 3000, kAcross = 1500;  // N
constexpr double kTurn = 300;                   // N·m
constexpr double kTwist = 900;                  // N·m
// On a wall the spin and the way up both come from what is across [ours: with a thrust's limit the
// moment lay at it].
constexpr double kWallAcross = 3000, kWallTurn = 900;  // N, N·m
constexpr double kTwistPerSpin = 200;                  // N·m·s, where the search begins

void virtualForce(const RigUse& u, SkillDraft& d) {
  // What bears the body has the plain names, another limb its own before them.
  const std::string of = u.target == Body::contactOf(*u.phase) ? "" : u.target + "_";
  // What is pushed goes the other way: the ground is given the opposite of what the COM is.
  parameter(d, of + "push_along", "N", -kPush, kPush, 0,
            "On the COM, away from the centre of pressure.");
  const bool wall = u.phase->kind->wall;
  const double across = wall ? kWallAcross : kAcross;
  const double turn = wall ? kWallTurn : kTurn;
  parameter(d, of + "push_across", "N", -across, across, 0,
            "On the COM, at right angles, forward.");
  parameter(d, of + "push_turn", "N·m", -turn, turn, 0, "On the body, forward.");
  std::string tilt = "0", twist = "0";
  if (u.twist != 0) {
    parameter(d, of + "push_twist", "N·m", -kTwist, kTwist, kTwistPerSpin * u.twist,
              "On the body, about the vertical, to the left.");
    // Without it who turns falls sideways.
    parameter(d, of + "push_tilt", "N·m", -kTurn, kTurn, 0, "On the body, to the right.");
    twist = fmt::format("\"-{}push_twist\"", of);
    tilt = fmt::format("\"-{}push_tilt\"", of);
  }
  d.forces.push_back(fmt::format(
      "bodies = [\"{0}\"]\ntouching = true\nframe = \"cop to com\"\nforce = "
      "[\"-{1}push_across\", 0, \"-{1}push_along\"]\nmoment = [{2}, \"-{1}push_turn\", {3}]",
      u.target, of, tilt, twist));
}

// Of the COM over the feet. The printed 300 and 6 hold no crouch but the deepest [ours: about
// m g / h times 2.5, near critical].
constexpr double kSpring = 3000, kDamper = 600;  // N/m, N·s/m

void feedbackVirtualForce(const RigUse& u, SkillDraft& d) {
  const auto& soles = u.body->soles;
  // Ahead of the ankles by as much as standing puts it.
  d.forces.push_back(fmt::format(
      "com = true\nagainst = [{0}]\ntouching = true\nforce = [\"{1} * ({3} + over * "
      "cos(heading.root) - "
      "com.x) - {2} * com_velocity.x\", \"{1} * ({4} + over * sin(heading.root) - com.y) - {2} * "
      "com_velocity.y\", \"-{2} * com_velocity.z\"]",
      quoted(soles), kSpring, kDamper, u.body->mean(soles, 'x'), u.body->mean(soles, 'y')));
  d.constants.emplace_back("over = 0.06");
}

constexpr std::array kRigs = {
    Rig{"TargetJoints", "none: the angle is what was asked", targetJoints},
    Rig{"IKPose", "root_height, root_forward, root_pitch; in the air leg, feet_forward", ikPose},
    Rig{"Stiffness", "none, or give", stiffness},
    Rig{"VirtualForce", "push_along, push_across, push_turn", virtualForce},
    Rig{"FeedbackVirtualForce", "none", feedbackVirtualForce},
};

}  // namespace

bool SkillDraft::has(std::string_view rig) const {
  return std::ranges::find(rigs, rig) != rigs.end();
}

std::span<const Rig> allRigs() {
  return kRigs;
}

const Rig& rigNamed(std::string_view name) {
  const auto* found = std::ranges::find(kRigs, name, &Rig::name);
  assert(found != kRigs.end());
  return *found;
}

Body::Body(const Script& s) : script(&s), root(s.model->bodyName(s.model->root())) {
  const sim::Model& model = *s.model;
  const sim::Robot& robot = *model.robot();
  const auto feet = robot.bodies.find("feet");
  if (feet == robot.bodies.end()) {
    throw InputError(fmt::format("{}: no group of bodies \"feet\" under [bodies]", robot.name));
  }
  sim::World world(s.model);
  const auto at = [&](const sim::Pose& pose) {
    world.place(model.stateOf(pose));
    return &world.snapshot();
  };
  const auto start = robot.poses.find(s.start);
  const sim::Pose stand = start == robot.poses.end() ? sim::Pose{} : start->second;
  for (const auto& [limb, chain] : robot.limbs) {
    const auto sole = std::ranges::find_if(chain, [&](const std::string& b) {
      return std::ranges::find(feet->second, b) != feet->second.end();
    });
    if (sole == chain.end()) continue;
    soles.push_back(*sole);
    if (soles.size() > 1) continue;
    // What moves this leg within the plane of motion has its axis across it.
    for (const sim::Joint& j : model.joints()) {
      const std::string body = model.bodyName(model.bodyOf(j));
      const auto place = std::ranges::find(chain.begin(), sole + 1, body);
      if (place == sole + 1 || j.motor < 0) continue;
      world.place(model.stateOf({}));
      const Vector3d axis = world.snapshot().jointAxis(j);
      const bool across = std::abs(axis.x()) > 0.9;
      if (!across && std::abs(axis.y()) < 0.9) continue;
      std::string name = j.name;
      for (const auto& [pair, m] : robot.mirrored) {
        if (m.left == j.name || m.right == j.name) name = pair;
      }
      (across ? side_joints : leg_joints).push_back(name);
    }
  }
  if (soles.empty() || leg_joints.empty()) {
    throw InputError(
        fmt::format("{}: none of its [limbs] ends in a body of the group \"feet\"", robot.name));
  }
  const sim::Snapshot* standing = at(stand);
  origin = Vector3d::Zero();
  for (const std::string& b : feet->second) {
    origin += standing->bodyPosition(model.body(b)) / static_cast<double>(feet->second.size());
  }
  for (const std::string& b : soles) {
    side.push_back(standing->bodyPosition(model.body(b)).y() -
                   standing->bodyPosition(model.root()).y());
  }
}

std::string Body::contactOf(const Phase& phase) {
  return phase.bears.empty() ? "feet" : phase.bears;
}

Vector3d Body::rootFromSoles(const KeyPose& key) const {
  const sim::Model& model = *script->model;
  const sim::Robot& robot = *model.robot();
  sim::Pose pose;
  const auto base = robot.poses.find(key.base == "previous" ? script->start : key.base);
  if (base != robot.poses.end()) pose = base->second;
  for (const KeyAngle& a : key.angles) {
    for (const sim::SignedJoint& j : robot.jointsNamed(a.joint)) {
      pose.joints[j.joint] = j.sign * a.angle;
    }
  }
  sim::World world(script->model);
  world.place(model.stateOf(pose));
  const sim::Snapshot& s = world.snapshot();
  // As if the sole were flat.
  const Eigen::Matrix3d R_WS = s.bodyRotation(model.body(soles[0]));
  const Vector3d p_W = s.bodyPosition(model.root()) - s.bodyPosition(model.body(soles[0]));
  const Vector3d p_S = R_WS.transpose() * p_W;
  const double pitch =
      sim::rpyOf(Eigen::Matrix3d(R_WS.transpose() * s.bodyRotation(model.root()))).y();
  return {p_S.x(), pitch, p_S.z()};
}

std::string Body::headed(const std::string& forward, const std::string& left) const {
  return fmt::format(
      "x = \"{0} * cos(heading.root) - {1} * sin(heading.root)\"\n"
      "y = \"{0} * sin(heading.root) + {1} * cos(heading.root)\"",
      forward, left);
}

std::string Body::mean(const std::vector<std::string>& bodies, char axis) const {
  std::vector<std::string> terms;
  terms.reserve(bodies.size());
  for (const std::string& b : bodies) {
    terms.push_back(control::Expression::spelled(fmt::format("body.{}.{}", b, axis)));
  }
  if (terms.size() == 1) return terms[0];
  return fmt::format("({}) / {}", join(terms, " + "), terms.size());
}

}  // namespace traceur::coach
