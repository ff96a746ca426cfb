// The difference between a plant and its model, learnt from runs, and the model corrected by it.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "traceur/core/plant.h"
#include "traceur/gp/regression.h"

namespace traceur::bias {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What was seen of one run of a plant.
struct RunLog {
  double time_step = 0;  ///< [s]
  MatrixXd x;            ///< (n x T + 1) state readings, the first before any input
  MatrixXd u;            ///< (m x T) inputs, held from one reading to the next

  int steps() const { return static_cast<int>(u.cols()); }
};

struct BiasOptions {
  /// (n + m) what the regression's inputs, state then input, are multiplied by; (n) its outputs.
  VectorXd input_scale, output_scale;
  gp::Kernel kernel;
  /// A sample is the mean discrepancy of so many steps. 1 is the printed one-step difference
  /// [Ha2015, Eq. 54], which of a plant with contacts is mostly their jitter; 10 and more average
  /// it away [ours].
  int average = 20;
  int stride = 40;   ///< steps from one sample to the next
  int most = 120;    ///< samples kept of all runs, those farthest from each other
  double decay = 1;  ///< d of [Ha2015, Eq. 55]
};

/// A sample: in state x, given u, the plant moved by `difference` more in a step than the model.
struct BiasSample {
  VectorXd x;           ///< (n)
  VectorXd u;           ///< (m)
  VectorXd difference;  ///< (n), of one step
};

/// The mean one-step differences of a run, of k = options.average steps each:
///
///     Δ_t = (x_{t+k} - Φ_k(x_t, u_t … u_{t+k-1})) / k
///
/// where Φ_k are k steps of the model from the reading x_t. The sample's x and u are the means over
/// its steps.
/// @param keep  whether a reading may be used; a sample needs all of its own
/// @throws InputError for a log of another plant's sizes or time step
std::vector<BiasSample> samplesOf(const RunLog& log, Plant& model, const BiasOptions& options,
                                  const std::function<bool(const VectorXd& x)>& keep);

/// At most so many of the samples, each chosen to be as far as can be from those chosen before, in
/// the kernel's lengths; the first is kept.
std::vector<BiasSample> spread(const std::vector<BiasSample>& samples, const BiasOptions& options);

/// g of [Ha2015, Eq. 55]: the regression's mean, weighted by how sure it is,
///
///     g(x, u) = exp(-d |v|²) mean(x, u),   v the variances of the n outputs
///
/// so that far from all samples the model stands as it is.
class DynamicsBias {
 public:
  /// @throws InputError for samples that the regression refuses, or scales of other sizes
  DynamicsBias(const std::vector<BiasSample>& samples, BiasOptions options);

  int samples() const { return regression_.size(); }
  const gp::Regression& regression() const { return regression_; }

  struct Scratch {
    VectorXd input;
    gp::Predictor::Scratch gp;
  };
  /// @param difference  (n) written: what a step adds to the model's
  /// @return the weight exp(-d |v|²) that is in it already
  double predict(const VectorXd& x, const VectorXd& u, VectorXd& difference,
                 Scratch& scratch) const;

 private:
  BiasOptions options_;
  gp::Regression regression_;
  gp::Predictor predictor_;
};

/// How much of the differences' variance a bias explains, R² by output: 1 - Σ(Δ - g)² / ΣΔ².
/// Measured against no correction at all, not against a mean.
VectorXd explained(const DynamicsBias& bias, const std::vector<BiasSample>& samples);

/// A model with its bias: x_{t+1} = f(x_t, u_t) + g(x_t, u_t) [Ha2015, Eq. 50].
class CorrectedPlant : public Plant {
 public:
  /// @param bias  null: the model alone
  CorrectedPlant(std::unique_ptr<Plant> model, std::shared_ptr<const DynamicsBias> bias);

  int states() const override { return model_->states(); }
  int inputs() const override { return model_->inputs(); }
  double timeStep() const override { return model_->timeStep(); }
  void reset(const VectorXd& x) override { model_->reset(x); }
  void step(const VectorXd& u) override;
  const VectorXd& state() const override { return model_->state(); }

 private:
  std::unique_ptr<Plant> model_;
  std::shared_ptr<const DynamicsBias> bias_;
  DynamicsBias::Scratch scratch_;
  VectorXd difference_, x_;
};

}  // namespace traceur::bias
