#include "traceur/optim/contextual_cma.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>

#include "tests/contract/crafted_state.h"
#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/minimise.h"

namespace traceur::optim {
namespace {

/// ‖x - c(w)‖² with c on a straight segment, or on a parabola.
class Moving : public Problem {
 public:
  Moving(int n, int tasks, bool bent) : n_(n), tasks_(tasks), bent_(bent) {}
  VectorXd lower() const override { return VectorXd::Constant(n_, -1); }
  VectorXd upper() const override { return VectorXd::Constant(n_, 1); }
  VectorXd tasks() const override { return VectorXd::LinSpaced(tasks_, 3, 8); }
  virtual VectorXd optimum(double w) const {
    VectorXd c = VectorXd::LinSpaced(n_, -0.4, 0.4) * (1 - w);
    if (bent_) c[0] += 0.6 * w * w;
    return c;
  }
  Evaluation evaluate(const VectorXd& x) const override {
    Evaluation e{.cost = 0};
    for (int i = 0; i < tasks_; ++i) {
      e.task_costs.push_back((x - optimum(i / (tasks_ - 1.0))).squaredNorm());
      e.cost += e.task_costs.back() / tasks_;
    }
    return e;
  }

 private:
  int n_, tasks_;
  bool bent_;
};

std::unique_ptr<Optimizer> made(const Problem& p, const CommonOptions& o = {}) {
  return makeContextualCma(p, o);
}

/// The equations of the header, in loops and without bounds.
struct TextbookContextual {
  int n, K;
  std::uint64_t memory;  // generations of elites
  VectorXd w;            // (M)
  MatrixXd A, C, p_sigma, p_c;
  double sigma;
  int updates = 0;
  std::vector<ContextualCmaState::Elite> elites = {};
  int stalled = 0;  // generations with h_σ = 0
  int served = 0;   // tasks that had an elite

  TextbookContextual(const VectorXd& x0, double s, int k, std::uint64_t generations,
                     VectorXd positions)
      : n(static_cast<int>(x0.size())),
        K(k),
        memory(generations),
        w(std::move(positions)),
        A(x0.replicate(1, K)),
        C(MatrixXd::Identity(n, n)),
        p_sigma(MatrixXd::Zero(n, K)),
        p_c(p_sigma),
        sigma(s) {}

  /// The integral of -ln 2u from a to b, of its positive (sign 1) or negative part.
  static double logarithm(double a, double b, int sign) {
    const auto whole = [](double u) { return u > 0 ? u - u * std::log(2 * u) : 0; };
    const auto in = [&](double u) { return sign > 0 ? std::min(u, 0.5) : std::max(u, 0.5); };
    return whole(in(b)) - whole(in(a));
  }

