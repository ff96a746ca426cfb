#include "traceur/optim/one_plus_one.h"

#include <gtest/gtest.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::optim {
namespace {

TEST(OnePlusOne, TriesItsStartFirst) {
  OnePlusOne o({.x0 = VectorXd::LinSpaced(3, 1, 2), .sigma = 1});
  EXPECT_EQ(o.ask()[0].x, VectorXd::LinSpaced(3, 1, 2));
  o.tell(0, {.cost = 1});
  EXPECT_NE(o.ask()[0].x, VectorXd::LinSpaced(3, 1, 2));
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

TEST(OnePlusOne, RefusesWhatCannotBeUsed) {
  EXPECT_THROW(OnePlusOne({}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .sigma = 0}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .restarts = -1}), InputError);
  EXPECT_THROW(OnePlusOne({.x0 = VectorXd::Zero(2), .tolx = NAN}), InputError);
}

}  // namespace
}  // namespace traceur::optim
