#include "traceur/landing/stress.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace traceur::landing {
namespace {

/// What the names of the joints between a body and its parent have in common: "hip".
std::string jointName(const sim::Model& model, sim::BodyId body) {
  std::string common;
  for (const sim::Joint& j : model.joints()) {
    if (model.bodyOf(j) != body) continue;
    std::string name = j.name;
    for (const auto& [pair, sides] : model.robot()->mirrored) {
      if (sides.left == j.name || sides.right == j.name) name = pair;
    }
    if (common.empty()) {
      common = name;
      continue;
    }
    const auto ends = std::mismatch(common.begin(), common.end(), name.begin(), name.end());
    common.erase(ends.first, common.end());
  }
  while (common.ends_with('_')) common.pop_back();
  return common;
}

}  // namespace

double StressedJoint::stress(const VectorXd& by_body) const {
  double most = 0;
  for (const sim::BodyId b : moves) most = std::max(most, by_body[b.value]);
  return most;
}

std::vector<StressedJoint> stressedJoints(const sim::Model& model) {
  std::vector<StressedJoint> all;
  std::map<std::string, size_t> known;
  for (int b = 0; b < model.bodies(); ++b) {
    const sim::BodyId body{b};
    const std::string name = jointName(model, body);
    if (name.empty()) continue;
    const auto [at, added] = known.emplace(name, all.size());
    if (added) {
      StressedJoint joint;
      joint.name = name;
      joint.meets_first = true;
      for (int k = 0; k < model.bodies(); ++k) {
        if (model.hangsOn({k}, body)) joint.carries += model.bodyMass({k});
        const bool further = k != b && model.hangsOn({k}, body);
        joint.meets_first = joint.meets_first && !further;
      }
      const auto& groups = model.robot()->bodies;
      bool end = false;
      for (const char* group : {"feet", "hands"}) {
        const auto found = groups.find(group);
        if (found == groups.end()) continue;
        end = end || std::count(found->second.begin(), found->second.end(), model.bodyName(body));
      }
      joint.meets_first = joint.meets_first && end;
      all.push_back(std::move(joint));
    }
    all[at->second].moves.push_back(body);
  }
  return all;
}

StressRatio compared(const std::vector<StressedJoint>& joints, const VectorXd& limp,
                     const VectorXd& landing) {
  StressRatio r;
  double logs = 0;
  double limp_sum = 0;
  double sum = 0;
  int count = 0;
  r.worst = std::numeric_limits<double>::infinity();
  for (const StressedJoint& j : joints) {
    const double ours = j.stress(landing);
    if (!(ours > 0)) continue;
    const double ratio = j.stress(limp) / ours;
    r.mean += ratio;
    logs += std::log(ratio);
    r.worst = std::min(r.worst, ratio);
    limp_sum += j.stress(limp);
    sum += ours;
    ++count;
  }
  if (count == 0) return {};
  r.mean /= count;
  r.geometric = std::exp(logs / count);
  r.sums = limp_sum / sum;
  return r;
}

std::vector<StressedJoint> withoutEnds(std::vector<StressedJoint> joints) {
  std::erase_if(joints, [](const StressedJoint& j) { return j.meets_first; });
  return joints;
}

}  // namespace traceur::landing
