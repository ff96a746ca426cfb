#include "traceur/optim/cma_c.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

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

/// Of ten draws it tries the one that promises most, once n + 1 costs are known, and all of the
/// generation's draws pass the classifiers.
TEST(CmaC, AModelChoosesAmongDraws) {
  const auto slope = [](const VectorXd& x) {
    return Evaluation{.cost = x[0] + x[1], .violated = {false}};
  };
  double ahead = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const CmaCOptions o{.cma = {.x0 = VectorXd::Zero(2), .lambda = 8, .seed = seed},
                        .constraints = 1};
    CmaC without(o);
    CmaC with(modelCmaC(o));
    const auto first = without.ask();
    for (size_t k = 0; k < first.size(); ++k) EXPECT_EQ(with.ask()[k].x, first[k].x);
    step(without, slope);
    step(with, slope);
    EXPECT_EQ(with.cma().mean(), without.cma().mean());
    for (const Candidate& c : without.ask()) ahead += c.x.sum() / 160;
    for (const Candidate& c : with.ask()) ahead -= c.x.sum() / 160;
  }
  // The expected least of ten standard normal numbers is -1.54, and σ of x_1 + x_2 is √2 σ: 0.65.
  EXPECT_GT(ahead, 0.3);
}

/// Costs of infeasible trials teach nothing where they do not rank against those of feasible ones.
TEST(CmaC, AModelLearnsFromTheCostsThatRank) {
  for (const bool feasible_first : {true, false}) {
    const CmaCOptions o{
        .cma = {.x0 = VectorXd::Zero(2), .lambda = 8, .feasible_first = feasible_first},
        .constraints = 1};
    CmaC without(o);
    CmaC with(modelCmaC(o));
    for (CmaC* c : {&without, &with}) {
      step(*c, [](const VectorXd& x) { return Evaluation{.cost = x[0], .violated = {true}}; });
    }
    double apart = 0;
    for (size_t k = 0; k < 8; ++k) apart += (with.ask()[k].x - without.ask()[k].x).norm();
    EXPECT_EQ(apart == 0, feasible_first);
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
      [](auto& o) { o.collapsed = 0; },       [](auto& o) { o.tours = 0; },
      [](auto& o) { o.choices = 1; },         [](auto& o) { o.model_caution = 0; }};
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
                                      [](auto& o) { o.near_C = 0; },
                                      [](auto& o) { o.choices = 0; },
                                      [](auto& o) { o.model_width = 0; },
                                      [](auto& o) { o.model_noise = 0; },
                                      [](auto& o) { o.model_caution = -0.01; },
                                      [](auto& o) { o.model_caution = INFINITY; },
                                      [](auto& o) { o.model_points = 0; }};
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

/// The classifiers of one generation by the rules of the header, without bounds.
struct TextbookCmaC {
  struct Known {
    VectorXd x;
    std::vector<int> labels;  // 1 holds, -1 violated, 0 unknown
  };
  CmaCOptions o;
  std::vector<Known> known = {};
  std::vector<double> gamma = {0, 0};
  std::vector<ClassifierReport> reports = {{}, {}};
  bool seen_feasible = false;
  // Of this generation.
  std::vector<std::optional<SvmClassifier>> svm = {};
  VectorXd center = {};
  MatrixXd metric = {};

