#include "traceur/optim/restarts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/test_functions.h"

namespace traceur::optim {
namespace {

/// Many local minima on a bowl; least 0 at 0.
double rastrigin(const VectorXd& x) {
  return x.squaredNorm() + 10 * (1 - (x.array() * 2 * M_PI).cos()).sum();
}

CmaEsOptions bowl(std::uint64_t seed) {
  return {.x0 = VectorXd::Constant(4, 3),
          .sigma = 1,
          .lower = VectorXd::Constant(4, -5),
          .upper = VectorXd::Constant(4, 5),
          .seed = seed};
}

/// λ of each descent until the optimiser stops.
std::vector<int> populations(Restarts& restarts) {
  std::vector<int> lambdas;
  int seen = 0;
  while (!restarts.stopped()) {
    if (restarts.descents() > seen) {
      seen = restarts.descents();
      lambdas.push_back(restarts.cma().options().lambda);
    }
    for (const Candidate& c : restarts.ask()) restarts.tell(c.id, {.cost = rastrigin(c.x)});
  }
  return lambdas;
}

TEST(Restarts, IpopDoublesThePopulation) {
  Restarts ipop(bowl(1), {.restarts = 3});
  EXPECT_EQ(populations(ipop), (std::vector<int>{8, 16, 32, 64}));
}

TEST(Restarts, BipopSpendsAsMuchOnSmallPopulations) {
  Restarts bipop(bowl(1), {.restarts = 3, .bipop = true});
  const std::vector<int> lambdas = populations(bipop);
  EXPECT_GT(lambdas.size(), 5);
  EXPECT_EQ(std::vector<int>(lambdas.begin(), lambdas.begin() + 2), (std::vector<int>{8, 16}));
  EXPECT_EQ(*std::max_element(lambdas.begin(), lambdas.end()), 64);
}

TEST(Restarts, BipopSharesTrialsByItsRules) {
  const CmaEsOptions options = bowl(2);
  Restarts bipop(options, {.restarts = 4, .bipop = true});
  struct Descent {
    int lambda = 0;
    double sigma = 0;
    VectorXd start;
    std::uint64_t trials = 0;
  };
  std::vector<Descent> all;
  std::uint64_t next = 0;
  while (!bipop.stopped()) {
    if (bipop.descents() > static_cast<int>(all.size())) {
      const CmaEsOptions& o = bipop.cma().options();
      all.push_back({o.lambda, o.sigma, o.x0, 0});
    }
    for (const Candidate& c : bipop.ask()) {
      EXPECT_EQ(c.id, next++);
      bipop.tell(c.id, {.cost = rastrigin(c.x)});
      ++all.back().trials;
    }
  }
  EXPECT_EQ(all[0].start, options.x0);
  std::uint64_t large = all[0].trials, small = 0, latest = all[0].trials;
  int lambda = 8;
  int grown = 0;
  int spent = 0;  // small ones that ended for having had their trials
  for (size_t i = 1; i < all.size(); ++i) {
    SCOPED_TRACE(i);
    const Descent& d = all[i];
    for (size_t k = 0; k < i; ++k) EXPECT_NE(d.start, all[k].start);
    EXPECT_LE(d.start.cwiseAbs().maxCoeff(), 5);
    if (i > 1 && small < large) {
      small += d.trials;
      EXPECT_GE(d.lambda, 2);
      EXPECT_LE(d.lambda, std::max(8, lambda / 2));  // λ₀ (λ/(2 λ₀))^(u²)
      Random random(2, kDescentStream + 1, i + 1);
      const double u = random.uniform();
      EXPECT_EQ(d.lambda, std::max(2.0, std::floor(8 * std::pow(lambda / 16.0, u * u))));
      EXPECT_DOUBLE_EQ(d.sigma, std::pow(10, -2 * random.uniform()));
      spent +=
          2 * d.trials >= latest && 2 * (d.trials - static_cast<std::uint64_t>(d.lambda)) < latest;
      // But for the last, it ends with the generation that has had half of the large one's trials.
      if (i + 1 < all.size()) {
        EXPECT_LT(d.trials - static_cast<std::uint64_t>(d.lambda), (latest + 1) / 2);
      }
    } else {
      lambda *= 2;
      ++grown;
      large += d.trials;
      latest = d.trials;
      EXPECT_EQ(d.lambda, lambda);
      EXPECT_EQ(d.sigma, 1);
    }
  }
  EXPECT_EQ(grown, 4);
  EXPECT_GT(spent, 0);
}

TEST(Restarts, FindsTheDeepestOfManyValleys) {
  const FunctionProblem problem(VectorXd::Constant(4, -5), VectorXd::Constant(4, 5), rastrigin);
  for (const bool bipop : {false, true}) {
    int alone = 0;
    int solved = 0;
    for (std::uint64_t seed = 1; seed <= 7; ++seed) {
      CmaEs one(bowl(seed));
      alone += minimise(problem, one, {.budget = 30000, .target = 1e-8}).end == End::kTarget;
      Restarts many(bowl(seed), {.bipop = bipop});
      solved += minimise(problem, many, {.budget = 30000, .target = 1e-8}).end == End::kTarget;
    }
    EXPECT_GE(solved, 5);
    EXPECT_LE(alone, 3);
  }
}

TEST(Restarts, RefusesWhatCannotBeUsed) {
  EXPECT_THROW(Restarts(bowl(1), {.restarts = -1}), InputError);
  EXPECT_THROW(Restarts(bowl(1), {.growth = 0.5}), InputError);
  EXPECT_THROW(Restarts(bowl(1), {.growth = NAN}), InputError);
  EXPECT_THROW(Restarts(bowl(1), {.growth = INFINITY}), InputError);
  EXPECT_THROW(Restarts({}), InputError);
  EXPECT_NO_THROW(Restarts(bowl(1), {.restarts = 0, .growth = 1}));
}

TEST(Restarts, BeginAtRandomInTheBoxOrAboutTheStart) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const CmaEsOptions o{.x0 = VectorXd{{1, 2, 3}},
                       .sigma = 0.5,
                       .scale = VectorXd{{1, 10, 2}},
                       .lower = VectorXd{{-1, 1.9, -inf}},
                       .upper = VectorXd{{3, inf, inf}},
                       .lambda = 5,
                       .seed = 7,
                       .termination = {.tolxup = 0}};  // ends every descent at once
  Restarts restarts(o, {.restarts = 3, .growth = 1.5});
  const int lambdas[] = {5, 7, 11, 16};
  std::uint64_t next = 0;
  for (int descent = 0; descent < 4; ++descent) {
    EXPECT_FALSE(restarts.stopped());
    EXPECT_EQ(restarts.descents(), descent + 1);
    VectorXd x0 = o.x0;
    std::uint64_t seed = 7;
    if (descent > 0) {
      Random random(7, kDescentStream, static_cast<std::uint64_t>(descent));
      seed = random.bits();
      x0[0] = random.uniform(-1, 3);
      x0[1] = std::max(1.9, 2 + 5 * random.normal());
      x0[2] = 3 + random.normal();
    }
    const CmaEsOptions& got = restarts.cma().options();
    EXPECT_EQ(got.x0, x0) << descent;
    EXPECT_EQ(got.seed, seed);
    EXPECT_EQ(got.lambda, lambdas[descent]);
    EXPECT_EQ(got.sigma, 0.5);
    const std::uint64_t first = next;
    for (const Candidate& c : restarts.ask()) {
      EXPECT_EQ(c.id, next++);
      restarts.tell(c.id, {.cost = c.x[0]});
    }
    if (descent == 0 || descent == 3) continue;
    try {
      restarts.tell(first, {.cost = 1});
      FAIL();
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()), "restarts: no candidate " + std::to_string(first) +
                                           ", the descent began at " + std::to_string(next));
    }
  }
  ASSERT_TRUE(restarts.stopped());
  EXPECT_EQ(restarts.stopped()->reason, "tolxup");
  EXPECT_EQ(restarts.descents(), 4);
}

TEST(Restarts, DoNotFollowADescentOfNothingButFailures) {
  for (const bool bipop : {false, true}) {
    Restarts restarts(bowl(1), {.bipop = bipop});
    for (int g = 0; g < 50 && !restarts.stopped(); ++g) {
      for (const Candidate& c : restarts.ask()) restarts.tell(c.id, {.failed = true});
    }
    ASSERT_TRUE(restarts.stopped());
    EXPECT_EQ(restarts.stopped()->reason, "tolallfailed");
    EXPECT_EQ(restarts.descents(), 1);
  }
}

}  // namespace
}  // namespace traceur::optim
