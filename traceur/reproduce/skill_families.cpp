#include "traceur/reproduce/skill_families.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/infinity.h"
#include "traceur/core/random.h"
#include "traceur/optim/all.h"
#include "traceur/optim/family_baselines.h"
#include "traceur/optim/minimise.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::reproduce {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using skill::Skill;

/// A stream of the seed that no sample uses: a generation would have to be as large.
constexpr std::uint64_t kFamilyStartStream = ~std::uint64_t{0};
constexpr int kSweep = 51;  // tasks a learnt family is tried on [Ha2015, Fig. 34]

/// A skill and the range of tasks it is published for.
struct FamilySkill {
  std::string name;
  double first, last;
  std::string task_unit;  // theirs
  std::string unit;       // of errors, for people
  double unit_per_one;    // of them in one unit of the task
};

const std::vector<FamilySkill>& familySkills() {
  static const std::vector<FamilySkill> kSkills = {{"jump", 0.03, 0.08, "m", "mm", 1e3},
                                                   {"kick", 0.3, 0.6, "m", "cm", 1e2},
                                                   {"walk", 0.0667, 0.1333, "m/s", "cm/s", 1e2}};
  return kSkills;
}

std::shared_ptr<const Skill> skillOf(const std::string& name) {
  // Beside the robots, in the source folder and where the program is installed.
  const std::filesystem::path robot =
      skill::findRobot("bioloid-gp", std::filesystem::current_path());
  const auto data = robot.parent_path().parent_path().parent_path();
  return Skill::fromFile(data / "skills" / "bioloid-gp" / (name + ".toml"));
}

/// The engine and, of each skill, a print of its file and its robot.
std::string skillPrints() {
  std::string prints = sim::engineVersion();
  for (const FamilySkill& f : familySkills()) {
    const auto skill = skillOf(f.name);
    Hash hash;
    hash.add(skill->text);
    hash.add(fmt::format("{}", skill->model->fingerprint()));
    prints += fmt::format(" {} {:08x}", f.name, hash.value() & 0xffffffff);
  }
  return prints;
}

VectorXd tasksOf(const FamilySkill& f, int count) {
  return VectorXd::LinSpaced(count, f.first, f.last);
}

/// Four digits: what a figure shows.
double rounded(double x) {
  return std::strtod(fmt::format("{:.4g}", x).c_str(), nullptr);
}

std::unique_ptr<optim::Optimizer> make(const optim::Problem& problem, const Skill& skill,
                                       const LearningOptions& o) {
  const VectorXd lower = problem.lower();
  const VectorXd upper = problem.upper();
  const VectorXd middle = 0.5 * (lower + upper);
  optim::CommonOptions options{.seed = o.seed, .control_points = o.control_points};
  const optim::OptimizerEntry& entry = optim::findOptimizer(o.optimiser, true);
  if (o.start == Start::kLearn) {
    options.sigma = skill::kStepSize;
    options.x0 = skill.initialParameters();
    return entry.make(problem, options);
  }
  if (o.optimiser == "contextual" || o.optimiser == "curve") {
    options.sigma = 0.5;
    options.x0 = middle;
    return entry.make(problem, options);
  }
  optim::CmaEsOptions cma;
  cma.x0 = middle;
  cma.scale = upper - lower;
  cma.lower = lower;
  cma.upper = upper;
  cma.lambda = 16;
  cma.active = false;
  cma.seed = o.seed;
  // In the inner half of the ranges, where the print has [-1, 1] for a range and [-0.5, 0.5].
  Random random(o.seed, kFamilyStartStream);
  const auto start = [&](int columns) {
    MatrixXd x(lower.size(), columns);
    for (double& value : x.reshaped()) value = random.uniform(0.25, 0.75);
    x = (upper - lower).asDiagonal() * x;
    return MatrixXd(x.colwise() + lower);
  };
  if (o.optimiser == "cma") {
    cma.sigma = 0.5;
    return std::make_unique<optim::PhiCma>(problem.tasks(), o.control_points, cma,
                                           start(o.control_points));
  }
  if (o.optimiser != "individual") throw InputError(o.optimiser + ": has no published start");
  cma.sigma = 1;  // printed as 2 of [-1, 1]
  cma.x0 = start(1).col(0);
  return std::make_unique<optim::IndividualCma>(
      optim::IndividualCmaOptions{.tasks = problem.tasks(), .cma = cma, .target = 1e-3});
}

