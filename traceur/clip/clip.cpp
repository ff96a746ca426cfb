#include "traceur/clip/clip.h"

#include <algorithm>

#include "traceur/sim/model.h"
#include "traceur/sim/world.h"

namespace traceur::clip {
namespace {

constexpr double kStays = 1e-6;  // [m]: less is rounding

/// The robot's bodies, parents first, and where each is hinged.
struct Skeleton {
  std::vector<sim::BodyId> bodies;
  std::vector<const sim::Joint*> hinges;  // null: welded, or the root
  std::vector<int> parents;               // indices in bodies

  explicit Skeleton(const sim::Model& model) {
    std::vector<int> index(static_cast<size_t>(model.bodies()), -1);
    for (int b = 0; b < model.bodies(); ++b) {
      if (!model.isRobot({b})) continue;
      index[static_cast<size_t>(b)] = static_cast<int>(bodies.size());
      const auto hinge = std::ranges::find_if(
          model.joints(), [&](const sim::Joint& j) { return j.body.value == b; });
      const bool root = bodies.empty();
      parents.push_back(root ? -1 : index[static_cast<size_t>(model.parent({b}).value)]);
      hinges.push_back(root || hinge == model.joints().end() ? nullptr : &*hinge);
      bodies.push_back({b});
    }
  }

  std::vector<Place> places(const sim::Snapshot& s) const {
    std::vector<Place> places;
    for (size_t i = 0; i < bodies.size(); ++i) {
      places.push_back({s.bodyRotation(bodies[i]),
                        hinges[i] ? s.jointAnchor(*hinges[i]) : s.bodyPosition(bodies[i])});
    }
    return places;
  }
};

/// The farthest that a bone's body reaches from its joint.
Vector3d tipOf(const sim::Snapshot& s, sim::BodyId body, const Vector3d& joint) {
  Vector3d towards = s.bodyCom(body) - joint;
  if (towards.norm() < kStays) return Vector3d::Zero();
  towards.normalize();
  const auto end = s.farthestPoint(body, towards);
  return end ? Vector3d(towards.dot(*end - joint) * towards) : towards * kStays;
}

}  // namespace

std::vector<Place> Clip::places(size_t frame) const {
  const Frame& f = frames[frame];
  std::vector<Place> all;
  for (size_t j = 0; j < joints.size(); ++j) {
    const Eigen::Matrix3d turned = f.rotation[j].toRotationMatrix();
    if (joints[j].parent < 0) {
      all.push_back({turned, f.position[j]});
    } else {
      const Place& on = all[static_cast<size_t>(joints[j].parent)];
      all.push_back({on.R * turned, on.p + on.R * f.position[j]});
    }
  }
  return all;
}

Clip clipOf(const sim::Recording& recording) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  const Skeleton skeleton(*model);
  sim::World world(model);
  world.place(model->initialState());
  const std::vector<Place> rest = skeleton.places(world.snapshot());
  Clip clip;
  for (size_t j = 0; j < rest.size(); ++j) {
    Joint joint{model->bodyName(skeleton.bodies[j]), skeleton.parents[j], rest[j].p};
    if (joint.parent >= 0) joint.offset -= rest[static_cast<size_t>(joint.parent)].p;
    joint.moves = joint.parent < 0;
    const bool leaf =
        std::ranges::find(skeleton.parents, static_cast<int>(j)) == skeleton.parents.end();
    if (leaf) joint.tip = tipOf(world.snapshot(), skeleton.bodies[j], rest[j].p);
    clip.joints.push_back(std::move(joint));
  }
  const auto& frames = recording.frames;
  if (frames.size() > 1) clip.interval = frames[1].state.time - frames[0].state.time;
  for (const sim::Frame& f : frames) {
    world.place(f.state);
    std::vector<Place> now = skeleton.places(world.snapshot());
    Frame out;
    for (size_t j = 0; j < now.size(); ++j) {
      now[j].R *= rest[j].R.transpose();
      Joint& joint = clip.joints[j];
      if (joint.parent < 0) {
        out.rotation.emplace_back(now[j].R);
        out.position.push_back(now[j].p);
        continue;
      }
      const Place& on = now[static_cast<size_t>(joint.parent)];
      out.rotation.emplace_back(Eigen::Matrix3d(on.R.transpose() * now[j].R));
      out.position.emplace_back(on.R.transpose() * (now[j].p - on.p));
      joint.moves = joint.moves || (out.position[j] - joint.offset).norm() > kStays;
    }
    clip.frames.push_back(std::move(out));
  }
  return clip;
}

}  // namespace traceur::clip
