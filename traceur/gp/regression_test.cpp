#include "traceur/gp/regression.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/random.h"

namespace traceur::gp {
namespace {

VectorXd point(double x) {
  return VectorXd::Constant(1, x);
}

VectorXd normals(Random& random, int n) {
  VectorXd v(n);
  for (double& x : v) x = random.normal();
  return v;
}

Kernel kernelOf(int inputs) {
  return {VectorXd::LinSpaced(inputs, 0.7, 1.3), 1.5, 0.1};
}

/// Two smooth functions of two inputs, seen through noise.
Regression samples(int n, std::uint64_t seed) {
  Regression g(kernelOf(2), 2);
  Random random(seed);
  for (int i = 0; i < n; ++i) {
    const VectorXd x = normals(random, 2);
    g.add(x, Eigen::Vector2d(std::sin(2 * x[0]) * x[1], std::cos(x[1])) + 0.1 * normals(random, 2));
  }
  return g;
}

TEST(Gp, OneSampleIsAShrunkValue) {
  Regression g({point(0.5), 2, 0.3}, 1);
  EXPECT_EQ(g.predict(point(1)).variance, 4);
  EXPECT_EQ(g.predict(point(1)).mean[0], 0);
  g.add(point(1), point(5));
  const double shrink = 4 / (4 + 0.09);
  EXPECT_NEAR(g.predict(point(1)).mean[0], 5 * shrink, 1e-12);
  EXPECT_NEAR(g.predict(point(1)).variance, 4 - 4 * shrink, 1e-12);
  const double k = 4 * std::exp(-0.5);  // one length away
  EXPECT_NEAR(g.predict(point(1.5)).mean[0], k * 5 / 4.09, 1e-12);
  EXPECT_NEAR(g.predict(point(1.5)).variance, 4 - k * k / 4.09, 1e-12);
  EXPECT_NEAR(g.predict(point(40)).variance, 4, 1e-12);  // it knows nothing there
  EXPECT_NEAR(g.logLikelihood(), -0.5 * (25 / 4.09 + std::log(4.09) + std::log(2 * M_PI)), 1e-12);
}

TEST(Gp, ManySamplesAreTheTextbooksFormula) {
  const Regression g = samples(40, 3);
  const int n = g.size();
  MatrixXd K(n, n);
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) {
      K(a, b) = g.kernel()(g.x().col(a), g.x().col(b)) + (a == b ? 0.01 : 0);
    }
  }
  const Eigen::LDLT<MatrixXd> solver(K);
  EXPECT_LT((g.factor() * g.factor().transpose() - K).cwiseAbs().maxCoeff(), 1e-12);
  Random random(8);
  const Predictor fast(g);
  Predictor::Scratch scratch;
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = 2 * normals(random, 2);
    VectorXd k(n);
    for (int a = 0; a < n; ++a) k[a] = g.kernel()(g.x().col(a), x);
    const VectorXd mean = g.y() * solver.solve(k);
    const double variance = 1.5 * 1.5 - k.dot(solver.solve(k));
    const Prediction p = g.predict(x);
    EXPECT_LT((p.mean - mean).norm(), 1e-9);
    EXPECT_NEAR(p.variance, variance, 1e-9);
    VectorXd quick(2);
    EXPECT_NEAR(fast.meanAndVariance(x, quick, scratch), variance, 2e-5);
    EXPECT_LT((quick - mean).norm(), 2e-5);
  }
}

TEST(Gp, ANewKernelForOldSamplesIsAsIfItHadBeenThereFirst) {
  Regression late = samples(25, 4);
  Regression early({VectorXd::Constant(2, 0.4), 0.8, 0.2}, 2);
  for (int i = 0; i < late.size(); ++i) early.add(late.x().col(i), late.y().col(i));
  late.setKernel(early.kernel());
  EXPECT_EQ(late.factor(), early.factor());
}

