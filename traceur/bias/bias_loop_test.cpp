#include "traceur/bias/bias_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace traceur::bias {
namespace {

/// x' = x + gain u Δt.
class Slide : public Plant {
 public:
  explicit Slide(double gain) : gain_(gain) {}
  int states() const override { return 1; }
  int inputs() const override { return 1; }
  double timeStep() const override { return 0.1; }
  void reset(const VectorXd& x) override { x_ = x; }
  void step(const VectorXd& u) override { x_ += 0.1 * gain_ * u; }
  const VectorXd& state() const override { return x_; }

 private:
  double gain_;
  VectorXd x_ = VectorXd::Zero(1);
};

/// Push with a constant input, the one parameter, so as to be at 2 after 20 steps; the cost is by
/// how much that is missed.
struct Task {
  BiasTask task;
  BiasOptions bias;
  BiasLoopOptions options;
  bool learns = true;
  std::unique_ptr<Slide> plant;
  std::vector<int> numbers;

  explicit Task(double gain) : plant(std::make_unique<Slide>(gain)) {
    task.lower = VectorXd::Constant(1, -3);
    task.upper = VectorXd::Constant(1, 3);
    task.run = [](Plant& p, const VectorXd& parameters, const VectorXd& x0) {
      return runOf(p, parameters, x0).cost;
    };
    task.starts = {VectorXd::Zero(1)};
    task.success = 0.1;
    bias.input_scale = VectorXd::Ones(2);
    bias.output_scale = VectorXd::Constant(1, 10);
    bias.kernel = {VectorXd::Constant(2, 2), 1, 0.01};
    bias.average = 5;
    bias.stride = 5;
    options.search = {.direct = 100, .good = 0.01};
  }

  BiasLearned learn() {
    const auto model = [] { return std::make_unique<Slide>(1); };
    const ModelLearner learner = biasLearner(model, bias, [](const VectorXd&) { return true; });
    return learnWithBias(
        task,
        [&](const std::vector<RunLog>& logs, int iteration) {
          return learner(learns ? logs : std::vector<RunLog>(), iteration);
        },
        [&](const VectorXd& parameters, int number) {
          numbers.push_back(number);
          return runOf(*plant, parameters, VectorXd::Zero(1));
        },
        options);
  }

