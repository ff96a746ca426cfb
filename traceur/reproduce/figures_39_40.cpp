#include "traceur/reproduce/figures_39_40.h"

namespace traceur::reproduce {
namespace {

using bias::VectorXd;

BalanceTrial trial(std::string policy, std::string name, Plant& plant, const VectorXd& parameters,
                   const VectorXd& x0) {
  BalanceTrial t{std::move(policy), std::move(name), {}, {}};
  t.failure =
      bias::balance(plant, {}, bias::BalancePolicy::of(parameters), x0, {}, {}, &t.log).failure;
  return t;
}

VectorXd policyOfModel(const bias::BongoLearning& o) {
  return bias::searchOnModels(bias::bongoTask(o), bias::bongoLearner(o), {}, 0, {},
                              bias::bongoLoop(o).search)
      .parameters;
}

}  // namespace

bias::BongoMachine figure39Machine() {
  bias::BongoMachine machine;
  machine.faults.com_offset = 0.002;
  return machine;
}

std::vector<BalanceTrial> trialsOf(const VectorXd& of_model, const VectorXd& learned,
                                   const bias::BongoMachine& machine) {
  const VectorXd x0 = bias::bongoStart(0.6 * machine.start_angle, 0.6 * machine.start_angle);
  bias::BongoBoard model;
  bias::BongoHardware hardware({}, machine.faults);
  return {trial("model's", "model", model, of_model, x0),
          trial("model's", "machine", hardware, of_model, x0),
          trial("learned", "machine", hardware, learned, x0),
          trial("learned", "model", model, learned, x0)};
}

PolicyTrials policyTrials(std::uint64_t seed) {
  const bias::BongoMachine machine = figure39Machine();
  bias::BongoLearning o;
  o.seed = seed;
  const bias::BiasLearned learned = bias::learnOnMachine(machine, o);
  // The first iteration has no logs: its policy is the model's.
  return {"pelvis 2 mm off", learned.solved, static_cast<int>(learned.iterations.size()),
          trialsOf(learned.iterations.front().policy.parameters, learned.parameters, machine)};
}

std::vector<BiasField> biasFields(std::uint64_t seed) {
  static constexpr int kTrained = 4;  // runs [Ha2015, §8.5.2]
  static constexpr int kUnseen = 2;
  bias::BongoLearning o;
  o.seed = seed;
  const VectorXd parameters = policyOfModel(o);
  bias::BongoMachine heavy, sticky;
  heavy.faults.inertia_scale = 1.2;
  sticky.faults.coulomb_friction = 2;
  std::vector<BiasField> fields;
  for (const bias::BongoMachine& machine : {heavy, sticky}) {
    BiasField field;
    field.machine = fields.empty() ? "inertia +20 %" : "friction 2 N·m";
    const bias::BiasOptions options = bias::bongoBias(o.method);
    bias::BongoBoard model(o.board);
    std::vector<bias::BiasSample> seen;
    for (int run = 0; run < kTrained + kUnseen; ++run) {
      const bias::RunLog log = bias::runMachine(machine, o.board, parameters, seed, run).log;
      const auto samples = bias::samplesOf(log, model, options, bias::bongoKeeps(o.board));
      auto& to = run < kTrained ? seen : field.truth;
      to.insert(to.end(), samples.begin(), samples.end());
    }
    field.training = bias::spread(seen, options);
    const bias::DynamicsBias learned(field.training, options);
    bias::DynamicsBias::Scratch scratch;
    for (const bias::BiasSample& s : field.truth) {
      VectorXd g;
      learned.predict(s.x, s.u, g, scratch);
      field.predicted.push_back(std::move(g));
    }
    field.explained = bias::explained(learned, field.truth);
    fields.push_back(std::move(field));
  }
  return fields;
}

}  // namespace traceur::reproduce
