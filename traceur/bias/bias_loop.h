// The outer loop: from a model and a handful of runs to a policy that works on the plant
// [Ha2015, Alg. 5].
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "traceur/bias/dynamics_bias.h"
#include "traceur/bias/policy_search.h"

namespace traceur::bias {

/// What is to be learned, as far as the loop need know.
struct BiasTask {
  /// A new model of the plant.
  std::function<std::unique_ptr<Plant>()> model;
  VectorXd lower, upper;  ///< bounds of the policy's parameters
  /// Runs a policy on a plant from an initial state.
  /// @param log  when given: what was seen
  /// @return its cost
  std::function<double(Plant& plant, const VectorXd& parameters, const VectorXd& x0, RunLog* log)>
      run;
  std::vector<VectorXd> starts;  ///< from which the policy search runs the model; the worst counts
  std::function<bool(const VectorXd& x)> keep;  ///< whether a reading is of use to learn from
  double success = 0;                           ///< Z_max: a run has succeeded at a lower cost
};

/// One run of the plant itself, whoever makes it: a simulator, a machine, a person with a file.
struct PlantRun {
  double cost = 0;
  RunLog log;
};

struct BiasLoopOptions {
  int iterations = 10;  ///< N_out at most
  int runs = 2;         ///< of the plant, in each iteration; all must succeed
  BiasOptions bias;
  PolicySearchOptions search;
  bool warm = true;         ///< a search begins where the last one ended [ours]
  bool learns_bias = true;  ///< false: the control, which only searches again
};

struct BiasIteration {
  FoundPolicy policy;
  std::vector<double> costs;  ///< of the plant's runs
  int samples = 0;            ///< behind the bias the policy was found with
  bool cleared = false;       ///< no good policy was found with that bias, which was given up
};

struct BiasLearned {
  bool solved = false;
  VectorXd parameters;  ///< the last policy
  std::vector<BiasIteration> iterations;
  int plant_runs = 0;
};

/// Searches a policy on the model, tries it on the plant, learns from the difference, and again
/// until every run of an iteration succeeds. Where no policy succeeds on the corrected model, the
/// samples are cleared and the search begins anew on the model alone, before a run of the plant is
/// spent; the printed algorithm spends it.
/// @param plant  runs a policy; `number` counts its runs from 0
BiasLearned learnWithBias(
    const BiasTask& task,
    const std::function<PlantRun(const VectorXd& parameters, int number)>& plant,
    const BiasLoopOptions& options);

}  // namespace traceur::bias
