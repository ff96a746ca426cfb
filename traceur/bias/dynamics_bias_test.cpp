#include "traceur/bias/dynamics_bias.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/bias/bongo_board.h"
#include "traceur/bias/bongo_hardware.h"
#include "traceur/bias/test_states.h"
#include "traceur/core/error.h"
#include "traceur/core/random.h"

namespace traceur::bias {
namespace {

/// x' = x + (a x + b u) Δt: a plant whose bias is known.
class Line : public Plant {
 public:
  Line(double a, double b) : a_(a), b_(b) {}
  int states() const override { return 1; }
  int inputs() const override { return 1; }
  double timeStep() const override { return 0.01; }
  void reset(const VectorXd& x) override { x_ = x; }
  void step(const VectorXd& u) override { x_ += 0.01 * (a_ * x_ + b_ * u); }
  const VectorXd& state() const override { return x_; }

 private:
  double a_, b_;
  VectorXd x_ = VectorXd::Zero(1);
};

BiasOptions lineOptions() {
  BiasOptions o;
  o.input_scale = VectorXd::Ones(2);
  o.output_scale = VectorXd::Constant(1, 100);
  o.kernel = {VectorXd::Constant(2, 2), 1, 0.01};
  o.average = 1;
  o.stride = 3;
  return o;
}

template <typename P>
RunLog drive(P& plant, const VectorXd& x0, int steps, const std::function<double(int)>& input) {
  RunLog log{plant.timeStep(), MatrixXd(x0.size(), steps + 1), MatrixXd(1, steps)};
  plant.reset(x0);
  log.x.col(0) = plant.state();
  for (int t = 0; t < steps; ++t) {
    log.u(0, t) = input(t);
    plant.step(log.u.col(t));
    log.x.col(t + 1) = plant.state();
  }
  return log;
}

TEST(DynamicsBias, OfAPlantThatDiffersByALineIsThatLine) {
  Line model(-1, 1), plant(-1.3, 0.8);
  const BiasOptions o = lineOptions();
  const RunLog log = drive(plant, VectorXd::Ones(1), 150, [](int t) { return std::sin(0.1 * t); });
  const DynamicsBias bias(samplesOf(log, model, o, all), o);
  EXPECT_EQ(bias.samples(), 50);
  DynamicsBias::Scratch scratch;
  VectorXd g;
  const double weight =
      bias.predict(VectorXd::Constant(1, 0.4), VectorXd::Constant(1, 0.5), g, scratch);
  EXPECT_NEAR(g[0], 0.01 * (-0.3 * 0.4 - 0.2 * 0.5), 1e-4);
  EXPECT_GT(weight, 0.99);
  // Far from all samples the model stands as it is.
  bias.predict(VectorXd::Constant(1, 40), VectorXd::Zero(1), g, scratch);
  EXPECT_LT(std::abs(g[0]), 1e-6);

  CorrectedPlant corrected(std::make_unique<Line>(model),
                           std::make_shared<const DynamicsBias>(bias));
  const auto input = [](int t) { return 0.5 * std::cos(0.2 * t); };
  const VectorXd x0 = VectorXd::Constant(1, 0.8);
  const RunLog truth = drive(plant, x0, 60, input);
  const double better = (drive(corrected, x0, 60, input).x - truth.x).norm();
  const double nominal = (drive(model, x0, 60, input).x - truth.x).norm();
  EXPECT_LT(better, 0.05 * nominal);
}

TEST(DynamicsBias, AveragesOverStepsAndSkipsBadReadings) {
  Line model(0, 0), plant(0, 1);
  BiasOptions o = lineOptions();
  o.average = 10;
  o.stride = 10;
  const RunLog log = drive(plant, VectorXd::Zero(1), 40, [](int t) { return t; });
  const auto samples = samplesOf(log, model, o, all);
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_NEAR(samples[1].difference[0], 0.01 * 14.5, 1e-9);
  EXPECT_NEAR(samples[1].u[0], 14.5, 1e-12);
  const auto some = samplesOf(log, model, o, [](const VectorXd& x) { return x[0] < 1; });
  EXPECT_EQ(some.size(), 1U);
}

/// Readings whose noise is forty times what the machine does otherwise in a step: the torque it
/// lacks is told all the same, and a model that is right is left as it is.
TEST(DynamicsBias, OfInputsIsToldThroughNoise) {
  static constexpr double kDeviation = 0.02;
  Line model(-1, 1);
  BiasOptions o = lineOptions();
  o.noise = VectorXd::Constant(1, kDeviation * kDeviation);
  o.output_scale = VectorXd::Ones(1);
  o.other_signals = {0.1, 0.01};
  o.average = 40;
  o.stride = 20;
  o.kernel.noise = 0.1;
  for (const double part : {0.6, 1.0}) {
    Line plant(-1, part);
    RunLog log = drive(plant, VectorXd::Zero(1), 4000, [](int t) { return std::sin(0.01 * t); });
    Random random(3);
    for (double& x : log.x.reshaped()) x += kDeviation * random.normal();
    const DynamicsBias bias(samplesOf(log, model, o, all), o);
    DynamicsBias::Scratch scratch;
    VectorXd g;
    bias.predict(VectorXd::Zero(1), VectorXd::Constant(1, 0.5), g, scratch);
    ASSERT_EQ(g.size(), 1);
    EXPECT_NEAR(g[0], (part - 1) * 0.5, 0.03) << part;

    CorrectedPlant corrected(std::make_unique<Line>(model),
                             std::make_shared<const DynamicsBias>(bias));
    corrected.reset(VectorXd::Zero(1));
    corrected.step(VectorXd::Constant(1, 0.5));
    EXPECT_NEAR(corrected.state()[0], 0.01 * (0.5 + g[0]), 1e-12);
  }
}

TEST(DynamicsBias, SpreadKeepsTheFarthest) {
  BiasOptions o = lineOptions();
  o.most = 3;
  std::vector<BiasSample> samples;
  for (const double x : {0.0, 0.1, 0.2, 5.0, 5.1, -7.0}) {
    samples.push_back({VectorXd::Constant(1, x), VectorXd::Zero(1), VectorXd::Zero(1)});
  }
  const auto kept = spread(samples, o);
  ASSERT_EQ(kept.size(), 3U);
  EXPECT_EQ(kept[0].x[0], 0);
  EXPECT_EQ(kept[1].x[0], -7);
  EXPECT_EQ(kept[2].x[0], 5.1);
  o.most = 6;  // no more than that: as they come
  const auto whole = spread(samples, o);
  ASSERT_EQ(whole.size(), 6U);
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(whole[i].x, samples[i].x);
  // Far is what the kernel calls far.
  o.most = 2;
  samples.push_back({VectorXd::Zero(1), VectorXd::Constant(1, 3), VectorXd::Zero(1)});
  o.kernel.lengths << 7, 1;
  EXPECT_EQ(spread(samples, o)[1].u[0], 3);
}

TEST(DynamicsBias, RefusesALogOfAnotherPlant) {
  Line model(0, 0);
  BiasOptions o = lineOptions();
  RunLog log{0.01, MatrixXd::Zero(2, 11), MatrixXd::Zero(1, 10)};
  EXPECT_THROW(samplesOf(log, model, o, all), InputError);
  log = {0.02, MatrixXd::Zero(1, 11), MatrixXd::Zero(1, 10)};
  EXPECT_THROW(samplesOf(log, model, o, all), InputError);
  log = {0.01, MatrixXd::Zero(1, 11), MatrixXd::Zero(2, 10)};
  EXPECT_THROW(samplesOf(log, model, o, all), InputError);
  for (const int steps : {9, 11}) {
    log = {0.01, MatrixXd::Zero(1, 11), MatrixXd::Zero(1, steps)};
    EXPECT_THROW(samplesOf(log, model, o, all), InputError);
  }
  for (const double sign : {1.0, -1.0}) {
    log = {0.01 + sign * 1.5e-9, MatrixXd::Zero(1, 11), MatrixXd::Zero(1, 10)};
    EXPECT_THROW(samplesOf(log, model, o, all), InputError);
    log.time_step = 0.01 + sign * 0.5e-9;
    EXPECT_FALSE(samplesOf(log, model, o, all).empty());
  }
  const VectorXd one = VectorXd::Ones(1), two = VectorXd::Ones(2);
  EXPECT_NO_THROW(DynamicsBias({{one, one, one}}, o));
  EXPECT_THROW(DynamicsBias({{two, one, one}}, o), InputError);
  EXPECT_THROW(DynamicsBias({{one, two, one}}, o), InputError);
  EXPECT_THROW(DynamicsBias({{one, one, two}}, o), InputError);
  o.kernel.lengths = VectorXd::Ones(3);
  EXPECT_THROW(DynamicsBias({}, o), InputError);
}

/// x_i' = x_i + (rate_i x_i + u_i³) Δt, two of them.
class Pair : public Plant {
 public:
  Pair(double first, double second) : rates_(first, second) {}
  int states() const override { return 2; }
  int inputs() const override { return 2; }
  double timeStep() const override { return 0.01; }
  void reset(const VectorXd& x) override { x_ = x; }
  void step(const VectorXd& u) override {
    x_ += 0.01 * (rates_.cwiseProduct(x_) + VectorXd(u.array().cube()));
  }
  const VectorXd& state() const override { return x_; }

