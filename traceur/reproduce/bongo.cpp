#include "traceur/reproduce/bongo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace traceur::reproduce {
namespace {

using bias::BongoFaults;
using bias::BongoLearning;

constexpr int kLastStarts = 100;  // that a last policy is tried from

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

struct SensorNoise {
  double torque, angle, rate;   // variances
  double no_error, with_error;  // printed
};

const std::vector<SensorNoise>& noises() {
  static const std::vector<SensorNoise> kNoises = {
      {0, 0, 0, 6.4, 2.8},           {1e-3, 0, 0, 7.3, 3.5},      {1e-2, 0, 0, 9.5, 4.8},
      {0.1, 0, 0, 5.5, 2.5},         {0.1, 1e-6, 1e-3, 7.5, 3.5}, {0.1, 2e-6, 2e-3, 4.4, 4.4},
      {0.1, 4e-6, 4e-3, 7.0, 3.3},   {0.1, 8e-6, 8e-3, 9.6, 5.0}, {0.1, 1.6e-5, 1.6e-2, 4.6, 5.5},
      {0.1, 3.2e-5, 3.2e-2, 4, 3.5}, {0.1, 6.4e-5, 6.4e-2, 6, 4}, {0.1, 1.28e-4, 0.128, 4, 3.6}};
  return kNoises;
}

/// The worst cost of the runs over the iterations, counted from `first`.
std::vector<Point> costsOf(const bias::BiasLearned& learned, double first) {
  std::vector<Point> points;
  for (const bias::BiasIteration& iteration : learned.iterations) {
    const double worst = *std::max_element(iteration.costs.begin(), iteration.costs.end());
    points.push_back({first + static_cast<double>(points.size()), std::round(100 * worst) / 100});
  }
  return points;
}

constexpr const char* kBongoProtocol =
    "Wheel and board begin within 0.5 degrees, a machine in Box2D, two runs of 5 s an iteration, "
    "both of which must stay up; at most ten iterations, counted as 10 when missed.";

struct PrintedMachine {
  std::string name;
  BongoFaults faults;
  std::vector<double> printed;  // costs, read off the figure
};

const std::vector<PrintedMachine>& machines41() {
  static const std::vector<PrintedMachine> kMachines = [] {
    std::vector<PrintedMachine> machines(4);
    const auto noise = [](PrintedMachine& m, double torque, double angle, double rate) {
      m.faults.torque_variance = torque;
      m.faults.angle_variance = angle;
      m.faults.rate_variance = rate;
    };
    machines[0] = {"0.01 1e-06 0.001", {}, {4.2e5, 4.1e5, 4.9e5, 4.0e5, 90, 51}};
    noise(machines[0], 0.01, 1e-6, 1e-3);
    machines[1] = {"0.1 4e-06 0.004", {}, {3.6e5, 3.2e5, 180, 91}};
    noise(machines[1], 0.1, 4e-6, 4e-3);
    machines[2] = {
        "0.1 8e-06 0.008 inertia +20 %", {}, {2.9e5, 7.2e5, 4.7e5, 122, 100, 415, 640, 73}};
    noise(machines[2], 0.1, 8e-6, 8e-3);
    machines[2].faults.inertia_scale = 1.2;
    machines[3] = {"COM offset 2 mm", {}, {}};
    machines[3].faults.com_offset = 0.002;
    return machines;
  }();
  return kMachines;
}

struct Fault {
  std::string name;
  BongoFaults faults;
};

const std::vector<Fault>& faults() {
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
  return kFaults;
}

struct Method {
  std::string name;
  bias::BongoMethod method;
  bias::BongoSearch search;
};

const std::vector<Method>& methods() {
  using enum bias::BongoMethod;
  static const std::vector<Method> kMethods = {
      {"bias", kBias, bias::BongoSearch::kStarts},
      {"none", kNone, bias::BongoSearch::kStarts},
      {"identify", kIdentify, bias::BongoSearch::kStarts},
      {"randomise", kRandomise, bias::BongoSearch::kStarts},
      {"published", kPublished, bias::BongoSearch::kPublished},
      {"published none", kNone, bias::BongoSearch::kPublished},
      {"bias one start", kBias, bias::BongoSearch::kPublished}};
  return kMethods;
}

}  // namespace

BongoRun table13Run(int row, int column, std::uint64_t seed) {
  const SensorNoise& n = noises()[row];
  BongoRun run;
  run.machine.faults.torque_variance = n.torque;
  run.machine.faults.angle_variance = n.angle;
  run.machine.faults.rate_variance = n.rate;
  if (column == 1) run.machine.faults.inertia_scale = 1.2;
  run.learning.seed = seed;
  return run;
}

