// Each stopping criterion of CMA-ES: a run that makes exactly it fire, at the generation where a
// naive reading of its definition says so, and not when it is switched off. Several of the scenes
// are mistakes found in published implementations.
#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cmath>

#include "traceur/core/random.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

const CmaTermination kAllOff{.tolx = 0,
                             .tolfun = 0,
                             .tolfunhist = 0,
                             .equalfunvals = false,
                             .tolflatfitness = INT_MAX,
                             .tolxup = kInf,
                             .tolupsigma = kInf,
                             .conditioncov = kInf,
                             .noeffectaxis = false,
                             .noeffectcoord = false,
                             .tolstagnation = INT_MAX,
                             .maxiter = INT_MAX,
                             .tolallfailed = INT_MAX};

/// A run so far: the optimiser after g generations, and all costs it was told.
struct Record {
  const CmaEs& cma;
  const std::vector<std::vector<double>>& costs;  // per generation, in the order of ids

  int n() const { return static_cast<int>(cma.options().x0.size()); }
  int g() const { return static_cast<int>(costs.size()); }
  double growth() const { return cma.state().sigma / cma.options().sigma; }
  /// Eigenvalues of C, falling.
  VectorXd eigenvalues() const {
    SymmetricEigen eigen(n());
    eigen.compute(cma.state().C);
    VectorXd values = eigen.values();
    std::sort(values.begin(), values.end(), std::greater());
    return values;
  }
  double best(int generation) const {
    return *std::min_element(costs[generation].begin(), costs[generation].end());
  }
  double middle(int generation) const {
    std::vector<double> c = costs[generation];
    std::sort(c.begin(), c.end());
    return c[c.size() / 2];
  }
  /// Greatest minus least of the bests of the last 10 + ⌈30 n/λ⌉ generations; ∞ before.
  double historyRange() const {
    const int window = 10 + static_cast<int>(std::ceil(30.0 * n() / cma.constants().lambda));
    if (g() < window) return kInf;
    double low = kInf, high = -kInf;
    for (int i = g() - window; i < g(); ++i) {
      low = std::min(low, best(i));
      high = std::max(high, best(i));
    }
    return high - low;
  }
};

struct Scene {
  std::string reason;
  CmaEsOptions options;
  std::function<double(int g, int k, const VectorXd& x)> cost;
  std::function<bool(const Record&)> due;
  void (*switch_off)(CmaTermination&);
  bool above;  ///< fires above its limit, not below
  int generations = 20000;
};

/// The generation after which the run stops, and why; 0 generations if it does not.
struct Outcome {
  int generation = 0;
  Stop stop;
};

Outcome run(const Scene& scene, const CmaTermination& termination, bool check_due) {
  CmaEsOptions options = scene.options;
  options.termination = termination;
  CmaEs cma(options);
  std::vector<std::vector<double>> costs;
  for (int g = 0; g < scene.generations; ++g) {
    costs.emplace_back();
    const std::vector<Candidate> candidates = cma.ask();
    for (size_t k = 0; k < candidates.size(); ++k) {
      costs.back().push_back(scene.cost(g, static_cast<int>(k), candidates[k].x));
      cma.tell(candidates[k].id, {.cost = costs.back().back()});
    }
    if (check_due) {
      const bool due = scene.due({cma, costs});
      EXPECT_EQ(due, cma.stopped().has_value()) << "after generation " << g + 1;
      if (due != cma.stopped().has_value()) return {};
    }
    if (cma.stopped()) return {g + 1, *cma.stopped()};
  }
  return {};
}

