#include "traceur/optim/one_plus_one.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_constants.h"

namespace traceur::optim {
namespace {

TEST(OnePlusOne, TriesItsStartFirst) {
  OnePlusOne o({.x0 = VectorXd::LinSpaced(3, 1, 2), .sigma = 1});
  EXPECT_EQ(o.ask()[0].x, VectorXd::LinSpaced(3, 1, 2));
  o.tell(0, {.cost = 1});
  EXPECT_NE(o.ask()[0].x, VectorXd::LinSpaced(3, 1, 2));
}

/// The equations of the header, with C itself and without bounds.
struct TextbookOnePlusOne {
  OnePlusOneOptions o;
  int n;
  VectorXd parent, p_c;
  MatrixXd C, v;
  double sigma, p = 2.0 / 11, cost = 0;
  int violations = -1;          // no parent yet
  std::vector<double> parents;  // costs, of as many violations
  int failures = 0, worse = 0;  // how often each was learned from

  explicit TextbookOnePlusOne(const OnePlusOneOptions& options)
      : o(options),
        n(static_cast<int>(o.x0.size())),
        parent(o.x0),
        p_c(VectorXd::Zero(n)),
        C(MatrixXd::Identity(n, n)),
        v(MatrixXd::Zero(n, o.constraints + 1)),
        sigma(o.sigma) {}

  void learn(const VectorXd& x, const Evaluation& e) {
    std::vector<int> violated;
    for (int j = 0; j < o.constraints; ++j) {
      if (!e.failed && e.violated[j]) violated.push_back(j);
    }
    if (e.failed) violated = {o.constraints};
    int count = static_cast<int>(violated.size());
    if (e.failed) {
      count = o.constraints + 1;
    } else if (!o.feasible_first) {
      count = 0;
    }
    const VectorXd y = (x - parent) / sigma;
    if (violations < 0) {
      violations = count;
      cost = e.failed ? 0 : e.cost;
    } else if (count > 0 && violations == 0) {
      if (o.active_constraints) learnFailure(violated, y);
    } else if (!e.failed) {
      const bool success = count < violations || (count == violations && e.cost <= cost);
      p = 11.0 / 12 * p + (success ? 1.0 / 12 : 0);
      if (success) {
        learnSuccess(y);
        parents.push_back(cost);
        if (count != violations) parents.clear();
        parent = x;
        violations = count;
        cost = e.cost;
      } else if (count == violations && parents.size() >= 5 && o.active &&
                 e.cost > parents[parents.size() - 5]) {
        ++worse;
        const double squared = y.dot(C.inverse() * y);
        double c = 0.4 / (std::pow(n, 1.6) + 1);
        if (2 * squared > 1) c = std::min(c, 1 / (2 * squared - 1));
        C = (1 + c) * C - c * y * y.transpose();
      }
      sigma *= std::exp((p - 2.0 / 11) / ((1 + n / 2.0) * 9 / 11));
    }
  }

  void learnSuccess(const VectorXd& y) {
    const double c_c = 2.0 / (n + 2), c_cov = 2.0 / (n * n + 6.0);
    p_c *= 1 - c_c;
    if (p < 0.44) p_c += std::sqrt(c_c * (2 - c_c)) * y;
    C = (1 - c_cov + (p < 0.44 ? 0 : c_cov * c_c * (2 - c_c))) * C + c_cov * p_c * p_c.transpose();
  }

