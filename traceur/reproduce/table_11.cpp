#include "traceur/reproduce/table_11.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/all.h"
#include "traceur/optim/curve_cma.h"
#include "traceur/optim/family_baselines.h"
#include "traceur/optim/minimise.h"

namespace traceur::reproduce {
namespace {

using optim::Evaluation;
using optim::VectorXd;

constexpr int kTasks = 6;
/// Streams of the seed that no sample uses: a generation would have to be as large.
constexpr std::uint64_t kSegmentStream = ~std::uint64_t{0};
constexpr std::uint64_t kTable11StartStream = kSegmentStream - 1;

VectorXd uniform(Random& random, int n, double half) {
  VectorXd v(n);
  for (double& value : v) value = random.uniform(-half, half);
  return v;
}

/// cos(2π 3ᵏ (z + ½)) is the real part of e^(2πi (z + ½)) cubed k times: as exact as the cosine of
/// so great an angle, and one cosine instead of 21. Every cos(π 3ᵏ) is -1.
double weierstrass(const VectorXd& z) {
  double sum = 0;
  for (const double value : z) {
    const double angle = 2 * std::numbers::pi * (value + 0.5);
    double re = std::cos(angle);
    double im = std::sin(angle);
    double weight = 1;
    for (int k = 0; k <= 20; ++k, weight *= 0.5) {
      sum += weight * (re + 1);
      const double square_re = re * re - im * im;
      const double square_im = 2 * re * im;
      const double cube_re = square_re * re - square_im * im;
      im = square_re * im + square_im * re;
      re = cube_re;
    }
  }
  return 0.1 * sum;
}

double schwefelTerm(double z, int n) {
  if (std::abs(z) <= 500) return z * std::sin(std::sqrt(std::abs(z)));
  const double folded = 500 - std::fmod(std::abs(z), 500);
  const double beyond = (std::abs(z) - 500) / 100;
  return std::copysign(folded, z) * std::sin(std::sqrt(folded)) - beyond * beyond / n;
}

double schwefel(const VectorXd& d) {
  const int n = static_cast<int>(d.size());
  double sum = 0;
  for (const double value : d) sum += schwefelTerm(200 * value + 420.9687462275036, n);
  return std::max(0.0, (418.9829 * n * n - sum - 418.9 * n * (n - 1)) / 1000);
}

double costOf(Function function, const VectorXd& d, double w) {
  switch (function) {
    case Function::kSphere:
      return d.norm();
    case Function::kBentCigar:
      return 2e-7 * d[0] * d[0] + 0.2 * d.tail(d.size() - 1).squaredNorm();
    case Function::kWeierstrass:
      return weierstrass((0.1 + 0.9 * w) * d);
    case Function::kSchwefel:
      return schwefel(d);
  }
  return kInfinity;
}

class SegmentFamily : public optim::Problem {
 public:
  SegmentFamily(Function function, VectorXd a, VectorXd b)
      : function_(function), a_(std::move(a)), b_(std::move(b)) {}

  VectorXd lower() const override { return VectorXd::Constant(a_.size(), -kInfinity); }
  VectorXd upper() const override { return VectorXd::Constant(a_.size(), kInfinity); }
  VectorXd tasks() const override { return VectorXd::LinSpaced(kTasks, 0, 1); }

  Evaluation evaluate(const VectorXd& x) const override {
    double outside = 0;
    if (function_ != Function::kSphere) {
      outside = 0.1 * (x.array().abs() - 1).max(0).square().sum();
    }
    Evaluation evaluation{.cost = 0};
    for (int i = 0; i < kTasks; ++i) {
      const double w = static_cast<double>(i) / (kTasks - 1);
      const double cost = costOf(function_, x - ((1 - w) * a_ + w * b_), w) + outside;
      evaluation.task_costs.push_back(cost);
      evaluation.cost += cost / kTasks;
    }
    return evaluation;
  }

 private:
  Function function_;
  VectorXd a_;
  VectorXd b_;
};

std::unique_ptr<optim::Optimizer> make(const optim::Problem& problem, Algorithm algorithm,
                                       std::uint64_t seed) {
  const int n = problem.dimension();
  if (algorithm == Algorithm::kCurve) {
    optim::CurveCmaOptions o = optim::table11CurveCma();
    o.x0 = VectorXd::Zero(n);
    o.tasks = problem.tasks();
    o.seed = seed;
    return std::make_unique<optim::CurveCma>(std::move(o));
  }
  if (algorithm == Algorithm::kCma) {
    optim::CmaEsOptions o;
    o.x0 = VectorXd::Zero(n);
    o.sigma = 1;
    o.lambda = 16;
    o.active = false;
    o.seed = seed;
    Random random(seed, kTable11StartStream);
    return std::make_unique<optim::PhiCma>(problem.tasks(), 2, o,
                                           uniform(random, 2 * n, 0.5).reshaped(n, 2));
  }
  return optim::findOptimizer("contextual")
      .make(problem, {.seed = seed, .sigma = 0.5, .x0 = VectorXd::Zero(n)});
}

}  // namespace

const std::vector<Table11Row>& table11() {
  static const std::vector<Table11Row> kRows = {
      {"sphere-5", Function::kSphere, 5, true, 6309.7, 7151.1},
      {"sphere-10", Function::kSphere, 10, true, 9460.3, 13404.9},
      {"sphere-20", Function::kSphere, 20, true, 16395.4, 23539.7},
      {"bent-cigar-5", Function::kBentCigar, 5, true, 1402.6, 2666.6},
      {"bent-cigar-10", Function::kBentCigar, 10, true, 3092.0, 5724.9},
      {"bent-cigar-20", Function::kBentCigar, 20, true, 5824.3, 11196.9},
      {"weierstrass-5", Function::kWeierstrass, 5, false, 0.00093, 0.03549},
      {"weierstrass-10", Function::kWeierstrass, 10, false, 0.00105, 0.15398},
      {"schwefel-5", Function::kSchwefel, 5, false, 0.00444, 0.07025},
      {"schwefel-7", Function::kSchwefel, 7, false, 0.00848, 0.25131},
  };
  return kRows;
}

int table11Budget(const Table11Row& row) {
  return row.unimodal ? 30000 : 20000;
}

std::unique_ptr<optim::Problem> table11Problem(const Table11Row& row, std::uint64_t seed) {
  Random random(seed, kSegmentStream);
  const VectorXd a = uniform(random, row.n, 0.5);
  const VectorXd b = a + uniform(random, row.n, 0.1);
  return std::make_unique<SegmentFamily>(row.function, a, b);
}

Table11Outcome runTable11(const Table11Row& row, Algorithm algorithm, std::uint64_t seed) {
  const auto problem = table11Problem(row, seed);
  const auto optimizer = make(*problem, algorithm, seed);
  const optim::Summary summary = optim::minimise(
      *problem, *optimizer, {.budget = table11Budget(row), .target = kTable11Threshold});
  const double cost = optimizer->achieved().value_or(kInfinity);
  const bool reached = cost <= kTable11Threshold;
  // A unimodal run that stops short has not got there for less.
  const bool short_stop = row.unimodal && !reached;
  return {short_stop ? table11Budget(row) : summary.progress.evaluations, cost, reached};
}

}  // namespace traceur::reproduce
