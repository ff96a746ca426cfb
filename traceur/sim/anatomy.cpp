#include "traceur/sim/anatomy.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

namespace traceur::sim {
namespace {

/// What is less above the ground than this part of the COM's height touches it: soles of meshes are
/// not quite level [ours].
constexpr double kTouching = 0.02;
/// A corner is where a shape ends in a direction so little out of the straight that all of a flat
/// face is asked before its edge [ours].
constexpr double kTilt = 0.05;

/// The tree of the bodies that joints move; what is fixed to one is part of it.
class Tree {
 public:
  explicit Tree(const Model& model) : model_(model), children_(model.bodies()) {
    moving_.insert(model.root().value);
    for (const Joint& j : model.joints()) moving_.insert(model.bodyOf(j).value);
    for (const int b : moving_) {
      if (b != model.root().value) children_[parent(b)].push_back(b);
    }
  }

  const std::set<int>& bodies() const { return moving_; }
  const std::vector<int>& children(int body) const { return children_[body]; }
  int parent(int body) const { return owner(model_.parent({body}).value); }

  /// The moving body that a body is part of.
  int owner(int body) const {
    while (body > 0 && !moving_.contains(body)) body = model_.parent({body}).value;
    return body;
  }
  bool hangsOn(int body, int ancestor) const { return model_.hangsOn({body}, {ancestor}); }
  double mass(int body) const {
    double sum = 0;
    for (int b = body; b < model_.bodies(); ++b) {
      if (model_.isRobot({b}) && hangsOn(b, body)) sum += model_.bodyMass({b});
    }
    return sum;
  }

 private:
  const Model& model_;
  std::set<int> moving_;
  std::vector<std::vector<int>> children_;
};

/// A point of a robot's surface.
struct SurfacePoint {
  BodyId body;
  Vector3d p_W;
};

class Finder {
 public:
  Finder(const World& world, const Mirroring& mirroring)
      : s_(world.snapshot()),
        model_(world.model()),
        mirroring_(mirroring),
        tree_(model_),
        forward_(mirroring.plane.left.cross(Vector3d::UnitZ())) {}

  Anatomy find();

 private:
  std::optional<SurfacePoint> farthest(const std::set<int>& owners, const Vector3d& u) const;
  /// Else a robot.toml cannot name it.
  bool hasName(int body) const { return model_.bodyName({body}) != fmt::format("body {}", body); }
  bool isLeft(int body) const { return mirroring_.plane.side(s_.bodyCom({body})) > 0; }
  std::vector<int> chainFrom(int body, bool leg) const;
  void findFeet();
  void addSole(const std::string& side, const std::set<int>& feet);
  void addFingertip(const std::string& name, const std::vector<int>& limb);
  void addPoint(const std::string& name, const SurfacePoint& point);
  std::vector<std::string> named(const std::vector<int>& bodies) const;

