// What planning a fall costs: the exact planner against the unpruned recursion, and the one that
// plans while falling against the exact one, from random starts of each published stance.
//
//   bench_fall [STARTS]      run at the repository's root; 200 starts, of which 3 without pruning
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "traceur/core/random.h"
#include "traceur/fall/fall_problem.h"
#include "traceur/fall/value_table.h"

namespace {

using namespace traceur;
using namespace traceur::fall;

/// CPU time of a call [ms].
template <typename F>
double milliseconds(F call) {
  const auto cpu = [] {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double begin = cpu();
  call();
  return cpu() - begin;
}

struct Times {
  std::vector<double> each;
  double mean() const {
    double sum = 0;
    for (const double t : each) sum += t;
    return sum / static_cast<double>(each.size());
  }
  double p99() const {
    std::vector<double> sorted = each;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<size_t>(0.99 * static_cast<double>(sorted.size() - 1))];
  }
};

void measure(const FallRobot& falls, const FallSetup& setup, Stall stall, int starts) {
  const auto model = sim::Model::fromScene({.robot = falls.robot});
  const SagittalBody body(model, setup);
  FallProblemOptions options;
  options.stall = stall;
  const FallProblem p = fallProblem(body, falls, options);
  sim::World world(model);
  world.reset(model->stateOf(falls.robot->poses.at(setup.stance)));
  const PendulumState stance = body.pendulum(world.snapshot(), 0);
  std::optional<ValueTable> table;
  const double build = milliseconds([&] { table.emplace(p); });
  Times exact, quick, pruned, plain;
  double optimum = 0;
  double found = 0;
  int dead = 0;
  int differ = 0;
  for (int i = 0; i < starts; ++i) {
    Random random(5, 0, i);
    const double unit = std::sqrt(p.model.gravity / stance.r);
    const FallState x{0,
                      0,
                      {.theta = stance.theta + random.uniform(0, 0.15),
                       .r = stance.r,
                       .theta_rate = random.uniform(0.05, 0.5) * unit,
                       .r_rate = 0}};
    FallPlan best, near;
    exact.each.push_back(milliseconds([&] { best = planExactly(p, x); }));
    quick.each.push_back(milliseconds([&] { near = planQuickly(p, *table, x); }));
    if (std::isinf(best.cost)) continue;
    if (std::isinf(near.cost)) {
      ++dead;
    } else {
      optimum += best.cost;
      found += near.cost;
    }
  }
  // Without pruning a plan takes up to 6 s where a stalled fall has stopped, minutes and more where
  // they do not or the graph is long: both on a grid three times as coarse there.
  FallProblem same = p;
  const bool coarse = stall == Stall::kLiteral || p.graph.nodes.size() > 4;
  if (coarse) {
    same.grid.time *= 3;
    same.grid.angle *= 2;
    same.grid.rod_rates = 1;
  }
  for (int i = 0; i < std::min(coarse ? 20 : 3, starts); ++i) {
    Random random(6, 0, i);
    const FallState x{
        0,
        0,
        {.theta = stance.theta + random.uniform(0, 0.15),
         .r = stance.r,
         .theta_rate = random.uniform(0.1, 0.5) * std::sqrt(p.model.gravity / stance.r),
         .r_rate = 0}};
    FallPlan a, b;
    pruned.each.push_back(milliseconds([&] { a = planExactly(same, x); }));
    plain.each.push_back(milliseconds([&] { b = planUnpruned(same, x); }));
    if (a.cost != b.cost) ++differ;
  }
  fmt::print(
      "{:10} {:8} {:8} {:7}  {:7.2f} {:7.2f}  {:8.1f}  {:6.2f} {:4}  {:8.1f}{} {:5}  {:5.0f} "
      "{:4.2f}\n",
      falls.robot->name, setup.stance, setup.direction,
      stall == Stall::kStops ? "stops" : "literal", quick.mean(), quick.p99(), exact.mean(),
      100 * (found / optimum - 1), dead, plain.mean() / pruned.mean(), coarse ? "*" : " ", differ,
      build, static_cast<double>(table->bytes()) / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  const int starts = argc > 1 ? std::atoi(argv[1]) : 200;
  fmt::print("{} random starts; CPU times of one core\n", starts);
  fmt::print("{:10} {:8} {:8} {:7}  {:>7} {:>7}  {:>8}  {:>6} {:>4}  {:>8} {:>5}  {:>5} {:>4}\n",
             "robot", "stance", "", "stall", "mean ms", "p99 ms", "exact ms", "cost+%", "dead",
             "unpruned", "other", "table", "MB");
  fmt::print("{:>70}  {:>6} {:>4}  {:>8} {:>5}  {:>5}\n", "", "", "ends", "/ exact", "plan", "ms");
  fmt::print("{:>92}\n", "*: coarse grid");
  for (const char* robot : {"atlas", "bioloid-gp"}) {
    const FallRobot falls = FallRobot::fromFile(fmt::format("models/{}/falls.toml", robot));
    for (const FallSetup& setup : falls.setups) {
      measure(falls, setup, Stall::kStops, starts);
      if (falls.robot->name == "atlas") measure(falls, setup, Stall::kLiteral, starts);
    }
  }
}
