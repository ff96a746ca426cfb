#include "traceur/optim/all.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "traceur/core/error.h"
#include "traceur/optim/family.h"
#include "traceur/optim/test_functions.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

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

/// A tilted bowl in a box, of several tasks or none, with a constraint and failures here and there.
class Rough : public Problem {
 public:
  explicit Rough(bool family) : family_(family) {}
  VectorXd lower() const override { return VectorXd::Constant(3, -1); }
  VectorXd upper() const override { return VectorXd::LinSpaced(3, 1, 3); }
  VectorXd tasks() const override {
    return family_ ? VectorXd(VectorXd::LinSpaced(3, 1, 5)) : VectorXd();
  }
  std::vector<std::string> constraints() const override { return {"edge"}; }
  Evaluation evaluate(const VectorXd& x) const override {
    Evaluation e{.cost = 0, .violated = {x[0] + x[1] < 0.1}};
    e.failed = std::sin(1e3 * x.sum()) > 0.95;
    for (const double task : tasks()) e.task_costs.push_back(costOf(x, task));
    for (const double cost : e.task_costs) e.cost += cost / 3;
    if (!family_) e.cost = costOf(x, 1);
    return e;
  }

 private:
  static double costOf(const VectorXd& x, double task) {
    return std::pow(x[0] - 0.1 * task, 2) + 10 * std::pow(x[1] - x[0], 2) + std::abs(x[2]);
  }
  bool family_;
};

void runGeneration(Optimizer& optimizer, const Problem& problem) {
  for (const Candidate& c : optimizer.ask()) optimizer.tell(c.id, problem.evaluate(c.x));
}

/// Whether a search that was written down in the middle of a generation ends it like the one that
/// was not, though it is told what is left last first, and without having asked.
template <class Make>
void expectResumesInBetween(const Make& make, const Problem& problem) {
  const auto whole = make();
  for (int g = 0; g < 40; ++g) {
    const std::vector<Candidate> candidates = whole->ask();
    const size_t half = candidates.size() / 2;
    for (size_t k = 0; k < half; ++k) {
      whole->tell(candidates[k].id, problem.evaluate(candidates[k].x));
    }
    const auto resumed = make();
    resumed->restore(whole->save());
    ASSERT_EQ(resumed->save(), whole->save());
    for (size_t k = candidates.size(); k-- > half;) {
      resumed->tell(candidates[k].id, problem.evaluate(candidates[k].x));
    }
    for (size_t k = half; k < candidates.size(); ++k) {
      whole->tell(candidates[k].id, problem.evaluate(candidates[k].x));
    }
    ASSERT_EQ(resumed->save(), whole->save()) << g;
    if (candidates.empty()) continue;
    // What is over is not told again, nor is what has not come yet.
    const std::string before = whole->save();
    for (const std::uint64_t id :
         {candidates[0].id, candidates.back().id, candidates[0].id + 9999}) {
      EXPECT_THROW(whole->tell(id, problem.evaluate(candidates[0].x)), InputError);
    }
    EXPECT_EQ(whole->save(), before);
  }
}

/// Whether a search goes on as if nothing had been, from wherever it was written down.
template <class Make>
void expectResumes(const Make& make, const Problem& problem) {
  const auto whole = make();
  std::vector<std::string> states = {whole->save()};
  for (int g = 0; g < 60; ++g) {
    runGeneration(*whole, problem);
    states.push_back(whole->save());
  }
  for (const size_t from : {0, 1, 7, 40}) {
    const auto resumed = make();
    resumed->restore(states[from]);
    EXPECT_EQ(resumed->save(), states[from]);
    for (size_t g = from; g < from + 20; ++g) {
      runGeneration(*resumed, problem);
      ASSERT_EQ(resumed->save(), states[g + 1]) << from << " " << g;
    }
  }
}

TEST(AllOptimizers, GoOnFromWhatTheyWroteDown) {
  for (const OptimizerEntry& entry : allOptimizers()) {
    SCOPED_TRACE(entry.name);
    const Rough problem(entry.learns_families);
    expectResumes([&] { return entry.make(problem, {.seed = 3}); }, problem);
    expectResumesInBetween([&] { return entry.make(problem, {.seed = 3}); }, problem);
  }
}

