#include "traceur/optim/problem.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

TEST(Evaluation, IsMeaningfulOnlyWithACost) {
  EXPECT_TRUE((Evaluation{.cost = 1}).meaningful());
  EXPECT_FALSE(Evaluation{}.meaningful());
  EXPECT_FALSE((Evaluation{.cost = -kInf}).meaningful());
  EXPECT_FALSE((Evaluation{.cost = NAN}).meaningful());
  EXPECT_FALSE((Evaluation{.cost = 1, .failed = true}).meaningful());
}

TEST(Evaluation, IsFeasibleOnlyIfNothingIsViolated) {
  EXPECT_TRUE((Evaluation{.cost = 1}).feasible());
  EXPECT_TRUE((Evaluation{.cost = 1, .violated = {false, false}}).feasible());
  EXPECT_FALSE((Evaluation{.cost = 1, .violated = {false, true}}).feasible());
  EXPECT_FALSE((Evaluation{.cost = NAN, .violated = {false}}).feasible());
}

TEST(Evaluation, OrderIsAStrictWeakOneForAllKindsOfCosts) {
  const std::vector<Evaluation> best_first = {
      {.cost = -1e308},
      {.cost = -1},
      {.cost = 1e300},
      {.cost = -1e308, .violated = {true}},
      {.cost = -5, .violated = {true, true}},
      {.cost = 7, .violated = {false, true}},
  };
  const std::vector<Evaluation> failed = {{},
                                          {.cost = NAN},
                                          {.cost = -kInf},
                                          {.cost = -1, .failed = true},
                                          {.cost = NAN, .violated = {true}}};
  for (size_t i = 0; i < best_first.size(); ++i) {
    for (size_t j = 0; j < best_first.size(); ++j) {
      EXPECT_EQ(better(best_first[i], best_first[j]), i < j) << i << " " << j;
    }
    for (const Evaluation& f : failed) {
      EXPECT_TRUE(better(best_first[i], f));
      EXPECT_FALSE(better(f, best_first[i]));
    }
  }
  for (const Evaluation& a : failed) {
    for (const Evaluation& b : failed) EXPECT_FALSE(better(a, b));
  }
}

TEST(CheckBounds, NamesWhatIsWrong) {
  const auto message = [](const VectorXd& l, const VectorXd& u, int n) -> std::string {
    try {
      checkBounds("here", l, u, n);
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message(VectorXd::Zero(2), VectorXd::Ones(2), 2), "");
  EXPECT_EQ(message(VectorXd::Constant(2, -kInf), VectorXd::Constant(2, kInf), 2), "");
  EXPECT_EQ(message(VectorXd::Zero(2), VectorXd::Ones(3), 2),
            "here: expected bounds lower(2), upper(2), got lower(2), upper(3)");
  EXPECT_EQ(message(VectorXd::Zero(2), Eigen::Vector2d(1, -3), 2),
            "here: expected lower[1] < upper[1], got 0 and -3");
  EXPECT_EQ(message(VectorXd::Zero(1), VectorXd::Zero(1), 1),
            "here: expected lower[0] < upper[0], got 0 and 0");
  EXPECT_EQ(message(VectorXd::Constant(1, NAN), VectorXd::Zero(1), 1),
            "here: expected lower[0] < upper[0], got nan and 0");
}

TEST(TestFunctions, HaveTheirKnownMinima) {
  for (const int n : {2, 5, 20}) {
    EXPECT_EQ(sphere(VectorXd::Zero(n)), 0);
    EXPECT_EQ(ellipsoid(VectorXd::Zero(n)), 0);
    EXPECT_EQ(cigar(VectorXd::Zero(n)), 0);
    EXPECT_EQ(rosenbrock(VectorXd::Ones(n)), 0);
    EXPECT_NEAR(ellipsoid(VectorXd::Unit(n, n - 1)), 1e6, 1e-6);
    EXPECT_EQ(ellipsoid(VectorXd::Unit(n, 0)), 1);
    EXPECT_EQ(cigar(VectorXd::Unit(n, 1)), 1e6);
    EXPECT_EQ(rosenbrock(VectorXd::Zero(n)), n - 1);
  }
}

TEST(Problem, NamesItsVariablesIfNobodyElseDoes) {
  const FunctionProblem problem(VectorXd{{-1, 0}}, VectorXd{{3, kInf}}, sphere);
  const ParamSpecs parameters = problem.parameters();
  ASSERT_EQ(parameters.size(), 2u);
  EXPECT_EQ(parameters[0].name, "x1");
  EXPECT_EQ(parameters[1].name, "x2");
  EXPECT_EQ(lowerOf(parameters), problem.lower());
  EXPECT_EQ(upperOf(parameters), problem.upper());
  EXPECT_EQ(initialOf(parameters), (VectorXd{{1, 1}})) << "the middle, and 1 inside the bound";
}

}  // namespace
}  // namespace traceur::optim
