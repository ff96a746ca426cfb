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
  BiasLoopOptions options;
  std::unique_ptr<Slide> plant;
  std::vector<int> numbers;

  explicit Task(double gain) : plant(std::make_unique<Slide>(gain)) {
    task.model = [] { return std::make_unique<Slide>(1); };
    task.lower = VectorXd::Constant(1, -3);
    task.upper = VectorXd::Constant(1, 3);
    task.run = [](Plant& p, const VectorXd& parameters, const VectorXd& x0, RunLog* log) {
      p.reset(x0);
      RunLog seen{p.timeStep(), MatrixXd(1, 21), MatrixXd(1, 20)};
      seen.x.col(0) = p.state();
      for (int t = 0; t < 20; ++t) {
        p.step(parameters);
        seen.u.col(t) = parameters;
        seen.x.col(t + 1) = p.state();
      }
      if (log) *log = seen;
      return std::abs(p.state()[0] - 2);
    };
    task.starts = {VectorXd::Zero(1)};
    task.keep = [](const VectorXd&) { return true; };
    task.success = 0.1;
    options.bias.input_scale = VectorXd::Ones(2);
    options.bias.output_scale = VectorXd::Constant(1, 10);
    options.bias.kernel = {VectorXd::Constant(2, 2), 1, 0.01};
    options.bias.average = 5;
    options.bias.stride = 5;
    options.search = {.direct = 100, .good = 0.01};
  }

  BiasLearned learn() {
    return learnWithBias(
        task,
        [&](const VectorXd& parameters, int number) {
          numbers.push_back(number);
          PlantRun run;
          run.cost = task.run(*plant, parameters, VectorXd::Zero(1), &run.log);
          return run;
        },
        options);
  }
};

TEST(BiasLoop, APlantLikeItsModelNeedsOneIteration) {
  Task t(1);
  const BiasLearned learned = t.learn();
  EXPECT_TRUE(learned.solved);
  EXPECT_EQ(learned.iterations.size(), 1U);
  EXPECT_EQ(learned.plant_runs, 2);
  EXPECT_EQ(t.numbers, (std::vector<int>{0, 1}));
  EXPECT_EQ(learned.iterations[0].samples, 0);
  EXPECT_NEAR(learned.parameters[0], 1, 0.05);
}

TEST(BiasLoop, LearnsWhatTheModelGetsWrongAndTheControlDoesNot) {
  Task t(0.7);
  const BiasLearned learned = t.learn();
  EXPECT_TRUE(learned.solved);
  EXPECT_LE(learned.iterations.size(), 3U);
  EXPECT_GT(learned.iterations.back().samples, 0);
  EXPECT_NEAR(learned.parameters[0], 1 / 0.7, 0.1);

  t.options.learns_bias = false;
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

}  // namespace
}  // namespace traceur::bias
