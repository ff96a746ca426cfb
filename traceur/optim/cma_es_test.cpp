#include "traceur/optim/cma_es.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <climits>
#include <cmath>
#include <numeric>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/all.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/state.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

/// A textbook CMA-ES without a thought for speed: full matrices, C^(-1/2) formed anew, no shared
/// code but the constants. It learns from the points another one drew.
struct TextbookCmaEs {
  int n;
  CmaConstants c;
  VectorXd m, p_sigma, p_c;
  MatrixXd C;
  double sigma;
  int updates = 0;
  int stalled = 0;  // generations with h_σ = 0
  bool holds = false;
  VectorXd held = {};  // the best feasible trial, and its cost
  double held_cost = 0;
  int taken = 0, clipped = 0;  // generations that learned from it, and from a place nearer by

  TextbookCmaEs(const VectorXd& x0, double sigma0, bool active, int lambda = 0)
      : n(static_cast<int>(x0.size())),
        c(cmaConstants(n, lambda, active)),
        m(x0),
        p_sigma(VectorXd::Zero(n)),
        p_c(VectorXd::Zero(n)),
        C(MatrixXd::Identity(n, n)),
        sigma(sigma0) {}

  void learn(std::vector<VectorXd> x, std::vector<Evaluation> e) {
    const auto meaningful = [](const Evaluation& v) { return v.meaningful(); };
    if (std::none_of(e.begin(), e.end(), meaningful)) return;
    SymmetricEigen eigen(n);
    eigen.compute(C);
    const MatrixXd root = eigen.vectors() * eigen.values().cwiseSqrt().cwiseInverse().asDiagonal() *
                          eigen.vectors().transpose();
    const auto feasible = [](const Evaluation& v) { return v.feasible(); };
    if (held.size() > 0 && std::none_of(e.begin(), e.end(), feasible)) {
      const auto worst =
          std::max_element(e.begin(), e.end(), [](auto& a, auto& b) { return better(a, b); });
      const VectorXd y = held - m;
      const double length = (root * y / sigma).norm();
      const double longest = std::sqrt(n) + 2.0 * n / (n + 2);
      ++taken;
      clipped += length > longest;
      x[worst - e.begin()] = m + y * std::min(1.0, longest / length);
      *worst = {.cost = held_cost};
    }
    std::vector<int> rank(x.size());
    std::iota(rank.begin(), rank.end(), 0);
    std::stable_sort(rank.begin(), rank.end(), [&](int a, int b) { return better(e[a], e[b]); });
    for (const int k : rank) {
      if (!holds || !e[k].feasible() || (held.size() > 0 && e[k].cost >= held_cost)) continue;
      held = x[k];
      held_cost = e[k].cost;
    }

    const auto good = std::count_if(e.begin(), e.end(), meaningful);
    VectorXd w = c.weights;
    int mu = std::max<int>(1, std::min<int>(c.mu, static_cast<int>(good / 2)));
    const auto pulling = static_cast<int>(std::count_if(e.begin(), e.end(), feasible));
    if (holds && pulling > 0) mu = std::min(mu, pulling);
    for (int i = mu; i < c.mu; ++i) w[i] = 0;
    w.head(mu) /= w.head(mu).sum();
    for (int i = static_cast<int>(good); i < c.lambda; ++i) w[i] *= 0.5;
    const double mu_eff = 1 / w.head(mu).squaredNorm();

    VectorXd y_w = VectorXd::Zero(n);
    MatrixXd rank_mu = MatrixXd::Zero(n, n);
    for (int i = 0; i < c.lambda; ++i) {
      const VectorXd y = (x[rank[i]] - m) / sigma;
      if (i < mu) y_w += w[i] * y;
      const double w_i = w[i] >= 0 ? w[i] : w[i] * n / (root * y).squaredNorm();
      rank_mu += w_i * y * y.transpose();
    }
    ++updates;
    m += sigma * y_w;
    p_sigma =
        (1 - c.c_sigma) * p_sigma + std::sqrt(c.c_sigma * (2 - c.c_sigma) * mu_eff) * (root * y_w);
    const bool h = p_sigma.norm() / std::sqrt(1 - std::pow(1 - c.c_sigma, 2 * updates)) <
                   (1.4 + 2.0 / (n + 1)) * c.chi_n;
    stalled += !h;
    p_c = (1 - c.c_c) * p_c + (h ? std::sqrt(c.c_c * (2 - c.c_c) * mu_eff) : 0) * y_w;
    C = (1 + (h ? 0 : c.c_1 * c.c_c * (2 - c.c_c)) - c.c_1 - c.c_mu * w.sum()) * C +
        c.c_1 * p_c * p_c.transpose() + c.c_mu * rank_mu;
    sigma *= std::exp(std::min(1.0, c.c_sigma / c.d_sigma * (p_sigma.norm() / c.chi_n - 1)));
  }
};

/// Asks, evaluates and tells one generation.
void step(CmaEs& cma, const std::function<Evaluation(const VectorXd&)>& evaluate) {
  for (const Candidate& c : cma.ask()) cma.tell(c.id, evaluate(c.x));
}

Evaluation rotatedValley(const VectorXd& x) {
  double valley = 0;
  for (int i = 0; i + 1 < x.size(); ++i) valley += std::pow(x[i] - 2 * x[i + 1], 2);
  return {.cost = 1000 * valley + x.squaredNorm() + x[0]};
}

TEST(CmaEs, UpdatesAsTheTextbookDoes) {
  struct Case {
    const char* what;
    int n, lambda;
    double sigma;
    bool active;
    std::function<Evaluation(const VectorXd&)> f;
    bool holds = false;
  };
  const std::vector<Case> cases = {
      {"active", 6, 0, 0.5, true, rotatedValley},
      {"passive", 6, 0, 0.5, false, rotatedValley},
      {"one variable", 1, 0, 0.5, true, [](auto& x) { return Evaluation{.cost = x[0] * x[0]}; }},
      {"odd population", 4, 9, 0.5, true, rotatedValley},
      {"large population", 3, 60, 0.5, true, rotatedValley},
      {"small step, so that h_sigma stalls", 6, 0, 1e-3, true, rotatedValley},
      {"constraint", 5, 0, 0.5, true,
       [](auto& x) {
         return Evaluation{.cost = sphere(x), .violated = {x[0] < 0.5, false}};
       }},
      // Whether and at what cost is chance, so that what is held stays behind.
      {"held, of one variable", 1, 0, 0.5, true,
       [](auto& x) {
         return Evaluation{.cost = std::cos(3e4 * x[0]), .violated = {std::sin(1e4 * x[0]) < 0.7}};
       },
       true},
      {"held", 3, 0, 0.5, true,
       [](auto& x) {
         return Evaluation{.cost = std::cos(3e4 * x[1]),
                           .violated = {std::sin(1e4 * x[0]) < 0.9},
                           .failed = std::sin(2e4 * x[2]) > 0.9};
       },
       true},
      {"failures", 5, 0, 0.5, true,
       [](auto& x) { return Evaluation{.cost = sphere(x), .failed = std::sin(1e4 * x[0]) > 0.2}; }},
  };
  for (const Case& k : cases) {
    SCOPED_TRACE(k.what);
    const VectorXd x0 = VectorXd::LinSpaced(k.n, 1, 2);
    CmaEs cma({.x0 = x0,
               .sigma = k.sigma,
               .lambda = k.lambda,
               .active = k.active,
               .seed = 11,
               .hold_feasible = k.holds});
    TextbookCmaEs book(x0, k.sigma, k.active, k.lambda);
    book.holds = k.holds;
    for (int g = 0; g < 40; ++g) {
      std::vector<VectorXd> x;
      std::vector<Evaluation> e;
      for (const Candidate& c : cma.ask()) {
        x.push_back(c.x);
        e.push_back(k.f(c.x));
        cma.tell(c.id, e.back());
      }
      book.learn(x, e);
      const CmaState& s = cma.state();
      const MatrixXd C = s.C.selfadjointView<Eigen::Lower>();
      ASSERT_LE((s.mean - book.m).norm(), 1e-8 * (1 + book.m.norm())) << g;
      ASSERT_NEAR(s.sigma, book.sigma, 1e-8 * book.sigma) << g;
      ASSERT_LE((C - book.C).norm(), 1e-7 * book.C.norm()) << g;
      ASSERT_LE((s.p_c - book.p_c).norm(), 1e-6) << g;
      ASSERT_LE((s.p_sigma - book.p_sigma).norm(), 1e-6) << g;
    }
    if (k.sigma < 0.01) {
      EXPECT_GT(book.stalled, 3);
    }
    if (k.holds) {
      EXPECT_GT(book.taken, 5);
      EXPECT_GT(book.clipped, 0);
      EXPECT_LT(book.clipped, book.taken);
      EXPECT_EQ(cma.state().held_cost, book.held_cost);
    }
  }
}

