#include "apps/cli/performance.h"

#include <fmt/format.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::cli {

namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Json numberOrNull(double x) {
  return std::isfinite(x) ? Json(x) : Json();
}

Json boolOrNull(std::optional<bool> x) {
  return x ? Json(*x) : Json();
}

Json toJson(const Performance& p, const skill::Task& t) {
  Json j{{"task", p.task},
         {"achieved", numberOrNull(p.rollout.achieved)},
         {"error", numberOrNull(p.error())},
         {"failed", p.rollout.failed()},
         {"ended", p.rollout.ended},
         {"cost", numberOrNull(p.rollout.cost)}};
  if (const auto reached = p.reached(t)) j["within_tolerance"] = *reached;
  return j;
}

Json toJson(const std::vector<practice::Quantity>& quantities) {
  Json j = Json::object();
  for (const practice::Quantity& q : quantities) {
    j[q.unit.empty() ? q.name : fmt::format("{} [{}]", q.name, q.unit)] = numberOrNull(q.value);
  }
  return j;
}

Json toJson(const ParamSpecs& parameters, const Eigen::VectorXd& x) {
  std::vector<practice::Quantity> all;
  const size_t n = std::min(parameters.size(), static_cast<size_t>(x.size()));
  for (size_t i = 0; i < n; ++i) {
    all.push_back({parameters[i].name, x[static_cast<Eigen::Index>(i)], parameters[i].unit});
  }
  return toJson(all);
}

std::string toText(const Performance& p, const skill::Task& t) {
  const std::string unit = t.unit.empty() ? "" : " " + t.unit;
  const std::string fails = p.rollout.failed() ? " (fails: " + p.rollout.ended + ")" : "";
  if (t.achieved.empty()) {
    return fmt::format("{} {:.4g}{} asked, cost {:.3g}{}", t.name, p.task, unit, p.rollout.cost,
                       fails);
  }
  const bool misses = !p.rollout.failed() && p.reached(t) == false;
  return fmt::format(
      "{} {:.4g}{}, asked {:.4g}{}, error {:.2g}{}{}{}", t.name, p.rollout.achieved, unit, p.task,
      unit, p.error(), unit, fails,
      misses ? fmt::format(" (not within the tolerance of {:g}{})", t.tolerance, unit) : "");
}

ExitCode exitCode(std::optional<bool> reached) {
  return reached.value_or(true) ? kDone : kNotReached;
}

void requireAchieved(const skill::Skill& skill) {
  if (!skill.task.achieved.empty()) return;
  throw InputError(skill.name + " does not say what a trial achieved: there is no error to map");
}

std::filesystem::path beside(const std::filesystem::path& run, const std::string& ending) {
  const std::filesystem::path name = run.extension() == ".run" ? run.stem() : run.filename();
  return run.parent_path() / (name.string() + ending);
}

}  // namespace traceur::cli