  void begin(const CmaState& s) {
    const auto n = static_cast<double>(s.mean.size());
    const bool local = o.follow && seen_feasible;
    center = s.mean;
    metric = o.cma.scale.cwiseInverse().asDiagonal();
    if (local) metric = s.D.cwiseInverse().asDiagonal() * s.B.transpose() * metric / s.sigma;
    svm.assign(2, std::nullopt);
    for (int j = 0; j < 2; ++j) {
      std::vector<int> chosen;
      bool enough = true;
      for (const int label : {1, -1}) {
        std::vector<std::pair<double, int>> all;
        for (int k = 0; k < static_cast<int>(known.size()); ++k) {
          if (known[k].labels[j] != label) continue;
          all.emplace_back((metric * (known[k].x - center)).norm(), k);
        }
        enough = enough && static_cast<int>(all.size()) >= o.least_labels;
        std::sort(all.begin(), all.end());
        const int most = local ? o.neighbours : o.most_points;
        if (static_cast<int>(all.size()) > most) all.resize(most);
        for (const auto& [distance, k] : all) chosen.push_back(k);
      }
      if (!enough) continue;
      std::sort(chosen.begin(), chosen.end());
      MatrixXd X(s.mean.size(), chosen.size());
      std::vector<bool> inside;
      for (const int k : chosen) {
        X.col(static_cast<Eigen::Index>(inside.size())) = metric * (known[k].x - center);
        inside.push_back(known[k].labels[j] == 1);
      }
      if (gamma[j] == 0 && !local) {
        const double width =
            o.wide_width * std::sqrt(n / 2) * (o.width_at_first_use ? s.sigma : o.cma.sigma);
        gamma[j] = 1 / (2 * width * width);
      }
      svm[j].emplace(
          X, inside,
          SvmOptions{.gamma = local ? 1 / (2 * n * o.near_width * o.near_width) : gamma[j],
                     .C = local ? o.near_C : o.wide_C,
                     .balanced = o.balanced});
    }
  }

  double decision(int j, const VectorXd& x) const {
    return svm[j]->decision(metric * (x - center));
  }

  double acceptance(const VectorXd& x) const {
    double p = 1;
    for (int j = 0; j < 2; ++j) {
      if (!svm[j] || reports[j].agreement < o.least_agreement) continue;
      p *= 1 / (1 + std::exp(-o.alpha * decision(j, x)));
    }
    return p;
  }

  void learn(const VectorXd& x, const Evaluation& e) {
    Known trial{x, {0, 0}};
    for (int j = 0; j < 2 && !e.failed; ++j) {
      trial.labels[j] = e.violated.empty() || !e.violated[j] ? 1 : -1;
    }
    for (int j = 0; j < 2; ++j) {
      reports[j].active = svm[j].has_value();
      if (!svm[j] || trial.labels[j] == 0) continue;
      const bool right = (decision(j, x) > 0) == (trial.labels[j] == 1);
      ++reports[j].judged;
      reports[j].agreed += right;
      reports[j].agreement = 0.95 * reports[j].agreement + (right ? 0.05 : 0);
    }
    if (!e.failed) known.push_back(trial);
  }
};