  void learnFailure(const std::vector<int>& violated, const VectorXd& y) {
    ++failures;
    const double beta = 0.1 / ((n + 2) * static_cast<double>(violated.size()));
    for (const int j : violated) {
      v.col(j) = (n + 1) * v.col(j) / (n + 2) + y / (n + 2);
    }
    for (const int j : violated) {
      const VectorXd d = v.col(j);
      C -= (2 * beta - beta * beta) / d.dot(C.inverse() * d) * d * d.transpose();
    }
  }
};

TEST(OnePlusOne, UpdatesAsItsEquationsSay) {
  struct Case {
    const char* what;
    OnePlusOneOptions o;
    bool fails;
  };
  const VectorXd x0 = VectorXd::LinSpaced(4, 1, 2);
  const VectorXd outside = x0 - 0.7 * VectorXd::Unit(4, 0);
  for (const Case& c : std::initializer_list<Case>{
           {"free", {.x0 = x0, .sigma = 0.5}, false},
           {"small step, so that the path stalls", {.x0 = x0, .sigma = 1e-3}, false},
           {"passive", {.x0 = x0, .sigma = 0.5, .active = false}, false},
           {"constraints", {.x0 = x0, .sigma = 0.5, .constraints = 2}, false},
           {"deaf to constraints",
            {.x0 = x0, .sigma = 0.5, .constraints = 2, .active_constraints = false},
            false},
           {"infeasible start", {.x0 = outside, .sigma = 0.5, .constraints = 2}, true},
           {"by cost alone",
            {.x0 = x0, .sigma = 0.5, .constraints = 2, .feasible_first = false},
            true}}) {
    SCOPED_TRACE(c.what);
    OnePlusOne one(c.o);
    TextbookOnePlusOne book(c.o);
    for (int t = 0; t < 250; ++t) {
      const Candidate candidate = one.ask()[0];
      const VectorXd& x = candidate.x;
      Evaluation e{.cost = 0};
      for (int j = 0; j < 4; ++j) e.cost += std::pow(10, j) * x[j] * x[j];
      e.failed = c.fails && std::sin(1e4 * x[0]) > 0.7;
      if (c.o.constraints > 0) e.violated = {x[0] < 0.5, x[0] + x[1] < 0.8};
      one.tell(candidate.id, e);
      book.learn(x, e);
      const OnePlusOneState& s = one.state();
      ASSERT_LE((s.parent - book.parent).norm(), 1e-9) << t;
      ASSERT_NEAR(s.sigma, book.sigma, 1e-9 * book.sigma) << t;
      ASSERT_NEAR(s.p_success, book.p, 1e-9) << t;
      ASSERT_LE((s.shape.covariance() - book.C).norm(), 1e-7 * book.C.norm()) << t;
      ASSERT_EQ(s.violations, book.violations) << t;
      ASSERT_EQ(s.cost, book.cost) << t;
    }
    EXPECT_EQ(book.worse > 0, c.o.active);
    const bool hears = c.o.constraints > 0 && c.o.active_constraints;
    EXPECT_EQ(book.failures > 0, hears);
  }
}

TEST(OnePlusOne, TheFifthLastParentIsTheOldestOfTheQueue) {
  OnePlusOne o({.x0 = VectorXd::Zero(3), .sigma = 1});
  for (int cost = 10; cost > 0; --cost) o.tell(o.ask()[0].id, {.cost = double(cost)});
  // Parents were 10, 9, …, 2, and 1 is the parent now: the oldest go first.
  EXPECT_EQ(o.state().ancestors, (std::vector<double>{6, 5, 4, 3, 2}));
  // Worse than the parent but better than the fifth-last teaches no shape, worse does.
  const MatrixXd before = o.state().shape.L;
  o.tell(o.ask()[0].id, {.cost = 5.5});
  EXPECT_EQ(o.state().shape.L, before);
  o.tell(o.ask()[0].id, {.cost = 6.5});
  EXPECT_NE(o.state().shape.L, before);
}

TEST(OnePlusOne, InfeasibleTrialsMoveNeitherTheStepNorTheParent) {
  OnePlusOne o({.x0 = VectorXd::Zero(2), .sigma = 1, .constraints = 1});
  o.tell(0, {.cost = 0});
  for (int k = 0; k < 200; ++k) {
    const Candidate c = o.ask()[0];
    // What lies right of the parent is infeasible, what lies left is dearer.
    const OnePlusOneState before = o.state();
    o.tell(c.id, {.cost = 1, .violated = {c.x[0] > 0}});
    EXPECT_EQ(o.state().parent, before.parent);
    if (c.x[0] > 0) {
      EXPECT_EQ(o.state().sigma, before.sigma);
      EXPECT_EQ(o.state().p_success, before.p_success);
    }
  }
  const MatrixXd C = o.state().shape.covariance();
  EXPECT_LT(C(0, 0), 0.5 * C(1, 1));  // the step across the wall has shrunk
}

TEST(OnePlusOne, StopsOrStartsAnew) {
  OnePlusOne once({.x0 = VectorXd::Zero(2), .sigma = 1});
  OnePlusOne again({.x0 = VectorXd::Zero(2), .sigma = 1, .restarts = 1});
  int count[2] = {0, 0};
  for (OnePlusOne* o : {&once, &again}) {
    while (!o->stopped() && count[o == &again] < 100000) {
      const Candidate c = o->ask()[0];
      o->tell(c.id, {.cost = c.x.norm()});
      ++count[o == &again];
    }
    EXPECT_EQ(o->stopped()->reason, "tolx");
  }
  EXPECT_GT(count[1], 1.5 * count[0]);

  OnePlusOne plateau({.x0 = VectorXd::Zero(2), .sigma = 1});
  while (!plateau.stopped()) plateau.tell(plateau.ask()[0].id, {.cost = 3});
  EXPECT_EQ(plateau.stopped()->reason, "tolxup");
}

TEST(OnePlusOne, OptionsEndWhereTheySay) {
  const VectorXd x0 = VectorXd::Zero(3);
  EXPECT_EQ(OnePlusOne({.x0 = x0}).options().tolallfailed, 20 * 7);  // 4 + ⌊3 ln 3⌋ = 7
  EXPECT_EQ(OnePlusOne({.x0 = x0, .tolallfailed = 3}).options().tolallfailed, 3);
  EXPECT_NO_THROW(OnePlusOne({.x0 = x0, .constraints = 0, .tolx = 0, .tolxup = 0, .restarts = 0}));
  EXPECT_THROW(OnePlusOne({.x0 = x0, .constraints = -1}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = x0, .tolx = -1e-9}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = x0, .tolxup = -1e-9}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = x0, .tolxup = NAN}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = x0, .tolallfailed = -1}), InputError);
}

