// The dissertation's toy problems: a small feasible corner, and costs that noise blurs.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "traceur/optim/optimizer.h"

namespace traceur::reproduce {

/// One row of Tables 7 to 9 [Ha2015, §6.4]: a problem in the plane,
///
///     shape kTriangle:  f_toy = 0.1 ‖x - (3.9, 3.9)‖²,  fails where x > 4 or y > 4, and x + y < r
///     shape kL:         f_toy = 0.1 ‖x - (3.1, 3.6)‖²,  fails where x > 4 or y > 4, and
///                       x < 3 or y < 3 or (x < 3.5 and y < 3.5)
///     noise kRandom:      f = f_toy + U(0, 0.05) where feasible, + U(0, 2) elsewhere
///     noise kUndulation:  f = f_toy + k |sin(w (x+y)) + sin(w (x-y))|
///
/// Area ratio, infeasible to feasible: the printed 50, 200, 800 are those of [0, 5]² at r = 7, 7.5,
/// 7.75, although the printed domain is [-5, 5]².
struct ToyRow {
  enum class Shape { kTriangle, kL };
  enum class Noise { kRandom, kUndulation };

  std::string name;    ///< "Toy1 ratio 200"
  std::string tables;  ///< where it is printed: "7, 8"
  Shape shape = Shape::kTriangle;
  Noise noise = Noise::kRandom;
  double r = 7.5;             ///< of kTriangle
  double k = 0;               ///< height of kUndulation
  double w = 0;               ///< its frequency
  double printed_cma_es = 0;  ///< mean evaluations of CMA-ES over 20 seeds, as printed
  double printed_cma_c = 0;   ///< of CMA-C

  Eigen::Vector2d optimum() const;  ///< of f_toy
};

/// The ten rows.
std::span<const ToyRow> toyRows();

/// A row as a problem without bounds. What noise a point gets depends on (seed, x) alone: a fresh
/// draw for every new point, and equal points give equal bits, as Problem asks.
class ToyProblem : public optim::Problem {
 public:
  ToyProblem(const ToyRow& row, std::uint64_t seed) : row_(row), seed_(seed) {}

  Eigen::VectorXd lower() const override;
  Eigen::VectorXd upper() const override;
  std::vector<std::string> constraints() const override;
  optim::Evaluation evaluate(const Eigen::VectorXd& x) const override;
  /// f_toy, without noise.
  double smoothCost(const Eigen::VectorXd& x) const;

 private:
  ToyRow row_;
  std::uint64_t seed_;
};

/// When a run of a row ends. The dissertation does not say when its did; kCollapsed explains its
/// numbers best.
enum class ToyStop {
  kCollapsed,  ///< eight trials in a row, of a generation if it has eight, within 0.5 of optimum()
  kReached,    ///< a feasible trial with f_toy < 0.002
};

/// An evaluation count at which a run is given up and counted as this many.
inline constexpr int kToyCap = 2000;

struct ToyOutcome {
  int evaluations = 0;  ///< trials simulated; kToyCap if missed
  bool missed = false;
  int infeasible = 0;  ///< of the trials simulated
};

/// Who runs the rows: μ/λ = 4/8 where there is a λ, σ₀ = 5, the first mean uniform in [-5, 5]².
struct ToyAlgorithm {
  std::string name;  ///< "CMA-C"
  std::string help;  ///< one sentence
};

std::span<const ToyAlgorithm> toyAlgorithms();

/// One run. Equal seeds give every algorithm the same start and the same noise.
/// @param on_trial  sees every trial, if given
/// @return the outcome, and the optimiser as the run left it
/// @throws InputError for a row or an algorithm there is not
std::pair<ToyOutcome, std::unique_ptr<optim::Optimizer>> runToy(
    int row, int algorithm, std::uint64_t seed, ToyStop stop = ToyStop::kCollapsed,
    const std::function<void(const optim::Candidate&, const optim::Evaluation&)>& on_trial = {});

}  // namespace traceur::reproduce
