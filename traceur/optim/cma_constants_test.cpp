#include "traceur/optim/cma_constants.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "traceur/optim/cma_es.h"

namespace traceur::optim {
namespace {

/// As pycma 4.4.0 prints them, to the digits shown; it has the same defaults.
struct Golden {
  int n, lambda, mu;
  const char *mu_eff, *c_c, *c_1, *c_mu, *c_sigma, *d_sigma, *negative_sum;
  int maxiter, tolstagnation;
  const char* eigen_gap;
};
constexpr Golden kGolden[] = {
    {5, 8, 4, "2.600", "0.4502", "0.04729", "0.04786", "0.4340", "1.4340", "-1.988", 3494, 239,
     "1.00"},
    {10, 10, 5, "3.167", "0.2950", "0.01528", "0.02355", "0.3196", "1.3196", "-1.649", 8116, 416,
     "1.00"},
    {20, 12, 6, "3.729", "0.1718", "0.00437", "0.00922", "0.2143", "1.2143", "-1.474", 23006, 845,
     "1.00"},
    {50, 15, 7, "4.541", "0.0755", "0.00076", "0.00222", "0.1137", "1.1137", "-1.341", 108892, 2457,
     "1.00"},
    {100, 17, 8, "5.096", "0.0389", "0.00019", "0.00068", "0.0656", "1.0656", "-1.286", 386059,
     5982, "1.14"},
};

TEST(CmaConstants, AgreeWithPycmaToThePrintedDigits) {
  for (const Golden& g : kGolden) {
    SCOPED_TRACE(g.n);
    const CmaConstants c = cmaConstants(g.n);
    EXPECT_EQ(c.lambda, g.lambda);
    EXPECT_EQ(c.mu, g.mu);
    EXPECT_EQ(fmt::format("{:.3f}", c.mu_eff), g.mu_eff);
    EXPECT_EQ(fmt::format("{:.4f}", c.c_c), g.c_c);
    EXPECT_EQ(fmt::format("{:.5f}", c.c_1), g.c_1);
    EXPECT_EQ(fmt::format("{:.5f}", c.c_mu), g.c_mu);
    EXPECT_EQ(fmt::format("{:.4f}", c.c_sigma), g.c_sigma);
    EXPECT_EQ(fmt::format("{:.4f}", c.d_sigma), g.d_sigma);
    EXPECT_EQ(fmt::format("{:.3f}", c.weights.tail(c.lambda - c.mu).sum()), g.negative_sum);
    EXPECT_EQ(fmt::format("{:.2f}", c.eigen_gap), g.eigen_gap);

    const CmaEs cma({.x0 = VectorXd::Zero(g.n)});
    EXPECT_EQ(cma.options().termination.maxiter, g.maxiter);
    EXPECT_EQ(cma.options().termination.tolstagnation, g.tolstagnation);
  }
}

TEST(CmaConstants, WeightsFallFromPositiveToNegativeAndSumToOne) {
  for (const int lambda : {2, 3, 4, 7, 8, 100}) {
    SCOPED_TRACE(lambda);
    const CmaConstants c = cmaConstants(7, lambda);
    EXPECT_EQ(c.mu, lambda / 2);
    EXPECT_NEAR(c.weights.head(c.mu).sum(), 1, 1e-14);
    for (int i = 0; i < lambda; ++i) {
      if (i > 0) {
        EXPECT_LT(c.weights[i], c.weights[i - 1]);
      }
      if (i < c.mu) {
        EXPECT_GT(c.weights[i], 0);
      }
      if (i >= c.mu) {
        EXPECT_LE(c.weights[i], 1e-15);
      }
    }
  }
}

TEST(CmaConstants, RecombinationUsesHalfOfLambdaPlusOne) {
  // ln((λ+1)/2) - ln i, not ln(μ+1) - ln i: for λ = 8 the ratio of the first two weights differs.
  const CmaConstants c = cmaConstants(5, 8);
  EXPECT_NEAR(c.weights[0] / c.weights[1], std::log(4.5) / std::log(4.5 / 2), 1e-14);
}

TEST(CmaConstants, SmallPopulationsLearnRankOneSlower) {
  EXPECT_DOUBLE_EQ(cmaConstants(10, 3).c_1, 0.5 * 2 / (11.3 * 11.3 + cmaConstants(10, 3).mu_eff));
  EXPECT_DOUBLE_EQ(cmaConstants(10, 6).c_1, 2 / (11.3 * 11.3 + cmaConstants(10, 6).mu_eff));
}

TEST(CmaConstants, LearningRatesStayBelowOne) {
  for (const int n : {1, 2, 3, 30}) {
    for (const int lambda : {2, 10, 1000, 100000}) {
      const CmaConstants c = cmaConstants(n, lambda);
      EXPECT_GT(c.c_mu, 0);
      EXPECT_LE(c.c_1 + c.c_mu, 1);
      EXPECT_TRUE(c.weights.allFinite());
    }
  }
}

TEST(CmaConstants, PassiveHasNoNegativeWeights) {
  const CmaConstants active = cmaConstants(10);
  const CmaConstants passive = cmaConstants(10, 0, false);
  EXPECT_EQ(passive.weights.tail(5), VectorXd::Zero(5));
  EXPECT_EQ(passive.weights.head(5), active.weights.head(5));
}

TEST(CmaConstants, AreThoseOfTheirFormulas) {
  // E‖N(0, I)‖ as its series has it, written out.
  EXPECT_DOUBLE_EQ(cmaConstants(1).chi_n, 1 - 0.25 + 1.0 / 21);
  EXPECT_DOUBLE_EQ(cmaConstants(2).chi_n, std::sqrt(2) * (1 - 0.125 + 1.0 / 84));
  EXPECT_DOUBLE_EQ(cmaConstants(5).chi_n, std::sqrt(5) * (0.95 + 1.0 / 525));
  // Large populations are damped more.
  for (const auto& [n, lambda] : {std::pair(3, 60), std::pair(10, 200), std::pair(10, 10)}) {
    const CmaConstants c = cmaConstants(n, lambda);
    const double more = std::sqrt((c.mu_eff - 1) / (n + 1)) - 1;
    EXPECT_EQ(more > 0, lambda > 10);
    EXPECT_DOUBLE_EQ(c.d_sigma - c.c_sigma - 1, more > 0 ? 2 * more : 0);
    EXPECT_DOUBLE_EQ(c.c_sigma, (c.mu_eff + 2) / (n + c.mu_eff + 3));
  }
  // The rank-μ update takes what the rank-one update leaves, and no more.
  const CmaConstants large = cmaConstants(2, 1000);
  EXPECT_EQ(large.c_mu, 1 - large.c_1);
}

TEST(CmaConstants, NegativeWeightsKeepWithinTheTightestOfThreeBounds) {
  int tightest[3] = {0, 0, 0};
  for (const int n : {1, 2, 5, 20}) {
    for (const int lambda : {4, 8, 20, 100}) {
      const CmaConstants c = cmaConstants(n, lambda);
      double sum = 0;
      double squares = 0;
      for (int i = lambda / 2; i < lambda; ++i) {
        const double w = std::log((lambda + 1) / 2.0 / (i + 1));
        sum += w;
        squares += w * w;
      }
      EXPECT_NEAR(c.mu_eff_minus, sum * sum / squares, 1e-12);
      const double bounds[] = {1 + c.c_1 / c.c_mu, 1 + 2 * c.mu_eff_minus / (c.mu_eff + 2),
                               (1 - c.c_1 - c.c_mu) / (n * c.c_mu)};
      const double* least = std::min_element(std::begin(bounds), std::end(bounds));
      EXPECT_NEAR(-c.weights.tail(lambda - c.mu).sum(), *least, 1e-12) << n << " " << lambda;
      ++tightest[least - std::begin(bounds)];
    }
  }
  for (const int times : tightest) EXPECT_GT(times, 0);
}

}  // namespace
}  // namespace traceur::optim
