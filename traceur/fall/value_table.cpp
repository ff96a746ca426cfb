#include "traceur/fall/value_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "traceur/fall/expansion.h"

namespace traceur::fall {
namespace {

/// Where the table ends: later, all of a stopper's angles can be reached; further back or faster,
/// the value changes little [ours].
constexpr double kLatest = 1.5;     // [s]
constexpr double kFurthest = -1.2;  // [rad]
constexpr double kFastest = 2.0;    // of √(2 g/r), the rate of a fall to the ground

double flat(const FallProblem& problem, double r) {
  return problem.model.mass * std::sqrt(2 * problem.model.gravity * r);
}

}  // namespace

void ValueTable::layOut(const FallProblem& problem) {
  assert(!problem.lengths.empty());
  const size_t each = static_cast<size_t>(grid_.times) * grid_.angles * grid_.lengths * grid_.rates;
  values_.resize(each * problem.graph.nodes.size());
  for (size_t node = 0; node < problem.graph.nodes.size(); ++node) {
    const auto [shortest, longest] = problem.lengths[node];
    nodes_.push_back({{0, kLatest, grid_.times},
                      {kFurthest, std::numbers::pi / 2, grid_.angles},
                      {shortest, longest, grid_.lengths},
                      {0, kFastest * std::sqrt(2 * problem.model.gravity / longest), grid_.rates},
                      each * node});
  }
}

ValueTable::ValueTable(const FallProblem& problem, const ValueGrid& grid, const float* values)
    : grid_(grid) {
  layOut(problem);
  std::copy_n(values, values_.size(), values_.begin());
}

ValueTable::ValueTable(const FallProblem& problem, const ValueGrid& grid) : grid_(grid) {
  layOut(problem);
  std::vector<int> order = problem.graph.order();
  std::reverse(order.begin(), order.end());
  Expansion expansion;
  for (const int node : order) {
    const Node& n = nodes_[node];
    const double dead = flat(problem, problem.lengths[node].second);
    size_t i = n.first;
    for (int t = 0; t < grid.times; ++t) {
      for (int a = 0; a < grid.angles; ++a) {
        for (int l = 0; l < grid.lengths; ++l) {
          for (int w = 0; w < grid.rates; ++w) {
            const FallState x{
                node,
                n.time.at(t),
                {.theta = n.theta.at(a), .r = n.r.at(l), .theta_rate = n.rate.at(w), .r_rate = 0}};
            double best = dead;
            if (stopped(problem, x.pendulum)) {
              best = 0;
            } else {
              expand(problem, x, expansion);
              if (expansion.stops) best = 0;
              for (const PlannedContact& c : expansion.contacts) {
                if (c.impact.impulse >= best) continue;
                const FallState next = c.next();
                const double rest = stopped(problem, next.pendulum) ? 0 : at(next);
                best = std::min(best, std::max(c.impact.impulse, rest));
              }
            }
            values_[i++] = static_cast<float>(best);
          }
        }
      }
    }
  }
}

double ValueTable::at(const FallState& x) const {
  const Node& n = nodes_[x.contact];
  const Axis* axes[4] = {&n.time, &n.theta, &n.r, &n.rate};
  const double where[4] = {x.time, x.pendulum.theta, x.pendulum.r, x.pendulum.theta_rate};
  size_t low[4];
  double part[4];
  size_t stride[4];
  size_t s = 1;
  for (int i = 3; i >= 0; --i) {
    const double u =
        std::clamp((where[i] - axes[i]->min) / (axes[i]->max - axes[i]->min), 0.0, 1.0) *
        (axes[i]->n - 1);
    low[i] = std::min(static_cast<size_t>(u), static_cast<size_t>(axes[i]->n - 2));
    part[i] = u - static_cast<double>(low[i]);
    stride[i] = s;
    s *= axes[i]->n;
  }
  double value = 0;
  for (int corner = 0; corner < 16; ++corner) {
    double weight = 1;
    size_t index = n.first;
    for (int i = 0; i < 4; ++i) {
      const bool upper = ((corner >> i) & 1) != 0;
      weight *= upper ? part[i] : 1 - part[i];
      index += (low[i] + (upper ? 1 : 0)) * stride[i];
    }
    if (weight > 0) value += weight * values_[index];
  }
  return value;
}

FallPlan planQuickly(const FallProblem& problem, const ValueTable& table, const FallState& start,
                     const QuickSearch& search) {
  std::vector<std::pair<double, const PlannedContact*>> ranked;
  return PlanSearch(problem, true,
                    [&](size_t depth, double bound, const std::vector<PlannedContact>& all,
                        std::vector<const PlannedContact*>& chosen) {
                      ranked.clear();
                      for (const PlannedContact& c : all) {
                        if (c.impact.impulse >= bound) continue;
                        const FallState next = c.next();
                        const double rest = stopped(problem, next.pendulum) ? 0 : table.at(next);
                        ranked.emplace_back(std::max(c.impact.impulse, rest), &c);
                      }
                      const size_t most =
                          depth == 0 ? search.first : (depth == 1 ? search.second : search.later);
                      const size_t n = std::min(most, ranked.size());
                      std::partial_sort(
                          ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(n),
                          ranked.end(),
                          [](const auto& a, const auto& b) { return a.first < b.first; });
                      for (size_t i = 0; i < n; ++i) chosen.push_back(ranked[i].second);
                    })
      .plan(start);
}

}  // namespace traceur::fall
