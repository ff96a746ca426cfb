#include "traceur/optim/curve_race.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "traceur/core/random.h"

namespace traceur::optim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTasks = 6;

/// Task i wants the number i/5, with a line from p_1 to p_2.
double costOf(const MatrixXd& points, int task) {
  const double w = task / 5.0;
  return std::pow((1 - w) * points(0, 0) + w * points(0, 1) - w, 2);
}

CurveRace::Curve measured(const MatrixXd& points) {
  CurveRace::Curve curve{points, 0, {}};
  for (int i = 0; i < kTasks; ++i) curve.task_costs.push_back(costOf(points, i));
  curve.cost = std::accumulate(curve.task_costs.begin(), curve.task_costs.end(), 0.0) / kTasks;
  return curve;
}

/// A race about a line that misses by 0.5, with a trial of cost 0 seen for every task.
struct Lines {
  CurveRace race{kTasks};
  int generation = 0;

  Lines() {
    race.see(std::vector<double>(kTasks, 0));
    race.offer(measured(MatrixXd::Constant(1, 2, 0.5)));
    race.begin(draw());
  }

  CurveRace::Draw draw() const {
    return [this](double step_size, int number) {
      Random random(1, generation, number);
      MatrixXd points = race.best().points;
      for (double& p : points.reshaped()) p += 0.3 * step_size * random.normal();
      return points;
    };
  }

  void step() {
    std::vector<double> costs;
    for (const auto& e : race.entrants()) costs.push_back(costOf(e.points, e.nextTask()));
    race.tell(costs);
    ++generation;
    race.fill(draw());
  }
};

TEST(CurveRace, FindsTheLine) {
  Lines lines;
  double cost = lines.race.best().cost;
  for (int g = 0; g < 200; ++g) {
    lines.step();
    EXPECT_LE(lines.race.best().cost, cost);
    cost = lines.race.best().cost;
    const CurveRace::Curve again = measured(lines.race.best().points);
    EXPECT_NEAR(cost, again.cost, 1e-15);
    EXPECT_EQ(lines.race.best().task_costs, again.task_costs);
  }
  EXPECT_LT(cost, 1e-5);
}

TEST(CurveRace, RunsNoMoreOfACurveThatCannotWin) {
  Lines lines;
  int left = 0;
  for (int g = 0; g < 300; ++g) {
    const auto before = lines.race.entrants();
    lines.step();
    const auto& after = lines.race.entrants();
    for (const auto& was : before) {
      left += std::none_of(after.begin(), after.end(),
                           [&](const auto& is) { return is.points == was.points; });
    }
  }
  EXPECT_LT(lines.race.trials(), 2.5 * left);  // of six points
}

TEST(CurveRace, BeginsWithTheTaskThatCostsMost) {
  const Lines lines;
  const auto& costs = lines.race.best().task_costs;
  for (const auto& e : lines.race.entrants()) {
    for (int i = 1; i < kTasks; ++i) EXPECT_GE(costs[e.order[i - 1]], costs[e.order[i]]);
  }
}

TEST(CurveRace, APointThatFailsLoses) {
  Lines lines;
  const auto before = lines.race.entrants();
  lines.race.tell(std::vector<double>(before.size(), NAN));
  EXPECT_FALSE(lines.race.isOn());
  EXPECT_DOUBLE_EQ(lines.race.best().cost, measured(MatrixXd::Constant(1, 2, 0.5)).cost);
}

TEST(CurveRace, CostsMayBeBelowZero) {
  // The same costs less 1, of which the least is known to be -1.
  Lines lines;
  CurveRace shifted(kTasks);
  shifted.see(std::vector<double>(kTasks, -1));
  CurveRace::Curve first = lines.race.best();
  for (double& c : first.task_costs) c -= 1;
  first.cost -= 1;
  shifted.offer(first);
  shifted.begin([&](double, int k) { return lines.race.entrants()[k].points; });
  std::vector<double> costs;
  std::vector<double> less;
  for (const auto& e : lines.race.entrants()) {
    costs.push_back(costOf(e.points, e.nextTask()));
    less.push_back(costs.back() - 1);
  }
  lines.race.tell(costs);
  shifted.tell(less);
  ASSERT_EQ(shifted.entrants().size(), lines.race.entrants().size());
  for (size_t k = 0; k < shifted.entrants().size(); ++k) {
    EXPECT_EQ(shifted.entrants()[k].points, lines.race.entrants()[k].points);
  }
}

TEST(CurveRace, CountsTrialsSinceAFallByAFifth) {
  Gain gain;
  gain.note(10, 3);
  EXPECT_EQ(gain.since, 0U);
  gain.note(8.1, 3);
  gain.note(8.1, 4);
  EXPECT_EQ(gain.since, 7U);
  gain.note(8, 1);
  EXPECT_EQ(gain.since, 0U);
  EXPECT_EQ(gain.from, 8);
}

}  // namespace
}  // namespace traceur::optim
