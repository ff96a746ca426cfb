#include "traceur/bias/dynamics_bias.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"

namespace traceur::bias {
namespace {

VectorXd inputOf(const VectorXd& x, const VectorXd& u, const BiasOptions& o) {
  VectorXd input(x.size() + u.size());
  input << x, u;
  return input.cwiseProduct(o.input_scale);
}

gp::Regression regressionOf(const std::vector<BiasSample>& samples, const BiasOptions& o) {
  if (o.input_scale.size() != o.kernel.lengths.size()) {
    throw InputError(fmt::format("bias: {} scales of inputs, but the kernel has {} lengths",
                                 o.input_scale.size(), o.kernel.lengths.size()));
  }
  gp::Regression regression(o.kernel, static_cast<int>(o.output_scale.size()));
  for (const BiasSample& s : samples) {
    if (s.x.size() + s.u.size() != o.input_scale.size() ||
        s.difference.size() != o.output_scale.size()) {
      throw InputError("bias: a sample of another size than the scales");
    }
    regression.add(inputOf(s.x, s.u, o), s.difference.cwiseProduct(o.output_scale));
  }
  return regression;
}

}  // namespace

std::vector<BiasSample> samplesOf(const RunLog& log, Plant& model, const BiasOptions& o,
                                  const std::function<bool(const VectorXd& x)>& keep) {
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
  std::vector<BiasSample> samples;
  const int k = o.average;
  for (int t = 0; t + k <= log.steps(); t += o.stride) {
    bool good = true;
    for (int i = t; i <= t + k && good; ++i) good = keep(log.x.col(i));
    if (!good) continue;
    model.reset(log.x.col(t));
    for (int i = t; i < t + k; ++i) model.step(log.u.col(i));
    samples.push_back({log.x.middleCols(t, k).rowwise().mean(),
                       log.u.middleCols(t, k).rowwise().mean(),
                       (log.x.col(t + k) - model.state()) / k});
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
      regression_(regressionOf(samples, options_)),
      predictor_(regression_) {}

double DynamicsBias::predict(const VectorXd& x, const VectorXd& u, VectorXd& difference,
                             Scratch& s) const {
  const Eigen::Index n = x.size();
  s.input.resize(n + u.size());
  s.input.head(n) = x.cwiseProduct(options_.input_scale.head(n));
  s.input.tail(u.size()) = u.cwiseProduct(options_.input_scale.tail(u.size()));
  difference.resize(n);
  const double variance = predictor_.meanAndVariance(s.input, difference, s.gp);
  // The outputs share a kernel, so all n variances are this one.
  const double weight = std::exp(-options_.decay * static_cast<double>(n) * variance * variance);
  difference = weight * difference.cwiseQuotient(options_.output_scale);
  return weight;
}

VectorXd explained(const DynamicsBias& bias, const std::vector<BiasSample>& samples) {
  VectorXd left, whole, g;
  DynamicsBias::Scratch scratch;
  for (const BiasSample& s : samples) {
    bias.predict(s.x, s.u, g, scratch);
    if (whole.size() == 0) left = whole = VectorXd::Zero(g.size());
    whole += s.difference.cwiseAbs2();
    left += (s.difference - g).cwiseAbs2();
  }
  return VectorXd::Ones(whole.size()) - left.cwiseQuotient(whole);
}

CorrectedPlant::CorrectedPlant(std::unique_ptr<Plant> model,
                               std::shared_ptr<const DynamicsBias> bias)
    : model_(std::move(model)), bias_(std::move(bias)) {}

void CorrectedPlant::step(const VectorXd& u) {
  if (!bias_) {
    model_->step(u);
    return;
  }
  bias_->predict(model_->state(), u, difference_, scratch_);
  model_->step(u);
  x_ = model_->state() + difference_;
  model_->reset(x_);
}

}  // namespace traceur::bias
