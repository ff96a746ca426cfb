#include "traceur/flight/poses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "traceur/core/random.h"

namespace traceur::flight {
namespace {

/// How many poses the choice is made from [ours: drawing them takes some tenths of a second].
constexpr int kDrawn = 500;

sim::State stateOf(const sim::Model& model, const VectorXd& joints) {
  sim::State state = model.initialState();
  for (size_t i = 0; i < model.joints().size(); ++i) {
    state.q[model.joints()[i].q] = joints[static_cast<Eigen::Index>(i)];
  }
  return state;
}

/// The joint of the same pair, or -1, with the sign of equal motions.
struct Partner {
  int joint = -1;
  double sign = 1;
};

std::vector<Partner> partnersOf(const sim::Model& model) {
  std::map<std::string, int> index;
  for (size_t i = 0; i < model.joints().size(); ++i) {
    index[model.joints()[i].name] = static_cast<int>(i);
  }
  std::vector<Partner> partners(model.joints().size());
  if (!model.robot()) return partners;
  for (const auto& [unused, pair] : model.robot()->mirrored) {
    const auto left = index.find(pair.left);
    const auto right = index.find(pair.right);
    if (left == index.end() || right == index.end()) continue;
    partners[static_cast<size_t>(left->second)] = {right->second, pair.sign};
  }
  return partners;
}

bool reachesIntoItself(sim::World& world, const VectorXd& joints) {
  sim::State state = stateOf(world.model(), joints);
  if (world.model().rootDofs() == 6) state.q[world.model().rootQ() + 2] = 100;  // off the ground
  return world.placePressed(state);
}

}  // namespace

FlightPose flightPose(sim::World& world, const VectorXd& joints) {
  world.place(stateOf(world.model(), joints));
  const Matrix3d R = world.snapshot().bodyRotation(world.model().root());
  return {joints, R.transpose() * world.snapshot().inertia() * R};
}

std::vector<FlightPose> unlikePoses(const std::shared_ptr<const sim::Model>& model,
                                    const VectorXd& seed_pose, int count, std::uint64_t seed) {
  sim::World world(model);
  Random random(seed);
  const std::vector<Partner> partners = partnersOf(*model);
  std::vector<FlightPose> drawn;
  while (static_cast<int>(drawn.size()) < kDrawn) {
    VectorXd joints = seed_pose;
    const bool apart = random.uniform() < 0.25;
    const auto angle = [&](size_t i) {
      const auto at = static_cast<Eigen::Index>(i);
      const sim::JointLimit& limit = model->joints()[i].limit;
      const double u = 2 * random.uniform() - 1;  // most angles are small
      const double to = std::clamp(u < 0 ? limit.min : limit.max, -3.0, 3.0);
      return seed_pose[at] + u * u * (to - seed_pose[at]);
    };
    std::vector<bool> set(partners.size(), false);
    for (size_t i = 0; i < partners.size(); ++i) {
      if (set[i]) continue;
      joints[static_cast<Eigen::Index>(i)] = angle(i);
      const Partner& p = partners[i];
      if (p.joint < 0) continue;
      joints[p.joint] = apart ? angle(static_cast<size_t>(p.joint))
                              : p.sign * joints[static_cast<Eigen::Index>(i)];
      set[static_cast<size_t>(p.joint)] = true;
    }
    if (!reachesIntoItself(world, joints)) drawn.push_back(flightPose(world, joints));
  }
  std::vector<FlightPose> chosen = {flightPose(world, seed_pose)};
  std::vector<double> far(drawn.size(), std::numeric_limits<double>::infinity());
  while (static_cast<int>(chosen.size()) < count) {
    for (size_t i = 0; i < drawn.size(); ++i) {
      far[i] = std::min(far[i], (drawn[i].inertia - chosen.back().inertia).norm());
    }
    const auto best = std::max_element(far.begin(), far.end()) - far.begin();
    chosen.push_back(drawn[static_cast<size_t>(best)]);
  }
  return chosen;
}

}  // namespace traceur::flight
