#include "apps/cli/trained.h"

#include <fmt/format.h>

#include <sstream>

#include "traceur/core/error.h"
#include "traceur/core/toml.h"

namespace traceur::cli {

RunFile::Meta toMeta(const LearnOptions& o, const skill::Skill& skill) {
  std::string parameters;
  for (const ParamSpec& p : skill.parameters) {
    parameters += fmt::format("{}{} [{}]", parameters.empty() ? "" : ", ", p.name, p.unit);
  }
  return {{"verb", "learn"},
          {"traceur", TRACEUR_VERSION},
          {"engine", sim::engineVersion()},
          {"skill", skill.name},
          {"skill_file", o.skill_file},
          {"skill_text", skill.text},
          {"model", skill.model->mjcf()},
          {"parameters", parameters},
          {"task", fmt::format("{}", o.task)},
          {"task_unit", skill.task.unit},
          {"seed", fmt::format("{}", o.seed)},
          {"budget", fmt::format("{}", o.budget)},
          {"optimiser", o.optimiser},
          {"population", fmt::format("{}", o.population)},
          {"step_size", fmt::format("{}", o.step_size)}};
}

void requireSameOptions(const RunFile& run, const RunFile::Meta& asked) {
  for (const auto& [key, value] : asked) {
    const std::string stored = required(run, key);
    if (stored == value) continue;
    const std::string where = run.path().string();
    if (key == "budget") {
      if (std::stol(value) >= std::stol(stored)) continue;
      throw InputError(
          fmt::format("{}: budget {} is less than the {} it began with", where, value, stored));
    }
    if (key == "skill_file") continue;  // the text counts, wherever it lies
    const bool is_text = key == "skill_text" || key == "model";
    throw InputError(fmt::format("{}: cannot be resumed with another {}{}", where, key,
                                 is_text ? ": the skill or robot file has changed since it began"
                                         : fmt::format(": it has {}, got {}", stored, value)));
  }
}

optim::Progress progressOf(const RunFile& run, const std::vector<std::string>& constraints) {
  optim::Progress p;
  for (const TrialRow& row : run.trials()) {
    optim::Trial trial;
    trial.x = Eigen::Map<const Eigen::VectorXd>(row.x.data(), row.x.size());
    trial.evaluation.cost = row.cost;
    trial.evaluation.failed = row.failed;
    for (const std::string& name : constraints) {
      trial.evaluation.violated.push_back(("," + row.violated + ",").find("," + name + ",") !=
                                          std::string::npos);
    }
    ++p.evaluations;
    p.failed += row.failed;
    p.generation = row.generation + 1;
    if (!p.best || optim::better(trial.evaluation, p.best->evaluation)) p.best = trial;
  }
  return p;
}

std::string required(const RunFile& run, const std::string& key) {
  const auto value = run.meta(key);
  if (!value) {
    throw InputError(fmt::format("{}: this run does not say its \"{}\"", run.path().string(), key));
  }
  return *value;
}

sim::Recording bestRecording(const RunFile& run) {
  const auto bytes = run.recording("best");
  if (!bytes) {
    throw InputError(
        fmt::format("{}: nothing is recorded yet: it was cut off; finish it with "
                    "traceur learn {} --out {} --resume and the same options",
                    run.path().string(), required(run, "skill_file"), run.path().string()));
  }
  return sim::Recording::decode(*bytes);
}

}  // namespace traceur::cli
