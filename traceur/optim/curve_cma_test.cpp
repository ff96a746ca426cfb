#include "traceur/optim/curve_cma.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <climits>
#include <cmath>
#include <functional>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/segment_problem.h"
#include "traceur/optim/task_positions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

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
    const auto family = curve.family();
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
  CommonOptions options;
  options.control_points = 4;
  const auto cubic = makeCurveCma(problem, options);
  minimise(problem, *cubic, {.budget = 20000, .target = 1e-4});
  EXPECT_LE(cubic->family()->cost, 1e-4);
  options.control_points = 2;
  const auto straight = makeCurveCma(problem, options);
  minimise(problem, *straight, {.budget = 20000, .target = 1e-4});
  EXPECT_GT(straight->family()->cost, 0.01);
}

TEST(CurveCma, RunsTheCurveThenSamplesThenTheNextCurve) {
  const SegmentProblem problem = line(2);
  CurveCma curve(optionsFor(problem));
  EXPECT_FALSE(curve.family());
  ASSERT_EQ(curve.ask().size(), 6u);
  for (const Candidate& c : curve.ask()) EXPECT_EQ(c.x, VectorXd::Zero(2));
  tellAll(curve, problem);
  EXPECT_NEAR(curve.family()->cost, 0.04 + (0.09 + 0.0256 + 0.0004 + 0.0144 + 0.0676 + 0.16) / 6,
              1e-12);
  ASSERT_EQ(curve.ask().size(), 16u);
  EXPECT_EQ(curve.ask()[0].id, 6u);
  tellAll(curve, problem);
  ASSERT_EQ(curve.ask().size(), 6u);
  const double sigma = curve.state().sigma;
  const double before = curve.family()->cost;
  double cost = 0;
  for (int i = 0; i < 6; ++i) cost += problem.evaluate(curve.ask()[i].x).task_costs[i] / 6;
  tellAll(curve, problem);
  const bool accepted = cost < before;
  EXPECT_DOUBLE_EQ(curve.family()->cost, accepted ? cost : before);
  EXPECT_DOUBLE_EQ(curve.state().sigma, sigma * std::exp(accepted ? 1.0 / 3 : -1.0 / 12));
}

/// The equations of the header for one elite a task, so that nothing is drawn but samples, with
/// full matrices.
struct TextbookCurve {
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

  TextbookCurve(const CurveCmaOptions& options, int control_points, const VectorXd& w)
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
    TextbookCurve book(o, o.control_points, (tasks.array() - 1) / 8);
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
  const auto family = curve.family();
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
    EXPECT_LT(curve.family()->cost, 0.0055) << seed;
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
  EXPECT_LT(a.family()->cost, 0.1);
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
  EXPECT_FALSE(curve.family());