/// Only the criterion of the scene is on.
CmaTermination only(const Scene& scene) {
  CmaTermination t = kAllOff;
  const CmaTermination& d = scene.options.termination;
  const std::string& r = scene.reason;
  if (r == "tolx") t.tolx = d.tolx;
  if (r == "tolfun") t.tolfun = d.tolfun;
  if (r == "tolfunhist") t.tolfunhist = d.tolfunhist;
  if (r == "equalfunvals") t.equalfunvals = true;
  if (r == "tolflatfitness") t.tolflatfitness = d.tolflatfitness;
  if (r == "tolxup") t.tolxup = d.tolxup;
  if (r == "tolupsigma") t.tolupsigma = d.tolupsigma;
  if (r == "conditioncov") t.conditioncov = d.conditioncov;
  if (r == "noeffectaxis") t.noeffectaxis = true;
  if (r == "noeffectcoord") t.noeffectcoord = true;
  if (r == "tolstagnation") t.tolstagnation = d.tolstagnation;
  if (r == "maxiter") t.maxiter = d.maxiter;
  if (r == "tolallfailed") t.tolallfailed = d.tolallfailed;
  return t;
}

/// A number in [0, 1) that looks random: costs that say nothing.
double noise(int g, int k) {
  return Random(99, g, k).uniform();
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

/// Whether neither the best nor the median costs have improved over their last window generations.
bool stagnates(const Record& r, int window) {
  if (r.g() < window) return false;
  const int part = static_cast<int>(0.3 * window);
  std::vector<double> first_best, first_middle, last_best, last_middle;
  for (int i = 0; i < part; ++i) {
    first_best.push_back(r.best(r.g() - window + i));
    first_middle.push_back(r.middle(r.g() - window + i));
    last_best.push_back(r.best(r.g() - 1 - i));
    last_middle.push_back(r.middle(r.g() - 1 - i));
  }
  return median(last_best) >= median(first_best) && median(last_middle) >= median(first_middle);
}

std::vector<Scene> scenes() {
  const VectorXd ones = VectorXd::Ones(5);
  const CmaEsOptions plain{.x0 = ones, .sigma = 0.5};
  std::vector<Scene> all;

  // The minimum is at 0 and steep, so that x can be told apart long after the costs are large. σ is
  // on the side of C, the root of the variance is taken, and σ₀ = 0.5 is what it is relative to.
  all.push_back({"tolx", plain, [](int, int, auto& x) { return 1e30 * sphere(x); },
                 [](const Record& r) {
                   const CmaState& s = r.cma.state();
                   const double widest =
                       std::max(s.C.diagonal().cwiseSqrt().maxCoeff(), s.p_c.cwiseAbs().maxCoeff());
                   return s.sigma * widest < 1e-12 * 0.5;
                 },
                 [](CmaTermination& t) { t.tolx = 0; }, false});

  all.push_back({"tolfun", plain, [](int, int, auto& x) { return sphere(x); },
                 [](const Record& r) {
                   const std::vector<double>& now = r.costs.back();
                   const double range = *std::max_element(now.begin(), now.end()) -
                                        *std::min_element(now.begin(), now.end());
                   return std::max(r.historyRange(), range) < 1e-11;
                 },
                 [](CmaTermination& t) { t.tolfun = 0; }, false});

  // The best is nearly the same each time, the others are anything: tolfun must hold its tongue.
  all.push_back({"tolfunhist", plain,
                 [](int g, int k, auto&) { return k == g % 8 ? 1e-13 * (g % 3) : 1 + noise(g, k); },
                 [](const Record& r) { return r.historyRange() < 1e-12; },
                 [](CmaTermination& t) { t.tolfunhist = 0; }, false});

  all.push_back({"equalfunvals", plain,
                 [](int g, int k, auto&) { return k == g % 8 ? -3e20 : noise(g, k); },
                 [](const Record& r) { return r.historyRange() == 0; },
                 [](CmaTermination& t) { t.equalfunvals = false; }, false});

  all.push_back({"tolflatfitness", plain, [](int g, int, auto&) { return 1.0 + g; },
                 [](const Record& r) { return r.g() > 10; },
                 [](CmaTermination& t) { t.tolflatfitness = INT_MAX; }, true});

  // A slope without end.
  all.push_back({"tolxup", plain, [](int, int, auto& x) { return x[0]; },
                 [](const Record& r) { return r.growth() * std::sqrt(r.eigenvalues()[0]) > 1e4; },
                 [](CmaTermination& t) { t.tolxup = kInf; }, true});

  // On a plateau σ grows and C does not.
  for (int quarter = 8; quarter < 48; ++quarter) {
    const double limit = quarter / 4.0;
    CmaEsOptions creeping = plain;
    creeping.termination.tolupsigma = limit;
    all.push_back(
        {"tolupsigma", creeping, [](int g, int, auto&) { return 1.0 + g; },
         [limit](const Record& r) { return r.growth() > limit * std::sqrt(r.eigenvalues()[0]); },
         [](CmaTermination& t) { t.tolupsigma = kInf; }, true});
  }

  // One variable counts 10^20 times as much. The condition is that of C, not of its root.
  CmaEsOptions well_conditioned = plain;
  well_conditioned.termination.conditioncov = 1e12;
  all.push_back({"conditioncov", well_conditioned,
                 [](int, int, auto& x) { return x.head(4).squaredNorm() + 1e20 * x[4] * x[4]; },
                 [](const Record& r) {
                   const VectorXd e = r.eigenvalues();
                   return e[4] <= 0 || e[0] / e[4] > 1e12;
                 },
                 [](CmaTermination& t) { t.conditioncov = kInf; }, true});

  // The minimum lies at 10⁸ in one coordinate and 0 in the others. That coordinate alone stops the
  // run, be it the first or another.
  for (const int far : {0, 3}) {
    CmaEsOptions o = plain;
    o.x0 = VectorXd::Zero(5);
    o.x0[far] = 1e8;
    all.push_back({"noeffectcoord", o,
                   [far](int, int, const VectorXd& x) {
                     VectorXd y = x;
                     y[far] -= 1e8;
                     return 1e30 * sphere(y);
                   },
                   [](const Record& r) {
                     const CmaState& s = r.cma.state();
                     for (int i = 0; i < 5; ++i) {
                       const double next = s.mean[i] + 0.2 * s.sigma * std::sqrt(s.C(i, i));
                       if (next == s.mean[i]) return true;
                     }
                     return false;
                   },
                   [](CmaTermination& t) { t.noeffectcoord = false; }, false});
  }

  // All coordinates are far out, and one direction, not along an axis of space, is 1000 times
  // narrower than the others: it is lost first, and found when its turn comes.
  CmaEsOptions far_out{.x0 = VectorXd::Constant(5, 1e8), .sigma = 0.5};
  all.push_back({"noeffectaxis", far_out,
                 [](int, int, const VectorXd& x) {
                   const VectorXd y = x - VectorXd::Constant(5, 1e8);
                   return 1e30 * (sphere(y) + 1e8 * std::pow(y.sum(), 2));
                 },
                 [](const Record& r) {
                   const CmaState& s = r.cma.state();
                   const int axis = r.g() % 5;
                   for (int i = 0; i < 5; ++i) {
                     const double next = s.mean[i] + 0.1 * s.sigma * s.D[axis] * s.B(i, axis);
                     if (next != s.mean[i]) return false;
                   }
                   return true;
                 },
                 [](CmaTermination& t) { t.noeffectaxis = false; }, false});

  // Costs that are nothing but noise.
  all.push_back({"tolstagnation", plain, [](int g, int k, auto&) { return noise(g, k); },
                 [](const Record& r) { return r.g() % 12 == 0 && stagnates(r, 239); },
                 [](CmaTermination& t) { t.tolstagnation = INT_MAX; }, true});

  CmaEsOptions short_run = plain;
  short_run.termination.maxiter = 17;
  all.push_back({"maxiter", short_run, [](int, int, auto& x) { return sphere(x); },
                 [](const Record& r) { return r.g() >= 17; },
                 [](CmaTermination& t) { t.maxiter = INT_MAX; }, true});

  // Ten good generations first: only failures in a row count.
  all.push_back({"tolallfailed", plain,
                 [](int g, int, auto& x) { return g < 10 || g == 25 ? sphere(x) : NAN; },
                 [](const Record& r) { return r.g() == 46; },
                 [](CmaTermination& t) { t.tolallfailed = INT_MAX; }, true, 200});
  return all;
}

TEST(Stop, ExactlyTheOneCriterionFiresAtItsGeneration) {
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.reason);
    const Outcome full = run(scene, scene.options.termination, false);
    EXPECT_EQ(full.stop.reason, scene.reason);
    const Outcome alone = run(scene, only(scene), true);
    EXPECT_EQ(alone.stop.reason, scene.reason);
    EXPECT_EQ(alone.generation, full.generation);
    EXPECT_EQ(alone.stop.value, full.stop.value);
    EXPECT_FALSE(std::isnan(full.stop.value));
    if (scene.above) {
      EXPECT_GE(full.stop.value, full.stop.limit);
    }
    if (!scene.above) {
      EXPECT_LE(full.stop.value, full.stop.limit);
    }
  }
}

