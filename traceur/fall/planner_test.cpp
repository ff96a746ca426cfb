// Planning held against the same in few lines, on a robot of three parts that exists nowhere else.
#include "traceur/fall/planner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/core/toml.h"
#include "traceur/fall/embedded/fall_plan.h"
#include "traceur/fall/expansion.h"
#include "traceur/fall/plan_library.h"
#include "traceur/fall/value_table.h"

namespace traceur::fall {
namespace {

constexpr double kPi = std::numbers::pi;

/// Feet, knees and hands, which touch in this order, knees or not.
FallProblem threeParts() {
  FallProblem p;
  p.model = {.mass = 2, .inertia = 0.03, .gravity = 9.7, .step = 0.01};
  p.graph.nodes = {{"feet", {}}, {"knees", {}}, {"hands", {}}};
  p.graph.edges = {{1, 2}, {2}, {}};
  p.first_angle = {{2.6, -2.9}, {1.4}, {}};  // the hands go round through ±π
  p.lengths = {{0.18, 0.34}, {0.12, 0.3}, {0.1, 0.4}};
  for (const std::vector<int>& edges : p.graph.edges) {
    p.reach.emplace_back();
    for (size_t e = 0; e < edges.size(); ++e) {
      ReachTable table(0.02, 0.5);
      for (double r1 = 0.11; r1 < 0.4; r1 += 0.02) {
        for (double r2 = 0.11; r2 < 0.37; r2 += 0.02) {
          for (int a = 0; a < ReachTable::kAngles; ++a) table.mark(r1, r2, 0.04 + a * kPi / 36);
        }
      }
      p.reach.back().push_back(std::move(table));
    }
  }
  p.rod_speed = 0.15;
  p.stopper_speed = 4;
  p.least_interval = 0.1;
  p.grid = {.rod_rates = 3, .time = 0.05, .angle = 0.3};
  p.horizon = 0.6;
  return p;
}

FallState startOfThreeParts(int i) {
  Random random(3, 1, i);
  return {i % 5 == 4 ? 1 : 0,
          i % 3 * 0.1,
          {.theta = random.uniform(-0.2, 0.3),
           .r = random.uniform(0.2, 0.3),
           .theta_rate = random.uniform(0.5, 3),
           .r_rate = random.uniform(-0.1, 0.1)}};
}

/// All that may happen next, every action by itself; `stops` as Expansion.
std::vector<PlannedContact> byHand(const FallProblem& p, const FallState& from, bool& stops) {
  std::vector<PlannedContact> found;
  const auto [least, most] = p.lengths[from.contact];
  stops = false;
  const int angles = static_cast<int>(std::lround(2 * kPi / p.grid.angle));
  for (int i = 0; i < p.grid.rod_rates; ++i) {
    const double rate =
        p.grid.rod_rates == 1 ? 0 : p.rod_speed * (2. * i / (p.grid.rod_rates - 1) - 1);
    PendulumState s = from.pendulum;
    for (int k = 1; k * p.model.step < p.horizon + 1e-9 && s.theta < kPi / 2; ++k) {
      step(p.model, rate, s);
      if (s.r < least / 1.05 || s.r > most * 1.05) break;
      if (s.theta_rate <= 0) {
        stops = stops || p.stall == Stall::kStops;
        break;
      }
      const double time = k * p.model.step;
      if (std::abs(std::remainder(time, p.grid.time)) > 1e-9) continue;
      if (time < p.least_interval - 1e-9) continue;
      for (size_t e = 0; e < p.graph.edges[from.contact].size(); ++e) {
        for (int a = 1; a <= angles; ++a) {
          const double theta2 = -kPi + a * p.grid.angle;
          double turn = kInfinity;
          for (int round = -2; round <= 2; ++round) {
            turn =
                std::min(turn, std::abs(theta2 - p.first_angle[from.contact][e] + 2 * kPi * round));
          }
          if (turn > p.stopper_speed * (from.time + time)) continue;
          const auto hit = impact(p.model, s, theta2);
          if (!hit) continue;
          if (!p.reach[from.contact][e].reachable(s.r, hit->length, theta2)) continue;
          found.push_back({from, {p.graph.edges[from.contact][e], theta2, time, rate}, s, *hit});
        }
      }
    }
  }
  if (stops) found.clear();
  return found;
}

TEST(Planner, TriesWhatTheProblemAllowsAndNothingElse) {
  size_t seen = 0;
  int stopping = 0;
  Expansion out;
  for (const int rates : {1, 2, 3, 5}) {
    for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
      FallProblem p = threeParts();
      p.grid.rod_rates = rates;
      p.stall = stall;
      for (int i = 0; i < 20; ++i) {
        FallState start = startOfThreeParts(i);
        if (i == 0) start.pendulum = {.theta = -0.3, .r = 0.25, .theta_rate = 1};
        bool stops = false;
        const std::vector<PlannedContact> expected = byHand(p, start, stops);
        expand(p, start, out);
        EXPECT_EQ(out.stops, stops) << i;
        ASSERT_EQ(out.contacts.size(), expected.size()) << i;
        seen += expected.size();
        stopping += stops;
        for (size_t c = 0; c < expected.size(); ++c) {
          const PlannedContact& is = out.contacts[c];
          const PlannedContact& should = expected[c];
          EXPECT_EQ(is.action.contact, should.action.contact);
          EXPECT_EQ(is.action.rod_rate, should.action.rod_rate);
          EXPECT_NEAR(is.action.theta2, should.action.theta2, 1e-9);
          EXPECT_NEAR(is.action.duration, should.action.duration, 1e-9);
          EXPECT_NEAR(is.impact.impulse, should.impact.impulse, 1e-9);
          EXPECT_EQ(is.from.contact, start.contact);
          EXPECT_EQ(is.before.theta, should.before.theta);
          const auto tried = tryAction(p, start, is.action);
          ASSERT_TRUE(tried);
          EXPECT_EQ(tried->impact.impulse, is.impact.impulse);
          EXPECT_EQ(tried->before.theta, is.before.theta);
          EXPECT_EQ(tried->from.time, start.time);
        }
      }
    }
  }
  EXPECT_GT(seen, 1000U);
  EXPECT_GT(stopping, 5);
}

TEST(Planner, AnActionOutsideOfTheProblemIsNone) {
  const FallProblem p = threeParts();
  const FallState start{0, 0.1, {.theta = 0.2, .r = 0.25, .theta_rate = 1}};
  Expansion out;
  expand(p, start, out);
  const auto one = std::find_if(out.contacts.begin(), out.contacts.end(), [&](const auto& c) {
    return c.action.contact == 1 && c.action.rod_rate > 0;
  });
  ASSERT_NE(one, out.contacts.end());
  const auto with = [&](const std::function<void(FallProblem&, FallAction&, FallState&)>& change) {
    FallProblem problem = p;
    FallAction action = one->action;
    FallState from = start;
    change(problem, action, from);
    return tryAction(problem, from, action).has_value();
  };
  EXPECT_TRUE(with([](auto&, auto&, auto&) {}));
  EXPECT_FALSE(with([](auto&, FallAction& a, auto&) { a.contact = 0; }));
  EXPECT_FALSE(with([](FallProblem& q, auto&, auto&) { q.graph.edges[0] = {2}; }));
  // Its time is the least.
  EXPECT_TRUE(with([](FallProblem& q, FallAction& a, auto&) { q.least_interval = a.duration; }));
  EXPECT_FALSE(
      with([](FallProblem& q, FallAction& a, auto&) { q.least_interval = a.duration + 1e-6; }));
  // The rod at its end is as long as a twentieth beyond the poses, or as short.
  const double r = one->before.r;
  const double shortest = start.pendulum.r + one->action.rod_rate * p.model.step;
  for (const double share : {0.999, 1.001}) {
    const bool inside = share < 1;
    EXPECT_EQ(with([&](FallProblem& q, auto&, auto&) { q.lengths[0].second = r / 1.05 / share; }),
              inside);
    EXPECT_EQ(
        with([&](FallProblem& q, auto&, auto&) { q.lengths[0].first = shortest * 1.05 * share; }),
        inside);
  }
  // As quick as the stopper has to be.
  const double turn = std::abs(std::remainder(one->action.theta2 - p.first_angle[0][0], 2 * kPi));
  const double speed = turn / one->next().time;
  EXPECT_TRUE(with([&](FallProblem& q, auto&, auto&) { q.stopper_speed = 1.001 * speed; }));
  EXPECT_FALSE(with([&](FallProblem& q, auto&, auto&) { q.stopper_speed = 0.999 * speed; }));
  EXPECT_FALSE(with([](auto&, auto&, FallState& s) { s.pendulum.theta_rate = -0.5; }));
  EXPECT_FALSE(with([](auto&, auto&, FallState& s) { s.pendulum.theta_rate = 30; }));
  // On its back a stopper would reach the ground again.
  EXPECT_FALSE(with([](auto&, FallAction& a, FallState& s) {
    s.pendulum.theta = 2 * kPi + 0.1;
    a.theta2 -= 0.1;
  }));
}

double value(const FallProblem& p, const FallState& x, PlanEffort& effort) {
  if (stopped(p, x.pendulum)) return 0;
  ++effort.states;
  Expansion out;
  expand(p, x, out);
  double best = out.stops ? 0 : kInfinity;
  for (const PlannedContact& c : out.contacts) {
    ++effort.actions;
    best = std::min(best, std::max(c.impact.impulse, value(p, c.next(), effort)));
  }
  return best;
}

/// The same by branch and bound.
double bounded(const FallProblem& p, const FallState& x, double best, PlanEffort& effort) {
  if (stopped(p, x.pendulum)) return 0;
  ++effort.states;
  Expansion out;
  expand(p, x, out);
  if (out.stops) return 0;
  std::stable_sort(out.contacts.begin(), out.contacts.end(), [](const auto& a, const auto& b) {
    return a.impact.impulse < b.impact.impulse;
  });
  for (const PlannedContact& c : out.contacts) {
    if (c.impact.impulse >= best) break;
    ++effort.actions;
    best = std::min(best, std::max(c.impact.impulse, bounded(p, c.next(), best, effort)));
  }
  return best;
}

/// Algorithm 1 with its cache.
struct CachedByHand {
  struct Seen {
    FallState x;
    double cost;
    std::optional<FallAction> action;
  };
  const FallProblem& p;
  double tolerance;
  std::vector<Seen> seen = {};
  PlanEffort effort = {};