  /// @param sampled  (n x λ)
  /// @param known    costs, (M x λ), NaN where there is none
  void learn(std::uint64_t generation, const MatrixXd& sampled, const MatrixXd& known) {
    const auto M = static_cast<int>(w.size());
    const MatrixXd inverse = C.inverse();
    std::vector<VectorXd> phi;
    for (const double at : w) phi.push_back(bernstein(K, at));
    const auto y = [&](const VectorXd& x, int i) { return VectorXd((x - A * phi[i]) / sigma); };
    const auto squared = [&](const VectorXd& x, int i) { return y(x, i).dot(inverse * y(x, i)); };

    std::vector<VectorXd> x;
    std::vector<VectorXd> cost;
    std::vector<VectorXd> r;
    for (int k = 0; k < sampled.cols(); ++k) {
      x.push_back(sampled.col(k));
      cost.push_back(known.col(k));
      VectorXd p(M);
      for (int i = 0; i < M; ++i) p[i] = std::exp(-squared(x[k], i) / 2);
      r.push_back(p / p.mean());
    }
    std::vector<const ContextualCmaState::Elite*> taken;
    for (int i = 0; i < M; ++i) {
      const ContextualCmaState::Elite* best = nullptr;
      for (const auto& e : elites) {
        if (!std::isnan(e.costs[i]) && (!best || e.costs[i] < best->costs[i])) best = &e;
      }
      if (!best || squared(best->x, i) > std::pow(std::sqrt(n) + 2.0 * n / (n + 2), 2)) continue;
      size_t at = std::find(taken.begin(), taken.end(), best) - taken.begin();
      if (at == taken.size()) {
        taken.push_back(best);
        x.push_back(best->x);
        cost.push_back(Eigen::Map<const VectorXd>(best->costs.data(), M));
        r.push_back(VectorXd::Zero(M));
      }
      r[sampled.cols() + at][i] = 1;
      ++served;
    }
    const auto lambda = static_cast<int>(x.size());

    MatrixXd W = MatrixXd::Zero(M, lambda);
    MatrixXd below = W;
    VectorXd h = VectorXd::Zero(M);
    for (int i = 0; i < M; ++i) {
      std::vector<int> rank(lambda);
      std::iota(rank.begin(), rank.end(), 0);
      const auto order = [&](int k) { return std::isnan(cost[k][i]) ? INFINITY : cost[k][i]; };
      std::stable_sort(rank.begin(), rank.end(), [&](int a, int b) { return order(a) < order(b); });
      double meaningful = 0, all = 0;
      for (int k = 0; k < lambda; ++k) {
        all += r[k][i];
        if (!std::isnan(cost[k][i])) meaningful += r[k][i];
      }
      double u = 0;
      for (const int k : rank) {
        const double end = u + r[k][i];
        if (!std::isnan(cost[k][i])) W(i, k) = logarithm(u / meaningful, end / meaningful, 1);
        below(i, k) = logarithm(u / all, end / all, -1);
        u = end;
      }
      W.row(i) /= W.row(i).sum();
      below.row(i) /= -below.row(i).sum();
      h[i] = std::min(1.0, meaningful / (lambda / 2.0));
    }
    h /= h.sum();

    MatrixXd G = MatrixXd::Zero(K, K);
    MatrixXd moved = MatrixXd::Zero(n, K);
    MatrixXd shared = MatrixXd::Zero(K, K);  // Φ S Φᵀ
    double pooled = 0, pooled_below = 0;
    for (int i = 0; i < M; ++i) {
      G += h[i] * phi[i] * phi[i].transpose();
      VectorXd delta = -A * phi[i];
      for (int k = 0; k < lambda; ++k) delta += W(i, k) * x[k];
      moved += h[i] * delta * phi[i].transpose();
      for (int j = 0; j < M; ++j) {
        const double S = h[i] * h[j] * W.row(i).dot(W.row(j));
        shared += S * phi[i] * phi[j].transpose();
        pooled += S;
        pooled_below += h[i] * h[j] * below.row(i).dot(below.row(j));
      }
    }
    G += 1e-8 * G.trace() * MatrixXd::Identity(K, K);
    const MatrixXd delta_A = moved * G.inverse();
    const double mu_w = K / (G.inverse() * shared).trace();
    const double mu = 1 / pooled;
    const double N = n * K;
    const double c_sigma = (mu_w + 2) / (n + mu_w + 3);
    const double d_sigma = 1 + 2 * std::max(0.0, std::sqrt((mu_w - 1) / (N + 1)) - 1) + c_sigma;
    const double chi = std::sqrt(N) * (1 - 1 / (4 * N) + 1 / (21 * N * N));
    const double c_c = (4 + mu / n) / (n + 4 + 2 * mu / n);
    const double c_1 = 2 / (std::pow(n + 1.3, 2) + mu);
    const double c_mu = std::min(1 - c_1, 2 * (mu + 1 / mu - 1.75) / (std::pow(n + 2, 2) + mu));

    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(C);
    const MatrixXd step = delta_A * MatrixXd(G.llt().matrixL()) / sigma;
    ++updates;
    p_sigma = (1 - c_sigma) * p_sigma +
              std::sqrt(c_sigma * (2 - c_sigma) * mu_w) * eigen.operatorInverseSqrt() * step;
    const bool moves = p_sigma.norm() / std::sqrt(1 - std::pow(1 - c_sigma, 2 * updates)) <
                       (1.4 + 2 / (N + 1)) * chi;
    stalled += !moves;
    p_c = (1 - c_c) * p_c + (moves ? std::sqrt(c_c * (2 - c_c) * mu_w) : 0) * step;
    const double alpha =
        std::min({1 + c_1 / c_mu, 1 + 2 / pooled_below / (mu + 2), (1 - c_1 - c_mu) / (n * c_mu)});
    MatrixXd learned = MatrixXd::Zero(n, n);
    double sum = 0;
    for (int i = 0; i < M; ++i) {
      for (int k = 0; k < lambda; ++k) {
        const double failed = std::isnan(cost[k][i]) ? kWeightOfFailure : 1;
        const double low = alpha * failed * below(i, k);
        sum += h[i] * (W(i, k) + low);
        learned +=
            h[i] * (W(i, k) + low * n / squared(x[k], i)) * y(x[k], i) * y(x[k], i).transpose();
      }
    }
    A += delta_A;
    C = (1 + (moves ? 0 : c_1 * c_c * (2 - c_c)) - c_1 - c_mu * sum) * C +
        c_1 / K * p_c * p_c.transpose() + c_mu * learned;
    sigma *= std::exp(std::min(1.0, c_sigma / d_sigma * (p_sigma.norm() / chi - 1)));

    std::erase_if(elites, [&](const auto& e) { return generation - e.generation >= memory; });
    std::vector<int> best;
    for (int i = 0; memory > 0 && i < M; ++i) {
      int of = -1;
      for (int k = 0; k < sampled.cols(); ++k) {
        if (!std::isnan(known(i, k)) && (of < 0 || known(i, k) < known(i, of))) of = k;
      }
      if (of < 0 || std::find(best.begin(), best.end(), of) != best.end()) continue;
      best.push_back(of);
      elites.push_back({generation, sampled.col(of), {known.col(of).begin(), known.col(of).end()}});
    }
  }
};

TEST(ContextualCma, UpdatesAsItsEquationsSay) {
  struct Case {
    const char* what;
    int n, K, memory;
    double sigma;
    bool fails;
  };
  for (const Case& c :
       std::initializer_list<Case>{{"line", 4, 2, 0, 0.3, false},
                                   {"point", 3, 1, 0, 0.3, false},
                                   {"cubic", 3, 4, 0, 0.3, false},
                                   {"small step, so that h_sigma stalls", 4, 2, 0, 1e-3, false},
                                   {"failures", 4, 2, 0, 0.3, true},
                                   {"elites", 4, 2, 3, 0.3, false},
                                   {"elites among failures", 4, 2, 2, 0.3, true}}) {
    SCOPED_TRACE(c.what);
    VectorXd tasks(4);
    tasks << 1, 2, 4, 5;
    const VectorXd x0 = VectorXd::LinSpaced(c.n, 1, 2);
    // As many samples as make a generation be about all four tasks, and no curves.
    ContextualCma cma({.tasks = tasks,
                       .x0 = x0,
                       .sigma = c.sigma,
                       .control_points = c.K,
                       .lambda = 24,
                       .curve_share = 1e-6,
                       .elite_generations = c.memory,
                       .tolx = 0,
                       .tolstagnation = 0});
    TextbookContextual book(x0, c.sigma, c.K, c.memory, (tasks.array() - 1) / 4);
    for (std::uint64_t g = 0; g < 30; ++g) {
      const std::vector<Candidate> candidates = cma.ask();
      ASSERT_EQ(candidates.size(), 24U);
      MatrixXd X(c.n, 24);
      MatrixXd costs(4, 24);
      for (int k = 0; k < 24; ++k) {
        const VectorXd& x = candidates[k].x;
        X.col(k) = x;
        Evaluation e{.cost = 0};
        e.failed = c.fails && std::sin(1e4 * x[0]) > 0.5;
        for (int i = 0; i < 4; ++i) {
          double cost = 0;
          for (int j = 0; j < c.n; ++j) {
            cost += std::pow(10, j) * std::pow(x[j] - 0.3 * tasks[i] * (j - 1), 2);
          }
          e.task_costs.push_back(cost);
          e.cost += cost / 4;
          costs(i, k) = e.failed ? NAN : cost;
        }
        cma.tell(candidates[k].id, e);
      }
      book.learn(g, X, costs);
      const ContextualCmaState& s = cma.state();
      ASSERT_LE((s.A - book.A).norm(), 1e-7 * (1 + book.A.norm())) << g;
      ASSERT_NEAR(s.sigma, book.sigma, 1e-7 * book.sigma) << g;
      ASSERT_LE((s.C - book.C).norm(), 1e-6 * book.C.norm()) << g;
      ASSERT_LE((s.p_sigma - book.p_sigma).norm(), 1e-6) << g;
      ASSERT_LE((s.p_c - book.p_c).norm(), 1e-6) << g;
      ASSERT_EQ(s.elites.size(), book.elites.size()) << g;
    }
    EXPECT_EQ(book.served > 0, c.memory > 0);
    if (c.sigma < 0.01) {
      EXPECT_GT(book.stalled, 2);
    }
  }
}

TEST(ContextualCma, FindsAMovingOptimumBetweenTheTasksToo) {
  const Moving problem(5, 6, false);
  const auto optimizer = made(problem);
  const Summary s = minimise(problem, *optimizer, {.budget = 4000, .target = 1e-8});
  ASSERT_EQ(s.end, End::kTarget);
  for (double w = 0; w <= 1; w += 0.05) {
    EXPECT_LT((optimizer->family()->curve.at(w) - problem.optimum(w)).norm(), 1e-3) << w;
  }
}

TEST(ContextualCma, ACubicFollowsWhatALineCannot) {
  const Moving problem(4, 6, true);
  const auto line = made(problem);
  const auto cubic = made(problem, {.control_points = 4});
  minimise(problem, *line, {.budget = 4000});
  minimise(problem, *cubic, {.budget = 4000});
  EXPECT_GT(line->family()->cost, 1e-4);
  EXPECT_LT(cubic->family()->cost, 1e-6);
}

TEST(ContextualCma, ReportsOnlyMeasuredCosts) {
  const Moving problem(3, 6, false);
  const auto optimizer = made(problem);
  EXPECT_FALSE(optimizer->family());
  minimise(problem, *optimizer, {.budget = 400});
  const Family best = *optimizer->family();
  double mean = 0;
  for (int i = 0; i < 6; ++i) {
    const Evaluation e = problem.evaluate(best.curve.at(i / 5.0));
    EXPECT_DOUBLE_EQ(e.task_costs[i], best.task_costs[i]);
    mean += e.task_costs[i] / 6;
  }
  EXPECT_NEAR(best.cost, mean, 1e-15);
}

TEST(ContextualCma, MoreTasksCostHardlyMore) {
  const auto trials = [](int tasks) {
    int total = 0;
    for (std::uint64_t seed = 1; seed <= 9; ++seed) {
      const Moving problem(6, tasks, false);
      const auto optimizer = made(problem, {.seed = seed});
      const Summary s = minimise(problem, *optimizer, {.budget = 20000, .target = 1e-6});
      EXPECT_EQ(s.end, End::kTarget);
      total += s.progress.evaluations;
    }
    return total;
  };
  EXPECT_LT(trials(21), 1.2 * trials(6));
}

TEST(ContextualCma, StaysInsideTheBoxWhenTheOptimumLeavesIt) {
  class Outside : public Moving {
   public:
    Outside() : Moving(2, 3, false) {}
    Evaluation evaluate(const VectorXd& x) const override {
      EXPECT_TRUE((x.array().abs() <= 1).all()) << x.transpose();
      Evaluation e{.cost = 0};
      for (int i = 0; i < 3; ++i) e.task_costs.push_back((x.array() - 2).square().sum() + i * x[0]);
      return e;
    }
  };
  const Outside problem;
  const auto optimizer = made(problem);
  minimise(problem, *optimizer, {.budget = 2000});
  for (const double w : {0.0, 0.5, 1.0}) {
    EXPECT_NEAR(optimizer->family()->curve.at(w)[1], 1, 1e-3);
  }
}

/// Optima near the bounds, half of the variables nearer to them with every task.
class NearBounds : public Moving {
 public:
  /// @param nearest  of the first task to a bound of ±1, above or not at all
  explicit NearBounds(double nearest, bool above = true)
      : Moving(6, 6, false), nearest_(nearest), above_(above) {}
  VectorXd upper() const override {
    if (above_) return VectorXd::Ones(6);
    return VectorXd::Constant(6, std::numeric_limits<double>::infinity());
  }
  VectorXd optimum(double w) const override {
    VectorXd c = VectorXd::LinSpaced(6, -nearest_, nearest_);
    c.tail(3).array() -= 0.2 * w;
    return c;
  }

