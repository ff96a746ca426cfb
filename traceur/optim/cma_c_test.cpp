#include "traceur/optim/cma_c.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/test_functions.h"

namespace traceur::optim {
namespace {

/// Feasible is x + y ≥ 1; the cost leads away from it.
Evaluation halfPlane(const VectorXd& x) {
  return {.cost = x.squaredNorm(), .violated = {x[0] + x[1] < 1}};
}

template <typename F>
void step(CmaC& cma, const F& evaluate) {
  for (const Candidate& c : cma.ask()) cma.tell(c.id, evaluate(c.x));
}

TEST(CmaC, WithoutConstraintsIsCmaEsToTheBit) {
  const CmaEsOptions options{.x0 = VectorXd::Ones(5), .sigma = 0.5, .seed = 7};
  CmaEs plain(options);
  CmaC c({.cma = options});
  for (int g = 0; g < 30; ++g) {
    for (const Candidate& p : plain.ask()) plain.tell(p.id, {.cost = rosenbrock(p.x)});
    step(c, [](auto& x) { return Evaluation{.cost = rosenbrock(x)}; });
    ASSERT_EQ(c.cma().state().mean, plain.state().mean);
  }
}

TEST(CmaC, TriesFewerInfeasiblePointsThanCmaEs) {
  int infeasible[2] = {0, 0};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const CmaEsOptions options{.x0 = VectorXd::Constant(2, 3), .sigma = 1, .seed = seed};
    CmaEs plain(options);
    CmaC c({.cma = options, .constraints = 1});
    double best = 9;
    for (int g = 0; g < 60; ++g) {
      for (const Candidate& p : plain.ask()) {
        const Evaluation e = halfPlane(p.x);
        infeasible[0] += !e.feasible();
        plain.tell(p.id, e);
      }
      step(c, [&](auto& x) {
        Evaluation e = halfPlane(x);
        infeasible[1] += !e.feasible();
        if (e.feasible()) best = std::min(best, e.cost);
        return e;
      });
    }
    EXPECT_LT(best, 0.5 + 1e-4);
    EXPECT_GT(c.refused(), 0);
    EXPECT_GT(c.classifiers()[0].agreement, 0.6);
    EXPECT_EQ(c.classifiers()[0].active, true);
  }
  EXPECT_LT(infeasible[1], infeasible[0] / 2);
}

TEST(CmaC, ExperienceKeepsTheFirstGenerationFeasible) {
  const CmaEsOptions options{.x0 = VectorXd::Zero(2), .sigma = 1};
  CmaC first({.cma = options, .constraints = 1});
  std::vector<Trial> experience;
  for (int g = 0; g < 30; ++g) {
    step(first, [&](auto& x) {
      experience.push_back({x, halfPlane(x)});
      return halfPlane(x);
    });
  }
  // A second constraint is new: nothing is known of it.
  CmaC again({.cma = options, .constraints = 2, .experience = experience});
  CmaC fresh({.cma = options, .constraints = 2});
  const auto count = [](CmaC& c) {
    int feasible = 0;
    for (const Candidate& p : c.ask()) feasible += halfPlane(p.x).feasible();
    return feasible;
  };
  EXPECT_GT(count(again), count(fresh));
  EXPECT_LT(again.acceptance(Eigen::Vector2d(0, 0)), 0.5);
  EXPECT_GT(again.acceptance(Eigen::Vector2d(0.8, 0.8)), 0.5);
}

TEST(CmaC, WrongExperienceDoesNotLockTheFeasibleRegionOut) {
  // Every label of the experience is a lie.
  std::vector<Trial> lies;
  for (int i = -8; i <= 8; ++i) {
    for (int j = -8; j <= 8; ++j) {
      const Eigen::Vector2d x(i / 4.0, j / 4.0);
      lies.push_back({x, {.cost = 0, .violated = {x.sum() >= 1}}});
    }
  }
  int solved = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CmaC c({.cma = {.x0 = VectorXd::Zero(2), .sigma = 0.5, .seed = seed},
            .constraints = 1,
            .experience = lies});
    double best = 9;
    for (int g = 0; g < 400; ++g) {
      step(c, [&](auto& x) {
        if (halfPlane(x).feasible()) best = std::min(best, x.squaredNorm());
        return halfPlane(x);
      });
    }
    solved += best < 0.51;
  }
  EXPECT_GE(solved, 4);
}

