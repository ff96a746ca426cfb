#include "traceur/optim/curve_cma.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/segment_problem.h"
#include "traceur/optim/task_positions.h"

namespace traceur::optim {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// c(w) from (-0.3, 0.2, …) to (0.4, 0.2, …), tasks 0, 1/5, …, 1.
SegmentProblem line(int n, double low = -kInf, double high = kInf) {
  return {VectorXd::Constant(n, low), VectorXd::Constant(n, high), VectorXd::LinSpaced(6, 0, 1),
          [n](double w) {
            VectorXd c = VectorXd::Constant(n, 0.2);
            c[0] = -0.3 + 0.7 * w;
            return c;
          }};
}

CurveCmaOptions optionsFor(const Problem& problem) {
  CurveCmaOptions o;
  o.x0 = VectorXd::Zero(problem.dimension());
  o.tasks = problem.tasks();
  o.lower = problem.lower();
  o.upper = problem.upper();
  return o;
}

void tellAll(CurveCma& curve, const Problem& problem, bool backwards = false) {
  std::vector<Candidate> all = curve.ask();
  if (backwards) std::reverse(all.begin(), all.end());
  for (const Candidate& c : all) curve.tell(c.id, problem.evaluate(c.x));
}

TEST(CurveCma, FindsALine) {
  const SegmentProblem problem = line(3);
  for (const bool table : {false, true}) {
    CurveCmaOptions o = table ? table11CurveCma() : CurveCmaOptions{};
    o.x0 = VectorXd::Zero(3);
    o.tasks = problem.tasks();
    CurveCma curve(o);
    const Summary summary = minimise(problem, curve, {.budget = 20000, .target = 1e-5});
    ASSERT_EQ(summary.end, End::kTarget) << table;
    const auto family = curve.best();
    ASSERT_TRUE(family);
    EXPECT_NEAR(family->curve.at(0)[0], -0.3, 0.02);
    EXPECT_NEAR(family->curve.at(1)[0], 0.4, 0.02);
    double sum = 0;
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(problem.evaluate(family->curve.at(problem.tasks()[i])).task_costs[i],
                family->task_costs[i]);
      sum += family->task_costs[i] / 6;
    }
    EXPECT_DOUBLE_EQ(sum, family->cost);
  }
}

TEST(CurveCma, BendsWithFourControlPoints) {
  const SegmentProblem problem(VectorXd::Constant(2, -2), VectorXd::Constant(2, 2),
                               VectorXd::LinSpaced(6, 10, 15), [](double t) {
                                 const double w = (t - 10) / 5;
                                 return VectorXd{{w, 4 * w * (1 - w)}};
                               });
  FamilyOptions options;
  options.control_points = 4;
  const auto cubic = makeCurveCma(problem, options);
  minimise(problem, *cubic, {.budget = 20000, .target = 1e-4});
  EXPECT_LE(cubic->best()->cost, 1e-4);
  options.control_points = 2;
  const auto straight = makeCurveCma(problem, options);
  minimise(problem, *straight, {.budget = 20000, .target = 1e-4});
  EXPECT_GT(straight->best()->cost, 0.01);
}

TEST(CurveCma, RunsTheCurveThenSamplesThenTheNextCurve) {
  const SegmentProblem problem = line(2);
  CurveCma curve(optionsFor(problem));
  EXPECT_FALSE(curve.best());
  ASSERT_EQ(curve.ask().size(), 6u);
  for (const Candidate& c : curve.ask()) EXPECT_EQ(c.x, VectorXd::Zero(2));
  tellAll(curve, problem);
  EXPECT_NEAR(curve.best()->cost, 0.04 + (0.09 + 0.0256 + 0.0004 + 0.0144 + 0.0676 + 0.16) / 6,
              1e-12);
  ASSERT_EQ(curve.ask().size(), 16u);
  EXPECT_EQ(curve.ask()[0].id, 6u);
  tellAll(curve, problem);
  ASSERT_EQ(curve.ask().size(), 6u);
  const double sigma = curve.state().sigma;
  const double before = curve.best()->cost;
  double cost = 0;
  for (int i = 0; i < 6; ++i) cost += problem.evaluate(curve.ask()[i].x).task_costs[i] / 6;
  tellAll(curve, problem);
  const bool accepted = cost < before;
  EXPECT_DOUBLE_EQ(curve.best()->cost, accepted ? cost : before);
  EXPECT_DOUBLE_EQ(curve.state().sigma, sigma * std::exp(accepted ? 1.0 / 3 : -1.0 / 12));
}

