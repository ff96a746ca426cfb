// White noise on what a plant shows: a model that is to be trained with it, and how much of it logs
// hold.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "traceur/bias/dynamics_bias.h"

namespace traceur::bias {

/// Another plant whose readings have white noise on them; its motion has none. Equal seeds, resets
/// and inputs give equal bits: the noise is a sequence of 8192 readings, begun anew by each reset
/// at a place that follows from x, so that episodes from different starts see different noise.
class NoisyPlant : public Plant {
 public:
  /// @param variances  (n) ≥ 0, of the readings
  NoisyPlant(std::unique_ptr<Plant> plant, const VectorXd& variances, std::uint64_t seed);

  int states() const override { return plant_->states(); }
  int inputs() const override { return plant_->inputs(); }
  double timeStep() const override { return plant_->timeStep(); }
  void reset(const VectorXd& x) override;
  void step(const VectorXd& u) override;
  const VectorXd& state() const override { return reading_; }

 private:
  void read();

  std::unique_ptr<Plant> plant_;
  MatrixXd noise_;  // (n x 8192)
  Eigen::Index now_ = 0;
  VectorXd reading_;
};

/// Variances (n) of white noise on the readings of logs. Of the one-step residuals
/// e_t = x_{t+1} - Φ_1(x_t, u_t), noise makes neighbours differ, E[e_t e_{t+1}] = -σ², while forces
/// that a model has not, which last longer than a step, make them alike:
///
///     σ² = max(0, -mean_t e_t e_{t+1})
///
/// @param keep  whether a reading may be used
VectorXd readingNoise(const std::vector<RunLog>& logs, Plant& model,
                      const std::function<bool(const VectorXd& x)>& keep);

}  // namespace traceur::bias