  const Snapshot& s_;
  const Model& model_;
  const Mirroring& mirroring_;
  Tree tree_;
  Vector3d forward_;
  std::set<int> feet_;
  Anatomy found_;
};

std::optional<SurfacePoint> Finder::farthest(const std::set<int>& owners, const Vector3d& u) const {
  std::optional<SurfacePoint> most;
  for (int b = 1; b < model_.bodies(); ++b) {
    if (!model_.isRobot({b}) || !owners.contains(tree_.owner(b))) continue;
    const auto point = s_.farthestPoint({b}, u.normalized());
    if (point && (!most || u.dot(*point) > u.dot(most->p_W))) most = SurfacePoint{{b}, *point};
  }
  return most;
}

std::vector<std::string> Finder::named(const std::vector<int>& bodies) const {
  std::vector<std::string> names;
  for (const int b : bodies) {
    if (hasName(b)) names.push_back(model_.bodyName({b}));
  }
  return names;
}

void Finder::findFeet() {
  const auto lowest = farthest(tree_.bodies(), -Vector3d::UnitZ());
  if (!lowest) return;
  const double most = lowest->p_W.z() + kTouching * (s_.com().z() - lowest->p_W.z());
  for (const int b : tree_.bodies()) {
    const auto point = farthest({b}, -Vector3d::UnitZ());
    if (point && point->p_W.z() <= most) feet_.insert(b);
  }
}

std::vector<int> Finder::chainFrom(int body, bool leg) const {
  std::vector<int> chain = {body};
  while (true) {
    std::vector<int> next = tree_.children(chain.back());
    if (leg) {
      std::erase_if(next, [&](int child) {
        return std::none_of(feet_.begin(), feet_.end(),
                            [&](int foot) { return tree_.hangsOn(foot, child); });
      });
    }
    if (next.size() != 1) return chain;
    chain.push_back(next[0]);
  }
}

void Finder::addPoint(const std::string& name, const SurfacePoint& point) {
  if (!hasName(point.body.value)) return;
  const Vector3d p_BP =
      s_.bodyRotation(point.body).transpose() * (point.p_W - s_.bodyPosition(point.body));
  found_.contacts[name] = {model_.bodyName(point.body), p_BP};
}

void Finder::addSole(const std::string& side, const std::set<int>& feet) {
  const Vector3d outwards = (side == "left" ? 1 : -1) * mirroring_.plane.left;
  for (const bool toe : {true, false}) {
    for (const bool outer : {true, false}) {
      const Vector3d u = -Vector3d::UnitZ() + kTilt * (toe ? forward_ : -forward_) +
                         kTilt * (outer ? outwards : -outwards);
      if (const auto point = farthest(feet, u)) {
        addPoint(fmt::format("{}_{}_{}", side, toe ? "toe" : "heel", outer ? "outer" : "inner"),
                 *point);
      }
    }
  }
}

/// The middle of where the last of a limb's shapes ends, seen from where the limb begins.
void Finder::addFingertip(const std::string& name, const std::vector<int>& limb) {
  const Vector3d along = (s_.bodyCom({limb.back()}) - s_.bodyPosition({limb.front()})).normalized();
  const Vector3d a = along.unitOrthogonal();
  const Vector3d b = along.cross(a);
  Vector3d sum = Vector3d::Zero();
  std::optional<SurfacePoint> corner;
  for (const double i : {-kTilt, kTilt}) {
    for (const double j : {-kTilt, kTilt}) {
      corner = farthest({limb.back()}, along + i * a + j * b);
      if (!corner) return;  // a hand that touches nothing
      sum += corner->p_W;
    }
  }
  addPoint(name, {corner->body, sum / 4});
}

Anatomy Finder::find() {
  findFeet();
  std::set<int> paired;
  for (const auto& [name, pair] : mirroring_.pairs) {
    paired.insert(model_.bodyOf(model_.joint(pair.left)).value);
    paired.insert(model_.bodyOf(model_.joint(pair.right)).value);
  }
  std::set<int> trunk;
  std::vector<int> begins;
  for (const int b : tree_.bodies()) {  // parents come first
    if (b != model_.root().value && !trunk.contains(tree_.parent(b))) continue;
    if (paired.contains(b)) {
      begins.push_back(b);
    } else {
      trunk.insert(b);
    }
  }
  // The left before the right; of a side's several limbs the heaviest is the arm.
  std::stable_sort(begins.begin(), begins.end(), [&](int a, int b) {
    return std::pair(!isLeft(a), -tree_.mass(a)) < std::pair(!isLeft(b), -tree_.mass(b));
  });
  const auto add_group = [&](const std::string& name, const std::vector<int>& bodies) {
    std::vector<std::string>& group = found_.bodies[name];
    for (const std::string& body : named(bodies)) group.push_back(body);
  };
  for (const int begin : begins) {
    const bool leg = std::any_of(feet_.begin(), feet_.end(),
                                 [&](int foot) { return tree_.hangsOn(foot, begin); });
    const std::string side = isLeft(begin) ? "left" : "right";
    std::string name = side + (leg ? "_leg" : "_arm");
    for (int n = 2; found_.limbs.contains(name); ++n) {
      name = fmt::format("{}_{}_{}", side, leg ? "leg" : "arm", n);
    }
    const std::vector<int> chain = chainFrom(begin, leg);
    found_.limbs[name] = named(chain);
    add_group(leg ? "legs" : "arms", chain);
    if (!leg && name == side + "_arm") {
      add_group("hands", {chain.back()});
      addFingertip(side + "_hand", chain);
    }
  }
  for (const char* side : {"left", "right"}) {
    std::set<int> feet;
    for (const int f : feet_) {
      if (isLeft(f) == (side == std::string("left"))) feet.insert(f);
    }
    addSole(side, feet);
  }
  if (!feet_.empty()) add_group("feet", {feet_.begin(), feet_.end()});
  add_group("trunk", {trunk.begin(), trunk.end()});
  if (const auto top = farthest(trunk, Vector3d::UnitZ())) {
    add_group("head", {tree_.owner(top->body.value)});
  }
  return found_;
}

}  // namespace

Anatomy anatomyOf(const World& world, const Mirroring& mirroring) {
  return Finder(world, mirroring).find();
}

}  // namespace traceur::sim
