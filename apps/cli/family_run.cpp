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

StoredFamily storedFamily(const RunFile& run) {
  const std::string where = run.path().string();
  const auto text = run.meta("family");
  if (!text) throw InputError(fmt::format("{}: no curve has been run yet", where));
  StoredFamily f;
  f.tasks = toTasks(required(run, "tasks"), where + ": tasks");
  const auto number = [](const nlohmann::json& j) { return j.is_null() ? NAN : j.get<double>(); };
  try {
    const nlohmann::json j = nlohmann::json::parse(*text);
    const auto points = j.at("points").get<std::vector<std::vector<double>>>();
    if (points.empty() || points[0].empty()) throw InputError("no points");
    MatrixXd& m = f.family.curve.points;
    m.resize(static_cast<Eigen::Index>(points[0].size()), static_cast<Eigen::Index>(points.size()));
    for (Eigen::Index k = 0; k < m.cols(); ++k) {
      if (points[k].size() != points[0].size()) throw InputError("points of several sizes");
      m.col(k) = Eigen::Map<const VectorXd>(points[k].data(), m.rows());
    }
    if (!m.allFinite()) throw InputError("points that are not finite");
    f.folded = j.at("folded").get<bool>();
    const auto kind = j.at("kind").get<std::string>();
    if (kind != "bezier" && kind != "polyline") throw InputError("kind \"" + kind + "\"");
    f.family.curve.kind =
        kind == "bezier" ? optim::Curve::Kind::kBezier : optim::Curve::Kind::kPolyline;
    f.family.cost = number(j.at("cost"));
    for (const auto& cost : j.at("task_costs")) f.family.task_costs.push_back(number(cost));
    if (static_cast<Eigen::Index>(f.family.task_costs.size()) != f.tasks.size()) {
      throw InputError("costs of another number of tasks");
    }
  } catch (const std::exception& e) {
    throw InputError(fmt::format(
        "{}: not a run file of this version: its family cannot be read: {}", where, e.what()));
  }
  return f;
}

FamilyRun readFamily(const RunFile& run) {
  const std::string where = run.path().string();
  if (run.meta("tasks").value_or("").empty() || !run.meta("skill_text")) {
    throw InputError(
        fmt::format("{}: not a family of a skill; learn one with traceur learn SKILL --tasks "
                    "FIRST:LAST:COUNT",
                    where));
  }
  StoredFamily stored = storedFamily(run);
  FamilyRun f{skillOf(run), std::move(stored.tasks), std::move(stored.family), {}, {}};
  const skill::SkillProblem problem(f.skill, f.tasks);
  f.lower = problem.lower();
  f.upper = problem.upper();
  if (f.family.curve.points.rows() != f.lower.size()) {
    throw InputError(fmt::format(
        "{}: not a run file of this version: its family has {} parameters, its skill {}", where,
        f.family.curve.points.rows(), f.lower.size()));
  }
  if (stored.folded) {
    f.family.curve.bounds = optim::BoundFold(f.lower, f.upper, VectorXd::Ones(f.lower.size()));
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
