#include "traceur/reproduce/skill_families.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <regex>
#include <string>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::reproduce {
namespace {

TEST(SkillFamilies, ReadALearningCurve) {
  const std::vector<Point> curve = {{32, 1.0}, {64, 0.5}, {128, 0.1}, {500, 0.1}};
  EXPECT_TRUE(std::isinf(costAfter(curve, 31)));
  EXPECT_EQ(costAfter(curve, 64), 0.5);
  EXPECT_EQ(costAfter(curve, 127), 0.5);
  EXPECT_EQ(costAfter(curve, 5000), 0.1);
  EXPECT_EQ(trialsTo(curve, 0.5), 64);
  EXPECT_EQ(trialsTo(curve, 0.2), 128);
  EXPECT_FALSE(trialsTo(curve, 0.05));
}

/// The costs are what two generations come to: step sizes, bounds, samples and starts all have a
/// part in them.
TEST(SkillFamilies, LearnAndKeepTheCurveOfIt) {
  struct Learnt {
    const char* optimiser;
    Start start;
    double cost;
  };
  const Learnt known[] = {
      {"contextual", Start::kLearn, 0.0909496}, {"contextual", Start::kPublished, 0.115938},
      {"curve", Start::kLearn, 0.102915},       {"curve", Start::kPublished, 0.0967343},
      {"cma", Start::kLearn, 0.139428},         {"cma", Start::kPublished, 0.187991},
      {"individual", Start::kLearn, 0.111802},  {"individual", Start::kPublished, 0.0879828}};
  const auto skill = skill::Skill::fromFile("tests/cli/nod.toml");
  const Eigen::VectorXd tasks = Eigen::VectorXd::LinSpaced(3, 0, 1);
  const skill::SkillProblem problem(skill, tasks);
  for (const Learnt& k : known) {
    SCOPED_TRACE(fmt::format("{} {}", k.optimiser, static_cast<int>(k.start)));
    const LearningOptions options{
        .optimiser = k.optimiser, .start = k.start, .budget = 96, .target = 0, .seed = 2};
    const Learning a = learnFamily(skill, tasks, options);
    EXPECT_GE(a.trials, 96);
    EXPECT_NEAR(a.family.cost, k.cost, 1e-4 * k.cost);
    ASSERT_FALSE(a.costs.empty());
    EXPECT_LT(a.costs.back().y, a.costs.front().y);
    EXPECT_EQ(a.costs.back().x, a.trials);
    for (size_t i = 1; i + 1 < a.costs.size(); ++i) {
      EXPECT_LT(a.costs[i].y, a.costs[i - 1].y);
    }
    // What it says of the curve holds when its points are run again.
    double mean = 0;
    for (int i = 0; i < 3; ++i) {
      const double cost = problem.evaluate(a.family.curve.at(i / 2.0)).task_costs[i];
      EXPECT_EQ(cost, a.family.task_costs[i]);
      mean += cost / 3;
    }
    EXPECT_NEAR(a.costs.back().y, mean, 1e-3 * mean);
  }
  EXPECT_THROW(learnFamily(skill, tasks, {.optimiser = "nobody"}), InputError);
}

TEST(SkillFamilies, TryWhatIsLearntOnManyTasks) {
  skill::Skill with_target = *skill::Skill::fromFile("tests/cli/nod.toml");
  with_target.target_cost = 0.1;
  const auto skill = std::make_shared<const skill::Skill>(with_target);
  const Eigen::VectorXd tasks = Eigen::VectorXd::LinSpaced(3, 0.1, 0.6);
  LearningOptions options{.budget = 96, .target = 1.5, .seed = 2};
  const auto error = [](const skill::Rollout& r, double task) { return r.achieved - task; };
  const Outcome reached = learnAndSweep(skill, tasks, options, error);
  EXPECT_FALSE(reached.missed);

  options.target = 1.5 * 0.1;
  const Learning same = learnFamily(skill, tasks, options);
  EXPECT_LE(same.family.cost, 0.15);
  EXPECT_EQ(reached.value, same.trials);
  skill::Runner runner(skill);
  ASSERT_EQ(reached.points.size(), 51U);
  for (int i = 0; i <= 50; ++i) {
    const double task = 0.1 + 0.01 * i;
    EXPECT_NEAR(reached.points[i].x, task, 1e-12);
    const double achieved = runner.run(same.family.curve.at(i / 50.0), task).achieved;
    EXPECT_NEAR(reached.points[i].y, achieved - task, 1e-3 * std::abs(achieved - task));
  }

  options.target = 1e-9;
  EXPECT_TRUE(learnAndSweep(skill, tasks, options, error).missed);
  std::stop_source stop;
  stop.request_stop();
  options.stop = stop.get_token();
  const Outcome nothing = learnAndSweep(skill, tasks, options, error);
  EXPECT_TRUE(nothing.missed);
  EXPECT_EQ(nothing.value, 0);
  EXPECT_TRUE(nothing.points.empty());
}

/// Columns are called after the optimiser, "cubic" for four control points, and the tasks if not 6.
TEST(SkillFamilies, LearnWhatTheirColumnsAreCalled) {
  const double ranges[3][2] = {{0.03, 0.08}, {0.3, 0.6}, {0.0667, 0.1333}};
  const auto expect = [&](const Table& table, int row, int column, const FamilyRun& run) {
    const std::string& name = table.columns[column].name;
    SCOPED_TRACE(table.name + " " + name);
    EXPECT_EQ(run.skill, table.rows[row].name);
    const int tasks = name.ends_with("21 tasks") ? 21 : name.ends_with("51 tasks") ? 51 : 6;
    EXPECT_EQ(run.tasks, Eigen::VectorXd::LinSpaced(tasks, ranges[row][0], ranges[row][1]));
    EXPECT_TRUE(run.options.optimiser == name.substr(0, name.find(' ')) ||
                (run.options.optimiser == "cma" && name.starts_with("CMA-ES")));
    EXPECT_EQ(run.options.control_points, name.ends_with("cubic") ? 4 : 2);
    EXPECT_EQ(run.options.seed, 7U);
    const bool published = table.name != "families";
    EXPECT_EQ(run.options.start, published ? Start::kPublished : Start::kLearn);
    EXPECT_EQ(run.options.target, published ? -kInfinity : 1);
    // 1600 trials a task on average, where each has a search of its own.
    EXPECT_EQ(run.options.budget, run.options.optimiser == "individual" ? 1600 * tasks
                                  : run.options.optimiser == "cma"      ? 12500
                                  : published                           ? 5000
                                                                        : 3000);
  };
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 6; ++column) {
      expect(figure32(), row, column, figure32Run(row, column, 7));
    }
    for (const int column : {0, 1}) expect(families(), row, column, familiesRun(row, column, 7));
  }
  for (int column = 0; column < 6; ++column) {
    expect(figure33(), 0, column, figure33Run(0, column, 7));
  }
  for (int column = 0; column < 4; ++column) expect(figure34(), 0, column, figure34Run(column, 7));
  EXPECT_NE(figure32().protocol.find("5000 trials, CMA-ES 12500."), std::string::npos);
}