TEST(CmaEs, DecomposesLazilyWithoutHarm) {
  // At n = 100 every second generation: D, B then lag one generation behind C.
  CmaEs cma({.x0 = VectorXd::Ones(100), .sigma = 0.5});
  for (int g = 1; g <= 6; ++g) {
    step(cma, [](auto& x) { return Evaluation{.cost = ellipsoid(x)}; });
    const CmaState& s = cma.state();
    EXPECT_EQ(s.decomposed, static_cast<std::uint64_t>(g / 2 * 2));
    const MatrixXd C = s.C.selfadjointView<Eigen::Lower>();
    const double gap = (s.B * s.D.cwiseAbs2().asDiagonal() * s.B.transpose() - C).norm();
    if (g % 2 == 0) {
      EXPECT_LT(gap, 1e-12);
    }
    if (g % 2 == 1) {
      EXPECT_GT(gap, 1e-6);
    }
  }
}

TEST(CmaEs, DrawsFromTheDistributionItReports) {
  // 4000 points of one generation against mean and covariance in the units of x.
  const int lambda = 4000;
  VectorXd scale(3);
  scale << 1, 100, 0.01;
  CmaEs cma({.x0 = VectorXd::LinSpaced(3, -1, 1), .sigma = 0.5, .scale = scale, .lambda = lambda});
  for (int g = 0; g < 4; ++g) {
    step(cma, [](auto& x) { return Evaluation{.cost = x[0] + x[1] / 100 + std::sin(x[2])}; });
  }
  const MatrixXd expected = cma.covariance();
  MatrixXd found = MatrixXd::Zero(3, 3);
  VectorXd mean = VectorXd::Zero(3);
  for (const Candidate& c : cma.ask()) {
    mean += c.x / lambda;
    found += (c.x - cma.mean()) * (c.x - cma.mean()).transpose() / lambda;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(mean[i], cma.mean()[i], 4 * std::sqrt(expected(i, i) / lambda));
    for (int j = 0; j < 3; ++j) {
      const double size = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(found(i, j), expected(i, j), 0.1 * size);
    }
  }
  EXPECT_GT(std::abs(expected(0, 1)), 0.05 * std::sqrt(expected(0, 0) * expected(1, 1)));
}

TEST(CmaEs, SolvesTheSameProblemInAnyUnits) {
  // Scale 2^k multiplies without rounding: equal bits up to that factor.
  VectorXd scale(4);
  scale << 1, 1024, 0.125, 4;
  CmaEs plain({.x0 = VectorXd::Ones(4), .sigma = 0.5});
  CmaEs scaled({.x0 = scale, .sigma = 0.5, .scale = scale});
  for (int g = 0; g < 50; ++g) {
    step(plain, [](auto& x) { return Evaluation{.cost = rosenbrock(x)}; });
    step(scaled, [&](auto& x) { return Evaluation{.cost = rosenbrock(x.cwiseQuotient(scale))}; });
    ASSERT_EQ(scaled.state().mean, plain.state().mean.cwiseProduct(scale)) << g;
    ASSERT_EQ(scaled.state().sigma, plain.state().sigma) << g;
  }
}

TEST(CmaEs, IgnoresMonotonicTransformationsOfTheCost) {
  CmaEs plain({.x0 = VectorXd::Ones(4), .sigma = 0.5});
  CmaEs cubed({.x0 = VectorXd::Ones(4), .sigma = 0.5});
  for (int g = 0; g < 40; ++g) {
    step(plain, [](auto& x) { return Evaluation{.cost = sphere(x)}; });
    step(cubed, [](auto& x) { return Evaluation{.cost = std::pow(sphere(x), 3) - 7}; });
    ASSERT_EQ(cubed.state().mean, plain.state().mean);
  }
}

TEST(CmaEs, CapsTheGrowthOfTheStepAtE) {
  // Only points far out in one direction are let through, so that p_σ is longer than chance allows.
  CmaEs cma({.x0 = VectorXd::Zero(2),
             .sigma = 1,
             .seed = 2,
             .acceptance = [](int, const VectorXd& x) { return x[0] > 4 ? 1.0 : 0; },
             .max_draws = INT_MAX});
  const double before = cma.state().sigma;
  step(cma, [](auto& x) { return Evaluation{.cost = x[1]}; });
  EXPECT_GT(cma.constants().c_sigma / cma.constants().d_sigma *
                (cma.state().p_sigma.norm() / cma.constants().chi_n - 1),
            1);
  EXPECT_DOUBLE_EQ(cma.state().sigma / before, std::exp(1));
}

TEST(CmaEs, GrowsItsStepOnAPlateau) {
  CmaEs cma({.x0 = VectorXd::Zero(5), .sigma = 0.1});
  TextbookCmaEs book(VectorXd::Zero(5), 0.1, true);
  std::vector<VectorXd> x;
  for (const Candidate& c : cma.ask()) x.push_back(c.x);
  book.learn(x, std::vector<Evaluation>(x.size(), {.cost = 3}));
  step(cma, [](auto&) { return Evaluation{.cost = 3}; });
  const CmaConstants& c = cma.constants();
  EXPECT_NEAR(cma.state().sigma, book.sigma * std::exp(0.2 + c.c_sigma / c.d_sigma), 1e-12);

  // Equal costs of which some are infeasible do tell trials apart.
  CmaEs half({.x0 = VectorXd::Zero(5), .sigma = 0.1});
  TextbookCmaEs half_book(VectorXd::Zero(5), 0.1, true);
  std::vector<Evaluation> mixed(x.size(), {.cost = 3});
  for (const int k : {0, 2, 3, 5, 7}) mixed[k].violated = {true};
  half_book.learn(x, mixed);
  for (const Candidate& k : half.ask()) half.tell(k.id, mixed[k.id]);
  EXPECT_NEAR(half.state().sigma, half_book.sigma, 1e-12);

  // Of eight trials the best six must be equal, not five.
  for (const int equal : {5, 6}) {
    CmaEs most({.x0 = VectorXd::Zero(5), .sigma = 0.1});
    TextbookCmaEs most_book(VectorXd::Zero(5), 0.1, true);
    std::vector<Evaluation> costs(x.size(), {.cost = 3});
    for (size_t k = static_cast<size_t>(equal); k < 8; ++k) costs[k].cost = 4;
    most_book.learn(x, costs);
    for (const Candidate& k : most.ask()) most.tell(k.id, costs[k.id]);
    const double more = equal == 6 ? std::exp(0.2 + c.c_sigma / c.d_sigma) : 1;
    EXPECT_NEAR(most.state().sigma, most_book.sigma * more, 1e-12) << equal;
  }

  // Started on a plateau six steps wide, it finds the slope beyond.
  const FunctionProblem problem(5, [](const VectorXd& v) { return std::min(sphere(v), 300.0); });
  int crossed = 0;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    CmaEs lost({.x0 = VectorXd::Constant(5, 8), .sigma = 0.1, .seed = seed});
    crossed += minimise(problem, lost, {.target = 1e-10}).end == End::kTarget;
  }
  EXPECT_GE(crossed, 9);
}