/// The equations of the header for one elite a task, so that nothing is drawn but samples, with
/// full matrices.
struct Textbook {
  CurveCmaOptions o;
  int n, M, K;
  MatrixXd basis;  // (M x K)
  MatrixXd points, proposed;
  std::vector<MatrixXd> C;
  std::vector<VectorXd> path;
  std::vector<double> best;
  MatrixXd elites;
  double cost = kInf, sigma, p = 2.0 / 11;
  bool first = true;
  int successes = 0, failures = 0;

  Textbook(const CurveCmaOptions& options, int control_points, const VectorXd& w)
      : o(options),
        n(static_cast<int>(o.x0.size())),
        M(static_cast<int>(w.size())),
        K(control_points),
        basis(M, K),
        points(o.x0.replicate(1, K)),
        proposed(points),
        C(M, MatrixXd::Identity(n, n)),
        path(M, VectorXd::Zero(n)),
        best(M, kInf),
        elites(n, M),
        sigma(o.step_size == StepSize::kVariance ? o.sigma * o.sigma : o.sigma) {
    for (int i = 0; i < M; ++i) basis.row(i) = bernstein(K, w[i]).transpose();
  }

  void remember(const VectorXd& x, const std::vector<double>& costs) {
    for (int i = 0; i < M; ++i) {
      if (!(costs[i] < best[i])) continue;
      best[i] = costs[i];
      elites.col(i) = x;
    }
  }

  /// After the samples of an iteration.
  void propose() { proposed = elites * basis * (basis.transpose() * basis).inverse(); }

  /// After the points of a curve, with their mean cost.
  void judge(double measured) {
    const bool success = measured < cost;
    if (!first) {
      const double before = p;
      p = 11 * p / 12 + (success ? 1.0 / 12 : 0);
      if (success) {
        const double deviation = o.step_size == StepSize::kVariance ? std::sqrt(sigma) : sigma;
        const MatrixXd steps = (proposed - points) * basis.transpose();
        for (int i = 0; i < M; ++i) {
          learn(i, steps.col(i) / (o.normalised_steps ? deviation : o.sigma),
                o.fresh_success_rate ? p : before);
        }
      }
      sigma *= success ? std::exp(1.0 / 3) : std::exp(-o.failure_exponent / 3);
      ++(success ? successes : failures);
    }
    if (first || success) {
      points = proposed;
      cost = measured;
    }
    first = false;
  }

  void learn(int i, const VectorXd& y, double rate) {
    const double c_c = 2.0 / (n + 2);
    const double c_cov = 2 / (n * n + o.c_cov_offset);
    const bool moves = rate < 0.44;
    path[i] = (1 - c_c) * path[i] + (moves ? std::sqrt(c_c * (2 - c_c)) : 0) * y;
    C[i] = (1 - c_cov + (moves ? 0 : c_cov * c_c * (2 - c_c))) * C[i] +
           c_cov * path[i] * path[i].transpose();
  }
};