TEST(Stop, ACriterionSwitchedOffIsSilent) {
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.reason);
    CmaTermination t = scene.options.termination;
    scene.switch_off(t);
    EXPECT_NE(run(scene, t, false).stop.reason, scene.reason);
  }
}

TEST(Stop, WithAllOffARunGoesOn) {
  for (Scene scene : scenes()) {
    SCOPED_TRACE(scene.reason);
    scene.generations = 1500;
    EXPECT_EQ(run(scene, kAllOff, false).generation, 0);
  }
}

TEST(Stop, TolxLooksAtThePathToo) {
  // Generations where every √C_ii says stop and p_c says no.
  int decided_by_path = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CmaTermination t = kAllOff;
    t.tolx = 1.05;
    CmaEs cma({.x0 = VectorXd::Ones(5), .sigma = 0.5, .seed = seed, .termination = t});
    for (int g = 0; g < 30; ++g) {
      for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = sphere(c.x)});
      const CmaState& s = cma.state();
      const double growth = s.sigma / 0.5;
      const bool by_covariance = growth * s.C.diagonal().cwiseSqrt().maxCoeff() < 1.05;
      const bool by_path = growth * s.p_c.cwiseAbs().maxCoeff() < 1.05;
      EXPECT_EQ(cma.stopped().has_value(), by_covariance && by_path);
      decided_by_path += by_covariance && !by_path;
    }
  }
  EXPECT_GT(decided_by_path, 5);
}

