#include "traceur/bias/faulty_bongo_board.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <nlopt.hpp>

namespace traceur::bias {
namespace {

BongoParameters scaled(BongoParameters p, double scale) {
  p.inertia_scale *= scale;
  return p;
}

}  // namespace

FaultyBongoBoard::FaultyBongoBoard(const BongoParameters& p, const BongoModelFaults& faults,
                                   double time_step)
    : board_(scaled(p, faults.inertia_scale), time_step), faults_(faults) {
  offset_moment_ =
      -2 * p.pelvis_mass * p.inertia_scale * faults.inertia_scale * p.gravity * faults.com_offset;
  const double steps = faults.delay / time_step;
  part_ = steps - std::floor(steps);
  late_.assign(static_cast<size_t>(steps) + 2, 0);
}

void FaultyBongoBoard::reset(const VectorXd& x) {
  x_ = x;
  std::fill(late_.begin(), late_.end(), 0.0);
}

void FaultyBongoBoard::setPast(const Eigen::Ref<const VectorXd>& torques) {
  const size_t n = late_.size();
  for (size_t i = 1; i <= n; ++i) {
    const auto from = torques.size() - static_cast<Eigen::Index>(i);
    late_[(now_ + n - i) % n] = from < 0 ? 0 : torques[from];
  }
}

void FaultyBongoBoard::step(const VectorXd& u) {
  assert(u.size() == 1);
  const size_t n = late_.size();
  late_[now_] = u[0];
  // The oldest two: the delay lies between theirs.
  const double torque = (1 - part_) * late_[(now_ + 2) % n] + part_ * late_[(now_ + 1) % n];
  now_ = (now_ + 1) % n;
  const BongoBoard::State x = x_;
  // Less than all of it at rates that it would turn round within a step (0.0027 rad/s for 1 N·m),
  // so that it brakes and never drives.
  const double slip = x[5] / (1e-3 + 3e-3 * faults_.coulomb_friction);
  const double friction =
      faults_.coulomb_friction * std::clamp(slip, -1.0, 1.0) + faults_.viscous_friction * x[5];
  x_ = board_.stepped(x, torque - friction, offset_moment_ * std::cos(x[0] + x[1]));
}

BongoModelFaults identify(const std::vector<RunLog>& logs, const BongoParameters& board,
                          const BiasOptions& o,
                          const std::function<bool(const VectorXd& x)>& keep) {
  struct Window {
    const RunLog* log;
    int begin;
  };
  std::vector<Window> windows;
  for (const RunLog& log : logs) {
    for (int t = 0; t + o.average <= log.steps(); t += o.stride) {
      bool good = true;
      for (int i = t; i <= t + o.average && good; ++i) good = keep(log.x.col(i));
      if (good) windows.push_back({&log, t});
    }
  }
  if (windows.empty()) return {};

  Eigen::Vector3d deviation = Eigen::Vector3d::Ones();
  const auto squares = [&](const BongoModelFaults& faults) {
    FaultyBongoBoard model(board, faults, logs.front().time_step);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Window& w : windows) {
      model.reset(w.log->x.col(w.begin));
      model.setPast(w.log->u.row(0).head(w.begin).transpose());
      for (int i = w.begin; i < w.begin + o.average; ++i) model.step(w.log->u.col(i));
      const VectorXd missed = w.log->x.col(w.begin + o.average) - model.state();
      sum += missed.tail<3>().cwiseQuotient(deviation).cwiseAbs2();
    }
    return Eigen::Vector3d(sum / static_cast<double>(windows.size()));
  };
  deviation = squares({}).cwiseSqrt().cwiseMax(1e-12);

  // In units in which 1 is a fault worth finding.
  static constexpr std::array<double, 5> kUnit = {0.1, 0.002, 1, 1, 0.001};
  static constexpr std::array<double, 5> kLower = {-5, 0, 0, 0, -20};
  static constexpr std::array<double, 5> kUpper = {10, 10, 20, 20, 20};
  const auto faults_of = [](const std::vector<double>& y) {
    return BongoModelFaults{1 + kUnit[0] * y[0], kUnit[1] * y[1], kUnit[2] * y[2], kUnit[3] * y[3],
                            kUnit[4] * y[4]};
  };
  auto cost = [&](const std::vector<double>& y) { return squares(faults_of(y)).sum(); };
  nlopt::opt search(nlopt::LN_SBPLX, 5);
  search.set_lower_bounds({kLower.begin(), kLower.end()});
  search.set_upper_bounds({kUpper.begin(), kUpper.end()});
  search.set_initial_step(1.0);
  search.set_maxeval(600);
  search.set_xtol_rel(1e-3);
  search.set_min_objective([](const std::vector<double>& y, std::vector<double>&,
                              void* data) { return (*static_cast<decltype(&cost)>(data))(y); },
                           &cost);
  std::vector<double> y(5, 0.0);
  y[1] = 0.5;
  double value = 0;
  search.optimize(y, value);
  return faults_of(y);
}

}  // namespace traceur::bias
