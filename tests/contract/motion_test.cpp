// What every controller and every observer keeps to. A new one is tested by a line in its list.
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "traceur/fall/impulse_meter.h"
#include "traceur/fall/ways.h"
#include "traceur/motion/session.h"
#include "traceur/skill/skill_sequence.h"

namespace traceur {
namespace {

/// A BioloidGP that is pushed, for a second.
struct Trial {
  fall::FallRobot falls = fall::FallRobot::fromFile("models/bioloid-gp/falls.toml");
  std::shared_ptr<const sim::Model> model = sim::Model::fromScene({.robot = falls.robot});
  fall::SagittalBody body{model, falls.setups[0]};
  sim::State start = model->stateOf(falls.robot->poses.at(falls.setups[0].stance));
  fall::FallContext context{falls, body, start, [](auto&, auto&, auto&) { return std::nullopt; }};
  std::shared_ptr<const skill::Skill> jump = skill::Skill::fromFile("skills/bioloid-gp/jump.toml");
  skill::Places places{*jump};
  skill::SkillController nobody{jump, places};

  Trial() { places.parameters = jump->initialParameters(); }
  motion::TrialOptions options() const {
    return {.horizon = 1, .pushes = {{.body = model->root(), .force = {2, 0, 0}, .duration = 0.2}}};
  }
};

struct ControllerEntry {
  const char* name;
  std::function<std::unique_ptr<motion::Controller>(Trial&)> make;
};

std::vector<ControllerEntry> controllers() {
  std::vector<ControllerEntry> all = {
      {"SkillController",
       [](Trial& t) { return std::make_unique<skill::SkillController>(t.jump, t.places); }},
  };
  for (const fall::WayToFall& way : fall::allWays()) {
    all.push_back({way.name.data(), [&](Trial& t) { return way.make(t.context); }});
  }
  return all;
}

struct ObserverEntry {
  const char* name;
  std::function<std::unique_ptr<motion::Observer>(Trial&)> make;
};

std::vector<ObserverEntry> observers() {
  return {
      {"Measures",
       [](Trial& t) { return std::make_unique<skill::Measures>(*t.jump, t.places, t.nobody); }},
      {"ImpulseMeter",
       [](Trial& t) {
         return std::make_unique<fall::ImpulseMeter>(t.body, fall::FallProtocol{}, t.falls.head);
       }},
  };
}

/// Asks of the command what everyone who reads it relies on.
class Judge : public motion::Observer {
 public:
  Judge(const sim::Model& model, const motion::Controller& controller)
      : model_(&model), controller_(&controller) {}
  void commanded(const motion::Moment& /*m*/, const control::Command& c,
                 const sim::Torque& torque) override {
    ++commands;
    const auto joints = static_cast<Eigen::Index>(model_->joints().size());
    ASSERT_EQ(c.target.q.size(), joints);
    EXPECT_TRUE(c.target.q.allFinite());
    for (const Eigen::VectorXd* factors : {&c.stiffness, &c.damping}) {
      if (factors->size() == 0) continue;
      ASSERT_EQ(factors->size(), joints);
      EXPECT_GE(factors->minCoeff(), 0);
    }
    EXPECT_TRUE(torque.tau.allFinite());
    const auto phases = static_cast<int>(controller_->phases().size());
    EXPECT_GE(controller_->phase(), 0);
    EXPECT_LT(controller_->phase(), phases);
    EXPECT_GE(phases, phases_) << "phases may only become more";
    phases_ = phases;
  }

  int commands = 0;

 private:
  const sim::Model* model_;
  const motion::Controller* controller_;
  int phases_ = 0;
};

/// Lets an observer see, but not end, a trial.
class Muted : public motion::Observer {
 public:
  explicit Muted(motion::Observer& other) : other_(&other) {}
  void begin(const motion::Moment& m) override { other_->begin(m); }
  std::string_view ends(const motion::Moment& m) override {
    other_->ends(m);
    return {};
  }
  void see(const motion::Moment& m, bool last) override { other_->see(m, last); }
  void commanded(const motion::Moment& m, const control::Command& c,
                 const sim::Torque& torque) override {
    other_->commanded(m, c, torque);
  }

 private:
  motion::Observer* other_;
};

TEST(Controllers, TellEveryJointAndKeepNothingOfATrial) {
  Trial t;
  for (const ControllerEntry& entry : controllers()) {
    SCOPED_TRACE(entry.name);
    const auto trial = [&](motion::Controller& controller) {
      sim::World world(t.model);
      control::Actuation actuation(control::defaultController(t.model));
      Judge judge(*t.model, controller);
      const std::array<motion::Observer*, 1> watching = {&judge};
      motion::Session session(world, actuation, controller, watching);
      const motion::Trial ended = session.run(t.start, t.options());
      EXPECT_EQ(judge.commands, 1000);
      EXPECT_FALSE(ended.diverged);
      return ended.hash;
    };
    const auto used = entry.make(t);
    const std::uint64_t first = trial(*used);
    EXPECT_EQ(trial(*used), first);
    EXPECT_EQ(trial(*entry.make(t)), first);
  }
}

TEST(Observers, ChangeNothingOfWhatTheySee) {
  Trial t;
  const auto trial = [&](std::vector<motion::Observer*> watching) {
    sim::World world(t.model);
    control::Actuation actuation(control::defaultController(t.model));
    const auto hold = fall::wayNamed("hold").make(t.context);
    motion::Session session(world, actuation, *hold, watching);
    return session.run(t.start, t.options()).hash;
  };
  const std::uint64_t alone = trial({});
  for (const ObserverEntry& entry : observers()) {
    SCOPED_TRACE(entry.name);
    const auto observer = entry.make(t);
    Muted muted(*observer);
    EXPECT_EQ(trial({&muted}), alone);
    EXPECT_EQ(trial({&muted}), alone);
  }
}

}  // namespace
}  // namespace traceur