/// One column of a figure: an optimiser and what it may spend.
struct Learner {
  std::string name;
  std::string optimiser;
  int control_points;
  int tasks;
  int budget;
  /// By skill, at the checkpoints; the figures' ordinates are 7/11 of the mean cost, which the
  /// plotting code divided by 11 runs after it had left 2 of 9 out.
  std::vector<std::vector<double>> ordinates = {};
};

constexpr double kOrdinate = 7.0 / 11.0;

/// Trials at which the figures were read off.
const std::vector<int>& checkpoints() {
  static const std::vector<int> kTrials = {500,  1000, 2000, 3000,  4000,
                                           5000, 6000, 8000, 10000, 12000};
  return kTrials;
}

constexpr double kNoTarget = -kInfinity;
constexpr int kPublishedBudget = 5000;
constexpr int kCmaBudget = 12500;  // 2.5 times as many; the figures end at 12000

const Learner& curveLine() {
  static const Learner kLearner{"curve",
                                "curve",
                                2,
                                6,
                                kPublishedBudget,
                                {{.33, .18, .041, .024, .0056, .0012},
                                 {.25, .073, .023, .0028, .0013, .0011},
                                 {.91, .29, .0048, .0027, .0009, .00048}}};
  return kLearner;
}

const Learner& cmaLine() {
  static const Learner kLearner{"CMA-ES",
                                "cma",
                                2,
                                6,
                                kCmaBudget,
                                {{.62, .43, .38, .26, .19, .12, .083, .021, .010, .0015},
                                 {1.2, .9, .50, .32, .16, .086, .071, .027, .0098, .0027},
                                 {5.3, 4.9, 2.9, 1.2, .42, .14, .12, .03, .015, .003}}};
  return kLearner;
}

const Learner& contextualLine() {
  static const Learner kLearner{"contextual", "contextual", 2, 6, kPublishedBudget};
  return kLearner;
}

std::vector<Learner> learners32() {
  return {cmaLine(),
          {"CMA-ES cubic",
           "cma",
           4,
           6,
           kCmaBudget,
           {{.68, .66, .49, .39, .37, .31, .27, .20, kNotPrinted, .15},
            {1.2, 1.2, 1.0, .87, .85, .71, .60, .40, kNotPrinted, .20},
            {4.9, 4.3, 3.7, 3.3, 2.7, 2.1, 2.1, 1.1, kNotPrinted, .65}}},
          curveLine(),
          {"curve cubic",
           "curve",
           4,
           6,
           kPublishedBudget,
           {{.21, .16, .053, .014, .00044, .00018},
            {.14, .055, .011, .003, .0019, .00095},
            {.71, .47, .038, .0038, .00066, .00035}}},
          contextualLine(),
          {"contextual cubic", "contextual", 4, 6, kPublishedBudget}};
}

std::vector<Learner> learners33() {
  static constexpr double kNo = kNotPrinted;
  return {
      cmaLine(),
      {"CMA-ES 21 tasks",
       "cma",
       2,
       21,
       kCmaBudget,
       {{kNo, .61, kNo, .41, kNo, .37, kNo, kNo, kNo, .21}}},
      curveLine(),
      {"curve 21 tasks", "curve", 2, 21, kPublishedBudget, {{.30, .17, .035, .016, .0043, .0014}}},
      contextualLine(),
      {"contextual 21 tasks", "contextual", 2, 21, kPublishedBudget}};
}

const std::vector<Learner>& learners34() {
  static const std::vector<Learner> kLearners = {
      {"individual", "individual", 2, 6, 9600},
      {"individual 51 tasks", "individual", 2, 51, 81600},
      {"curve", "curve", 2, 6, kPublishedBudget},
      {"contextual", "contextual", 2, 6, kPublishedBudget}};
  return kLearners;
}

/// Those of `learn --tasks` that are compared, and what they may spend.
const std::vector<std::string>& defaultLearners() {
  static const std::vector<std::string> kOptimisers = {"contextual", "curve"};
  return kOptimisers;
}
constexpr int kLearnBudget = 3000;

