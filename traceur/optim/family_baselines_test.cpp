#include "traceur/optim/family_baselines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/segment_problem.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

SegmentProblem bow(int n = 2, double low = -2, double high = 2, int M = 5) {
  return {VectorXd::Constant(n, low), VectorXd::Constant(n, high), VectorXd::LinSpaced(M, 0, 1),
          [n](double w) {
            VectorXd c = VectorXd::Constant(n, 0.2);
            c[0] = w;
            c[1] = 2 * w * (1 - w);
            return c;
          }};
}

CmaEsOptions cmaFor(const Problem& problem) {
  CmaEsOptions o;
  o.x0 = VectorXd::Zero(problem.dimension());
  o.lower = problem.lower();
  o.upper = problem.upper();
  o.sigma = 0.5;
  o.lambda = 8;
  return o;
}

IndividualCmaOptions individualFor(const Problem& problem) {
  IndividualCmaOptions o;
  o.tasks = problem.tasks();
  o.cma = cmaFor(problem);
  return o;
}

/// Each baseline in each of its ways.
std::vector<std::function<std::unique_ptr<Optimizer>(const Problem&, std::uint64_t seed)>>
everyWay() {
  const auto individual = [](int turn) {
    return [=](const Problem& problem, std::uint64_t seed) -> std::unique_ptr<Optimizer> {
      IndividualCmaOptions o = individualFor(problem);
      o.cma.seed = seed;
      o.turn = turn;
      return std::make_unique<IndividualCma>(o);
    };
  };
  return {[](const Problem& problem, std::uint64_t seed) -> std::unique_ptr<Optimizer> {
            CmaEsOptions o = cmaFor(problem);
            o.seed = seed;
            return std::make_unique<PhiCma>(problem.tasks(), 4, o);
          },
          individual(0), individual(3)};
}

/// Every point of the answer has been run: re-running it says the same.
void expectMeasured(const Problem& problem, const Family& family) {
  const VectorXd tasks = problem.tasks();
  double sum = 0;
  for (int i = 0; i < tasks.size(); ++i) {
    const double w = (tasks[i] - tasks[0]) / (tasks[tasks.size() - 1] - tasks[0]);
    EXPECT_EQ(problem.evaluate(family.curve.at(w)).task_costs[i], family.task_costs[i]);
    sum += family.task_costs[i];
  }
  EXPECT_NEAR(family.cost, sum / static_cast<double>(tasks.size()), 1e-15);
}

TEST(FamilyBaselines, FindABow) {
  const SegmentProblem problem = bow();
  for (size_t way = 0; way < everyWay().size(); ++way) {
    const auto optimizer = everyWay()[way](problem, 1);
    const Summary summary = minimise(problem, *optimizer, {.budget = 30000, .target = 1e-4});
    EXPECT_EQ(summary.end, End::kTarget) << way;
    ASSERT_TRUE(optimizer->family());
    expectMeasured(problem, *optimizer->family());
  }
}

TEST(FamilyBaselines, OrderAndInterruptionsDoNotMatter) {
  const SegmentProblem problem = bow();
  for (const auto& make : everyWay()) {
    const auto one = make(problem, 1);
    auto other = make(problem, 1);
    for (int g = 0; g < 25; ++g) {
      for (const Candidate& c : one->ask()) one->tell(c.id, problem.evaluate(c.x));
      const std::vector<Candidate> all = other->ask();
      for (size_t k = 0; k < all.size() / 2; ++k) {
        other->tell(all[k].id, problem.evaluate(all[k].x));
      }
      auto restored = make(problem, 1);
      restored->restore(other->save());
      ASSERT_EQ(restored->save(), other->save());
      other = std::move(restored);
      std::vector<Candidate> rest = other->ask();
      ASSERT_EQ(rest.size(), all.size() - all.size() / 2);
      std::reverse(rest.begin(), rest.end());
      for (const Candidate& c : rest) other->tell(c.id, problem.evaluate(c.x));
      ASSERT_EQ(one->save(), other->save()) << g;
    }
    EXPECT_THROW(make(problem, 2)->restore(one->save()), InputError);
    std::string damaged = one->save();
    damaged[50] ^= 1;
    EXPECT_THROW(other->restore(damaged), InputError);
    EXPECT_EQ(one->save(), other->save());
    EXPECT_THROW(other->tell(0, problem.evaluate(VectorXd::Zero(2))), InputError);
    EXPECT_THROW(other->tell(other->ask()[0].id, {.cost = 1}), InputError);
    EXPECT_EQ(one->save(), other->save());
  }
}