/// What is said of a name that there is not.
std::string refusalOf(const char* name, std::optional<bool> families) {
  try {
    findOptimizer(name, families);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(AllOptimizers, AreFoundByWhatTheyLearn) {
  for (const OptimizerEntry& entry : allOptimizers()) {
    SCOPED_TRACE(entry.name);
    EXPECT_EQ(&findOptimizer(entry.name, entry.learns_families), &entry);
    const std::string said = refusalOf(entry.name.c_str(), !entry.learns_families);
    const std::string list = said.substr(said.find("There is: ") + 10) + ", ";
    const std::string other = entry.learns_families ? "bipop-cma-es, " : "contextual, ";
    EXPECT_NE(list.find(other), std::string::npos) << said;
    EXPECT_NE(list.find(entry.name + ", "), 0u) << said;
    EXPECT_EQ(list.find(", " + entry.name + ", "), std::string::npos) << said;
  }
  EXPECT_EQ(
      refusalOf("curv", true).find("no optimiser of families \"curv\". Did you mean \"curve\"?"),
      0u);
}

TEST(AllOptimizers, HaveAFamilyIfTheyLearnOne) {
  for (const OptimizerEntry& entry : allOptimizers()) {
    SCOPED_TRACE(entry.name);
    const Rough problem(entry.learns_families);
    const auto optimizer = entry.make(problem, {.seed = 3});
    EXPECT_FALSE(optimizer->family());
    EXPECT_EQ(optimizer->achieved().has_value(), entry.learns_families);
    for (int g = 0; g < 100; ++g) runGeneration(*optimizer, problem);
    ASSERT_EQ(optimizer->family().has_value(), entry.learns_families);
    if (!entry.learns_families) continue;
    EXPECT_EQ(optimizer->achieved(), optimizer->family()->cost);
  }
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
  EXPECT_EQ(o.x0, VectorXd::Constant(2, 0.25e308));
  EXPECT_NO_THROW(CmaEs{o});
}

TEST(CostsOfTasks, AreNaNWhereATrialSaysNothing) {
  const auto costs = [](const Evaluation& e) { return costsOfTasks("here", e, 3); };
  const auto nothing = [](const std::vector<double>& c) {
    return c.size() == 3 && std::isnan(c[0]) && std::isnan(c[1]) && std::isnan(c[2]);
  };
  EXPECT_EQ(costs({.cost = 2, .task_costs = {1, 2, 3}}), (std::vector<double>{1, 2, 3}));
  EXPECT_TRUE(nothing(costs({.cost = 2, .failed = true, .task_costs = {1, 2, 3}})));
  EXPECT_TRUE(nothing(costs({.cost = 2, .failed = true, .task_costs = {1}})));
  EXPECT_TRUE(nothing(costs({.cost = NAN})));
  EXPECT_TRUE(nothing(costs({})));
  // Without a mean, what it says of some tasks counts.
  const std::vector<double> some = costs({.cost = NAN, .task_costs = {-kInf, 7, NAN}});
  EXPECT_TRUE(std::isnan(some[0]) && std::isnan(some[2]));
  EXPECT_EQ(some[1], 7);
  for (const Evaluation& e : {Evaluation{.cost = 1}, Evaluation{.cost = 1, .task_costs = {1, 2}},
                              Evaluation{.cost = NAN, .task_costs = {1, 2, 3, 4}}}) {
    EXPECT_THROW(costs(e), InputError);
  }
  try {
    costs({.cost = 1, .task_costs = {1, 2}});
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "here: expected a trial's costs of 3 tasks, got 2");
  }
}

TEST(CmaEsOptionsOf, RefusesReversedBoundsByItself) {
  const FunctionProblem reversed(VectorXd::Ones(2), VectorXd::Zero(2), sphere);
  EXPECT_THROW(cmaEsOptions(reversed, {}), InputError);
  EXPECT_THROW(onePlusOneOptions(FunctionProblem(2, sphere), {.lambda = -1}), InputError);
}

}  // namespace
}  // namespace traceur::optim
