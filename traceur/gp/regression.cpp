#include "traceur/gp/regression.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <nlopt.hpp>
#include <numbers>

#include "traceur/core/error.h"

namespace traceur::gp {
namespace {

constexpr const char* kFormat = "traceur gp";

void check(const Kernel& k) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (k.lengths.size() == 0) throw InputError("gp: a kernel has a length for each input, got none");
  for (Eigen::Index j = 0; j < k.lengths.size(); ++j) {
    if (positive(k.lengths[j])) continue;
    throw InputError(
        fmt::format("gp: length {} is {}: expected a number > 0", j + 1, k.lengths[j]));
  }
  if (!positive(k.signal)) {
    throw InputError(fmt::format("gp: signal {}: expected a number > 0", k.signal));
  }
  if (!(k.noise >= 0) || !std::isfinite(k.noise)) {
    throw InputError(fmt::format("gp: noise {}: expected a number >= 0", k.noise));
  }
}

/// k(x, x_a) for the samples a, without noise.
VectorXd covariances(const Kernel& kernel, const MatrixXd& samples, const VectorXd& x) {
  VectorXd k(samples.cols());
  for (Eigen::Index a = 0; a < samples.cols(); ++a) k[a] = kernel(samples.col(a), x);
  return k;
}

/// The next row of the factor, without and with its diagonal entry.
/// @throws InputError where rounding alone would decide that entry
void appendRow(const Kernel& kernel, const MatrixXd& samples, const VectorXd& x, MatrixXd& factor) {
  const Eigen::Index n = factor.rows();
  const VectorXd k = covariances(kernel, samples.leftCols(n), x);
  const VectorXd row =
      n > 0 ? VectorXd(factor.triangularView<Eigen::Lower>().solve(k)) : VectorXd(0);
  const double whole = kernel.signal * kernel.signal + kernel.noise * kernel.noise;
  const double left = whole - row.squaredNorm();
  // Rounding leaves an error of the order of ε times the number of terms.
  const double least =
      4 * std::numeric_limits<double>::epsilon() * static_cast<double>(n + 1) * whole;
  if (!(left > least)) {
    Eigen::Index nearest = 0;
    if (n > 0) k.maxCoeff(&nearest);
    const double distance =
        n > 0 ? ((samples.col(nearest) - x).array() / kernel.lengths.array()).matrix().norm() : 0;
    throw InputError(fmt::format(
        "gp: the kernel matrix is singular with sample {}: it is nearest to sample {}, {:.2g} "
        "lengths away, and noise {:.2g} of signal {:.2g} cannot tell what they say apart",
        n + 1, nearest + 1, distance, kernel.noise, kernel.signal));
  }
  factor.conservativeResize(n + 1, n + 1);
  factor.col(n).setZero();
  factor.row(n).head(n) = row;
  factor(n, n) = std::sqrt(left);
}

}  // namespace

double Kernel::operator()(const VectorXd& a, const VectorXd& b) const {
  return signal * signal * std::exp(-0.5 * ((a - b).array() / lengths.array()).square().sum());
}

Regression::Regression(Kernel kernel, int outputs) : kernel_(std::move(kernel)) {
  check(kernel_);
  if (outputs < 1) throw InputError(fmt::format("gp: {} outputs: expected at least 1", outputs));
  x_.resize(kernel_.lengths.size(), 0);
  y_.resize(outputs, 0);
}

void Regression::add(const VectorXd& x, const VectorXd& y) {
  if (x.size() != x_.rows() || y.size() != y_.rows()) {
    throw InputError(fmt::format("gp: expected a sample of {} inputs and {} outputs, got {} and {}",
                                 x_.rows(), y_.rows(), x.size(), y.size()));
  }
  if (!x.allFinite() || !y.allFinite()) {
    throw InputError(fmt::format("gp: sample {} is not finite", size() + 1));
  }
  appendRow(kernel_, x_, x, factor_);
  const Eigen::Index n = x_.cols();
  x_.conservativeResize(Eigen::NoChange, n + 1);
  y_.conservativeResize(Eigen::NoChange, n + 1);
  x_.col(n) = x;
  y_.col(n) = y;
}