 private:
  VectorXd x_ = VectorXd::Zero(2);
  Eigen::Vector2d rates_;
};

BiasOptions pairOptions() {
  BiasOptions o;
  o.lags = {1, 4, 13};
  o.directions = {1, 0};
  o.direction_scale = 0.3;
  o.input_scale = VectorXd::LinSpaced(12, 0.5, 1.5);  // states, 4 times inputs, directions
  o.output_scale = Eigen::Vector2d(100, 50);
  o.kernel = {VectorXd::Constant(12, 2), 1, 0.1};
  o.average = 10;
  o.stride = 6;
  return o;
}

RunLog drivePair(Plant& plant, int steps, double phase) {
  RunLog log{plant.timeStep(), MatrixXd(2, steps + 1), MatrixXd(2, steps)};
  plant.reset(Eigen::Vector2d(0.3, -0.2));
  log.x.col(0) = plant.state();
  for (int t = 0; t < steps; ++t) {
    log.u.col(t) << std::sin(0.3 * t + phase), std::cos(0.2 * t + phase);
    plant.step(log.u.col(t));
    log.x.col(t + 1) = plant.state();
  }
  return log;
}

TEST(DynamicsBias, SamplesAreMeansOverTheirSteps) {
  Pair plant(0.5, -0.4), model(0.5, -1);
  const BiasOptions o = pairOptions();
  const RunLog log = drivePair(plant, 40, 0);
  const auto samples = samplesOf(log, model, o, all);
  ASSERT_EQ(samples.size(), 6U);
  for (size_t s = 0; s < samples.size(); ++s) {
    VectorXd x = VectorXd::Zero(2), u = VectorXd::Zero(10);
    for (int i = 0; i < 10; ++i) {
      const int t = 6 * static_cast<int>(s) + i;
      x += log.x.col(t) / 10;
      int at = 0;
      for (const int lag : {0, 1, 4, 13}) {
        if (t >= lag) u.segment(at, 2) += log.u.col(t - lag) / 10;  // nothing before a run
        at += 2;
      }
      u[8] += std::tanh(log.x(1, t) / 0.3) / 10;
      u[9] += std::tanh(log.x(0, t) / 0.3) / 10;
    }
    EXPECT_LT((samples[s].x - x).norm(), 1e-12) << s;
    EXPECT_LT((samples[s].u - u).norm(), 1e-12) << s;
    // The first state goes as the model says; the second lacks 0.006 of where it is, its change in
    // these steps weighted by what the model makes of it.
    EXPECT_NEAR(samples[s].difference[0], 0, 1e-9);
    double lacks = 0, weights = 0;
    for (int i = 0; i < 10; ++i) {
      const double weight = std::pow(0.99, 9 - i);
      lacks += weight * 0.006 * log.x(1, 6 * static_cast<Eigen::Index>(s) + i);
      weights += weight;
    }
    EXPECT_NEAR(samples[s].difference[1], lacks / weights, 1e-9);
  }
}

TEST(DynamicsBias, ACorrectedPlantGivesItWhatTheSamplesHave) {
  Pair plant(0.5, -0.4);
  Pair model(0.3, -1);
  BiasOptions o = pairOptions();
  o.decay = 3;
  const auto bias =
      std::make_shared<const DynamicsBias>(samplesOf(drivePair(plant, 200, 0), model, o, all), o);
  CorrectedPlant corrected(std::make_unique<Pair>(model), bias);
  EXPECT_EQ(corrected.states(), 2);
  EXPECT_EQ(corrected.inputs(), 2);
  EXPECT_EQ(corrected.timeStep(), 0.01);
  DynamicsBias::Scratch scratch;
  for (const double phase : {1.0, 2.0}) {  // nothing of the first run is left in the second
    const RunLog log = drivePair(corrected, 40, phase);
    for (int t = 0; t < 40; ++t) {
      VectorXd u = VectorXd::Zero(10);
      int at = 0;
      for (const int lag : {0, 1, 4, 13}) {
        if (t >= lag) u.segment(at, 2) = log.u.col(t - lag);
        at += 2;
      }
      u[8] = std::tanh(log.x(1, t) / 0.3);
      u[9] = std::tanh(log.x(0, t) / 0.3);
      VectorXd g;
      const double weight = bias->predict(log.x.col(t), u, g, scratch);
      model.reset(log.x.col(t));
      model.step(log.u.col(t));
      EXPECT_EQ(VectorXd(log.x.col(t + 1)), VectorXd(model.state() + g)) << t;

      // g of its own formula.
      VectorXd input(12);
      input << log.x.col(t), u;
      const gp::Prediction p = bias->regression().predict(input.cwiseProduct(o.input_scale));
      EXPECT_NEAR(weight, std::exp(-3 * 2 * p.variance * p.variance), 1e-3);
      EXPECT_LT((g - weight * p.mean.cwiseQuotient(o.output_scale)).norm(), 1e-6);
    }
  }
}

TEST(DynamicsBias, WhatIsExplainedIsOfTheWholeDifference) {
  Line model(0, 1), plant(0, 0.8);
  const BiasOptions o = lineOptions();
  const RunLog log = drive(plant, VectorXd::Zero(1), 90, [](int t) { return std::sin(0.1 * t); });
  const auto samples = samplesOf(log, model, o, all);
  const DynamicsBias bias(samples, o);
  auto others = samples;
  for (size_t i = 0; i < others.size(); i += 3) others[i].difference[0] += 0.001;
  double left = 0, whole = 0;
  DynamicsBias::Scratch scratch;
  VectorXd g;
  for (const BiasSample& s : others) {
    bias.predict(s.x, s.u, g, scratch);
    left += std::pow(s.difference[0] - g[0], 2);
    whole += std::pow(s.difference[0], 2);
  }
  EXPECT_NEAR(explained(bias, others)[0], 1 - left / whole, 1e-12);
  EXPECT_LT(explained(bias, others)[0], 0.9);
  // Without a sample, whatever kernels might be tried, there is no bias.
  BiasOptions tried = o;
  tried.other_signals = {0.1};
  EXPECT_EQ(DynamicsBias({}, tried).predict(samples[0].x, samples[0].u, g, scratch),
            std::exp(-1.0));
  EXPECT_EQ(g[0], 0);
}

/// Exact readings of a plant that answers half: the input it lacks is what was not answered, though
/// a cube of it moves the plant.
TEST(DynamicsBias, OfInputsIsFoundThroughWhatTheModelMakesOfThem) {
  class Weak : public Pair {
   public:
    using Pair::Pair;
    void step(const VectorXd& u) override { Pair::step(u.cwiseProduct(Eigen::Vector2d(0.7, 1.2))); }
  } plant(0.5, -0.4);
  Pair model(0.5, -0.4);
  BiasOptions o = pairOptions();
  o.noise = Eigen::Vector2d(1e-4, 4e-4);
  RunLog log{0.01, MatrixXd(2, 31), MatrixXd(2, 30)};
  plant.reset(Eigen::Vector2d(0.3, -0.2));
  log.x.col(0) = plant.state();
  for (int t = 0; t < 30; ++t) {
    log.u.col(t) << 0.8, -0.5;
    plant.step(log.u.col(t));
    log.x.col(t + 1) = plant.state();
  }
  // The path is linear in u³, so the two steps are Newton's for a root of it.
  const auto newton = [](double u, double answered) {
    double more = 0;
    for (int round = 0; round < 2; ++round) {
      more -= (std::pow(u + more, 3) - std::pow(answered * u, 3)) / (3 * std::pow(u + more, 2));
    }
    EXPECT_NEAR(more, (answered - 1) * u, 0.01);
    return more;
  };
  const auto samples = samplesOf(log, model, o, all);
  ASSERT_EQ(samples.size(), 4U);
  for (size_t s = 0; s < samples.size(); ++s) {
    EXPECT_NEAR(samples[s].difference[0], newton(0.8, 0.7), 1e-4) << s;
    EXPECT_NEAR(samples[s].difference[1], newton(-0.5, 1.2), 1e-4) << s;
    EXPECT_LT(
        (samples[s].x - log.x.middleCols(6 * static_cast<Eigen::Index>(s), 10).rowwise().mean())
            .norm(),
        1e-2)
        << s;
  }
  // Of a model that is linear one step is exact, and the second changes nothing.
  Line line(-1, 1), half(-1, 0.5);
  BiasOptions linear = lineOptions();
  linear.average = 5;
  linear.noise = VectorXd::Constant(1, 1e-4);
  const RunLog run = drive(half, VectorXd::Ones(1), 30, [](int) { return 3; });
  for (const BiasSample& s : samplesOf(run, line, linear, all)) {
    EXPECT_NEAR(s.difference[0], -1.5, 1e-8);
  }
}

/// Dry friction is told by the direction of motion; where there is none, that input is left out.
TEST(DynamicsBias, DirectionsAreUsedWhereTheyMatter) {
  class Rubbed : public Line {
   public:
    explicit Rubbed(double friction) : Line(-1, 1), friction_(friction) {}
    void step(const VectorXd& u) override {
      const double before = state()[0];
      Line::step(u);
      reset(state() - VectorXd::Constant(1, 0.01 * friction_ * std::tanh(before / 0.05)));
    }

   private:
    double friction_;
  };
  Line model(-1, 1);
  BiasOptions o = lineOptions();
  o.directions = {0};
  o.direction_scale = 0.05;
  o.input_scale = VectorXd::Ones(3);
  o.kernel.lengths = VectorXd::Constant(3, 2);
  VectorXd without = o.kernel.lengths;
  without[2] = 100;
  o.other_lengths = {without};
  const auto input = [](int t) { return 2 * std::sin(0.3 * t); };
  const auto bias_of = [&](double friction) {
    Rubbed plant(friction);
    return std::make_shared<const DynamicsBias>(
        samplesOf(drive(plant, VectorXd::Ones(1), 200, input), model, o, all), o);
  };
  EXPECT_EQ(bias_of(0)->regression().kernel().lengths[2], 100);
  const auto bias = bias_of(0.5);
  EXPECT_EQ(bias->regression().kernel().lengths[2], 2);
  Rubbed plant(0.5);
  CorrectedPlant corrected(std::make_unique<Line>(model), bias);
  const VectorXd x0 = VectorXd::Zero(1);
  const auto other = [](int t) { return std::sin(0.2 * t); };
  const MatrixXd truth = drive(plant, x0, 100, other).x;
  const double better = (drive(corrected, x0, 100, other).x - truth).norm();
  EXPECT_LT(better, 0.1 * (drive(model, x0, 100, other).x - truth).norm());
}

/// A force that the model has not, over many steps: what it adds to the rate in each, not what the
/// rate then adds to the place.
TEST(DynamicsBias, OfAForceIsWhatItDoesToTheRate) {
  const BongoBoard model;
  class Pushed : public BongoBoard {
   public:
    void step(const VectorXd& u) override { BongoBoard::step(u + VectorXd::Constant(1, 5)); }
  } plant;
  BongoBoard nominal;
  BiasOptions o;
  o.output_scale.resize(6);
  o.output_scale << 0, 0, 0, 100, 100, 100;
  const BongoBoard::State x0 = BongoBoard::State::Constant(0.002);
  const RunLog log = drive(plant, x0, 20, [](int) { return 3; });
  const auto samples = samplesOf(log, nominal, o, all);
  ASSERT_EQ(samples.size(), 1U);
  const Eigen::Vector3d expected =
      0.001 * (model.acceleration(samples[0].x, 8) - model.acceleration(samples[0].x, 3));
  EXPECT_EQ(samples[0].difference.head<3>(), Eigen::Vector3d::Zero());
  EXPECT_LT((samples[0].difference.tail<3>() - expected).norm(), 0.02 * expected.norm());
}

/// What late torques do is learned when they are inputs, and used by the corrected model.
TEST(DynamicsBias, OfADelayNeedsEarlierInputs) {
  class Late : public Line {
   public:
    Late() : Line(0, 1) {}
    void step(const VectorXd& u) override {
      Line::step(last_);
      last_ = u;
    }
    void reset(const VectorXd& x) override {
      Line::reset(x);
      last_ = VectorXd::Zero(1);
    }

   private:
    VectorXd last_ = VectorXd::Zero(1);
  } plant;
  Line model(0, 1);
  BiasOptions o = lineOptions();
  o.lags = {1};
  o.input_scale = VectorXd::Ones(3);
  o.kernel.lengths = VectorXd::Constant(3, 8);
  o.stride = 1;
  Random random(4);
  std::vector<double> inputs(200);
  for (double& u : inputs) u = random.normal();
  const auto input = [&](int t) { return inputs[t]; };
  const VectorXd x0 = VectorXd::Zero(1);
  const RunLog log = drive(plant, x0, 150, input);
  const auto samples = samplesOf(log, model, o, all);
  EXPECT_EQ(samples[0].u, Eigen::Vector2d(inputs[0], 0));  // nothing before a run
  EXPECT_EQ(samples[1].u, Eigen::Vector2d(inputs[1], inputs[0]));
  const auto bias = std::make_shared<const DynamicsBias>(samples, o);
  const auto unseen = samplesOf(drive(plant, x0, 200, input), model, o, all);
  EXPECT_GT(explained(*bias, unseen)[0], 0.99);
  auto still = unseen;
  for (BiasSample& s : still) s.difference.setZero();
  EXPECT_TRUE(std::isnan(explained(*bias, still)[0])) << "of no variance there is no share";
  CorrectedPlant corrected(std::make_unique<Line>(model), bias);
  const double better = (drive(corrected, x0, 60, input).x - drive(plant, x0, 60, input).x).norm();
  const double nominal = (drive(model, x0, 60, input).x - drive(plant, x0, 60, input).x).norm();
  EXPECT_LT(better, 0.1 * nominal);
}

/// Of the board's hardware with masses 20 % larger, driven by a controller that balances it: most
/// of the bias of velocities that were never trained on is explained, and averaging is why.
TEST(DynamicsBias, OfTheBongoBoardsInertiaIsLearnedFromFourRuns) {
  BongoFaults heavy;
  heavy.inertia_scale = 1.2;
  BongoHardware hardware({}, heavy);
  BongoBoard model;
  // Gains that balance with x_p in the world.
  const auto run = [&](double aw, double ab) {
    RunLog log{0.001, MatrixXd(6, 1501), MatrixXd(1, 1500)};
    VectorXd x = VectorXd::Zero(6);
    x[0] = aw;
    x[1] = ab;
    hardware.reset(x);
    log.x.col(0) = hardware.state();
    for (int t = 0; t < 1500; ++t) {
      const BongoBoard::State s = hardware.state();
      const double u = 10201.5 * poseOf({}, s).pelvis.x() + 3656.9 * pelvisVelocity({}, s) -
                       2913.9 * s[2] - 2.8 * s[5] - 1870.3 * (s[0] + s[1]);
      log.u(0, t) = std::clamp(u, -100.0, 100.0);
      hardware.step(log.u.col(t));
      log.x.col(t + 1) = hardware.state();
    }
    return log;
  };
  BiasOptions o;
  o.input_scale.resize(7);
  o.input_scale << 1, 1, 1, .1, .1, .1, .01;
  o.output_scale.resize(6);
  o.output_scale << 1, 1, 1, .1, .1, .1;
  o.output_scale *= 1000;  // of a step's change, to the kernel's size of 1
  o.kernel = {VectorXd::Ones(7), 1, 0.1};
  const auto near = [](const VectorXd& x) {
    return std::abs(x[0] + x[1]) < 0.3 && x.tail(3).cwiseAbs().maxCoeff() < 6.2;
  };
  const auto score_of = [&](int average) {
    o.average = average;
    std::vector<BiasSample> train, test;
    int i = 0;
    for (const double ab : {.002, -.003, .004, -.001, .0025, -.0035}) {
      const auto samples = samplesOf(run(.001 * i, ab), model, o, near);
      auto& to = i++ < 4 ? train : test;
      to.insert(to.end(), samples.begin(), samples.end());
    }
    return explained(DynamicsBias(spread(train, o), o), test).tail(3).eval();
  };
  EXPECT_GT(score_of(20).minCoeff(), 0.95);
}

TEST(DynamicsBias, SaysWhichSamplesWereLeftOutAndWhy) {
  Line model(-1, 1), plant(-1.3, 0.8);
  BiasOptions o = lineOptions();
  o.average = 4;
  o.stride = 10;
  RunLog log = drive(plant, VectorXd::Ones(1), 100, [](int t) { return std::sin(0.1 * t); });
  const size_t all_of_them = samplesOf(log, model, o, all).size();
  EXPECT_EQ(all_of_them, 10U);
  log.x(0, 32) += 0.5;  // a reading that jumps
  log.x(0, 61) = 7;     // and one that is refused
  const auto keep = [](const VectorXd& x) { return x[0] < 5; };
  EXPECT_EQ(samplesOf(log, model, o, keep).size(), all_of_them - 1);
  o.outlier = 0.2;
  std::vector<LeftOut> left_out;
  EXPECT_EQ(samplesOf(log, model, o, keep, &left_out).size(), all_of_them - 2);
  ASSERT_EQ(left_out.size(), 2U);
  EXPECT_EQ(left_out[0].reading, 32);
  EXPECT_TRUE(left_out[0].outlier);
  EXPECT_EQ(left_out[1].reading, 61);
  EXPECT_FALSE(left_out[1].outlier);
  // The reading it begins with counts, too; so does the last that it is the mean of, not the next.
  RunLog edges = drive(plant, VectorXd::Ones(1), 100, [](int t) { return std::sin(0.1 * t); });
  o.outlier = std::numeric_limits<double>::infinity();
  left_out.clear();
  for (const int reading : {20, 54, 65}) edges.x(0, reading) = 7;
  EXPECT_EQ(samplesOf(edges, model, o, keep, &left_out).size(), all_of_them - 2);
  ASSERT_EQ(left_out.size(), 2U);
  EXPECT_EQ(left_out[0].reading, 20);
  EXPECT_EQ(left_out[1].reading, 54);
}

}  // namespace
}  // namespace traceur::bias