/// All that a test has time for: the skills are there, and who is asked to stop has learnt nothing.
TEST(SkillFamilies, AskedToStopTheyEndSoon) {
  std::stop_source stop;
  stop.request_stop();
  for (const Table& table : {figure32(), figure33(), figure34(), families()}) {
    for (int row = 0; row < static_cast<int>(table.rows.size()); ++row) {
      const Outcome outcome = table.run(row, 0, 1, stop.get_token());
      EXPECT_TRUE(outcome.missed) << table.name;
      EXPECT_TRUE(outcome.points.empty());
      EXPECT_EQ(outcome.value, table.points == "trials:cost" ? kInfinity : 0);
    }
  }
}

/// The optimiser "curve" first runs the point it begins at.
TEST(SkillFamilies, BeginAsLearnDoesOrInTheMiddleOfTheRanges) {
  const auto skill = skill::Skill::fromFile("tests/cli/nod.toml");
  const Eigen::VectorXd tasks = Eigen::VectorXd::LinSpaced(3, 0, 1);
  const skill::SkillProblem problem(skill, tasks);
  const Eigen::VectorXd middle = (problem.lower() + problem.upper()) / 2;
  ASSERT_NE(middle, skill->initialParameters());
  for (const Start start : {Start::kLearn, Start::kPublished}) {
    const Learning a = learnFamily(
        skill, tasks, {.optimiser = "curve", .start = start, .budget = 3, .target = -1, .seed = 1});
    const Eigen::VectorXd x = start == Start::kLearn ? skill->initialParameters() : middle;
    EXPECT_NEAR(a.costs.front().y, problem.evaluate(x).cost, 1e-3 * a.costs.front().y);
  }
}