 private:
  double nearest_;
  bool above_;
};

TEST(ContextualCma, IsNotCaughtWithOneEndBeyondTheBoundAndItsMirrorImageInside) {
  // An end of the line that has gone through a bound is handed out folded back, where it is right
  // by itself and wrong with the other end.
  for (const bool above : {true, false}) {
    for (const int control_points : {2, 4}) {
      const NearBounds problem(0.9, above);
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const auto optimizer = made(
            problem, {.seed = seed, .control_points = control_points, .x0 = VectorXd::Zero(6)});
        const Summary s = minimise(problem, *optimizer,
                                   {.budget = control_points == 2 ? 1500 : 8000, .target = 1e-3});
        EXPECT_EQ(s.end, End::kTarget) << above << control_points << " seed " << seed;
      }
    }
  }
}

TEST(ContextualCma, RemembersSamplesOnTheCurvesSideOfABound) {
  // So near that searches cross the bounds; what is remembered from there must not pull out.
  const NearBounds problem(0.972);
  int trials = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto optimizer = made(problem, {.seed = seed, .sigma = 0.2, .x0 = VectorXd::Zero(6)});
    trials += minimise(problem, *optimizer, {.budget = 8000, .target = 0.02}).progress.evaluations;
  }
  EXPECT_LT(trials / 40, 465);  // 434; without images 526
}

TEST(ContextualCma, GoesWhereALuckySampleWas) {
  // All around fall, a little cheaper the farther from where none would: as jumps that do not land.
  class Ledge : public Moving {
   public:
    Ledge() : Moving(6, 6, false) {}
    Evaluation evaluate(const VectorXd& x) const override {
      Evaluation e{.cost = 0};
      const double away = (x.tail(5).array() - 0.25).matrix().norm();
      const double rest = away < 0.4
                              ? 0.1 * away * away
                              : 0.3 + 0.05 * (x.tail(5).array() + 0.25).matrix().squaredNorm();
      for (int i = 0; i < 6; ++i) {
        e.task_costs.push_back(std::pow(x[0] - 0.1 * i, 2) + rest);
        e.cost += e.task_costs.back() / 6;
      }
      return e;
    }
  };
  const Ledge problem;
  const auto reached = [&](int generations) {
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      ContextualCma optimizer({.tasks = problem.tasks(),
                               .x0 = VectorXd::Zero(6),
                               .sigma = 0.2,
                               .scale = VectorXd::Constant(6, 2),
                               .lower = problem.lower(),
                               .upper = problem.upper(),
                               .seed = seed,
                               .elite_generations = generations});
      count += minimise(problem, optimizer, {.budget = 2500, .target = 1e-3}).end == End::kTarget;
    }
    return count;
  };
  EXPECT_LE(reached(0), 4);
  EXPECT_GE(reached(5), 10);
}