TEST(CmaC, TrainsAsksAndJudgesItsClassifiersAsTheHeaderSays) {
  const CmaEsOptions cma{.x0 = VectorXd{{-1, 2, 0}},
                         .sigma = 0.5,
                         .scale = VectorXd{{1, 2, 0.5}},
                         .lambda = 8,
                         .seed = 5};
  CmaCOptions o{.cma = cma,
                .constraints = 2,
                .alpha = 3,
                .least_labels = 3,
                .wide_width = 0.7,
                .follow = false,
                .neighbours = 9,
                .most_points = 14,
                .least_agreement = 0.72,  // of none before it has judged
                .restarts = 0};
  CmaCOptions frozen = o;
  frozen.width_at_first_use = true;
  frozen.balanced = false;
  frozen.wide_C = 3;
  frozen.least_agreement = 0.7;  // of each that has not
  CmaCOptions following = o;
  following.follow = true;
  for (const CmaCOptions& options : {o, frozen, following}) {
    CmaC c(options);
    TextbookCmaC book{options};
    int failed = 0;
    int ignored = 0;
    for (int g = 0; g < 25; ++g) {
      book.begin(c.cma().state());
      const std::vector<Candidate> candidates = c.ask();
      for (const Candidate& p : candidates) {
        ASSERT_NEAR(c.acceptance(p.x), book.acceptance(p.x), 1e-9) << g;
        const VectorXd beside = p.x + VectorXd{{0.3, -0.2, 0.1}};
        ASSERT_NEAR(c.acceptance(beside), book.acceptance(beside), 1e-9) << g;
      }
      for (int j = 0; j < 2; ++j) {
        ignored += book.svm[j] && book.reports[j].agreement < options.least_agreement;
      }
      bool feasible = false;
      std::vector<Evaluation> told;
      for (const Candidate& p : candidates) {
        Evaluation e{.cost = (p.x - VectorXd{{-2, 4, 0}}).squaredNorm(),
                     .violated = {p.x[0] + 0.2 * std::sin(9 * p.x[2]) < 0, p.x[1] > 2.5}};
        e.failed = std::sin(1e3 * p.x[2]) > 0.9;
        if (p.x[2] > 0.7) e.violated.clear();
        failed += e.failed;
        feasible = feasible || e.feasible();
        told.push_back(e);
      }
      for (size_t k = 0; k < told.size(); ++k) c.tell(candidates[k].id, told[k]);
      for (size_t k = 0; k < told.size(); ++k) book.learn(candidates[k].x, told[k]);
      book.seen_feasible = book.seen_feasible || feasible;
      for (int j = 0; j < 2; ++j) {
        const ClassifierReport& report = c.classifiers()[j];
        EXPECT_EQ(report.active, book.reports[j].active);
        ASSERT_EQ(report.judged, book.reports[j].judged) << g;
        ASSERT_EQ(report.agreed, book.reports[j].agreed) << g;
        EXPECT_NEAR(report.agreement, book.reports[j].agreement, 1e-12);
      }
      EXPECT_EQ(c.refused(), c.cma().state().refused);
    }
    EXPECT_TRUE(book.seen_feasible);
    EXPECT_GT(failed, 0);
    EXPECT_GT(ignored, 0);
    EXPECT_GT(book.reports[0].judged, 50u);
    EXPECT_GT(book.reports[1].judged, 50u);
  }
}

TEST(CmaC, ForgetsTheOldestOfTooManyTrials) {
  // The only violation is the first of so many trials, and the nearest to the start.
  std::vector<Trial> experience = {{VectorXd::Zero(1), {.cost = 1, .violated = {true}}}};
  for (int k = 1; k < 4000; ++k) {
    experience.push_back({VectorXd::Constant(1, 1 + k), {.cost = 1, .violated = {false}}});
  }
  const CmaEsOptions cma{.x0 = VectorXd::Zero(1), .sigma = 1};
  for (const bool more : {false, true}) {
    if (more) experience.push_back({VectorXd::Ones(1), {.cost = 1, .violated = {false}}});
    CmaC c({.cma = cma, .constraints = 1, .experience = experience, .most_points = 5});
    c.ask();
    EXPECT_EQ(c.acceptance(VectorXd::Zero(1)) == 1, more);
  }
  // One that says nothing takes no place.
  experience.back().evaluation.failed = true;
  CmaC c({.cma = cma, .constraints = 1, .experience = experience, .most_points = 5});
  c.ask();
  EXPECT_LT(c.acceptance(VectorXd::Zero(1)), 1);
}