TEST(CmaEs, HandsOutPointsInsideTheBoundsOnly) {
  VectorXd lower(4), upper(4);
  lower << -1, 0, -kInf, -3;
  upper << 1, kInf, 2, -2.5;
  for (const double sigma : {0.01, 0.5, 100.0}) {
    CmaEs cma(
        {.x0 = Eigen::Vector4d(-1, 0, 2, -2.7), .sigma = sigma, .lower = lower, .upper = upper});
    for (int g = 0; g < 100; ++g) {
      step(cma, [&](auto& x) {
        EXPECT_TRUE((x.array() >= lower.array()).all() && (x.array() <= upper.array()).all());
        return Evaluation{.cost = (x - Eigen::Vector4d(3, 3, 3, 3)).squaredNorm()};
      });
    }
    EXPECT_TRUE((cma.mean().array() >= lower.array()).all());
    EXPECT_TRUE((cma.mean().array() <= upper.array()).all());
  }
}

TEST(CmaEs, FindsMinimaOnBoundsAndInCorners) {
  // A slope toward three bounds, a bowl in the other two variables: linear convergence is asked
  // for.
  const FunctionProblem corner(
      VectorXd::Constant(5, -1), VectorXd::Constant(5, 2),
      [](const VectorXd& x) { return (x.head(3).array() + 1).sum() + x.tail(2).squaredNorm(); });
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    CmaEs cma({.x0 = VectorXd::Constant(5, 0.7),
               .sigma = 0.5,
               .lower = corner.lower(),
               .upper = corner.upper(),
               .seed = seed});
    const Summary s = minimise(corner, cma, {.budget = 2000, .target = 1e-10});
    EXPECT_EQ(s.end, End::kTarget) << s.stop.reason;
  }
  // A smooth minimum outside pulls against the bound.
  const FunctionProblem outside(VectorXd::Constant(5, 1), VectorXd::Constant(5, 2), sphere);
  CmaEs cma({.x0 = VectorXd::Constant(5, 1.9),
             .sigma = 0.2,
             .lower = outside.lower(),
             .upper = outside.upper()});
  EXPECT_EQ(minimise(outside, cma, {.budget = 2000, .target = 5 + 1e-9}).end, End::kTarget);
}

TEST(CmaEs, WideBoundsChangeNothing) {
  CmaEs free({.x0 = VectorXd::Ones(4), .sigma = 0.5});
  CmaEs bounded({.x0 = VectorXd::Ones(4),
                 .sigma = 0.5,
                 .lower = VectorXd::Constant(4, -1e6),
                 .upper = VectorXd::Constant(4, 1e6)});
  for (int g = 0; g < 60; ++g) {
    for (CmaEs* cma : {&free, &bounded}) {
      step(*cma, [](auto& x) { return Evaluation{.cost = rosenbrock(x)}; });
    }
    ASSERT_EQ(free.state().mean, bounded.state().mean);
  }
}

TEST(CmaEs, DoesNotOutgrowItsBox) {
  // The last variable does nothing; unbounded growth there would cost the others their steps.
  const VectorXd lower = VectorXd::Zero(3);
  const VectorXd upper = VectorXd::Constant(3, 3);
  CmaEs cma({.x0 = VectorXd::Ones(3),
             .sigma = 0.3,
             .lower = lower,
             .upper = upper,
             .termination = {.tolflatfitness = INT_MAX}});
  for (int g = 0; g < 200; ++g) {
    step(cma, [](auto&) { return Evaluation{.cost = 1}; });  // flat: σ would explode
    ASSERT_LE(std::sqrt(cma.covariance().diagonal().maxCoeff()), 1 + 1e-12);
    ASSERT_TRUE(cma.state().C.allFinite() && cma.state().B.allFinite());
  }
}

TEST(CmaEs, NarrowsTheBoxedVariableAndNothingElse) {
  // The first variable's first step is its limit, so that any growth is cut; the box does not
  // change what was drawn, only where it was tried.
  const VectorXd inf = VectorXd::Constant(3, kInf);
  VectorXd lower = -inf;
  VectorXd upper = inf;
  lower[0] = -1;
  upper[0] = 1;
  int cut = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CmaEs free({.x0 = VectorXd::Zero(3), .sigma = 2.0 / 3, .seed = seed});
    CmaEs boxed(
        {.x0 = VectorXd::Zero(3), .sigma = 2.0 / 3, .lower = lower, .upper = upper, .seed = seed});
    for (CmaEs* cma : {&free, &boxed}) {
      for (const Candidate& c : cma->ask()) cma->tell(c.id, {.cost = double(c.id * 5 % 7)});
    }
    const double widest = std::sqrt(free.covariance()(0, 0));
    const double factor = std::min(1.0, (2.0 / 3) / widest);
    cut += factor < 1;
    MatrixXd expected = free.covariance();
    expected.row(0) *= factor;
    expected.col(0) *= factor;
    EXPECT_LE((boxed.covariance() - expected).norm(), 1e-14);
    VectorXd path = free.state().p_c;
    path[0] *= factor;
    EXPECT_LE((boxed.state().p_c - path).norm(), 1e-14);
    const CmaState& s = boxed.state();
    const MatrixXd C = s.C.selfadjointView<Eigen::Lower>();
    EXPECT_LE((s.B * s.D.cwiseAbs2().asDiagonal() * s.B.transpose() - C).norm(), 1e-14);
  }
  EXPECT_GT(cut, 5);
  EXPECT_LT(cut, 20);
}

TEST(CmaEs, TwentyPercentRandomFailuresCostLittle) {
  // Which trials fail is pure chance but a function of x, so that runs repeat.
  const auto unlucky = [](const VectorXd& x) {
    std::uint64_t bits = 0;
    for (const double v : x) bits = bits * 31 + std::bit_cast<std::uint64_t>(v);
    return Random(bits).uniform() < 0.2;
  };
  class Unlucky : public FunctionProblem {
   public:
    explicit Unlucky(std::function<bool(const VectorXd&)> unlucky)
        : FunctionProblem(5, sphere), unlucky_(std::move(unlucky)) {}
    Evaluation evaluate(const VectorXd& x) const override {
      return unlucky_(x) ? Evaluation{.cost = NAN} : FunctionProblem::evaluate(x);
    }

   private:
    std::function<bool(const VectorXd&)> unlucky_;
  };
  const Unlucky failing(unlucky);
  const FunctionProblem clean(5, sphere);
  std::vector<int> with, without;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    Random random(seed, 77);
    VectorXd x0(5);
    for (double& v : x0) v = random.uniform(-2, 2);
    CmaEs a({.x0 = x0, .sigma = 0.5, .seed = seed});
    CmaEs b({.x0 = x0, .sigma = 0.5, .seed = seed});
    const Summary f = minimise(failing, a, {.target = 1e-10});
    const Summary c = minimise(clean, b, {.target = 1e-10});
    EXPECT_EQ(f.end, End::kTarget);
    EXPECT_GT(f.progress.failed, 0.1 * f.progress.evaluations);
    with.push_back(f.progress.evaluations);
    without.push_back(c.progress.evaluations);
  }
  std::nth_element(with.begin(), with.begin() + 5, with.end());
  std::nth_element(without.begin(), without.begin() + 5, without.end());
  EXPECT_LE(with[5], 1.4 * without[5]) << with[5] << " against " << without[5];
}