TEST(FamilyBaselines, StayInTheBox) {
  const SegmentProblem problem = bow(2, -0.1, 0.45);
  for (const auto& make : everyWay()) {
    const auto optimizer = make(problem, 1);
    minimise(problem, *optimizer, {.budget = 4000});  // throws outside
    ASSERT_TRUE(optimizer->family());
    expectMeasured(problem, *optimizer->family());
    EXPECT_NEAR(optimizer->family()->curve.at(1)[0], 0.45, 0.05);
  }
}

TEST(FamilyBaselines, SurviveFailuresAndReportTheirEnd) {
  const SegmentProblem problem = bow();
  for (const auto& make : everyWay()) {
    const auto dead = make(problem, 1);
    const auto half = make(problem, 1);
    for (int g = 0; g < 200 && !dead->stopped(); ++g) {
      for (const Candidate& c : dead->ask()) dead->tell(c.id, {.failed = true});
    }
    ASSERT_TRUE(dead->stopped());
    EXPECT_EQ(dead->stopped()->reason, "tolallfailed");
    EXPECT_FALSE(dead->family());
    for (int g = 0; g < 150 && !half->stopped(); ++g) {
      for (const Candidate& c : half->ask()) {
        Evaluation e = problem.evaluate(c.x);
        if (c.id % 7 == 0) e.failed = true;
        if (c.id % 5 == 0) e.task_costs[3] = c.id % 2 == 0 ? double{kNaN} : double{kInf};
        half->tell(c.id, e);
      }
    }
    ASSERT_TRUE(half->family());
    EXPECT_LT(half->family()->cost, 0.02);
  }
}

TEST(PhiCma, RunsEachCurveAtEachTask) {
  const SegmentProblem problem = bow();
  MatrixXd phi0(2, 2);
  phi0 << 0.1, 0.2, 0.3, 0.4;
  PhiCma phi(problem.tasks(), 2, cmaFor(problem), phi0);
  EXPECT_EQ(phi.cma().mean(), (VectorXd{{0.1, 0.3, 0.2, 0.4}}));
  const std::vector<Candidate> all = phi.ask();
  ASSERT_EQ(all.size(), 40u);
  EXPECT_TRUE((2 * all[2].x).isApprox(all[0].x + all[4].x));  // w = 0, ½, 1 of the first
  EXPECT_FALSE((2 * all[4].x).isApprox(all[2].x + all[6].x));
  double least = kInf;
  double sum = 0;
  for (int i = 0; i < 40; ++i) {
    EXPECT_FALSE(phi.family());
    const Evaluation e = problem.evaluate(all[i].x);
    sum += e.task_costs[i % 5];
    if (i % 5 == 4) least = std::min(least, sum / 5), sum = 0;
    phi.tell(all[i].id, e);
  }
  EXPECT_DOUBLE_EQ(phi.family()->cost, least);
}

TEST(IndividualCma, NeighboursBeginWhereTheTaskBeforeEnded) {
  const SegmentProblem problem = bow();
  IndividualCmaOptions o = individualFor(problem);
  o.turn = 30;
  o.cma.x0.setConstant(-0.5);
  o.cma.sigma = 1e-4;  // still far from where it goes after one turn
  IndividualCma cma(o);
  VectorXd best;
  double least = kInf;
  for (int g = 0; g < 30; ++g) {
    for (const Candidate& c : cma.ask()) {
      const Evaluation e = problem.evaluate(c.x);
      if (e.task_costs[0] < least) least = e.task_costs[0], best = c.x;
      cma.tell(c.id, e);
    }
  }
  ASSERT_EQ(cma.ask().size(), 8u);
  EXPECT_GT((best - o.cma.x0).norm(), 2e-2);
  for (const Candidate& c : cma.ask()) EXPECT_LT((c.x - best).norm(), 1e-3);
  EXPECT_FALSE(cma.family());  // four tasks have not been tried
}

