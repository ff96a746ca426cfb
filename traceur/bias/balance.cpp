#include "traceur/bias/balance.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::bias {

BalancePolicy BalancePolicy::of(const VectorXd& parameters) {
  assert(parameters.size() == kParameters);
  BalancePolicy policy;
  for (int i = 0; i < kParameters; ++i) {
    policy.h[i] = std::copysign(std::expm1(std::abs(parameters[i])), parameters[i]);
  }
  return policy;
}

double BalancePolicy::torque(const BongoParameters& board, const BongoBoard::State& x) const {
  const double rolled = from_wheel ? board.wheel_radius : 0;  // the wheel's centre is at -r α_w
  const double place = poseOf(board, x).pelvis.x() + rolled * x[0];
  const double speed = pelvisVelocity(board, x) + rolled * x[3];
  const double u = h[0] * place + h[1] * speed + h[2] * x[2] + h[3] * x[5] + h[4] * (x[0] + x[1]);
  return std::clamp(u, -most_torque, most_torque);
}

std::string BalanceLimits::failure(const BongoParameters& board, const BongoBoard::State& x) const {
  // A reading that is no number has failed, too: comparisons with it are false.
  const auto within = [](double value, double limit) { return std::abs(value) <= limit; };
  if (!within(x[0] + x[1] + x[2], body_angle)) return "body angle";
  if (!within(x[0] + x[1], board_angle)) return "board angle";
  if (!within(x[3], rate) || !within(x[4], rate) || !within(x[3] + x[4], rate)) return "rate";
  if (!within(x.head<3>().lpNorm<1>(), distance)) return "distance";
  // Flatter than this the board is off the ground wherever on the wheel it lies.
  static constexpr double kFlat = 0.15;
  if (std::abs(x[0] + x[1]) > kFlat && boardHeight(board, x) < board_height) {
    return "board on the ground";
  }
  return "";
}

Episode balance(Plant& plant, const BongoParameters& board, const BalancePolicy& policy,
                const VectorXd& x0, const BalanceCost& cost, const BalanceLimits& limits,
                RunLog* log) {
  Episode episode;
  plant.reset(x0);
  if (log) {
    log->time_step = plant.timeStep();
    log->x.resize(6, cost.steps + 1);
    log->u.resize(1, cost.steps);
    log->x.col(0) = plant.state();
  }
  double farthest = 0;
  double effort = 0;
  VectorXd u(1);
  while (episode.steps < cost.steps) {
    const BongoBoard::State x = plant.state();
    episode.failure = limits.failure(board, x);
    if (episode.failed()) break;
    farthest = std::max(farthest, cost.of(x));
    u[0] = policy.torque(board, x);
    effort += cost.torque * u[0] * u[0];
    plant.step(u);
    if (log) {
      log->u(0, episode.steps) = u[0];
      log->x.col(episode.steps + 1) = plant.state();
    }
    ++episode.steps;
  }
  if (log) {
    log->x.conservativeResize(Eigen::NoChange, episode.steps + 1);
    log->u.conservativeResize(Eigen::NoChange, episode.steps);
  }
  episode.cost = cost.failure * (cost.steps - episode.steps) + farthest + effort;
  return episode;
}

}  // namespace traceur::bias
