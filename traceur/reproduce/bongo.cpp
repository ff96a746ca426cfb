#include "traceur/reproduce/bongo.h"

#include <fmt/format.h>

#include <algorithm>

#include "traceur/bias/bongo_learning.h"

namespace traceur::reproduce {
namespace {

using bias::BongoFaults;
using bias::BongoLearning;
using bias::BongoMachine;

constexpr int kStarts = 100;  // that a last policy is tried from

bias::BiasLearned learnOn(const BongoMachine& machine, const BongoLearning& o) {
  return bias::learnWithBias(
      bias::bongoTask(o), bias::bongoLearner(o),
      [&](const Eigen::VectorXd& parameters, int number) {
        return bias::runMachine(machine, o.board, parameters, o.seed, number);
      },
      bias::bongoLoop(o));
}

/// A table like the runs' whose values are what `of` makes of each.
Results told(const Results& runs, const std::string& quantity, bool printed,
             const std::function<double(const Outcome&)>& of) {
  Table t = runs.table();
  t.points.clear();
  t.readings = {};
  for (Row& row : t.rows) row.quantity = quantity;
  if (!printed) {
    for (Column& c : t.columns) c.printed.clear();
  }
  Results read(t);
  for (const auto& [key, outcome] : runs.outcomes()) {
    read.add(key, {of(outcome), outcome.missed, {}});
  }
  return read;
}

struct Noise {
  double torque, angle, rate;   // variances
  double no_error, with_error;  // printed
};

const std::vector<Noise>& noises() {
  static const std::vector<Noise> kNoises = {
      {0, 0, 0, 6.4, 2.8},           {1e-3, 0, 0, 7.3, 3.5},      {1e-2, 0, 0, 9.5, 4.8},
      {0.1, 0, 0, 5.5, 2.5},         {0.1, 1e-6, 1e-3, 7.5, 3.5}, {0.1, 2e-6, 2e-3, 4.4, 4.4},
      {0.1, 4e-6, 4e-3, 7.0, 3.3},   {0.1, 8e-6, 8e-3, 9.6, 5.0}, {0.1, 1.6e-5, 1.6e-2, 4.6, 5.5},
      {0.1, 3.2e-5, 3.2e-2, 4, 3.5}, {0.1, 6.4e-5, 6.4e-2, 6, 4}, {0.1, 1.28e-4, 0.128, 4, 3.6}};
  return kNoises;
}

constexpr const char* kProtocol =
    "Wheel and board begin within 0.5 degrees, a machine in Box2D, two runs of 5 s an iteration, "
    "both of which must stay up; at most ten iterations, counted as 10 when missed.";

}  // namespace

Table table13() {
  Table t;
  t.name = "table-13";
  t.title = "Experiments to a policy that balances [Ha2015, Tab. 13].";
  t.protocol = fmt::format(
      "Rows: variances of torque, angles and rates. {} Whether the printed \"experiments\" are "
      "iterations or runs is not said: both are told beside them.",
      kProtocol);
  t.points = "iteration:cost";
  std::vector<double> no_error, with_error;
  for (const Noise& n : noises()) {
    t.rows.push_back({fmt::format("{:g} {:g} {:g}", n.torque, n.angle, n.rate), "", "iterations"});
    no_error.push_back(n.no_error);
    with_error.push_back(n.with_error);
  }
  t.columns = {{"no error", 3, 20, no_error}, {"20 % error", 3, 20, with_error}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    const Noise& n = noises()[row];
    BongoMachine machine;
    machine.faults.torque_variance = n.torque;
    machine.faults.angle_variance = n.angle;
    machine.faults.rate_variance = n.rate;
    if (column == 1) machine.faults.inertia_scale = 1.2;
    BongoLearning o;
    o.seed = seed;
    const bias::BiasLearned learned = learnOn(machine, o);
    Outcome outcome{static_cast<double>(learned.iterations.size()), !learned.solved, {}};
    double i = 0;
    for (const bias::BiasIteration& iteration : learned.iterations) {
      const double worst = *std::max_element(iteration.costs.begin(), iteration.costs.end());
      outcome.points.push_back({++i, std::round(100 * worst) / 100});
    }
    return outcome;
  };
  t.readings = [](const Results& runs) {
    return std::vector<Results>{
        told(runs, "iterations", true, [](const Outcome& o) { return o.value; }),
        told(runs, "runs of the machine", true,
             [](const Outcome& o) { return static_cast<double>(BongoLearning().runs) * o.value; })};
  };
  return t;
}

Table bongoFaults() {
  struct Fault {
    std::string name;
    BongoFaults faults;
  };
  struct Method {
    std::string name;
    bias::BongoMethod method;
    bias::BongoSearch search;
  };
  static const std::vector<Fault> kFaults = [] {
    std::vector<Fault> faults(4);
    faults[0] = {"inertia +20 %", {}};
    faults[0].faults.inertia_scale = 1.2;
    faults[1] = {"delay 5 ms", {}};
    faults[1].faults.delay = 0.005;
    faults[2] = {"friction 2 N m", {}};
    faults[2].faults.coulomb_friction = 2;
    faults[3] = {"COM offset 2 mm", {}};
    faults[3].faults.com_offset = 0.002;
    return faults;
  }();
  using enum bias::BongoMethod;
  static const std::vector<Method> kMethods = {
      {"bias", kBias, bias::BongoSearch::kStarts},
      {"none", kNone, bias::BongoSearch::kStarts},
      {"identify", kIdentify, bias::BongoSearch::kStarts},
      {"randomise", kRandomise, bias::BongoSearch::kStarts},
      {"published", kPublished, bias::BongoSearch::kPublished},
      {"published none", kNone, bias::BongoSearch::kPublished}};
  Table t;
  t.name = "bongo-faults";
  t.title = "Experiments to a policy that balances, by fault and method. Not in the paper.";
  t.protocol = fmt::format(
      "{} Bias: ours. None: the model stays as it is, and is searched again. Identify: inertia, "
      "delay, friction and COM offset by least squares. Randomise: four models with random faults "
      "each time. Published: DIRECT alone from one start, one-step differences.",
      kProtocol);
  t.points = "starts:balanced";
  t.figure = false;
  for (const Fault& f : kFaults) t.rows.push_back({f.name, "", "iterations"});
  for (const Method& m : kMethods) t.columns.push_back({m.name, 3, 20, {}});
  t.ratios = {{"bias / none", 0, 1}, {"bias / identify", 0, 2}, {"bias / randomise", 0, 3}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    const BongoMachine machine{.faults = kFaults[row].faults};
    BongoLearning o;
    o.method = kMethods[column].method;
    o.search = kMethods[column].search;
    o.seed = seed;
    const bias::BiasLearned learned = learnOn(machine, o);
    const int good = bias::successes(machine, o.board, learned.parameters, kStarts, seed);
    return Outcome{static_cast<double>(learned.iterations.size()),
                   !learned.solved,
                   {{static_cast<double>(kStarts), static_cast<double>(good)}}};
  };
  t.readings = [](const Results& runs) {
    Results balanced =
        told(runs, "starts balanced of 100", false, [](const Outcome& o) { return o.points[0].y; });
    return std::vector<Results>{
        told(runs, "iterations", false, [](const Outcome& o) { return o.value; }),
        std::move(balanced)};
  };
  return t;
}

}  // namespace traceur::reproduce
