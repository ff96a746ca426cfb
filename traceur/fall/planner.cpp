#include "traceur/fall/planner.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "traceur/core/infinity.h"
#include "traceur/fall/expansion.h"

namespace traceur::fall {
namespace {

/// How far a stopper has to turn from where it is in the stance [rad].
double turnOf(const FallProblem& problem, int from, size_t edge, double theta2) {
  return std::abs(std::remainder(theta2 - problem.first_angle[from][edge], 2 * std::numbers::pi));
}

/// The contact of a stopper now, where reach and speed allow it.
std::optional<Impact> touch(const FallProblem& problem, const FallState& from, size_t edge,
                            double theta2, double time, const PendulumState& s) {
  const std::optional<double> r2 = stopperLength(s, theta2);
  if (!r2 || !problem.reach[from.contact][edge].reachable(s.r, *r2, theta2)) return std::nullopt;
  if (turnOf(problem, from.contact, edge, theta2) > time * problem.stopper_speed) {
    return std::nullopt;
  }
  return impact(problem.model, s, theta2);
}

int stepsOf(const FallProblem& problem, double time) {
  return static_cast<int>(std::lround(time / problem.model.step));
}

/// How far beyond the random poses a rod is planned for [ours]: they do not meet the extremes.
constexpr double kBeyondPoses = 1.05;

/// Whether the robot can make a rod that long. Growing without end it would stop any fall; and from
/// states that no pose has, plans are worse than what was begun [of 100 random pushes of Atlas on
/// two feet 26 come out otherwise, 20 of them better; the mean share falls from 0.57 to 0.52].
bool withinReach(const FallProblem& problem, int node, double r) {
  if (problem.lengths.empty()) return true;
  const auto [least, most] = problem.lengths[node];
  return least / kBeyondPoses <= r && r <= kBeyondPoses * most;
}

double rodRate(const FallProblem& problem, int i) {
  const int n = problem.grid.rod_rates;
  return n == 1 ? 0 : problem.rod_speed * (2.0 * i / (n - 1) - 1);
}

}  // namespace

bool stopped(const FallProblem& problem, const PendulumState& after) {
  if (after.theta_rate <= 0) return true;
  if (problem.stall == Stall::kLiteral || after.theta >= 0) return false;
  // With ṙ₁ = 0 it passes over its pivot if ½ r² θ̇² > g r (1 - cos θ).
  return after.r * after.theta_rate * after.theta_rate <
         2 * problem.model.gravity * (1 - std::cos(after.theta));
}

void expand(const FallProblem& problem, const FallState& from, Expansion& out) {
  out.stops = false;
  out.contacts.clear();
  const std::vector<int>& next = problem.graph.edges[from.contact];
  const int stride = stepsOf(problem, problem.grid.time);
  const int last = stepsOf(problem, problem.horizon);
  const int angles = static_cast<int>(std::lround(2 * std::numbers::pi / problem.grid.angle));
  // What can be known of a stopper before its contact is computed: whether it points down, and from
  // when on it can be there.
  struct Stopper {
    size_t edge;
    double theta2, cos, sin, soonest;
  };
  std::vector<Stopper> stoppers;
  for (size_t edge = 0; edge < next.size(); ++edge) {
    for (int a = 0; a < angles; ++a) {
      const double theta2 = -std::numbers::pi + (a + 1) * problem.grid.angle;
      stoppers.push_back({edge, theta2, std::cos(theta2), std::sin(theta2),
                          turnOf(problem, from.contact, edge, theta2) / problem.stopper_speed});
    }
  }
  for (int i = 0; i < problem.grid.rod_rates; ++i) {
    const double rate = rodRate(problem, i);
    PendulumState s = from.pendulum;
    for (int k = 1; k <= last && s.theta < std::numbers::pi / 2; ++k) {
      step(problem.model, rate, s);
      if (!withinReach(problem, from.contact, s.r)) break;
      if (s.theta_rate <= 0) {
        out.stops = out.stops || problem.stall == Stall::kStops;
        break;
      }
      if (k % stride != 0) continue;
      const double duration = k * problem.model.step;
      if (duration < problem.least_interval) continue;
      const double time = from.time + duration;
      const double c = std::cos(s.theta);
      const double n = std::sin(s.theta);
      for (const Stopper& stopper : stoppers) {
        static constexpr double kRounding = 1e-9;
        if (stopper.soonest > time + kRounding) continue;
        if (c * stopper.cos - n * stopper.sin > kRounding) continue;
        const auto hit = touch(problem, from, stopper.edge, stopper.theta2, time, s);
        if (!hit) continue;
        out.contacts.push_back(
            {from, {next[stopper.edge], stopper.theta2, duration, rate}, s, *hit});
      }
    }
    if (out.stops) {
      out.contacts.clear();
      return;
    }
  }
}

std::optional<PlannedContact> tryAction(const FallProblem& problem, const FallState& from,
                                        const FallAction& action) {
  const std::vector<int>& next = problem.graph.edges[from.contact];
  const auto edge = std::find(next.begin(), next.end(), action.contact);
  if (edge == next.end()) return std::nullopt;
  PendulumState s = from.pendulum;
  if (action.duration < problem.least_interval) return std::nullopt;
  for (int k = stepsOf(problem, action.duration); k > 0; --k) {
    step(problem.model, action.rod_rate, s);
    if (!withinReach(problem, from.contact, s.r)) return std::nullopt;
    if (s.theta_rate <= 0 || s.theta >= std::numbers::pi / 2) return std::nullopt;
  }
  const auto hit =
      touch(problem, from, edge - next.begin(), action.theta2, from.time + action.duration, s);
  if (!hit) return std::nullopt;
  return PlannedContact{from, action, s, *hit};
}

FallPlan PlanSearch::plan(const FallState& start) {
  FallPlan found;
  found.cost = costToGo(start, kInfinity, 0, found.contacts);
  std::reverse(found.contacts.begin(), found.contacts.end());
  return found;
}

double PlanSearch::costToGo(const FallState& x, double bound, size_t depth,
                            std::vector<PlannedContact>& plan) {
  plan.clear();
  if (stopped(problem_, x.pendulum)) return 0;
  ++effort.states;
  if (depth == levels_.size()) levels_.push_back(std::make_unique<Level>());
  Level& level = *levels_[depth];
  expand(problem_, x, level.expansion);
  if (level.expansion.stops) return 0;
  level.chosen.clear();
  choose_(depth, bound, level.expansion.contacts, level.chosen);
  double best = bound;
  for (const PlannedContact* c : level.chosen) {
    if (prunes_ && c->impact.impulse >= best) continue;
    ++effort.actions;
    double limit = kInfinity;
    if (prunes_) limit = best;
    const double rest = costToGo(c->next(), limit, depth + 1, level.deeper);
    const double cost = std::max(c->impact.impulse, rest);
    if (!(cost < best)) continue;
    best = cost;
    level.best = level.deeper;
    level.best.push_back(*c);
    plan = level.best;
  }
  return best;
}

namespace {

/// Algorithm 1 with its cache of values.
class CachedSearch {
 public:
  CachedSearch(const FallProblem& problem, double tolerance)
      : problem_(problem), tolerance_(tolerance), seen_(problem.graph.nodes.size()) {}