TEST(CmaC, KeepsTheProbabilityOfTheBoxesInside) {
  // Behind a mirror is the same trial: what is known of it counts where the search is.
  const Eigen::Vector2d lower(-1, -1);
  const Eigen::Vector2d upper(1, 1);
  const std::vector<Trial> experience = {
      {Eigen::Vector2d(-0.9, 0.2), {.cost = 1, .violated = {true}}},
      {Eigen::Vector2d(0.9, 0.2), {.cost = 1, .violated = {false}}}};
  CmaC c({.cma = {.x0 = VectorXd::Zero(2), .sigma = 0.5, .lower = lower, .upper = upper},
          .constraints = 1,
          .experience = experience,
          .wide_width = 1});
  c.ask();
  for (const double x : {0.0, 0.4, 0.8}) {
    const double right = c.acceptance(Eigen::Vector2d(x, 0.2));
    EXPECT_NEAR(right + c.acceptance(Eigen::Vector2d(-x, 0.2)), 1, 1e-9) << x;
    EXPECT_GE(right, 0.5 - 1e-9);
  }
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

TEST(CmaC, BeginsAnewOnlyWhereThatMayHelp) {
  const CmaEsOptions cma{
      .x0 = VectorXd::Zero(2), .sigma = 1, .lambda = 4, .termination = {.maxiter = 3}};
  const CmaCOptions o{.cma = cma, .constraints = 1, .restarts = 2};
  const auto descents = [&](const CmaCOptions& options, const auto& evaluate, int generations) {
    CmaC c(options);
    for (int g = 0; g < generations; ++g) {
      for (const Candidate& p : c.ask()) c.tell(p.id, evaluate(g, p));
    }
    return c.descents();
  };
  const auto good = [](int, const Candidate& p) {
    return Evaluation{.cost = p.x.norm(), .violated = {false}};
  };
  const auto once = [](int g, const Candidate& p) {
    return Evaluation{.cost = p.x.norm(), .violated = {g == 0 && p.id == 1}};
  };
  EXPECT_EQ(descents(o, good, 12), 1);  // nothing was ever violated
  EXPECT_EQ(descents(o, once, 2), 1);
  EXPECT_EQ(descents(o, once, 3), 2);
  EXPECT_EQ(descents(o, once, 6), 3);
  EXPECT_EQ(descents(o, once, 30), 3);
  CmaCOptions failing = o;
  failing.cma.termination = {.tolallfailed = 5};
  EXPECT_EQ(descents(
                failing,
                [](int g, const Candidate&) {
                  return Evaluation{.cost = 1, .violated = {true}, .failed = g > 0};
                },
                20),
            1);
  // One that does not follow begins anew once it has shrunk without a feasible trial.
  CmaCOptions blind = o;
  blind.follow = false;
  blind.cma.termination = {.tolx = 0, .tolfun = 0, .tolfunhist = 0};
  blind.collapsed = 0.3;
  const auto never = [](int, const Candidate& p) {
    return Evaluation{.cost = p.x.norm(), .violated = {true}};
  };
  EXPECT_EQ(descents(blind, never, 150), 3);
  EXPECT_EQ(descents(blind, once, 150), 1);
  CmaCOptions by_cost = blind;
  by_cost.cma.feasible_first = false;
  EXPECT_EQ(descents(by_cost, never, 150), 1);
}

TEST(CmaC, ToursOtherStartsAndGoesOnWithTheBest) {
  // Feasible is a band about each corner of a square; one corner is the cheapest.
  const auto evaluate = [](const VectorXd& x) {
    const VectorXd corner = x.cwiseSign();
    const double distance = (x - corner).norm();
    return Evaluation{.cost = distance + 0.7 * corner[0] + 0.3 * corner[1],
                      .violated = {distance > 0.4}};
  };
  for (const int tours : {0, 1, 3}) {
    int best_was_not_last = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      CmaCOptions o{
          .cma = {.x0 = Eigen::Vector2d(0.1, -0.1), .sigma = 1, .lambda = 8, .seed = seed},
          .constraints = 1,
          .restarts = 20,
          .collapsed = 0.1,
          .tours = tours};
      CmaC c(o);
      struct Descent {
        std::uint64_t seed = 0;
        double best = std::numeric_limits<double>::infinity();
        std::uint64_t generations = 0;
      };
      std::vector<Descent> all = {{c.cma().options().seed}};
      bool back = false;
      for (int g = 0; g < 1500 && !back; ++g) {
        // While it tours, what has collapsed has ended.
        EXPECT_GE(c.cma().state().sigma * c.cma().longestAxis(), 0.1);
        for (const Candidate& p : c.ask()) {
          const Evaluation e = evaluate(p.x);
          if (e.feasible()) all.back().best = std::min(all.back().best, e.cost);
          c.tell(p.id, e);
        }
        ++all.back().generations;
        const std::uint64_t now = c.cma().options().seed;
        back = c.cma().state().sigma * c.cma().longestAxis() < 0.1;
        if (now != all.back().seed && !back) all.push_back({now});
      }
      ASSERT_TRUE(back);
      std::erase_if(all, [](const Descent& d) { return !std::isfinite(d.best); });
      EXPECT_EQ(all.size(), static_cast<size_t>(tours) + 1);
      const auto best = std::min_element(
          all.begin(), all.end(), [](const auto& a, const auto& b) { return a.best < b.best; });
      EXPECT_EQ(c.cma().options().seed, best->seed);
      EXPECT_EQ(c.cma().state().generation, best->generations);
      EXPECT_EQ(c.cma().state().held_cost, best->best);
      best_was_not_last += best + 1 != all.end();
      // It goes on there.
      const int descents = c.descents();
      for (int g = 0; g < 5; ++g) {
        for (const Candidate& p : c.ask()) c.tell(p.id, evaluate(p.x));
      }
      EXPECT_EQ(c.descents(), descents);
      EXPECT_EQ(c.cma().state().generation, best->generations + 5);
    }
    EXPECT_EQ(best_was_not_last > 0, tours > 0);
  }
}

