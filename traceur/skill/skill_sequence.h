// Skills performed one after another.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "traceur/skill/measures.h"
#include "traceur/skill/skill_controller.h"

namespace traceur::skill {

/// Performs a skill's parts: each begins at the moment at which the one before ended, with the
/// target that was held then, so that it moves as it does in a trial that starts from the other
/// one's ending, to the bit. A part ends as it would alone, at its stop or its horizon, or when its
/// `until` holds; one that fails ends the trial.
class SkillSequence : public motion::Controller, public motion::Observer {
 public:
  /// @param places  of the whole; its parameters and task are set before begin()
  SkillSequence(const Skill& skill, Places& places);

  void begin(const motion::Moment& m, const control::JointTarget& held) override;
  void update(const motion::Moment& m) override;
  void command(const motion::Moment& m, motion::Senses& senses, control::Command& c) override;
  int phase() const override { return first_phase_[part_] + running().controller->phase(); }
  std::vector<std::string> phases() const override { return skill_->phaseNames(); }

  void begin(const motion::Moment& /*m*/) override {}  // a controller's comes first
  std::string_view ends(const motion::Moment& /*m*/) override { return ended_; }
  void see(const motion::Moment& m, bool last) override;

 private:
  struct Running {
    const Skill* skill = nullptr;
    std::unique_ptr<Places> places;
    std::unique_ptr<motion::Controller> controller;
    SkillSequence* nested = nullptr;  // the controller, where the part has parts itself
    std::unique_ptr<Measures> measures;
    std::vector<control::Expression> parameters;
    std::unique_ptr<control::Expression> task;
    std::optional<control::Expression> until;
    int steps = 0;  // of its horizon
  };
  const Running& running() const { return parts_[part_]; }
  motion::Moment since(const motion::Moment& m) const;
  void enter(size_t part, const motion::Moment& m, const control::JointTarget& held);
  std::string_view why(const motion::Moment& m);
  void over(const motion::Moment& m);
  void showStage(const motion::Moment& m);

  const Skill* skill_;
  Places* places_;
  std::vector<Running> parts_;
  std::vector<int> first_phase_;    // of each part, in phases()
  std::vector<int> first_failure_;  // in Skill::failures
  size_t part_ = 0;
  int begun_ = 0;      // step of the trial in which the part began
  int stage_ = -1;     // the phase that lasts
  int entered_ = 0;    // the step in which it began
  std::string ended_;  // why the trial ends
  control::JointTarget held_;
};

}  // namespace traceur::skill
