// The outer loop: from a model and a handful of runs to a policy that works on the plant
// [Ha2015, Alg. 5].
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "traceur/bias/dynamics_bias.h"
#include "traceur/bias/policy_search.h"

namespace traceur::bias {

/// What is known of a plant; the policy search runs a policy on each model.
struct LearnedModels {
  std::vector<std::unique_ptr<Plant>> plants;
  /// They are so noisy that luck has its part in each episode.
  bool by_chance = false;
};

/// Makes models of a plant from what was seen of it.
/// @param logs       of all runs that count, none at first
/// @param iteration  from 0
using ModelLearner = std::function<LearnedModels(const std::vector<RunLog>& logs, int iteration)>;

/// The model corrected by its bias, or alone while there are no samples.
/// @param model  makes a new model of the plant
/// @param keep   whether a reading is of use to learn from
ModelLearner biasLearner(std::function<std::unique_ptr<Plant>()> model, BiasOptions options,
                         std::function<bool(const VectorXd& x)> keep);

/// What is to be learned, as far as the loop need know.
struct BiasTask {
  VectorXd lower, upper;  ///< bounds of the policy's parameters
  /// Runs a policy on a plant from an initial state, and tells its cost.
  std::function<double(Plant& plant, const VectorXd& parameters, const VectorXd& x0)> run;
  /// From which the policy search runs the models, the easiest first; the worst counts. One that
  /// does not succeed hides those after it, so that a search climbs from start to start [ours].
  std::vector<VectorXd> starts;
  /// The same for models by chance, of which the mean counts: the worst of a few says how unlucky
  /// the unluckiest was [ours]. Empty: `starts` does.
  std::vector<VectorXd> many_starts;
  double success = 0;  ///< Z_max: a run has succeeded at a lower cost
  double most = 0;     ///< what no run costs more than; each hidden start counts so much
};

/// One run of the plant itself, whoever makes it: a simulator, a machine, a person with a file.
struct PlantRun {
  double cost = 0;
  RunLog log;
};

struct BiasLoopOptions {
  int iterations = 10;  ///< N_out at most
  int runs = 2;         ///< of the plant, in each iteration; all must succeed
  PolicySearchOptions search;
  bool warm = true;  ///< a search begins where the last one ended [ours]
  /// Asked to end: a search ends after the trial under way, the plant runs no more.
  std::stop_token stop = {};
};

struct BiasIteration {
  FoundPolicy policy;
  std::vector<double> costs;  ///< of the plant's runs
  bool cleared = false;       ///< no policy was found with the logs, which were given up
};

struct BiasLearned {
  bool solved = false;
  bool stopped = false;  ///< it was asked to; an iteration that was cut short is not among these
  VectorXd parameters;   ///< the last iteration's policy; empty without one
  std::vector<BiasIteration> iterations;
  int plant_runs = 0;
};

/// The policy that costs least on the models that the logs teach. Where they are by chance and
/// there is a policy to begin with, that one is polished: costs of no meaning would lead DIRECT
/// astray.
/// @param iteration  from 0, for the seed
/// @param warm       a policy to begin with, or empty
FoundPolicy searchOnModels(const BiasTask& task, const ModelLearner& learner,
                           const std::vector<RunLog>& logs, int iteration, const VectorXd& warm,
                           PolicySearchOptions options);

/// Searches a policy on the models, tries it on the plant, learns from the logs, and again until
/// every run of an iteration succeeds. Where no policy succeeds on the models from even the first
/// start, the logs are given up and the search begins anew, before a run of the plant is spent; the
/// printed algorithm spends it. Of models by chance only a mean is known, so their logs are kept.
/// @param plant  runs a policy; `number` counts its runs from 0
BiasLearned learnWithBias(
    const BiasTask& task, const ModelLearner& learner,
    const std::function<PlantRun(const VectorXd& parameters, int number)>& plant,
    const BiasLoopOptions& options);

}  // namespace traceur::bias