TEST(Gp, LikelihoodsGradientIsItsSlope) {
  const Regression g = samples(15, 5);
  VectorXd gradient;
  g.logLikelihood(&gradient);
  ASSERT_EQ(gradient.size(), 4);
  const double h = 1e-5;
  for (int i = 0; i < 4; ++i) {
    const auto at = [&](double log) {
      Kernel k = g.kernel();
      (i < 2 ? k.lengths[i] : i == 2 ? k.signal : k.noise) *= std::exp(log);
      Regression moved = g;
      moved.setKernel(k);
      return moved.logLikelihood();
    };
    EXPECT_NEAR(gradient[i], (at(h) - at(-h)) / (2 * h), 1e-5 * (1 + std::abs(gradient[i]))) << i;
  }
}

/// A function drawn from the prior itself, at points in [-half, half]^2.
Regression drawn(const Kernel& truth, int n, double half, Random& random) {
  MatrixXd x(2, n);
  for (double& v : x.reshaped()) v = random.uniform(-half, half);
  MatrixXd K(n, n);
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) {
      K(a, b) = truth(x.col(a), x.col(b)) + (a == b ? truth.noise * truth.noise : 0);
    }
  }
  const VectorXd y = Eigen::LLT<MatrixXd>(K).matrixL() * normals(random, n);
  Regression g(truth, 1);
  for (int a = 0; a < n; ++a) g.add(x.col(a), y.segment(a, 1));
  return g;
}

TEST(Gp, VarianceIsTheSquareOfTheErrorToExpect) {
  const Kernel truth{Eigen::Vector2d(0.5, 2), 1.2, 0.2};
  double squares = 0;
  int inside = 0;
  int count = 0;
  Random random(11);
  for (int draw = 0; draw < 60; ++draw) {
    const Regression all = drawn(truth, 40, 2, random);
    Regression half(truth, 1);
    for (int a = 0; a < 20; ++a) half.add(all.x().col(a), all.y().col(a));
    for (int a = 20; a < 40; ++a, ++count) {
      const Prediction p = half.predict(all.x().col(a));
      const double z =
          (all.y()(0, a) - p.mean[0]) / std::sqrt(p.variance + truth.noise * truth.noise);
      squares += z * z;
      inside += std::abs(z) < 1.96;
    }
  }
  // 60 draws of 20 correlated errors: the tolerances are ours, about four times the scatter.
  EXPECT_NEAR(squares / count, 1, 0.25);
  EXPECT_NEAR(static_cast<double>(inside) / count, 0.95, 0.03);
}

TEST(Gp, FittingFindsTheKernelTheSamplesCameFrom) {
  const Kernel truth{Eigen::Vector2d(0.5, 2), 1.2, 0.2};
  Random random(12);
  Regression g = drawn(truth, 150, 2, random);
  g.setKernel({Eigen::Vector2d(1, 1), 1, 0.5});
  const double before = g.logLikelihood();
  const Fit f = fit(g);
  EXPECT_EQ(f.before, before);
  EXPECT_GT(f.after, before + 10);
  EXPECT_DOUBLE_EQ(f.after, g.logLikelihood());
  EXPECT_NEAR(std::log(g.kernel().lengths[0]), std::log(0.5), 0.3);
  EXPECT_NEAR(std::log(g.kernel().lengths[1]), std::log(2.0), 0.5);
  EXPECT_NEAR(std::log(g.kernel().noise), std::log(0.2), 0.2);
  // An input that says nothing gets a length beyond its range.
  Regression blind(kernelOf(2), 1);
  for (int i = 0; i < 40; ++i) {
    const VectorXd x = normals(random, 2);
    blind.add(x, point(std::sin(x[0]) + 0.05 * random.normal()));
  }
  fit(blind);
  EXPECT_GT(blind.kernel().lengths[1], 5 * blind.kernel().lengths[0]);
}