/// Runs as the first row's might be: one column is twice as fast as "curve", one never gets there.
TEST(SkillFamilies, TellTrialsToTheLevelOfThePublishedOptimiser) {
  const Table table = figure32();
  Results runs(table);
  const auto column = [&](const std::string& name) {
    int c = 0;
    while (table.columns[c].name != name) ++c;
    return c;
  };
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    runs.add({0, column("curve"), seed}, {0, false, {{100, 1.0}, {4000, 0.01}, {5000, 0.01}}});
    runs.add({0, column("contextual"), seed}, {0, false, {{100, 1.0}, {2000, 0.005}}});
    runs.add({0, column("CMA-ES"), seed}, {0, false, {{96, 1.0}, {12500, 0.02}}});
  }
  runs.add({2, column("curve"), 1}, {0, false, {{500, 0.3}, {3000, 0.25}, {5000, 0.125}}});
  const std::vector<Results> told = table.readings(runs);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].table().name, "figure-32 trials");
  EXPECT_EQ(
      told[0].table().title,
      "Trials to the level of the dissertation's optimiser: jump 0.01 [0.01, 0.01]; walk 0.12 "
      "[0.12, 0.12].");
  EXPECT_NE(told[0].table().protocol.find("after 5000 trials"), std::string::npos);
  EXPECT_EQ(table.readings(Results(table))[0].table().title,
            "Trials to the level of the dissertation's optimiser: not run yet.");
  const Summary trials = summarise(told[0]);
  EXPECT_EQ(told[0].table().rows[2].name, "walk");
  EXPECT_EQ(trials.cells[1][column("curve")].runs, 0);
  EXPECT_EQ(trials.cells[2][column("curve")].value, 5000);
  EXPECT_EQ(trials.cells[0][column("curve")].value, 4000);
  EXPECT_EQ(trials.cells[0][column("contextual")].value, 2000);
  EXPECT_TRUE(std::isinf(trials.cells[0][column("CMA-ES")].value));
  EXPECT_EQ(trials.cells[0][column("CMA-ES")].missed, 3);
  EXPECT_EQ(trials.ratios[0][1].value, 0.5);
  EXPECT_TRUE(std::isinf(trials.ratios[0][0].value));
  // A column that is stuck is no faster for a smaller budget.
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    runs.add({0, column("contextual"), seed}, {0, false, {{100, 1.0}, {2500, 0.5}}});
  }
  const Summary stuck = summarise(table.readings(runs)[0]);
  EXPECT_TRUE(std::isinf(stuck.ratios[0][1].value));
  EXPECT_TRUE(std::isinf(stuck.ratios[0][1].interval.low));
  // Of two that never get there nothing is known.
  Table both = table.readings(runs)[0].table();
  both.ratios = {{"contextual / CMA-ES", column("contextual"), column("CMA-ES")}};
  Results never(both);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    never.add({0, column("contextual"), seed}, {kInfinity, true});
    never.add({0, column("CMA-ES"), seed}, {kInfinity, true});
  }
  EXPECT_TRUE(std::isnan(summarise(never).ratios[0][0].value));
  const Summary costs = summarise(told[1]);
  EXPECT_EQ(told[1].table().rows[1].name, "jump 1000");
  EXPECT_EQ(costs.cells[1][column("curve")].value, 1.0);
  EXPECT_NEAR(costs.cells[1][column("curve")].printed, 0.18 * 11 / 7, 1e-12);
  EXPECT_EQ(costs.cells[5][column("curve")].value, 0.01);  // 5000, all it had
  EXPECT_EQ(costs.cells[6][column("curve")].runs, 0);
  EXPECT_EQ(costs.cells[7][column("curve")].runs, 0);  // 8000: it had no more than 5000
  EXPECT_EQ(costs.cells[7][column("CMA-ES")].value, 1.0);
  EXPECT_EQ(costs.cells[9][column("CMA-ES")].value, 1.0);
  EXPECT_EQ(told[1].table().name, "figure-32 costs");
  ASSERT_EQ(told[1].table().rows.size(), 30U);
  EXPECT_EQ(told[1].table().rows[23].name, "walk 3000");
  EXPECT_EQ(told[1].table().rows[23].group, "walk");
  EXPECT_EQ(costs.cells[20][column("curve")].value, 0.3);
  EXPECT_EQ(costs.cells[23][column("curve")].value, 0.25);
  EXPECT_EQ(costs.cells[0][column("CMA-ES")].runs, 3);
  EXPECT_EQ(costs.cells[0][column("curve")].runs, 3);
  EXPECT_EQ(costs.cells[10][column("curve")].runs, 0);
  // The median of three runs of "curve", one of which never gets there and counts in full.
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const double late = seed == 1 ? 0.5 : 0.01;
    runs.add({1, column("curve"), seed}, {0, false, {{4000, late}, {5000, late}}});
  }
  const Summary kicks = summarise(table.readings(runs)[0]);
  EXPECT_EQ(kicks.cells[1][column("curve")].runs, 3);
  EXPECT_EQ(kicks.cells[1][column("curve")].missed, 1);
  EXPECT_EQ(kicks.cells[1][column("curve")].value, 4000);
  EXPECT_EQ(table.readings(runs)[0].values(1, column("curve")), (Sample{5000, 4000, 4000}));
}