TEST(ContextualCma, ALuckySampleTeachesEveryTaskItIsTheBestOf) {
  ContextualCma optimizer({.tasks = VectorXd::LinSpaced(2, 0, 1),
                           .x0 = VectorXd::Zero(3),
                           .scale = VectorXd::Ones(3),
                           .lambda = 4});
  const auto tell_all = [&](auto cost) {
    const std::vector<Candidate> asked = optimizer.ask();
    ASSERT_EQ(asked.size(), 4u);
    for (size_t k = 0; k < 4; ++k) {
      const double c = cost(k);
      optimizer.tell(asked[k].id, {.cost = c, .task_costs = {c, c}});
    }
  };
  const VectorXd lucky = optimizer.ask()[0].x;
  tell_all([](size_t k) { return k == 0 ? 0.0 : 1.0; });
  tell_all([](size_t k) { return k == 0 ? 2.0 : NAN; });  // nothing better than what is remembered
  for (const auto& point : optimizer.state().A.colwise()) {
    EXPECT_LT((point - lucky).norm(), 1e-6) << optimizer.state().A;
  }
}

TEST(ContextualCma, LearnsFromTheOneSampleThatDoesNotFail) {
  ContextualCma optimizer({.tasks = VectorXd::LinSpaced(2, 0, 1),
                           .x0 = VectorXd::Zero(3),
                           .scale = VectorXd::Ones(3),
                           .lambda = 4});
  const std::vector<Candidate> asked = optimizer.ask();
  for (size_t k = 0; k < 4; ++k) {
    const double c = k == 2 ? 1.0 : NAN;
    optimizer.tell(asked[k].id, {.cost = c, .task_costs = {c, c}});
  }
  for (const auto& point : optimizer.state().A.colwise()) {
    EXPECT_LT((point - asked[2].x).norm(), 1e-6) << optimizer.state().A;
  }
}

TEST(ContextualCma, BeginsAnewWithMoreSamplesWhereItIsStuck) {
  /// A wide basin with a floor of 1 and a narrow one that leads to 0.
  class Trap : public Moving {
   public:
    Trap() : Moving(2, 3, false) {}
    Evaluation evaluate(const VectorXd& x) const override {
      const double wide = 1 + (x.array() - 0.5).square().sum();
      const double narrow = 20 * (x.array() + 0.6).square().sum();
      Evaluation e{.cost = std::min(wide, narrow)};
      e.task_costs.assign(3, e.cost);
      return e;
    }
  };
  const Trap problem;
  int reached = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ContextualCma optimizer({.tasks = problem.tasks(),
                             .x0 = VectorXd::Constant(2, 0.5),
                             .sigma = 0.1,
                             .lower = problem.lower(),
                             .upper = problem.upper(),
                             .seed = seed});
    const Summary s = minimise(problem, optimizer, {.budget = 20000, .target = 1e-3});
    reached += s.end == End::kTarget;
    EXPECT_EQ(optimizer.state().lambda, 32 << optimizer.state().restarts);
  }
  EXPECT_GE(reached, 4);
}

/// Runs until it begins anew for the first time, its last generation by another that was restored.
void untilRestart(const Problem& problem, ContextualCma* optimizer) {
  ContextualCma resumed(optimizer->options());
  for (int generation = 0; generation < 1000 && optimizer->state().restarts == 0; ++generation) {
    resumed.restore(optimizer->save());
    for (const Candidate& c : optimizer->ask()) {
      const Evaluation e = problem.evaluate(c.x);
      optimizer->tell(c.id, e);
      resumed.tell(c.id, e);
    }
  }
  ASSERT_EQ(optimizer->state().restarts, 1);
  ASSERT_TRUE(optimizer->family());
  EXPECT_EQ(resumed.save(), optimizer->save());
}

TEST(ContextualCma, BeginsAnewAboutItsBestCurveOnlyWhereCostsAreRough) {
  /// A floor at a height, smooth, or so rough that neighbours differ by up to a half.
  class Floor : public Moving {
   public:
    Floor(double height, double roughness)
        : Moving(4, 3, false), height_(height), roughness_(roughness) {}
    Evaluation evaluate(const VectorXd& x) const override {
      Evaluation e = Moving::evaluate(x);
      for (double& cost : e.task_costs) cost += height_ + roughness_ * std::sin(1e5 * x.sum());
      return e;
    }

   private:
    double height_, roughness_;
  };
  for (const double height : {1.0, -1.0}) {
    for (const double roughness : {0.0, 0.5}) {
      const Floor problem(height, roughness);
      ContextualCma optimizer({.tasks = problem.tasks(),
                               .x0 = VectorXd::Constant(4, 0.5),
                               .scale = VectorXd::Constant(4, 2),
                               .lower = problem.lower(),
                               .upper = problem.upper()});
      untilRestart(problem, &optimizer);
      const double distance = (2 * optimizer.state().A - optimizer.family()->curve.points).norm();
      if (roughness > 0) {
        EXPECT_LT(distance, 1e-12) << height;
        EXPECT_DOUBLE_EQ(optimizer.state().sigma, 0.2 * optimizer.options().sigma) << height;
      } else {
        EXPECT_GT(distance, 0.1) << height;
        EXPECT_EQ(optimizer.state().sigma, optimizer.options().sigma) << height;
      }
    }
  }
}

TEST(ContextualCma, BeginsAnewWhereNoCurveIsComplete) {
  /// Trials for the last task fail where the others are at their best.
  class Blind : public Moving {
   public:
    Blind() : Moving(2, 3, false) {}
    Evaluation evaluate(const VectorXd& x) const override {
      Evaluation e = Moving::evaluate(x);
      if (x.norm() < 0.3) e.task_costs.back() = NAN;
      e.task_costs[0] = e.task_costs[1] = x.squaredNorm();
      return e;
    }
  };
  const Blind problem;
  ContextualCma optimizer({.tasks = problem.tasks(),
                           .x0 = VectorXd::Zero(2),
                           .lower = problem.lower(),
                           .upper = problem.upper(),
                           .control_points = 1,
                           .tolx = 0});
  minimise(problem, optimizer, {.budget = 4000});
  EXPECT_GT(optimizer.state().restarts, 0);
}

TEST(ContextualCma, ARestartAmongFailuresDoesNotEndASearchThatFoundSomething) {
  /// Nothing but failures around a little ball with a floor.
  class Island : public Moving {
   public:
    Island() : Moving(4, 3, false) {}
    Evaluation evaluate(const VectorXd& x) const override {
      const double c = x.norm() < 0.3 ? 1 + x.squaredNorm() : NAN;
      return {.cost = c, .task_costs = {c, c, c}};
    }
  };
  const Island problem;
  ContextualCma optimizer({.tasks = problem.tasks(),
                           .x0 = VectorXd::Zero(4),
                           .sigma = 0.1,
                           .lower = problem.lower(),
                           .upper = problem.upper()});
  const Summary s = minimise(problem, optimizer, {.budget = 8000});
  EXPECT_TRUE(optimizer.family());
  EXPECT_EQ(s.end, End::kBudget);
  EXPECT_GE(optimizer.state().restarts, 2);
}

