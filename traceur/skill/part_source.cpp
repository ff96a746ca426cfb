#include "traceur/skill/part_source.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "traceur/core/error.h"
#include "traceur/core/run_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/optim/problem.h"

namespace traceur::skill {
namespace {

/// The best trial's numbers; empty without one.
std::vector<double> bestOf(const RunFile& run) {
  if (const auto row = run.meta("favourite")) {  // of drawn conditions: none of the trials
    try {
      return nlohmann::json::parse(*row).at("x").get<std::vector<double>>();
    } catch (const std::exception& e) {
      throw InputError(
          fmt::format("{}: its favourite cannot be read: {}", run.path().string(), e.what()));
    }
  }
  std::vector<double> best;
  optim::Evaluation least;
  for (const TrialRow& row : run.trials()) {
    optim::Evaluation e;
    e.cost = row.cost;
    e.failed = row.failed;
    e.violated = {!row.violated.empty()};
    if (!e.meaningful() || (!best.empty() && !optim::better(e, least))) continue;
    best = row.x;
    least = e;
  }
  return best;
}

}  // namespace

PartSource PartSource::fromFile(const std::filesystem::path& file) {
  if (file.extension() != ".run") return {readFile(file), file, {}, {}};
  const RunFile run = RunFile::open(file, false);
  const auto text = run.meta("skill_text");
  const auto task = parseNumber(run.meta("task").value_or(""));
  if (!text || !run.meta("tasks").value_or("").empty()) {
    throw InputError(fmt::format("{}: expected the run of one task of a skill", file.string()));
  }
  PartSource source{*text, run.meta("skill_file").value_or(""), bestOf(run), task};
  if (source.learned.empty()) {
    throw InputError(
        fmt::format("{}: none of its trials gave a cost: there is nothing to begin "
                    "from",
                    file.string()));
  }
  return source;
}

}  // namespace traceur::skill
