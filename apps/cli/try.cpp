// traceur try: run a skill once, as it stands.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/pictures.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/practice/learn.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using practice::LearnedSkill;
using skill::Skill;

struct TryArguments {
  std::string skill_file;
  std::vector<std::string> values;
  std::vector<std::string> given;
  std::optional<double> task;
  std::vector<std::string> files;
  bool json = false;
};

/// The rows' initial numbers, but for those of NAME=VALUE.
Eigen::VectorXd numbersOf(const Numbers& numbers, const char* option,
                          const std::vector<std::string>& values) {
  Eigen::VectorXd x = initialOf(numbers.rows);
  for (const std::string& text : values) assign(x, numbers, text, option);
  return x;
}

void printAll(const char* title, const nlohmann::ordered_json& values) {
  if (values.empty()) return;
  print("{}\n", title);
  for (const auto& [name, value] : values.items()) {
    print("  {:<24} {}\n", name, value.is_null() ? "-" : value.dump());
  }
}

void report(const TryArguments& a, const LearnedSkill& what, const Performance& p) {
  const Skill& skill = *what.skill;
  const auto objectives = toJson(practice::objectivesOf(skill, p.rollout));
  const auto measures = toJson(practice::measuresOf(skill, p.rollout));
  const auto parameters = toJson(skill.parameters, what.parameters);
  if (a.json) {
    nlohmann::ordered_json j{{"skill", skill.name}};
    j.update(toJson(p, skill.task));
    j["unit"] = skill.task.unit;
    j["reached"] = boolOrNull(p.reached(skill.task));
    j["time"] = p.rollout.time;
    j["objectives"] = objectives;
    j["measures"] = measures;
    j["parameters"] = parameters;
    j["hash"] = fmt::format("{:016x}", p.rollout.hash);
    if (!a.files.empty()) j["files"] = a.files;
    printJson(j);
    return;
  }
  print("{}: {}\n", skill.name, toText(p, skill.task));
  print("ended            {} after {:g} s\ncost             {:g}\n", p.rollout.ended,
        p.rollout.time, p.rollout.cost);
  printAll("objectives", objectives);
  printAll("measures", measures);
  printAll("parameters", parameters);
  for (const std::string& file : a.files) print("{}\n", file);
}

int trySkill(const TryArguments& a) {
  Interrupt interrupt;  // before any other thread
  const std::shared_ptr<const Skill> skill = Skill::fromFile(a.skill_file);
  const LearnedSkill what{
      skill, a.task.value_or(skill->task.initial),
      numbersOf({skill->parameters, "parameter", skill->name}, "--set", a.values),
      numbersOf({skill->conditions, "condition", skill->name}, "--given", a.given)};
  practice::requireInRange(*skill, what.task);
  for (const fs::path file : a.files) {
    if (file.extension() != ".run") requirePicture(file);
  }
  sim::Recording recording;
  const Performance p{what.task, what.perform(&recording)};
  for (const fs::path file : a.files) {
    if (file.extension() == ".run") {
      practice::keep(what, p.rollout, recording, file);
    } else if (!draw(recording, file, {}, interrupt, a.json)) {
      return kInterrupted;
    }
  }
  report(a, what, p);
  return p.rollout.failed() ? kFailed : exitCode(p.reached(skill->task));
}

}  // namespace

void addTry(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<TryArguments>();
  CLI::App* verb = program.add_subcommand(
      "try", "Run a skill once, unpractised: what each objective and measure says of it.");
  verb->add_option("SKILL", a->skill_file, "Skill file (TOML)")->required();
  verb->add_option("--set", a->values,
                   "NAME=VALUE: a parameter, in its own unit; the others are the file's initial")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--given", a->given,
                   "NAME=VALUE: a condition, in its own unit; the others are the file's default")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--task", a->task,
                   "What to ask for, in the skill's own unit; default: the file's");
  verb->add_option("--out", a->files,
                   "Where to: .png for a film strip, .mp4 for a video, .run for a run file of this "
                   "one trial. One for each")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_flag("--json", a->json, "Print one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur try skills/bioloid-gp/jump.toml\n"
      "  traceur try skills/bioloid-gp/jump.toml --set crouch_hip=0.9 --out try.png\n"
      "  traceur try skills/bioloid-gp/jump.toml --task 0.07 --out try.run\n"
      "Exit code: 0 done, 1 the trial fails, 2 wrong use, 3 it does not reach the task.");
  verb->callback([a, &exit_code] { exit_code = trySkill(*a); });
}

}  // namespace traceur::cli