TEST(SkillFamilies, SumUpTheCostsOfManyTasks) {
  const Table table = figure34();
  Results runs(table);
  std::vector<Point> points;
  points.reserve(51);
  for (int i = 0; i < 51; ++i) points.push_back({0.02 + 0.001 * i, 0.001 * ((i * 20) % 51)});
  runs.add({0, 2, 1}, {4000, false, points});
  runs.add({0, 3, 1}, {5000, false, {}});
  const Results told = table.readings(runs).at(0);
  const Summary s = summarise(told);
  ASSERT_EQ(told.table().rows.size(), 5U);
  EXPECT_EQ(told.table().rows[4].name, "jump largest");
  EXPECT_EQ(told.table().rows[4].group, "jump");
  const double expected[] = {4000, 0, 0.025, 0.025, 0.05};  // of 0, 0.001, … 0.05
  for (int row = 0; row < 5; ++row) {
    EXPECT_NEAR(s.cells[row][2].value, expected[row], 1e-12) << row;
    EXPECT_EQ(std::isinf(s.cells[row][3].value), row > 0) << row;  // not one curve
    EXPECT_EQ(s.cells[row][0].runs, 0);
  }
  EXPECT_EQ(s.cells[2][1].printed, .00089);
}

TEST(SkillFamilies, KeepTheRowsOfEachSkillApart) {
  const Table table = families();
  Results runs(table);
  for (int row = 0; row < static_cast<int>(table.rows.size()); ++row) {
    runs.add({row, 1, 1}, {1000.0 + row, false, {{0.1, 0.002}, {0.2, 0.001 * (row + 3)}}});
  }
  const Results told = table.readings(runs).at(0);
  const Summary s = summarise(told);
  ASSERT_EQ(told.table().rows.size(), 5 * table.rows.size());
  for (size_t row = 0; row < table.rows.size(); ++row) {
    EXPECT_EQ(told.table().rows[5 * row + 3].name, table.rows[row].name + " largest error");
    EXPECT_EQ(s.cells[5 * row][1].value, 1000.0 + static_cast<double>(row));
    EXPECT_EQ(s.cells[5 * row + 4][1].value, 0);
  }
}