  double costToGo(const FallState& x, std::optional<FallAction>* first) {
    if (stopped(problem_, x.pendulum)) return 0;
    const Key key = keyOf(x);
    if (!first) {
      if (const Seen* near = nearest(x.contact, key)) return near->cost;
    }
    ++effort.states;
    Expansion expansion;
    expand(problem_, x, expansion);
    double best = expansion.stops ? 0 : kInfinity;
    std::optional<FallAction> action;
    for (const PlannedContact& c : expansion.contacts) {
      ++effort.actions;
      const double cost = std::max(c.impact.impulse, costToGo(c.next(), nullptr));
      if (!(cost < best)) continue;
      best = cost;
      action = c.action;
    }
    seen_[x.contact].push_back({key, best, action});
    if (first) *first = action;
    return best;
  }

  /// The action of the nearest state seen, however far.
  std::optional<FallAction> actionNear(const FallState& x) const {
    const Seen* best = nullptr;
    double least = kInfinity;
    const Key key = keyOf(x);
    for (const Seen& s : seen_[x.contact]) {
      const double d = (s.key - key).squaredNorm();
      if (d < least) {
        least = d;
        best = &s;
      }
    }
    return best ? best->action : std::nullopt;
  }

  PlanEffort effort;

 private:
  using Key = Eigen::Matrix<double, 5, 1>;
  struct Seen {
    Key key;
    double cost;
    std::optional<FallAction> action;
  };

