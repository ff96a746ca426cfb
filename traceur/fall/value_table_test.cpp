// Planning with the published robots, exactly and with a table.
#include "traceur/fall/fall_testing.h"

namespace traceur::fall {
namespace {

TEST(Planner, BranchAndBoundIsExact) {
  const auto falls = fallsOf("atlas");
  for (const char* direction : {"forward", "backward"}) {
    FallProblem p = coarse(*falls, "two_feet", direction);
    for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
      p.stall = stall;
      int found = 0;
      for (int i = 0; i < 25; ++i) {
        const FallState start = randomStart(1.1, i);
        PlanEffort pruned, all;
        const FallPlan exact = planExactly(p, start, &pruned);
        const FallPlan plain = planUnpruned(p, start, &all);
        EXPECT_EQ(exact.cost, plain.cost);
        EXPECT_LE(pruned.actions, all.actions);
        if (std::isinf(exact.cost)) continue;
        ++found;
        std::vector<FallAction> actions;
        for (const PlannedContact& c : exact.contacts) actions.push_back(c.action);
        EXPECT_EQ(replay(p, start, actions).cost, exact.cost);
      }
      EXPECT_GT(found, 0);
    }
  }
}

TEST(Planner, ARodDoesNotStopAFallByGrowingBeyondTheRobot) {
  FallProblem p;
  p.model = {.mass = 100, .inertia = 10};
  p.graph.nodes = {{"feet", {}}};
  p.graph.edges = {{}};
  p.rod_speed = 0.6;
  // A tenth faster than what stands up again by itself.
  const double r = 1.1, theta = -0.3;
  const double passive = std::sqrt(2 * p.model.gravity * (1 - std::cos(theta)) / r);
  const FallState start{0, 0, {.theta = theta, .r = r, .theta_rate = 1.1 * passive}};
  Expansion out;
  expand(p, start, out);
  EXPECT_TRUE(out.stops);  // at twice the length
  p.lengths = {{0.6, 1.2}};
  expand(p, start, out);
  EXPECT_FALSE(out.stops);
}

TEST(Planner, AnActionTriedKeepsTheRodWithinTheRobot) {
  const auto falls = fallsOf("atlas");
  FallProblem p = coarse(*falls, "two_feet", "forward");
  const FallState start = randomStart(1.1, 0);
  Expansion out;
  expand(p, start, out);
  ASSERT_FALSE(out.contacts.empty());
  const FallAction action = out.contacts.front().action;
  EXPECT_TRUE(tryAction(p, start, action));
  p.lengths.assign(p.graph.nodes.size(), {0.1, 1});  // the rod is 1.1 m
  EXPECT_FALSE(tryAction(p, start, action));
}

TEST(Planner, AFallStopsWhereTheRodCannotPassItsPivot) {
  FallProblem p;
  PendulumModel fine = p.model;
  fine.step = 1e-5;
  for (const double theta : {-0.4, -0.05}) {
    for (const double r : {0.2, 1.1}) {
      const double passing = std::sqrt(2 * p.model.gravity * (1 - std::cos(theta)) / r);
      for (const double share : {0.99, 1.01}) {
        PendulumState s{.theta = theta, .r = r, .theta_rate = share * passing};
        p.stall = Stall::kStops;
        EXPECT_EQ(stopped(p, s), share < 1) << theta << " " << r;
        p.stall = Stall::kLiteral;
        EXPECT_FALSE(stopped(p, s));
        while (s.theta_rate > 0 && s.theta < 0) step(fine, 0, s);
        EXPECT_EQ(s.theta_rate <= 0, share < 1) << theta << " " << r;
      }
    }
  }
  for (const Stall stall : {Stall::kStops, Stall::kLiteral}) {
    p.stall = stall;
    EXPECT_FALSE(stopped(p, {.theta = 0.1, .r = 1, .theta_rate = 1e-3}));
    EXPECT_TRUE(stopped(p, {.theta = 0.1, .r = 1, .theta_rate = 0}));
    EXPECT_TRUE(stopped(p, {.theta = -0.1, .r = 1, .theta_rate = -1}));
  }
}

TEST(Planner, ExpandsAllThatAnActionMayDoAndNothingElse) {
  const auto falls = fallsOf("atlas");
  FallProblem p = coarse(*falls, "two_feet", "forward");
  p.grid.rod_rates = 3;
  p.least_interval = 0.1;
  const int angles = static_cast<int>(std::lround(2 * std::numbers::pi / p.grid.angle));
  size_t seen = 0;
  Expansion out;  // used again and again, as a search does
  for (int i = 0; i < 4; ++i) {
    FallState start = randomStart(1.1, i);
    start.pendulum.theta = std::abs(start.pendulum.theta);  // nothing stops it
    start.time = i % 2 == 0 ? 0 : 0.3;
    expand(p, start, out);
    ASSERT_FALSE(out.stops);
    seen += out.contacts.size();
    size_t allowed = 0;
    const std::vector<int>& next = p.graph.edges[0];
    for (const double rate : {-p.rod_speed, 0.0, p.rod_speed}) {
      for (int k = 1; k * p.grid.time < 1.5; ++k) {
        for (int a = 1; a <= angles; ++a) {
          for (const int to : next) {
            allowed += tryAction(p, start,
                                 {to, -std::numbers::pi + a * p.grid.angle, k * p.grid.time, rate})
                           .has_value();
          }
        }
      }
    }
    EXPECT_EQ(out.contacts.size(), allowed);
    for (const PlannedContact& c : out.contacts) {
      const auto tried = tryAction(p, start, c.action);
      ASSERT_TRUE(tried);
      EXPECT_EQ(tried->impact.impulse, c.impact.impulse);
      EXPECT_EQ(c.next().time, start.time + c.action.duration);
      EXPECT_EQ(c.next().contact, c.action.contact);
      EXPECT_GE(c.action.duration, p.least_interval);
      const auto edge = std::find(next.begin(), next.end(), c.action.contact) - next.begin();
      ASSERT_LT(edge, static_cast<std::ptrdiff_t>(next.size()));
      const double turn =
          std::remainder(c.action.theta2 - p.first_angle[0][edge], 2 * std::numbers::pi);
      EXPECT_LE(std::abs(turn), c.next().time * p.stopper_speed + 1e-9);
      EXPECT_TRUE(p.reach[0][edge].reachable(c.before.r, c.impact.length, c.action.theta2));
      // The stopper's tip is on the ground.
      EXPECT_NEAR(c.before.com().y() + c.impact.length * std::cos(c.before.theta + c.action.theta2),
                  0, 1e-9);
    }
  }
  EXPECT_GT(seen, 0U);
}

TEST(Planner, AHeldPoseHitsTheGroundPartByPart) {
  FallProblem p;
  p.model = {.mass = 100, .inertia = 20};
  const FallState start{0, 0.5, {.theta = 0.1, .r = 1, .theta_rate = 0.5}};
  const std::vector<HeldPart> parts = {{"hand", 0.8, 2.2}, {"knee", 0.75, 2.6}, {"head", 0.5, 0}};
  const std::vector<HeldImpact> impacts = heldFall(p, parts, start);
  ASSERT_EQ(impacts.size(), 2U);
  // Where the tips are, seen from the COM: the body turns with the rod between impacts, and not in
  // one, whatever the new rod's direction is.
  std::vector<double> world;
  world.reserve(parts.size());
  for (const HeldPart& part : parts) world.push_back(start.pendulum.theta + part.theta2);
  PendulumState s = start.pendulum;
  double time = start.time;
  std::vector<bool> down(parts.size());
  for (const HeldImpact& found : impacts) {
    size_t hit = parts.size();
    while (hit == parts.size()) {
      ASSERT_LT(s.theta, std::numbers::pi / 2);
      const double before = s.theta;
      step(p.model, 0, s);
      time += p.model.step;
      for (size_t i = parts.size(); i-- > 0;) {
        world[i] += s.theta - before;
        const bool below = s.com().y() + parts[i].r2 * std::cos(world[i]) <= 0;
        if (below && !down[i]) hit = i;
      }
    }
    down[hit] = true;
    EXPECT_EQ(found.part, parts[hit].name);
    EXPECT_NEAR(found.time, time, 1e-9);
    const auto expected = impact(p.model, s, world[hit] - s.theta);
    ASSERT_TRUE(expected);
    EXPECT_NEAR(found.impulse, expected->impulse, 1e-9 * expected->impulse);
    s = expected->after;
  }
}

TEST(Planner, ACachePlansNearlyAsWellAsTheOptimum) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  for (int i = 0; i < 10; ++i) {
    const FallState start = randomStart(1.1, i);
    PlanEffort cached, all;
    const double optimum = planUnpruned(p, start, &all).cost;
    const double cost = planCached(p, start, 0.1, &cached).cost;
    EXPECT_GE(cost, optimum);
    EXPECT_LE(cost, 1.5 * optimum);  // nearer states than 0.1 are not worth more
    EXPECT_LE(cached.states, all.states);
  }
}