TEST(CmaEs, OneSuccessAmongFailuresIsEnoughToMove) {
  CmaEs cma({.x0 = VectorXd::Zero(5), .sigma = 0.5});
  const std::vector<Candidate> candidates = cma.ask();
  for (size_t k = 0; k < candidates.size(); ++k) {
    cma.tell(candidates[k].id, k == 4 ? Evaluation{.cost = 1} : Evaluation{.failed = true});
  }
  EXPECT_LE((cma.state().mean - candidates[4].x).norm(), 1e-15);
  EXPECT_TRUE(cma.state().C.allFinite());
}

TEST(CmaEs, AGenerationOfFailuresChangesNothingButTheCounter) {
  CmaEs cma({.x0 = VectorXd::Ones(5), .sigma = 0.5});
  for (int g = 0; g < 5; ++g) step(cma, [](auto& x) { return Evaluation{.cost = sphere(x)}; });
  const CmaState before = cma.state();
  const std::vector<Candidate> tried = cma.ask();
  step(cma, [](auto&) { return Evaluation{.cost = NAN}; });
  EXPECT_EQ(cma.state().mean, before.mean);
  EXPECT_EQ(cma.state().sigma, before.sigma);
  EXPECT_EQ(cma.state().C, before.C);
  EXPECT_EQ(cma.state().p_sigma, before.p_sigma);
  EXPECT_EQ(cma.state().generation, before.generation + 1);
  EXPECT_NE(cma.ask()[0].x, tried[0].x);  // other points next time
  // And the search goes on as if the generation had not been.
  const FunctionProblem problem(5, sphere);
  EXPECT_EQ(minimise(problem, cma, {.target = 1e-10}).end, End::kTarget);
}

TEST(CmaEs, SurvivesCostsOfEverySizeAndSign) {
  for (const auto& f : std::vector<std::function<double(const VectorXd&)>>{
           [](auto& x) { return 1e300 * sphere(x); }, [](auto& x) { return -1e300 + sphere(x); },
           [](auto& x) { return 1e-300 * sphere(x); },
           [](auto& x) { return x[0] > 0 ? -kInf : x[1]; },
           [](auto& x) { return x[0] > 0 ? kInf : -x[0]; },
           [](auto& x) { return -std::exp(100 * x[0]); }}) {
    CmaEs cma({.x0 = VectorXd::Constant(3, -0.1), .sigma = 0.5});
    for (int g = 0; g < 300; ++g) {
      step(cma, [&](auto& x) { return Evaluation{.cost = f(x)}; });
      const CmaState& s = cma.state();
      ASSERT_TRUE(s.mean.allFinite() && s.C.allFinite() && s.B.allFinite() && s.D.allFinite() &&
                  s.p_c.allFinite() && s.p_sigma.allFinite() && std::isfinite(s.sigma))
          << g;
      ASSERT_GT(s.D.minCoeff(), 0);
      if (cma.stopped()) {
        ASSERT_FALSE(std::isnan(cma.stopped()->value));
      }
    }
  }
}

TEST(CmaEs, AskRepeatsItselfAndLeavesOutWhatWasTold) {
  CmaEs cma({.x0 = VectorXd::Ones(5), .sigma = 0.5});
  const std::vector<Candidate> all = cma.ask();
  ASSERT_EQ(all.size(), 8);
  cma.tell(all[3].id, {.cost = 1});
  const std::vector<Candidate> left = cma.ask();
  ASSERT_EQ(left.size(), 7);
  for (const Candidate& c : left) {
    EXPECT_NE(c.id, all[3].id);
    EXPECT_EQ(c.x, all[c.id - all[0].id].x);
  }
}

TEST(CmaEs, TiesGoToTheSmallerId) {
  // All equal: the result is as if the costs had risen with the ids, but for the plateau's growth.
  CmaEs tied({.x0 = VectorXd::Ones(5), .sigma = 0.5});
  CmaEs rising({.x0 = VectorXd::Ones(5), .sigma = 0.5});
  const std::vector<Candidate> all = tied.ask();
  for (size_t k = all.size(); k-- > 0;) tied.tell(all[k].id, {.cost = 2});
  for (const Candidate& c : all) rising.tell(c.id, {.cost = static_cast<double>(c.id)});
  EXPECT_EQ(tied.state().mean, rising.state().mean);
  EXPECT_EQ(tied.state().C, rising.state().C);
}

TEST(CmaEs, FeasibilityCanBeLeftToTheCost) {
  // By cost alone, the run is that of the same costs without a constraint; failures still rank
  // last.
  const auto constrained = [](const VectorXd& x) {
    return Evaluation{.cost = sphere(x), .violated = {x[0] > 0.5}, .failed = x[1] > 1.6};
  };
  const auto plain = [&](const VectorXd& x) {
    return Evaluation{.cost = sphere(x), .failed = x[1] > 1.6};
  };
  const VectorXd x0 = VectorXd::Ones(4);
  CmaEs first({.x0 = x0, .sigma = 0.5});
  CmaEs by_cost({.x0 = x0, .sigma = 0.5, .feasible_first = false});
  CmaEs free({.x0 = x0, .sigma = 0.5});
  for (int g = 0; g < 20; ++g) {
    step(first, constrained);
    step(by_cost, constrained);
    step(free, plain);
    ASSERT_EQ(by_cost.state().mean, free.state().mean);
  }
  EXPECT_NE(first.state().mean, free.state().mean);
  EXPECT_THROW(by_cost.restore(first.save()), InputError);
}

TEST(CmaEs, AcceptanceDecidesWhatIsTried) {
  const auto right = [](int, const VectorXd& x) { return x[0] > 0 ? 1.0 : 0; };
  CmaEs all({.x0 = VectorXd::Zero(3), .sigma = 1, .acceptance = [](int, auto&) { return 1.0; }});
  CmaEs plain({.x0 = VectorXd::Zero(3), .sigma = 1});
  CmaEs half({.x0 = VectorXd::Zero(3), .sigma = 1, .acceptance = right});
  CmaEs none({.x0 = VectorXd::Zero(3),
              .sigma = 1,
              .acceptance = [](int, auto&) { return 0.0; },
              .max_draws = 3});
  const auto x = [](CmaEs& cma) {
    std::vector<VectorXd> points;
    for (const Candidate& c : cma.ask()) points.push_back(c.x);
    return points;
  };
  EXPECT_EQ(x(all), x(plain));
  int kept = 0;
  for (size_t k = 0; k < x(half).size(); ++k) {
    EXPECT_GT(x(half)[k][0], 0);
    const bool first_draw = x(plain)[k][0] > 0;
    EXPECT_EQ(x(half)[k] == x(plain)[k], first_draw);
    kept += first_draw;
  }
  EXPECT_GT(kept, 0);
  EXPECT_LT(kept, 7);
  EXPECT_EQ(x(none).size(), 7);  // one of the refused draws is taken
  // … the likeliest of them: of 400 from a normal distribution it is far out.
  CmaEs far({.x0 = VectorXd::Zero(3),
             .sigma = 1,
             .acceptance = [](int, auto& p) { return 1e-9 * std::exp(p[0]); },
             .max_draws = 400});
  for (const VectorXd& point : x(far)) EXPECT_GT(point[0], 1.5);
  step(far, [](auto&) { return Evaluation{.cost = 0}; });
  EXPECT_EQ(far.state().refused, 7 * 400);
  // What is learned is what was drawn: the accepted points pull the mean to the right.
  step(half, [](auto&) { return Evaluation{.cost = 0}; });
  EXPECT_GT(half.mean()[0], 0);
}

