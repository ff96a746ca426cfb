#include "traceur/bias/bongo_learning.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "traceur/bias/faulty_bongo_board.h"
#include "traceur/bias/noisy_plant.h"
#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"

namespace traceur::bias {
namespace {

class BongoMachineFile : public testing::Test {
 protected:
  BongoMachine read(const std::string& text) {
    std::ofstream(file) << text;
    return readBongoMachine(file);
  }
  std::string messageOf(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }
  TestFolder folder;
  std::filesystem::path file = folder / "machine.toml";
};

TEST_F(BongoMachineFile, HasEveryFaultByName) {
  const BongoMachine m = read(R"(
start_angle = 1
[faults]
inertia_scale = 1.2
torque_variance = 0.1
angle_variance = 1e-6
rate_variance = 1e-3
delay = 0.005
coulomb_friction = 2
viscous_friction = 3
com_offset = 0.002
torque_gain = 0.9
encoder_step = 3.1e-5
ground_friction = 0.3
board_friction = 0.8
)");
  EXPECT_NEAR(m.start_angle, 0.01745, 1e-5);
  EXPECT_EQ(m.faults.inertia_scale, 1.2);
  EXPECT_EQ(m.faults.rate_variance, 1e-3);
  EXPECT_EQ(m.faults.board_friction, 0.8);
  EXPECT_EQ(read("").faults.inertia_scale, 1);
}

TEST_F(BongoMachineFile, EveryFaultHasItsPlaceAndItsBounds) {
  for (const BongoFaultField& field : bongoFaultFields()) {
    const auto with = [&](double value) {
      return fmt::format("[faults]\n{} = {:.17g}\n", field.name, value);
    };
    for (const double value :
         {field.least, field.most, field.least + (field.most - field.least) / 4}) {
      BongoFaults expected;
      expected.*field.value = value;
      const BongoFaults faults = read(with(value)).faults;
      for (const BongoFaultField& other : bongoFaultFields()) {
        EXPECT_EQ(faults.*other.value, expected.*other.value) << field.name << " " << other.name;
      }
    }
    EXPECT_NE(messageOf(with(field.least - 0.01)), "") << field.name;
    EXPECT_NE(messageOf(with(field.most + 0.01)), "") << field.name;
  }
  EXPECT_NEAR(read("start_angle = 2").start_angle, 2 * M_PI / 180, 1e-12);
  EXPECT_EQ(read("start_angle = 0").start_angle, 0);
  EXPECT_NE(messageOf("start_angle = -0.1"), "");
  EXPECT_NE(messageOf("start_angle = 5.8"), "");
}

TEST_F(BongoMachineFile, BoundsAreTheOnesThatAreTold) {
  std::string bounds;
  for (const BongoFaultField& field : bongoFaultFields()) {
    bounds += fmt::format("{} {} {}\n", field.name, field.least, field.most);
  }
  EXPECT_EQ(bounds, R"(inertia_scale 0.1 10
torque_variance 0 10000
angle_variance 0 1
rate_variance 0 100
delay 0 0.5
coulomb_friction 0 100
viscous_friction 0 100
com_offset -0.1 0.1
torque_gain 0 10
encoder_step 0 0.1
ground_friction 0 10
board_friction 0 10
)");
}

TEST_F(BongoMachineFile, SaysWhatIsWrongAndWhere) {
  EXPECT_NE(messageOf("angle = 1\n").find("angle"), std::string::npos);
  // Whole steps but for rounding: a millionth of one.
  EXPECT_EQ(messageOf("[faults]\ndelay = 0.0050000005\n"), "");
  EXPECT_NE(messageOf("[faults]\ndelay = 0.0050000015\n").find("whole steps"), std::string::npos);
  EXPECT_NE(messageOf("[faults]\ndelay = 0.0049999985\n").find("whole steps"), std::string::npos);
  EXPECT_NE(messageOf("[faults]\ndelays = 1\n").find(":2:"), std::string::npos);
  EXPECT_NE(messageOf("[faults]\ndelays = 1\n").find("delay"), std::string::npos);
  EXPECT_NE(messageOf("[faults]\ndelay = -1\n").find("expected 0 to 0.5"), std::string::npos);
  EXPECT_NE(messageOf("[faults]\ndelay = 0.0026\n").find("whole steps"), std::string::npos);
  EXPECT_NE(messageOf("start_angle = \"far\"\n").find("number"), std::string::npos);
}

TEST(BongoLearning, NamesThatThereAreNotAreRefusedWithThoseThereAre) {
  EXPECT_EQ(bongoMethod("identify"), BongoMethod::kIdentify);
  EXPECT_EQ(bongoSearch("published"), BongoSearch::kPublished);
  EXPECT_THROW(bongoMethod("magic"), InputError);
  EXPECT_THROW(bongoSearch("magic"), InputError);
}

TEST(BongoLearning, StartsLieWithinTheAngleAndComeInPairs) {
  BongoLearning o;
  o.start_angle = 0.03;
  for (const BongoSearch search : {BongoSearch::kStarts, BongoSearch::kPublished}) {
    o.search = search;
    const BiasTask task = bongoTask(o);
    EXPECT_EQ(task.lower, VectorXd(VectorXd::Constant(5, -10)));
    EXPECT_EQ(task.upper, VectorXd(VectorXd::Constant(5, 10)));
    EXPECT_EQ(task.success, 200);
    EXPECT_EQ(task.most, 200.0 * 5001);
    ASSERT_EQ(task.starts.size(), search == BongoSearch::kStarts ? 7U : 1U);
    EXPECT_EQ(task.starts[0], VectorXd(bongoStart(0, 0.25 * M_PI / 180)));
    std::set<std::pair<double, double>> corners;
    for (size_t i = 1; i < task.starts.size(); ++i) {
      const VectorXd& x = task.starts[i];
      EXPECT_EQ(x.tail(4), VectorXd(VectorXd::Zero(4)));
      EXPECT_EQ(std::abs(x[0]), std::abs(x[1]));
      EXPECT_LE(std::abs(x[0]), 0.03);
      EXPECT_TRUE(corners.insert({x[0], x[1]}).second);
    }
    for (const auto& [wheel, board] : corners) EXPECT_TRUE(corners.contains({-wheel, -board}));
    if (!corners.empty()) {  // the easiest first; those with a level board only near by
      EXPECT_TRUE(corners.contains({0.6 * 0.03, -0.6 * 0.03}));
      EXPECT_TRUE(corners.contains({0.6 * 0.03, 0.6 * 0.03}));
      EXPECT_TRUE(corners.contains({0.03, 0.03}));
      EXPECT_FALSE(corners.contains({0.03, -0.03}));
      EXPECT_EQ(std::abs(task.starts[1][0]), 0.6 * 0.03);
    }
    ASSERT_EQ(task.many_starts.size(), 20U);
    double most[2] = {0, 0};
    for (const VectorXd& x : task.many_starts) {
      for (int i = 0; i < 2; ++i) most[i] = std::max(most[i], std::abs(x[i]));
      EXPECT_EQ(x.tail(4), VectorXd(VectorXd::Zero(4)));
    }
    for (const double angle : most) {
      EXPECT_LE(angle, 0.03);
      EXPECT_GT(angle, 0.02);
    }
    BongoBoard board;
    VectorXd parameters(5);
    parameters << 7.4, 3.1, -2.45, -1.3, 5.45;
    EXPECT_EQ(task.run(board, parameters, task.starts[0]),
              balance(board, {}, BalancePolicy::of(parameters), task.starts[0]).cost);

    const BiasLoopOptions loop = bongoLoop(o);
    EXPECT_EQ(loop.iterations, o.iterations);
    EXPECT_EQ(loop.runs, o.runs);
    EXPECT_EQ(loop.warm, search == BongoSearch::kStarts);
    if (search == BongoSearch::kStarts) {
      EXPECT_EQ(loop.search.good, 200 + 6 * 200.0 * 5001);
      EXPECT_EQ(loop.search.success, 200);
      EXPECT_EQ(loop.search.polish, 300);
      EXPECT_EQ(loop.search.polish_step, 0.05);
    } else {
      EXPECT_EQ(loop.search.polish, 0);
      EXPECT_EQ(loop.search.good, -INFINITY);
    }
    o.seed = 7;
    EXPECT_EQ(bongoLoop(o).search.seed, 7000U);  // an iteration adds one
    o.seed = 1;
  }
}

TEST(BongoLearning, MachinesRunFromWithinTheAngleAndSuccessesAreCounted) {
  BongoMachine machine;
  machine.start_angle = 0.004;
  VectorXd parameters(5);
  parameters << 7.4, 3.1, -2.45, -1.3, 5.45;
  double most[2] = {0, 0};
  for (int number = 0; number < 12; ++number) {
    const RunLog log = runMachine(machine, {}, VectorXd::Zero(5), 3, number).log;
    for (int i = 0; i < 2; ++i) most[i] = std::max(most[i], std::abs(log.x(i, 0)));
  }
  for (const double angle : most) {
    EXPECT_LE(angle, 0.004 + 1e-6);
    EXPECT_GT(angle, 0.002);
  }
  EXPECT_EQ(successes(machine, {}, parameters, 4, 1, {}), 4);
  EXPECT_EQ(successes(machine, {}, VectorXd::Zero(5), 4, 1, {}), 0);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(successes(machine, {}, parameters, 4, 1, stop.get_token()), 0);
}

TEST(BongoLearning, ScalesAndLengthsAreOfAllInputs) {
  for (const BongoMethod method : {BongoMethod::kBias, BongoMethod::kPublished}) {
    const BiasOptions o = bongoBias(method);
    // Six states, the torque, and what a method adds to them.
    const auto inputs = static_cast<Eigen::Index>(7 + o.lags.size() + o.directions.size());
    EXPECT_EQ(inputs, method == BongoMethod::kPublished ? 7 : 10);
    ASSERT_EQ(o.input_scale.size(), inputs);
    EXPECT_EQ(o.input_scale.head(3), VectorXd(VectorXd::Ones(3)));
    EXPECT_EQ(o.input_scale.segment(3, 3), VectorXd(VectorXd::Constant(3, 0.1)));
    EXPECT_EQ(o.kernel.lengths, VectorXd(VectorXd::Ones(inputs)));
    EXPECT_EQ(o.kernel.signal, 1);
    EXPECT_DOUBLE_EQ(o.kernel.noise, std::exp(-2));
    EXPECT_EQ(o.output_scale.head(3).isZero(), method == BongoMethod::kBias);
    EXPECT_EQ(o.outlier, 1);
    for (const VectorXd& lengths : o.other_lengths) EXPECT_EQ(lengths.size(), inputs);
  }
  EXPECT_EQ(bongoBias(BongoMethod::kPublished).average, 1);
}

TEST(BongoLearning, ABiasIsLearnedWithTheNumbersItWasPublishedAndTriedWith) {
  const auto expect = [](const VectorXd& got, std::initializer_list<double> numbers) {
    EXPECT_EQ(got, VectorXd(Eigen::Map<const VectorXd>(numbers.begin(),
                                                       static_cast<Eigen::Index>(numbers.size()))));
  };
  const BiasOptions published = bongoBias(BongoMethod::kPublished);
  expect(published.input_scale, {1, 1, 1, .1, .1, .1, .01});
  expect(published.output_scale, {1, 1, 1, .1, .1, .1});
  EXPECT_TRUE(published.other_lengths.empty());
  const BiasOptions ours = bongoBias(BongoMethod::kBias);
  EXPECT_EQ(ours.lags, std::vector<int>({5, 10}));
  EXPECT_EQ(ours.directions, std::vector<Eigen::Index>({5}));
  expect(ours.input_scale, {1, 1, 1, .1, .1, .1, .01, .01, .01, 1});
  expect(ours.output_scale, {0, 0, 0, 100, 100, 100});
  ASSERT_EQ(ours.other_lengths.size(), 4U);
  expect(ours.other_lengths[0], {1, 1, 1, 1, 1, 1, 1, 1, 1, 1});
  expect(ours.other_lengths[1], {1, 1, 1, 1, 1, 1, 1, 1, 1, 100});
  expect(ours.other_lengths[2], {2, 2, 2, 2, 2, 2, 2, 2, 2, 1});
  expect(ours.other_lengths[3], {2, 2, 2, 2, 2, 2, 2, 2, 2, 100});
  EXPECT_TRUE(ours.other_signals.empty());

  const auto with = [](double variance) {
    VectorXd noise(6);
    noise << 1e-3, 1e-3, 1e-3, 0.5 * variance, variance, 1.5 * variance;
    return bongoBias(BongoMethod::kBias, noise);
  };
  // √(2 v) / 20 · 100: both ends of a difference over 20 steps, scaled. Up to 1 it is added.
  EXPECT_NEAR(with(0.016).kernel.noise, std::hypot(std::exp(-2), std::sqrt(0.032) * 5), 1e-12);
  EXPECT_EQ(with(0.0199).noise.size(), 0);
  const BiasOptions strong = with(0.0201);
  expect(strong.output_scale, {0.2});
  EXPECT_EQ(strong.other_signals, std::vector<double>({0.3, 0.1, 0.03, 0.01}));
  EXPECT_EQ(strong.noise[5], 1.5 * 0.0201);
  for (const double variance : {0.0201, 0.128}) {
    const double slope = 0.001 * BongoBoard().acceleration(BongoBoard::State::Zero(), 1)[2];
    const double wanted = 12 * variance * std::pow(0.2 / slope, 2) / std::exp(-4);
    const int k = static_cast<int>(std::ceil(std::cbrt(wanted)));
    EXPECT_EQ(with(variance).average, k);
    EXPECT_NEAR(with(variance).kernel.noise, std::exp(-2) * std::sqrt(1 + wanted / (k * k * k)),
                1e-6);
  }
}

/// Old results can be had again only so.
TEST(BongoLearning, WhatASeedDrawsStaysWhatItIs) {
  BongoMachine machine;
  machine.start_angle = 0.012;
  machine.faults.angle_variance = 1e-8;
  const auto drawn = [](Random& random) {
    const double wheel = random.uniform(-0.012, 0.012);
    return bongoStart(wheel, random.uniform(-0.012, 0.012));
  };
  VectorXd parameters(5);
  parameters << 7.4, 3.1, -2.45, -1.3, 5.45;
  for (int number = 0; number < 3; ++number) {
    Random random(4, 1, number);
    const VectorXd start = drawn(random);
    BongoHardware hardware({}, machine.faults, random.bits());
    hardware.reset(start);
    EXPECT_EQ(VectorXd(runMachine(machine, {}, VectorXd::Zero(5), 4, number).log.x.col(0)),
              hardware.state());
  }
  int good = 0;
  for (int i = 0; i < 8; ++i) {
    Random random(4, 2, i);
    const VectorXd start = drawn(random);
    BongoHardware hardware({}, machine.faults, random.bits());
    const bool failed = balance(hardware, {}, BalancePolicy::of(parameters), start).failed();
    good += !failed;
  }
  EXPECT_GT(good, 0);
  EXPECT_LT(good, 8);
  EXPECT_EQ(successes(machine, {}, parameters, 8, 4), good);
  BongoLearning o;
  o.seed = 4;
  o.start_angle = 0.012;
  Random many(4, 4);
  for (const VectorXd& start : bongoTask(o).many_starts) EXPECT_EQ(start, VectorXd(drawn(many)));

  o.method = BongoMethod::kRandomise;
  const LearnedModels models = bongoLearner(o)({}, 3);
  ASSERT_EQ(models.plants.size(), 4U);
  Random faults(4, 3, 3);
  for (const auto& model : models.plants) {
    BongoModelFaults f;
    f.inertia_scale = faults.uniform(0.75, 1.35);
    f.delay = faults.uniform(0, 0.008);
    f.coulomb_friction = faults.uniform(0, 3);
    f.com_offset = faults.uniform(-0.003, 0.003);
    FaultyBongoBoard expected({}, f);
    expected.reset(VectorXd::Zero(6));
    model->reset(VectorXd::Zero(6));
    for (int t = 0; t < 30; ++t) {
      expected.step(VectorXd::Constant(1, 20));
      model->step(VectorXd::Constant(1, 20));
    }
    EXPECT_EQ(model->state(), expected.state());
  }
}

TEST(BongoLearning, AMachineIsLearnedUntilItIsToStop) {
  std::stop_source stop;
  stop.request_stop();
  const BiasLearned learned = learnOnMachine({}, {}, stop.get_token());
  EXPECT_TRUE(learned.stopped);
  EXPECT_EQ(learned.plant_runs, 0);
  BongoLearning none;
  none.iterations = 0;
  EXPECT_FALSE(learnOnMachine({}, none).stopped);
}

TEST(BongoLearning, ACostCanBeToldFromALogAlone) {
  BongoMachine machine;
  machine.faults.delay = 0.005;
  machine.start_angle = 0.02;
  VectorXd parameters = VectorXd::Zero(5);
  for (int number = 0; number < 3; ++number) {
    const PlantRun run = runMachine(machine, {}, parameters, 4, number);
    const Episode seen = episodeOf(run.log, {});
    EXPECT_EQ(run.cost, seen.cost) << number;
    EXPECT_TRUE(seen.failed());
    EXPECT_NE(seen.failure, "end of the log");
    EXPECT_EQ(run.cost, runMachine(machine, {}, parameters, 4, number).cost);
    parameters[number] = 3;
  }
}

TEST(BongoLearning, ARunThatWasCutShortDidNotSucceed) {
  RunLog log = runMachine({}, {}, VectorXd::Zero(5), 4, 0).log;
  log.x.conservativeResize(Eigen::NoChange, 101);
  log.u.conservativeResize(Eigen::NoChange, 100);
  const Episode seen = episodeOf(log, {});
  EXPECT_EQ(seen.steps, 100);
  EXPECT_EQ(seen.failure, "end of the log");
  EXPECT_GT(seen.cost, 200 * 4900);
  // One that was asked for no more steps did.
  for (const int steps : {99, 100}) {
    const Episode whole = episodeOf(log, {}, {.steps = steps});
    EXPECT_EQ(whole.steps, steps);
    EXPECT_FALSE(whole.failed());
    double farthest = 0;  // and nothing was pushed
    for (int t = 0; t < steps; ++t) farthest = std::max(farthest, BalanceCost().of(log.x.col(t)));
    EXPECT_LT(farthest, 1);
    EXPECT_EQ(whole.cost, farthest);
  }
}

TEST(BongoLearning, EveryFilterIsToldByName) {
  const auto name_of = [](std::initializer_list<double> values) {
    const VectorXd x = Eigen::Map<const VectorXd>(values.begin(), 6);
    const int filter = bongoFilter({}, x);
    EXPECT_EQ(bongoKeeps({})(x), filter < 0);
    return filter < 0 ? std::string_view() : bongoFilters()[filter].name;
  };
  EXPECT_EQ(name_of({0, 0, 0, 0, 0, 0}), "");
  EXPECT_EQ(name_of({0, 0.2, 0.45, 3, 3, 0}), "");
  EXPECT_EQ(name_of({0, 0.36, 0, 0, 0, 0}), "board on the ground");
  EXPECT_EQ(name_of({2.3, -2.3, 0, 0, 0, 0}), "distance");
  EXPECT_EQ(name_of({0, 0.2, 0.6, 0, 0, 0}), "body angle");
  EXPECT_EQ(name_of({0, 0.31, 0, 0, 0, 0}), "board angle");
  EXPECT_EQ(name_of({0, 0, 0, 4, 3, 0}), "rate");
  EXPECT_NE(name_of({NAN, 0, 0, 0, 0, 0}), "");
  EXPECT_TRUE(std::isnan(bongoFilters()[1].threshold));  // not judged
  // A board on a larger wheel leans further before it is on the ground.
  BongoParameters high;
  high.wheel_radius *= 1.5;
  VectorXd leaning = VectorXd::Zero(6);
  leaning[1] = 0.36;
  EXPECT_EQ(bongoFilter({}, leaning), 0);
  EXPECT_NE(bongoFilter(high, leaning), 0);
  // What is at a threshold is kept; left is as right.
  const auto both = [&](std::initializer_list<double> values, const std::string& name) {
    std::vector<double> mirrored;
    for (const double x : values) mirrored.push_back(-x);
    EXPECT_EQ(name_of(values), name);
    EXPECT_EQ(bongoFilter({}, Eigen::Map<const VectorXd>(mirrored.data(), 6)),
              bongoFilter({}, Eigen::Map<const VectorXd>(values.begin(), 6)));
  };
  both({2.125, -2.125, 0.25, 0, 0, 0}, "");
  both({2.125, -2.125, 0.251, 0, 0, 0}, "distance");
  both({0, 0, 0.7, 0, 0, 0}, "");
  both({0, 0, 0.701, 0, 0, 0}, "body angle");
  both({0.125, 0.125, 0.5, 0, 0, 0}, "body angle");
  both({0, 0.3, 0, 0, 0, 0}, "");
  both({0.15, 0.151, 0, 0, 0, 0}, "board angle");
  for (const double rate : {6.2, 6.201}) {
    const std::string name = rate > 6.2 ? "rate" : "";
    both({0, 0, 0, rate, -3, 0}, name);
    both({0, 0, 0, -3, rate, 0}, name);
    both({0, 0, 0, 2, rate - 2, 0}, name);
  }
}

TEST(BongoLearning, SamplesAreCountedByTheFilterThatIsAgainstThem) {
  RunLog log = runMachine({}, {}, VectorXd::Zero(5), 4, 0).log;
  const BiasOptions o = bongoBias(BongoMethod::kBias);
  const BongoSamples whole = bongoSamples({log}, {}, o);
  ASSERT_GT(whole.kept.size(), 4U);
  log.x(2, 10) += 3;  // a reading of the joint that jumps: leans too much
  log.x(3, 50) += 12;
  log.x(4, 50) -= 12;  // both are too fast
  log.x(5, 90) += 20;  // nothing but the model says no
  const BongoSamples left = bongoSamples({log}, {}, o);
  EXPECT_EQ(left.kept.size(), whole.kept.size() - 3);
  EXPECT_EQ(left.left_out[3], whole.left_out[3] + 1);
  EXPECT_EQ(left.left_out[5], whole.left_out[5] + 1);
  EXPECT_EQ(left.left_out[6], whole.left_out[6] + 1);
}

/// Without faults every method's models are of use from the first, and no logs change nothing.
TEST(BongoLearning, EveryMethodMakesModels) {
  for (const std::string& name : bongoMethods()) {
    BongoLearning o;
    o.method = bongoMethod(name);
    const ModelLearner learner = bongoLearner(o);
    BongoMachine machine;
    machine.faults.inertia_scale = 1.2;
    const std::vector<RunLog> logs = {runMachine(machine, {}, VectorXd::Zero(5), 1, 0).log};
    for (const auto& seen : {std::vector<RunLog>(), logs}) {
      const auto models = learner(seen, 0);
      ASSERT_FALSE(models.plants.empty()) << name;
      for (const auto& model : models.plants) {
        model->reset(bongoStart(0, 0.004));
        model->step(VectorXd::Zero(1));
        EXPECT_TRUE(model->state().allFinite()) << name;
      }
    }
  }
}

/// Each is what its parts make of the logs; those that heed noise have it, and by chance is what is
/// too noisy to see a rate's bias.
TEST(BongoLearning, EveryMethodsModelsAreWhatItSays) {
  BongoMachine machine;
  machine.faults.inertia_scale = 1.2;
  VectorXd parameters(5);
  parameters << 7.4, 3.1, -2.45, -1.3, 5.45;
  const auto moved = [](Plant& plant) {
    plant.reset(bongoStart(0.001, 0.004));
    for (int t = 0; t < 5; ++t) plant.step(VectorXd::Constant(1, 10));
    return VectorXd(plant.state());
  };
  BongoBoard board;
  const auto nominal = [] { return std::make_unique<BongoBoard>(); };
  for (const double variance : {0.0001, 0.128}) {
    machine.faults.rate_variance = variance;
    RunLog log = runMachine(machine, {}, parameters, 1, 0).log;
    log.x.conservativeResize(Eigen::NoChange, std::min<Eigen::Index>(log.x.cols(), 1001));
    log.u.conservativeResize(Eigen::NoChange, log.x.cols() - 1);
    const std::vector<RunLog> logs = {log};
    const VectorXd noise = readingNoise(logs, board, bongoKeeps({}));
    for (const int iteration : {0, 2}) {
      const auto model = [&](BongoMethod method) {
        BongoLearning o;
        o.seed = 6;
        o.method = method;
        LearnedModels models = bongoLearner(o)(logs, iteration);
        EXPECT_EQ(models.plants.size(), 1U);
        const bool heeds = method == BongoMethod::kBias || method == BongoMethod::kIdentify;
        EXPECT_EQ(models.by_chance, heeds && variance > 0.02);
        return moved(*models.plants[0]);
      };
      const auto noisy = [&](std::unique_ptr<Plant> plant) {
        NoisyPlant with(std::move(plant), noise, Random(6, 5, iteration).bits());
        return moved(with);
      };
      EXPECT_EQ(model(BongoMethod::kNone), moved(board));
      LearnedModels published =
          biasLearner(nominal, bongoBias(BongoMethod::kPublished), bongoKeeps({}))(logs, 0);
      EXPECT_EQ(model(BongoMethod::kPublished), moved(*published.plants[0]));
      LearnedModels bias =
          biasLearner(nominal, bongoBias(BongoMethod::kBias, noise), bongoKeeps({}))(logs, 0);
      EXPECT_EQ(model(BongoMethod::kBias), noisy(std::move(bias.plants[0])));
      const BongoModelFaults faults =
          identify(logs, {}, bongoBias(BongoMethod::kIdentify), bongoKeeps({}));
      EXPECT_EQ(model(BongoMethod::kIdentify),
                noisy(std::make_unique<FaultyBongoBoard>(BongoParameters(), faults)));
    }
  }
}

TEST(BongoLearning, NoiseThatHidesABiasLeavesThatOfTheTorque) {
  const auto noise = [](double of_rates) {
    VectorXd v(6);
    v << VectorXd::Constant(3, 1e-3 * of_rates), VectorXd::Constant(3, of_rates);
    return v;
  };
  const BiasOptions quiet = bongoBias(BongoMethod::kBias);
  const BiasOptions some = bongoBias(BongoMethod::kBias, noise(0.016));
  EXPECT_EQ(some.output_scale.size(), 6);
  EXPECT_EQ(some.average, quiet.average);
  EXPECT_GT(some.kernel.noise, quiet.kernel.noise);
  const BiasOptions strong = bongoBias(BongoMethod::kBias, noise(0.128));
  EXPECT_EQ(strong.output_scale.size(), 1);
  EXPECT_GT(strong.average, 2 * quiet.average);
  // Averaged until a torque's noise is the kernel's: together √2 of it, less what the whole number
  // of readings is more than that takes.
  EXPECT_LE(strong.kernel.noise, std::sqrt(2) * quiet.kernel.noise);
  EXPECT_GT(strong.kernel.noise, 1.3 * quiet.kernel.noise);
  EXPECT_EQ(bongoBias(BongoMethod::kPublished, noise(0.128)).noise.size(), 0);
}

/// Of a heavier machine that reads 0.01 rad and 0.36 rad/s wrong: that it answers less.
TEST(BongoLearning, AHeavierMachineIsToldThroughTheStrongestNoise) {
  BongoMachine machine;
  machine.faults = {.inertia_scale = 1.2,
                    .torque_variance = 0.1,
                    .angle_variance = 1.28e-4,
                    .rate_variance = 0.128};
  VectorXd parameters(5);  // balances on it
  parameters << 7.4, 3.1, -2.45, -1.3, 5.45;
  std::vector<RunLog> logs;
  logs.reserve(2);
  for (int i = 0; i < 2; ++i) logs.push_back(runMachine(machine, {}, parameters, 1, i).log);
  const auto models = bongoLearner({})(logs, 1);
  EXPECT_TRUE(models.by_chance);
  BongoBoard board;
  const VectorXd noise = readingNoise(logs, board, bongoKeeps({}));
  const BiasOptions o = bongoBias(BongoMethod::kBias, noise);
  std::vector<BiasSample> samples;
  for (const RunLog& log : logs) {
    const auto seen = samplesOf(log, board, o, bongoKeeps({}));
    samples.insert(samples.end(), seen.begin(), seen.end());
  }
  const DynamicsBias bias(spread(samples, o), o);
  DynamicsBias::Scratch scratch;
  VectorXd u = VectorXd::Constant(4, 20);  // of now, twice earlier, and the direction
  u[3] = 0;
  VectorXd g;
  bias.predict(VectorXd::Zero(6), u, g, scratch);
  EXPECT_NEAR(g[0], -20.0 / 6, 1.7);
  bias.predict(VectorXd::Zero(6), VectorXd::Zero(4), g, scratch);
  EXPECT_NEAR(g[0], 0, 0.5);
}

}  // namespace
}  // namespace traceur::bias