TEST(OnePlusOne, StopsAfterSoManyFailuresInARow) {
  OnePlusOne o({.x0 = VectorXd::Zero(3), .tolallfailed = 3, .restarts = 9});
  const auto fail = [&] { o.tell(o.ask()[0].id, {.cost = 0, .failed = true}); };
  for (int i = 0; i < 2; ++i) fail();
  EXPECT_FALSE(o.stopped());
  o.tell(o.ask()[0].id, {.cost = 1});
  for (int i = 0; i < 2; ++i) fail();
  EXPECT_FALSE(o.stopped());
  fail();
  ASSERT_TRUE(o.stopped());
  EXPECT_EQ(o.stopped()->reason, "tolallfailed");
  EXPECT_EQ(o.stopped()->value, 3);
  EXPECT_EQ(o.state().descent, 0U);  // not begun anew
}

TEST(OnePlusOne, RefusesWhatCannotBeUsed) {
  EXPECT_THROW(OnePlusOne({}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .sigma = 0}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .restarts = -1}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .tolx = NAN}), InputError);
}

TEST(OnePlusOne, ItsStepsDoNotOutgrowTheirBox) {
  // Every trial is a success, so that σ grows until a box holds it: a third of that, or the first
  // step where it is longer.
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const double sigma : {0.1, 0.9}) {
    const OnePlusOneOptions o{.x0 = VectorXd::Zero(3),
                              .sigma = sigma,
                              .scale = VectorXd{{1, 1, 10}},
                              .lower = VectorXd{{-1, -inf, -10}},
                              .upper = VectorXd{{1, inf, 10}}};
    const double widest[] = {std::max(2.0 / 3, sigma), inf, std::max(20.0 / 3, 10 * sigma)};
    const SuccessConstants c = successConstants(3);
    OnePlusOne one(o);
    int cut = 0;
    for (int t = 0; t < 200; ++t) {
      const double before = one.state().sigma;
      one.tell(one.ask()[0].id, {.cost = -static_cast<double>(t)});
      const OnePlusOneState& s = one.state();
      const auto deviation = [&](int i) {
        return o.scale[i] * std::sqrt(s.shape.covariance()(i, i));
      };
      double expected = t == 0 ? before : before * stepFactor(c, s.p_success);
      const double grown = expected;
      for (int i = 0; i < 3; ++i) expected = std::min(expected, widest[i] / deviation(i));
      ASSERT_NEAR(s.sigma, expected, 1e-12) << t;
      cut += expected < grown;
    }
    EXPECT_GT(cut, 100);
  }
}

