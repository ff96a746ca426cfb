#include "traceur/reproduce/figure_42.h"

#include <fmt/format.h>

#include "traceur/bias/bongo_learning.h"
#include "traceur/bias/noisy_plant.h"
#include "traceur/core/hash.h"
#include "traceur/core/random.h"

namespace traceur::reproduce {
namespace {

using bias::VectorXd;

// Streams of a seed.
constexpr std::uint64_t kTrainingStream = 20;
constexpr std::uint64_t kStartsStream = 21;

class SameNoise : public Plant {
 public:
  SameNoise(const bias::BongoFaults& faults, std::uint64_t seed) : faults_(faults), seed_(seed) {
    reset(VectorXd::Zero(6));
  }
  int states() const override { return 6; }
  int inputs() const override { return 1; }
  double timeStep() const override { return machine_->timeStep(); }
  void reset(const VectorXd& x) override {
    Hash start;
    start.add(std::span<const double>(x.data(), static_cast<size_t>(x.size())));
    machine_ = std::make_unique<bias::BongoHardware>(
        bias::BongoParameters(), faults_, Random(seed_, kTrainingStream, start.value()).bits());
    machine_->reset(x);
  }
  void step(const VectorXd& u) override { machine_->step(u); }
  const VectorXd& state() const override { return machine_->state(); }

 private:
  bias::BongoFaults faults_;
  std::uint64_t seed_;
  std::unique_ptr<bias::BongoHardware> machine_;
};

}  // namespace

std::unique_ptr<Plant> machineOfSameNoise(const bias::BongoFaults& faults, std::uint64_t seed) {
  return std::make_unique<SameNoise>(faults, seed);
}

bias::BongoFaults figure42Noise() {
  bias::BongoFaults faults;
  faults.torque_variance = 0.1;
  faults.angle_variance = 4e-6;
  faults.rate_variance = 4e-3;
  return faults;
}

Map figure42Map() {
  return {.count = 12,
          .low = -0.035,
          .high = 0.035,
          .xlabel = "wheel [rad]",
          .ylabel = "board from it [rad]"};
}

bias::FoundPolicy trainedWith(bool on_machine, const bias::BongoFaults& noise, std::uint64_t seed,
                              const std::stop_token& stop) {
  bias::BongoLearning o;
  o.seed = seed;
  const auto plant = [&](const std::vector<bias::RunLog>&, int) {
    bias::LearnedModels one;
    if (on_machine) {
      one.plants.push_back(machineOfSameNoise(noise, seed));
      return one;
    }
    VectorXd variances(6);
    variances << VectorXd::Constant(3, noise.angle_variance),
        VectorXd::Constant(3, noise.rate_variance);
    std::unique_ptr<Plant> model = std::make_unique<bias::BongoBoard>();
    if (!variances.isZero()) {
      model = std::make_unique<bias::NoisyPlant>(std::move(model), variances, seed);
    }
    one.plants.push_back(std::move(model));
    return one;
  };
  bias::PolicySearchOptions search = bias::bongoLoop(o).search;
  search.stop = stop;
  return bias::searchOnModels(bias::bongoTask(o), plant, {}, 0, {}, search);
}

Table figure42() {
  Table t;
  t.name = "figure-42";
  t.title = "Starts a policy balances from, trained without noise and with [Ha2015, Fig. 42].";
  const bias::BongoFaults noise = figure42Noise();
  const Map map = figure42Map();
  t.protocol = fmt::format(
      "Wheel and board angles in {0} x {0} squares of +-{1} rad, a run of 5 s from the middle of "
      "each, in Box2D with noise of variances {2} N2m2, {3} rad2 and {4} rad2/s2; the paper prints "
      "neither these nor where its policies were trained to balance from (ours: +-0.5 degrees). "
      "Searched on the machine itself, as the caption says, or on the model with that noise on its "
      "readings. A pair of policies has one seed. Missed are searches whose policy does not "
      "balance where it "
      "was trained; they count. p by sign flips. Pairs without a missed search are told beside "
      "them, a choice made after the runs were seen.",
      map.count, map.high, noise.torque_variance, noise.angle_variance, noise.rate_variance);
  t.rows = {{"machine", "", "% of squares"}, {"model", "", "% of squares"}};
  t.columns = {{"without noise", 10, 30, {}}, {"with noise", 10, 30, {}}};
  t.differences = {{"with - without", 1, 0},
                   {"the same, no search of the pair missed", 1, 0, true}};
  t.points = "square:balanced";
  t.drawn = Drawn::kMap;
  t.map = map;
  t.run = [noise, map](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    const bias::FoundPolicy found =
        trainedWith(row == 0, column == 1 ? noise : bias::BongoFaults(), seed, stop);
    if (stop.stop_requested()) return Outcome();
    const auto policy = bias::BalancePolicy::of(found.parameters);
    const double side = (map.high - map.low) / map.count;
    Outcome outcome{.missed = !(found.cost < bias::BalanceCost().failure)};
    int good = 0;
    for (int k = 0; k < map.count * map.count; ++k) {
      if (stop.stop_requested()) return outcome;
      const auto at = [&](int i) { return map.low + (i + 0.5) * side; };
      // The same noise for both policies of a pair.
      bias::BongoHardware machine(
          {}, noise, Random(seed, kStartsStream, static_cast<std::uint64_t>(k)).bits());
      const bool up = !bias::balance(machine, {}, policy,
                                     bias::bongoStart(at(k % map.count), at(k / map.count)))
                           .failed();
      good += up;
      outcome.points.push_back({static_cast<double>(k), up ? 1.0 : 0.0});
    }
    outcome.value = 100.0 * good / (map.count * map.count);
    return outcome;
  };
  return t;
}

}  // namespace traceur::reproduce
