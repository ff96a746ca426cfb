#include "traceur/optim/curve_race.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace traceur::optim {
namespace {

/// A fall that counts [ours].
constexpr double kGain = 0.2;
/// Curves at a time [ours: enough for the processors of a small computer; with more, more are drawn
/// about a curve that is no longer the best].
constexpr size_t kEntrants = 8;
/// Factors of the step size, at rest with one winner in eleven; the least, for a lucky winner where
/// costs are rough would end all search; and the largest [ours; kicks].
constexpr double kGrowth = 1.5;
constexpr double kShrink = 0.96;
constexpr double kLeastStep = 0.03;
constexpr double kLargestStep = 2;

}  // namespace

void Gain::note(double cost, std::uint64_t passed) {
  since += passed;
  if (!(from - cost >= kGain * std::abs(from))) return;  // from infinity it is
  from = cost;
  since = 0;
}

CurveRace::CurveRace(int tasks) : least_(tasks, std::numeric_limits<double>::infinity()) {}

void CurveRace::see(const std::vector<double>& task_costs) {
  for (size_t i = 0; i < least_.size(); ++i) least_[i] = std::fmin(least_[i], task_costs[i]);
}

void CurveRace::offer(const Curve& curve) {
  if (curve.cost < best_.cost) best_ = curve;
}

void CurveRace::begin(const Draw& draw) {
  step_size_ = 1;
  gain_ = {best_.cost, 0};
  fill(draw);
}

void CurveRace::tell(const std::vector<double>& costs) {
  const auto M = static_cast<double>(least_.size());
  std::vector<Entrant> left;
  for (size_t k = 0; k < entrants_.size(); ++k) {
    Entrant& e = entrants_[k];
    e.costs.push_back(costs[k]);
    double hoped = std::accumulate(e.costs.begin(), e.costs.end(), 0.0);
    for (size_t i = e.costs.size(); i < e.order.size(); ++i) hoped += least_[e.order[i]];
    const bool may_win = hoped / M < best_.cost;  // not with a NaN
    if (may_win && e.costs.size() < e.order.size()) {
      left.push_back(std::move(e));
      continue;
    }
    if (may_win) {
      best_.points = std::move(e.points);
      best_.cost = hoped / M;
      for (size_t i = 0; i < e.order.size(); ++i) best_.task_costs[e.order[i]] = e.costs[i];
    }
    step_size_ = std::min(step_size_ * (may_win ? kGrowth : kShrink), kLargestStep);
    if (step_size_ < kLeastStep) step_size_ = 1;
  }
  entrants_ = std::move(left);
  trials_ += costs.size();
  gain_.note(best_.cost, costs.size());
}

void CurveRace::fill(const Draw& draw) {
  std::vector<int> order(least_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int i, int j) { return best_.task_costs[i] > best_.task_costs[j]; });
  for (int k = 0; entrants_.size() < kEntrants; ++k) {
    entrants_.push_back({draw(step_size_, k), order, {}});
  }
}

void CurveRace::save(StateWriter& w) const {
  const bool any = std::isfinite(best_.cost);
  w.integer(any);
  if (any) {
    w.reals(numbers(best_.points));
    w.real(best_.cost);
    w.reals(best_.task_costs);
  }
  w.reals(least_);
  w.real(step_size_);
  w.real(gain_.from);
  w.integer(gain_.since);
  w.integer(trials_);
  w.integer(entrants_.size());
  for (const Entrant& e : entrants_) {
    w.reals(numbers(e.points));
    w.reals(std::vector<double>(e.order.begin(), e.order.end()));
    w.reals(e.costs);
  }
}

void CurveRace::restore(StateReader& r, int n, int K) {
  best_ = {};
  if (r.integer() != 0) {
    best_.points.resize(n, K);
    r.reals(numbers(best_.points));
    best_.cost = r.real();
    best_.task_costs = r.reals();
  }
  least_ = r.reals();
  step_size_ = r.real();
  gain_.from = r.real();
  gain_.since = r.integer();
  trials_ = r.integer();
  entrants_.resize(r.integer());
  for (Entrant& e : entrants_) {
    e.points.resize(n, K);
    r.reals(numbers(e.points));
    e.order.clear();
    for (const double task : r.reals()) e.order.push_back(static_cast<int>(task));
    e.costs = r.reals();
  }
}

}  // namespace traceur::optim
