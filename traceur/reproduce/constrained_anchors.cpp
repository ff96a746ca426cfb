#include "traceur/reproduce/constrained_anchors.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_c.h"
#include "traceur/optim/one_plus_one.h"

namespace traceur::reproduce {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

/// The stream of a run's start, apart from those of its optimiser.
constexpr std::uint64_t kAnchorStartStream = 0x616e63686f72;  // "anchor"

double square(double x) {
  return x * x;
}
double cube(double x) {
  return x * x * x;
}

struct Definition {
  Anchor anchor;
  std::vector<std::string> constraints;
  VectorXd lower, upper;  // empty: none
  std::function<optim::Evaluation(const VectorXd&)> evaluate;
};

/// min Σ x_i² with Σ x_i ≥ n; best at (1, …, 1).
Definition tangent(int n) {
  return {{fmt::format("TR{}", n), n, static_cast<double>(n), 1, VectorXd::Constant(n, 5), 1},
          {"below plane"},
          {},
          {},
          [n](const VectorXd& x) {
            return optim::Evaluation{.cost = x.squaredNorm(), .violated = {x.sum() < n}};
          }};
}

/// min -x_1 with ‖x‖ ≤ 1; best at (1, 0, …, 0).
Definition ball(int n) {
  return {{fmt::format("ball{}", n), n, -1, 0.3, VectorXd::Zero(n), 0.1},
          {"outside ball"},
          {},
          {},
          [](const VectorXd& x) {
            return optim::Evaluation{.cost = -x[0], .violated = {x.squaredNorm() > 1}};
          }};
}

/// Between two circles that cross at an angle of 2.6°; best at (14.095, 0.84296).
Definition g06() {
  return {{"g06", 2, -6961.81387558015, 0.2, Vector2d(14.7, 2.5), 0},
          {"inside circle", "outside circle"},
          Vector2d(13, 0),
          Vector2d(100, 100),
          [](const VectorXd& x) {
            return optim::Evaluation{.cost = cube(x[0] - 10) + cube(x[1] - 20),
                                     .violated = {square(x[0] - 5) + square(x[1] - 5) < 100,
                                                  square(x[0] - 6) + square(x[1] - 5) > 82.81}};
          }};
}

/// Below two quartics; best at (2.3295, 3.1785), where they cross.
Definition g24() {
  return {
      {"g24", 2, -5.50801327159536, 0.3, Vector2d(2, 0.3), 0},
      {"above first", "above second"},
      Vector2d(0, 0),
      Vector2d(3, 4),
      [](const VectorXd& x) {
        const double a = x[0];
        const double first = 2 * square(square(a)) - 8 * cube(a) + 8 * square(a) + 2;
        const double second = 4 * square(square(a)) - 32 * cube(a) + 88 * square(a) - 96 * a + 36;
        return optim::Evaluation{.cost = -x[0] - x[1], .violated = {x[1] > first, x[1] > second}};
      }};
}

const std::array<Definition, 6>& definitions() {
  static const std::array<Definition, 6> kAll = {tangent(2), tangent(10), g06(),
                                                 g24(),      ball(5),     ball(20)};
  return kAll;
}

const Definition& definition(int anchor) {
  if (anchor < 0 || anchor >= static_cast<int>(definitions().size())) {
    throw InputError(fmt::format("constrained anchors: expected an anchor in [0, {}], got {}",
                                 definitions().size() - 1, anchor));
  }
  return definitions()[anchor];
}

struct AnchorCompetitor {
  AnchorAlgorithm what;
  std::function<std::unique_ptr<optim::Optimizer>(const optim::CmaEsOptions&, int constraints)>
      make;  // empty: resampling
};

const std::vector<AnchorCompetitor>& anchorCompetitors() {
  static const std::vector<AnchorCompetitor> kAll = {
      {{"resampling", "CMA-ES that draws until the trial is feasible; every trial counts."}, {}},
      {{"CMA-ES feasible first", "CMA-ES, feasible trials ranked first."},
       [](const optim::CmaEsOptions& o, int) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::CmaEs>(o);
       }},
      {{"(1+1)-CMA-ES", "(1+1)-CMA-ES with active constraint handling."},
       [](const optim::CmaEsOptions& o, int constraints) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::OnePlusOne>(
             optim::OnePlusOneOptions{.x0 = o.x0,
                                      .sigma = o.sigma,
                                      .lower = o.lower,
                                      .upper = o.upper,
                                      .constraints = constraints,
                                      .seed = o.seed});
       }},
      {{"CMA-C", "CMA-C with Traceur's defaults."},
       [](const optim::CmaEsOptions& o, int constraints) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::CmaC>(
             optim::CmaCOptions{.cma = o, .constraints = constraints});
       }},
  };
  return kAll;
}

}  // namespace