TEST(IndividualCma, EndsWithTheLastTask) {
  const SegmentProblem problem = bow();
  for (const int turn : {0, 2}) {
    IndividualCmaOptions o = individualFor(problem);
    o.target = 1e-3;
    o.turn = turn;
    IndividualCma cma(o);
    const Summary summary = minimise(problem, cma, {.budget = 30000});
    EXPECT_EQ(summary.end, End::kOptimizer);
    EXPECT_EQ(summary.stop.reason, "target");
    EXPECT_TRUE(cma.ask().empty());
    ASSERT_TRUE(cma.family());
    const Family best = *cma.family();
    for (const double cost : best.task_costs) EXPECT_LE(cost, 1e-3);
    expectMeasured(problem, best);
    IndividualCma again(o);
    again.restore(cma.save());
    EXPECT_EQ(again.save(), cma.save());
  }
}

TEST(IndividualCma, JoinsUnevenTasksOnAGrid) {
  const auto problem = [](VectorXd tasks) {
    return SegmentProblem(VectorXd::Constant(1, -9), VectorXd::Constant(1, 9), std::move(tasks),
                          [](double t) { return VectorXd{{t * t}}; });
  };
  const SegmentProblem grid = problem(VectorXd{{0, 1, 1.5, 3}});
  IndividualCma cma(individualFor(grid));
  minimise(grid, cma, {.budget = 20000, .target = 1e-8});
  ASSERT_TRUE(cma.family());
  expectMeasured(grid, *cma.family());
  EXPECT_EQ(cma.family()->curve.points.cols(), 7);
  EXPECT_NEAR(cma.family()->curve.at(0.75)[0], (1.5 * 1.5 + 9) / 2, 1e-3);
  const SegmentProblem uneven = problem(VectorXd{{0, 1, std::sqrt(2), 3}});
  EXPECT_THROW(IndividualCma{individualFor(uneven)}, InputError);
  const SegmentProblem one = problem(VectorXd{{2}});
  IndividualCma single(individualFor(one));
  minimise(one, single, {.budget = 2000, .target = 1e-8});
  EXPECT_NEAR(single.family()->curve.at(0.3)[0], 4, 1e-3);
}

TEST(FamilyBaselines, RefuseWrongOptions) {
  const SegmentProblem problem = bow();
  for (const auto make : {makePhiCma, makeIndividualCma, makeNeighbourCma}) {
    EXPECT_EQ(make(problem, {})->ask().size(), make == makePhiCma          ? 80u
                                               : make == makeIndividualCma ? 80u
                                                                           : 16u);
    EXPECT_THROW(make(problem, {.sigma = 0}), InputError);
    EXPECT_THROW(make(problem, {.sigma = kNaN}), InputError);
    EXPECT_THROW(make(problem, {.lambda = 1}), InputError);
    EXPECT_THROW(make(problem, {.x0 = VectorXd::Zero(3)}), InputError);
    EXPECT_THROW(make(problem, {.x0 = VectorXd::Constant(2, 5)}), InputError);
    EXPECT_THROW(make(bow(2, 1, -1), {}), InputError);
    EXPECT_THROW(make(bow(2, -1, 1, 0), {}), InputError);
  }
  EXPECT_THROW(PhiCma(problem.tasks(), 0, cmaFor(problem)), InputError);
  EXPECT_THROW(PhiCma(problem.tasks(), 2, cmaFor(problem), MatrixXd::Zero(2, 3)), InputError);
  const auto refused = [&](auto change) {
    IndividualCmaOptions o = individualFor(problem);
    change(o);
    EXPECT_THROW(IndividualCma{o}, InputError);
  };
  refused([](auto& o) { o.turn = -1; });
  refused([](auto& o) { o.target = kNaN; });
  refused([](auto& o) { o.tasks.resize(0); });
}