void Regression::setKernel(Kernel kernel) {
  check(kernel);
  if (kernel.lengths.size() != x_.rows()) {
    throw InputError(fmt::format("gp: expected a kernel of {} lengths, got {}", x_.rows(),
                                 kernel.lengths.size()));
  }
  MatrixXd factor;
  for (Eigen::Index a = 0; a < x_.cols(); ++a) appendRow(kernel, x_, x_.col(a), factor);
  kernel_ = std::move(kernel);
  factor_ = std::move(factor);
}

Prediction Regression::predict(const VectorXd& x) const {
  Prediction p{VectorXd::Zero(y_.rows()), kernel_.signal * kernel_.signal};
  if (size() == 0) return p;
  const auto L = factor_.triangularView<Eigen::Lower>();
  const VectorXd v = L.solve(covariances(kernel_, x_, x));
  p.mean = y_ * L.transpose().solve(v);
  p.variance = std::max(0.0, p.variance - v.squaredNorm());
  return p;
}

double Regression::logLikelihood(VectorXd* gradient) const {
  const Eigen::Index n = x_.cols();
  const auto m = static_cast<double>(y_.rows());
  const auto L = factor_.triangularView<Eigen::Lower>();
  MatrixXd alpha = y_.transpose();  // (N x m) K⁻¹ Yᵀ
  if (n > 0) {
    L.solveInPlace(alpha);
    L.transpose().solveInPlace(alpha);
  }
  const double value = -0.5 * (y_.transpose().array() * alpha.array()).sum() -
                       m * factor_.diagonal().array().log().sum() -
                       0.5 * m * static_cast<double>(n) * std::log(2 * std::numbers::pi);
  if (!gradient) return value;
  // ∂ log p / ∂θ = ½ tr((Σ α αᵀ - m K⁻¹) ∂K/∂θ) [Rasmussen2006, Eq. 5.9].
  MatrixXd inverse = MatrixXd::Identity(n, n);
  if (n > 0) {
    L.solveInPlace(inverse);
    L.transpose().solveInPlace(inverse);
  }
  const MatrixXd A = alpha * alpha.transpose() - m * inverse;
  const Eigen::Index r = x_.rows();
  gradient->setZero(r + 2);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      const double weight = 0.5 * A(a, b) * kernel_(x_.col(a), x_.col(b));
      for (Eigen::Index j = 0; j < r; ++j) {
        const double d = (x_(j, a) - x_(j, b)) / kernel_.lengths[j];
        (*gradient)[j] += weight * d * d;
      }
      (*gradient)[r] += 2 * weight;
    }
    (*gradient)[r + 1] += A(a, a) * kernel_.noise * kernel_.noise;
  }
  return value;
}

std::string Regression::save() const {
  nlohmann::ordered_json j{
      {"format", kFormat},
      {"version", 1},
      {"lengths", std::vector<double>(kernel_.lengths.begin(), kernel_.lengths.end())},
      {"signal", kernel_.signal},
      {"noise", kernel_.noise},
      {"outputs", y_.rows()}};
  j["samples"] = nlohmann::ordered_json::array();
  for (Eigen::Index a = 0; a < x_.cols(); ++a) {
    const auto x = x_.col(a);
    const auto y = y_.col(a);
    j["samples"].push_back({{"x", std::vector<double>(x.begin(), x.end())},
                            {"y", std::vector<double>(y.begin(), y.end())}});
  }
  return j.dump(1);
}