/// The columns' costs at the checkpoints.
Results costsAtCheckpoints(const Results& runs, const std::vector<Learner>& learners) {
  const Table& from = runs.table();
  Table t;
  t.name = from.name + " costs";
  t.title = "Mean cost of the best curve so far.";
  t.protocol =
      "Printed values are read off the figure and multiplied by 11/7: its ordinates are "
      "sums of seven runs divided by eleven. Of CMA-ES the best of each generation is printed, not "
      "the best so far, and the printed trimmed runs are the same two throughout. Costs are not of "
      "the same functions: what falling and turning cost is ours, in the skills' files.";
  t.center = Center::kTrimmedMean;
  t.columns = from.columns;
  for (size_t r = 0; r < from.rows.size(); ++r) {
    for (size_t k = 0; k < checkpoints().size(); ++k) {
      t.rows.push_back(
          {fmt::format("{} {}", from.rows[r].name, checkpoints()[k]), from.rows[r].name, "cost"});
      for (size_t c = 0; c < learners.size(); ++c) {
        const auto& ordinates = learners[c].ordinates;
        const bool known = r < ordinates.size() && k < ordinates[r].size();
        t.columns[c].printed.push_back(known ? ordinates[r][k] / kOrdinate : kNotPrinted);
      }
    }
  }
  Results costs(t);
  for (const auto& [key, outcome] : runs.outcomes()) {
    const auto [row, column, seed] = key;
    for (size_t k = 0; k < checkpoints().size(); ++k) {
      if (checkpoints()[k] > learners[column].budget) break;
      const double cost = costAfter(outcome.points, checkpoints()[k]);
      if (!std::isfinite(cost)) continue;  // not one whole curve yet
      costs.add({row * static_cast<int>(checkpoints().size()) + static_cast<int>(k), column, seed},
                {cost});
    }
  }
  return costs;
}

/// Trials until the median cost that the dissertation's optimiser had after its 5000.
Results trialsToLevel(const Results& runs, const std::vector<Learner>& learners,
                      std::vector<Ratio> ratios) {
  const Table& from = runs.table();
  const auto column_of = [&](const std::string& name) {
    size_t c = 0;
    while (learners[c].name != name) ++c;
    return static_cast<int>(c);
  };
  const int curve = column_of("curve");
  Table t;
  t.name = from.name + " trials";
  t.protocol = fmt::format(
      "{} Until the mean cost is at most the median that the column \"curve\" has after {} trials "
      "(in brackets that median's bootstrap 95 % interval, which those of trials do not contain). "
      "A run that did not get there is missed, and counts as infinitely long; one of \"curve\", "
      "whose level it is, counts with its {}. Ratios are of medians of trials; \"curve\" is there "
      "sooner than after {}, for half of its runs are.",
      from.protocol, kPublishedBudget, kPublishedBudget, kPublishedBudget);
  t.center = Center::kMedian;
  t.columns = from.columns;
  t.ratios = std::move(ratios);
  std::vector<double> levels;
  std::string words;
  for (size_t r = 0; r < from.rows.size(); ++r) {
    t.rows.push_back({from.rows[r].name, "", "trials"});
    Sample costs;
    for (const auto& [key, outcome] : runs.outcomes()) {
      const auto [row, column, seed] = key;
      if (row != static_cast<int>(r) || column != curve) continue;
      costs.push_back(costAfter(outcome.points, kPublishedBudget));
    }
    levels.push_back(costs.empty() ? kNotPrinted : median(costs));
    if (costs.empty()) continue;
    const Interval i = bootstrap({&costs, 1}, [](const auto& drawn) { return median(drawn[0]); });
    words += fmt::format(" {} {:.2g} [{:.2g}, {:.2g}];", from.rows[r].name, levels.back(), i.low,
                         i.high);
  }
  t.title = fmt::format("Trials to the level of the dissertation's optimiser:{}",
                        words.empty() ? " not run yet;" : words);
  t.title.back() = '.';
  Results trials(t);
  for (const auto& [key, outcome] : runs.outcomes()) {
    const auto [row, column, seed] = key;
    if (std::isnan(levels[row])) continue;
    const auto reached = trialsTo(outcome.points, levels[row]);
    const double never = column == curve ? kPublishedBudget : kInfinity;
    trials.add(key, {reached.value_or(never), !reached});
  }
  return trials;
}