TEST(CmaEs, TriesItsStartFirst) {
  const VectorXd x0 = VectorXd::LinSpaced(4, 1, 2);
  CmaEs cma({.x0 = x0, .sigma = 1, .try_start = true});
  EXPECT_EQ(cma.ask()[0].x, x0);
  EXPECT_NE(cma.ask()[1].x, x0);
  step(cma, [](auto& x) { return Evaluation{.cost = sphere(x)}; });
  EXPECT_NE(cma.ask()[0].x, cma.mean());
}

TEST(CmaEs, HoldsTheFeasibleTrialItKnows) {
  // Feasible is a small ball about the start; the cost leads away from it.
  const auto evaluate = [](const VectorXd& x) {
    return Evaluation{.cost = x[0], .violated = {x.norm() > 0.3}};
  };
  CmaEs holding({.x0 = VectorXd::Zero(6), .sigma = 1, .hold_feasible = true, .try_start = true});
  CmaEs free({.x0 = VectorXd::Zero(6), .sigma = 1, .try_start = true});
  for (int g = 0; g < 150; ++g) {
    step(holding, evaluate);
    step(free, evaluate);
  }
  EXPECT_LT(holding.mean().norm(), 0.3 + 1e-3);
  EXPECT_LT(holding.state().held_cost, -0.2);
  EXPECT_GT(free.mean().norm(), 1);

  // Feasible trials alone pull: with one of them, the mean goes there.
  CmaEs one({.x0 = VectorXd::Zero(6), .sigma = 1, .hold_feasible = true});
  const std::vector<Candidate> candidates = one.ask();
  for (const Candidate& c : candidates) {
    one.tell(c.id, {.cost = c.x[0], .violated = {c.id != candidates[3].id}});
  }
  EXPECT_LT((one.mean() - candidates[3].x).norm(), 1e-14);
}

TEST(CmaEs, HoldsAFeasibleTrialBehindAMirrorToo) {
  int behind = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CmaEs cma({.x0 = VectorXd::Constant(2, 0.95),
               .sigma = 0.2,
               .lower = VectorXd::Zero(2),
               .upper = VectorXd::Ones(2),
               .seed = seed,
               .hold_feasible = true});
    // The one feasible trial draws the mean to it, and is held there when no other comes.
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = 1, .violated = {c.id != 0}});
    const VectorXd mean = cma.state().mean;
    behind += (mean.array() > 1.05).any();
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = 1, .violated = {true}});
    EXPECT_LT((cma.state().mean - mean).norm(), 1e-6) << seed;
  }
  EXPECT_GT(behind, 3);
}

TEST(CmaEs, FailuresAloneMoveNothingWhateverIsHeld) {
  CmaEs cma({.x0 = VectorXd::Zero(3), .sigma = 1, .hold_feasible = true, .try_start = true});
  step(cma, [](const VectorXd& x) { return Evaluation{.cost = x[0], .violated = {false}}; });
  const VectorXd mean = cma.mean();
  for (int g = 0; g < 40 && !cma.stopped(); ++g) {
    step(cma, [](const VectorXd&) { return Evaluation{.failed = true}; });
    EXPECT_EQ(cma.mean(), mean);
  }
  ASSERT_TRUE(cma.stopped());
  EXPECT_EQ(cma.stopped()->reason, "tolallfailed");
}

/// Σ 10^(power (i-1)/(n-1)) (y_i - 0.3)² of y = Q x.
FunctionProblem illConditioned(double power, const MatrixXd& Q, double bound = 1) {
  const Eigen::Index n = Q.rows();
  return {VectorXd::Constant(n, -bound), VectorXd::Constant(n, bound),
          [power, Q](const VectorXd& x) {
            const VectorXd y = Q * x;
            double sum = 0;
            for (Eigen::Index i = 0; i < y.size(); ++i) {
              const double share = static_cast<double>(i) / static_cast<double>(y.size() - 1);
              sum += std::pow(10, power * share) * (y[i] - 0.3) * (y[i] - 0.3);
            }
            return sum;
          }};
}

TEST(CmaEs, SolvesWhatIsFarWorseConditionedThanDoublesHold) {
  MatrixXd plane = MatrixXd::Identity(3, 3);  // turned in the plane of the first two
  plane.topLeftCorner(2, 2) = Eigen::Rotation2D<double>(0.7).matrix();
  const MatrixXd whole =
      Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  for (const MatrixXd& Q : {MatrixXd(MatrixXd::Identity(3, 3)), plane, whole}) {
    for (const double power : {14, 18}) {
      // A box would fold a valley this narrow that lies across it.
      const FunctionProblem problem = illConditioned(power, Q, Q(2, 2) == 1 ? 1 : kInf);
      for (const std::uint64_t seed : {1, 2, 3}) {
        CmaEs cma(cmaEsOptions(problem, {.seed = seed}));
        const Summary s = minimise(problem, cma, {.budget = 6000, .target = 1e-9});
        EXPECT_EQ(s.end, End::kTarget) << power << "\n" << Q << "\n" << s.stop.reason;
      }
    }
  }
}

TEST(CmaEs, MovingItsBasisChangesNeitherDistributionNorPaths) {
  const FunctionProblem problem = illConditioned(18, MatrixXd::Identity(3, 3));
  CmaEs cma(cmaEsOptions(problem, {}));
  bool moved = false;
  for (int g = 0; g < 800 && !moved; ++g) {
    const CmaState before = cma.state();
    EXPECT_EQ(before.lengths.size(), 0);
    for (const Candidate& c : cma.ask()) cma.tell(c.id, problem.evaluate(c.x));
    const CmaState& s = cma.state();
    moved = s.lengths.size() > 0;
    if (!moved) continue;
    EXPECT_GT(before.condition, 1e12);
    EXPECT_EQ(s.C, MatrixXd(MatrixXd::Identity(3, 3)));
    // Lengths fall, and are those of an ellipsoid of the condition that was too much for C.
    const double condition = std::pow(s.lengths[0] / s.lengths[2], 2);
    EXPECT_GT(condition, 1e14);
    EXPECT_LT(condition, 1e15);
    EXPECT_TRUE((s.axes.transpose() * s.axes).isIdentity(1e-14));
    // One generation moves a deviation by little more than e.
    for (int i = 0; i < 3; ++i) {
      const double was = before.sigma * std::sqrt(before.C(i, i));
      const double is = std::sqrt(cma.covariance()(i, i)) / cma.options().scale[i];
      EXPECT_NEAR(std::log(is / was), 0, 1.2) << i;
    }
    // It goes on from what was saved with equal bits.
    CmaEs other(cmaEsOptions(problem, {}));
    other.restore(cma.save());
    EXPECT_EQ(other.save(), cma.save());
    for (const Candidate& c : cma.ask()) cma.tell(c.id, problem.evaluate(c.x));
    for (const Candidate& c : other.ask()) other.tell(c.id, problem.evaluate(c.x));
    EXPECT_EQ(other.save(), cma.save());
  }
  EXPECT_TRUE(moved);
}

