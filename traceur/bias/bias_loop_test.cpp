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

/// A learner of plants that are all alike; what they do is the task's affair.
ModelLearner slides(int count, bool by_chance) {
  return [=](const std::vector<RunLog>&, int) {
    LearnedModels models;
    for (int i = 0; i < count; ++i) models.plants.push_back(std::make_unique<Slide>(1));
    models.by_chance = by_chance;
    return models;
  };
}

TEST(BiasLoop, PolishingAMeanIsASearchOfOneRoundNearThePolicy) {
  BiasTask task;
  task.lower = VectorXd::Constant(1, -1);
  task.upper = VectorXd::Constant(1, 1);
  task.starts = {VectorXd::Constant(1, -0.3), VectorXd::Constant(1, 0.7)};
  task.success = 0.5;
  task.most = 10;
  task.run = [](Plant&, const VectorXd& p, const VectorXd& x0) { return (p - x0).squaredNorm(); };
  const auto mean = [](const VectorXd& p) {
    return (std::pow(p[0] + 0.3, 2) + std::pow(p[0] - 0.7, 2)) / 2;
  };
  const auto worst = [](double p) { return std::max(std::pow(p + 0.3, 2), std::pow(p - 0.7, 2)); };
  const VectorXd warm = VectorXd::Constant(1, 0.6);
  PolicySearchOptions o{.direct = 50, .polish = 60, .polish_step = 0.2, .success = 0, .seed = 4};
  PolicySearchOptions near = o;
  near.direct = 0;
  near.rounds = 1;
  near.polish = 30;
  near.polish_step = 0.08;
  near.seed = 4 + 3;
  near.warm = warm;
  const FoundPolicy expected = searchPolicy(mean, task.lower, task.upper, near);
  const FoundPolicy found = searchOnModels(task, slides(2, true), {}, 3, warm, o);
  EXPECT_EQ(found.trials, expected.trials);
  EXPECT_NEAR(found.parameters[0], expected.parameters[0], 1e-9);
  EXPECT_NEAR(found.cost, expected.cost, 1e-12);

  // One trial of polish is none, but the mean counts; without any, or a policy, the worst does.
  o.direct = 0;
  o.polish = 1;
  const FoundPolicy one = searchOnModels(task, slides(2, true), {}, 3, warm, o);
  EXPECT_EQ(one.trials, 1);
  EXPECT_NEAR(one.cost, mean(warm), 1e-12);
  o.polish = 0;
  EXPECT_NEAR(searchOnModels(task, slides(2, true), {}, 3, warm, o).cost, 10 + worst(0.6), 1e-12);
  o.direct = 50;
  o.polish = 60;
  const FoundPolicy none = searchOnModels(task, slides(2, true), {}, 3, VectorXd(), o);
  EXPECT_NEAR(none.cost, worst(none.parameters[0]), 1e-12);
}

TEST(BiasLoop, EveryHiddenStartCountsTheMost) {
  BiasTask task;
  task.lower = VectorXd::Constant(1, -1);
  task.upper = VectorXd::Constant(1, 1);
  for (int i = 0; i < 3; ++i) task.starts.push_back(VectorXd::Constant(1, i));
  task.success = 1;
  task.most = 100;
  VectorXd costs(3);
  task.run = [&](Plant&, const VectorXd&, const VectorXd& x0) {
    return costs[static_cast<Eigen::Index>(x0[0])];
  };
  const auto cost = [&](double first, double second, double third) {
    costs << first, second, third;
    return searchOnModels(task, slides(1, false), {}, 0, VectorXd::Zero(1), {.direct = 0}).cost;
  };
  EXPECT_EQ(cost(0.5, 0.7, 0.6), 0.7);
  EXPECT_EQ(cost(0.5, 0.7, 4), 4);
  EXPECT_EQ(cost(0.5, 4, 0), 104);
  EXPECT_EQ(cost(4, 0, 0), 204);
  EXPECT_EQ(cost(1, 0, 0), 201);  // success is less than its cost
}

/// What the second iteration does with logs that are of no use, and what it starts from.
TEST(BiasLoop, LogsAreGivenUpWhereNotEvenTheFirstStartSucceeds) {
  struct Case {
    double first, second;  // costs of the two starts on the models
    bool cleared;
  };
  for (const Case& c :
       {Case{0.5, 90, false}, Case{0.999, 1, false}, Case{1, 0, true}, Case{90, 0, true}}) {
    for (const bool warm : {true, false}) {
      BiasTask task;
      task.lower = VectorXd::Constant(1, -1);
      task.upper = VectorXd::Constant(1, 2);
      task.starts = {VectorXd::Zero(1), VectorXd::Ones(1)};
      task.success = 1;
      task.most = 100;
      std::vector<double> asked;  // of the model in the search under way
      task.run = [&](Plant&, const VectorXd& parameters, const VectorXd& x0) {
        asked.push_back(parameters[0]);
        const double farther = c.first < 1 ? 1e-6 * std::abs(parameters[0] - 0.5) : 0;
        return (x0[0] == 0 ? c.first : c.second) - farther;
      };
      std::vector<size_t> logs_seen;
      std::vector<double> begun_at;
      const auto models = slides(1, false);
      const ModelLearner learner = [&](const std::vector<RunLog>& logs, int iteration) {
        logs_seen.push_back(logs.size());
        if (!asked.empty()) begun_at.push_back(asked[0]);
        asked.clear();
        return models(logs, iteration);
      };
      BiasLoopOptions options;
      options.iterations = 2;
      options.runs = 3;
      options.warm = warm;
      options.search.direct = 5;
      const BiasLearned learned = learnWithBias(
          task, learner,
          [](const VectorXd&, int) {
            return PlantRun{1, {}};
          },
          options);
      EXPECT_EQ(learned.plant_runs, 6);
      EXPECT_FALSE(learned.solved) << "success is less than its cost";
      EXPECT_EQ(logs_seen,
                c.cleared ? std::vector<size_t>({0, 3, 0}) : std::vector<size_t>({0, 3}));
      EXPECT_FALSE(learned.iterations[0].cleared);
      EXPECT_EQ(learned.iterations[1].cleared, c.cleared);
      EXPECT_EQ(learned.iterations[1].costs, std::vector<double>(3, 1.0));
      EXPECT_EQ(begun_at[0], 0.5);  // the middle
      const double first_found = learned.iterations[0].policy.parameters[0];
      if (!c.cleared) {
        EXPECT_NE(first_found, 0.5);
        EXPECT_EQ(asked[0], warm ? first_found : 0.5);
      }
    }
  }
}

TEST(BiasLoop, EveryRunOfAnIterationMustSucceed) {
  for (const int failing : {0, 1, 2}) {
    Task t(1);
    t.options.runs = 3;
    t.options.iterations = 2;
    const auto model = [] { return std::make_unique<Slide>(1); };
    const BiasLearned learned = learnWithBias(
        t.task, biasLearner(model, t.bias, [](const VectorXd&) { return true; }),
        [&](const VectorXd& parameters, int number) {
          PlantRun run = Task::runOf(*t.plant, parameters, VectorXd::Zero(1));
          if (number == failing) run.cost = 1;
          return run;
        },
        t.options);
    EXPECT_TRUE(learned.solved);
    EXPECT_EQ(learned.iterations.size(), 2U) << failing;
  }
}

}  // namespace
}  // namespace traceur::bias