  static double distance(const FallState& a, const FallState& b) {
    if (a.contact != b.contact) return 100;
    const auto square = [](double x) { return x * x; };
    return std::sqrt(square(a.time - b.time) + square(a.pendulum.theta - b.pendulum.theta) +
                     square(0.1 * (a.pendulum.r - b.pendulum.r)) +
                     square(2 * (a.pendulum.theta_rate - b.pendulum.theta_rate)) +
                     square(4 * (a.pendulum.r_rate - b.pendulum.r_rate)));
  }
  double value(const FallState& x, bool first = false) {
    if (stopped(p, x.pendulum)) return 0;
    for (const Seen& s : seen) {
      if (!first && distance(s.x, x) < tolerance) return s.cost;
    }
    ++effort.states;
    Expansion out;
    expand(p, x, out);
    Seen now{x, out.stops ? 0 : kInfinity, {}};
    for (const PlannedContact& c : out.contacts) {
      ++effort.actions;
      const double cost = std::max(c.impact.impulse, value(c.next()));
      if (cost < now.cost) now = {x, cost, c.action};
    }
    seen.push_back(now);
    return now.cost;
  }
  double costOfPlan(const FallState& start) {
    value(start, true);
    std::vector<FallAction> actions;
    std::optional<FallAction> action;
    if (!seen.empty()) action = seen.back().action;
    for (FallState x = start; action;) {
      actions.push_back(*action);
      const auto contact = tryAction(p, x, *action);
      if (!contact) break;
      x = contact->next();
      if (stopped(p, x.pendulum)) break;
      const auto nearest = std::min_element(
          seen.begin(), seen.end(),
          [&](const Seen& a, const Seen& b) { return distance(a.x, x) < distance(b.x, x); });
      action = nearest->x.contact == x.contact ? nearest->action : std::nullopt;
    }
    return replay(p, start, actions).cost;
  }
};

TEST(Planner, SearchesAreTheRecursionsTheyAreDocumentedAs) {
  int planned = 0;
  int hopeless = 0;
  std::set<std::uint64_t> efforts;
  for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
    FallProblem p = threeParts();
    p.stall = stall;
    for (int i = 0; i < 14; ++i) {
      FallState start = startOfThreeParts(i);
      if (i == 0) start = {0, 0, {.theta = 1.3, .r = 0.25, .theta_rate = 3}};  // too late
      PlanEffort all, plain, some, pruned;
      const double best = value(p, start, all);
      EXPECT_EQ(planUnpruned(p, start, &plain).cost, best);
      EXPECT_EQ(plain.states, all.states);
      EXPECT_EQ(plain.actions, all.actions);
      const FallPlan plan = planExactly(p, start, &pruned);
      EXPECT_EQ(plan.cost, best);
      EXPECT_EQ(bounded(p, start, kInfinity, some), best);
      EXPECT_EQ(pruned.states, some.states);
      EXPECT_EQ(pruned.actions, some.actions);
      planned += !plan.contacts.empty();
      hopeless += std::isinf(best);
      EXPECT_EQ(planCached(p, start, 0).cost, best);
      for (const double tolerance : {0.1, 0.4, 2.0}) {
        CachedByHand hand{p, tolerance};
        const double cost = hand.costOfPlan(start);
        PlanEffort cached;
        EXPECT_EQ(planCached(p, start, tolerance, &cached).cost, cost) << i << " " << tolerance;
        EXPECT_EQ(cached.states, hand.effort.states);
        EXPECT_EQ(cached.actions, hand.effort.actions);
        efforts.insert(cached.states);
      }
      // A plan leads from contact to contact.
      FallState x = start;
      for (const PlannedContact& c : plan.contacts) {
        EXPECT_EQ(c.from.contact, x.contact);
        EXPECT_EQ(c.from.time, x.time);
        x = c.next();
      }
    }
  }
  EXPECT_GT(planned, 10);
  EXPECT_GT(hopeless, 0);
  EXPECT_GT(efforts.size(), 10U);
}