FamilyRun runOf(const Learner& l, int row, std::uint64_t seed) {
  const FamilySkill& f = familySkills()[row];
  return {f.name,
          tasksOf(f, l.tasks),
          {l.optimiser, l.control_points, Start::kPublished, l.budget, kNoTarget, seed, {}}};
}

Table learningTable(const std::string& name, const std::string& title,
                    const std::vector<Learner>& learners, std::vector<Ratio> ratios) {
  Table t;
  t.name = name;
  t.title = title;
  t.protocol = fmt::format(
      "Skills of skills/bioloid-gp. All begin in the middle of the parameters' ranges with half of "
      "each range as standard deviation, CMA-ES at random in the inner half. Curve has the text's "
      "settings, not those behind Table 11's print, which are faster there; CMA-ES 16 samples and "
      "no negative weights. {} trials, CMA-ES {}. Hours in all: --row and --column choose some.",
      kPublishedBudget, kCmaBudget);
  t.center = Center::kTrimmedMean;
  t.points = "trials:cost";
  t.made_with = skillPrints;
  for (const FamilySkill& f : familySkills()) t.rows.push_back({f.name, "", "cost"});
  for (const Learner& l : learners) t.columns.push_back({l.name, 1, 9, {}});
  t.run = [learners](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    FamilyRun run = runOf(learners[column], row, seed);
    run.options.stop = stop;
    const Learning learning = learnFamily(skillOf(run.skill), run.tasks, run.options);
    if (learning.costs.empty()) return Outcome{kInfinity, true, {}};
    return Outcome{learning.costs.back().y, false, learning.costs};
  };
  t.printed_points = [learners](int row, int column) {
    std::vector<Point> points;
    const auto& ordinates = learners[column].ordinates;
    if (row >= static_cast<int>(ordinates.size())) return points;
    for (size_t k = 0; k < ordinates[row].size(); ++k) {
      if (std::isnan(ordinates[row][k])) continue;
      points.push_back({static_cast<double>(checkpoints()[k]), ordinates[row][k] / kOrdinate});
    }
    return points;
  };
  t.readings = [learners, ratios = std::move(ratios)](const Results& runs) {
    return std::vector<Results>{trialsToLevel(runs, learners, ratios),
                                costsAtCheckpoints(runs, learners)};
  };
  return t;
}

/// A row for each of `of` in each row of the runs, from what their points are.
struct Reading {
  std::string name;
  std::string quantity;
  std::function<double(const Outcome&)> of;
  std::vector<double> printed = {};   ///< by column
  std::optional<Center> center = {};  ///< as Row's
};

/// The sizes of an outcome's y in rising order; those that are no numbers, of falls, come last.
Sample sorted(const Outcome& outcome) {
  Sample y;
  for (const Point& p : outcome.points) y.push_back(std::isnan(p.y) ? kInfinity : std::abs(p.y));
  std::sort(y.begin(), y.end());
  return y;
}

/// The value that a part of an outcome's sizes lie at or below.
double at(const Outcome& outcome, double part) {
  const Sample y = sorted(outcome);
  if (y.empty()) return kInfinity;
  return y[static_cast<size_t>(std::lround(part * (static_cast<double>(y.size()) - 1)))];
}

Results readingsOf(const Results& runs,
                   const std::function<std::vector<Reading>(int row)>& readings) {
  Table t = runs.table();
  t.points.clear();
  t.readings = {};
  t.rows.clear();
  for (Column& c : t.columns) c.printed.clear();
  std::vector<std::vector<Reading>> by_row;
  std::vector<int> first;
  for (size_t r = 0; r < runs.table().rows.size(); ++r) {
    by_row.push_back(readings(static_cast<int>(r)));
    first.push_back(static_cast<int>(t.rows.size()));
    for (const Reading& reading : by_row.back()) {
      t.rows.push_back({fmt::format("{} {}", runs.table().rows[r].name, reading.name),
                        runs.table().rows[r].name,
                        reading.quantity,
                        {},
                        reading.center});
      for (size_t c = 0; c < t.columns.size(); ++c) {
        t.columns[c].printed.push_back(reading.printed.empty() ? kNotPrinted : reading.printed[c]);
      }
    }
  }
  Results read(t);
  for (const auto& [key, outcome] : runs.outcomes()) {
    const auto [row, column, seed] = key;
    for (size_t i = 0; i < by_row[row].size(); ++i) {
      read.add({first[row] + static_cast<int>(i), column, seed},
               {by_row[row][i].of(outcome), outcome.missed});
    }
  }
  return read;
}

}  // namespace

