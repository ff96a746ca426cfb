// One performance of a skill, as people and programs are told of it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/cli/verbs.h"
#include "traceur/practice/learned.h"

namespace traceur::cli {

/// What was asked, and what came of it.
struct Performance {
  double task = 0;
  skill::Rollout rollout;

  double error() const { return rollout.achieved - task; }
  std::optional<bool> reached(const skill::Task& t) const {
    return practice::reached(t, task, rollout);
  }
};

/// NaN and the infinities are null.
nlohmann::ordered_json numberOrNull(double x);
/// What nobody can say is null.
nlohmann::ordered_json boolOrNull(std::optional<bool> x);
nlohmann::ordered_json toJson(const Performance& p, const skill::Task& t);
/// {"apex [m]": 0.23, …}
nlohmann::ordered_json toJson(const std::vector<practice::Quantity>& quantities);
/// The values, in the order of the parameters.
nlohmann::ordered_json toJson(const ParamSpecs& parameters, const Eigen::VectorXd& x);

/// What a person wants to know of it, without the skill's name.
std::string toText(const Performance& p, const skill::Task& t);

/// kNotReached if a task is known not to be reached, else kDone.
ExitCode exitCode(std::optional<bool> reached);

/// @throws InputError for a skill that does not say what a trial achieved
void requireAchieved(const skill::Skill& skill);

/// What is made of a run, in its folder: "a/jump.run" and "-sweep.csv" give "a/jump-sweep.csv".
std::filesystem::path beside(const std::filesystem::path& run, const std::string& ending);

}  // namespace traceur::cli