TEST(PhiCma, IsCmaEsOverAllControlPoints) {
  const SegmentProblem problem = bow();
  CmaEsOptions one = cmaFor(problem);
  one.scale = VectorXd{{1, 0.5}};
  one.x0 = VectorXd{{0.3, -0.2}};
  one.seed = 5;
  for (const int K : {1, 3, 9}) {  // of nine, five are used
    PhiCma phi(problem.tasks(), K, one);
    const int used = std::min(K, 5);
    CmaEsOptions all = one;
    for (VectorXd* v : {&all.x0, &all.scale, &all.lower, &all.upper}) {
      *v = VectorXd(v->replicate(used, 1));
    }
    CmaEs reference(all);
    double least = kInf;
    MatrixXd best;
    std::vector<double> best_costs;
    for (int g = 0; g < 12; ++g) {
      const std::vector<Candidate> points = phi.ask();
      const std::vector<Candidate> curves = reference.ask();
      ASSERT_EQ(points.size(), 5 * curves.size());
      for (size_t k = 0; k < curves.size(); ++k) {
        const Eigen::Map<const MatrixXd> control(curves[k].x.data(), 2, used);
        double sum = 0;
        std::vector<double> costs;
        for (size_t i = 0; i < 5; ++i) {
          const Candidate& point = points[5 * k + i];
          EXPECT_EQ(point.id, static_cast<std::uint64_t>(g) * 40 + 5 * k + i);
          ASSERT_LT((point.x - control * bernstein(used, static_cast<double>(i) / 4)).norm(),
                    1e-14);
          Evaluation e = problem.evaluate(point.x);
          if (g == 3 && k == 1 && i == 2) e.task_costs[2] = kNaN;
          phi.tell(point.id, e);
          costs.push_back(e.task_costs[i]);
          sum += costs.back() / 5;
        }
        reference.tell(curves[k].id, {.cost = sum});
        if (sum < least) least = sum, best = control, best_costs = costs;
      }
      ASSERT_TRUE(phi.family());
      EXPECT_NEAR(phi.family()->cost, least, 1e-14);
      EXPECT_EQ(phi.family()->curve.points, best);
      EXPECT_EQ(phi.family()->task_costs, best_costs);
      ASSERT_LT((phi.cma().mean() - reference.mean()).norm(), 1e-12);
    }
  }
  // Of equal curves the first is the best.
  PhiCma flat(problem.tasks(), 2, one);
  const VectorXd first = flat.ask()[0].x;
  for (const Candidate& c : flat.ask()) {
    flat.tell(c.id, {.cost = 1, .task_costs = std::vector<double>(5, 1.0)});
  }
  EXPECT_LT((flat.family()->curve.at(0) - first).norm(), 1e-14);
}

/// What IndividualCma's header says, in its own words: a CmaEs for each task.
struct TextbookIndividual {
  struct Search {
    std::unique_ptr<CmaEs> cma = {};
    double cost = kInf;
    VectorXd best = {};
    bool over = false;
  };
  IndividualCmaOptions o;
  std::vector<Search> searches = {};
  int turn_of = 0;
  int had = 0;  // generations of its turn
  std::string stop = {};
  double family = kInf;

  explicit TextbookIndividual(const IndividualCmaOptions& options) : o(options) {
    searches.resize(static_cast<size_t>(o.tasks.size()));
    for (size_t i = 0; i < searches.size(); ++i) {
      if (o.turn == 0 || i == 0) begin(static_cast<int>(i), o.cma.x0);
    }
  }