TEST(Gp, SavesEveryBit) {
  const Regression g = samples(12, 6);
  const Regression again = Regression::load(g.save(), "here");
  EXPECT_EQ(again.factor(), g.factor());
  EXPECT_EQ(again.y(), g.y());
  EXPECT_EQ(again.save(), g.save());
  const auto refused = [](const std::string& text, const std::string& words) {
    try {
      Regression::load(text, "file.json");
      FAIL() << "accepted";
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("file.json"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  refused("{", "parse");
  refused("{}", "format");
  refused(R"({"format": "traceur gp", "version": 9})", "version 1");
  std::string other = g.save();
  other.replace(other.find("traceur gp"), 10, "traceur pg");
  refused(other, "version 1");
  EXPECT_EQ(again.x(), g.x());
  EXPECT_EQ(again.kernel().signal, 1.5);
  EXPECT_EQ(again.outputs(), 2);
  EXPECT_EQ(again.size(), 12);
  const Regression none = Regression::load(Regression(kernelOf(3), 2).save(), "here");
  EXPECT_EQ(none.size(), 0);
  EXPECT_EQ(none.inputs(), 3);
}

TEST(Gp, RefusesWhatMakesNoSense) {
  EXPECT_THROW(Regression({point(0), 1, 0}, 1), InputError);
  EXPECT_THROW(Regression({point(1), -1, 0}, 1), InputError);
  EXPECT_THROW(Regression({point(1), 1, NAN}, 1), InputError);
  EXPECT_THROW(Regression({VectorXd(0), 1, 0}, 1), InputError);
  EXPECT_THROW(Regression({point(1), 1, 0}, 0), InputError);
  for (const double bad : {0.0, -1.0, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
    EXPECT_THROW(Regression({Eigen::Vector2d(bad, 1), 1, 0}, 1), InputError) << bad;
    EXPECT_THROW(Regression({Eigen::Vector2d(1, bad), 1, 0}, 1), InputError) << bad;
    EXPECT_THROW(Regression({point(1), bad, 0}, 1), InputError) << bad;
    if (bad == 0) continue;  // no noise is fine
    EXPECT_THROW(Regression({point(1), 1, bad}, 1), InputError) << bad;
  }
  Regression g({point(1), 1, 0}, 1);
  EXPECT_THROW(fit(g), InputError);
  EXPECT_THROW(g.add(point(NAN), point(0)), InputError);
  EXPECT_THROW(g.add(point(0), point(INFINITY)), InputError);
  EXPECT_THROW(g.add(VectorXd::Zero(2), point(0)), InputError);
  EXPECT_THROW(g.add(point(0), VectorXd::Zero(2)), InputError);
  EXPECT_THROW(g.setKernel({VectorXd::Ones(2), 1, 0}), InputError);
  EXPECT_THROW(g.setKernel({point(-1), 1, 0}), InputError);
  g.add(point(0), point(0));
  g.add(point(3), point(0));
  try {
    g.add(point(3 + 1e-9), point(1));
    FAIL() << "a copy without noise was taken";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("nearest to sample 2"), std::string::npos) << e.what();
  }
  EXPECT_EQ(g.size(), 2);
  EXPECT_EQ(g.factor().rows(), 2);
  Kernel noisy = g.kernel();
  noisy.noise = 0.1;
  g.setKernel(noisy);
  g.add(point(3 + 1e-9), point(1));  // now it may be noise
  EXPECT_THROW(g.setKernel({point(1), 1, 0}), InputError);
  EXPECT_EQ(g.kernel().noise, 0.1);

  const auto message = [](Regression& of, double x) -> std::string {
    try {
      of.add(point(x), point(1));
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  Regression wide({point(2), 1, 0}, 1);
  for (const double x : {0.0, 4.0, 8.0}) EXPECT_EQ(message(wide, x), "");
  EXPECT_NE(message(wide, 4 + 1e-9).find("with sample 4: it is nearest to sample 2, 5e-10 lengths"),
            std::string::npos)
      << message(wide, 4 + 1e-9);
  Regression two({point(2), 1, 0}, 1);
  EXPECT_EQ(message(two, 0), "");
  EXPECT_NE(message(two, 1e-9).find("with sample 2: it is nearest to sample 1, 5e-10 lengths"),
            std::string::npos)
      << message(two, 1e-9);
  Regression tiny({point(2), 1e-200, 0}, 1);  // its square is 0
  EXPECT_NE(message(tiny, 0).find("with sample 1: it is nearest to sample 1, 0 lengths"),
            std::string::npos)
      << message(tiny, 0);
  EXPECT_EQ(tiny.size(), 0);
}

/// Each number goes as far as it may, from its own start: samples of a function far from the
/// kernel.
TEST(Gp, FittingStaysWithinAFactorOfTheStart) {
  const Kernel truth{Eigen::Vector2d(0.5, 2), 1.2, 0.2};
  Random random(12);
  const Regression from = drawn(truth, 60, 2, random);
  const struct {
    Kernel start;
    double by[4];  // where to: lengths, signal, noise
  } cases[] = {{{Eigen::Vector2d(5, 0.2), 0.1, 0.02}, {0.8, 0.8, 1.25, 1.25}},
               {{Eigen::Vector2d(0.1, 20), 12, 2}, {1.25, 1.25, 0.8, 0.8}}};
  for (const auto& [start, by] : cases) {
    Regression g = from;
    g.setKernel(start);
    const Fit f = fit(g, {.range = 1.25});
    EXPECT_NEAR(g.kernel().lengths[0] / start.lengths[0], by[0], 1e-9);
    EXPECT_NEAR(g.kernel().lengths[1] / start.lengths[1], by[1], 1e-9);
    EXPECT_NEAR(g.kernel().signal / start.signal, by[2], 1e-9);
    EXPECT_NEAR(g.kernel().noise / start.noise, by[3], 1e-9);
    EXPECT_GT(f.after, f.before);
    EXPECT_GT(f.evaluations, 1);
    EXPECT_LT(f.evaluations, 200);
  }
  Regression g = from;
  g.setKernel({Eigen::Vector2d(1, 1), 1, 0.5});
  EXPECT_LE(fit(g, {.evaluations = 3}).evaluations, 4);
}

/// The best of a fit is where no number alone is better, and noise of 0 stays 0.
TEST(Gp, FittingEndsAtTheMostLikely) {
  for (const double noise : {0.2, 0.0}) {
    Random random(13);
    Regression g({Eigen::Vector2d(0.6, 0.9), 1.2, noise}, 1);
    for (int i = 0; i < 25; ++i) {
      const VectorXd x = 1.5 * normals(random, 2);
      g.add(x, point(std::sin(2 * x[0]) * std::cos(x[1]) + noise * random.normal()));
    }
    const Fit f = fit(g);
    EXPECT_GT(f.after, f.before);
    EXPECT_EQ(g.kernel().noise > 0, noise > 0);
    VectorXd gradient;
    EXPECT_DOUBLE_EQ(g.logLikelihood(&gradient), f.after);
    EXPECT_LT(gradient.cwiseAbs().maxCoeff(), noise > 0 ? 1e-2 : 0.5) << gradient.transpose();
  }
}

/// Whatever the number of samples: a predictor works in bands of them.
TEST(Gp, APredictorIsTheRegressionOfAnySize) {
  for (const int n : {0, 1, 2, 15, 16, 17, 31, 32, 33, 49}) {
    const Regression g = samples(n, 9);
    const Predictor fast(g);
    EXPECT_EQ(fast.size(), n);
    EXPECT_EQ(fast.outputs(), 2);
    Predictor::Scratch scratch;
    Random random(10);
    for (int i = 0; i < 5; ++i) {
      const VectorXd x = normals(random, 2);
      const Prediction p = g.predict(x);
      VectorXd mean(2), alone(2);
      EXPECT_NEAR(fast.meanAndVariance(x, mean, scratch), p.variance, 2e-5) << n;
      fast.mean(x, alone, scratch);
      EXPECT_LT((mean - p.mean).norm(), 2e-5) << n;
      EXPECT_EQ(alone, mean);
    }
  }
  const Regression none = samples(0, 9);
  EXPECT_EQ(none.logLikelihood(), 0);
  VectorXd gradient;
  none.logLikelihood(&gradient);
  EXPECT_EQ(gradient, VectorXd(VectorXd::Zero(4)));
  // Where samples crowd, rounding may not make a variance negative.
  Regression crowd({point(50), 1, 1e-3}, 1);
  for (int i = 0; i < 30; ++i) crowd.add(point(0.1 * i), point(0));
  const Predictor sure(crowd);
  Predictor::Scratch scratch;
  VectorXd mean(1);
  for (int i = 0; i < 30; ++i) {
    const double variance = sure.meanAndVariance(point(0.1 * i), mean, scratch);
    EXPECT_GE(variance, 0);
    EXPECT_LT(variance, 1e-3);
  }
}

}  // namespace
}  // namespace traceur::gp
