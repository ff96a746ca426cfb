// Figures 39 and 40 of the dissertation: what a policy of the model does on the machine, and what
// is learned of the difference.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "traceur/bias/bongo_learning.h"

namespace traceur::reproduce {

/// One run of a policy on a plant, both in a few words.
struct BalanceTrial {
  std::string policy;
  std::string plant;
  bias::RunLog log;
  std::string failure;  ///< what ended it, "" for nothing
};

/// Runs of the model's policy on model and machine, then of the learned one on machine and model,
/// all from one start.
std::vector<BalanceTrial> trialsOf(const bias::VectorXd& of_model, const bias::VectorXd& learned,
                                   const bias::BongoMachine& machine);

struct PolicyTrials {
  std::string machine;               ///< its fault, in a few words
  bool solved = false;               ///< both runs of the last iteration stayed up
  int iterations = 0;                ///< of the learning
  std::vector<BalanceTrial> trials;  ///< as trialsOf
};

/// A machine whose pelvis is 2 mm off. The paper's has no fault but its engine's contacts, on which
/// its policies of the model do not hold; ours balance such a machine nearly always.
bias::BongoMachine figure39Machine();

/// The policy searched on the model alone, and the one learned on figure39Machine()
/// [Ha2015, Fig. 39].
PolicyTrials policyTrials(std::uint64_t seed);

/// A bias on states it was not trained on [Ha2015, Fig. 40].
struct BiasField {
  std::string machine;                     ///< its fault, in a few words
  std::vector<bias::BiasSample> training;  ///< those that are kept of four runs
  std::vector<bias::BiasSample> truth;     ///< of two other runs
  std::vector<bias::VectorXd> predicted;   ///< (6) at each of those, what a step adds
  bias::VectorXd explained;  ///< (3) R² over those, of the rates of wheel, board, legs
};

/// Of an inertia of 20 % more, and of dry friction of 2 N·m, which is the hardest to predict. Runs
/// are of the policy that is searched on the model alone, from random starts.
std::vector<BiasField> biasFields(std::uint64_t seed);

}  // namespace traceur::reproduce