AnchorProblem::AnchorProblem(int anchor) : anchor_(anchor) {
  const Definition& d = definition(anchor);
  lower_ = d.lower.size() > 0 ? d.lower : VectorXd::Constant(d.anchor.n, -kInfinity);
  upper_ = d.upper.size() > 0 ? d.upper : VectorXd::Constant(d.anchor.n, kInfinity);
}

std::vector<std::string> AnchorProblem::constraints() const {
  return definition(anchor_).constraints;
}

optim::Evaluation AnchorProblem::evaluate(const VectorXd& x) const {
  return definition(anchor_).evaluate(x);
}

std::span<const Anchor> anchors() {
  static const std::vector<Anchor> kAll = [] {
    std::vector<Anchor> all;
    for (const Definition& d : definitions()) all.push_back(d.anchor);
    return all;
  }();
  return kAll;
}

std::span<const AnchorAlgorithm> anchorAlgorithms() {
  static const std::vector<AnchorAlgorithm> kAll = [] {
    std::vector<AnchorAlgorithm> all;
    for (const AnchorCompetitor& a : anchorCompetitors()) all.push_back(a.what);
    return all;
  }();
  return kAll;
}

AnchorOutcome runAnchor(int anchor, int algorithm, std::uint64_t seed) {
  const AnchorProblem problem(anchor);
  if (algorithm < 0 || algorithm >= static_cast<int>(anchorCompetitors().size())) {
    throw InputError(fmt::format("constrained anchors: expected an algorithm in [0, {}], got {}",
                                 anchorCompetitors().size() - 1, algorithm));
  }
  const Anchor& a = definition(anchor).anchor;
  Random random(seed, kAnchorStartStream);
  optim::CmaEsOptions options{.x0 = a.start,
                              .sigma = a.sigma,
                              .lower = problem.lower(),
                              .upper = problem.upper(),
                              .seed = seed};
  for (double& x : options.x0) x += a.start_sigma * random.normal();

  AnchorOutcome outcome;
  outcome.gap = kInfinity;
  const double target = kAnchorGap * std::max(1.0, std::abs(a.best));
  const auto run = [&](const VectorXd& x) {
    optim::Evaluation evaluation = problem.evaluate(x);
    ++outcome.rollouts;
    if (evaluation.feasible()) {
      outcome.gap = std::min(outcome.gap, evaluation.cost - a.best);
    } else {
      ++outcome.infeasible;
    }
    outcome.solved = outcome.gap <= target;
    return evaluation;
  };
  const auto over = [&] { return outcome.solved || outcome.rollouts >= kAnchorCap; };

  const AnchorCompetitor& chosen = anchorCompetitors()[algorithm];
  std::unique_ptr<optim::Optimizer> optimizer;
  if (chosen.make) {
    optimizer = chosen.make(options, static_cast<int>(problem.constraints().size()));
  } else {
    // A draw is refused by running it; a feasible one is run again when it is told, and counts
    // once.
    options.max_draws = std::numeric_limits<int>::max();
    options.acceptance = [&](int, const VectorXd& x) {
      if (outcome.rollouts >= kAnchorCap || problem.evaluate(x).feasible()) return 1.0;
      run(x);
      return 0.0;
    };
    optimizer = std::make_unique<optim::CmaEs>(options);
  }
  while (!over()) {
    for (const optim::Candidate& c : optimizer->ask()) {
      if (over()) return outcome;  // its draws took the last rollouts
      const optim::Evaluation evaluation = run(c.x);
      if (over()) return outcome;
      optimizer->tell(c.id, evaluation);
    }
  }
  return outcome;
}

}  // namespace traceur::reproduce
