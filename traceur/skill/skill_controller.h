// A skill's phases, forces and feedback, followed step by step.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "traceur/motion/controller.h"
#include "traceur/motion/joint_path.h"
#include "traceur/skill/bound.h"
#include "traceur/skill/places.h"

namespace traceur::skill {

/// Moves the targets from phase to phase:
///
///     q* = q₀ + min(1, t / T) (q₁ − q₀) + feedback
///
/// from where the last phase left them to this one's in its blend T, t since it was entered. What a
/// phase's targets and blend say is worked out as it is entered, its gains and forces in each step.
class SkillController : public motion::Controller {
 public:
  /// @param places  of the trial; its parameters and task are set before begin()
  SkillController(std::shared_ptr<const Skill> skill, Places& places);

  void begin(const motion::Moment& m, const control::JointTarget& held) override;
  void update(const motion::Moment& m) override;
  void command(const motion::Moment& m, motion::Senses& senses, control::Command& c) override;
  int phase() const override { return phase_; }
  std::vector<std::string> phases() const override;

 private:
  struct Target {
    int joint;
    double sign;
    control::Expression value;
  };
  struct Force {
    const ForceTerm* term;
    BoundVector force, moment;
  };
  struct Factor {
    int joint;
    control::Expression value;
  };
  struct Phase {
    std::vector<Target> targets;
    control::Expression blend;
    std::vector<Factor> stiffness, damping;
    std::unique_ptr<BoundReach> reach;
    std::unique_ptr<BoundFlight> flight;
    std::vector<Force> forces;
    std::vector<control::Expression> exits;
  };
  struct BoundFeedback {
    std::vector<Target> joints;
    const std::vector<bool>* during;
  };

  static std::vector<Target> bind(const std::vector<JointValue>& values,
                                  const control::Expression::Lookup& lookup);
  static std::vector<Factor> bind(const std::vector<GainFactor>& values,
                                  const control::Expression::Lookup& lookup);
  void enter(int phase, const motion::Moment& m);
  void solveReach(const motion::Moment& m);
  void factors(const std::vector<Factor>& from, VectorXd& to) const;
  void exert(const Force& force, const sim::Snapshot& s, std::vector<control::VirtualForce>& out);

  std::shared_ptr<const Skill> skill_;
  Places* places_;
  std::vector<Phase> phases_;
  std::vector<BoundFeedback> feedback_;
  bool senses_velocity_ = false;                 // feedback reads the COM's
  Vector3d sensed_velocity_ = Vector3d::Zero();  // [m/s]

  int phase_ = 0;
  int entered_step_ = 0;  // a phase's time is a whole number of steps, a difference of times is not
  double path_began_ = 0;         // [s]
  bool over_ = false;             // the last phase has ended, and is held
  int solved_step_ = 0;           // when its reach was solved last
  VectorXd wanted_;               // the pose that reach keeps near to
  bool follows_cop_ = false;      // some force's frame does
  std::optional<Vector3d> cop_;   // the last one of this phase
  control::JointTarget reached_;  // without feedback
  motion::JointPath path_;        // to the phase's targets
};

}  // namespace traceur::skill