TEST(Planner, EveryContactOfAPlanIsAllowed) {
  const auto falls = fallsOf("bioloid-gp");
  const SagittalBody body(modelOf(*falls), falls->setup("one_foot", "forward"));
  FallProblem p = fallProblem(body, *falls, {.poses = 2000});
  p.least_interval = 0.04;
  sim::World world(body.model());
  world.place(body.model()->stateOf(falls->robot->poses.at(body.setup().stance)));
  const std::vector<HeldPart> parts = heldParts(body, world.snapshot(), 0);
  ASSERT_FALSE(parts.empty());
  for (int i = 0; i < 10; ++i) {
    const FallState start = randomStart(0.17, i);
    const FallPlan plan = planExactly(p, start);
    double cost = 0;
    int on = 0;
    for (const PlannedContact& c : plan.contacts) {
      EXPECT_EQ(c.from.contact, on);
      on = c.action.contact;
      cost = std::max(cost, c.impact.impulse);
      EXPECT_LE(std::abs(c.action.rod_rate), p.rod_speed);
      EXPECT_GE(c.action.duration, p.least_interval);
    }
    if (!std::isinf(plan.cost)) {
      EXPECT_EQ(cost, plan.cost);
    }
    double held = 0;
    for (const HeldImpact& h : heldFall(p, parts, start)) held = std::max(held, h.impulse);
    if (start.pendulum.theta > 0) {
      EXPECT_LT(plan.cost, held);
    }
  }
}