Learning learnFamily(const std::shared_ptr<const Skill>& skill, const VectorXd& tasks,
                     const LearningOptions& o) {
  const skill::SkillProblem problem(skill, tasks);
  const auto optimizer = make(problem, *skill, o);
  Learning learning;
  const auto note = [&](const optim::Generation& g) {
    const double cost = optimizer->achieved().value_or(kInfinity);
    auto& costs = learning.costs;
    if (!std::isfinite(cost) || (!costs.empty() && rounded(cost) >= costs.back().y)) return;
    costs.push_back({static_cast<double>(g.progress.evaluations), rounded(cost)});
  };
  const optim::Summary summary = optim::minimise(
      problem, *optimizer,
      {.budget = o.budget, .target = o.target, .stop = o.stop, .on_generation = note});
  learning.trials = summary.progress.evaluations;
  learning.family = optimizer->family().value_or(optim::Family());
  if (!learning.costs.empty()) {  // it ends so: a figure's line goes on to here
    learning.costs.push_back({static_cast<double>(learning.trials), rounded(learning.family.cost)});
  }
  return learning;
}

Outcome learnAndSweep(const std::shared_ptr<const Skill>& skill, const VectorXd& trained,
                      LearningOptions options,
                      const std::function<double(const skill::Rollout&, double task)>& of) {
  options.target *= skill->target_cost;
  const Learning learning = learnFamily(skill, trained, options);
  const bool none = learning.family.task_costs.empty();
  const bool missed =
      none || (std::isfinite(options.target) && learning.family.cost > options.target);
  Outcome outcome{static_cast<double>(learning.trials), missed, {}};
  if (none) return outcome;
  const skill::SkillProblem problem(skill, trained);
  skill::Runner runner(skill);
  const VectorXd tasks = VectorXd::LinSpaced(kSweep, trained[0], trained[trained.size() - 1]);
  for (int i = 0; i < kSweep && !options.stop.stop_requested(); ++i) {
    const VectorXd x = learning.family.curve.at(static_cast<double>(i) / (kSweep - 1))
                           .cwiseMax(problem.lower())
                           .cwiseMin(problem.upper());
    outcome.points.push_back({tasks[i], rounded(of(runner.run(x, tasks[i]), tasks[i]))});
  }
  return outcome;
}

double costAfter(const std::vector<Point>& curve, double trials) {
  double cost = kInfinity;
  for (const Point& p : curve) {
    if (p.x <= trials) cost = p.y;
  }
  return cost;
}

std::optional<double> trialsTo(const std::vector<Point>& curve, double cost) {
  for (const Point& p : curve) {
    if (p.y <= cost) return p.x;
  }
  return std::nullopt;
}

Table figure32() {
  return learningTable("figure-32",
                       "Learning a family of jumps, kicks and walks [Ha2015, Fig. 32].",
                       learners32(), {{"CMA-ES / curve", 0, 2}, {"contextual / curve", 4, 2}});
}

Table figure33() {
  Table t = learningTable("figure-33",
                          "Learning a family of jumps with 6 and 21 tasks [Ha2015, Fig. 33].",
                          learners33(), {{"CMA-ES 21 / 6", 1, 0}, {"contextual 21 / 6", 5, 4}});
  t.rows.erase(t.rows.begin() + 1, t.rows.end());  // of jumps alone, as printed
  return t;
}

FamilyRun figure32Run(int row, int column, std::uint64_t seed) {
  return runOf(learners32()[column], row, seed);
}

FamilyRun figure33Run(int row, int column, std::uint64_t seed) {
  return runOf(learners33()[column], row, seed);
}

FamilyRun figure34Run(int column, std::uint64_t seed) {
  return runOf(learners34()[column], 0, seed);
}

FamilyRun familiesRun(int row, int column, std::uint64_t seed) {
  const FamilySkill& f = familySkills()[row];
  return {
      f.name,
      tasksOf(f, 6),
      {.optimiser = defaultLearners()[column], .budget = kLearnBudget, .target = 1, .seed = seed}};
}

