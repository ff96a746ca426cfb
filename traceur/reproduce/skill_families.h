// Chapter 7's experiments with skills of a small robot: how fast each optimiser learns a family of
// jumps, kicks or walks, and how well what it learnt does the tasks in between.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "traceur/optim/family.h"
#include "traceur/reproduce/table.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill.h"

namespace traceur::reproduce {

/// Learning curves of jump, kick and walk [Ha2015, Fig. 32]: six tasks, line and cubic.
Table figure32();
/// The jump with 6 and with 21 tasks, for a line [Ha2015, Fig. 33].
Table figure33();
/// Costs of 51 tasks of the learnt jumps [Ha2015, Fig. 34].
Table figure34();
/// What `learn --tasks` with its defaults gives: errors of 51 tasks, falls and trials.
Table families();

/// The mean cost of the best curve over the trials that finding it took. A point is kept where the
/// cost fell, and the last.
struct Learning {
  std::vector<Point> costs;  ///< x: trials; y: cost
  optim::Family family;      ///< the best; no points if the search ended before there was one
  int trials = 0;
};

/// How a search begins.
enum class Start {
  kLearn,     ///< as `traceur learn`: the skill's initial parameters, its step size
  kPublished  ///< the middle of the ranges, half of each as standard deviation [Ha2015, §7.4];
              ///< CMA-ES at random in the inner half
};

struct LearningOptions {
  std::string optimiser = "contextual";
  int control_points = 2;
  Start start = Start::kLearn;
  int budget = 5000;  ///< trials
  double target = 0;  ///< mean cost that ends it
  std::uint64_t seed = 1;
  std::stop_token stop = {};
};

/// What a cell of the tables learns.
struct FamilyRun {
  std::string skill;
  Eigen::VectorXd tasks;
  LearningOptions options;
};
FamilyRun figure32Run(int row, int column, std::uint64_t seed);
FamilyRun figure33Run(int row, int column, std::uint64_t seed);
FamilyRun figure34Run(int column, std::uint64_t seed);  ///< of jumps alone
FamilyRun familiesRun(int row, int column, std::uint64_t seed);

/// @param tasks  (M) trained
/// @throws InputError as the optimiser
Learning learnFamily(const std::shared_ptr<const skill::Skill>& skill, const Eigen::VectorXd& tasks,
                     const LearningOptions& options);

/// Learns to `target` of the skill's target_cost and tries the result on 51 tasks over the range.
/// The value is the number of trials, missed if the target was not reached; a point is a task and
/// what `of` says of its performance.
Outcome learnAndSweep(const std::shared_ptr<const skill::Skill>& skill,
                      const Eigen::VectorXd& trained, LearningOptions options,
                      const std::function<double(const skill::Rollout&, double task)>& of);

/// The least cost a learning curve had reached after so many trials; infinite before its first.
double costAfter(const std::vector<Point>& curve, double trials);

/// Trials after which a learning curve was at a cost or below; nothing if it never was.
std::optional<double> trialsTo(const std::vector<Point>& curve, double cost);

}  // namespace traceur::reproduce
