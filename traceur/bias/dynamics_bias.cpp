#include "traceur/bias/dynamics_bias.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "traceur/core/error.h"

namespace traceur::bias {
namespace {

VectorXd inputOf(const VectorXd& x, const VectorXd& u, const BiasOptions& o) {
  VectorXd input(x.size() + u.size());
  input << x, u;
  return input.cwiseProduct(o.input_scale);
}

std::vector<Eigen::Index> learnedOf(const BiasOptions& o) {
  std::vector<Eigen::Index> learned;
  for (Eigen::Index i = 0; i < o.output_scale.size(); ++i) {
    if (o.output_scale[i] != 0) learned.push_back(i);
  }
  return learned;
}

gp::Regression regressionOf(const std::vector<BiasSample>& samples, const BiasOptions& o) {
  if (o.input_scale.size() != o.kernel.lengths.size()) {
    throw InputError(fmt::format("bias: {} scales of inputs, but the kernel has {} lengths",
                                 o.input_scale.size(), o.kernel.lengths.size()));
  }
  const std::vector<Eigen::Index> learned = learnedOf(o);
  gp::Regression regression(o.kernel, static_cast<int>(learned.size()));
  for (const BiasSample& s : samples) {
    if (s.x.size() + s.u.size() != o.input_scale.size() ||
        s.difference.size() != o.output_scale.size()) {
      throw InputError("bias: a sample of another size than the scales");
    }
    regression.add(inputOf(s.x, s.u, o),
                   VectorXd(s.difference.cwiseProduct(o.output_scale))(learned));
  }
  if (o.other_lengths.empty() && o.other_signals.empty()) return regression;
  std::vector<VectorXd> lengths = {o.kernel.lengths};
  lengths.insert(lengths.end(), o.other_lengths.begin(), o.other_lengths.end());
  std::vector<double> signals = {o.kernel.signal};
  signals.insert(signals.end(), o.other_signals.begin(), o.other_signals.end());
  gp::Kernel best = o.kernel;
  double most = regression.logLikelihood();
  for (const double signal : signals) {
    for (const VectorXd& l : lengths) {
      gp::Kernel kernel{l, signal, o.kernel.noise};
      regression.setKernel(kernel);
      const double likelihood = regression.logLikelihood();
      if (!(likelihood > most)) continue;
      most = likelihood;
      best = std::move(kernel);
    }
  }
  regression.setKernel(best);
  return regression;
}

/// Where the model goes from x0 with `bias` added in each step.
VectorXd wentTo(Plant& model, const VectorXd& x0, const MatrixXd& u, const VectorXd& bias) {
  model.reset(x0);
  VectorXd x;
  for (Eigen::Index i = 0; i < u.cols(); ++i) {
    model.step(u.col(i));
    x = model.state() + bias;
    model.reset(x);
  }
  return x;
}

VectorXd constantBias(Plant& model, const VectorXd& x0, const MatrixXd& u, const VectorXd& x1,
                      const std::vector<Eigen::Index>& learned) {
  const auto n = static_cast<Eigen::Index>(learned.size());
  VectorXd bias = VectorXd::Zero(x0.size());
  const VectorXd alone = wentTo(model, x0, u, bias);
  static constexpr double kSmall = 1e-6;
  MatrixXd S(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    bias[learned[i]] = kSmall;
    S.col(i) = VectorXd(wentTo(model, x0, u, bias) - alone)(learned) / kSmall;
    bias[learned[i]] = 0;
  }
  const VectorXd missed = VectorXd(x1 - alone)(learned);
  bias(learned) = VectorXd(S.partialPivLu().solve(missed));
  return bias;
}

/// The states from x0 on with `more` added to each input.
MatrixXd pathOf(Plant& model, const VectorXd& x0, const MatrixXd& u, const VectorXd& more) {
  MatrixXd x(x0.size(), u.cols() + 1);
  model.reset(x0);
  x.col(0) = x0;
  for (Eigen::Index i = 0; i < u.cols(); ++i) {
    model.step(u.col(i) + more);
    x.col(i + 1) = model.state();
  }
  return x;
}

struct Window {
  MatrixXd x;           ///< (n x k + 1) states
  VectorXd difference;  ///< BiasSample's
};

Window inputBias(Plant& model, const MatrixXd& readings, const MatrixXd& u, const VectorXd& noise) {
  static constexpr double kLeastNoise = 1e-12;  // variance, where none was seen
  static constexpr double kSmall = 1e-5;        // for differences
  const Eigen::Index n = readings.rows();
  const VectorXd weights = noise.cwiseMax(kLeastNoise).cwiseSqrt().cwiseInverse();
  const auto weighted = [&](const MatrixXd& x) {
    return VectorXd((weights.asDiagonal() * x).reshaped());
  };
  VectorXd x0 = readings.col(0);
  VectorXd more = VectorXd::Zero(u.rows());
  MatrixXd x = pathOf(model, x0, u, more);
  for (int round = 0; round < 2; ++round) {
    MatrixXd J(readings.size(), n + u.rows());
    for (Eigen::Index i = 0; i < J.cols(); ++i) {
      double& value = i < n ? x0[i] : more[i - n];
      const double here = value;
      value += kSmall;
      J.col(i) = weighted(pathOf(model, x0, u, more) - x) / kSmall;
      value = here;
    }
    const VectorXd change =
        (J.transpose() * J).ldlt().solve(J.transpose() * weighted(readings - x));
    x0 += change.head(n);
    more += change.tail(u.rows());
    x = pathOf(model, x0, u, more);
  }
  return {std::move(x), std::move(more)};
}

/// What is against the sample from reading t on.
std::optional<LeftOut> unusable(const RunLog& log, int t, Plant& model, const BiasOptions& o,
                                const std::function<bool(const VectorXd& x)>& keep) {
  const Eigen::Index n = log.x.rows();
  for (int i = t; i <= t + o.average; ++i) {
    if (!keep(log.x.col(i))) return LeftOut{.reading = i};
    if (i == t || std::isinf(o.outlier)) continue;
    model.reset(log.x.col(i - 1));
    model.step(log.u.col(i - 1));
    const VectorXd missed = log.x.col(i) - model.state();
    if (!(missed.cwiseProduct(o.input_scale.head(n)).norm() <= o.outlier)) {
      return LeftOut{.reading = i, .outlier = true};
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<BiasSample> samplesOf(const RunLog& log, Plant& model, const BiasOptions& o,
                                  const std::function<bool(const VectorXd& x)>& keep,
                                  std::vector<LeftOut>* left_out) {
  if (log.x.rows() != model.states() || log.u.rows() != model.inputs() ||
      log.x.cols() != log.u.cols() + 1) {
    throw InputError(fmt::format(
        "bias: a log of {} states, {} inputs, {} readings and {} steps; the model has {} states "
        "and "
        "{} inputs",
        log.x.rows(), log.u.rows(), log.x.cols(), log.u.cols(), model.states(), model.inputs()));
  }
  if (std::abs(log.time_step - model.timeStep()) > 1e-9) {
    throw InputError(fmt::format("bias: a log of steps of {} s; the model's are {} s",
                                 log.time_step, model.timeStep()));
  }
  const std::vector<Eigen::Index> learned = learnedOf(o);
  std::vector<BiasSample> samples;
  const int k = o.average;
  const Eigen::Index m = log.u.rows();
  const auto directions = static_cast<Eigen::Index>(o.directions.size());
  for (int t = 0; t + k <= log.steps(); t += o.stride) {
    const std::optional<LeftOut> bad = unusable(log, t, model, o, keep);
    if (bad) {
      if (left_out) left_out->push_back(*bad);
      continue;
    }
    VectorXd u(m * static_cast<Eigen::Index>(1 + o.lags.size()) + directions);
    u.head(m) = log.u.middleCols(t, k).rowwise().mean();
    for (size_t l = 0; l < o.lags.size(); ++l) {
      const int from = std::max(0, t - o.lags[l]);
      const int count = std::max(0, t + k - o.lags[l] - from);
      u.segment(m * static_cast<Eigen::Index>(1 + l), m) =
          log.u.middleCols(from, count).rowwise().sum() / k;
    }
    const MatrixXd readings = log.x.middleCols(t, k + 1);
    const MatrixXd inputs = log.u.middleCols(t, k);
    const Window window = o.noise.size() > 0
                              ? inputBias(model, readings, inputs, o.noise)
                              : Window{readings, constantBias(model, readings.col(0), inputs,
                                                              readings.col(k), learned)};
    for (Eigen::Index d = 0; d < directions; ++d) {
      u[u.size() - directions + d] =
          (window.x.row(o.directions[d]).head(k) / o.direction_scale).array().tanh().mean();
    }
    samples.push_back({window.x.leftCols(k).rowwise().mean(), std::move(u), window.difference});
  }
  return samples;
}

std::vector<BiasSample> spread(const std::vector<BiasSample>& samples, const BiasOptions& o) {
  if (static_cast<int>(samples.size()) <= o.most) return samples;
  std::vector<VectorXd> at;
  at.reserve(samples.size());
  for (const BiasSample& s : samples) {
    at.push_back(inputOf(s.x, s.u, o).cwiseQuotient(o.kernel.lengths));
  }
  std::vector<double> nearest(samples.size(), std::numeric_limits<double>::infinity());
  std::vector<BiasSample> chosen;
  size_t next = 0;
  while (static_cast<int>(chosen.size()) < o.most) {
    chosen.push_back(samples[next]);
    const VectorXd here = at[next];
    for (size_t i = 0; i < at.size(); ++i) {
      nearest[i] = std::min(nearest[i], (at[i] - here).squaredNorm());
    }
    next = static_cast<size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  return chosen;
}

DynamicsBias::DynamicsBias(const std::vector<BiasSample>& samples, BiasOptions options)
    : options_(std::move(options)),
      learned_(learnedOf(options_)),
      unscale_(VectorXd(options_.output_scale(learned_)).cwiseInverse()),
      regression_(regressionOf(samples, options_)),
      predictor_(regression_) {}

double DynamicsBias::predict(const VectorXd& x, const VectorXd& u, VectorXd& difference,
                             Scratch& s) const {
  const Eigen::Index n = x.size();
  s.input.resize(n + u.size());
  s.input.head(n) = x.cwiseProduct(options_.input_scale.head(n));
  s.input.tail(u.size()) = u.cwiseProduct(options_.input_scale.tail(u.size()));
  s.output.resize(unscale_.size());
  const double variance = predictor_.meanAndVariance(s.input, s.output, s.gp);
  // The outputs share a kernel, so all their variances are this one.
  const auto m = static_cast<double>(unscale_.size());
  const double weight = std::exp(-options_.decay * m * variance * variance);
  difference.setZero(options_.output_scale.size());
  for (Eigen::Index i = 0; i < unscale_.size(); ++i) {
    difference[learned_[i]] = weight * s.output[i] * unscale_[i];
  }
  return weight;
}

VectorXd explained(const DynamicsBias& bias, const std::vector<BiasSample>& samples) {
  const std::vector<Eigen::Index> learned = learnedOf(bias.options());
  VectorXd left = VectorXd::Zero(static_cast<Eigen::Index>(learned.size()));
  VectorXd whole = left;
  VectorXd g;
  DynamicsBias::Scratch scratch;
  for (const BiasSample& s : samples) {
    bias.predict(s.x, s.u, g, scratch);
    whole += VectorXd(s.difference(learned)).cwiseAbs2();
    left += VectorXd((s.difference - g)(learned)).cwiseAbs2();
  }
  VectorXd share(whole.size());
  for (Eigen::Index i = 0; i < whole.size(); ++i) {
    share[i] = whole[i] > 0 ? 1 - left[i] / whole[i] : NAN;
  }
  return share;
}

CorrectedPlant::CorrectedPlant(std::unique_ptr<Plant> model,
                               std::shared_ptr<const DynamicsBias> bias)
    : model_(std::move(model)), bias_(std::move(bias)) {
  const std::vector<int>& lags = bias_->options().lags;
  const int longest = lags.empty() ? 0 : *std::max_element(lags.begin(), lags.end());
  past_ = MatrixXd::Zero(model_->inputs(), longest + 1);
  u_.resize(model_->inputs() * static_cast<Eigen::Index>(1 + lags.size()) +
            static_cast<Eigen::Index>(bias_->options().directions.size()));
}

void CorrectedPlant::reset(const VectorXd& x) {
  model_->reset(x);
  past_.setZero();
}

void CorrectedPlant::step(const VectorXd& u) {
  const Eigen::Index m = u.size();
  past_.col(now_) = u;
  u_.head(m) = u;
  const BiasOptions& o = bias_->options();
  const std::vector<int>& lags = o.lags;
  const auto directions = static_cast<Eigen::Index>(o.directions.size());
  for (Eigen::Index d = 0; d < directions; ++d) {
    u_[u_.size() - directions + d] =
        std::tanh(model_->state()[o.directions[d]] / o.direction_scale);
  }
  for (size_t l = 0; l < lags.size(); ++l) {
    u_.segment(m * static_cast<Eigen::Index>(1 + l), m) =
        past_.col((now_ + past_.cols() - lags[l]) % past_.cols());
  }
  now_ = (now_ + 1) % past_.cols();
  bias_->predict(model_->state(), u_, difference_, scratch_);
  if (o.noise.size() > 0) {
    model_->step(u + difference_);
    return;
  }
  model_->step(u);
  x_ = model_->state() + difference_;
  model_->reset(x_);
}

}  // namespace traceur::bias
