#include "traceur/skill/launch.h"

#include <cmath>
#include <numbers>

namespace traceur::skill {

LaunchState::LaunchState(const Skill& skill, Places& places)
    : skill_(&skill),
      world_(skill.model),
      height_(skill.launch->height, places.in(Scope::kSetup)),
      velocity_(skill.launch->velocity, places.in(Scope::kSetup)),
      spin_(skill.launch->spin, places.in(Scope::kSetup)),
      lands_(maybeBound(skill.launch->lands, places.in(Scope::kSetup))),
      ground_(skill.launch->ground, places.in(Scope::kSetup)) {
  const std::string* const angles[] = {&skill.launch->roll, &skill.launch->pitch,
                                       &skill.launch->yaw};
  for (int i = 0; i < 3; ++i) {
    angles_[i] = maybeBound(*angles[i], places.in(Scope::kSetup));
  }
}

sim::State LaunchState::launched(const sim::Pose& pose) {
  const sim::State state = skill_->model->stateOf(pose);
  double height = height_.value();
  if (skill_->launch->of_com) {
    world_.place(state);
    height -= world_.snapshot().com().z();
  }
  return skill_->model->launched(state, height, velocity_.value(), spin_.value());
}

/// How far the root's somersault is from the wanted one when the COM, in rigid flight, is as high
/// as it is over a ground that it touches with the wanted one [rad].
double LaunchState::landing(const sim::State& state, double wanted) {
  sim::Pose pose = skill_->launch->pose;
  for (int i = 0; i < 3; ++i) {
    if (angles_[i]) pose.root_rpy[i] = angles_[i]->value();
  }
  pose.root_rpy.y() = wanted;
  world_.place(skill_->model->stateOf(pose));
  const double low = world_.snapshot().com().z();
  world_.place(state);
  const sim::Snapshot& s = world_.snapshot();
  const double time = flight::fallTime(s.com().z() - ground_.value() - low, velocity_.value().z(),
                                       skill_->model->gravity());
  const sim::Matrix3d R = s.bodyRotation(skill_->model->root());
  const sim::Matrix3d inertia = R.transpose() * s.inertia() * R;
  const Vector3d momentum = s.inertia() * spin_.value();
  const sim::Matrix3d then = flight::turned(R, momentum, inertia, time);
  return std::remainder(sim::Turn::of(then).somersault - wanted, 2 * std::numbers::pi);
}

sim::State LaunchState::state() {
  sim::Pose pose = skill_->launch->pose;
  for (int i = 0; i < 3; ++i) {
    if (angles_[i]) pose.root_rpy[i] = angles_[i]->value();
  }
  if (!lands_) return launched(pose);
  // A planar spin needs one correction; where others take part, a few.
  static constexpr int kCorrections = 6;
  const double wanted = lands_->value();
  pose.root_rpy.y() = wanted;
  sim::State state = launched(pose);
  for (int k = 0; k < kCorrections && state.q.allFinite() && state.v.allFinite(); ++k) {
    pose.root_rpy.y() -= landing(state, wanted);
    state = launched(pose);
  }
  return state;
}

}  // namespace traceur::skill