TEST(CmaEs, GivesUpBeyondTheConditionItMay) {
  const FunctionProblem problem = illConditioned(40, MatrixXd::Identity(3, 3));
  for (const double limit : {1e10, 1e20}) {
    CmaEsOptions o = cmaEsOptions(problem, {});
    o.termination = {.tolx = 0,
                     .tolfun = 0,
                     .tolfunhist = 0,
                     .conditioncov = limit,
                     .noeffectaxis = false,
                     .noeffectcoord = false};
    CmaEs cma(o);
    const Summary s = minimise(problem, cma, {.budget = 20000});
    EXPECT_EQ(s.stop.reason, "conditioncov");
    EXPECT_GT(s.stop.value, limit);
  }
}

TEST(CmaEs, RefusesWrongOptionsWithOneClearMessage) {
  const auto message = [](CmaEsOptions options) -> std::string {
    try {
      const CmaEs cma(std::move(options));
      return "nothing";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  const VectorXd x0 = VectorXd::Zero(3);
  EXPECT_EQ(message({}), "cma-es: expected x0 of at least one variable, got none");
  EXPECT_EQ(message({.x0 = Eigen::Vector2d(0, NAN)}), "cma-es: x0[1] is nan");
  EXPECT_EQ(message({.x0 = x0, .sigma = 0}), "cma-es: expected a finite sigma > 0, got 0");
  EXPECT_EQ(message({.x0 = x0, .sigma = -1}), "cma-es: expected a finite sigma > 0, got -1");
  EXPECT_EQ(message({.x0 = x0, .sigma = NAN}), "cma-es: expected a finite sigma > 0, got nan");
  EXPECT_EQ(message({.x0 = x0, .scale = VectorXd::Ones(2)}),
            "cma-es: expected scale(3) as x0, got scale(2)");
  EXPECT_EQ(message({.x0 = x0, .scale = Eigen::Vector3d(1, 0, 1)}),
            "cma-es: expected a finite scale[1] > 0, got 0");
  EXPECT_EQ(message({.x0 = x0, .lower = VectorXd::Zero(2)}),
            "cma-es: expected bounds lower(3), upper(3), got lower(2), upper(3)");
  EXPECT_EQ(message({.x0 = x0, .lower = VectorXd::Constant(3, NAN)}),
            "cma-es: expected lower[0] < upper[0], got nan and inf");
  EXPECT_EQ(message({.x0 = x0, .lower = VectorXd::Ones(3), .upper = VectorXd::Zero(3)}),
            "cma-es: expected lower[0] < upper[0], got 1 and 0");
  EXPECT_EQ(message({.x0 = x0, .lower = VectorXd::Ones(3)}),
            "cma-es: x0[0] = 0 is outside [1, inf]");
  EXPECT_EQ(message({.x0 = x0, .lambda = 1}),
            "cma-es: expected lambda in [2, 1000000], or 0 for the default, got 1");
  EXPECT_EQ(message({.x0 = x0, .lambda = -4}),
            "cma-es: expected lambda in [2, 1000000], or 0 for the default, got -4");
  EXPECT_EQ(message({.x0 = x0, .feasible_first = false, .hold_feasible = true}),
            "cma-es: hold_feasible needs feasible_first");
  EXPECT_EQ(message({.x0 = x0, .choices = 0}), "cma-es: expected choices ≥ 1, got 0");
  EXPECT_EQ(message({.x0 = x0, .max_draws = 0}), "cma-es: expected max_draws ≥ 1, got 0");
  EXPECT_EQ(message({.x0 = x0, .termination = {.tolx = NAN}}),
            "cma-es: expected tolx ≥ 0, got nan");
  EXPECT_EQ(message({.x0 = x0, .termination = {.maxiter = -2}}),
            "cma-es: expected maxiter ≥ 0, got -2");
  EXPECT_EQ(message({.x0 = x0}), "nothing");
}

TEST(CmaEs, RestoreRefusesWhatIsNotItsStateAndChangesNothing) {
  const CmaEsOptions options{.x0 = VectorXd::Ones(5), .sigma = 0.5};
  CmaEs cma(options);
  for (int g = 0; g < 7; ++g) step(cma, [](auto& x) { return Evaluation{.cost = sphere(x)}; });
  const std::string own = cma.save();

  CmaEs wider({.x0 = VectorXd::Ones(6), .sigma = 0.5});
  CmaEs larger({.x0 = VectorXd::Ones(5), .sigma = 0.5, .lambda = 20});
  CmaEs seeded({.x0 = VectorXd::Ones(5), .sigma = 0.5, .seed = 2});
  CmaEs stopping({.x0 = VectorXd::Ones(5), .sigma = 0.5, .termination = {.tolx = 1e-3}});
  CmaEs choosy(
      {.x0 = VectorXd::Ones(5), .sigma = 0.5, .acceptance = [](int, auto&) { return 1.0; }});
  std::vector<std::string> foreign = {"", "hello", own.substr(0, own.size() / 2), own + "x",
                                      own.substr(1)};
  for (CmaEs* other : {&wider, &larger, &seeded, &stopping, &choosy}) {
    foreign.push_back(other->save());
  }
  for (size_t i = 0; i < own.size(); i += 37) {
    foreign.push_back(own);
    foreign.back()[i] ^= 1;
  }
  for (const std::string& text : foreign) {
    EXPECT_THROW(cma.restore(text), InputError);
    EXPECT_EQ(cma.save(), own);
  }
  try {
    cma.restore(wider.save());
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(),
                 "cma-es: cannot restore a state of n = 6, lambda = 9; expected n = 5, "
                 "lambda = 8");
  }
  CmaEs twin(options);
  EXPECT_NO_THROW(twin.restore(own));
  EXPECT_EQ(twin.save(), own);
}

TEST(CmaEs, AStateStaysSmall) {
  // Histories are cut to what the stop tests still need, however long the run.
  CmaEs cma(
      {.x0 = VectorXd::Ones(2),
       .termination = {.tolfun = 0, .tolfunhist = 0, .tolstagnation = 50, .maxiter = INT_MAX}});
  Random random(1);
  size_t early = 0;
  for (int g = 0; g < 3000; ++g) {
    step(cma, [&](auto&) { return Evaluation{.cost = random.uniform()}; });
    if (g == 200) early = cma.save().size();
  }
  EXPECT_LT(early, 4000);
  const size_t basis = (1 + 2 * 2 + 1 + 2) * 8;  // of a distribution that noise has drawn out
  EXPECT_LE(cma.save().size(), early + basis + size_t{3000 / 5 - 50} * 32);  // a fifth is looked at
}

/// A search with the same distribution and paths, whose shape stands in T = U diag(lengths), not in
/// C. What it drew is the same only if U, lengths are the B, D of what it was.
std::string withBasis(const CmaEs& cma, const MatrixXd& U, const VectorXd& lengths) {
  const CmaState& s = cma.state();
  const auto n = static_cast<int>(s.mean.size());
  const std::string state = cma.save();
  StateReader r(state, "cma-es", 4);
  StateWriter w("cma-es", 4);
  const auto reals = [&](const auto& m) { w.reals({m.data(), static_cast<size_t>(m.size())}); };
  for (int i = 0; i < 5; ++i) w.integer(r.integer());
  w.integer(r.integer());  // sigma, to the bit
  std::vector<double> numbers_read;
  for (int i = 0; i < 6; ++i) r.reals(numbers_read);
  for (int i = 0; i < 2; ++i) r.integer();  // whether it has moved, condition
  reals(s.mean);
  reals(VectorXd(VectorXd::Ones(n)));
  reals(VectorXd(U.transpose() * s.p_sigma));
  reals(VectorXd((U.transpose() * s.p_c).cwiseQuotient(lengths)));
  reals(MatrixXd(MatrixXd::Identity(n, n)));
  reals(MatrixXd(MatrixXd::Identity(n, n)));
  w.integer(1);
  reals(U);
  reals(lengths);
  w.real(1);
  for (int i = 0; i < 4; ++i) w.integer(r.integer());
  bool holds = false;
  r.boolean(holds);
  w.boolean(holds);
  if (holds) {
    r.reals(numbers_read);
    w.reals(numbers_read);
  }
  w.integer(r.integer());  // held_cost
  std::optional<Stop> stop;
  field(r, stop);
  field(w, stop);
  for (int i = 0; i < 2 * cma.constants().lambda; ++i) w.integer(r.integer());
  w.integer(r.integer());
  const std::uint64_t kept = r.integer();
  w.integer(kept);
  for (std::uint64_t i = 0; i < 4 * kept; ++i) w.integer(r.integer());
  r.finish();
  return w.finish();
}

TEST(CmaEs, IsTheSameSearchInAnyBasis) {
  // Each generation once more in T's coordinates, which then are the axes of C.
  constexpr double inf = kInf;
  struct Case {
    const char* what;
    CmaEsOptions o;
    bool stops;
  };
  const VectorXd x0 = VectorXd::Zero(3);
  const VectorXd scale{{1, 2, 0.5}};
  const VectorXd lower{{-1, -inf, -inf}};
  const VectorXd upper{{1, inf, inf}};
  const VectorXd far = VectorXd::Constant(3, 1e17);
  for (const Case& c : std::initializer_list<Case>{
           {"free", {.x0 = x0, .sigma = 0.5, .scale = scale}, false},
           {"in a box", {.x0 = x0, .sigma = 2.0 / 3, .lower = lower, .upper = upper}, false},
           {"held", {.x0 = x0, .sigma = 0.5, .scale = scale, .hold_feasible = true}, false},
           {"tolx", {.x0 = x0, .sigma = 0.5, .termination = {.tolx = 1e9}}, true},
           {"tolxup", {.x0 = x0, .sigma = 0.5, .termination = {.tolxup = 0}}, true},
           {"tolupsigma", {.x0 = x0, .sigma = 0.5, .termination = {.tolupsigma = 0}}, true},
           {"noeffectcoord", {.x0 = far, .sigma = 0.5, .scale = scale}, true}}) {
    SCOPED_TRACE(c.what);
    CmaEs plain(c.o);
    CmaEs moved(c.o);
    int moved_again = 0;
    for (int g = 0; g < 25; ++g) {
      const MatrixXd B = plain.state().B;
      const VectorXd D = plain.state().D;
      moved.restore(withBasis(plain, B, D));
      EXPECT_LE((moved.covariance() - plain.covariance()).norm(),
                1e-12 * plain.covariance().norm());
      EXPECT_NEAR(moved.longestAxis(), plain.longestAxis(), 1e-12 * plain.longestAxis());
      const std::vector<Candidate> candidates = plain.ask();
      const std::vector<Candidate> same = moved.ask();
      for (size_t k = 0; k < candidates.size(); ++k) {
        ASSERT_LE((candidates[k].x - same[k].x).norm(), 1e-11 * (1 + candidates[k].x.norm()));
        Evaluation e = rotatedValley(candidates[k].x - c.o.x0);
        if (c.o.hold_feasible) e.violated = {g > 0 && (g * 8 + static_cast<int>(k)) % 11 > 0};
        plain.tell(candidates[k].id, e);
        moved.tell(same[k].id, e);
      }
      const CmaState& a = plain.state();
      const CmaState& b = moved.state();
      ASSERT_LE((a.mean - b.mean).norm(), 1e-9 * (1 + a.mean.norm())) << g;
      ASSERT_NEAR(a.sigma, b.sigma, 1e-9 * a.sigma);
      ASSERT_LE((moved.covariance() - plain.covariance()).norm(), 1e-8 * plain.covariance().norm());
      ASSERT_NEAR(a.p_sigma.norm(), b.p_sigma.norm(), 1e-8);
      const MatrixXd T = b.axes * b.lengths.asDiagonal();
      ASSERT_LE((T * b.p_c - a.p_c).norm(), 1e-8 * (1 + a.p_c.norm())) << g;
      if (T.isApprox(B * D.asDiagonal(), 1e-13)) {
        ASSERT_LE((B * b.p_sigma - a.p_sigma).norm(), 1e-8) << g;
      } else {
        ++moved_again;
        EXPECT_TRUE(b.C.isIdentity() && b.B.isIdentity() && b.D.isOnes());
        EXPECT_EQ(b.condition, 1);
      }
      ASSERT_EQ(plain.stopped().has_value(), c.stops);
      ASSERT_EQ(moved.stopped().has_value(), c.stops);
      if (!c.stops) continue;
      EXPECT_EQ(plain.stopped()->reason, c.what);
      EXPECT_EQ(moved.stopped()->reason, c.what);
      EXPECT_NEAR(moved.stopped()->value / plain.stopped()->value, 1, 1e-8);
      EXPECT_NEAR(moved.stopped()->limit, plain.stopped()->limit, 1e-9 * plain.stopped()->limit);
    }
    EXPECT_EQ(moved_again > 0, c.o.lower.size() > 0);
  }
}

TEST(CmaEs, StopsInAnotherBasisByTheLengthsOfItsAxes) {
  // A generation of failures changes nothing but is looked at.
  const auto stop = [](CmaTermination t, const VectorXd& lengths, double mean) {
    CmaEs cma({.x0 = VectorXd::Constant(3, mean), .sigma = 1, .termination = t});
    cma.restore(withBasis(cma, MatrixXd::Identity(3, 3), lengths));
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.failed = true});
    return cma.stopped();
  };
  const VectorXd lengths{{3, 2, 1}};
  const auto expect_stop = [&](const CmaTermination& t, const char* reason, double value) {
    const std::optional<Stop> s = stop(t, lengths, 0);
    ASSERT_TRUE(s) << reason;
    EXPECT_EQ(s->reason, reason);
    EXPECT_NEAR(s->value, value, 1e-12);
  };
  expect_stop({.conditioncov = 8.9}, "conditioncov", 9);
  EXPECT_FALSE(stop({.conditioncov = 9.1}, lengths, 0));
  expect_stop({.tolxup = 2.9}, "tolxup", 3);
  EXPECT_FALSE(stop({.tolxup = 3.1}, lengths, 0));
  expect_stop({.tolx = 3.1}, "tolx", 3);
  EXPECT_FALSE(stop({.tolx = 2.9}, lengths, 0));
  // A step of a tenth is lost beside 10^8 once an axis is shorter than 10^-7.
  const CmaTermination coordinate{.tolx = 0, .noeffectaxis = false};
  const CmaTermination axis{.tolx = 0, .noeffectcoord = false};
  for (const CmaTermination& t : {coordinate, axis}) {
    const std::optional<Stop> s = stop(t, VectorXd::Constant(3, 1e-9), 1e8);
    ASSERT_TRUE(s);
    EXPECT_EQ(s->reason, t.noeffectaxis ? "noeffectaxis" : "noeffectcoord");
    EXPECT_FALSE(stop(t, VectorXd::Constant(3, 1e-5), 1e8));
  }
}

