// Whole falls, planned and carried out.
#include "traceur/fall/fall_testing.h"

namespace traceur::fall {
namespace {

FallExperimentOptions withPoses(int poses) {
  FallExperimentOptions options;
  options.problem.poses = poses;
  return options;
}

TEST(FallExperiment, APlanHalvesTheImpulseOfASmallRobotAndTheSameTwice) {
  const auto falls = fallsOf("bioloid-gp");
  FallExperiment experiment(falls, falls->setup("one_foot", "forward"), withPoses(3000));
  const FallTrial held = experiment.run({1.5}, "hold").trial;
  const FallExperiment::Outcome planned = experiment.run({1.5}, "planned");
  ASSERT_TRUE(held.fell && planned.trial.fell);
  EXPECT_FALSE(held.diverged || planned.trial.diverged);
  EXPECT_LT(planned.trial.impulse, 0.6 * held.impulse);
  EXPECT_FALSE(planned.plan.contacts.empty());
  EXPECT_EQ(experiment.run({1.5}, "planned").trial.impulse, planned.trial.impulse);
  // A robot that lies still presses with its weight: the window's impulse is m g times it.
  const double rest = held.windowed.back().second;
  EXPECT_NEAR(rest, 1.6 * 9.81 * 0.01, 0.05);
}

TEST(FallSimulator, WhatIsMeasuredFitsTogether) {
  const auto falls = fallsOf("bioloid-gp");
  FallSimulator simulator(*falls, falls->setup("one_foot", "forward"));
  const FallProtocol protocol;
  for (const std::string strategy : {"hold", "limp"}) {
    sim::Recording recording;
    const FallTrial t = simulator.run({1.5}, strategy, {}, {.recording = &recording});
    ASSERT_TRUE(t.fell);
    EXPECT_GE(t.noticed, 0.1);  // not before the push is over
    // Impulses.
    EXPECT_DOUBLE_EQ(t.raw_impulse, t.peak_force * protocol.time_step);
    EXPECT_GE(t.impulse, t.raw_impulse);
    EXPECT_LE(t.impulse, t.peak_force * protocol.window);
    double windowed = 0;
    for (size_t i = 0; i < t.windowed.size(); ++i) {
      windowed = std::max(windowed, t.windowed[i].second);
      EXPECT_GE(t.windowed[i].second, -1e-12);
      EXPECT_NEAR(t.windowed[i].first - t.windowed[0].first, 0.001 * static_cast<double>(i), 1e-9);
    }
    EXPECT_LE(windowed, t.impulse);
    EXPECT_GT(windowed, 0.9 * t.impulse);
    // Contacts, each part once and in their order.
    ASSERT_FALSE(t.contacts.empty());
    std::set<std::string> parts;
    double largest = 0;
    double before = 0;
    for (const GroundContact& c : t.contacts) {
      EXPECT_TRUE(parts.insert(c.part).second) << c.part;
      EXPECT_GE(c.time, before);
      EXPECT_GE(c.impulse, 0);
      before = c.time;
      largest = std::max(largest, c.impulse);
    }
    EXPECT_EQ(largest, t.impulse);
    EXPECT_EQ(t.head_hit, parts.contains(falls->head));
    EXPECT_GT(t.peak_head, 0);
    // The COM from the pivot on, every 10 ms of what is left; frames of all, from the stance on.
    EXPECT_EQ(t.com.size(), 250U);
    EXPECT_NEAR(t.com[0].x(), t.start.pendulum.com().x(), 1e-12);
    EXPECT_GT(t.com.back().x(), 0.05);
    for (size_t i = 0; i < recording.frames.size(); ++i) {
      EXPECT_NEAR(recording.frames[i].state.time, 0.01 * static_cast<double>(i), 1e-9);
    }
    EXPECT_NEAR(recording.frames.back().state.time, t.noticed + protocol.settle, 0.0101);
    EXPECT_EQ(recording.phases, std::vector<std::string>({"push", strategy}));
    for (const sim::Frame& f : recording.frames) {
      EXPECT_EQ(f.phase, f.state.time < t.noticed - 1e-9 ? 0 : 1);
      if (strategy == "limp" && f.state.time > t.noticed + 0.001) {
        EXPECT_EQ(f.torque.norm(), 0);
      }
    }
    EXPECT_GT(t.peak_torque, 0);  // until then the stance is kept
    EXPECT_LE(t.peak_torque, 1);
  }
}

TEST(FallExperiment, SupportKeepsTheLegsFromGivingWay) {
  FallRobot falls = *fallsOf("atlas");
  const auto late = [&](double support) {  // the knees, against the plan [s]
    falls.tracking.support = support;
    FallExperiment experiment(std::make_shared<const FallRobot>(falls),
                              falls.setup("two_feet", "forward"), withPoses(3000));
    const FallExperiment::Outcome outcome = experiment.run({1500}, "planned");
    const PlannedContact& first = outcome.plan.contacts.front();
    EXPECT_EQ(experiment.problem().graph.nodes[first.action.contact].name, "knees");
    for (const GroundContact& c : outcome.trial.contacts) {
      if (c.part.ends_with("knee")) return c.time - outcome.trial.noticed - first.action.duration;
    }
    ADD_FAILURE() << "no knee touched";
    return 0.0;
  };
  const double given_way = late(0);
  const double borne = late(1);
  EXPECT_LT(given_way, -0.2);
  EXPECT_GT(borne, given_way + 0.05);  // not on time either: the knees are at their limit
}

TEST(FallExperiment, APlanThatCostsMoreThanKeepingThePoseIsNotFollowed) {
  // Once it sits, all that is left to plan is to throw the arms behind its back, for more than the
  // back costs that follows anyway. By that plan the fall ends at 0.66 of unplanned.
  const auto falls = fallsOf("atlas");
  FallExperiment experiment(falls, falls->setup("two_feet", "backward"));
  const double held = experiment.run({364}, "hold").trial.impulse;
  const FallTrial trial = experiment.run({364}, "planned").trial;
  ASSERT_GE(trial.contacts.size(), 2U);
  EXPECT_EQ(trial.contacts[0].part, "hips");
  EXPECT_EQ(trial.contacts[1].part, "back");
  EXPECT_LT(trial.impulse, 0.6 * held);
}

TEST(FallExperiment, NothingAsksMoreOfAJointThanItHas) {
  for (const auto& [robot, push] : {std::pair{"atlas", 2000.0}, std::pair{"bioloid-gp", 5.0}}) {
    const auto falls = fallsOf(robot);
    FallExperiment experiment(falls, falls->setups.front(), withPoses(2000));
    for (const std::string strategy : {"planned", "hold", "damp", "tuck"}) {
      const FallTrial trial = experiment.run({push}, strategy).trial;
      EXPECT_LE(trial.peak_torque, 1) << robot << " " << strategy;
      EXPECT_GT(trial.peak_torque, 0.1) << robot << " " << strategy;
    }
  }
}

TEST(FallExperiment, APushTooWeakMakesNoFall) {
  const auto falls = fallsOf("atlas");
  FallExperiment experiment(falls, falls->setup("two_feet", "forward"), withPoses(200));
  EXPECT_FALSE(experiment.run({50}, "hold").trial.fell);
}

TEST(FallExperiment, RefusesAStanceThatCannotStand) {
  auto falls = std::make_shared<FallRobot>(FallRobot::fromFile("models/bioloid-gp/falls.toml"));
  FallSetup setup = falls->setup("one_foot", "forward");
  setup.stands = true;
  EXPECT_THROW(FallExperiment(falls, setup, withPoses(10)), InputError);
  setup.graph.nodes[0].points = {"left_hand"};
  EXPECT_THROW(FallExperiment(falls, setup, withPoses(10)), InputError);
}

}  // namespace
}  // namespace traceur::fall
