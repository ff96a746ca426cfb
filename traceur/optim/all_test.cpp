#include "traceur/optim/all.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "traceur/core/error.h"
#include "traceur/optim/test_functions.h"

namespace traceur::optim {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(AllOptimizers, HaveNamesPeopleCanTypeAndHelp) {
  std::set<std::string> names;
  for (const OptimizerEntry& entry : allOptimizers()) {
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_EQ(entry.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"),
              std::string::npos);
    EXPECT_FALSE(entry.help.empty());
    EXPECT_EQ(&findOptimizer(entry.name), &entry);
  }
}

TEST(AllOptimizers, AWrongNameGetsASuggestion) {
  try {
    findOptimizer("cma_es");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find("no optimiser \"cma_es\". Did you mean \"cma-es\"?"), 0);
  }
  EXPECT_THROW(findOptimizer(""), InputError);
}

TEST(CmaEsOptionsOf, ScalesEachVariableByItsBox) {
  VectorXd lower(5), upper(5);
  lower << -1, 100, -kInf, 7, -kInf;
  upper << 1, 1100, kInf, kInf, -7;
  const FunctionProblem problem(lower, upper, sphere);
  const CmaEsOptions o = cmaEsOptions(problem, {.seed = 4, .lambda = 12, .sigma = 0.2});
  VectorXd scale(5), middle(5);
  scale << 2, 1000, 1, 1, 1;
  middle << 0, 600, 0, 8, -8;
  EXPECT_EQ(o.scale, scale);
  EXPECT_EQ(o.x0, middle);
  EXPECT_EQ(o.lower, lower);
  EXPECT_EQ(o.upper, upper);
  EXPECT_EQ(o.sigma, 0.2);
  EXPECT_EQ(o.lambda, 12);
  EXPECT_EQ(o.seed, 4);

  const CmaEs cma(o);
  EXPECT_NEAR(std::sqrt(cma.covariance()(1, 1)), 200, 1e-10);
}

TEST(CmaEsOptionsOf, TakesAStartingPointAndRefusesOneThatDoesNotFit) {
  const FunctionProblem problem(VectorXd::Zero(2), VectorXd::Ones(2), sphere);
  EXPECT_EQ(cmaEsOptions(problem, {.x0 = Eigen::Vector2d(0.1, 1)}).x0, Eigen::Vector2d(0.1, 1));
  EXPECT_THROW(cmaEsOptions(problem, {.x0 = VectorXd::Zero(3)}), InputError);
  EXPECT_THROW(findOptimizer("cma-es").make(problem, {.x0 = VectorXd::Constant(2, 1.5)}),
               InputError);
  EXPECT_THROW(findOptimizer("cma-es").make(problem, {.sigma = 0}), InputError);
  const FunctionProblem reversed(VectorXd::Ones(2), VectorXd::Zero(2), sphere);
  EXPECT_THROW(findOptimizer("cma-es").make(reversed, {}), InputError);
}

TEST(CmaEsOptionsOf, SurvivesABoxWiderThanTheLargestNumber) {
  const FunctionProblem problem(VectorXd::Constant(2, -1e308), VectorXd::Constant(2, 1.5e308),
                                sphere);
  const CmaEsOptions o = cmaEsOptions(problem, {});
  EXPECT_EQ(o.scale, VectorXd::Ones(2));
  EXPECT_TRUE(o.x0.allFinite());
  EXPECT_NO_THROW(CmaEs{o});
}

}  // namespace
}  // namespace traceur::optim