TEST(CmaEs, LimitsAreThemselvesAllowed) {
  // Before anything is learned σ/σ₀, every axis and the condition are 1.
  const auto reason = [](CmaTermination t) -> std::string {
    CmaEs cma({.x0 = VectorXd::Zero(3), .sigma = 0.25, .termination = t});
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.failed = true});
    return cma.stopped() ? cma.stopped()->reason : "";
  };
  EXPECT_EQ(reason({.tolx = 1}), "");
  EXPECT_EQ(reason({.tolx = 1.01}), "tolx");
  EXPECT_EQ(reason({.tolxup = 1}), "");
  EXPECT_EQ(reason({.tolxup = 0.99}), "tolxup");
  EXPECT_EQ(reason({.tolupsigma = 1}), "");
  EXPECT_EQ(reason({.tolupsigma = 0.99}), "tolupsigma");
  EXPECT_EQ(reason({.conditioncov = 1}), "");
  EXPECT_EQ(reason({.conditioncov = 0.99}), "conditioncov");
  EXPECT_EQ(reason({.tolallfailed = 2}), "");
  EXPECT_EQ(reason({.tolallfailed = 1}), "tolallfailed");
  EXPECT_EQ(reason({.maxiter = 2}), "");
  EXPECT_EQ(reason({.maxiter = 1}), "maxiter");
}