TEST(ContextualCma, SaysWhyItStoppedWhenRestartsAreSpent) {
  const Moving problem(2, 3, false);
  ContextualCma optimizer({.tasks = problem.tasks(), .x0 = VectorXd::Zero(2), .max_restarts = 0});
  const Summary s = minimise(problem, optimizer, {.budget = 100000});
  EXPECT_EQ(s.end, End::kOptimizer);
  EXPECT_EQ(s.stop.reason, "tolx");
  EXPECT_LT(s.stop.value, s.stop.limit);
}

TEST(ContextualCma, OptionsEndWhereTheySay) {
  using Change = std::function<void(ContextualCmaOptions&)>;
  const auto made = [](const Change& change) {
    ContextualCmaOptions o{.tasks = VectorXd::LinSpaced(3, 0, 1), .x0 = VectorXd::Zero(8)};
    change(o);
    return ContextualCma(o).options();
  };
  EXPECT_EQ(made([](auto&) {}).lambda, 32);
  EXPECT_EQ(made([](auto&) {}).stagnation_curves, 5 + 8 / 4);
  const std::vector<Change> last = {[](auto& o) { o.lambda = 4; },
                                    [](auto& o) { o.curve_share = 1e-9; },
                                    [](auto& o) { o.curve_share = 0.999; },
                                    [](auto& o) { o.stagnation_curves = 1; },
                                    [](auto& o) { o.elite_generations = 0; },
                                    [](auto& o) { o.tolstagnation = 0; },
                                    [](auto& o) { o.tolx = 0; },
                                    [](auto& o) { o.max_restarts = 0; },
                                    [](auto& o) { o.lambda_factor = 1; },
                                    [](auto& o) { o.control_points = 1; },
                                    [](auto& o) { o.control_points = 3; }};
  for (size_t i = 0; i < last.size(); ++i) EXPECT_NO_THROW(made(last[i])) << i;
  const std::vector<Change> beyond = {[](auto& o) { o.lambda = 3; },
                                      [](auto& o) { o.lambda = -1; },
                                      [](auto& o) { o.lambda = kMaxLambda + 1; },
                                      [](auto& o) { o.curve_share = 0; },
                                      [](auto& o) { o.curve_share = 1; },
                                      [](auto& o) { o.curve_share = NAN; },
                                      [](auto& o) { o.stagnation_curves = -1; },
                                      [](auto& o) { o.elite_generations = -1; },
                                      [](auto& o) { o.tolstagnation = -1e-9; },
                                      [](auto& o) { o.tolstagnation = NAN; },
                                      [](auto& o) { o.tolx = -1e-9; },
                                      [](auto& o) { o.tolx = NAN; },
                                      [](auto& o) { o.max_restarts = -1; },
                                      [](auto& o) { o.lambda_factor = 0.999; },
                                      [](auto& o) { o.lambda_factor = NAN; },
                                      [](auto& o) { o.control_points = 0; },
                                      [](auto& o) { o.control_points = 4; }};
  for (size_t i = 0; i < beyond.size(); ++i) EXPECT_THROW(made(beyond[i]), InputError) << i;
}

TEST(ContextualCma, RefusesWhatCannotBeUsed) {
  const VectorXd x0 = VectorXd::Zero(2);
  const VectorXd tasks = VectorXd::LinSpaced(3, 0, 1);
  EXPECT_THROW(ContextualCma({.tasks = {}, .x0 = x0}), InputError);
  EXPECT_THROW(ContextualCma({.tasks = VectorXd::Zero(3), .x0 = x0}), InputError);
  EXPECT_THROW(ContextualCma({.tasks = tasks, .x0 = x0, .control_points = 4}), InputError);
  EXPECT_THROW(ContextualCma({.tasks = tasks, .x0 = x0, .lambda = 3}), InputError);
  ContextualCma optimizer({.tasks = tasks, .x0 = x0});
  EXPECT_THROW(optimizer.tell(optimizer.ask()[0].id, {.cost = 1, .task_costs = {1, 2}}),
               InputError);
}

/// Where the numbers of a state with n = K = 1 stand.
constexpr size_t kGenerationAt = 8 + 8 + 10 + 8 + 3 * 8;
constexpr size_t kSigmaAt = kGenerationAt + 8 * 8;
constexpr size_t kPointsAt = kSigmaAt + 2 * 8;
constexpr size_t kCostsAt = kPointsAt + 8 * 8;

std::string withNumber(const std::string& state, size_t at, double number) {
  return withWord(state, at, std::bit_cast<std::uint64_t>(number));
}

TEST(ContextualCma, AGenerationIsAboutOneTaskOfEachStretch) {
  // So narrow about a line from 0 to 39 that a sample tells the task it is drawn for.
  ContextualCma cma({.tasks = VectorXd::LinSpaced(40, 0, 39), .x0 = VectorXd::Zero(1)});
  std::string state = withNumber(cma.save(), kSigmaAt, 1e-9);
  state = withNumber(state, kPointsAt + 8, 39);
  std::set<int> seen;
  std::vector<int> first(6, 0), twice(6, 0);  // how often a stretch is
  for (std::uint64_t g = 0; g < 200; ++g) {
    cma.restore(withWord(state, kGenerationAt, g));
    const std::vector<Candidate> candidates = cma.ask();
    ASSERT_EQ(candidates.size(), 32u);
    std::vector<int> tasks;
    for (const Candidate& c : candidates) {
      tasks.push_back(static_cast<int>(std::lround(c.x[0])));
      EXPECT_NEAR(c.x[0], tasks.back(), 1e-6);
      EXPECT_EQ(tasks.back(), tasks[(tasks.size() - 1) % 6]);
    }
    const std::set<int> anchors(tasks.begin(), tasks.end());
    ASSERT_EQ(anchors.size(), 6u);
    int stretch = 0;
    for (const int anchor : anchors) {
      EXPECT_GE(anchor, stretch * 40 / 6);
      EXPECT_LT(anchor, (stretch + 1) * 40 / 6);
      const auto samples = std::count(tasks.begin(), tasks.end(), anchor);
      EXPECT_TRUE(samples == 5 || samples == 6);
      twice[stretch] += samples == 6;
      first[stretch] += tasks[0] == anchor;
      ++stretch;
      seen.insert(anchor);
    }
  }
  EXPECT_EQ(seen.size(), 40u);
  for (int stretch = 0; stretch < 6; ++stretch) {  // 1 in 6, and 2 in 6
    EXPECT_GT(first[stretch], 15);
    EXPECT_LT(first[stretch], 55);
    EXPECT_GT(twice[stretch], 42);
    EXPECT_LT(twice[stretch], 92);
  }
  // Never fewer tasks than control points, nor more than there are.
  for (const int K : {1, 3}) {
    ContextualCma few({.tasks = VectorXd::LinSpaced(3, 0, 2),
                       .x0 = VectorXd::Zero(1),
                       .sigma = 1e-9,
                       .control_points = K,
                       .lambda = K == 1 ? 5 : 32});
    std::string bent = few.save();
    for (int k = 0; k < K; ++k) {
      bent = withNumber(bent, kPointsAt + 8 * static_cast<size_t>(k), k);
    }
    few.restore(bent);
    std::set<long> tasks;
    for (const Candidate& c : few.ask()) tasks.insert(std::lround(c.x[0]));
    EXPECT_EQ(tasks.size(), static_cast<size_t>(K));
  }
}