TEST(Stop, TolxIsRelativeToTheFirstStepAndToScale) {
  // The same run in other units stops at the same generation.
  const auto generations = [](double sigma, double scale) {
    CmaEs cma({.x0 = VectorXd::Ones(3) * sigma * scale,
               .sigma = sigma,
               .scale = VectorXd::Constant(3, scale)});
    while (!cma.stopped()) {
      for (const Candidate& c : cma.ask()) {
        cma.tell(c.id, {.cost = 1e60 * sphere(c.x)});
      }
    }
    EXPECT_EQ(cma.stopped()->reason, "tolx");
    return cma.state().generation;
  };
  const auto expected = generations(0.5, 1);
  EXPECT_EQ(generations(1024, 1), expected);
  EXPECT_EQ(generations(0.5, 4096), expected);
}

TEST(Stop, NoEffectAxisNeedsEveryCoordinate) {
  // Step 10⁻⁷ against means of 10¹⁰ in all coordinates but one.
  VectorXd x0 = VectorXd::Constant(5, 1e10);
  CmaTermination t = kAllOff;
  t.noeffectaxis = true;
  for (const bool all : {true, false}) {
    x0[2] = all ? 1e10 : 0;
    CmaEs cma({.x0 = x0, .sigma = 1e-7, .termination = t});
    for (int g = 0; g < 5; ++g) {
      for (const Candidate& c : cma.ask())
        cma.tell(c.id, {.cost = noise(g, static_cast<int>(c.id))});
      EXPECT_EQ(cma.stopped().has_value(), all);
    }
  }
}