TEST(CmaEs, RaisesEigenvaluesThatAreNoiseOfRounding) {
  // One axis of C is too short for doubles; T is not to take it over.
  CmaEs cma({.x0 = VectorXd::Ones(2),
             .sigma = 0.5,
             .active = false,
             .termination = {.conditioncov = 1e13}});
  std::string state = cma.save();
  StateReader r(state, "cma-es", 4);
  StateWriter w("cma-es", 4);
  for (int i = 0; i < 5; ++i) w.integer(r.integer());
  w.integer(r.integer());
  for (int i = 0; i < 6; ++i) {
    std::vector<double> v;
    r.reals(v);
    if (i == 1) v[1] = 1e-12;  // D
    if (i == 4) v[3] = 1e-24;  // C
    w.reals(v);
  }
  const size_t before = 8 + 8 + 6 + 8 + 8 * (6 + 4 * 3 + 2 * 5);
  for (size_t at = before; at + 8 < state.size(); at += 8) w.integer(r.integer());
  cma.restore(w.finish());
  step(cma, [](auto& x) { return Evaluation{.cost = x[0]}; });
  const CmaState& s = cma.state();
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  EXPECT_DOUBLE_EQ(s.D.minCoeff() / s.D.maxCoeff(), std::sqrt(epsilon));
  EXPECT_NEAR(s.C(1, 1) / s.C(0, 0) / epsilon, 1, 1e-3);
  EXPECT_GT(s.condition, 1e23);
  EXPECT_EQ(s.lengths.size(), 0);
  ASSERT_TRUE(cma.stopped());
  EXPECT_EQ(cma.stopped()->reason, "conditioncov");
}

TEST(CmaEs, TakesTheLikeliestOrTheLastOfManyRefusedDraws) {
  for (const bool likeliest : {true, false}) {
    std::vector<std::vector<VectorXd>> drawn(4);
    const auto remember = [&](int k, const VectorXd& x) {
      drawn[k].push_back(x);
      return 1e-12 / (1 + x.squaredNorm());
    };
    CmaEs cma({.x0 = VectorXd::Zero(2),
               .sigma = 1,
               .lambda = 4,
               .acceptance = remember,
               .max_draws = 5,
               .likeliest = likeliest});
    VectorXd mean = VectorXd::Zero(2);
    for (const Candidate& c : cma.ask()) {
      const std::vector<VectorXd>& all = drawn[c.id];
      ASSERT_EQ(all.size(), 5u);
      const auto nearest = std::min_element(all.begin(), all.end(),
                                            [](auto& a, auto& b) { return a.norm() < b.norm(); });
      EXPECT_EQ(c.x, likeliest ? *nearest : all.back());
      if (c.id < 2) mean += cma.constants().weights[static_cast<int>(c.id)] * c.x;
    }
    // What is learned is what was taken; for C = I a step of y is one of z.
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = static_cast<double>(c.id)});
    EXPECT_LT((cma.mean() - mean).norm(), 1e-14);
    const CmaConstants& k = cma.constants();
    const double factor = std::sqrt(k.c_sigma * (2 - k.c_sigma) * k.mu_eff);
    EXPECT_LT((cma.state().p_sigma - factor * mean).norm(), 1e-14);
    EXPECT_EQ(cma.state().refused, 20u);
    step(cma, [](auto& x) { return Evaluation{.cost = x[0]}; });
    EXPECT_EQ(cma.state().refused, 40u);
  }
}

TEST(CmaEs, SaysWhatCannotBeUsedOrTold) {
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  const auto made = [&](const CmaTermination& t) {
    return message([&] { CmaEs({.x0 = VectorXd::Zero(3), .termination = t}); });
  };
  EXPECT_EQ(made({.tolx = -1}), "cma-es: expected tolx ≥ 0, got -1");
  EXPECT_EQ(made({.tolfun = -1}), "cma-es: expected tolfun ≥ 0, got -1");
  EXPECT_EQ(made({.tolfunhist = -1}), "cma-es: expected tolfunhist ≥ 0, got -1");
  EXPECT_EQ(made({.tolflatfitness = -1}), "cma-es: expected tolflatfitness ≥ 0, got -1");
  EXPECT_EQ(made({.tolxup = -1}), "cma-es: expected tolxup ≥ 0, got -1");
  EXPECT_EQ(made({.tolupsigma = -1}), "cma-es: expected tolupsigma ≥ 0, got -1");
  EXPECT_EQ(made({.conditioncov = -1}), "cma-es: expected conditioncov ≥ 0, got -1");
  EXPECT_EQ(made({.tolstagnation = -1}), "cma-es: expected tolstagnation ≥ 0, got -1");
  EXPECT_EQ(made({.maxiter = -1}), "cma-es: expected maxiter ≥ 0, got -1");
  EXPECT_EQ(made({.tolallfailed = -1}), "cma-es: expected tolallfailed ≥ 0, got -1");
  const auto lambda = [&](int count) {
    return message([&] { CmaEs({.x0 = VectorXd::Zero(1), .lambda = count}); });
  };
  EXPECT_EQ(lambda(2), "");
  EXPECT_EQ(lambda(kMaxLambda), "");
  EXPECT_EQ(lambda(kMaxLambda + 1),
            "cma-es: expected lambda in [2, 1000000], or 0 for the default, got 1000001");
  EXPECT_EQ(message([] { CmaEs({.x0 = VectorXd::Zero(1), .max_draws = 1}); }), "");

  CmaEs cma({.x0 = VectorXd::Zero(3), .lambda = 4});
  const auto tell = [&](std::uint64_t id) { return message([&] { cma.tell(id, {.cost = 1}); }); };
  EXPECT_EQ(tell(4), "cma-es: no candidate 4 in generation 0, which has 0 to 3");
  for (std::uint64_t id = 0; id < 4; ++id) EXPECT_EQ(tell(id), "");
  EXPECT_EQ(tell(3), "cma-es: no candidate 3 in generation 1, which has 4 to 7");
  EXPECT_EQ(tell(8), "cma-es: no candidate 8 in generation 1, which has 4 to 7");
  EXPECT_EQ(tell(7), "");
  EXPECT_EQ(tell(7), "cma-es: candidate 7 has been told already");
}

}  // namespace
}  // namespace traceur::optim