TEST(Planner, AReplayCostsWhatComesOfItsActions) {
  const FallProblem p = threeParts();
  FallPlan plan;
  FallState start;
  for (int i = 0; plan.contacts.size() < 2; ++i) {
    ASSERT_LT(i, 100);
    start = startOfThreeParts(i);
    plan = planExactly(p, start);
  }
  std::vector<FallAction> actions;
  for (const PlannedContact& c : plan.contacts) actions.push_back(c.action);
  FallPlan again = replay(p, start, actions);
  EXPECT_EQ(again.cost, plan.cost);
  EXPECT_EQ(again.contacts.size(), plan.contacts.size());
  actions.push_back(actions.back());  // it has stopped before
  again = replay(p, start, actions);
  EXPECT_EQ(again.cost, plan.cost);
  EXPECT_EQ(again.contacts.size(), plan.contacts.size());
  again = replay(p, start, {actions[0]});  // too few
  EXPECT_EQ(again.cost, kInfinity);
  EXPECT_EQ(again.contacts.size(), 1U);
  FallAction wrong = actions[1];
  wrong.contact = 0;
  again = replay(p, start, {actions[0], wrong, actions[1]});
  EXPECT_EQ(again.cost, kInfinity);
  EXPECT_EQ(again.contacts.size(), 1U);
  // One that stops by itself needs none.
  const FallState rising{0, 0, {.theta = -0.3, .r = 0.25, .theta_rate = 1}};
  EXPECT_EQ(replay(p, rising, {}).cost, 0);
}

