#include "traceur/reproduce/falls.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/random.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/skill/skill.h"

namespace traceur::reproduce {
namespace {

using fall::FallExperiment;
using fall::Strategy;

/// A fall that was published: what is printed of it.
struct Case {
  std::string robot, stance, direction;
  double push;  // [N]
  std::string without = {};
  double unplanned = kNotPrinted;  // [N·s]
  double planned = kNotPrinted;    // [N·s]
};

struct Way {
  std::string name;
  Strategy strategy;
};

const std::vector<Way>& ways() {
  static const std::vector<Way> kWays = {{"unplanned", Strategy::kHold},
                                         {"planned", Strategy::kPlanned},
                                         {"limp", Strategy::kLimp},
                                         {"damp", Strategy::kDamp},
                                         {"tuck", Strategy::kTuck}};
  return kWays;
}

constexpr const char* kProtocol =
    "Largest over time of the vertical impulse of 10 ms on all that is not the stance's own "
    "contact, pushes of 0.1 s on the trunk. Unplanned holds the stance; limp switches the motors "
    "off; damp lets them only resist; tuck curls up.";

FallExperiment experimentOf(const Case& c, std::uint64_t seed) {
  const auto robot = skill::findRobot(c.robot, std::filesystem::current_path());
  const auto falls = std::make_shared<const fall::FallRobot>(
      fall::FallRobot::fromFile(robot.parent_path() / "falls.toml"));
  fall::FallSetup setup = falls->setup(c.stance, c.direction);
  if (!c.without.empty()) setup.graph = setup.graph.without(c.without);
  fall::FallExperimentOptions options;
  options.problem.seed = seed;
  return {falls, setup, options};
}

Outcome outcomeOf(const fall::FallTrial& t) {
  if (!t.fell || t.diverged) return {0, true, {}};
  return {t.impulse, false, {}};
}

/// A row a case, a column a way to fall.
Table casesTable(const std::vector<Case>& cases) {
  Table t;
  t.protocol =
      fmt::format("{} The seed is that of the poses the reach tables are drawn from.", kProtocol);
  std::vector<double> unplanned, planned;
  for (const Case& c : cases) {
    std::string name = fmt::format("{} {} {:g} N", c.stance, c.direction, c.push);
    if (!c.without.empty()) name += " without " + c.without;
    t.rows.push_back({name, c.robot, "N·s"});
    unplanned.push_back(c.unplanned);
    planned.push_back(c.planned);
  }
  for (const Way& w : ways()) t.columns.push_back({w.name, 3, 9, {}});
  t.columns[0].printed = unplanned;
  t.columns[1].printed = planned;
  t.ratios = {{"planned / unplanned", 1, 0},
              {"planned / limp", 1, 2},
              {"planned / damp", 1, 3},
              {"planned / tuck", 1, 4}};
  t.run = [cases](int row, int column, std::uint64_t seed, const std::stop_token&) {
    FallExperiment experiment = experimentOf(cases[row], seed);
    return outcomeOf(experiment.run({cases[row].push}, ways()[column].strategy).trial);
  };
  return t;
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
  t.title = "BioloidGP follows the plan for 5 N after other pushes [Ha2015, §4.4.1.1].";
  t.protocol = fmt::format(
      "{} The plan is followed to its end without planning anew; printed are "
      "35 to 50 % of unplanned.",
      kProtocol);
  for (const double push : kPushes) t.rows.push_back({fmt::format("{:g} N", push), "", "N·s"});
  t.columns = {{"unplanned", 3, 9, {}}, {"the plan for 5 N", 3, 9, {}}};
  t.ratios = {{"planned / unplanned", 1, 0}};
  t.run = [planned](int row, int column, std::uint64_t seed, const std::stop_token&) {
    FallExperiment experiment = experimentOf(planned, seed);
    if (column == 0) return outcomeOf(experiment.run({kPushes[row]}, Strategy::kHold).trial);
    const fall::FallPlan plan = experiment.run({kPlannedFor}, Strategy::kPlanned).plan;
    return outcomeOf(experiment.run({kPushes[row]}, Strategy::kPlanned, nullptr, &plan).trial);
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
  t.title = "Falls after random pushes in the published ranges. Not in the paper.";
  t.protocol = fmt::format(
      "{} Impulses as a share of that of the unplanned fall after the same "
      "push; missed: not below it. Points: the push and its share.",
      kProtocol);
  t.points = "push:share";
  t.drawn = Drawn::kNothing;
  t.center = Center::kMedian;
  for (const Range& r : kRanges) {
    t.rows.push_back({fmt::format("{} {} {} {:g}-{:g} N", r.setup.robot, r.setup.stance,
                                  r.setup.direction, r.setup.push, r.most),
                      "", "of unplanned"});
  }
  for (size_t i = 1; i < ways().size(); ++i) t.columns.push_back({ways()[i].name, 10, 100, {}});
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    const Range& r = kRanges[row];
    FallExperiment experiment = experimentOf(r.setup, 1);
    Random random(seed, 0, row);
    const double push = random.uniform(r.setup.push, r.most);
    const fall::FallTrial held = experiment.run({push}, Strategy::kHold).trial;
    const fall::FallTrial other = experiment.run({push}, ways()[column + 1].strategy).trial;
    if (!held.fell || other.diverged) return Outcome{1, true, {{push, 1}}};
    const double share = other.impulse / held.impulse;
    return Outcome{share, share >= 1, {{push, share}}};
  };
  return t;
}

}  // namespace traceur::reproduce