Table figure34() {
  Table t;
  t.name = "figure-34";
  t.title = "Costs of 51 jumps, of which 6 were trained, or all [Ha2015, Fig. 34].";
  t.protocol =
      "The printed jump is another robot's, of human size, with five parameters: only the order of "
      "the columns can be compared. Between individually learnt tasks parameters are interpolated; "
      "each has 1600 trials on average, begins at a point of the inner half of the ranges, one for "
      "all, with the whole range as standard deviation, and ends at a cost of 0.001. Printed costs "
      "above 10 were plotted as a tenth and one more. The others begin as in figure-32.";
  t.center = Center::kMedian;
  t.points = "task:cost";
  t.made_with = skillPrints;
  t.rows = {{"jump", "", "trials"}};
  for (const Learner& l : learners34()) t.columns.push_back({l.name, 1, 9, {}});
  t.run = [](int /*row*/, int column, std::uint64_t seed, const std::stop_token& stop) {
    FamilyRun run = figure34Run(column, seed);
    run.options.stop = stop;
    return learnAndSweep(skillOf(run.skill), run.tasks, run.options,
                         [](const skill::Rollout& r, double) { return r.cost; });
  };
  t.readings = [](const Results& runs) {
    const auto cost = [](double part) { return [part](const Outcome& o) { return at(o, part); }; };
    const auto mean_of = [](const Outcome& o) {
      return o.points.empty() ? kInfinity : mean(sorted(o));
    };
    return std::vector{readingsOf(runs, [&](int) {
      return std::vector<Reading>{
          {"trials", "trials", [](const Outcome& o) { return o.value; }},
          {"least", "cost", cost(0), {.00066, .00018, .00013, kNotPrinted}},
          {"median", "cost", cost(0.5), {.0124, .00089, .00167, kNotPrinted}},
          {"mean", "cost", mean_of, {.151, .00183, .00271, kNotPrinted}},
          {"largest", "cost", cost(1), {2.10, .0226, .00744, kNotPrinted}}};
    })};
  };
  return t;
}

Table families() {
  Table t;
  t.name = "families";
  t.title =
      "What learn --tasks finds, tried on 51 tasks of which 6 were trained. Not in the paper.";
  std::string ranges;
  for (const FamilySkill& f : familySkills()) {
    ranges += fmt::format("{}{} {} to {}", ranges.empty() ? "" : ", ", f.name, f.first, f.last);
  }
  t.protocol = fmt::format(
      "As `traceur learn SKILL --tasks FIRST:LAST:6 --budget {} --optimiser COLUMN` for each seed "
      "(missed: it never reached the skill's target_cost; its trials count as infinite), then {} "
      "tasks: {}, in m and m/s. A task that ends in a fall has an infinite error.",
      kLearnBudget, kSweep, ranges);
  t.center = Center::kMedian;
  t.points = "task:error";
  t.made_with = skillPrints;
  for (const FamilySkill& f : familySkills()) {
    t.rows.push_back({f.name, "", "trials", f.task_unit});
  }
  for (const std::string& o : defaultLearners()) t.columns.push_back({o, 1, 9, {}});
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    FamilyRun run = familiesRun(row, column, seed);
    run.options.stop = stop;
    return learnAndSweep(skillOf(run.skill), run.tasks, run.options,
                         [](const skill::Rollout& r, double task) {
                           return r.failed() ? kNotPrinted : r.achieved - task;
                         });
  };
  t.readings = [](const Results& runs) {
    return std::vector{readingsOf(runs, [](int row) {
      const FamilySkill& f = familySkills()[row];
      const auto error = [&f](double part) {
        return [part, unit = f.unit_per_one](const Outcome& o) { return unit * at(o, part); };
      };
      const auto trials = [](const Outcome& o) {
        if (o.missed) return kInfinity;
        return o.value;
      };
      return std::vector<Reading>{
          {"trials", "trials", trials},
          {"median error", f.unit, error(0.5)},
          {"error of nine tasks in ten", f.unit, error(0.9)},
          {"largest error", f.unit, error(1)},
          {"falls",
           fmt::format("of {}, mean", kSweep),
           [](const Outcome& o) {
             if (o.points.empty()) return static_cast<double>(kSweep);
             return static_cast<double>(std::count_if(
                 o.points.begin(), o.points.end(), [](const Point& p) { return std::isnan(p.y); }));
           },
           {},
           Center::kMean}};
    })};
  };
  return t;
}

}  // namespace traceur::reproduce
