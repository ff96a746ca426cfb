#include "apps/cli/family_run.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/search.h"
#include "apps/cli/trained.h"
#include "traceur/core/error.h"
#include "traceur/skill/rollout.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::cli {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd FamilyRun::at(double task) const {
  const double first = tasks[0];
  const double last = tasks[tasks.size() - 1];
  if (!(task >= first && task <= last)) {
    throw InputError(fmt::format("--task {} {}: this family was learned for {} to {}", task,
                                 skill->task.unit, first, last));
  }
  // Between two tasks a curve may leave the box; folded ones cannot.
  return family.curve.at((task - first) / (last - first)).cwiseMax(lower).cwiseMin(upper);
}

std::string toText(const optim::Family& family) {
  nlohmann::json j;
  j["kind"] = family.curve.kind == optim::Curve::Kind::kBezier ? "bezier" : "polyline";
  for (const auto& point : family.curve.points.colwise()) {
    j["points"].push_back(std::vector<double>(point.begin(), point.end()));
  }
  j["folded"] = family.curve.bounds.any();
  j["cost"] = family.cost;
  j["task_costs"] = family.task_costs;
  return j.dump();
}

void requireAchieved(const skill::Skill& skill) {
  if (!skill.task.achieved.empty()) return;
  throw InputError(skill.name + " does not say what a trial achieved: there is no error to map");
}

std::filesystem::path beside(const std::filesystem::path& run, const std::string& ending) {
  const std::filesystem::path name = run.extension() == ".run" ? run.stem() : run.filename();
  return run.parent_path() / (name.string() + ending);
}

FamilyRun readFamily(const RunFile& run) {
  const auto text = run.meta("family");
  const std::string tasks = run.meta("tasks").value_or("");
  const std::string where = run.path().string();
  if (tasks.empty() || !run.meta("skill_text")) {
    throw InputError(
        fmt::format("{}: not a family of a skill; learn one with traceur learn SKILL --tasks "
                    "FIRST:LAST:COUNT",
                    where));
  }
  if (!text) throw InputError(fmt::format("{}: no curve has been run yet", where));
  FamilyRun f;
  f.tasks = toTasks(tasks, where + ": tasks");
  f.skill = skillOf(run);
  const skill::SkillProblem problem(f.skill, f.tasks);
  bool folded = false;
  try {
    const nlohmann::json j = nlohmann::json::parse(*text);
    const auto points = j.at("points").get<std::vector<std::vector<double>>>();
    MatrixXd& m = f.family.curve.points;
    m.resize(problem.dimension(), static_cast<Eigen::Index>(points.size()));
    for (Eigen::Index k = 0; k < m.cols(); ++k) {
      if (static_cast<Eigen::Index>(points[k].size()) != m.rows()) {
        throw InputError("points of another size than the skill has parameters");
      }
      m.col(k) = Eigen::Map<const VectorXd>(points[k].data(), m.rows());
    }
    if (m.cols() == 0) throw InputError("no points");
    folded = j.at("folded");
    const std::string kind = j.at("kind");
    if (kind != "bezier" && kind != "polyline") throw InputError("kind \"" + kind + "\"");
    f.family.curve.kind =
        kind == "bezier" ? optim::Curve::Kind::kBezier : optim::Curve::Kind::kPolyline;
    f.family.cost = j.at("cost").is_null() ? NAN : j.at("cost").get<double>();
    for (const auto& cost : j.at("task_costs")) {
      f.family.task_costs.push_back(cost.is_null() ? NAN : cost.get<double>());
    }
    if (static_cast<Eigen::Index>(f.family.task_costs.size()) != f.tasks.size()) {
      throw InputError("costs of another number of tasks");
    }
  } catch (const std::exception& e) {
    throw InputError(fmt::format("{}: its family cannot be read: {}", where, e.what()));
  }
  f.lower = problem.lower();
  f.upper = problem.upper();
  if (folded) {
    f.family.curve.bounds = optim::BoundFold(f.lower, f.upper, VectorXd::Ones(problem.dimension()));
  }
  return f;
}

sim::Recording recordingOf(const RunFile& run, const std::optional<double>& task) {
  if (!task) return bestRecording(run);
  const FamilyRun f = readFamily(run);
  sim::Recording recording;
  skill::Runner(f.skill).run(f.at(*task), *task, &recording);
  return recording;
}

}  // namespace traceur::cli
