#include "apps/cli/trained.h"

#include <fmt/format.h>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"

namespace traceur::cli {

RunFile::Meta toMeta(const LearnOptions& o, const skill::Skill& skill) {
  std::vector<std::string> constraints;
  for (const skill::Failure& f : skill.failures) constraints.push_back(f.name);
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
          {"model", fmt::format("{:016x}", skill.model->fingerprint())},
          {"parameters", parameters},
          {"task", fmt::format("{}", o.task)},
          {"task_unit", skill.task.unit},
          {"seed", fmt::format("{}", o.seed)},
          {"budget", fmt::format("{}", o.budget)},
          {"tasks", o.tasks},
          {"curve", o.curve},
          {"optimiser", o.optimiser},
          {"experience", o.experience},
          {"constraints", join(constraints)},
          {"population", fmt::format("{}", o.population)},
          {"step_size", fmt::format("{}", o.step_size)}};
}

std::shared_ptr<const skill::Skill> skillOf(const RunFile& run) {
  const std::string file = required(run, "skill_file");
  auto skill = skill::Skill::fromText(required(run, "skill_text"), file);
  // Prints of different engines cannot be compared; what was learned may still be tried.
  const bool comparable = required(run, "engine") == sim::engineVersion();
  const std::string print = fmt::format("{:016x}", skill->model->fingerprint());
  if (!comparable || print == required(run, "model")) return skill;
  throw InputError(fmt::format(
      "{}: learned with another robot: the {} found from {} has changed since", run.path().string(),
      skill->model->robot() ? skill->model->robot()->name : "one", file));
}

sim::Recording bestRecording(const RunFile& run) {
  const auto bytes = run.recording("best");
  const std::string verb = run.meta("verb").value_or("");
  if (!bytes && verb == "minimise") {
    throw InputError(
        fmt::format("{}: a search of numbers: there is no motion to look at", run.path().string()));
  }
  if (!bytes && !run.meta("tasks").value_or("").empty()) {
    throw InputError(fmt::format("{}: a family: expected --task, which of its tasks to look at",
                                 run.path().string()));
  }
  if (!bytes) {
    throw InputError(
        fmt::format("{}: nothing is recorded yet: it was cut off; finish it with "
                    "traceur learn {} --out {} --resume and the same options",
                    run.path().string(), required(run, "skill_file"), run.path().string()));
  }
  return sim::Recording::decode(*bytes);
}

}  // namespace traceur::cli