  static PlantRun runOf(Plant& p, const VectorXd& parameters, const VectorXd& x0) {
    p.reset(x0);
    RunLog seen{p.timeStep(), MatrixXd(1, 21), MatrixXd(1, 20)};
    seen.x.col(0) = p.state();
    for (int t = 0; t < 20; ++t) {
      p.step(parameters);
      seen.u.col(t) = parameters;
      seen.x.col(t + 1) = p.state();
    }
    return {std::abs(p.state()[0] - 2), seen};
  }
};

TEST(BiasLoop, APlantLikeItsModelNeedsOneIteration) {
  Task t(1);
  const BiasLearned learned = t.learn();
  EXPECT_TRUE(learned.solved);
  EXPECT_EQ(learned.iterations.size(), 1U);
  EXPECT_EQ(learned.plant_runs, 2);
  EXPECT_EQ(t.numbers, (std::vector<int>{0, 1}));
  EXPECT_NEAR(learned.parameters[0], 1, 0.05);
}

TEST(BiasLoop, LearnsWhatTheModelGetsWrongAndTheControlDoesNot) {
  Task t(0.7);
  const BiasLearned learned = t.learn();
  EXPECT_TRUE(learned.solved);
  EXPECT_LE(learned.iterations.size(), 3U);
  EXPECT_NEAR(learned.parameters[0], 1 / 0.7, 0.1);

  t.learns = false;
  t.options.iterations = 4;
  const BiasLearned control = t.learn();
  EXPECT_FALSE(control.solved);
  EXPECT_EQ(control.iterations.size(), 4U);
  EXPECT_EQ(control.plant_runs, 8);
}

TEST(BiasLoop, GivesUpABiasWithWhichNothingSucceeds) {
  Task t(-1);  // nothing like the model: no input of the bounds gets there
  t.task.lower = VectorXd::Constant(1, 0);
  t.options.iterations = 8;
  const BiasLearned learned = t.learn();
  EXPECT_FALSE(learned.solved);
  EXPECT_FALSE(learned.iterations[0].cleared);  // there was nothing to clear
  EXPECT_TRUE(std::any_of(learned.iterations.begin(), learned.iterations.end(),
                          [](const BiasIteration& i) { return i.cleared; }));
}

TEST(BiasLoop, AskedToStopItRunsThePlantNoMore) {
  std::stop_source stop;
  Task t(0.7);
  t.options.stop = stop.get_token();
  t.task.success = 0;  // never
  int trials = 0;      // of the third search
  const auto run = t.task.run;
  t.task.run = [&](Plant& p, const VectorXd& parameters, const VectorXd& x0) {
    if (t.numbers.size() == 4) {
      ++trials;
      stop.request_stop();
    }
    return run(p, parameters, x0);
  };
  const BiasLearned learned = t.learn();
  EXPECT_TRUE(learned.stopped);
  EXPECT_EQ(learned.iterations.size(), 2U);
  EXPECT_EQ(learned.plant_runs, 4);
  EXPECT_EQ(t.numbers.size(), 4U);
  EXPECT_EQ(learned.parameters, learned.iterations.back().policy.parameters);
  EXPECT_EQ(trials, 1);

  t.numbers.clear();
  const BiasLearned none = t.learn();  // asked to before it began
  EXPECT_TRUE(none.stopped);
  EXPECT_TRUE(none.iterations.empty());
  EXPECT_TRUE(t.numbers.empty());
}

TEST(BiasLoop, AStartThatFailsHidesThoseAfterIt) {
  Task t(1);
  t.task.starts = {VectorXd::Zero(1), VectorXd::Constant(1, 100)};  // from 100 there is no way
  t.task.most = 1000;
  std::vector<double> asked;
  t.task.run = [&](Plant&, const VectorXd& parameters, const VectorXd& x0) {
    asked.push_back(x0[0]);
    return std::abs(parameters[0]);
  };
  const auto models = [](const std::vector<RunLog>&, int) {
    LearnedModels one;
    one.plants.push_back(std::make_unique<Slide>(1));
    return one;
  };
  PolicySearchOptions once{.direct = 0, .polish = 0};
  const auto cost_at = [&](double parameter) {
    asked.clear();
    return searchOnModels(t.task, models, {}, 0, VectorXd::Constant(1, parameter), once).cost;
  };
  EXPECT_EQ(cost_at(0.05), 0.05);
  EXPECT_EQ(asked, (std::vector<double>{0, 100}));
  EXPECT_EQ(cost_at(0.5), 1000.5);
  EXPECT_EQ(asked, (std::vector<double>{0}));
}

/// Of models by chance the mean over many starts is polished, from the policy there is.
TEST(BiasLoop, ModelsByChanceCountByTheirMean) {
  BiasTask task;
  task.lower = VectorXd::Constant(1, -1);
  task.upper = VectorXd::Constant(1, 1);
  task.starts = {VectorXd::Zero(1)};
  task.many_starts = {VectorXd::Constant(1, 0.2), VectorXd::Constant(1, 0.6)};
  task.success = 1;
  task.most = 10;
  task.run = [](Plant&, const VectorXd& parameters, const VectorXd& x0) {
    return (parameters - x0).squaredNorm();
  };
  bool by_chance = true;
  const auto models = [&](const std::vector<RunLog>&, int) {
    LearnedModels one;
    one.plants.push_back(std::make_unique<Slide>(1));
    one.by_chance = by_chance;
    return one;
  };
  const PolicySearchOptions o{.polish = 200, .polish_step = 0.2};
  const VectorXd warm = VectorXd::Constant(1, 0.9);
  const FoundPolicy found = searchOnModels(task, models, {}, 1, warm, o);
  EXPECT_NEAR(found.parameters[0], 0.4, 1e-3);
  EXPECT_NEAR(found.cost, 0.04, 1e-5);
  EXPECT_LE(found.trials, 110);
  by_chance = false;
  EXPECT_NEAR(searchOnModels(task, models, {}, 1, warm, o).parameters[0], 0, 1e-3);
}

}  // namespace
}  // namespace traceur::bias
