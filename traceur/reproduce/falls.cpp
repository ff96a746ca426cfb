#include "traceur/reproduce/falls.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/random.h"
#include "traceur/core/toml.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/skill/skill.h"

namespace traceur::reproduce {
namespace {

using fall::FallExperiment;

/// A fall that was published: what is printed of it.
struct Case {
  std::string robot, stance, direction;
  double push;  // [N]
  std::string without = {};
  double unplanned = kNotPrinted;  // [N·s]
  double planned = kNotPrinted;    // [N·s]
};

/// The ways to fall, by what the tables call them.
std::vector<std::string> columnNames() {
  std::vector<std::string> names;
  for (const fall::WayToFall& w : fall::allWays()) {
    names.emplace_back(w.name == "hold" ? "unplanned" : w.name);
  }
  return names;
}

constexpr const char* kFallProtocol =
    "Largest over time of the vertical impulse of 10 ms on all that is not the stance's own "
    "contact, pushes of 0.1 s on the trunk. Unplanned holds the stance; limp switches the motors "
    "off; damp lets them only resist; tuck curls up.";

/// Beside the robot, in the source folder and where the program is installed.
std::filesystem::path fallsOf(const std::string& robot) {
  return skill::findRobot(robot, std::filesystem::current_path()).parent_path() / "falls.toml";
}

/// The engine and, of each robot, a print of its model and of what its files say.
std::string fallPrints() {
  std::string prints = sim::engineVersion();
  for (const char* robot : {"bioloid-gp", "atlas"}) {
    const std::filesystem::path file = fallsOf(robot);
    const fall::FallRobot falls = fall::FallRobot::fromFile(file);
    Hash hash;
    hash.add(readFile(file));
    hash.add(readFile(skill::findRobot(robot, std::filesystem::current_path())));
    hash.add(fmt::format("{}", sim::Model::fromScene({.robot = falls.robot})->fingerprint()));
    prints += fmt::format(" {} {:08x}", robot, hash.value() & 0xffffffff);
  }
  return prints;
}

FallExperiment experimentOf(const Case& c, std::uint64_t seed, bool as_published = false) {
  const auto falls =
      std::make_shared<const fall::FallRobot>(fall::FallRobot::fromFile(fallsOf(c.robot)));
  fall::FallSetup setup = falls->setup(c.stance, c.direction);
  if (!c.without.empty()) setup = setup.without(c.without);
  fall::FallExperimentOptions options;
  options.problem.seed = seed;
  if (as_published) {
    options.replans = false;
    options.problem.stall = fall::Stall::kLiteral;
  }
  return {falls, setup, options};
}

/// A row a case, a column a way to fall.
Table casesTable(const std::vector<Case>& cases) {
  Table t;
  t.made_with = fallPrints;
  t.protocol = fmt::format("{} The seed is that of the poses the reach tables are drawn from.",
                           kFallProtocol);
  std::vector<double> unplanned, planned;
  for (const Case& c : cases) {
    std::string name = fmt::format("{} {} {:g} N", c.stance, c.direction, c.push);
    if (!c.without.empty()) name += " without " + c.without;
    t.rows.push_back({name, c.robot, "N·s"});
    unplanned.push_back(c.unplanned);
    planned.push_back(c.planned);
  }
  for (const std::string& name : columnNames()) t.columns.push_back({name, 3, 9, {}});
  t.columns[0].printed = unplanned;
  t.columns[1].printed = planned;
  t.ratios = {{"planned / unplanned", 1, 0},
              {"planned / limp", 1, 2},
              {"planned / damp", 1, 3},
              {"planned / tuck", 1, 4}};
  t.run = [cases](int row, int column, std::uint64_t seed, const std::stop_token&) {
    FallExperiment experiment = experimentOf(cases[row], seed);
    return outcomeOf(experiment.run({cases[row].push}, fall::allWays()[column].name).trial);
  };
  return t;
}

/// Where the model has the COM every `interval` until its last contact, from the first pivot.
std::vector<fall::Vector2d> pathOf(const fall::FallPlan& plan, const fall::PendulumModel& model,
                                   double interval) {
  const int every = static_cast<int>(std::lround(interval / model.step));
  std::vector<fall::Vector2d> path;
  double pivot = 0;
  int k = 0;
  for (const fall::PlannedContact& c : plan.contacts) {
    fall::PendulumState s = c.from.pendulum;
    const int steps = static_cast<int>(std::lround(c.action.duration / model.step));
    for (int i = 0; i < steps; ++i, ++k) {
      if (k % every == 0) path.push_back(s.com() + fall::Vector2d(pivot, 0));
      fall::step(model, c.action.rod_rate, s);
    }
    pivot += c.impact.advance;
  }
  return path;
}

}  // namespace

Table table3() {
  Table t = casesTable({{"bioloid-gp", "one_foot", "forward", 0.5, "", 0.8889, 0.2063},
                        {"bioloid-gp", "one_foot", "forward", 1.5, "", 0.6789, 0.2776},
                        {"bioloid-gp", "one_foot", "forward", 5.0, "", 0.9312, 0.3885},
                        {"bioloid-gp", "one_foot", "forward", 8.0, "", 1.2170, 0.5884},
                        {"bioloid-gp", "one_foot", "forward", 8.0, "hands", 1.2170, kNotPrinted}});
  t.name = "table-3";
  t.title = "Largest impulses of BioloidGP's falls [Ha2015, Tab. 3].";
  return t;
}

Table table4() {
  Table t = casesTable({{"atlas", "one_foot", "forward", 1000, "", 363.9, 37.8},
                        {"atlas", "one_foot", "forward", 2500, "", 401.5, 281.1},
                        {"atlas", "two_feet", "forward", 1000, "", 392.8, 214.0},
                        {"atlas", "two_feet", "forward", 2000, "", 322.7, 199.7},
                        {"atlas", "two_feet", "backward", 300, "", 338.8, 176.5},
                        {"atlas", "two_feet", "backward", 500, "", 344.6, 243.9}});
  t.name = "table-4";
  t.title = "Largest impulses of Atlas's falls [Ha2015, Tab. 4].";
  return t;
}

Table fallRobustness() {
  static constexpr double kPlannedFor = 5;  // [N]
  static const std::vector<double> kPushes = {2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 6.5};
  const Case planned{"bioloid-gp", "one_foot", "forward", kPlannedFor};
  Table t;
  t.name = "fall-robustness";
  t.made_with = fallPrints;
  t.title = "BioloidGP follows the plan for 5 N after other pushes [Ha2015, §4.4.1.1].";
  t.protocol = fmt::format(
      "{} The plan ends with an impact that stops the fall, and is followed to its end without "
      "planning anew, as published; printed are 35 to 50 % of unplanned.",
      kFallProtocol);
  for (const double push : kPushes) t.rows.push_back({fmt::format("{:g} N", push), "", "N·s"});
  t.columns = {{"unplanned", 3, 9, {}}, {"the plan for 5 N", 3, 9, {}}};
  t.ratios = {{"planned / unplanned", 1, 0}};
  t.run = [planned](int row, int column, std::uint64_t seed, const std::stop_token&) {
    FallExperiment experiment = experimentOf(planned, seed, true);
    if (column == 0) return outcomeOf(experiment.run({kPushes[row]}, "hold").trial);
    const fall::FallPlan plan = experiment.run({kPlannedFor}, "planned").plan;
    return outcomeOf(experiment.run({kPushes[row]}, "planned", {}, &plan).trial);
  };
  return t;
}

Table figure22() {
  struct Curve {
    Case fall;
    std::vector<Point> robot, model;  // printed; their last points are where they end
  };
  static const std::vector<Curve> kCurves = {
      {{"bioloid-gp", "one_foot", "forward", 5},
       {{.053, .181},
        {.092, .166},
        {.119, .163},
        {.150, .171},
        {.180, .175},
        {.228, .170},
        {.267, .157},
        {.287, .149}},
       {{.053, .181},
        {.071, .174},
        {.089, .167},
        {.107, .164},
        {.125, .167},
        {.161, .173},
        {.196, .170},
        {.232, .160},
        {.268, .141}}},
      {{"bioloid-gp", "one_foot", "forward", 8},
       {{.071, .175},
        {.129, .156},
        {.201, .164},
        {.288, .154},
        {.331, .143},
        {.380, .139},
        {.438, .154},
        {.505, .147},
        {.549, .135},
        {.592, .118}},
       {{.071, .175},
        {.104, .158},
        {.141, .171},
        {.180, .175},
        {.246, .162},
        {.261, .155},
        {.291, .158},
        {.351, .148},
        {.372, .138},
        {.421, .135},
        {.455, .120},
        {.490, .091}}},
      {{"atlas", "two_feet", "forward", 1000},
       {{-.165, 1.050},
        {-.060, 1.037},
        {.045, .981},
        {.116, .919},
        {.186, .827},
        {.248, .722},
        {.256, .716}},
       {{-.171, 1.049}, {-.088, 1.019}, {-.005, .957}, {.050, .897}, {.105, .837}, {.161, .786}}},
      {{"atlas", "two_feet", "forward", 2000},
       {{-.116, 1.051},
        {.085, 1.019},
        {.287, .930},
        {.489, .814},
        {.668, .675},
        {.792, .627},
        {.994, .503},
        {1.096, .410}},
       {{-.132, 1.050},
        {.027, 1.021},
        {.187, .961},
        {.346, .871},
        {.376, .852},
        {.505, .813},
        {.664, .729},
        {.823, .609}}}};
  static constexpr double kInterval = 0.01;  // of FallTrial::com [s]
  Table t;
  t.name = "figure-22";
  t.made_with = fallPrints;
  t.title = "The centre of mass of the model and of the robot that follows it [Ha2015, Fig. 22].";
  t.protocol =
      "One plan that ends with an impact, followed to its end without planning anew, as published. "
      "Robot: its mean distance from the "
      "model at equal times until the model's last contact; model: the length of its path. Points: "
      "along the fall and up, from the first pivot; printed ones read off the plots.";
  t.points = "x:y";
  for (const Curve& c : kCurves) {
    t.rows.push_back(
        {fmt::format("{} {} {:g} N", c.fall.robot, c.fall.stance, c.fall.push), "", "m"});
  }
  t.columns = {{"robot", 1, 9, {}}, {"model", 1, 9, {}}};
  t.ratios = {{"distance / path", 0, 1}};
  t.printed_points = [](int row, int column) {
    return column == 0 ? kCurves[row].robot : kCurves[row].model;
  };
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    const Case& c = kCurves[row].fall;
    FallExperiment experiment = experimentOf(c, seed, true);
    const FallExperiment::Outcome outcome = experiment.run({c.push}, "planned");
    const std::vector<fall::Vector2d> path =
        pathOf(outcome.plan, experiment.problem().model, kInterval);
    return alongPath(outcome.trial.com, path, column == 0);
  };
  return t;
}