TEST(Planner, AFallThatHasTurnedBackNeedsNoContact) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  const FallState back{0, 0, {.theta = 0.1, .r = 1.1, .theta_rate = -0.2}};
  EXPECT_EQ(planExactly(p, back).cost, 0);
  EXPECT_TRUE(planExactly(p, back).contacts.empty());
  EXPECT_TRUE(heldFall(p, {{"head", 0.7, 0}}, back).empty());
}

TEST(ValueTable, PlansNearlyAsTheExactPlannerAndNeverClaimsMore) {
  const auto falls = fallsOf("atlas");
  const FallProblem p = coarse(*falls, "two_feet", "forward");
  const ValueTable table(p, {.times = 4, .angles = 9, .lengths = 4, .rates = 8});
  EXPECT_LT(table.bytes(), 5'000'000U);
  double exact = 0;
  double quick = 0;
  for (int i = 0; i < 25; ++i) {
    const FallState start = randomStart(1.1, i);
    const FallPlan best = planExactly(p, start);
    const FallPlan near = planQuickly(p, table, start);
    EXPECT_GE(near.cost, best.cost);
    if (std::isinf(best.cost)) continue;
    ASSERT_FALSE(std::isinf(near.cost)) << "a dead end";
    std::vector<FallAction> actions;
    for (const PlannedContact& c : near.contacts) actions.push_back(c.action);
    EXPECT_EQ(replay(p, start, actions).cost, near.cost);
    exact += best.cost;
    quick += near.cost;
  }
  EXPECT_GT(exact, 0);
  EXPECT_LT(quick, 1.05 * exact);
}

TEST(ValueTable, IsMultilinearInsideAndConstantBeyond) {
  FallProblem p;
  p.graph.nodes = {{"feet", {}}, {"hands", {}}};
  p.graph.edges = {{1}, {}};
  p.lengths = {{0.3, 0.5}, {0.2, 0.9}};
  const ValueGrid grid{.times = 3, .angles = 4, .lengths = 2, .rates = 5};
  const auto value = [](int node, double t, double theta, double r, double rate) {
    return (1 + node) * (2 + t) * (3 - theta) * (1 + r) * (5 + rate);
  };
  const ValueTable empty(p, grid, std::vector<float>(2 * 3 * 4 * 2 * 5).data());
  std::vector<float> values;
  for (int node = 0; node < 2; ++node) {
    const ValueTable::Node& n = empty.nodes()[node];
    EXPECT_EQ(n.first, static_cast<size_t>(node) * 3 * 4 * 2 * 5);
    EXPECT_EQ(std::pair(n.r.min, n.r.max), p.lengths[node]);
    EXPECT_EQ(n.time.min, 0);
    EXPECT_EQ(n.rate.min, 0);
    // Twice the rate of a fall to the ground.
    EXPECT_NEAR(n.rate.max, 2 * std::sqrt(2 * 9.81 / p.lengths[node].second), 1e-12);
    EXPECT_LT(n.theta.min, -1);
    EXPECT_EQ(n.theta.max, std::numbers::pi / 2);
    for (int t = 0; t < 3; ++t) {
      for (int a = 0; a < 4; ++a) {
        for (int l = 0; l < 2; ++l) {
          for (int w = 0; w < 5; ++w) {
            values.push_back(static_cast<float>(
                value(node, n.time.at(t), n.theta.at(a), n.r.at(l), n.rate.at(w))));
          }
        }
      }
    }
  }
  const ValueTable table(p, grid, values.data());
  EXPECT_EQ(table.values(), values);
  EXPECT_EQ(table.bytes(), 4 * values.size());
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const int node = i % 2;
    const ValueTable::Node& n = table.nodes()[node];
    double at[4];
    double held[4];
    const ValueTable::Axis* const axes[] = {&n.time, &n.theta, &n.r, &n.rate};
    for (int k = 0; k < 4; ++k) {
      const double span = axes[k]->max - axes[k]->min;
      at[k] = random.uniform(axes[k]->min - span / 4, axes[k]->max + span / 4);
      if (i < 4) at[k] = i < 2 ? axes[k]->min : axes[k]->max;
      held[k] = std::clamp(at[k], axes[k]->min, axes[k]->max);
    }
    const double expected = value(node, held[0], held[1], held[2], held[3]);
    EXPECT_NEAR(table.at({node, at[0], {.theta = at[1], .r = at[2], .theta_rate = at[3]}}),
                expected, 1e-5 * expected);
  }
}

}  // namespace
}  // namespace traceur::fall
