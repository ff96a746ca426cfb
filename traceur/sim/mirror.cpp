#include "traceur/sim/mirror.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

namespace traceur::sim {
namespace {

/// How far a joint may be from the other's mirror image, as a part of the robot's size: parts that
/// are no mirror images are farther, and files' digits and cable ducts are not [ours].
constexpr double kPlaceTolerance = 0.02;
/// The least cosine between an axis and the other's image [ours: 8 degrees].
constexpr double kAxisTolerance = 0.99;
/// A plane this near to x or y is x or y [ours, a cosine: 6 degrees].
constexpr double kLevel = 0.995;

struct Word {
  std::string_view left;
  std::string_view right;
};

/// The longest first.
constexpr std::array<Word, 5> kSides = {
    {{"left", "right"}, {"Left", "Right"}, {"LEFT", "RIGHT"}, {"l", "r"}, {"L", "R"}}};

/// Two joints whose names say that they are a pair, and what is left of the names without sides.
struct Named {
  const Joint* left;
  const Joint* right;
  std::string stem;
};

bool isSeparator(char c) {
  return c == '_' || c == '-' || c == '.' || c == ' ' || c == '/' || c == ':';
}

/// The name without the word at `at`, and without the separator that then has nothing to separate.
std::string without(const std::string& name, size_t at, size_t length) {
  std::string before = name.substr(0, at);
  std::string after = name.substr(at + length);
  if (!after.empty() && isSeparator(after.front()) &&
      (before.empty() || isSeparator(before.back()))) {
    after.erase(0, 1);
  } else if (after.empty() && !before.empty() && isSeparator(before.back())) {
    before.pop_back();
  }
  return before + after;
}

/// "hip_joint" is a long word for "hip".
std::string shortened(std::string stem) {
  for (const std::string_view ending : {"_joint", "_Joint", "-joint", "Joint"}) {
    if (stem.size() > ending.size() && stem.ends_with(ending)) {
      stem.erase(stem.size() - ending.size());
    }
  }
  return stem;
}

std::optional<Named> partnerByName(const std::vector<Joint>& joints, const Joint& left) {
  for (const Word& word : kSides) {
    for (size_t at = left.name.find(word.left); at != std::string::npos;
         at = left.name.find(word.left, at + 1)) {
      std::string other = left.name;
      other.replace(at, word.left.size(), word.right);
      for (const Joint& j : joints) {
        if (j.name == other) {
          return Named{&left, &j, without(left.name, at, word.left.size())};
        }
      }
    }
  }
  return std::nullopt;
}

SagittalPlane planeBetween(const Snapshot& s, const std::vector<Named>& named, double tolerance) {
  SagittalPlane plane;
  Vector3d apart = Vector3d::Zero();
  for (const Named& n : named) apart += s.jointAnchor(*n.left) - s.jointAnchor(*n.right);
  apart.z() = 0;
  if (apart.norm() > tolerance) {
    plane.left = apart.normalized();
    for (const Vector3d& axis :
         {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, -1, 0)}) {
      if (plane.left.dot(axis) > kLevel) plane.left = axis;
    }
  }
  for (const Named& n : named) {
    const Vector3d middle = (s.jointAnchor(*n.left) + s.jointAnchor(*n.right)) / 2;
    plane.offset += plane.left.dot(middle) / static_cast<double>(named.size());
  }
  return plane;
}

/// The sign of a pair; none if the joints are not each other's mirror image.
std::optional<double> signOf(const Snapshot& s, const SagittalPlane& plane, const Joint& left,
                             const Joint& right, double tolerance) {
  if (left.slides != right.slides) return std::nullopt;
  const Vector3d apart = s.jointAnchor(right) - plane.mirrored(s.jointAnchor(left));
  const Vector3d axis = s.jointAxis(right);
  // Where on its axis a hinge's anchor lies says nothing.
  const double distance = left.slides ? apart.norm() : apart.cross(axis).norm();
  Vector3d image = s.jointAxis(left) - 2 * plane.left.dot(s.jointAxis(left)) * plane.left;
  if (!left.slides) image = -image;
  const double cosine = axis.dot(image);
  if (distance > tolerance || std::abs(cosine) < kAxisTolerance) return std::nullopt;
  return cosine > 0 ? 1 : -1;
}

int depth(const Model& model, const Joint& joint) {
  int count = 0;
  for (BodyId b = model.bodyOf(joint); b.value > 0; b = model.parent(b)) ++count;
  return count;
}

/// The joint nearest to the mirror image of one on the left, as deep in the tree.
const Joint* partnerByPlace(const Snapshot& s, const Model& model, const SagittalPlane& plane,
                            const Joint& left, const std::set<std::string>& taken,
                            double tolerance) {
  const Joint* found = nullptr;
  double least = tolerance;
  for (const Joint& j : model.joints()) {
    if (taken.contains(j.name) || depth(model, j) != depth(model, left)) continue;
    const double apart = (s.jointAnchor(j) - plane.mirrored(s.jointAnchor(left))).norm();
    if (apart > least || plane.side(s.jointAnchor(j)) >= 0) continue;
    if (!signOf(s, plane, left, j, tolerance)) continue;
    least = apart;
    found = &j;
  }
  return found;
}

double sizeOf(const Snapshot& s, const Model& model) {
  double size = 0;
  for (int b = 1; b < model.bodies(); ++b) {
    if (!model.isRobot({b})) continue;
    size = std::max(size, (s.bodyCom({b}) - s.bodyCom(model.root())).norm());
  }
  return size;
}

}  // namespace

Mirroring mirroringOf(const World& world) {
  const Snapshot& s = world.snapshot();
  const Model& model = world.model();
  const double tolerance = kPlaceTolerance * sizeOf(s, model);
  std::vector<Named> named;
  for (const Joint& j : model.joints()) {
    if (auto pair = partnerByName(model.joints(), j)) named.push_back(std::move(*pair));
  }
  Mirroring found;
  found.plane = planeBetween(s, named, tolerance);

  std::set<std::string> names;  // a pair's name must not hide a joint
  for (const Joint& j : model.joints()) names.insert(j.name);
  std::set<std::string> taken;
  const auto add = [&](const Joint& left, const Joint& right, const std::string& stem,
                       double sign) {
    std::string name = shortened(stem);
    if (name.empty() || names.contains(name)) name = stem;
    if (name.empty() || names.contains(name)) name = left.name + "+" + right.name;
    names.insert(name);
    taken.insert({left.name, right.name});
    found.pairs.emplace(name, MirroredPair{left.name, right.name, sign});
  };
  for (const Named& n : named) {
    if (taken.contains(n.left->name) || taken.contains(n.right->name)) continue;
    const auto sign = signOf(s, found.plane, *n.left, *n.right, tolerance);
    if (sign) {
      add(*n.left, *n.right, n.stem, *sign);
    } else {
      found.refused.push_back(n.left->name + " and " + n.right->name);
      taken.insert({n.left->name, n.right->name});
    }
  }
  for (const Joint& j : model.joints()) {
    if (taken.contains(j.name) || found.plane.side(s.jointAnchor(j)) <= tolerance) continue;
    if (const Joint* other = partnerByPlace(s, model, found.plane, j, taken, tolerance)) {
      add(j, *other, j.name + "+" + other->name, *signOf(s, found.plane, j, *other, tolerance));
    }
  }
  return found;
}

}  // namespace traceur::sim