/// Of eleven tasks, 0 to 10 mm, cm or cm/s off to either side.
TEST(SkillFamilies, ErrorsAreInUnitsForPeople) {
  const Table table = families();
  Results runs(table);
  const char* units[] = {"mm", "cm", "cm/s"};
  for (int row = 0; row < 3; ++row) {
    std::vector<Point> points;
    for (int i = 0; i <= 10; ++i) {
      points.push_back(
          {0.1 * i, (i % 2 == 0 ? 1 : -1) * (row == 0 ? 1e-3 : 1e-2) * ((i * 7) % 11)});
    }
    runs.add({row, 0, 1}, {100, false, points});
    runs.add({row, 1, 1}, {100, true, {}});
  }
  const Results told = table.readings(runs).at(0);
  const Summary s = summarise(told);
  for (int row = 0; row < 3; ++row) {
    SCOPED_TRACE(table.rows[row].name);
    EXPECT_NEAR(s.cells[5 * row + 1][0].value, 5, 1e-9);
    EXPECT_NEAR(s.cells[5 * row + 2][0].value, 9, 1e-9);
    EXPECT_NEAR(s.cells[5 * row + 3][0].value, 10, 1e-9);
    for (int error = 1; error <= 3; ++error) {
      EXPECT_EQ(told.table().rows[5 * row + error].quantity, units[row]);
      EXPECT_TRUE(std::isinf(s.cells[5 * row + error][1].value));
    }
    EXPECT_EQ(told.table().rows[5 * row + 4].quantity, "of 51, mean");
    EXPECT_EQ(s.cells[5 * row + 4][1].value, 51);  // of no curve at all
    EXPECT_EQ(table.rows[row].unit, row == 2 ? "m/s" : "m");
  }
  EXPECT_TRUE(told.table().points.empty());
  EXPECT_FALSE(told.table().readings);
  EXPECT_NE(table.protocol.find("--budget 3000 "), std::string::npos);
  EXPECT_NE(
      table.protocol.find("51 tasks: jump 0.03 to 0.08, kick 0.3 to 0.6, walk 0.0667 to 0.1333, "),
      std::string::npos);
}

/// The engine, then a print of each skill.
TEST(SkillFamilies, SayWhatTheyAreMadeWith) {
  const std::string prints = families().made_with();
  EXPECT_TRUE(
      std::regex_match(prints, std::regex("MuJoCo [0-9.]+ jump [0-9a-f]{8} kick [0-9a-f]{8} "
                                          "walk [0-9a-f]{8}")))
      << prints;
}

TEST(SkillFamilies, CountAFallAsAnInfiniteError) {
  const Table table = families();
  Results runs(table);
  runs.add({0, 0, 1}, {1600, false, {{0.03, 0.001}, {0.04, NAN}, {0.05, -0.003}}});
  const std::vector<Results> told = table.readings(runs);
  const Summary s = summarise(told[0]);
  EXPECT_EQ(s.cells[0][0].value, 1600);
  EXPECT_DOUBLE_EQ(s.cells[1][0].value, 3);  // mm, median of 1, 3 and infinity
  EXPECT_TRUE(std::isinf(s.cells[3][0].value));
  EXPECT_EQ(s.cells[4][0].value, 1);
  // A search that never got there took no number of trials; one family's falls are not outvoted.
  runs.add({0, 0, 2}, {3004, true, {{0.03, 0.001}, {0.04, 0.001}, {0.05, 0.001}}});
  runs.add({0, 0, 3}, {3004, true, {{0.03, 0.001}, {0.04, 0.001}, {0.05, 0.001}}});
  const Summary three = summarise(table.readings(runs)[0]);
  EXPECT_TRUE(std::isinf(three.cells[0][0].value));
  EXPECT_DOUBLE_EQ(three.cells[4][0].value, 1.0 / 3);
}

}  // namespace
}  // namespace traceur::reproduce
