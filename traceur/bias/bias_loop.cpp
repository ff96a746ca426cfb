#include "traceur/bias/bias_loop.h"

#include <algorithm>
#include <limits>

namespace traceur::bias {

ModelLearner biasLearner(std::function<std::unique_ptr<Plant>()> model, BiasOptions options,
                         std::function<bool(const VectorXd& x)> keep) {
  return [model = std::move(model), options = std::move(options), keep = std::move(keep)](
             const std::vector<RunLog>& logs, int) {
    std::vector<BiasSample> samples;
    const std::unique_ptr<Plant> nominal = model();
    for (const RunLog& log : logs) {
      const auto seen = samplesOf(log, *nominal, options, keep);
      samples.insert(samples.end(), seen.begin(), seen.end());
    }
    LearnedModels models;
    if (samples.empty()) {
      models.plants.push_back(model());
    } else {
      models.plants.push_back(std::make_unique<CorrectedPlant>(
          model(), std::make_shared<const DynamicsBias>(spread(samples, options), options)));
    }
    return models;
  };
}

FoundPolicy searchOnModels(const BiasTask& task, const ModelLearner& learner,
                           const std::vector<RunLog>& logs, int iteration, const VectorXd& warm,
                           PolicySearchOptions options) {
  const LearnedModels models = learner(logs, iteration);
  options.seed += iteration;
  if (warm.size() > 0) options.warm = warm;
  if (models.by_chance && options.warm && options.polish > 0) {
    static constexpr double kNear = 0.4;  // of the first step: the policy is no stranger [ours]
    options.direct = 0;
    options.rounds = 1;
    options.polish /= 2;  // of about thrice as many episodes
    options.polish_step *= kNear;
    const auto mean = [&](const VectorXd& parameters) {
      const auto& starts = task.many_starts.empty() ? task.starts : task.many_starts;
      double sum = 0;
      for (const VectorXd& x0 : starts) {
        for (const auto& model : models.plants) sum += task.run(*model, parameters, x0);
      }
      return sum / static_cast<double>(starts.size() * models.plants.size());
    };
    return searchPolicy(mean, task.lower, task.upper, options);
  }
  const auto cost = [&](const VectorXd& parameters) {
    double worst = -std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < task.starts.size(); ++i) {
      for (const auto& model : models.plants) {
        worst = std::max(worst, task.run(*model, parameters, task.starts[i]));
      }
      if (!(worst < task.success)) {
        return worst + task.most * static_cast<double>(task.starts.size() - 1 - i);
      }
    }
    return worst;
  };
  return searchPolicy(cost, task.lower, task.upper, options);
}

BiasLearned learnWithBias(
    const BiasTask& task, const ModelLearner& learner,
    const std::function<PlantRun(const VectorXd& parameters, int number)>& plant,
    const BiasLoopOptions& o) {
  BiasLearned learned;
  std::vector<RunLog> logs;
  PolicySearchOptions search = o.search;
  search.stop = o.stop;
  for (int i = 0; i < o.iterations && !learned.solved; ++i) {
    const VectorXd warm = o.warm ? learned.parameters : VectorXd();
    BiasIteration iteration;
    iteration.policy = searchOnModels(task, learner, logs, i, warm, search);
    const double hidden = task.most * static_cast<double>(task.starts.size() - 1);
    if (!(iteration.policy.cost < task.success + hidden) && !logs.empty() &&
        !o.stop.stop_requested()) {
      iteration.cleared = true;
      logs.clear();
      iteration.policy = searchOnModels(task, learner, logs, i, warm, search);
    }
    bool solved = true;
    for (int r = 0; r < o.runs; ++r) {
      if (o.stop.stop_requested()) {
        learned.stopped = true;
        return learned;
      }
      PlantRun run = plant(iteration.policy.parameters, learned.plant_runs++);
      iteration.costs.push_back(run.cost);
      solved = solved && run.cost < task.success;
      logs.push_back(std::move(run.log));
    }
    learned.parameters = iteration.policy.parameters;
    learned.solved = solved;
    learned.iterations.push_back(std::move(iteration));
  }
  return learned;
}

}  // namespace traceur::bias
