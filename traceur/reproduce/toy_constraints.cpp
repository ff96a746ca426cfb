#include "traceur/reproduce/toy_constraints.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/optim/cma_c.h"
#include "traceur/optim/one_plus_one.h"
#include "traceur/optim/restarts.h"

namespace traceur::reproduce {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using Shape = ToyRow::Shape;
using Noise = ToyRow::Noise;

constexpr double kSigma = 5;      ///< σ₀ [Ha2015, §6.4]
constexpr int kLambda = 8;        ///< λ, with μ = 4 [Ha2015, §6.4]
constexpr double kDomain = 5;     ///< the first mean is uniform in [-5, 5]²
constexpr double kRadius = 0.5;   ///< of ToyStop::kCollapsed
constexpr double kClose = 0.002;  ///< of ToyStop::kReached
/// The stream of a run's start, apart from those of its optimiser and of the noise.
constexpr std::uint64_t kToyStartStream = 0x746f79;  // "toy"

}  // namespace

Vector2d ToyRow::optimum() const {
  return shape == Shape::kTriangle ? Vector2d(3.9, 3.9) : Vector2d(3.1, 3.6);
}

std::span<const ToyRow> toyRows() {
  static constexpr auto kTriangle = Shape::kTriangle;
  static constexpr auto kUndulation = Noise::kUndulation;
  static const std::array<ToyRow, 10> kRows = {{
      {"Toy1 ratio 200", "7, 8", kTriangle, Noise::kRandom, 7.5, 0, 0, 663.2, 144.8},
      {"Toy1 ratio 50", "8", kTriangle, Noise::kRandom, 7.0, 0, 0, 237.2, 153.2},
      {"Toy1 ratio 800", "8", kTriangle, Noise::kRandom, 7.75, 0, 0, 1343.6, 200.0},
      {"Toy2 k=2 w=10", "7, 9", kTriangle, kUndulation, 7.5, 2, 10, 1026.4, 229.6},
      {"Toy2 k=1 w=10", "9", kTriangle, kUndulation, 7.5, 1, 10, 638.8, 195.2},
      {"Toy2 k=4 w=10", "9", kTriangle, kUndulation, 7.5, 4, 10, 1820.4, 309.2},
      {"Toy2 k=1 w=20", "9", kTriangle, kUndulation, 7.5, 1, 20, 735.2, 220.0},
      {"Toy2 k=2 w=20", "9", kTriangle, kUndulation, 7.5, 2, 20, 1079.6, 272.0},
      {"Toy2 k=4 w=20", "9", kTriangle, kUndulation, 7.5, 4, 20, 1574.8, 348.0},
      {"Toy3", "7", Shape::kL, kUndulation, 0, 2, 10, 1027.2, 205.2},
  }};
  return kRows;
}

VectorXd ToyProblem::lower() const {
  return VectorXd::Constant(2, -std::numeric_limits<double>::infinity());
}

VectorXd ToyProblem::upper() const {
  return VectorXd::Constant(2, std::numeric_limits<double>::infinity());
}

std::vector<std::string> ToyProblem::constraints() const {
  return {"beyond 4", row_.shape == Shape::kTriangle ? "below diagonal" : "outside L"};
}

double ToyProblem::smoothCost(const VectorXd& x) const {
  return 0.1 * (x - row_.optimum()).squaredNorm();
}

optim::Evaluation ToyProblem::evaluate(const VectorXd& x) const {
  const bool beyond = x[0] > 4 || x[1] > 4;
  const bool outside = row_.shape == Shape::kTriangle
                           ? x[0] + x[1] < row_.r
                           : x[0] < 3 || x[1] < 3 || (x[0] < 3.5 && x[1] < 3.5);
  double noise = 0;
  if (row_.noise == Noise::kRandom) {
    Random random(seed_, std::bit_cast<std::uint64_t>(x[0]), std::bit_cast<std::uint64_t>(x[1]));
    noise = random.uniform(0, beyond || outside ? 2 : 0.05);
  } else {
    noise = row_.k * std::abs(std::sin(row_.w * (x[0] + x[1])) + std::sin(row_.w * (x[0] - x[1])));
  }
  return {.cost = smoothCost(x) + noise, .violated = {beyond, outside}};
}