BongoRun figure41Run(int row, int column, std::uint64_t seed) {
  BongoRun run{.machine = {.faults = machines41()[row].faults}};
  run.learning.method = column == 0 ? bias::BongoMethod::kBias : bias::BongoMethod::kNone;
  run.learning.seed = seed;
  return run;
}

BongoRun bongoFaultsRun(int row, int column, std::uint64_t seed) {
  BongoRun run{.machine = {.faults = faults()[row].faults}};
  run.learning.method = methods()[column].method;
  run.learning.search = methods()[column].search;
  run.learning.seed = seed;
  return run;
}

Table table13() {
  Table t;
  t.name = "table-13";
  t.title = "Experiments to a policy that balances [Ha2015, Tab. 13].";
  t.protocol = fmt::format(
      "Rows: variances of torque, angles and rates. {} Whether the printed \"experiments\" are "
      "iterations or runs is not said: both are told beside them.",
      kBongoProtocol);
  t.points = "iteration:cost";
  std::vector<double> no_error, with_error;
  for (const SensorNoise& n : noises()) {
    t.rows.push_back({fmt::format("{:g} {:g} {:g}", n.torque, n.angle, n.rate), "", "iterations"});
    no_error.push_back(n.no_error);
    with_error.push_back(n.with_error);
  }
  t.columns = {{"no error", 3, 20, no_error}, {"20 % error", 3, 20, with_error}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    const BongoRun run = table13Run(row, column, seed);
    const bias::BiasLearned learned = bias::learnOnMachine(run.machine, run.learning, stop);
    return Outcome{static_cast<double>(learned.iterations.size()), !learned.solved,
                   costsOf(learned, 1)};
  };
  t.readings = [](const Results& runs) {
    return std::vector<Results>{
        told(runs, "iterations", true, [](const Outcome& o) { return o.value; }),
        told(runs, "runs of the machine", true,
             [](const Outcome& o) { return static_cast<double>(BongoLearning().runs) * o.value; })};
  };
  return t;
}

Table figure41() {
  Table t;
  t.name = "figure-41";
  t.title = "Cost of the machine's runs over the iterations [Ha2015, Fig. 41].";
  t.protocol = fmt::format(
      "Rows: variances of torque, angles and rates as printed; the last is ours, a machine on "
      "which hardly a policy of the model alone holds. {} The worst cost of the two runs is drawn; "
      "below 200 both stayed up, and ours ends there. None: the model stays as it is, and is "
      "searched again. Printed runs, dashed, go on below 200.",
      kBongoProtocol);
  t.points = "iteration:cost";
  for (const PrintedMachine& m : machines41()) t.rows.push_back({m.name, "", "iterations"});
  t.columns = {{"bias", 5, 10, {}}, {"none", 5, 10, {}}};
  t.differences = {{"bias - none", 0, 1}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    const BongoRun run = figure41Run(row, column, seed);
    const bias::BiasLearned learned = bias::learnOnMachine(run.machine, run.learning, stop);
    return Outcome{static_cast<double>(learned.iterations.size()), !learned.solved,
                   costsOf(learned, 0)};
  };
  t.printed_points = [](int row, int column) {
    std::vector<Point> points;
    if (column != 0) return points;
    for (const double cost : machines41()[row].printed) {
      points.push_back({static_cast<double>(points.size()), cost});
    }
    return points;
  };
  return t;
}

Table bongoFaults() {
  Table t;
  t.name = "bongo-faults";
  t.title = "Experiments to a policy that balances, by fault and method. Not in the paper.";
  t.protocol = fmt::format(
      "{} Bias: ours. None: the model stays as it is, and is searched again. Identify: inertia, "
      "delay, friction and COM offset by least squares. Randomise: four models with random faults "
      "each time. Published: DIRECT alone from one start, one-step differences; none and our bias "
      "with that search, too.",
      kBongoProtocol);
  t.points = "starts:balanced";
  t.drawn = Drawn::kNothing;
  for (const Fault& f : faults()) t.rows.push_back({f.name, "", "iterations"});
  for (const Method& m : methods()) t.columns.push_back({m.name, 3, 20, {}});
  t.ratios = {{"bias / none", 0, 1}, {"bias / identify", 0, 2}, {"bias / randomise", 0, 3}};
  t.differences = {{"none - bias", 1, 0}, {"published none - bias one start", 5, 6}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    const BongoRun run = bongoFaultsRun(row, column, seed);
    const bias::BiasLearned learned = bias::learnOnMachine(run.machine, run.learning, stop);
    if (learned.stopped) return Outcome{};
    const int good =
        bias::successes(run.machine, run.learning.board, learned.parameters, kLastStarts, seed);
    return Outcome{static_cast<double>(learned.iterations.size()),
                   !learned.solved,
                   {{static_cast<double>(kLastStarts), static_cast<double>(good)}}};
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
