// What learning a bias costs: a prediction of it against a step of the model, and a policy search
// on the corrected model. All in one run, so that ratios mean something on a busy machine.
//
//   bench_bias
#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "traceur/bias/bongo_learning.h"
#include "traceur/core/random.h"

namespace {

using namespace traceur;
using Eigen::VectorXd;

double cpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Least CPU time of a call [us]: other programs only ever add.
template <typename F>
double microseconds(F call) {
  static constexpr int kCalls = 20000;
  double least = 1e300;
  for (int repeat = 0; repeat < 15; ++repeat) {
    const double begin = cpuSeconds();
    for (int i = 0; i < kCalls; ++i) call();
    least = std::min(least, 1e6 * (cpuSeconds() - begin) / kCalls);
  }
  return least;
}

gp::Regression regression(int inputs, int samples) {
  Random random(3);
  gp::Regression g({VectorXd::Ones(inputs), 1, 0.135}, 6);
  for (int i = 0; i < samples; ++i) {
    VectorXd x(inputs), y(6);
    for (double& v : x) v = random.normal();
    for (double& v : y) v = random.normal();
    g.add(x, y);
  }
  return g;
}

}  // namespace

int main() {
  bias::BongoBoard board;
  const VectorXd u = VectorXd::Constant(1, 3);
  const VectorXd x0 = bias::bongoStart(0.001, 0.002);
  board.reset(x0);
  int steps = 0;
  const double step = microseconds([&] {
    if (++steps % 100 == 0) board.reset(x0);
    board.step(u);
  });
  fmt::print("step of the model                        {:6.3f} us\n", step);
  for (const int n : {100, 600}) {
    const gp::Predictor predictor(regression(7, n));
    gp::Predictor::Scratch scratch;
    VectorXd x = VectorXd::Constant(7, 0.3), mean(6);
    const double both = microseconds([&] {
      x[0] += 1e-6;
      predictor.meanAndVariance(x, mean, scratch);
    });
    const double alone = microseconds([&] {
      x[0] += 1e-6;
      predictor.mean(x, mean, scratch);
    });
    fmt::print(
        "prediction, 6 outputs, N = {:3}           {:6.3f} us, {:4.1f} steps; mean alone "
        "{:6.3f} us, {:4.1f} steps\n",
        n, both, both / step, alone, alone / step);
  }

  // 1000 rollouts of 5 s that all stay up, on a model corrected by runs of a heavier machine.
  bias::BongoMachine machine;
  machine.faults.inertia_scale = 1.2;
  VectorXd parameters(5);  // balances on it from everywhere within 0.5 degrees
  parameters << 7.4754, 3.3687, -2.3216, -0.9873, 5.4532;
  bias::BongoLearning o;
  std::vector<bias::RunLog> logs;
  logs.reserve(2);
  for (int i = 0; i < 2; ++i) {
    logs.push_back(bias::runMachine(machine, o.board, parameters, 1, i).log);
  }
  const auto models = bias::bongoLearner(o)(logs, 1);
  const bias::BalancePolicy policy = bias::BalancePolicy::of(parameters);
  static constexpr int kRollouts = 100;
  int up = 0;
  const double begin = cpuSeconds();
  for (int i = 0; i < kRollouts; ++i) {
    const auto x = bias::bongoStart(1e-5 * i, 0.002);
    up += bias::balance(*models.plants[0], o.board, policy, x).failed() ? 0 : 1;
  }
  fmt::print("1000 rollouts of 5 s on the corrected model {:5.1f} s ({} of {} stayed up)\n",
             (cpuSeconds() - begin) * 1000 / kRollouts, up, kRollouts);
}