TEST(CurveCma, UpdatesAsItsEquationsSay) {
  const int n = 3;
  VectorXd tasks(5);
  tasks << 1, 2, 4, 7, 9;
  const auto cost_of = [](const VectorXd& x, double task) {
    double cost = 0;
    for (int j = 0; j < n; ++j) cost += std::pow(10, j) * std::pow(x[j] - 0.1 * task * (j - 1), 2);
    return cost;
  };
  CurveCmaOptions plain;
  plain.x0 = VectorXd::LinSpaced(n, 1, 2);
  plain.tasks = tasks;
  plain.elites = 1;
  CurveCmaOptions table = table11CurveCma();
  table.x0 = plain.x0;
  table.tasks = tasks;
  table.elites = 1;
  CurveCmaOptions cubic = plain;
  cubic.control_points = 4;
  cubic.failure_exponent = 0.5;
  for (const CurveCmaOptions& o : {plain, table, cubic}) {
    CurveCma curve(o);
    Textbook book(o, o.control_points, (tasks.array() - 1) / 8);
    for (int g = 0; g < 120; ++g) {
      const bool measuring = curve.state().measuring;
      const std::vector<Candidate> candidates = curve.ask();
      double mean = 0;
      for (size_t k = 0; k < candidates.size(); ++k) {
        Evaluation e{.cost = 0};
        for (const double task : tasks) e.task_costs.push_back(cost_of(candidates[k].x, task));
        curve.tell(candidates[k].id, e);
        if (measuring) mean += e.task_costs[k] / 5;
        if (!measuring || (book.first && o.pool_first_curve)) {
          book.remember(candidates[k].x, e.task_costs);
        }
      }
      if (measuring) {
        book.judge(mean);
      } else {
        book.propose();
        if (!curve.state().measuring) book.judge(kInf);  // nothing new to measure
      }
      const CurveCmaState& s = curve.state();
      ASSERT_LE((s.points - book.points).norm(), 1e-9) << g;
      ASSERT_LE((s.proposed - book.proposed).norm(), 1e-9) << g;
      ASSERT_NEAR(s.sigma, book.sigma, 1e-9 * book.sigma) << g;
      ASSERT_NEAR(s.p_success, book.p, 1e-9) << g;
      for (int i = 0; i < 5; ++i) {
        ASSERT_LE((s.shapes[i].covariance() - book.C[i]).norm(), 1e-7 * book.C[i].norm()) << g;
      }
    }
    EXPECT_GT(book.successes, 5);
    EXPECT_GT(book.failures, 5);
  }
}

TEST(CurveCma, KeepsTheBestOfEachTask) {
  const SegmentProblem problem = line(2);
  CurveCmaOptions o = optionsFor(problem);
  o.elites = 3;
  CurveCma curve(o);
  tellAll(curve, problem);
  std::vector<std::vector<double>> costs(6);
  for (int g = 0; g < 6; ++g) {
    for (const Candidate& c : curve.ask()) {
      if (curve.state().measuring) continue;
      const Evaluation e = problem.evaluate(c.x);
      for (int i = 0; i < 6; ++i) costs[i].push_back(e.task_costs[i]);
    }
    tellAll(curve, problem);
  }
  for (int i = 0; i < 6; ++i) {
    std::sort(costs[i].begin(), costs[i].end());
    ASSERT_EQ(curve.state().elites[i].size(), 3u);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(curve.state().elites[i][k].cost, costs[i][k]);
  }
}

TEST(CurveCma, TheStepSizeMayMultiplyTheVariance) {
  const SegmentProblem problem = line(2);
  for (const StepSize step : {StepSize::kDeviation, StepSize::kVariance}) {
    CurveCmaOptions o = optionsFor(problem);
    o.step_size = step;
    o.sigma = 0.5;
    o.lambda = 4000;
    CurveCma curve(o);
    tellAll(curve, problem);
    double squares = 0;
    for (const Candidate& c : curve.ask()) squares += c.x.squaredNorm();
    EXPECT_NEAR(std::sqrt(squares / 8000), 0.5, 0.02);
    EXPECT_EQ(curve.state().sigma, step == StepSize::kVariance ? 0.25 : 0.5);
  }
}

TEST(CurveCma, StaysInTheBoxAlsoWhereTheAnswerDoesNot) {
  SegmentProblem problem = line(2, -0.2, 0.3);
  CurveCma curve(optionsFor(problem));
  const Summary summary = minimise(problem, curve, {.budget = 6000});  // throws outside
  EXPECT_GT(summary.progress.evaluations, 1000);
  const auto family = curve.best();
  EXPECT_NEAR(family->curve.at(0)[0], -0.2, 0.02);
  EXPECT_LE(family->curve.points.maxCoeff(), 0.3);
  EXPECT_GE(family->curve.points.minCoeff(), -0.2);
}

