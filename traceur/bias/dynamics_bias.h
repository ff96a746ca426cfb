// The difference between a plant and its model, learnt from runs, and the model corrected by it.
#pragma once

#include <functional>
#include <limits>
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
  /// Besides the input of now, those of so many steps ago are inputs of the regression, so that a
  /// plant that answers late is no noise [ours].
  std::vector<int> lags;
  /// Of these states the direction, tanh(x_i / direction_scale), is an input as well: dry friction
  /// changes with a rate's direction and hardly else [ours].
  std::vector<Eigen::Index> directions;
  double direction_scale = 0.02;  ///< in the unit of the state
  /// What the regression's inputs, (x, u, u of each lag, directions), are multiplied by.
  VectorXd input_scale;
  /// (n) What the differences are multiplied by. One of 0 is not learned and stays 0: of a
  /// mechanism, models get forces wrong, which change rates, and that places follow rates they know
  /// [ours].
  VectorXd output_scale;
  gp::Kernel kernel;
  /// Lengths to try in place of the kernel's: those that make the samples most likely are taken, so
  /// that what does not matter is left out. A free fit has too many to find from noiseless samples
  /// that are alike [ours].
  std::vector<VectorXd> other_lengths;
  /// Signals to try in the same way, each with all lengths: a smaller one is likelier where the
  /// model is right and the samples are noise [ours].
  std::vector<double> other_signals;
  /// A sample is the difference over so many steps. 1 is the printed one-step difference, which of
  /// a plant with contacts is mostly their jitter; 10 and more average it away [ours].
  int average = 20;
  int stride = 40;   ///< steps from one sample to the next
  int most = 100;    ///< samples kept of all runs, those farthest from each other
  double decay = 1;  ///< d of [Ha2015, Eq. 55]
  /// (n) > 0 for noise that hides what the difference of each state is. What is learned is then
  /// what the inputs lack, x_{t+1} = f(x_t, u_t + g(x_t, u_t)), and output_scale is (m): a bias of
  /// few components, which cannot push a machine at rest where no input could [ours]. Empty:
  /// readings are exact.
  VectorXd noise;
  /// A reading is an outlier that is farther than this from where the model goes in a step from the
  /// one before, in the scale of the regression's inputs [Ha2015, §8.3.3, 7].
  double outlier = std::numeric_limits<double>::infinity();
};

/// A sample that was left out, and the first of its readings that may not be used.
struct LeftOut {
  int reading = 0;
  bool outlier = false;  ///< BiasOptions::outlier, not `keep`, is against it
};

/// A sample: in state x, given u, the plant moved by `difference` more in a step than the model.
struct BiasSample {
  VectorXd x;           ///< (n)
  VectorXd u;           ///< (m (1 + lags)), of now, then of each lag, 0 before a run; directions
  VectorXd difference;  ///< (n), of one step; 0 where it is not learned. (m) of inputs, with noise
};

/// The differences of a run over k = options.average steps each: the constant Δ that, added to the
/// model's state in each of them, takes it where the plant went. With Φ_k(Δ) the k steps of the
/// model from the reading x_t under u_t … u_{t+k-1},
///
///     Δ = S⁻¹ (x_{t+k} - Φ_k(0)),   S = ∂Φ_k/∂Δ at 0, by differences
///
/// in the components that are learned. For k = 1 it is x_{t+1} - Φ_1 [Ha2015, Eq. 54]. The sample's
/// x and u are the means over its steps.
///
/// With options.noise, of variances σ², the first state is not known either: the sample is the δ of
///
///     min over x_0, δ of  Σ_{i=0..k} ‖(x_{t+i} - Φ_i(x_0; u_t + δ … u_{t+i-1} + δ)) / σ‖²
///
/// by two steps of Gauss and Newton, and its x the mean of the states found.
/// @param model  has no state besides x
/// @param keep  whether a reading may be used; a sample needs all of its own
/// @param left_out  when given: those that were not taken are added to it
/// @throws InputError for a log of another plant's sizes or time step
std::vector<BiasSample> samplesOf(const RunLog& log, Plant& model, const BiasOptions& options,
                                  const std::function<bool(const VectorXd& x)>& keep,
                                  std::vector<LeftOut>* left_out = nullptr);

/// At most so many of the samples, each chosen to be as far as can be from those chosen before, in
/// the kernel's lengths; the first is kept.
std::vector<BiasSample> spread(const std::vector<BiasSample>& samples, const BiasOptions& options);

/// g of [Ha2015, Eq. 55]: the regression's mean, weighted by how sure it is,
///
///     g(x, u) = exp(-d |v|²) mean(x, u),   v the variances of the outputs
///
/// so that far from all samples the model stands as it is.
class DynamicsBias {
 public:
  /// @throws InputError for samples that the regression refuses, or scales of other sizes
  DynamicsBias(const std::vector<BiasSample>& samples, BiasOptions options);

  int samples() const { return regression_.size(); }
  const BiasOptions& options() const { return options_; }
  const gp::Regression& regression() const { return regression_; }

  struct Scratch {
    VectorXd input, output;
    gp::Predictor::Scratch gp;
  };
  /// @param u           as BiasSample's
  /// @param difference  written: what a step adds to the model's state (n), or to its input (m)
  /// @return the weight exp(-d |v|²) that is in it already
  double predict(const VectorXd& x, const VectorXd& u, VectorXd& difference,
                 Scratch& scratch) const;

 private:
  BiasOptions options_;
  std::vector<Eigen::Index> learned_;
  VectorXd unscale_;  // of the outputs
  gp::Regression regression_;
  gp::Predictor predictor_;
};

/// How much of the differences' variance a bias explains, R² of each component that is learned,
/// in their order: 1 - Σ(Δ - g)² / ΣΔ², NaN where ΣΔ² is 0. Against no correction, not a mean.
VectorXd explained(const DynamicsBias& bias, const std::vector<BiasSample>& samples);

/// A model with its bias: x_{t+1} = f(x_t, u_t) + g(x_t, u_t) [Ha2015, Eq. 50], or that of its
/// inputs, f(x_t, u_t + g(x_t, u_t)).
class CorrectedPlant : public Plant {
 public:
  CorrectedPlant(std::unique_ptr<Plant> model, std::shared_ptr<const DynamicsBias> bias);

  int states() const override { return model_->states(); }
  int inputs() const override { return model_->inputs(); }
  double timeStep() const override { return model_->timeStep(); }
  void reset(const VectorXd& x) override;
  void step(const VectorXd& u) override;
  const VectorXd& state() const override { return model_->state(); }

 private:
  std::unique_ptr<Plant> model_;
  std::shared_ptr<const DynamicsBias> bias_;
  DynamicsBias::Scratch scratch_;
  MatrixXd past_;  // (m x longest lag + 1), a ring
  Eigen::Index now_ = 0;
  VectorXd difference_, x_, u_;
};

}  // namespace traceur::bias