TEST(CmaC, AConstraintNeverSatisfiedEndsInAReportedStop) {
  class Never : public FunctionProblem {
   public:
    Never() : FunctionProblem(2, sphere) {}
    std::vector<std::string> constraints() const override { return {"never"}; }
    Evaluation evaluate(const VectorXd& x) const override {
      return {.cost = sphere(x), .violated = {true}};
    }
  };
  CmaC c({.cma = {.x0 = VectorXd::Ones(2), .sigma = 1}, .constraints = 1, .restarts = 2});
  const Summary s = minimise(Never(), c, {.budget = 20000});
  EXPECT_EQ(s.end, End::kOptimizer);
  EXPECT_EQ(c.descents(), 3);
}

TEST(CmaC, DissertationPresetNeitherRanksFeasibilityNorRestarts) {
  CmaC c(dissertationCmaC({.x0 = VectorXd::Zero(2), .sigma = 5, .lambda = 8}, 1));
  EXPECT_FALSE(c.options().cma.feasible_first);
  EXPECT_FALSE(c.options().cma.try_start);
  EXPECT_EQ(c.options().restarts, 0);
  for (int g = 0; g < 10; ++g) step(c, halfPlane);
  EXPECT_TRUE(c.classifiers()[0].active);
  EXPECT_EQ(c.descents(), 1);
}

TEST(CmaC, AKernelBeyondNumbersIsNone) {
  for (const double width : {1e-200, 1e200}) {  // 1 / width^2: infinite; 0
    CmaCOptions o = dissertationCmaC({.x0 = VectorXd::Zero(2), .sigma = 5, .lambda = 8}, 1);
    o.wide_width = width;
    CmaC c(o);
    for (int g = 0; g < 10; ++g) step(c, halfPlane);
    EXPECT_FALSE(c.classifiers()[0].active) << width;
  }
}

TEST(CmaC, OptionsEndWhereTheySay) {
  using Change = std::function<void(CmaCOptions&)>;
  const auto made = [](const Change& change) {
    CmaCOptions o{.cma = {.x0 = VectorXd::Zero(3)}, .constraints = 1};
    change(o);
    return CmaC(o).options();
  };
  EXPECT_EQ(made([](auto&) {}).neighbours, 20 + 2 * 3);
  EXPECT_TRUE(made([](auto&) {}).cma.hold_feasible);
  EXPECT_TRUE(made([](auto&) {}).cma.try_start);
  EXPECT_FALSE(made([](auto& o) { o.follow = false; }).cma.hold_feasible);
  EXPECT_FALSE(made([](auto& o) { o.cma.feasible_first = false; }).cma.hold_feasible);
  EXPECT_FALSE(made([](auto& o) { o.constraints = 0; }).cma.try_start);
  const std::vector<Change> last = {
      [](auto& o) { o.least_labels = 1; },    [](auto& o) { o.neighbours = 0; },
      [](auto& o) { o.most_points = 0; },     [](auto& o) { o.least_agreement = 0; },
      [](auto& o) { o.least_agreement = 1; }, [](auto& o) { o.restarts = 0; },
      [](auto& o) { o.collapsed = 0; },       [](auto& o) { o.tours = 0; }};
  for (size_t i = 0; i < last.size(); ++i) EXPECT_NO_THROW(made(last[i])) << i;
  const std::vector<Change> beyond = {[](auto& o) { o.least_labels = 0; },
                                      [](auto& o) { o.neighbours = -1; },
                                      [](auto& o) { o.most_points = -1; },
                                      [](auto& o) { o.least_agreement = -0.01; },
                                      [](auto& o) { o.least_agreement = 1.01; },
                                      [](auto& o) { o.restarts = -1; },
                                      [](auto& o) { o.collapsed = -0.01; },
                                      [](auto& o) { o.collapsed = NAN; },
                                      [](auto& o) { o.tours = -1; },
                                      [](auto& o) { o.alpha = 0; },
                                      [](auto& o) { o.alpha = INFINITY; },
                                      [](auto& o) { o.wide_C = 0; },
                                      [](auto& o) { o.near_width = 0; },
                                      [](auto& o) { o.near_C = 0; }};
  for (size_t i = 0; i < beyond.size(); ++i) EXPECT_THROW(made(beyond[i]), InputError) << i;
}

