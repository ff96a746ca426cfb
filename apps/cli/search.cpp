#include "apps/cli/search.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "apps/cli/arguments.h"
#include "apps/cli/family_run.h"
#include "apps/cli/progress.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/all.h"

namespace traceur::cli {
namespace {

/// A stored trial, and which of these constraints it violated.
optim::Trial toTrial(const TrialRow& row, std::span<const std::string> constraints) {
  optim::Trial trial;
  trial.x =
      Eigen::Map<const Eigen::VectorXd>(row.x.data(), static_cast<Eigen::Index>(row.x.size()));
  trial.evaluation.cost = row.cost;
  trial.evaluation.failed = row.failed;
  for (const std::string& name : constraints) {
    trial.evaluation.violated.push_back(violates(row, name));
  }
  return trial;
}

std::vector<TrialRow> rowsOf(const std::vector<optim::Trial>& trials, int generation,
                             const std::vector<std::string>& constraints) {
  std::vector<TrialRow> rows;
  for (const optim::Trial& t : trials) {
    std::vector<std::string> violated;
    for (size_t i = 0; i < t.evaluation.violated.size(); ++i) {
      if (t.evaluation.violated[i]) violated.push_back(constraints[i]);
    }
    rows.push_back({generation,
                    static_cast<int>(rows.size()),
                    t.evaluation.cost,
                    t.evaluation.failed,
                    join(violated, ","),
                    {t.x.data(), t.x.data() + t.x.size()}});
  }
  return rows;
}

std::string note(const optim::Progress& p) {
  if (!p.best) return "";
  std::string text = fmt::format("best {:.3g}", p.best->evaluation.cost);
  if (!p.best->evaluation.feasible()) text += " (failing)";
  if (p.failed > 0) text += fmt::format("  {} without a cost", p.failed);
  return text;
}

/// What each task costs on the best curve, while there is room; else their mean and the worst.
std::string note(const optim::Family& family) {
  static constexpr size_t kRoom = 8;
  std::string text = fmt::format("mean {:.2g}, tasks", family.cost);
  if (family.task_costs.size() > kRoom) {
    return fmt::format("mean {:.2g}, worst task {:.2g}", family.cost,
                       *std::max_element(family.task_costs.begin(), family.task_costs.end()));
  }
  for (const double cost : family.task_costs) text += fmt::format(" {:.1g}", cost);
  return text;
}

/// @throws InputError naming the first option that differs from the stored one
void requireSameOptions(const RunFile& run, const RunFile::Meta& asked) {
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  for (const auto& [key, value] : asked) {
    const std::string stored = required(run, key);
    if (stored == value) continue;
    const std::string where = run.path().string();
    if (key == "budget") {
      if (toNumber(value, "budget") >= toNumber(stored, where + ": budget")) continue;
      throw InputError(
          fmt::format("{}: budget {} is less than the {} it began with", where, value, stored));
    }
    if (key == "skill_file") continue;  // the text counts, wherever it lies
    if (key == "tasks" && !stored.empty() && !value.empty() &&
        tasksText(toTasks(stored, where + ": tasks")) == value) {
      continue;  // however the person wrote them
    }
    const bool is_text = key == "skill_text" || key == "model";
    throw InputError(
        fmt::format("{}: cannot be resumed with another {}{}", where, key,
                    is_text ? ": the skill or robot file has changed since it began"
                            : fmt::format(": it has {}, got {}", or_none(stored), or_none(value))));
  }
}

}  // namespace

RunFile openRun(const std::string& file, const RunFile::Meta& meta, bool resume) {
  bool exists = std::filesystem::exists(file);
  if (exists && resume && RunFile::neverBegan(file)) {
    std::filesystem::remove(file);
    exists = false;
  }
  if (!exists) return RunFile::create(file, meta);
  if (!resume) {
    throw InputError(fmt::format(
        "{}: exists already: --resume goes on with it, --out FILE writes elsewhere", file));
  }
  RunFile run = RunFile::open(file, true);
  requireSameOptions(run, meta);
  run.setMeta({{"budget", meta.at("budget")}});
  return run;
}

optim::Summary search(RunFile& run, const optim::Problem& problem, optim::Optimizer& optimiser,
                      const SearchOptions& o) {
  const std::vector<std::string> constraints = problem.constraints();
  const bool families = problem.tasks().size() > 0;
  const optim::Progress start = progressOf(run, constraints);
  if (const auto state = run.state()) {
    try {
      optimiser.restore(*state);
    } catch (const InputError& e) {  // the person's options are the same
      const bool taught = !run.meta("experience").value_or("").empty();
      throw InputError(fmt::format(
          "{}: cannot be resumed: {}it was made by another version: {}", run.path().string(),
          taught ? "the run given as --experience has changed since, or " : "", e.what()));
    }
  }
  ProgressLine line(o.title, o.budget, start.evaluations, o.quiet);
  optim::MinimiseOptions options;
  options.threads = o.threads;
  options.budget = o.budget;
  options.target = o.target;
  options.stop = o.stop;
  options.on_broken = o.on_broken;
  bool of_use = start.evaluations > 0;
  bool forgot = false;
  // How the best curve's cost fell: "trials:cost trials:cost …".
  std::string family_costs = run.meta("family_costs").value_or("");
  double family_cost = family_costs.empty()
                           ? std::numeric_limits<double>::infinity()
                           : toNumber(family_costs.substr(family_costs.rfind(':') + 1),
                                      run.path().string() + ": family_costs");
  options.on_generation = [&](const optim::Generation& g) {
    of_use = of_use || g.progress.failed < g.progress.evaluations;
    // What was found before is no longer the outcome.
    if (!std::exchange(forgot, true)) run.forget({"best"}, outcomeKeys());
    RunFile::Meta progress;
    const std::optional<optim::Family> best = g.optimizer.family();
    if (best) progress["family"] = toText(*best);
    if (best && best->cost < family_cost) {
      family_cost = best->cost;
      family_costs += fmt::format("{}{}:{}", family_costs.empty() ? "" : " ",
                                  g.progress.evaluations, family_cost);
      progress["family_costs"] = family_costs;
    }
    run.appendGeneration(g.progress.generation - 1,
                         rowsOf(g.trials, g.progress.generation - 1, constraints),
                         g.optimizer.save(), progress);
    line.update(g.progress.evaluations,
                best       ? note(*best)
                : families ? "no curve has been run yet"
                           : note(g.progress),
                "trials/s");
  };
  try {
    return optim::minimise(problem, optimiser, options, start);
  } catch (...) {
    if (!of_use) std::filesystem::remove(run.path());
    throw;
  }
}

bool violates(const TrialRow& row, const std::string& name) {
  const std::vector<std::string> names = split(row.violated, ',');
  return std::find(names.begin(), names.end(), name) != names.end();
}

optim::Progress progressOf(const RunFile& run, const std::vector<std::string>& constraints) {
  optim::Progress p;
  for (const TrialRow& row : run.trials()) {
    optim::Trial trial = toTrial(row, constraints);
    ++p.evaluations;
    p.failed += row.failed;
    p.generation = row.generation + 1;
    if (!trial.evaluation.meaningful()) continue;
    if (!p.best || optim::better(trial.evaluation, p.best->evaluation)) p.best = trial;
  }
  return p;
}

std::vector<optim::Trial> experienceOf(const std::string& file, const std::string& optimiser,
                                       const std::string& parameters,
                                       const std::vector<std::string>& constraints) {
  std::vector<optim::Trial> trials;
  if (file.empty()) return trials;
  if (!optim::findOptimizer(optimiser).learns_from_experience) {
    std::vector<std::string> names;
    for (const optim::OptimizerEntry& entry : optim::allOptimizers()) {
      if (entry.learns_from_experience) names.push_back(entry.name);
    }
    throw InputError(fmt::format("--experience: {} does not learn from it: expected --optimiser {}",
                                 optimiser, join(names, " or ")));
  }
  const RunFile run = RunFile::open(file, false);
  if (const std::string theirs = required(run, "parameters"); theirs != parameters) {
    throw InputError(fmt::format("{}: expected a run of the same parameters, {}, got one of {}",
                                 file, parameters, theirs));
  }
  const std::string names = ", " + required(run, "constraints") + ", ";
  size_t known = 0;
  while (known < constraints.size() &&
         names.find(", " + constraints[known] + ", ") != std::string::npos) {
    ++known;
  }
  if (known == 0) {
    throw InputError(fmt::format("{}: knows nothing of the first constraint here: it has {}", file,
                                 required(run, "constraints")));
  }
  for (const TrialRow& row : run.trials()) {
    trials.push_back(toTrial(row, std::span(constraints).first(known)));
  }
  return trials;
}

const std::vector<std::string>& outcomeKeys() {
  static const std::vector<std::string> kKeys = {"stop", "achieved", "ended", "hash"};
  return kKeys;
}

std::string required(const RunFile& run, const std::string& key) {
  const auto value = run.meta(key);
  if (!value) {
    throw InputError(fmt::format("{}: this run does not say its \"{}\"", run.path().string(), key));
  }
  return *value;
}

std::string words(const optim::Stop& stop) {
  return fmt::format("{} ({:g}, limit {:g})", stop.reason, stop.value, stop.limit);
}

}  // namespace traceur::cli