Regression Regression::load(const std::string& text, const std::string& where) {
  const auto vector = [](const nlohmann::json& j) {
    const auto values = j.get<std::vector<double>>();
    return VectorXd(
        Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  try {
    const nlohmann::json j = nlohmann::json::parse(text);
    if (j.at("format") != kFormat || j.at("version") != 1) {
      throw InputError("expected format \"traceur gp\", version 1");
    }
    Regression regression({vector(j.at("lengths")), j.at("signal"), j.at("noise")},
                          j.at("outputs"));
    for (const auto& sample : j.at("samples")) {
      regression.add(vector(sample.at("x")), vector(sample.at("y")));
    }
    return regression;
  } catch (const std::exception& e) {
    throw InputError(fmt::format("{}: not a Gaussian process that was saved: {}", where, e.what()));
  }
}

Fit fit(Regression& regression, const FitOptions& options) {
  if (regression.size() == 0) throw InputError("gp: there are no samples to fit a kernel to");
  const int r = regression.inputs();
  const bool noisy = regression.kernel().noise > 0;
  const int n = r + 1 + (noisy ? 1 : 0);
  std::vector<double> start(n);
  for (int j = 0; j < r; ++j) start[j] = std::log(regression.kernel().lengths[j]);
  start[r] = std::log(regression.kernel().signal);
  if (noisy) start[r + 1] = std::log(regression.kernel().noise);

  const auto kernel_of_log = [&](const std::vector<double>& log) {
    Kernel k{VectorXd(r), std::exp(log[r]), noisy ? std::exp(log[r + 1]) : 0};
    for (int j = 0; j < r; ++j) k.lengths[j] = std::exp(log[j]);
    return k;
  };
  Fit result{.before = regression.logLikelihood()};
  struct Work {
    Regression regression;
    std::function<Kernel(const std::vector<double>&)> kernel_of;
    Fit* result;
    std::vector<double> best;
  } work{regression, kernel_of_log, &result, start};
  result.after = result.before;

  nlopt::opt search(nlopt::LD_LBFGS, n);
  std::vector<double> low = start, high = start;
  for (double& x : low) x -= std::log(options.range);
  for (double& x : high) x += std::log(options.range);
  search.set_lower_bounds(low);
  search.set_upper_bounds(high);
  search.set_maxeval(options.evaluations);
  search.set_ftol_rel(1e-9);
  search.set_max_objective(
      [](const std::vector<double>& log, std::vector<double>& gradient, void* data) {
        auto& w = *static_cast<Work*>(data);
        ++w.result->evaluations;
        try {
          w.regression.setKernel(w.kernel_of(log));
        } catch (const InputError&) {  // singular: as unlikely as can be
          std::fill(gradient.begin(), gradient.end(), 0.0);
          return -std::numeric_limits<double>::max();
        }
        VectorXd g;
        const double value = w.regression.logLikelihood(gradient.empty() ? nullptr : &g);
        for (size_t i = 0; i < gradient.size(); ++i) gradient[i] = g[static_cast<Eigen::Index>(i)];
        if (value > w.result->after) {
          w.result->after = value;
          w.best = log;
        }
        return value;
      },
      &work);
  std::vector<double> x = start;
  double value = 0;
  try {
    search.optimize(x, value);
  } catch (const std::exception&) {
    // NLopt gives up on a line search at the limits of rounding; the best so far stands.
  }
  regression.setKernel(kernel_of_log(work.best));
  return result;
}

Predictor::Predictor(const Regression& g)
    : signal2_(static_cast<float>(g.kernel().signal * g.kernel().signal)),
      inverse_lengths_(g.kernel().lengths.cwiseInverse()),
      x_((inverse_lengths_.asDiagonal() * g.x()).transpose().cast<float>()),
      weights_(g.size(), g.outputs()) {
  if (g.size() == 0) return;
  const auto L = g.factor().triangularView<Eigen::Lower>();
  inverse_ = MatrixXd(L.solve(MatrixXd::Identity(g.size(), g.size()))).cast<float>();
  MatrixXd alpha = g.y().transpose();
  L.solveInPlace(alpha);
  L.transpose().solveInPlace(alpha);
  weights_ = alpha.cast<float>();
}

// By value is how Eigen hands out what may be written.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void Predictor::mean(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> mean,
                     Scratch& s) const {
  s.x = x.cwiseProduct(inverse_lengths_).cast<float>();
  s.k.setZero(x_.rows());
  for (Eigen::Index j = 0; j < x_.cols(); ++j) {
    s.k.array() += (x_.col(j).array() - s.x[j]).square();
  }
  s.k.array() = signal2_ * (-0.5F * s.k.array()).exp();
  s.mean.noalias() = weights_.transpose() * s.k;
  mean = s.mean.cast<double>();
}

// NOLINTNEXTLINE(performance-unnecessary-value-param)
double Predictor::meanAndVariance(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> mean,
                                  Scratch& s) const {
  this->mean(x, mean, s);
  const Eigen::Index n = s.k.size();
  s.v.setZero(n);
  // In bands: Eigen's triangular product is a third slower at these sizes.
  static constexpr Eigen::Index kBand = 16;
  for (Eigen::Index i = 0; i < n; i += kBand) {
    const Eigen::Index columns = std::min(kBand, n - i);
    s.v.tail(n - i).noalias() += inverse_.block(i, i, n - i, columns) * s.k.segment(i, columns);
  }
  return std::max(0.0F, signal2_ - s.v.squaredNorm());
}

}  // namespace traceur::gp