TEST(ContextualCma, SolvesTheSameProblemInAnyUnits) {
  // Scales of powers of two multiply without rounding.
  constexpr double inf = std::numeric_limits<double>::infinity();
  const VectorXd scale{{1, 1024, 0.125, 4}};
  const VectorXd lower{{-1, -inf, -0.3, -inf}};
  const VectorXd upper{{1, 2, inf, inf}};
  const ContextualCmaOptions o{.tasks = VectorXd{{1, 2, 4}},
                               .x0 = VectorXd{{0.5, 1.9, 0, 7}},
                               .sigma = 0.25,
                               .scale = VectorXd::Ones(4),
                               .lower = lower,
                               .upper = upper,
                               .lambda = 12,
                               .seed = 3,
                               .tolx = 0.2,
                               .max_restarts = 3};
  ContextualCmaOptions scaled_options = o;
  for (VectorXd* v :
       {&scaled_options.x0, &scaled_options.scale, &scaled_options.lower, &scaled_options.upper}) {
    *v = v->cwiseProduct(scale);
  }
  ContextualCma plain(o);
  ContextualCma scaled(scaled_options);
  const auto evaluate = [&](const VectorXd& x) {
    Evaluation e{.cost = 0};
    for (const double task : o.tasks) {
      e.task_costs.push_back(
          (x - VectorXd{{0.9 + 0.1 * task, 1.5, -0.2 - 0.1 * task, task}}).squaredNorm());
      e.cost += e.task_costs.back() / 3;
    }
    return e;
  };
  for (int g = 0; g < 150 && !plain.stopped(); ++g) {
    const std::vector<Candidate> a = plain.ask();
    const std::vector<Candidate> b = scaled.ask();
    ASSERT_EQ(a.size(), b.size());
    for (size_t k = 0; k < a.size(); ++k) {
      ASSERT_EQ(a[k].x.cwiseProduct(scale), b[k].x) << g;
      plain.tell(a[k].id, evaluate(a[k].x));
      scaled.tell(b[k].id, evaluate(b[k].x.cwiseQuotient(scale)));
    }
    ASSERT_EQ(plain.state().A, scaled.state().A) << g;
    ASSERT_EQ(plain.state().C, scaled.state().C) << g;
    ASSERT_EQ(plain.state().sigma, scaled.state().sigma) << g;
    if (!plain.family()) continue;
    EXPECT_EQ(plain.family()->curve.at(0.4).cwiseProduct(scale), scaled.family()->curve.at(0.4));
  }
  EXPECT_EQ(plain.state().restarts, 3);
}

TEST(ContextualCma, KeepsToOneSideOfTheMirrors) {
  // The means of all tasks lie between the same two mirrors, or beyond the same single one.
  for (const bool above : {true, false}) {
    for (const int control_points : {2, 4}) {
      for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const NearBounds problem(0.97, above);
        ContextualCma cma({.tasks = problem.tasks(),
                           .x0 = VectorXd::Zero(6),
                           .sigma = 0.5,
                           .lower = problem.lower(),
                           .upper = problem.upper(),
                           .control_points = control_points,
                           .seed = seed});
        const BoundFold fold(problem.lower(), problem.upper(), VectorXd::Constant(6, 0.5));
        MatrixXd Phi(control_points, 6);
        for (int i = 0; i < 6; ++i) Phi.col(i) = bernstein(control_points, i / 5.0);
        for (int g = 0; g < 40; ++g) {
          for (const Candidate& c : cma.ask()) cma.tell(c.id, problem.evaluate(c.x));
          const MatrixXd means = cma.state().A * Phi;
          for (int i = 0; i < 6; ++i) {
            const double low = fold.unfold(i, -1);
            const double cell = above ? fold.unfold(i, 1) - low : 1e9;
            const double turn = std::floor((means(i, 3) - low) / cell);
            EXPECT_GE(means.row(i).minCoeff(), low + turn * cell - 1e-9);
            EXPECT_LE(means.row(i).maxCoeff(), low + (turn + 1) * cell + 1e-9);
          }
        }
      }
    }
  }
}

TEST(ContextualCma, NarrowsTheBoxedVariableAndNothingElse) {
  // As in CmaEs: the first variable's first step is its limit, so that any growth is cut.
  const VectorXd inf = VectorXd::Constant(3, std::numeric_limits<double>::infinity());
  int cut = 0;
  for (const double scale : {1.0, 2.0}) {
    for (const double bound : {1.0, 0.1}) {  // where a third of the box is less, the first step is
      VectorXd lower = -inf;
      VectorXd upper = inf;
      lower[0] = -bound;
      upper[0] = bound;
      for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        ContextualCmaOptions o{.tasks = VectorXd{{0, 1}},
                               .x0 = VectorXd::Zero(3),
                               .sigma = 2.0 / 3 / scale,
                               .scale = VectorXd::Constant(3, scale),
                               .lambda = 8,
                               .seed = seed};
        ContextualCma free(o);
        o.lower = lower;
        o.upper = upper;
        ContextualCma boxed(o);
        for (ContextualCma* cma : {&free, &boxed}) {
          for (const Candidate& c : cma->ask()) {
            const auto cost = static_cast<double>(c.id * 5 % 7);
            cma->tell(c.id, {.cost = cost, .task_costs = {cost, -cost}});
          }
        }
        EXPECT_EQ(free.state().sigma, boxed.state().sigma);
        const double widest = free.state().sigma * std::sqrt(free.state().C(0, 0));
        const double factor = std::min(1.0, o.sigma / widest);
        cut += factor < 1;
        MatrixXd C = free.state().C;
        C.row(0) *= factor;
        C.col(0) *= factor;
        EXPECT_LE((boxed.state().C - C).norm(), 1e-14);
        MatrixXd path = free.state().p_c;
        path.row(0) *= factor;
        EXPECT_LE((boxed.state().p_c - path).norm(), 1e-14);
      }
    }
  }
  EXPECT_GT(cut, 5);
  EXPECT_LT(cut, 40);
}