TEST(CmaC, SaysWhatIsWrongWithAnOption) {
  const auto message = [](auto change) -> std::string {
    CmaCOptions o{.cma = {.x0 = VectorXd::Zero(2)}, .constraints = 1};
    change(o);
    try {
      const CmaC c(std::move(o));
      return "";
    } catch (const InputError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(message([](auto& o) { o.constraints = -1; }),
            "cma-c: expected constraints ≥ 0, got -1");
  EXPECT_EQ(message([](auto& o) { o.wide_width = INFINITY; }),
            "cma-c: expected a finite wide_width > 0, got inf");
  EXPECT_EQ(message([](auto& o) { o.tours = -1; }), "cma-c: expected tours ≥ 0, got -1");
  const auto knows = [&](const Trial& trial) {
    return message([&](auto& o) { o.experience = {{VectorXd::Zero(2), {}}, trial}; });
  };
  EXPECT_EQ(knows({VectorXd::Ones(2), {.cost = 1, .violated = {true}}}), "");
  EXPECT_EQ(knows({VectorXd::Ones(3), {}}), "cma-c: experience[1] has 3 variables, x0 has 2");
  EXPECT_EQ(knows({Eigen::Vector2d(0, NAN), {}}), "cma-c: experience[1] is not finite");
  EXPECT_EQ(knows({VectorXd::Ones(2), {.cost = 1, .violated = {true, true}}}),
            "cma-c: experience[1] reports on 2 constraints, expected 1 at most");

  CmaC c({.cma = {.x0 = VectorXd::Zero(2), .lambda = 4}, .constraints = 2});
  const std::string before = c.save();
  EXPECT_THROW(c.tell(0, {.cost = 1, .violated = {true}}), InputError);
  EXPECT_THROW(c.tell(4, {.cost = 1}), InputError);
  EXPECT_EQ(c.save(), before);
  EXPECT_NO_THROW(c.tell(0, {.cost = 1}));
  EXPECT_THROW(c.tell(0, {.cost = 1}), InputError);
}

TEST(CmaC, DissertationPresetIsWhatIsPrinted) {
  const CmaCOptions o = dissertationCmaC({.x0 = VectorXd::Zero(8), .sigma = 5}, 3);
  EXPECT_EQ(o.cma.x0.size(), 8);
  EXPECT_EQ(o.cma.sigma, 5);
  EXPECT_FALSE(o.cma.feasible_first);
  EXPECT_FALSE(o.cma.likeliest);
  EXPECT_EQ(o.constraints, 3);
  EXPECT_FALSE(o.balanced);
  EXPECT_DOUBLE_EQ(o.wide_width * std::sqrt(8 / 2.0), 0.1);
  EXPECT_TRUE(o.width_at_first_use);
  EXPECT_FALSE(o.follow);
  EXPECT_EQ(o.most_points, 0);
  EXPECT_EQ(o.least_agreement, 0);
  EXPECT_EQ(o.restarts, 0);
  EXPECT_DOUBLE_EQ(dissertationCmaC({}, 1).wide_width, 0.1 * std::sqrt(2));
}

}  // namespace
}  // namespace traceur::optim