Table randomFalls() {
  struct Range {
    Case setup;
    double most;  // [N]; Case::push is the least
  };
  static const std::vector<Range> kRanges = {{{"bioloid-gp", "one_foot", "forward", 0.5}, 8},
                                             {{"atlas", "one_foot", "forward", 1000}, 2500},
                                             {{"atlas", "two_feet", "forward", 1000}, 2000},
                                             {{"atlas", "two_feet", "backward", 300}, 500}};
  Table t;
  t.name = "random-falls";
  t.made_with = fallPrints;
  t.title = "Falls after random pushes in the published ranges. Not in the paper.";
  t.protocol = fmt::format(
      "{} Impulses as a share of that of the unplanned fall after the same "
      "push; missed: not below it. Points: the push and its share.",
      kFallProtocol);
  t.points = "push:share";
  t.drawn = Drawn::kNothing;
  t.center = Center::kMedian;
  for (const Range& r : kRanges) {
    t.rows.push_back({fmt::format("{} {} {} {:g}-{:g} N", r.setup.robot, r.setup.stance,
                                  r.setup.direction, r.setup.push, r.most),
                      "", "of unplanned"});
  }
  for (size_t i = 1; i < fall::allWays().size(); ++i) {
    t.columns.push_back({columnNames()[i], 10, 100, {}});
  }
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    const Range& r = kRanges[row];
    FallExperiment experiment = experimentOf(r.setup, 1);
    Random random(seed, 0, row);
    const double push = random.uniform(r.setup.push, r.most);
    const fall::FallTrial held = experiment.run({push}, "hold").trial;
    const fall::FallTrial other = experiment.run({push}, fall::allWays()[column + 1].name).trial;
    return shareOfHeld(held, other, push);
  };
  return t;
}

Outcome alongPath(const std::vector<fall::Vector2d>& com, const std::vector<fall::Vector2d>& path,
                  bool of_robot) {
  if (path.empty() || com.size() < path.size()) return {0, true, {}};
  double distance = 0;
  double length = 0;
  Outcome out;
  for (size_t i = 0; i < path.size(); ++i) {
    distance += (com[i] - path[i]).norm() / static_cast<double>(path.size());
    if (i > 0) length += (path[i] - path[i - 1]).norm();
    const fall::Vector2d& p = of_robot ? com[i] : path[i];
    out.points.push_back({p.x(), p.y()});
  }
  out.value = of_robot ? distance : length;
  return out;
}

Outcome outcomeOf(const fall::FallTrial& trial) {
  if (!trial.fell || trial.diverged) return {0, true, {}};
  return {trial.impulse, false, {}};
}

Outcome shareOfHeld(const fall::FallTrial& held, const fall::FallTrial& other, double push) {
  if (!held.fell || held.diverged || other.diverged) return {1, true, {{push, 1}}};
  const double share = other.impulse / held.impulse;
  return {share, share >= 1, {{push, share}}};
}

}  // namespace traceur::reproduce
