#include "traceur/optim/restarts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
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
  EXPECT_THROW(Restarts({}), InputError);
}

}  // namespace
}  // namespace traceur::optim