  /// Weights of t, θ₁, r₁, θ̇₁ and ṙ₁ [Ha2015, §4.3.2]; that of the contact, 100, lets no two
  /// nodes be near each other.
  static Key keyOf(const FallState& x) {
    return {x.time, x.pendulum.theta, 0.1 * x.pendulum.r, 2 * x.pendulum.theta_rate,
            4 * x.pendulum.r_rate};
  }

  const Seen* nearest(int contact, const Key& key) const {
    for (const Seen& s : seen_[contact]) {
      if ((s.key - key).squaredNorm() < tolerance_ * tolerance_) return &s;
    }
    return nullptr;
  }

  const FallProblem& problem_;
  double tolerance_;
  std::vector<std::vector<Seen>> seen_;
};

}  // namespace

FallPlan planExactly(const FallProblem& problem, const FallState& start, PlanEffort* effort) {
  PlanSearch search(problem, true,
                    [](size_t, double bound, const std::vector<PlannedContact>& all,
                       std::vector<const PlannedContact*>& chosen) {
                      for (const PlannedContact& c : all) {
                        if (c.impact.impulse < bound) chosen.push_back(&c);
                      }
                      std::stable_sort(chosen.begin(), chosen.end(), [](auto* a, auto* b) {
                        return a->impact.impulse < b->impact.impulse;
                      });
                    });
  FallPlan found = search.plan(start);
  if (effort) *effort = search.effort;
  return found;
}

FallPlan planUnpruned(const FallProblem& problem, const FallState& start, PlanEffort* effort) {
  PlanSearch search(problem, false,
                    [](size_t, double, const std::vector<PlannedContact>& all,
                       std::vector<const PlannedContact*>& chosen) {
                      for (const PlannedContact& c : all) chosen.push_back(&c);
                    });
  FallPlan found = search.plan(start);
  if (effort) *effort = search.effort;
  return found;
}

FallPlan planCached(const FallProblem& problem, const FallState& start, double tolerance,
                    PlanEffort* effort) {
  CachedSearch search(problem, tolerance);
  std::optional<FallAction> action;
  search.costToGo(start, &action);
  std::vector<FallAction> actions;
  FallState x = start;
  while (action) {
    const auto contact = tryAction(problem, x, *action);
    actions.push_back(*action);
    if (!contact) break;
    x = contact->next();
    if (stopped(problem, x.pendulum)) break;
    action = search.actionNear(x);
  }
  if (effort) *effort = search.effort;
  return replay(problem, start, actions);
}

FallPlan replay(const FallProblem& problem, const FallState& start,
                const std::vector<FallAction>& actions) {
  FallPlan plan;
  FallState x = start;
  Expansion expansion;
  for (const FallAction& action : actions) {
    if (stopped(problem, x.pendulum)) return plan;
    const auto contact = tryAction(problem, x, action);
    if (!contact) break;
    plan.cost = std::max(plan.cost, contact->impact.impulse);
    x = contact->next();
    plan.contacts.push_back(*contact);
  }
  if (stopped(problem, x.pendulum)) return plan;
  expand(problem, x, expansion);
  if (!expansion.stops) plan.cost = kInfinity;
  return plan;
}

std::vector<HeldImpact> heldFall(const FallProblem& problem, const std::vector<HeldPart>& parts,
                                 const FallState& start) {
  struct Rigid {
    const HeldPart* part;
    double r2;
    double theta2;
    bool down = false;
  };
  std::vector<Rigid> rest;
  rest.reserve(parts.size());
  for (const HeldPart& p : parts) rest.push_back({&p, p.r2, p.theta2, false});
  std::vector<HeldImpact> impacts;
  PendulumState s = start.pendulum;
  double time = start.time;
  const int last = stepsOf(problem, problem.horizon);
  for (int k = 0; k < last && s.theta_rate > 0 && s.theta < std::numbers::pi / 2; ++k) {
    step(problem.model, 0, s);
    time += problem.model.step;
    for (Rigid& r : rest) {
      const double angle = s.theta + r.theta2;
      if (r.down || s.com().y() + r.r2 * std::cos(angle) > 0) continue;
      r.down = true;
      const auto hit = impact(problem.model, s, r.theta2);
      if (!hit) continue;
      impacts.push_back({r.part->name, time, hit->impulse});
      // The rod turns to the new pivot; what is fixed to the body stays where it is.
      const double turned = s.theta - hit->after.theta;
      for (Rigid& other : rest) other.theta2 += turned;
      s = hit->after;
      break;
    }
  }
  return impacts;
}

}  // namespace traceur::fall
