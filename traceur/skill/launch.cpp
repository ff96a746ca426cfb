#include "traceur/skill/launch.h"

namespace traceur::skill {

LaunchState::LaunchState(const Skill& skill, Places& places)
    : skill_(&skill),
      height_(skill.launch->height, places.in(Scope::kSetup)),
      velocity_(skill.launch->velocity, places.in(Scope::kSetup)),
      spin_(skill.launch->spin, places.in(Scope::kSetup)) {
  const std::string* const angles[] = {&skill.launch->roll, &skill.launch->pitch,
                                       &skill.launch->yaw};
  for (int i = 0; i < 3; ++i) {
    angles_[i] = maybeBound(*angles[i], places.in(Scope::kSetup));
  }
}

sim::State LaunchState::state() const {
  sim::Pose pose = skill_->launch->pose;
  for (int i = 0; i < 3; ++i) {
    if (angles_[i]) pose.root_rpy[i] = angles_[i]->value();
  }
  return skill_->model->launched(skill_->model->stateOf(pose), height_.value(), velocity_.value(),
                                 spin_.value());
}

}  // namespace traceur::skill
