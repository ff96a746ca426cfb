// Functions with a known minimum, for tests, benchmarks and first programs.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "traceur/optim/problem.h"

namespace traceur::optim {

/// Any function of n numbers as a Problem, unbounded unless told otherwise.
class FunctionProblem : public Problem {
 public:
  using Function = std::function<double(const VectorXd&)>;

  /// @param f  pure, and callable from several threads at once
  FunctionProblem(int n, Function f)
      : FunctionProblem(VectorXd::Constant(n, -std::numeric_limits<double>::infinity()),
                        VectorXd::Constant(n, std::numeric_limits<double>::infinity()),
                        std::move(f)) {}
  FunctionProblem(VectorXd lower, VectorXd upper, Function f)
      : lower_(std::move(lower)), upper_(std::move(upper)), f_(std::move(f)) {}

  VectorXd lower() const override { return lower_; }
  VectorXd upper() const override { return upper_; }
  Evaluation evaluate(const VectorXd& x) const override { return {.cost = f_(x)}; }

 private:
  VectorXd lower_;
  VectorXd upper_;
  Function f_;
};

/// Σ x_i²; least 0 at 0.
inline double sphere(const VectorXd& x) {
  return x.squaredNorm();
}

/// Σ 10^(6 (i-1)/(n-1)) x_i²: axis-parallel, condition 10⁶; least 0 at 0.
inline double ellipsoid(const VectorXd& x) {
  const auto n = static_cast<int>(x.size());
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += std::pow(1e6, n > 1 ? i / (n - 1.0) : 0) * x[i] * x[i];
  return sum;
}

/// x_1² + 10⁶ Σ_{i>1} x_i²; least 0 at 0.
inline double cigar(const VectorXd& x) {
  return x[0] * x[0] + 1e6 * x.tail(x.size() - 1).squaredNorm();
}

/// Σ 100 (x_i² - x_{i+1})² + (1 - x_i)², n ≥ 2; least 0 at (1, …, 1). For n ≥ 4 there is a local
/// minimum of about 3.99 near (-1, 1, …, 1).
inline double rosenbrock(const VectorXd& x) {
  double sum = 0;
  for (int i = 0; i + 1 < x.size(); ++i) {
    const double valley = x[i] * x[i] - x[i + 1];
    sum += 100 * valley * valley + (1 - x[i]) * (1 - x[i]);
  }
  return sum;
}

struct TestFunction {
  std::string name;
  double (*f)(const VectorXd&);
};

inline const std::vector<TestFunction>& testFunctions() {
  static const std::vector<TestFunction> kAll = {
      {"sphere", sphere}, {"ellipsoid", ellipsoid}, {"cigar", cigar}, {"rosenbrock", rosenbrock}};
  return kAll;
}

}  // namespace traceur::optim