TEST(Stop, StagnationNeedsBothTheBestAndTheMedian) {
  const auto stops = [](auto cost) {
    CmaEs cma({.x0 = VectorXd::Ones(5), .termination = {.tolxup = kInf}});
    for (int g = 0; g < 700; ++g) {
      const std::vector<Candidate> candidates = cma.ask();
      for (size_t k = 0; k < candidates.size(); ++k) {
        cma.tell(candidates[k].id, {.cost = cost(g, static_cast<int>(k))});
      }
      if (cma.stopped() && cma.stopped()->reason == "tolstagnation") return true;
    }
    return false;
  };
  EXPECT_TRUE(stops([](int g, int k) { return noise(g, k); }));
  EXPECT_FALSE(stops([](int g, int k) { return noise(g, k) - 0.01 * g; }));
  // Only the best improves; only the others do.
  EXPECT_FALSE(stops([](int g, int k) { return k == 0 ? -1 - 0.01 * g : noise(g, k); }));
  EXPECT_FALSE(
      stops([](int g, int k) { return k == 0 ? -100 + noise(g, k) : noise(g, k) - 0.01 * g; }));
}

TEST(Stop, StagnationLooksAtAFifthOfALongRun) {
  // Improves for 3000 generations, then no more. A window of 239 alone would stop after some 200.
  CmaTermination t = kAllOff;
  t.tolstagnation = 0;
  CmaEs cma({.x0 = VectorXd::Ones(5), .termination = t});
  int g = 0;
  for (; g < 6000 && !cma.stopped(); ++g) {
    const std::vector<Candidate> candidates = cma.ask();
    for (size_t k = 0; k < candidates.size(); ++k) {
      cma.tell(candidates[k].id,
               {.cost = noise(g, static_cast<int>(k)) - 0.01 * std::min(g, 3000)});
    }
  }
  EXPECT_GT(g, 3300);
  EXPECT_LT(g, 4500);
}

TEST(Stop, FeasibilityFoundLateIsNotStagnation) {
  // Infeasible costs are low, feasible ones high; becoming feasible is progress.
  CmaTermination t = kAllOff;
  t.tolstagnation = 100;
  CmaEs cma({.x0 = VectorXd::Ones(5), .termination = t});
  for (int g = 0; g < 180; ++g) {
    const std::vector<Candidate> candidates = cma.ask();
    for (size_t k = 0; k < candidates.size(); ++k) {
      const double x = noise(g, static_cast<int>(k)) - 0.01 * g;
      cma.tell(candidates[k].id, g < 90 ? Evaluation{.cost = x, .violated = {true}}
                                        : Evaluation{.cost = 100 + x, .violated = {false}});
    }
    EXPECT_FALSE(cma.stopped()) << g;
  }
}

TEST(Stop, AFlatStartIsNotTheEndAtOnce) {
  // One flat generation, as a population on a plateau or of equal points has, is no reason.
  CmaEs cma({.x0 = VectorXd::Ones(5)});
  for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = 7});
  EXPECT_FALSE(cma.stopped());
  EXPECT_EQ(cma.state().flat, 1);
  for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = sphere(c.x)});
  EXPECT_EQ(cma.state().flat, 0);
}

TEST(Stop, IsAdviceAndSurvivesSaving) {
  const CmaEsOptions options{.x0 = VectorXd::Ones(2), .termination = {.maxiter = 3}};
  CmaEs cma(options);
  for (int g = 0; g < 3; ++g) {
    for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = sphere(c.x)});
  }
  ASSERT_TRUE(cma.stopped());
  CmaEs twin(options);
  twin.restore(cma.save());
  ASSERT_TRUE(twin.stopped());
  EXPECT_EQ(twin.stopped()->reason, "maxiter");
  EXPECT_EQ(twin.stopped()->value, 3);
  EXPECT_EQ(twin.stopped()->limit, 3);
  for (const Candidate& c : cma.ask()) cma.tell(c.id, {.cost = sphere(c.x)});
  EXPECT_EQ(cma.state().generation, 4);
}

}  // namespace
}  // namespace traceur::optim