  // A first curve that fails, and one task of which half the trials say nothing.
  CurveCma half(optionsFor(problem));
  for (int g = 0; g < 400 && !(half.family() && half.family()->cost < 1e-2); ++g) {
    for (const Candidate& c : half.ask()) {
      Evaluation e = problem.evaluate(c.x);
      if (g == 0) e.failed = true;
      if (c.id % 2 == 0) e.task_costs[3] = c.id % 4 == 0 ? double{kNaN} : double{kInf};
      half.tell(c.id, e);
    }
  }
  ASSERT_TRUE(half.family());
  EXPECT_LT(half.family()->cost, 1e-2);
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
    CommonOptions options;
    options.control_points = 4;
    const auto curve = makeCurveCma(problem, options);
    minimise(problem, *curve, {.budget = 5000, .target = 1e-4});
    EXPECT_LE(curve->family()->cost, 1e-4) << M;
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

/// How badly a group, (n x M), fits a curve of K control points at the tasks w, and the fit.
std::pair<double, MatrixXd> fitOf(const CurveCmaOptions& o, const MatrixXd& group,
                                  const VectorXd& w) {
  const int K = o.control_points;
  MatrixXd basis(w.size(), K);
  for (int i = 0; i < w.size(); ++i) basis.row(i) = bernstein(K, w[i]).transpose();
  const MatrixXd points = group * basis * (basis.transpose() * basis).inverse();
  MatrixXd left = group - points * basis.transpose();
  for (int j = 0; j < group.rows(); ++j) {
    const double width = o.upper[j] - o.lower[j];
    left.row(j) /= std::isfinite(width) ? width / 2 : o.scale[j];
  }
  if (o.fit_error == FitError::kDistances) return {left.colwise().norm().sum(), points};
  MatrixXd X = basis;
  if (K == 2) X << VectorXd::Ones(w.size()), w;
  const VectorXd variances = (X.transpose() * X).inverse().diagonal();
  double error = 0;
  for (int j = 0; j < group.rows(); ++j) {
    error += std::sqrt(left.row(j).squaredNorm() / static_cast<double>(w.size() - K)) *
             variances.cwiseSqrt().sum();
  }
  return {error, points};
}

TEST(CurveCma, ProposesTheLeastCostlyGroupOfElites) {
  // Three elites of four tasks: so many groups are tried that none is left out.
  const VectorXd w{{0, 0.2, 0.7, 1}};
  const auto evaluate = [&](const VectorXd& x, double unit) {
    Evaluation e{.cost = 0};
    for (const double at : w) {
      e.task_costs.push_back(unit * ((x - VectorXd{{at, 0.4 - at * at}}).squaredNorm() + 0.1));
    }
    return e;
  };
  for (const FitError fit_error : {FitError::kDistances, FitError::kStandardErrors}) {
    for (const int K : {1, 2, 3}) {
      for (const double alpha : {0.0, 0.1, 10.0}) {
        for (const double unit : {1.0, 1e307}) {  // of which no four could be added up
          CurveCmaOptions o;
          o.x0 = VectorXd::Zero(2);
          o.tasks = w;
          o.sigma = 0.2;
          o.scale = VectorXd{{1, 2}};
          o.lower = VectorXd{{-50, -kInf}};
          o.upper = VectorXd{{30, kInf}};
          o.control_points = K;
          o.lambda = 8;
          o.elites = 3;
          o.groups = 2000;
          o.alpha = alpha;
          o.fit_error = fit_error;
          CurveCma curve(o);
          for (int g = 0; g < 6; ++g) {
            const bool sampled = !curve.state().measuring;
            for (const Candidate& c : curve.ask()) {
              curve.tell(c.id, evaluate(c.x, unit == 1 ? 1 : 8e307));
            }
            if (!sampled) continue;
            const auto& elites = curve.state().elites;
            double least = kInf;
            MatrixXd points;
            for (int code = 0; code < 81; ++code) {
              MatrixXd group(2, 4);
              double cost = 0;
              for (int i = 0, rest = code; i < 4; ++i, rest /= 3) {
                ASSERT_EQ(elites[i].size(), 3u);
                group.col(i) = elites[i][rest % 3].x;
                cost += elites[i][rest % 3].cost / unit;
              }
              const auto [error, fit] = fitOf(o, group, w);
              cost += alpha * error / unit;
              if (cost < least) least = cost, points = fit;
            }
            ASSERT_LT((curve.state().proposed - points).norm(), 1e-9) << K << " " << alpha;
          }
        }
      }
    }
  }
}

TEST(CurveCma, TriesTheBestOfEachTaskFirstIfToldSo) {
  const SegmentProblem problem = line(2);
  CurveCmaOptions o = optionsFor(problem);
  o.scale = VectorXd::Ones(2);
  o.groups = 1;
  o.best_group_first = true;
  CurveCma curve(o);
  o.best_group_first = false;
  CurveCma drawn(o);
  int other = 0;
  for (int g = 0; g < 10; ++g) {
    const bool sampled = !curve.state().measuring;
    tellAll(curve, problem);
    tellAll(drawn, problem);
    if (!sampled) continue;
    for (CurveCma* c : {&curve, &drawn}) {
      MatrixXd best(2, 6);
      for (int i = 0; i < 6; ++i) best.col(i) = c->state().elites[i][0].x;
      const double off = (c->state().proposed - fitOf(o, best, problem.tasks()).second).norm();
      EXPECT_TRUE(c == &drawn || off < 1e-12) << off;
      other += c == &drawn && off > 1e-3;
    }
  }
  EXPECT_GT(other, 2);
}

TEST(CurveCma, ShrinksABentCurveIntoTheBoxAndCutsALine) {
  // One elite a task, so that the fit is known; its optimum lies outside.
  const SegmentProblem outside(VectorXd::Constant(2, -1), VectorXd::Constant(2, 1),
                               VectorXd::LinSpaced(6, 0, 1), [](double w) {
                                 return VectorXd{{1.3 - 3 * w * (1 - w), 3 * w - 1.5}};
                               });
  for (const int K : {2, 4}) {
    CurveCmaOptions o = optionsFor(outside);
    o.control_points = K;
    o.elites = 1;
    o.scale = VectorXd::Ones(2);
    CurveCma curve(o);
    int cut = 0;
    for (int g = 0; g < 150; ++g) {
      const bool sampled = !curve.state().measuring;
      tellAll(curve, outside);
      if (!sampled) continue;
      MatrixXd group(2, 6);
      for (int i = 0; i < 6; ++i) group.col(i) = curve.state().elites[i][0].x;
      MatrixXd points = fitOf(o, group, outside.tasks()).second;
      for (int j = 0; j < 2; ++j) {
        VectorXd at(6);
        for (int i = 0; i < 6; ++i) at[i] = points.row(j) * bernstein(K, i / 5.0);
        if (at.cwiseAbs().maxCoeff() <= 1) continue;
        ++cut;
        if (K == 2) {
          points.row(j) = points.row(j).cwiseMax(-1).cwiseMin(1);
          continue;
        }
        // About the mean of what lies inside, by the largest factor that keeps all inside.
        const double middle = at.cwiseMax(-1).cwiseMin(1).mean();
        double factor = 1;
        for (const double value : at) {
          if (value > middle) factor = std::min(factor, (1 - middle) / (value - middle));
          if (value < middle) factor = std::min(factor, (middle + 1) / (middle - value));
        }
        points.row(j) = middle + factor * (points.row(j).array() - middle);
      }
      ASSERT_LT((curve.state().proposed - points).norm(), 1e-9) << K << " " << g;
    }
    EXPECT_GT(cut, 10) << K;
  }
}

TEST(CurveCma, DrawsForTasksByChance) {
  const SegmentProblem problem = line(2, -1, 1);
  CurveCmaOptions o = optionsFor(problem);
  o.scale = VectorXd{{1, 0.5}};
  o.seed = 9;
  CurveCma curve(o);
  const BoundFold fold(o.lower, o.upper, o.sigma * o.scale);
  std::vector<int> count(6, 0);
  for (int g = 0; g < 60; ++g) {
    const CurveCmaState& s = curve.state();
    if (!s.measuring) {
      const std::vector<Candidate> candidates = curve.ask();
      for (size_t k = 0; k < candidates.size(); ++k) {
        Random random(9, s.generation, k);
        const auto task = static_cast<int>(random.below(6));
        ++count[task];
        VectorXd z(2);
        for (double& v : z) v = random.normal();
        const VectorXd y = s.shapes[task].L.triangularView<Eigen::Lower>() * z;
        const VectorXd mean = s.points * bernstein(2, task / 5.0);
        for (int j = 0; j < 2; ++j) {
          const double x = fold.fold(j, fold.unfold(j, mean[j]) + s.sigma * o.scale[j] * y[j]);
          ASSERT_NEAR(candidates[k].x[j], x, 1e-12);
        }
      }
    }
    tellAll(curve, problem);
  }
  for (const int times : count) EXPECT_GT(times, 40);  // of some 80
}

TEST(CurveCma, EndsWhereItsLimitsAre) {
  // While nothing is learned the largest deviation is the first.
  const SegmentProblem problem = line(2);
  const auto stop = [&](auto change) -> std::optional<Stop> {
    CurveCmaOptions o = optionsFor(problem);
    o.sigma = 0.5;
    change(o);
    CurveCma curve(o);
    for (const Candidate& c : curve.ask()) curve.tell(c.id, {.failed = true});
    return curve.stopped();
  };
  for (const StepSize step : {StepSize::kDeviation, StepSize::kVariance}) {
    EXPECT_FALSE(stop([&](auto& o) { o.tolx = 1, o.step_size = step; }));
    EXPECT_FALSE(stop([&](auto& o) { o.tolxup = 1, o.step_size = step; }));
    const auto small = stop([&](auto& o) { o.tolx = 1.01, o.step_size = step; });
    ASSERT_TRUE(small);
    EXPECT_EQ(small->reason, "tolx");
    EXPECT_EQ(small->value, 1);
    EXPECT_EQ(small->limit, 1.01);
    const auto large = stop([&](auto& o) { o.tolxup = 0.99, o.step_size = step; });
    ASSERT_TRUE(large);
    EXPECT_EQ(large->reason, "tolxup");
    EXPECT_EQ(large->value, 1);
    EXPECT_EQ(large->limit, 0.99);
  }

  // Iterations without any cost count, in a row, whether elites are known or not.
  CurveCmaOptions o = optionsFor(problem);
  o.tolallfailed = 3;
  CurveCma curve(o);
  const auto generation = [&](bool fails) {
    for (const Candidate& c : curve.ask()) {
      curve.tell(c.id, fails ? Evaluation{.failed = true} : problem.evaluate(c.x));
    }
  };
  generation(true);  // the first curve
  for (int k = 1; k <= 2; ++k) {
    generation(true);
    EXPECT_FALSE(curve.state().measuring);
    EXPECT_EQ(curve.state().all_failed, k);
  }
  generation(false);
  EXPECT_EQ(curve.state().all_failed, 0);
  EXPECT_TRUE(curve.state().measuring);
  EXPECT_FALSE(curve.family());
  generation(false);
  ASSERT_TRUE(curve.family());
  for (int k = 1; k <= 3; ++k) {
    EXPECT_FALSE(curve.stopped());
    while (curve.state().measuring) generation(false);
    generation(true);
    EXPECT_EQ(curve.state().all_failed, k);
  }
  ASSERT_TRUE(curve.stopped());
  EXPECT_EQ(curve.stopped()->reason, "tolallfailed");
  EXPECT_EQ(curve.stopped()->value, 3);
  EXPECT_EQ(curve.stopped()->limit, 3);
}

TEST(CurveCma, OfEqualCostsTheFirstIsTheBetter) {
  const SegmentProblem problem = line(2);
  CurveCmaOptions o = optionsFor(problem);
  o.elites = 3;
  CurveCma curve(o);
  for (int g = 0; g < 2; ++g) {
    const std::vector<Candidate> candidates = curve.ask();
    for (const Candidate& c : candidates) {
      curve.tell(c.id, {.cost = 1, .task_costs = std::vector<double>(6, 1.0)});
    }
    if (g == 0) continue;
    for (const auto& elites : curve.state().elites) {
      ASSERT_EQ(elites.size(), 3u);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(elites[k].x, candidates[k].x);
    }
  }
}

TEST(CurveCma, OptionsEndWhereTheySay) {
  using Change = std::function<void(CurveCmaOptions&)>;
  const SegmentProblem problem = line(2, -1, 1);
  const auto made = [&](const Change& change) {
    CurveCmaOptions o = optionsFor(problem);
    change(o);
    const CurveCma curve(o);
  };
  const std::vector<Change> last = {
      [](auto& o) { o.control_points = 1; }, [](auto& o) { o.control_points = 1000000; },
      [](auto& o) { o.lambda = 1; },         [](auto& o) { o.elites = 1; },
      [](auto& o) { o.groups = 1000000; },   [](auto& o) { o.tolallfailed = 1; },
      [](auto& o) { o.alpha = 0; },          [](auto& o) { o.tolx = 0; },
      [](auto& o) { o.tolxup = 0; },         [](auto& o) { o.c_cov_offset = 0; },
      [](auto& o) { o.tolxup = kInf; },      [](auto& o) { o.tolallfailed = INT_MAX; }};
  for (size_t i = 0; i < last.size(); ++i) EXPECT_NO_THROW(made(last[i])) << i;
  const auto message = [&](const Change& change) -> std::string {
    try {
      made(change);
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message([](auto& o) { o.control_points = 0; }),
            "curve: expected control_points in [1, 1000000], got 0");
  EXPECT_EQ(message([](auto& o) { o.lambda = 1000001; }),
            "curve: expected lambda in [1, 1000000], got 1000001");
  EXPECT_EQ(message([](auto& o) { o.elites = 0; }),
            "curve: expected elites in [1, 1000000], got 0");
  EXPECT_EQ(message([](auto& o) { o.groups = 0; }),
            "curve: expected groups in [1, 1000000], got 0");
  EXPECT_EQ(message([](auto& o) { o.tolallfailed = 0; }),
            "curve: expected tolallfailed in [1, 1000000], got 0");
  EXPECT_EQ(message([](auto& o) { o.alpha = -1; }), "curve: expected alpha ≥ 0, got -1");
  EXPECT_EQ(message([](auto& o) { o.tolx = -1; }), "curve: expected tolx ≥ 0, got -1");
  EXPECT_EQ(message([](auto& o) { o.tolxup = -1; }), "curve: expected tolxup ≥ 0, got -1");
  EXPECT_EQ(message([](auto& o) { o.c_cov_offset = kNaN; }),
            "curve: expected c_cov_offset ≥ 0, got nan");
  EXPECT_EQ(message([](auto& o) { o.failure_exponent = kInf; }),
            "curve: expected a finite failure_exponent > 0, got inf");

  const CurveCmaOptions table = table11CurveCma();
  EXPECT_EQ(table.sigma, 1);
  EXPECT_EQ(table.groups, 64);
  EXPECT_EQ(table.step_size, StepSize::kVariance);
  EXPECT_EQ(table.fit_error, FitError::kStandardErrors);
  EXPECT_EQ(table.c_cov_offset, 2);
  EXPECT_FALSE(table.normalised_steps || table.fresh_success_rate);
  EXPECT_TRUE(table.best_group_first && table.pool_first_curve);

  // As registered.
  const auto registered = [&](const CommonOptions& options) {
    const auto optimizer = makeCurveCma(problem, options);
    return dynamic_cast<const CurveCma&>(*optimizer).options();
  };
  EXPECT_EQ(registered({}).lambda, 16);
  const CurveCmaOptions o = registered(
      {.seed = 4, .control_points = 4, .lambda = 5, .sigma = 0.2, .x0 = VectorXd{{0, 1}}});
  EXPECT_EQ(o.seed, 4u);
  EXPECT_EQ(o.control_points, 4);
  EXPECT_EQ(o.lambda, 5);
  EXPECT_EQ(o.sigma, 0.2);
  EXPECT_EQ(o.x0, (VectorXd{{0, 1}}));
  EXPECT_EQ(o.scale, VectorXd::Constant(2, 2));
  EXPECT_EQ(o.lower, problem.lower());
  EXPECT_EQ(o.upper, problem.upper());
}

TEST(CurveCma, SaysWhatCannotBeTold) {
  const SegmentProblem problem = line(2);
  CurveCma curve(optionsFor(problem));
  const auto message = [&](std::uint64_t id) -> std::string {
    try {
      curve.tell(id, problem.evaluate(VectorXd::Zero(2)));
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message(6), "curve: no candidate 6 in generation 0, which has 0 to 5");
  for (std::uint64_t id = 0; id < 6; ++id) EXPECT_EQ(message(id), "");
  EXPECT_EQ(message(5), "curve: no candidate 5 in generation 1, which has 6 to 21");
  EXPECT_EQ(message(22), "curve: no candidate 22 in generation 1, which has 6 to 21");
  EXPECT_EQ(message(21), "");
  EXPECT_EQ(message(21), "curve: candidate 21 has been told already");
}

}  // namespace
}  // namespace traceur::optim