  void begin(int task, const VectorXd& x0) {
    CmaEsOptions c = o.cma;
    c.x0 = x0;
    c.seed = Random(o.cma.seed, static_cast<std::uint64_t>(task)).bits();
    if (o.turn > 0 && task > 0) c.sigma /= 2;
    searches[task].cma = std::make_unique<CmaEs>(c);
  }

  std::vector<std::pair<int, Candidate>> ask() const {
    std::vector<std::pair<int, Candidate>> all;
    for (int i = 0; i < static_cast<int>(searches.size()); ++i) {
      if (searches[i].over || (o.turn > 0 && i != turn_of)) continue;
      for (const Candidate& c : searches[i].cma->ask()) all.emplace_back(i, c);
    }
    return all;
  }

  void learn(const std::vector<double>& costs) {
    const auto asked = ask();
    for (size_t k = 0; k < asked.size(); ++k) {
      const auto& [task, c] = asked[k];
      Search& search = searches[task];
      if (costs[k] < search.cost) search.cost = costs[k], search.best = c.x;
      search.cma->tell(c.id, {.cost = costs[k]});
    }
    double sum = 0;
    for (Search& search : searches) {
      if (search.cma && !search.over) {
        search.over = search.cost <= o.target || search.cma->stopped();
        if (search.over) stop = search.cost <= o.target ? "target" : search.cma->stopped()->reason;
      }
      sum += search.cost / static_cast<double>(searches.size());
    }
    family = std::min(family, sum);
    ++had;
    if (o.turn == 0 || (had < o.turn && !searches[turn_of].over)) return;
    had = 0;
    for (size_t step = 0; step < searches.size(); ++step) {
      const int before = turn_of;
      turn_of = (turn_of + 1) % static_cast<int>(searches.size());
      if (!searches[turn_of].cma) {
        begin(turn_of, searches[before].best.size() > 0 ? searches[before].best : o.cma.x0);
      }
      if (!searches[turn_of].over) return;
    }
  }
};

TEST(IndividualCma, IsACmaEsForEachTask) {
  const SegmentProblem problem = bow();
  for (const int turn : {0, 1, 4}) {
    for (const bool failing : {false, true}) {
      IndividualCmaOptions o = individualFor(problem);
      o.cma.seed = 3;
      o.cma.lambda = 6;
      o.cma.scale = VectorXd{{1, 0.5}};
      o.cma.termination.tolallfailed = 2;
      o.turn = turn;
      o.target = 1e-4;
      IndividualCma cma(o);
      TextbookIndividual book(o);
      std::uint64_t next = 0;
      int generations = 0;
      for (; generations < 1000 && !cma.stopped(); ++generations) {
        const std::vector<Candidate> candidates = cma.ask();
        const auto expected = book.ask();
        ASSERT_EQ(candidates.size(), expected.size()) << generations;
        std::vector<double> costs;
        for (size_t k = 0; k < candidates.size(); ++k) {
          ASSERT_EQ(candidates[k].x, expected[k].second.x) << generations;
          EXPECT_EQ(candidates[k].id, next++);
          Evaluation e = problem.evaluate(candidates[k].x);
          if (failing && expected[k].first == 1) e.task_costs[1] = kInf;
          costs.push_back(failing && expected[k].first == 1 ? double{kNaN}
                                                            : e.task_costs[expected[k].first]);
          cma.tell(candidates[k].id, e);
        }
        book.learn(costs);
        ASSERT_EQ(cma.family().has_value(), std::isfinite(book.family));
        EXPECT_NEAR(cma.family() ? cma.family()->cost : 0, cma.family() ? book.family : 0, 1e-14);
      }
      ASSERT_TRUE(cma.stopped()) << turn;
      EXPECT_EQ(cma.stopped()->reason, book.stop);
      EXPECT_TRUE(cma.ask().empty());
      EXPECT_TRUE(book.ask().empty());
      EXPECT_GT(generations, 20);
    }
  }
}

