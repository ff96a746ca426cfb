// A search of some variables is that of a problem that has no others.
#include "traceur/optim/part.h"

#include <gtest/gtest.h>

#include "traceur/core/error.h"
#include "traceur/optim/minimise.h"

namespace traceur::optim {
namespace {

/// Σ (x_i - i)² where some x_i may be fixed by hand.
class Bowl : public Problem {
 public:
  explicit Bowl(std::vector<double> least, bool draws = false)
      : least_(std::move(least)), draws_(draws) {}
  VectorXd lower() const override {
    return VectorXd::Constant(static_cast<Eigen::Index>(least_.size()), -10);
  }
  VectorXd upper() const override { return -lower(); }
  std::vector<std::string> constraints() const override { return {"wall"}; }
  bool draws() const override { return draws_; }
  Evaluation evaluate(const VectorXd& x) const override {
    Evaluation e{.cost = 0, .violated = {x[0] < 0}};
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const double d = x[i] - least_[static_cast<size_t>(i)];
      e.cost += d * d;
    }
    return e;
  }

 private:
  std::vector<double> least_;
  bool draws_;
};

TEST(Part, SearchesAsIfThereWereNoOtherVariables) {
  const Bowl whole({1, 2, 3, 4});
  const Bowl two({2, 4});
  for (const OptimizerEntry& entry : allOptimizers()) {
    if (entry.learns_families) continue;
    SCOPED_TRACE(entry.name);
    CommonOptions options{.seed = 7, .sigma = 0.1, .x0 = VectorXd{{5, 0.5, -6, 0.5}}};
    const auto part = inPart(whole, options, {1, 3}, entry.make);
    options.x0 = VectorXd{{0.5, 0.5}};
    const auto alone = entry.make(two, options);
    for (int g = 0; g < 20; ++g) {
      const auto got = part->ask();
      const auto expected = alone->ask();
      ASSERT_EQ(got.size(), expected.size());
      for (size_t k = 0; k < got.size(); ++k) {
        const VectorXd& x = got[k].x;
        ASSERT_EQ(x.size(), 4);
        EXPECT_EQ(x[0], 5);
        EXPECT_EQ(x[2], -6);
        EXPECT_EQ(x[1], expected[k].x[0]);
        EXPECT_EQ(x[3], expected[k].x[1]);
        const Evaluation e = two.evaluate(expected[k].x);
        part->tell(got[k].id, e);
        alone->tell(expected[k].id, e);
      }
    }
    if (const auto favourite = alone->favourite()) {
      EXPECT_EQ(*part->favourite(), (VectorXd{{5, (*favourite)[0], -6, (*favourite)[1]}}));
    } else {
      EXPECT_FALSE(part->favourite());
    }
  }
}

TEST(Part, GoesOnWithEqualBitsWhenRestored) {
  const Bowl problem({1, 2, 3});
  const CommonOptions options{.seed = 3, .x0 = VectorXd{{0, 0, 0}}};
  const auto make = findOptimizer("cma-es").make;
  const auto whole = inPart(problem, options, {0, 2}, make);
  const auto tell = [&](Optimizer& o) {
    for (const Candidate& c : o.ask()) o.tell(c.id, problem.evaluate(c.x));
  };
  tell(*whole);
  const auto again = inPart(problem, options, {0, 2}, make);
  again->restore(whole->save());
  tell(*whole);
  tell(*again);
  EXPECT_EQ(again->ask().front().x, whole->ask().front().x);
}

TEST(Part, FavouriteOfDrawnTrialsHasAllVariables) {
  const Bowl problem({1, 2, 3}, true);
  const CommonOptions options{.seed = 3, .x0 = VectorXd{{1, 0, 3}}};
  const auto part = inPart(problem, options, {1}, findOptimizer("cma-es").make);
  const Summary found = minimise(problem, *part, {.threads = 1, .budget = 300}, {});
  ASSERT_TRUE(found.progress.best);
  EXPECT_EQ(found.progress.best->x[0], 1);
  EXPECT_NEAR(found.progress.best->x[1], 2, 0.05);
}

}  // namespace
}  // namespace traceur::optim