TEST(ContextualCma, RunsItsCurveForItsShareOfTheTrials) {
  ContextualCma cma({.tasks = VectorXd{{0, 1}},
                     .x0 = VectorXd::Zero(2),
                     .lambda = 9,
                     .curve_share = 0.2,
                     .tolx = 0,
                     .tolstagnation = 0});
  int samples = 0;
  int curves = 0;
  std::uint64_t next = 0;
  double least = std::numeric_limits<double>::infinity();
  double spread = 0;
  for (int g = 0; g < 60; ++g) {
    const bool due = 0.2 * samples >= (curves + 1) * 2;
    const std::vector<Candidate> candidates = cma.ask();
    ASSERT_EQ(candidates.size(), due ? 11u : 9u) << g;
    for (size_t k = 0; k < candidates.size(); ++k) {
      const Candidate& c = candidates[k];
      EXPECT_EQ(c.id, next++);
      if (k < 9) {
        const double cost = c.x.squaredNorm();
        cma.tell(c.id, {.cost = cost, .task_costs = {cost, cost}});
        continue;
      }
      // A curve's task counts where it was run; every fifth curve fails at one of them.
      const double mean = curves * 7 % 5 - 2;
      const double other = curves % 5 == 4 ? NAN : mean + curves;
      cma.tell(c.id,
               {.cost = 0, .task_costs = {k == 9 ? mean - curves : 99, k == 10 ? other : 99}});
    }
    samples += 9;
    if (!due) continue;
    const double mean = curves * 7 % 5 - 2;
    ++curves;
    if (curves % 5 == 0) {
      EXPECT_EQ(cma.state().costs.back(), std::numeric_limits<double>::infinity());
      continue;
    }
    EXPECT_EQ(cma.state().costs.back(), mean);
    if (mean < least) least = mean, spread = curves - 1;
    ASSERT_TRUE(cma.family());
    EXPECT_EQ(cma.family()->cost, least);
    EXPECT_EQ(cma.family()->task_costs, (std::vector<double>{least - spread, least + spread}));
  }
  EXPECT_EQ(cma.state().curves, static_cast<std::uint64_t>(curves));
  EXPECT_EQ(cma.state().samples, static_cast<std::uint64_t>(samples));
  EXPECT_GT(curves, 40);
}

/// A search at a point, all of whose samples fail, so that nothing moves: its curves have cost as
/// known, its σ is so many σ₀; after one more curve of that cost.
ContextualCma settled(ContextualCmaOptions o, const std::vector<double>& known, double size,
                      double cost) {
  o.tasks = VectorXd::Zero(1);
  o.x0 = VectorXd::Zero(1);
  o.sigma = 0.25;
  o.control_points = 1;
  o.lambda = 4;
  o.curve_share = 0.9;
  ContextualCma cma(o);
  const auto generation = [&](double curve) {
    for (const Candidate& c : cma.ask()) {
      const double said = c.id - cma.state().trials == 4 ? curve : double{NAN};
      cma.tell(c.id, {.cost = said, .task_costs = {said}});
    }
  };
  while (cma.state().costs.size() < known.size()) generation(1e3);
  std::string state = withNumber(cma.save(), kSigmaAt, 0.25 * size);
  for (size_t i = 0; i < known.size(); ++i) state = withNumber(state, kCostsAt + 8 * i, known[i]);
  cma.restore(state);
  generation(cost);
  return cma;
}

TEST(ContextualCma, StagnatesWhereTheLastCurvesAreNoGain) {
  struct Case {
    const char* what;
    int half;
    std::vector<double> known;
    double cost, size, tolerance;
    bool stops;
    double gain;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"a gain", 1, {4, 2}, 1.99, 0.05, 1e-3, false, 0},
           {"too little", 1, {4, 2}, 1.999, 0.05, 1e-3, true, 0.0005},
           {"a loss", 1, {4, 2}, 3, 0.05, 1e-3, true, 0},
           {"just enough", 1, {4, 2}, 1.5, 0.05, 0.25, false, 0},
           {"not enough", 1, {4, 2}, 1.5, 0.05, 0.26, true, 0.25},
           {"below zero", 1, {-4, -2}, -5, 0.05, 0.26, true, 0.25},
           {"below zero, a gain", 1, {-4, -2}, -5, 0.05, 0.25, false, 0},
           {"no curve is complete", 1, {INFINITY, INFINITY}, NAN, 0.05, 1e-3, true, 0},
           {"the first that is", 1, {INFINITY, INFINITY}, 3, 0.05, 1e-3, false, 0},
           {"too few curves", 1, {4}, 9, 0.05, 1e-3, false, 0},
           {"not settled", 1, {4, 2}, 3, 0.11, 1e-3, false, 0},
           {"settled", 1, {4, 2}, 3, 0.09, 1e-3, true, 0},
           {"of the last two", 2, {9, 8, 4, 2}, 7, 0.05, 0.51, true, 0.5},
           {"of the last two, a gain", 2, {9, 8, 4, 2}, 7, 0.05, 0.49, false, 0},
           {"the least before counts", 2, {2, 8, 9, 3}, 7, 0.05, 1e-3, true, 0},
           {"the third last is before", 2, {9, 8, 2, 3}, 7, 0.05, 1e-3, true, 0},
           {"too few for two", 2, {9, 9, 9}, 9, 0.05, 1e-3, false, 0},
           {"off", 1, {4, 2}, 3, 0.05, 0, false, 0}}) {
    SCOPED_TRACE(c.what);
    const ContextualCma cma = settled({.tasks = {},
                                       .x0 = {},
                                       .tolstagnation = c.tolerance,
                                       .stagnation_curves = c.half,
                                       .max_restarts = 0},
                                      c.known, c.size, c.cost);
    ASSERT_EQ(cma.stopped().has_value(), c.stops);
    if (!c.stops) continue;
    EXPECT_EQ(cma.stopped()->reason, "tolstagnation");
    EXPECT_NEAR(cma.stopped()->value, c.gain, 1e-12);
    EXPECT_EQ(cma.stopped()->limit, c.tolerance);
  }
}

