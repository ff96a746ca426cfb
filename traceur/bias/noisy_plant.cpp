#include "traceur/bias/noisy_plant.h"

#include "traceur/core/hash.h"
#include "traceur/core/random.h"

namespace traceur::bias {
namespace {

constexpr Eigen::Index kReadings = 8192;

}  // namespace

NoisyPlant::NoisyPlant(std::unique_ptr<Plant> plant, const VectorXd& variances, std::uint64_t seed)
    : plant_(std::move(plant)), noise_(variances.size(), kReadings) {
  Random random(seed, 0);
  for (double& value : noise_.reshaped()) value = random.normal();
  noise_ = variances.cwiseSqrt().asDiagonal() * noise_;
}

void NoisyPlant::reset(const VectorXd& x) {
  plant_->reset(x);
  Hash place;
  place.add(std::span<const double>(x.data(), static_cast<size_t>(x.size())));
  now_ = static_cast<Eigen::Index>(place.value() % kReadings);
  read();
}

void NoisyPlant::step(const VectorXd& u) {
  plant_->step(u);
  now_ = (now_ + 1) % kReadings;
  read();
}

void NoisyPlant::read() {
  reading_ = plant_->state() + noise_.col(now_);
}

VectorXd readingNoise(const std::vector<RunLog>& logs, Plant& model,
                      const std::function<bool(const VectorXd& x)>& keep) {
  VectorXd sum = VectorXd::Zero(model.states());
  int count = 0;
  for (const RunLog& log : logs) {
    VectorXd last;
    for (int t = 0; t < log.steps(); ++t) {
      if (!keep(log.x.col(t)) || !keep(log.x.col(t + 1))) {
        last.resize(0);
        continue;
      }
      model.reset(log.x.col(t));
      model.step(log.u.col(t));
      VectorXd residual = log.x.col(t + 1) - model.state();
      if (last.size() > 0) {
        sum -= residual.cwiseProduct(last);
        ++count;
      }
      last = std::move(residual);
    }
  }
  if (count == 0) return sum;
  return (sum / count).cwiseMax(0.0);
}

}  // namespace traceur::bias