TEST(CurveCma, ACubicKeepsItsShapeWhereABoundCutsIt) {
  // Up over the bound by a fifteenth and down again; a control point must lie far beyond.
  const SegmentProblem problem(VectorXd::Constant(2, -1), VectorXd::Constant(2, 1),
                               VectorXd::LinSpaced(6, 0, 1), [](double w) {
                                 VectorXd c = VectorXd::Constant(2, 0.2);
                                 c[0] = 1.1 - 1.5 * (w - 0.4) * (w - 0.4) * (1 + w);
                                 return c;
                               });
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CurveCmaOptions o = optionsFor(problem);
    o.control_points = 4;
    o.seed = seed;
    CurveCma curve(o);
    minimise(problem, curve, {.budget = 5000});
    // With control points moved into the box, .0066 in the median.
    EXPECT_LT(curve.best()->cost, 0.0055) << seed;
  }
}

TEST(CurveCma, WeighsTheFitInTheUnitOfTheBox) {
  // The first step is the same, whatever it is told in; what α weighs is the box's.
  const SegmentProblem problem = line(3, -1, 1);
  CurveCmaOptions one = optionsFor(problem);
  one.sigma = 0.5;
  CurveCmaOptions two = one;
  two.sigma = 0.25;
  two.scale = VectorXd::Constant(3, 2);
  CurveCma a(one);
  CurveCma b(two);
  for (int g = 0; g < 40; ++g) {
    tellAll(a, problem);
    tellAll(b, problem);
    ASSERT_EQ(a.state().points, b.state().points) << g;
  }
  EXPECT_LT(a.best()->cost, 0.1);
}

TEST(CurveCma, OrderAndInterruptionsDoNotMatter) {
  const SegmentProblem problem = line(3, -1, 1);
  CurveCma one(optionsFor(problem));
  CurveCma other(optionsFor(problem));
  for (int g = 0; g < 20; ++g) {
    tellAll(one, problem);
    const std::vector<Candidate> all = other.ask();
    for (size_t k = 0; k < all.size() / 2; ++k) {
      other.tell(all[k].id, problem.evaluate(all[k].x));
    }
    CurveCma restored(optionsFor(problem));
    restored.restore(other.save());
    EXPECT_EQ(restored.save(), other.save());
    other.restore(restored.save());
    tellAll(other, problem, true);
    ASSERT_EQ(one.save(), other.save()) << g;
  }
  CurveCmaOptions seeded = optionsFor(problem);
  seeded.seed = 2;
  EXPECT_THROW(CurveCma(seeded).restore(one.save()), InputError);
  std::string damaged = one.save();
  damaged[60] ^= 1;
  EXPECT_THROW(other.restore(damaged), InputError);
  EXPECT_EQ(one.save(), other.save());
}

TEST(CurveCma, SurvivesFailuresAndReportsTheirEnd) {
  const SegmentProblem problem = line(2);
  CurveCma curve(optionsFor(problem));
  for (int g = 0; g < 200 && !curve.stopped(); ++g) {
    for (const Candidate& c : curve.ask()) curve.tell(c.id, {.failed = true});
  }
  ASSERT_TRUE(curve.stopped());
  EXPECT_EQ(curve.stopped()->reason, "tolallfailed");
  EXPECT_FALSE(curve.best());

  // A first curve that fails, and one task of which half the trials say nothing.
  CurveCma half(optionsFor(problem));
  for (int g = 0; g < 400 && !(half.best() && half.best()->cost < 1e-2); ++g) {
    for (const Candidate& c : half.ask()) {
      Evaluation e = problem.evaluate(c.x);
      if (g == 0) e.failed = true;
      if (c.id % 2 == 0) e.task_costs[3] = c.id % 4 == 0 ? double{kNaN} : double{kInf};
      half.tell(c.id, e);
    }
  }
  ASSERT_TRUE(half.best());
  EXPECT_LT(half.best()->cost, 1e-2);
}

TEST(CurveCma, StopsOnAPlateau) {
  const SegmentProblem problem(VectorXd::Zero(2), VectorXd::Ones(2), VectorXd::LinSpaced(6, 0, 1),
                               [](double) { return VectorXd::Zero(2).eval(); });
  CurveCma curve(optionsFor(problem));
  for (int g = 0; g < 2000 && !curve.stopped(); ++g) {
    for (const Candidate& c : curve.ask()) {
      curve.tell(c.id, {.cost = 1, .task_costs = std::vector<double>(6, 1.0)});
    }
  }
  ASSERT_TRUE(curve.stopped());
  EXPECT_EQ(curve.stopped()->reason, "tolx");
}