TEST(CmaC, RefusesWhatCannotBeUsed) {
  const CmaEsOptions cma{.x0 = VectorXd::Zero(2)};
  EXPECT_THROW(CmaC({.cma = cma, .constraints = -1}), InputError);
  EXPECT_THROW(CmaC({.cma = cma, .constraints = 1, .alpha = NAN}), InputError);
  EXPECT_THROW(CmaC({.cma = cma, .constraints = 1, .wide_width = 0}), InputError);
  EXPECT_THROW(CmaC({.cma = cma, .constraints = 1, .experience = {{VectorXd::Zero(3), {}}}}),
               InputError);
  EXPECT_THROW(CmaC({.cma = cma,
                     .constraints = 1,
                     .experience = {{VectorXd::Zero(2), {.cost = 1, .violated = {true, true}}}}}),
               InputError);
  CmaC c({.cma = cma, .constraints = 1});
  EXPECT_THROW(c.tell(c.ask()[0].id, {.cost = 1, .violated = {true, false}}), InputError);
}

TEST(CmaC, EveryDescentBeginsAboutTheStartInsideTheBounds) {
  const CmaEsOptions cma{.x0 = Eigen::Vector2d(1, 2),
                         .sigma = 0.5,
                         .scale = Eigen::Vector2d(1, 10),
                         .lower = Eigen::Vector2d(0.9, -100),
                         .lambda = 4,
                         .seed = 7,
                         .termination = {.maxiter = 1}};
  CmaCOptions o{.cma = cma, .constraints = 1, .follow = false, .restarts = 6};
  CmaC c(o);
  for (int descent = 0; descent <= 6; ++descent) {
    EXPECT_EQ(c.descents(), descent + 1);
    VectorXd x0 = cma.x0;
    std::uint64_t seed = 7;
    if (descent > 0) {
      Random random(7, kDescentStream, static_cast<std::uint64_t>(descent));
      x0[0] = std::max(0.9, 1 + 0.5 * random.normal());
      x0[1] = 2 + 5 * random.normal();
      seed = random.bits();
    }
    EXPECT_EQ(c.cma().options().x0, x0) << descent;
    EXPECT_EQ(c.cma().options().seed, seed) << descent;
    for (const Candidate& p : c.ask()) {
      EXPECT_EQ(p.id / 4, static_cast<std::uint64_t>(descent));
      c.tell(p.id, {.cost = 1 + p.x[0], .violated = {true}});
    }
  }
  EXPECT_EQ(c.descents(), 7);
  ASSERT_TRUE(c.stopped());
  EXPECT_EQ(c.stopped()->reason, "maxiter");

  // Two bounds: the upper one holds, too.
  o.cma.upper = Eigen::Vector2d(1.1, 3);
  CmaC boxed(o);
  int held = 0;
  for (int descent = 0; descent < 6; ++descent) {
    for (const Candidate& p : boxed.ask()) boxed.tell(p.id, {.cost = 1, .violated = {true}});
    EXPECT_TRUE((boxed.cma().options().x0.array() <= o.cma.upper.array()).all());
    held += boxed.cma().options().x0[1] == 3;
  }
  EXPECT_GT(held, 0);
}

}  // namespace
}  // namespace traceur::optim
