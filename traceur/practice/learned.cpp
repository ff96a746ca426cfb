#include "traceur/practice/learned.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "traceur/control/signals.h"
#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/practice/search.h"
#include "traceur/skill/skill_problem.h"

namespace traceur::practice {

using skill::Measure;
using skill::Rollout;
using skill::Skill;

namespace {

/// As the file says, or else as the signal has it.
std::string unitOf(const Measure& m, const control::Signals& signals) {
  if (!m.unit.empty()) return m.unit;
  std::string unit = signals.unitOf(m.of);
  if (m.take != Measure::Take::kIntegral) return unit;
  if (m.of == "1") return "s";
  if (!unit.empty()) unit += "·s";
  return unit;
}

}  // namespace

std::optional<bool> reached(const skill::Task& task, double asked, const Rollout& r) {
  if (task.achieved.empty()) return std::nullopt;
  return !r.failed() && std::abs(r.achieved - asked) <= task.tolerance;
}

std::vector<Quantity> objectivesOf(const Skill& skill, const Rollout& r) {
  std::vector<Quantity> all;
  for (size_t i = 0; i < skill.terms.size(); ++i) {
    all.push_back({skill.terms[i].name, r.terms[i], ""});
  }
  return all;
}

std::vector<Quantity> measuresOf(const Skill& skill, const Rollout& r) {
  const control::Signals signals(skill.model);
  std::vector<Quantity> all;
  for (size_t i = 0; i < skill.measures.size(); ++i) {
    const Measure& m = skill.measures[i];
    all.push_back({m.name, r.measures[i], unitOf(m, signals)});
  }
  return all;
}

Rollout LearnedSkill::perform(sim::Recording* recording) const {
  skill::Runner runner(skill);
  runner.under(conditions);
  return runner.run(parameters, task, recording);
}

LearnedSkill LearnedFamily::at(double task) const {
  const double first = tasks[0];
  const double last = tasks[tasks.size() - 1];
  if (!(task >= first && task <= last)) {
    throw InputError(fmt::format("task {} {}: this family was learned for {} to {}", task,
                                 skill->task.unit, first, last));
  }
  // Between two tasks a curve may leave the box; folded ones cannot.
  return {skill, task,
          family.curve.at((task - first) / (last - first))
              .cwiseMax(lowerOf(skill->parameters))
              .cwiseMin(upperOf(skill->parameters))};
}

std::uint64_t partsOf(const Skill& skill) {
  if (skill.parts.empty() && !skill.after && skill.like.empty()) return 0;
  Hash hash;
  if (!skill.like.empty()) hash.add(skill.like);
  const auto add = [&](const skill::Part& part) {
    hash.add(part.skill->text);
    for (const std::string& value : part.parameters) hash.add(value + "\n");  // some are a run's
    hash.add(part.task);
    hash.add(fmt::format("{:016x}", partsOf(*part.skill)));
  };
  for (const skill::Part& part : skill.parts) add(part);
  if (skill.after) add(*skill.after);
  return hash.value();
}

std::shared_ptr<const Skill> skillOf(const Run& run) {
  if (!run.meta().skill) throw InputError(run.name() + ": not a run of traceur learn");
  const SkillInRun& s = *run.meta().skill;
  auto skill = skill::underGiven(Skill::fromText(s.text, s.file), run.meta().search.given);
  if (partsOf(*skill) != s.parts) {
    throw InputError(
        fmt::format("{}: a skill that {} is made of has changed since", run.name(), s.name));
  }
  // Prints of different engines cannot be compared; what was learned may still be tried.
  const bool comparable = s.engine == sim::engineVersion();
  if (!comparable || skill->model->fingerprint() == s.robot) return skill;
  throw InputError(
      fmt::format("{}: learned with another robot: the {} found from {} has changed since",
                  run.name(), skill->model->robot() ? skill->model->robot()->name : "one", s.file));
}

LearnedFamily learnedFamily(const Run& run) {
  if (!run.isFamily() || !run.meta().skill) {
    throw InputError(
        fmt::format("{}: not a family of a skill; learn one with traceur learn SKILL --tasks "
                    "FIRST:LAST:COUNT",
                    run.name()));
  }
  auto found = run.family();
  if (!found) throw InputError(fmt::format("{}: no curve has been run yet", run.name()));
  LearnedFamily f{skillOf(run), run.meta().search.tasks, std::move(found->first)};
  const auto n = static_cast<Eigen::Index>(f.skill->parameters.size());
  if (f.family.curve.points.rows() != n) {
    throw InputError(fmt::format(
        "{}: not a run file of this version: its family has {} parameters, its skill {}",
        run.name(), f.family.curve.points.rows(), n));
  }
  if (found->second) {
    f.family.curve.bounds = optim::BoundFold(lowerOf(f.skill->parameters),
                                             upperOf(f.skill->parameters), VectorXd::Ones(n));
  }
  return f;
}

LearnedSkill learnedSkill(const Run& run, std::optional<double> task) {
  if (run.isFamily()) {
    const LearnedFamily f = learnedFamily(run);
    if (!task) throw InputError(fmt::format("{}: a family: expected --task", run.name()));
    return f.at(*task);
  }
  LearnedSkill l{skillOf(run), run.meta().skill->task, {}};
  if (task && *task != l.task) {
    throw InputError(fmt::format("task {}: {} was learned for {} {} alone", *task, run.name(),
                                 l.task, l.skill->task.unit));
  }
  const optim::Progress p = run.progress();
  if (!p.best) throw InputError(run.name() + ": nothing has been learned yet");
  l.parameters = p.best->x;
  return l;
}

namespace {

const TomlValue* inTable(const TomlValue* table, std::string_view key) {
  if (!table || !table->isTable()) return nullptr;
  const auto at = table->table().find(key);
  return at == table->table().end() ? nullptr : &at->second;
}

/// Puts rows first under a heading of a TOML text, which gets one where it has none.
void addTo(std::string& text, std::string_view heading, const std::string& rows) {
  const std::string begin = fmt::format("\n{}", heading);
  const size_t at = text.find(begin);
  if (at == std::string::npos) {
    text += fmt::format("\n{}\n{}", heading, rows);
    return;
  }
  const size_t end = std::min(text.find('\n', at + begin.size()), text.size());
  text.insert(end, "\n" + rows.substr(0, rows.size() - 1));
}

}  // namespace

std::string withLearned(const Run& run, std::optional<double> task, const std::string& text,
                        const std::string& file, int digits) {
  const LearnedSkill learned = learnedSkill(run, task);
  const ParamSpecs& parameters = learned.skill->parameters;
  const TomlValue document = parseToml(text, file);
  std::vector<TomlNumber> numbers;
  std::string more;  // that a skill which is like another says anew
  for (const int i : namedBy(run.meta().search.only, parameters)) {
    const std::string value = fmt::format("{:.{}g}", learned.parameters[i], digits);
    const ParamSpec& p = parameters[i];
    const double number = std::clamp(toNumber(value, p.name), p.min, p.max);
    const TomlValue* said = inTable(inTable(&document, "parameters"), p.name);
    if (!said && inTable(&document, "like")) {
      more += fmt::format("{} = {}\n", p.name, number);
    } else if (said && said->isNumber()) {
      numbers.push_back({{"parameters", p.name}, number});
    } else {
      numbers.push_back({{"parameters", p.name, "initial"}, number});
    }
  }
  std::string with = withNumbers(text, file, numbers);
  if (!more.empty()) addTo(with, "[parameters]", more);
  Skill::fromText(with, file);
  return with;
}

sim::Recording recordingOf(const Run& run, std::optional<double> task) {
  if (!task) return run.recording();
  sim::Recording recording;
  learnedFamily(run).at(*task).perform(&recording);
  return recording;
}

Beginning beginningFrom(const Run& run, const ParamSpecs& parameters, double task) {
  VectorXd x;
  if (run.isFamily()) {
    const LearnedFamily f = learnedFamily(run);
    x = f.at(std::clamp(task, f.tasks[0], f.tasks[f.tasks.size() - 1])).parameters;
  } else if (const auto best = run.progress().best) {
    x = best->x;
  } else {
    throw InputError(
        fmt::format("{}: no trial of it gave a cost: nothing to begin from", run.name()));
  }
  const ParamSpecs& theirs = run.meta().parameters;
  Beginning b{parameters, {}, {}};
  for (ParamSpec& p : b.parameters) {
    const auto found = std::find_if(theirs.begin(), theirs.end(),
                                    [&](const ParamSpec& t) { return t.name == p.name; });
    if (found == theirs.end() || found - theirs.begin() >= x.size()) continue;
    if (found->unit != p.unit) {
      throw InputError(fmt::format("{}: its {} is in \"{}\", here it is in \"{}\"", run.name(),
                                   p.name, found->unit, p.unit));
    }
    const double value = x[found - theirs.begin()];
    p.initial = std::clamp(value, p.min, p.max);
    b.taken.push_back(p.name);
    if (p.initial != value) b.moved.push_back(p.name);
  }
  if (!b.taken.empty()) return b;
  throw InputError(fmt::format("{}: knows none of the parameters here, {}: it has {}", run.name(),
                               join(namesWithUnits(parameters)), join(namesWithUnits(theirs))));
}

}  // namespace traceur::practice
