#include "traceur/sim/scene.h"

#include <cmath>

namespace traceur::sim {
namespace {

/// Thickness of a wall behind its face [m]: more than anything penetrates at our speeds.
constexpr double kWallThickness = 0.2;

}  // namespace

Prop wall(std::string name, const Vector3d& position, double yaw, double width, double height) {
  const Vector3d facing(std::cos(yaw), std::sin(yaw), 0);
  return {.name = std::move(name),
          .shape = Prop::Shape::kBox,
          .size = {kWallThickness / 2, width / 2, height / 2},
          .position = position - facing * kWallThickness / 2 + Vector3d(0, 0, height / 2),
          .rpy = {0, 0, yaw}};
}

Prop rail(std::string name, const Vector3d& from, const Vector3d& to, double radius) {
  const Vector3d along = to - from;
  // A capsule's axis is its z: pitch it down to the horizontal, then yaw it.
  const double pitch = std::atan2(along.head<2>().norm(), along.z());
  const double yaw = std::atan2(along.y(), along.x());
  return {.name = std::move(name),
          .shape = Prop::Shape::kCapsule,
          .size = {radius, along.norm() / 2, 0},
          .position = (from + to) / 2,
          .rpy = {0, pitch, yaw}};
}

}  // namespace traceur::sim