TEST(OnePlusOne, BeginsAnewAboutItsStartInsideTheBounds) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const OnePlusOneOptions o{.x0 = VectorXd{{1, 2}},
                            .sigma = 0.5,
                            .scale = VectorXd{{1, 10}},
                            .lower = VectorXd{{0.9, -inf}},
                            .upper = VectorXd{{inf, 3}},
                            .seed = 7,
                            .tolxup = 0.9,  // ends every descent with its first trial
                            .restarts = 6};
  OnePlusOne one(o);
  for (std::uint64_t descent = 0; descent <= 6; ++descent) {
    EXPECT_FALSE(one.stopped());
    const OnePlusOneState& s = one.state();
    EXPECT_EQ(s.descent, descent);
    EXPECT_EQ(s.trial, descent);
    EXPECT_EQ(s.sigma, 0.5);
    EXPECT_EQ(s.p_success, 2.0 / 11);
    EXPECT_FALSE(s.has_parent);
    EXPECT_EQ(s.all_failed, 0);
    EXPECT_EQ(s.shape.covariance(), MatrixXd(MatrixXd::Identity(2, 2)));
    VectorXd start = o.x0;
    if (descent > 0) {
      Random random(7, kDescentStream, descent);
      start[0] = std::max(0.9, 1 + 0.5 * random.normal());
      start[1] = std::min(3.0, 2 + 5 * random.normal());
    }
    EXPECT_LT((one.ask()[0].x - start).norm(), 1e-12) << descent;
    one.tell(one.ask()[0].id, {.cost = 1});
  }
  ASSERT_TRUE(one.stopped());
  EXPECT_EQ(one.stopped()->reason, "tolxup");
  EXPECT_EQ(one.stopped()->value, 1);
  EXPECT_EQ(one.stopped()->limit, 0.9);
  EXPECT_EQ(one.state().descent, 6u);
  EXPECT_TRUE(one.state().has_parent);
}

TEST(OnePlusOne, LimitsAreThemselvesAllowed) {
  // The first trial changes neither σ nor shape: the largest deviation is the first.
  const auto stop = [](double tolx, double tolxup) {
    OnePlusOne one({.x0 = VectorXd::Zero(2), .sigma = 0.25, .tolx = tolx, .tolxup = tolxup});
    one.tell(0, {.cost = 1});
    return one.stopped();
  };
  EXPECT_FALSE(stop(1, 1));
  ASSERT_TRUE(stop(1.01, 1));
  EXPECT_EQ(stop(1.01, 1)->reason, "tolx");
  EXPECT_EQ(stop(1.01, 1)->value, 1);
  EXPECT_EQ(stop(1.01, 1)->limit, 1.01);
  ASSERT_TRUE(stop(1, 0.99));
  EXPECT_EQ(stop(1, 0.99)->reason, "tolxup");
  // Later it is the widest variable's.
  OnePlusOne one({.x0 = VectorXd::Ones(3), .sigma = 0.25, .tolx = 1e-3});
  while (!one.stopped()) {
    const Candidate c = one.ask()[0];
    one.tell(c.id, {.cost = c.x[0] * c.x[0] + 10 * c.x[1] * c.x[1] + 0.1 * c.x[2] * c.x[2]});
  }
  const OnePlusOneState& s = one.state();
  EXPECT_DOUBLE_EQ(one.stopped()->value,
                   s.sigma / 0.25 * std::sqrt(s.shape.covariance().diagonal().maxCoeff()));
}

TEST(OnePlusOne, SaysWhatCannotBeTold) {
  OnePlusOne one({.x0 = VectorXd::Zero(2), .constraints = 2});
  const auto message = [&](std::uint64_t id, const Evaluation& e) -> std::string {
    try {
      one.tell(id, e);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(message(1, {.cost = 1}), "one-plus-one: no candidate 1, only 0");
  EXPECT_EQ(message(0, {.cost = 1, .violated = {true}}),
            "one-plus-one: expected a trial to report on 2 constraints, got 1");
  EXPECT_EQ(message(0, {.cost = 1, .violated = {false, false}}), "");
  EXPECT_EQ(message(0, {.cost = 1}), "one-plus-one: no candidate 0, only 1");
  EXPECT_EQ(message(1, {.cost = 1}), "");
}

}  // namespace
}  // namespace traceur::optim
