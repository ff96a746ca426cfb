#include "traceur/bias/bias_loop.h"

#include <algorithm>

namespace traceur::bias {

BiasLearned learnWithBias(
    const BiasTask& task,
    const std::function<PlantRun(const VectorXd& parameters, int number)>& plant,
    const BiasLoopOptions& o) {
  BiasLearned learned;
  std::vector<BiasSample> samples;
  std::shared_ptr<const DynamicsBias> bias;
  const std::unique_ptr<Plant> model = task.model();

  const auto search = [&](int iteration) {
    CorrectedPlant corrected(task.model(), bias);
    PolicySearchOptions options = o.search;
    options.seed += iteration;
    if (o.warm && learned.parameters.size() > 0) options.warm = learned.parameters;
    const auto cost = [&](const VectorXd& parameters) {
      double worst = -std::numeric_limits<double>::infinity();
      for (const VectorXd& x0 : task.starts) {
        worst = std::max(worst, task.run(corrected, parameters, x0, nullptr));
      }
      return worst;
    };
    return searchPolicy(cost, task.lower, task.upper, options);
  };

  for (int i = 0; i < o.iterations && !learned.solved; ++i) {
    BiasIteration iteration;
    iteration.samples = bias ? bias->samples() : 0;
    iteration.policy = search(i);
    if (!(iteration.policy.cost < task.success) && bias) {
      iteration.cleared = true;
      samples.clear();
      bias.reset();
      iteration.policy = search(i);
    }
    learned.parameters = iteration.policy.parameters;
    learned.solved = true;
    for (int r = 0; r < o.runs; ++r) {
      const PlantRun run = plant(learned.parameters, learned.plant_runs++);
      iteration.costs.push_back(run.cost);
      learned.solved = learned.solved && run.cost < task.success;
      if (!o.learns_bias) continue;
      const auto seen = samplesOf(run.log, *model, o.bias, task.keep);
      samples.insert(samples.end(), seen.begin(), seen.end());
    }
    if (!samples.empty()) {
      bias = std::make_shared<const DynamicsBias>(spread(samples, o.bias), o.bias);
    }
    learned.iterations.push_back(std::move(iteration));
  }
  return learned;
}

}  // namespace traceur::bias