TEST(Planner, AHeldPoseIsLookedAtUntilTheHorizon) {
  FallProblem p = threeParts();
  const FallState start{0, 0.2, {.theta = 0.2, .r = 0.25, .theta_rate = 1}};
  const std::vector<HeldPart> parts = {{"hand", 0.2, 2}};
  p.horizon = 3;
  const auto impacts = heldFall(p, parts, start);
  ASSERT_EQ(impacts.size(), 1U);
  const double after = impacts[0].time - start.time;
  p.horizon = after;
  EXPECT_EQ(heldFall(p, parts, start).size(), 1U);
  p.horizon = after - p.model.step;
  EXPECT_TRUE(heldFall(p, parts, start).empty());
}

TEST(ValueTable, HoldsTheRecursionOverItself) {
  const FallProblem p = threeParts();
  const ValueGrid grid{.times = 3, .angles = 5, .lengths = 2, .rates = 4};
  const ValueTable table(p, grid);
  size_t i = 0;
  std::set<float> values;
  Expansion out;
  for (int node = 0; node < 3; ++node) {
    const ValueTable::Node& n = table.nodes()[node];
    EXPECT_EQ(n.first, i);
    EXPECT_EQ(n.time.max, 1.5);
    EXPECT_EQ(n.theta.min, -1.2);
    for (int t = 0; t < 3; ++t) {
      for (int a = 0; a < 5; ++a) {
        for (int l = 0; l < 2; ++l) {
          for (int w = 0; w < 4; ++w, ++i) {
            const FallState x{node,
                              n.time.at(t),
                              {.theta = n.theta.at(a), .r = n.r.at(l), .theta_rate = n.rate.at(w)}};
            // At worst it falls flat from the longest rod.
            double best = p.model.mass * std::sqrt(2 * p.model.gravity * p.lengths[node].second);
            expand(p, x, out);
            for (const PlannedContact& c : out.contacts) {
              const FallState next = c.next();
              const double rest = stopped(p, next.pendulum) ? 0 : table.at(next);
              best = std::min(best, std::max(c.impact.impulse, rest));
            }
            if (stopped(p, x.pendulum) || out.stops) best = 0;
            ASSERT_FLOAT_EQ(table.values()[i], static_cast<float>(best)) << i;
            values.insert(table.values()[i]);
          }
        }
      }
    }
  }
  EXPECT_EQ(table.values().size(), i);
  EXPECT_GT(values.size(), 30U);
}