TEST(ContextualCma, RestartsAboutItsBestWhereTheLastCurvesDiffer) {
  const auto about_best = [](const std::vector<double>& last, double cost) {
    std::vector<double> known(4, -100);
    known.insert(known.end(), last.begin(), last.end());
    ContextualCma cma = settled({.tasks = {}, .x0 = {}, .stagnation_curves = 3, .max_restarts = 5},
                                known, 0.05, cost);
    EXPECT_EQ(cma.state().restarts, 1);
    EXPECT_EQ(cma.state().lambda, 8);
    EXPECT_EQ(cma.state().all_failed, 0);
    EXPECT_FALSE(cma.stopped());
    return cma.state().sigma == 0.2 * 0.25;
  };
  // The median of three is to lie a tenth above the least.
  EXPECT_FALSE(about_best({10, 30}, 11));
  EXPECT_TRUE(about_best({10, 30}, 11.01));
  EXPECT_TRUE(about_best({30, 11.01}, 10));
  EXPECT_FALSE(about_best({10, 10}, 30));
  EXPECT_FALSE(about_best({-10, 30}, -9));
  EXPECT_TRUE(about_best({-10, 30}, -8.9));
}

TEST(ContextualCma, EndsARunWhereItsLimitsAre) {
  const auto reason = [](const ContextualCma& cma) {
    return cma.stopped() ? cma.stopped()->reason : "";
  };
  const auto at = [&](ContextualCmaOptions o, double size) {
    o.max_restarts = 0;
    return settled(o, {}, size, NAN);
  };
  EXPECT_EQ(reason(at({.tasks = {}, .x0 = {}, .tolx = 1}, 1)), "");
  const ContextualCma small = at({.tasks = {}, .x0 = {}, .tolx = std::nextafter(1, 2)}, 1);
  EXPECT_EQ(reason(small), "tolx");
  EXPECT_EQ(small.stopped()->value, 1);
  EXPECT_EQ(reason(at({.tasks = {}, .x0 = {}}, 1e4)), "");
  const ContextualCma large = at({.tasks = {}, .x0 = {}}, 1.0001e4);
  EXPECT_EQ(reason(large), "tolxup");
  EXPECT_DOUBLE_EQ(large.stopped()->value, 1.0001e4);
  EXPECT_EQ(large.stopped()->limit, 1e4);

  // Nothing but failures: after twenty generations, and never begun anew.
  const ContextualCmaOptions o{
      .tasks = VectorXd::Zero(1), .x0 = VectorXd::Zero(2), .control_points = 1};
  ContextualCma failing(o);
  for (int g = 1; g <= 20; ++g) {
    EXPECT_FALSE(failing.stopped());
    for (const Candidate& c : failing.ask()) failing.tell(c.id, {.failed = true});
    EXPECT_EQ(failing.state().all_failed, g);
  }
  EXPECT_EQ(reason(failing), "tolallfailed");
  EXPECT_EQ(failing.stopped()->value, 20);
  EXPECT_EQ(failing.stopped()->limit, 20);
  EXPECT_EQ(failing.state().restarts, 0);

  // The condition of C.
  for (const double least : {1e-14, 1.1e-14}) {
    ContextualCmaOptions once = o;
    once.max_restarts = 0;
    ContextualCma cma(once);
    constexpr size_t at_C = kPointsAt + 2 * 8 + 8;
    cma.restore(withNumber(cma.save(), at_C + 3 * 8, least));
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.failed = true});
    EXPECT_EQ(reason(cma), least == 1e-14 ? "conditioncov" : "");
    if (!cma.stopped()) continue;
    EXPECT_NEAR(cma.stopped()->value / 1e14, 1, 1e-9);
    EXPECT_NEAR(cma.stopped()->limit / 1e14, 1, 1e-9);
  }
}

TEST(ContextualCma, BeginsAnewElsewhere) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const ContextualCmaOptions o{.tasks = VectorXd{{0, 1}},
                               .x0 = VectorXd{{1, 2, 3}},
                               .sigma = 0.5,
                               .scale = VectorXd{{1, 10, 2}},
                               .lower = VectorXd{{-1, 1.9, -inf}},
                               .upper = VectorXd{{3, inf, inf}},
                               .lambda = 8,
                               .seed = 5,
                               .tolx = 9,  // ends every run at once
                               .max_restarts = 4,
                               .lambda_factor = 1.5};
  ContextualCma cma(o);
  const BoundFold fold(o.lower, o.upper, o.sigma * o.scale);
  int lambda = 8;
  for (int run = 0; run <= 4; ++run) {
    const ContextualCmaState& s = cma.state();
    EXPECT_EQ(s.restarts, run);
    EXPECT_EQ(s.lambda, lambda);
    EXPECT_EQ(s.sigma, 0.5);
    EXPECT_EQ(s.C, MatrixXd(MatrixXd::Identity(3, 3)));
    EXPECT_EQ(s.samples + s.curves + s.updates + s.elites.size() + s.costs.size(), 0u);
    VectorXd start = o.x0;
    if (run > 0) {
      Random random(5, UINT64_MAX, static_cast<std::uint64_t>(run));
      start[0] = random.uniform(-1, 3);
      start[1] = std::max(1.9, 2 + 5 * random.normal());
      start[2] = 3 + random.normal();
    }
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(fold.fold(i, o.scale[i] * s.A(i, k)), start[i], 1e-12) << run;
      }
    }
    for (const Candidate& c : cma.ask()) {
      cma.tell(c.id, {.cost = c.x[0], .task_costs = {c.x[0], c.x[1]}});
    }
    lambda = lambda * 3 / 2;
  }
  ASSERT_TRUE(cma.stopped());
  EXPECT_EQ(cma.stopped()->reason, "tolx");
  EXPECT_EQ(cma.state().restarts, 4);
  ContextualCmaOptions same = o;
  same.lambda_factor = 1;
  ContextualCma steady(same);
  for (const Candidate& c : steady.ask()) steady.tell(c.id, {.failed = true});
  EXPECT_EQ(steady.state().restarts, 1);
  EXPECT_EQ(steady.state().lambda, 8);
}

TEST(ContextualCma, SaysWhatCannotBeTold) {
  ContextualCma cma({.tasks = VectorXd{{0, 1}}, .x0 = VectorXd::Zero(2), .lambda = 4});
  const auto message = [&](std::uint64_t id) -> std::string {
    try {
      cma.tell(id, {.failed = true});
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message(4), "contextual: no candidate 4 in this generation, which has 0 to 3");
  for (std::uint64_t id = 0; id < 4; ++id) EXPECT_EQ(message(id), "");
  EXPECT_EQ(message(3), "contextual: no candidate 3 in this generation, which has 4 to 7");
  EXPECT_EQ(message(7), "");
  EXPECT_EQ(message(7), "contextual: candidate 7 has been told already");
}

}  // namespace
}  // namespace traceur::optim
