// One trial of a skill, from its start to a verdict.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "traceur/control/stable_pd.h"
#include "traceur/motion/session.h"
#include "traceur/sim/recording.h"
#include "traceur/skill/skill.h"

namespace traceur::skill {

/// What one trial did. A fall, or a simulation that diverged, is a value.
struct Rollout {
  double cost = 0;             ///< NaN where a measure that it needs saw nothing
  std::vector<double> terms;   ///< by Skill::terms
  std::vector<bool> violated;  ///< by Skill::failures
  /// The simulation left the finite numbers or had no room for all contacts: cost means nothing.
  bool diverged = false;
  double achieved = 0;  ///< in the task's unit; NaN for a skill that does not say
  double time = 0;      ///< when it ended [s]
  /// "horizon", "stop", "diverged", "too many contacts" or the failure's name.
  std::string ended;
  std::vector<double> measures;  ///< by Skill::measures
  std::uint64_t hash = 0;        ///< of the states every 10 ms and of the last one

  bool failed() const;
};

/// The robot's controller with what the skill changes in it.
control::StablePd controllerOf(const Skill& skill);

/// What happens to a robot in a trial.
struct Meddling {
  std::vector<motion::Push> pushes = {};
  std::vector<motion::Drag> drags = {};
  std::vector<motion::Shot> shots = {};
};

/// One thread's workspace for rollouts of one skill; made once, used for many.
class Runner {
 public:
  /// @throws InputError when the skill starts where another one's trial ends and that trial fails
  explicit Runner(std::shared_ptr<const Skill> skill);
  ~Runner();
  Runner(Runner&&) noexcept;
  Runner& operator=(Runner&&) = delete;

  /// The time [s], the phase's index and each joint's target, feedback included [rad].
  using OnTarget = std::function<void(double time, int phase, const control::JointTarget&)>;

  /// Who else watches the trials to come; they outlive this.
  /// @param joint_forces  whether one of them reads Snapshot::jointForces
  void watchedBy(const std::vector<motion::Observer*>& observers, bool joint_forces);
  /// What the trials to come are put under, in the order of Skill::conditions; empty: the initial
  /// ones.
  /// @throws InputError for a wrong number of them, or NaN among them
  void under(const VectorXd& conditions);
  /// Where a trial with these would begin.
  /// @throws InputError as run() does
  sim::State start(const VectorXd& parameters, double task);
  /// Where the trials to come begin instead; nothing: where the skill says.
  void beginsAt(const std::optional<sim::State>& start);
  /// What else happens to the robot in the trials to come, besides the skill's pushes.
  void meddledWith(const Meddling& how);
  /// Runs the skill. Equal arguments and conditions give equal bits in any Runner on any thread.
  /// @param parameters  (n), in the order and units of Skill::parameters
  /// @param recording   filled every kInterval when given
  /// @param on_target   called with what the joints are told, whenever the controller decides
  /// @param start       where another trial of the same scene ended, instead of the skill's start
  /// @throws InputError for a wrong number of parameters, or NaN among them
  Rollout run(const VectorXd& parameters, double task, sim::Recording* recording = nullptr,
              const OnTarget& on_target = {}, const motion::Ending* start = nullptr);
  /// From where another trial can go on after the last run.
  motion::Ending ending() const;

  /// What the last run would have cost for another task, where the motion does not depend on it.
  double costOf(double task);
  /// Whether "task" stands elsewhere than in costs and "achieved": a trial is of one task then.
  bool motionDependsOnTask() const;
  /// Whether "task" is read by a cost.
  bool costDependsOnTask() const;

  /// Time between a recording's frames [s]; rounded to whole steps.
  static constexpr double kInterval = 0.01;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace traceur::skill