/// planQuickly's search.
double quickByHand(const FallProblem& p, const ValueTable& table, const FallState& x, double best,
                   const std::vector<int>& most) {
  if (stopped(p, x.pendulum)) return 0;
  Expansion out;
  expand(p, x, out);
  if (out.stops) return 0;
  std::vector<std::pair<double, const PlannedContact*>> ranked;
  for (const PlannedContact& c : out.contacts) {
    if (c.impact.impulse >= best) continue;
    const FallState next = c.next();
    const double rest = stopped(p, next.pendulum) ? 0 : table.at(next);
    ranked.emplace_back(std::max(c.impact.impulse, rest), &c);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  ranked.resize(std::min(ranked.size(), static_cast<size_t>(most.front())));
  const std::vector<int> deeper(most.size() > 1 ? most.begin() + 1 : most.begin(), most.end());
  for (const auto& [promised, c] : ranked) {
    const double rest = quickByHand(p, table, c->next(), best, deeper);
    best = std::min(best, std::max(c->impact.impulse, rest));
  }
  return best;
}

TEST(ValueTable, IsLookedUpForAsManyActionsAsTheSearchSays) {
  const FallProblem p = threeParts();
  const ValueTable table(p, {.times = 3, .angles = 5, .lengths = 2, .rates = 4});
  std::set<double> costs;
  for (int i = 0; i < 12; ++i) {
    const FallState start = startOfThreeParts(i);
    for (const std::vector<int>& most :
         {std::vector{1, 1, 1}, {3, 2, 1}, {1, 3, 2}, {2, 1, 1}, {2, 5, 1}, {999, 999, 999}}) {
      const FallPlan plan = planQuickly(p, table, start, {most[0], most[1], most[2]});
      EXPECT_EQ(plan.cost, quickByHand(p, table, start, kInfinity, most)) << i << " " << most[0];
      costs.insert(plan.cost);
    }
    EXPECT_EQ(planQuickly(p, table, start, {999, 999, 999}).cost, planExactly(p, start).cost);
  }
  EXPECT_GT(costs.size(), 8U);
}

TEST(PlanLibrary, AFingerprintIsOfAllThatDecidesATable) {
  const ValueGrid grid{.times = 3, .angles = 5, .lengths = 2, .rates = 4};
  const std::function<void(FallProblem&, ValueGrid&)> changes[] = {
      [](FallProblem&, ValueGrid&) {},
      [](FallProblem& p, ValueGrid&) { p.model.mass += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.model.inertia += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.model.gravity += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.model.step += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.model.post_impact = PostImpact::kBodyRate; },
      [](FallProblem& p, ValueGrid&) { p.model.reversed_coriolis = true; },
      [](FallProblem& p, ValueGrid&) { p.rod_speed += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.stopper_speed += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.least_interval += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.grid.rod_rates += 2; },
      [](FallProblem& p, ValueGrid&) { p.grid.time += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.grid.angle += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.stall = Stall::kLiteral; },
      [](FallProblem& p, ValueGrid&) { p.horizon += 0.1; },
      [](FallProblem&, ValueGrid& g) { ++g.times; },
      [](FallProblem&, ValueGrid& g) { ++g.angles; },
      [](FallProblem&, ValueGrid& g) { ++g.lengths; },
      [](FallProblem&, ValueGrid& g) { ++g.rates; },
      [](FallProblem& p, ValueGrid&) { p.graph.nodes[0].name = "toes"; },
      [](FallProblem& p, ValueGrid&) { p.graph.nodes[2].name = "head"; },
      [](FallProblem& p, ValueGrid&) { p.lengths[0].first += 0.01; },
      [](FallProblem& p, ValueGrid&) { p.lengths[2].first += 0.01; },
      [](FallProblem& p, ValueGrid&) { p.lengths[2].second += 0.01; },
      [](FallProblem& p, ValueGrid&) {
        p.graph.edges[0] = {2, 1};
      },
      [](FallProblem& p, ValueGrid&) { p.graph.edges[1].clear(); },
      [](FallProblem& p, ValueGrid&) { p.first_angle[0][1] += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.first_angle[1][0] += 0.1; },
      [](FallProblem& p, ValueGrid&) { p.reach[0][1] = ReachTable(0.02, 0.5); },
      [](FallProblem& p, ValueGrid&) { p.reach[1][0] = ReachTable(0.02, 0.5); },
      [](FallProblem& p, ValueGrid&) { p.reach[1][0] = ReachTable(0.021, 0.5); },
  };
  std::set<std::uint64_t> prints;
  for (const auto& change : changes) {
    FallProblem p = threeParts();
    ValueGrid g = grid;
    change(p, g);
    prints.insert(fingerprintOf(p, g));
    EXPECT_EQ(fingerprintOf(p, g), fingerprintOf(FallProblem(p), g));
  }
  EXPECT_EQ(prints.size(), std::size(changes));
}

/// A library's bytes, aligned as the reader wants them.
struct Aligned {
  explicit Aligned(const std::string& bytes) : words(bytes.size() / 4 + 1) {
    std::memcpy(words.data(), bytes.data(), bytes.size());
    EXPECT_EQ(fall_open(words.data(), bytes.size(), &l), nullptr);
  }
  const void* at(size_t byte) const { return reinterpret_cast<const char*>(words.data()) + byte; }
  std::vector<std::uint32_t> words;
  const fall_library* l = nullptr;
};

TEST(PlanLibrary, HoldsAllOfAProblem) {
  FallProblem p = threeParts();
  p.graph.nodes[1].name = std::string(40, 'k');
  const ValueGrid grid{.times = 3, .angles = 5, .lengths = 2, .rates = 4};
  std::vector<float> values(3 * 3 * 5 * 2 * 4);
  for (size_t i = 0; i < values.size(); ++i) values[i] = 0.5F + static_cast<float>(i);
  const ValueTable table(p, grid, values.data());
  const std::string long_name(40, 'x');
  const std::string bytes = compileLibrary(p, table, {"robot", long_name, "somewhere else"});
  const Aligned library(bytes);
  const fall_library& l = *library.l;
  EXPECT_EQ(l.size, bytes.size());
  EXPECT_STREQ(l.robot, "robot");
  EXPECT_EQ(l.stance, long_name.substr(0, 31));
  EXPECT_STREQ(l.direction, "somewhere e");
  const std::uint64_t print = fingerprintOf(p, grid);
  EXPECT_EQ(l.problem[0], print & 0xffffffff);
  EXPECT_EQ(l.problem[1], print >> 32);
  EXPECT_EQ((std::vector<float>{l.mass, l.inertia, l.gravity, l.step, l.rod_speed, l.stopper_speed,
                                l.least_interval, l.grid_time, l.grid_angle, l.horizon}),
            (std::vector<float>{2, 0.03F, 9.7F, 0.01F, 0.15F, 4, 0.1F, 0.05F, 0.3F, 0.6F}));
  EXPECT_EQ(l.rod_rates, 3U);
  EXPECT_EQ(l.stall_stops, 1U);
  ASSERT_EQ(l.nodes, 3U);
  size_t size = sizeof l + 3 * sizeof(fall_library_node) + 3 * sizeof(fall_library_edge) +
                sizeof(float) * values.size();
  size_t value = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const fall_library_node& n = *fall_node(&l, i);
    EXPECT_EQ(n.name, p.graph.nodes[i].name.substr(0, sizeof n.name - 1));
    const ValueTable::Node& from = table.nodes()[i];
    for (const auto& [is, should] : {std::pair(&n.time, &from.time),
                                     {&n.theta, &from.theta},
                                     {&n.r, &from.r},
                                     {&n.rate, &from.rate}}) {
      EXPECT_EQ(is->min, static_cast<float>(should->min));
      EXPECT_EQ(is->max, static_cast<float>(should->max));
      EXPECT_EQ(is->n, static_cast<std::uint32_t>(should->n));
    }
    for (size_t k = 0; k < values.size() / 3; ++k, ++value) {
      EXPECT_EQ(static_cast<const float*>(library.at(n.values))[k], values[value]);
    }
    ASSERT_EQ(n.edges, p.graph.edges[i].size());
    for (std::uint32_t e = 0; e < n.edges; ++e) {
      const auto& edge = static_cast<const fall_library_edge*>(library.at(n.first_edge))[e];
      EXPECT_EQ(static_cast<int>(edge.to), p.graph.edges[i][e]);
      EXPECT_EQ(edge.first_angle, static_cast<float>(p.first_angle[i][e]));
      EXPECT_EQ(edge.cell, 0.02F);
      const ReachTable& reach = p.reach[i][e];
      ASSERT_EQ(static_cast<int>(edge.cells), reach.cells());
      ASSERT_EQ(static_cast<int>(edge.angles), ReachTable::kAngles);
      const auto* bits = static_cast<const unsigned char*>(library.at(edge.reach));
      size_t wrong = 0;
      for (size_t b = 0; b < reach.marked().size(); ++b) {
        wrong += (bits[b / 8] >> (b % 8) & 1) != reach.marked()[b];
      }
      EXPECT_EQ(wrong, 0U);
      size += (reach.marked().size() + 31) / 32 * 4;
    }
  }
  EXPECT_EQ(bytes.size(), size);  // and no more
  EXPECT_EQ(tableFromLibrary(bytes, p, "file").values(), values);
  p.stall = Stall::kLiteral;
  EXPECT_EQ(Aligned(compileLibrary(p, table, {})).l->stall_stops, 0U);
  for (const auto& change : {+[](FallProblem& q) { q.model.post_impact = PostImpact::kBodyRate; },
                             +[](FallProblem& q) { q.model.reversed_coriolis = true; }}) {
    FallProblem other = p;
    change(other);
    EXPECT_THROW(compileLibrary(other, table, {}), InputError);
  }
}