TEST(IndividualCma, TasksMayLieOnAGridOfAThousandSteps) {
  const auto with = [](const VectorXd& tasks) {
    IndividualCmaOptions o;
    o.tasks = tasks;
    o.cma.x0 = VectorXd::Zero(1);
    const IndividualCma cma(o);
  };
  EXPECT_NO_THROW(with(VectorXd{{0, 1, 1000}}));
  EXPECT_THROW(with(VectorXd{{0, 1, 1001}}), InputError);
  EXPECT_NO_THROW(with(VectorXd{{0, 1, 1.0 + 1e-12 + 1}}));
  EXPECT_THROW(with(VectorXd{{0, 1, 1.00001 + 1}}), InputError);
}

TEST(FamilyBaselines, AreRegisteredWithWhatTheirHeaderSays) {
  const SegmentProblem problem = bow(2, -1, 3);
  const CommonOptions options{.seed = 4, .sigma = 0.2, .x0 = VectorXd{{0, 1}}};
  CmaEsOptions cma;
  cma.x0 = options.x0;
  cma.sigma = 0.2;
  cma.scale = VectorXd::Constant(2, 4);
  cma.lower = problem.lower();
  cma.upper = problem.upper();
  cma.lambda = 16;
  cma.seed = 4;
  IndividualCmaOptions apart{.tasks = problem.tasks(), .cma = cma};
  IndividualCmaOptions turns = apart;
  turns.turn = 10;
  const auto expect_equal = [&](const std::unique_ptr<Optimizer>& one, Optimizer&& other) {
    for (int g = 0; g < 25; ++g) {
      const std::vector<Candidate> a = one->ask();
      const std::vector<Candidate> b = other.ask();
      ASSERT_EQ(a.size(), b.size()) << g;
      for (size_t k = 0; k < a.size(); ++k) {
        ASSERT_EQ(a[k].x, b[k].x) << g;
        one->tell(a[k].id, problem.evaluate(a[k].x));
        other.tell(b[k].id, problem.evaluate(b[k].x));
      }
    }
  };
  expect_equal(makePhiCma(problem, options), PhiCma(problem.tasks(), 2, cma));
  expect_equal(makeIndividualCma(problem, options), IndividualCma(apart));
  expect_equal(makeNeighbourCma(problem, options), IndividualCma(turns));
  EXPECT_EQ(makePhiCma(problem, {.lambda = 3})->ask().size(), 15u);
  EXPECT_NO_THROW(makePhiCma(problem, {.control_points = 4}));
  EXPECT_THROW(makeIndividualCma(problem, {.control_points = 4}), InputError);
  EXPECT_THROW(makeNeighbourCma(problem, {.control_points = 1}), InputError);
}

TEST(FamilyBaselines, SayWhatIsWrong) {
  const SegmentProblem problem = bow();
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  const auto phi = [&](int K, const MatrixXd& phi0) {
    return message([&] { PhiCma(problem.tasks(), K, cmaFor(problem), phi0); });
  };
  EXPECT_EQ(phi(0, {}), "cma: expected control points ≥ 1, got 0");
  EXPECT_EQ(phi(1, {}), "");
  EXPECT_EQ(phi(2, MatrixXd::Zero(3, 2)), "cma: expected phi0(2 x 2), got (3 x 2)");
  EXPECT_EQ(phi(2, MatrixXd::Zero(2, 3)), "cma: expected phi0(2 x 2), got (2 x 3)");
  EXPECT_EQ(phi(9, MatrixXd::Zero(2, 5)), "");
  for (const auto& make : everyWay()) {
    const auto optimizer = make(problem, 1);
    const size_t count = optimizer->ask().size();
    const auto tell = [&](std::uint64_t id) {
      return message([&] { optimizer->tell(id, problem.evaluate(VectorXd::Zero(2))); });
    };
    EXPECT_NE(tell(count).find(": no candidate " + std::to_string(count) + " in a generation of"),
              std::string::npos);
    EXPECT_EQ(tell(count - 1), "");
    EXPECT_NE(tell(count - 1).find("has been told already"), std::string::npos);
  }
}

}  // namespace
}  // namespace traceur::optim