namespace {

struct ToyCompetitor {
  ToyAlgorithm what;
  std::function<std::unique_ptr<optim::Optimizer>(const VectorXd& x0, std::uint64_t seed)> make;
};

optim::CmaEsOptions cmaEs(const VectorXd& x0, std::uint64_t seed, bool feasible_first) {
  return {
      .x0 = x0, .sigma = kSigma, .lambda = kLambda, .seed = seed, .feasible_first = feasible_first};
}

/// A collapsed competitor starts anew where CMA-C would: fair, and better for it than to go on.
constexpr double kCollapsed = 0.02;

const std::vector<ToyCompetitor>& toyCompetitors() {
  static const std::vector<ToyCompetitor> kAll = {
      {{"CMA-ES", "CMA-ES, all trials ranked by cost, as printed."},
       [](const VectorXd& x0, std::uint64_t seed) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::CmaEs>(cmaEs(x0, seed, false));
       }},
      {{"CMA-C 2015", "CMA-C as printed."},
       [](const VectorXd& x0, std::uint64_t seed) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::CmaC>(optim::dissertationCmaC(cmaEs(x0, seed, false), 2));
       }},
      {{"CMA-C", "CMA-C with Traceur's defaults."},
       [](const VectorXd& x0, std::uint64_t seed) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::CmaC>(
             optim::CmaCOptions{.cma = cmaEs(x0, seed, true), .constraints = 2});
       }},
      {{"(1+1)-CMA-ES", "(1+1)-CMA-ES, fewer violations first, restarted when collapsed."},
       [](const VectorXd& x0, std::uint64_t seed) -> std::unique_ptr<optim::Optimizer> {
         return std::make_unique<optim::OnePlusOne>(optim::OnePlusOneOptions{.x0 = x0,
                                                                             .sigma = kSigma,
                                                                             .constraints = 2,
                                                                             .seed = seed,
                                                                             .tolx = kCollapsed,
                                                                             .restarts = kToyCap});
       }},
      {{"CMA-ES feasible first", "CMA-ES, feasible trials first, restarted when collapsed."},
       [](const VectorXd& x0, std::uint64_t seed) -> std::unique_ptr<optim::Optimizer> {
         optim::CmaEsOptions o = cmaEs(x0, seed, true);
         o.termination.tolx = kCollapsed;
         return std::make_unique<optim::Restarts>(
             o, optim::RestartOptions{.restarts = kToyCap, .growth = 1});
       }},
  };
  return kAll;
}

}  // namespace

std::span<const ToyAlgorithm> toyAlgorithms() {
  static const std::vector<ToyAlgorithm> kAll = [] {
    std::vector<ToyAlgorithm> all;
    for (const ToyCompetitor& a : toyCompetitors()) all.push_back(a.what);
    return all;
  }();
  return kAll;
}

std::pair<ToyOutcome, std::unique_ptr<optim::Optimizer>> runToy(
    int row, int algorithm, std::uint64_t seed, ToyStop stop,
    const std::function<void(const optim::Candidate&, const optim::Evaluation&)>& on_trial) {
  if (row < 0 || row >= static_cast<int>(toyRows().size())) {
    throw InputError(fmt::format("toy constraints: expected a row in [0, {}], got {}",
                                 toyRows().size() - 1, row));
  }
  if (algorithm < 0 || algorithm >= static_cast<int>(toyCompetitors().size())) {
    throw InputError(fmt::format("toy constraints: expected an algorithm in [0, {}], got {}",
                                 toyCompetitors().size() - 1, algorithm));
  }
  const ToyProblem problem(toyRows()[row], seed);
  const Vector2d optimum = toyRows()[row].optimum();
  Random random(seed, kToyStartStream);
  VectorXd x0(2);
  for (double& x : x0) x = random.uniform(-kDomain, kDomain);
  std::unique_ptr<optim::Optimizer> optimizer = toyCompetitors()[algorithm].make(x0, seed);

  ToyOutcome outcome;
  int close_in_a_row = 0;
  while (outcome.evaluations < kToyCap) {
    for (const optim::Candidate& c : optimizer->ask()) {
      const optim::Evaluation evaluation = problem.evaluate(c.x);
      if (on_trial) on_trial(c, evaluation);
      ++outcome.evaluations;
      outcome.infeasible += !evaluation.feasible();
      close_in_a_row = (c.x - optimum).norm() <= kRadius ? close_in_a_row + 1 : 0;
      if (stop == ToyStop::kReached && evaluation.feasible() && problem.smoothCost(c.x) < kClose) {
        return {outcome, std::move(optimizer)};
      }
      optimizer->tell(c.id, evaluation);
    }
    // Eight in a row: with λ = 8 all of a generation.
    if (stop == ToyStop::kCollapsed && close_in_a_row >= kLambda) {
      return {outcome, std::move(optimizer)};
    }
  }
  outcome.evaluations = kToyCap;
  outcome.missed = true;
  return {outcome, std::move(optimizer)};
}

}  // namespace traceur::reproduce