TEST(PlanLibrary, AFingerprintIsNoProof) {
  const FallProblem three = threeParts();
  FallProblem two = three;
  two.graph = {{{"feet", {}}, {"hands", {}}}, {{1}, {}}};
  const ValueGrid grid{.times = 2, .angles = 2, .lengths = 2, .rates = 2};
  const std::vector<float> values(48, 1);
  // What is said of the second library, with the first's fingerprint and what else is changed.
  const auto said = [&](const FallProblem& as, const std::function<void(fall_library&)>& change) {
    std::string bytes = compileLibrary(two, ValueTable(two, grid, values.data()), {});
    Aligned library(bytes);
    fall_library& l = *const_cast<fall_library*>(library.l);
    const std::uint64_t print = fingerprintOf(as, grid);
    l.problem[0] = static_cast<std::uint32_t>(print);
    l.problem[1] = static_cast<std::uint32_t>(print >> 32);
    change(l);
    constexpr size_t summed = offsetof(fall_library, problem);
    l.checksum = fall_checksum(library.at(summed), bytes.size() - summed);
    std::memcpy(bytes.data(), library.words.data(), bytes.size());
    EXPECT_NO_THROW(Aligned{bytes});
    try {
      tableFromLibrary(bytes, as, "file");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(said(two, [](fall_library&) {}), "read");
  EXPECT_EQ(said(three, [](fall_library&) {}),
            "file: a library of fall plans that contradicts itself");
  EXPECT_EQ(said(two,
                 [](fall_library& l) {  // all nodes' values are read from the first's on
                   auto* first = const_cast<fall_library_node*>(fall_node(&l, 0));
                   first->values = l.size - 4 * 16;
                 }),
            "file: a library of fall plans that contradicts itself");
}

TEST(PlanLibrary, ATableIsTakenFromDiskWhereItCanBe) {
  FallProblem p = threeParts();
  p.grid = {.rod_rates = 1, .time = 0.2, .angle = 0.8};
  p.horizon = 0.4;
  const ValueTable made(p);
  const TestFolder folder;
  const std::string name = fmt::format("{:016x}.fallplan", fingerprintOf(p));
  EXPECT_EQ(cachedTable(p, {}, "").values(), made.values());
  EXPECT_FALSE(std::filesystem::exists(name));  // nowhere, not here
  EXPECT_EQ(cachedTable(p, {"r", "s", "d"}, folder / "new").values(), made.values());
  const auto file = std::filesystem::directory_iterator(folder / "new")->path();
  EXPECT_EQ(file.filename(), name);
  EXPECT_STREQ(Aligned(readFile(file)).l->robot, "r");
  // What lies there is what is given.
  std::vector<float> other(made.values().size(), 7);
  std::ofstream(file, std::ios::binary) << compileLibrary(p, ValueTable(p, {}, other.data()), {});
  EXPECT_EQ(cachedTable(p, {}, folder / "new").values(), other);
  // A file where the folder should be.
  EXPECT_EQ(cachedTable(p, {}, file).values(), made.values());
  // A model that no library holds.
  p.model.post_impact = PostImpact::kSticking;
  cachedTable(p, {}, folder / "none");
  EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

}  // namespace
}  // namespace traceur::fall