TEST(CurveCma, WorksWithFewerTasksThanControlPoints) {
  for (const int M : {1, 2, 3}) {
    const SegmentProblem problem(VectorXd::Constant(2, -1), VectorXd::Constant(2, 1),
                                 VectorXd::LinSpaced(M, 3, 5), [](double t) {
                                   return VectorXd{{t / 10, -t / 10}};
                                 });
    FamilyOptions options;
    options.control_points = 4;
    const auto curve = makeCurveCma(problem, options);
    minimise(problem, *curve, {.budget = 5000, .target = 1e-4});
    EXPECT_LE(curve->best()->cost, 1e-4) << M;
  }
}

TEST(CurveCma, RefusesWrongOptions) {
  const SegmentProblem problem = line(2, -1, 1);
  const auto refused = [&](auto change) {
    CurveCmaOptions o = optionsFor(problem);
    change(o);
    EXPECT_THROW(CurveCma{o}, InputError);
  };
  refused([](auto& o) { o.tasks.resize(0); });
  refused([](auto& o) { o.tasks[3] = o.tasks[2]; });
  refused([](auto& o) { o.tasks[3] = kNaN; });
  refused([](auto& o) { o.x0.resize(0); });
  refused([](auto& o) { o.x0[1] = kNaN; });
  refused([](auto& o) { o.x0[1] = 2; });
  refused([](auto& o) { o.x0.conservativeResize(1); });
  refused([](auto& o) { o.lower.swap(o.upper); });
  refused([](auto& o) { o.sigma = 0; });
  refused([](auto& o) { o.sigma = kInf; });
  refused([](auto& o) { o.scale = VectorXd::Zero(2); });
  refused([](auto& o) { o.control_points = 0; });
  refused([](auto& o) { o.lambda = 0; });
  refused([](auto& o) { o.elites = -1; });
  refused([](auto& o) { o.groups = 0; });
  refused([](auto& o) { o.alpha = kNaN; });
  refused([](auto& o) { o.failure_exponent = 0; });
  refused([](auto& o) { o.tolx = -1; });
  EXPECT_NO_THROW(CurveCma{optionsFor(problem)});
  EXPECT_THROW(makeCurveCma(problem, {.sigma = 0}), InputError);
  EXPECT_THROW(makeCurveCma(problem, {.lambda = -3}), InputError);

  CurveCma curve(optionsFor(problem));
  const std::string before = curve.save();
  EXPECT_THROW(curve.tell(99, {}), InputError);
  EXPECT_THROW(curve.tell(0, {.cost = 1, .task_costs = {1}}), InputError);
  EXPECT_EQ(curve.save(), before);
  curve.tell(0, problem.evaluate(VectorXd::Zero(2)));
  EXPECT_THROW(curve.tell(0, problem.evaluate(VectorXd::Zero(2))), InputError);
}

TEST(TaskPositions, RunFromZeroToOne) {
  EXPECT_EQ(taskPositions("test", VectorXd{{2, 3, 6}}), (VectorXd{{0, 0.25, 1}}));
  EXPECT_EQ(taskPositions("test", VectorXd{{7}}), VectorXd{{0}});
  EXPECT_EQ(taskPositions("test", VectorXd{{-1.7e308, 0, 1.7e308}}), (VectorXd{{0, 0.5, 1}}));
  EXPECT_EQ(taskPositions("test", VectorXd{{-3, 1, 4, 5}}), (VectorXd{{0, 0.5, 0.875, 1}}));
  const auto message = [](const VectorXd& tasks) -> std::string {
    try {
      taskPositions("test", tasks);
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message({}), "test: expected a problem with tasks, got none");
  EXPECT_EQ(message(VectorXd{{kNaN}}), "test: task 0 is nan");
  EXPECT_EQ(message(VectorXd{{0, kInf}}), "test: task 1 is inf");
  EXPECT_EQ(message(VectorXd{{3, 2}}), "test: expected rising tasks, got 2 after 3");
  EXPECT_EQ(message(VectorXd{{1, 2, 2}}), "test: expected rising tasks, got 2 after 2");
}

}  // namespace
}  // namespace traceur::optim
