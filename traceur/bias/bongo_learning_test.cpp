#include "traceur/bias/bongo_learning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "traceur/bias/noisy_plant.h"
#include "traceur/core/error.h"
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

TEST_F(BongoMachineFile, SaysWhatIsWrongAndWhere) {
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
}

TEST(BongoLearning, EveryFilterIsToldByName) {
  const auto name_of = [](std::initializer_list<double> values) {
    const VectorXd x = Eigen::Map<const VectorXd>(values.begin(), 6);
    const int filter = bongoFilter(x);
    EXPECT_EQ(bongoKeeps(x), filter < 0);
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
  for (int i = 0; i < 2; ++i) logs.push_back(runMachine(machine, {}, parameters, 1, i).log);
  const auto models = bongoLearner({})(logs, 1);
  EXPECT_TRUE(models.by_chance);
  BongoBoard board;
  const VectorXd noise = readingNoise(logs, board, bongoKeeps);
  const BiasOptions o = bongoBias(BongoMethod::kBias, noise);
  std::vector<BiasSample> samples;
  for (const RunLog& log : logs) {
    const auto seen = samplesOf(log, board, o, bongoKeeps);
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
