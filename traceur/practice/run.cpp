#include "traceur/practice/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string_view>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/core/text.h"
#include "traceur/practice/tasks.h"

namespace traceur::practice {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The rows of meta, read with messages that name the file and the row.
class Rows {
 public:
  explicit Rows(const RunFile& run) : run_(&run) {}

  std::string text(const std::string& key) const {
    const auto value = run_->meta(key);
    if (value) return *value;
    throw InputError(fmt::format("{}: this run does not say its \"{}\"", name(), key));
  }
  std::string textOr(const std::string& key, const std::string& otherwise) const {
    return run_->meta(key).value_or(otherwise);
  }
  double number(const std::string& key) const { return toNumber(text(key), where(key)); }
  int whole(const std::string& key) const {  // ≥ 0
    return static_cast<int>(wholeBelow(key, 10, std::numeric_limits<int>::max()));
  }
  std::uint64_t count(const std::string& key) const { return wholeBelow(key, 10, UINT64_MAX); }
  std::uint64_t print(const std::string& key) const { return wholeBelow(key, 16, UINT64_MAX); }
  /// What read makes of the row's JSON.
  template <class Read>
  auto json(const std::string& key, const std::string& text, const Read& read) const {
    try {
      return read(Json::parse(text));
    } catch (const std::exception& e) {
      std::string_view why = e.what();
      if (why.starts_with("[json.")) why.remove_prefix(std::min(why.find("] ") + 2, why.size()));
      throw InputError(fmt::format("{}: not a run file of this version: its {} cannot be read: {}",
                                   name(), key, why));
    }
  }
  std::string where(const std::string& key) const { return name() + ": " + key; }

 private:
  std::uint64_t wholeBelow(const std::string& key, int base, std::uint64_t most) const {
    const std::string t = text(key);
    const char* end = t.data() + t.size();
    std::uint64_t value = 0;
    const auto read = std::from_chars(t.data(), end, value, base);
    if (read.ec == std::errc() && read.ptr == end && value <= most) return value;
    throw InputError(fmt::format("{}: \"{}\" is not a number in [0, {}]", where(key), t, most));
  }
  std::string name() const { return run_->path().string(); }

  const RunFile* run_;
};

/// JSON has no number for these.
Json numberOrNull(double x) {
  return std::isfinite(x) ? Json(x) : Json();
}

double numberOr(const Json& j, double otherwise) {
  return j.is_null() ? otherwise : j.get<double>();
}

std::string parametersRow(const ParamSpecs& parameters) {
  Json all = Json::array();
  for (const ParamSpec& p : parameters) {
    all.push_back({{"name", p.name},
                   {"unit", p.unit},
                   {"min", numberOrNull(p.min)},
                   {"max", numberOrNull(p.max)},
                   {"initial", numberOrNull(p.initial)}});
  }
  return all.dump();
}

ParamSpecs parametersOf(const Rows& rows) {
  const std::string row = rows.text("parameters");
  ParamSpecs all;
  if (row.starts_with('[')) {
    return rows.json("parameters", row, [&](const Json& j) {
      for (const Json& p : j) {
        all.push_back({p.at("name").get<std::string>(), p.at("unit").get<std::string>(),
                       numberOr(p.at("min"), -kInfinity), numberOr(p.at("max"), kInfinity),
                       numberOr(p.at("initial"), kNone), ""});
      }
      return all;
    });
  }
  // Of files of before: "crouch [rad], push [N]", or without units.
  for (size_t from = 0; from < row.size();) {
    const size_t to = std::min(row.find(", ", from), row.size());
    const std::string one = row.substr(from, to - from);
    const size_t unit = one.ends_with(']') ? one.rfind(" [") : std::string::npos;
    const bool has = unit != std::string::npos;
    all.push_back({one.substr(0, unit), has ? one.substr(unit + 2, one.size() - unit - 3) : "",
                   -kInfinity, kInfinity, kNone, ""});
    from = to + 2;
  }
  return all;
}

std::vector<std::string> namesIn(const std::string& list) {
  std::vector<std::string> names = split(list, ',');
  for (std::string& name : names) name.erase(0, name.find_first_not_of(' '));
  return names;
}

RunFile::Meta toRows(const RunMeta& m) {
  const SearchOptions& s = m.search;
  RunFile::Meta rows{{"traceur", m.traceur},
                     {"parameters", parametersRow(m.parameters)},
                     {"constraints", join(m.constraints)},
                     {"seed", fmt::format("{}", s.seed)},
                     {"budget", fmt::format("{}", s.budget)},
                     {"optimiser", s.optimiser},
                     {"population", fmt::format("{}", s.population)},
                     {"step_size", fmt::format("{}", s.step_size)},
                     {"tasks", tasksText(s.tasks)},
                     {"curve", s.curve},
                     {"experience", s.experience},
                     {"from", s.from},
                     {"only", join(s.only)},
                     {"given", join(s.given)},
                     {"draws", fmt::format("{}", s.draws)}};
  if (m.skill) {
    rows.insert({{"verb", "learn"},
                 {"engine", m.skill->engine},
                 {"skill", m.skill->name},
                 {"skill_file", m.skill->file},
                 {"skill_text", m.skill->text},
                 {"model", fmt::format("{:016x}", m.skill->robot)},
                 {"parts", fmt::format("{:016x}", m.skill->parts)},
                 {"task", fmt::format("{}", m.skill->task)},
                 {"task_unit", m.skill->task_unit}});
  } else {
    rows.insert({{"verb", "minimise"},
                 {"command", m.command->command},
                 {"variables", m.command->variables}});
  }
  return rows;
}

RunMeta metaOf(const RunFile& run) {
  const Rows rows(run);
  RunMeta m;
  m.traceur = rows.text("traceur");
  m.parameters = parametersOf(rows);
  m.constraints = namesIn(rows.text("constraints"));
  const std::string tasks = rows.textOr("tasks", "");
  m.search = {.seed = rows.count("seed"),
              .budget = rows.whole("budget"),
              .optimiser = rows.text("optimiser"),
              .population = rows.whole("population"),
              .step_size = rows.number("step_size"),
              .tasks = tasks.empty() ? VectorXd() : toTasks(tasks, rows.where("tasks")),
              .curve = rows.textOr("curve", ""),
              .experience = rows.textOr("experience", ""),
              .from = rows.textOr("from", ""),
              .only = namesIn(rows.textOr("only", "")),
              .given = namesIn(rows.textOr("given", "")),
              .draws = run.meta("draws") ? rows.whole("draws") : 0};
  if (run.meta("skill_text")) {
    m.skill = {.name = rows.text("skill"),
               .file = rows.text("skill_file"),
               .text = rows.text("skill_text"),
               .robot = rows.print("model"),
               .parts = run.meta("parts") ? rows.print("parts") : 0,
               .engine = rows.text("engine"),
               .task = rows.number("task"),
               .task_unit = rows.text("task_unit")};
  } else {
    m.command = {.command = rows.text("command"), .variables = rows.text("variables")};
  }
  return m;
}

/// Whether bounds or beginnings, where both are known, are the same.
bool equalNumbers(const ParamSpec& a, const ParamSpec& b) {
  if (std::isnan(a.initial) || std::isnan(b.initial)) return true;  // of a file of before
  return a.min == b.min && a.max == b.max && a.initial == b.initial;
}

void requireSameParameters(const std::string& where, const RunMeta& stored, const RunMeta& asked) {
  const ParamSpecs& a = stored.parameters;
  const ParamSpecs& b = asked.parameters;
  const auto same = [](const ParamSpec& p, const ParamSpec& q) {
    return p.name == q.name && p.unit == q.unit;
  };
  if (!std::equal(a.begin(), a.end(), b.begin(), b.end(), same)) {
    throw InputError(fmt::format("{}: cannot be resumed with other parameters: it has {}, got {}",
                                 where, join(namesWithUnits(a)), join(namesWithUnits(b))));
  }
  if (!std::equal(a.begin(), a.end(), b.begin(), b.end(), equalNumbers)) {
    throw InputError(fmt::format(
        "{}: cannot be resumed with other bounds or beginnings of its parameters{}", where,
        asked.search.from.empty() ? "" : ": the run it began from has changed since"));
  }
}

/// @throws InputError naming the first option that differs from the stored one
void requireSameOptions(const RunFile& run, const RunMeta& stored, const RunMeta& asked) {
  const std::string where = run.path().string();
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  if (asked.search.budget < stored.search.budget) {
    throw InputError(fmt::format("{}: budget {} is less than the {} it began with", where,
                                 asked.search.budget, stored.search.budget));
  }
  RunFile::Meta before = toRows(stored);
  for (const auto& [key, value] : toRows(asked)) {
    // The skill's text counts, wherever it lies.
    if (key == "budget" || key == "skill_file" || key == "parameters") continue;
    if (before[key] == value) continue;
    const bool is_text = key == "skill_text" || key == "model" || key == "parts";
    throw InputError(fmt::format(
        "{}: cannot be resumed with another {}{}", where, key,
        is_text ? ": the skill or robot file has changed since it began"
                : fmt::format(": it has {}, got {}", or_none(before[key]), or_none(value))));
  }
  requireSameParameters(where, stored, asked);
}

Json toJson(const std::vector<Quantity>& quantities) {
  Json all = Json::array();
  for (const Quantity& q : quantities) {
    all.push_back({{"name", q.name}, {"value", numberOrNull(q.value)}, {"unit", q.unit}});
  }
  return all;
}

std::vector<Quantity> quantitiesOf(const Rows& rows, const std::string& key) {
  return rows.json(key, rows.textOr(key, "[]"), [](const Json& j) {
    std::vector<Quantity> all;
    for (const Json& q : j) {
      all.push_back({q.at("name").get<std::string>(), numberOr(q.at("value"), kNone),
                     q.at("unit").get<std::string>()});
    }
    return all;
  });
}

/// The rows of an outcome; the first generation after them makes them outdated.
const std::vector<std::string>& outcomeKeys() {
  static const std::vector<std::string> kKeys = {"stop",    "achieved",   "ended",   "hash",
                                                 "reached", "objectives", "measures"};
  return kKeys;
}

}  // namespace

std::vector<std::string> namesWithUnits(const ParamSpecs& parameters) {
  std::vector<std::string> names;
  for (const ParamSpec& p : parameters) {
    names.push_back(p.unit.empty() ? p.name : fmt::format("{} [{}]", p.name, p.unit));
  }
  return names;
}

std::string words(const optim::Stop& stop) {
  return fmt::format("{} ({:g}, limit {:g})", stop.reason, stop.value, stop.limit);
}

Run Run::begin(const std::filesystem::path& file, const RunMeta& meta, bool resume) {
  RunMeta asked = meta;
  asked.traceur = TRACEUR_VERSION;
  bool exists = std::filesystem::exists(file);
  if (exists && resume && RunFile::neverBegan(file)) {
    std::filesystem::remove(file);
    exists = false;
  }
  if (!exists) return {RunFile::create(file, toRows(asked)), asked};
  if (!resume) {
    throw InputError(
        fmt::format("{}: exists already: --resume goes on with it, --out FILE writes elsewhere",
                    file.string()));
  }
  RunFile run = RunFile::open(file, true);
  RunMeta stored = metaOf(run);
  requireSameOptions(run, stored, asked);
  stored.search.budget = asked.search.budget;
  run.setMeta({{"budget", fmt::format("{}", asked.search.budget)}});
  return {std::move(run), std::move(stored)};
}

Run Run::open(const std::filesystem::path& file) {
  RunFile run = RunFile::open(file, false);
  RunMeta meta = metaOf(run);
  return {std::move(run), std::move(meta)};
}

std::vector<optim::Trial> Run::trials() const {
  std::vector<optim::Trial> trials;
  for (const TrialRow& row : file_.trials()) {
    const std::vector<std::string> violated = split(row.violated, ',');
    optim::Trial trial;
    trial.x = Eigen::Map<const VectorXd>(row.x.data(), static_cast<Eigen::Index>(row.x.size()));
    trial.evaluation.cost = row.cost;
    trial.evaluation.failed = row.failed;
    for (const std::string& name : meta_.constraints) {
      trial.evaluation.violated.push_back(std::find(violated.begin(), violated.end(), name) !=
                                          violated.end());
    }
    trials.push_back(std::move(trial));
  }
  return trials;
}

optim::Progress Run::progress() const {
  optim::Progress p;
  for (const optim::Trial& trial : trials()) {
    ++p.evaluations;
    p.failed += trial.evaluation.failed;
    if (!trial.evaluation.meaningful()) continue;
    if (!p.best || optim::better(trial.evaluation, p.best->evaluation)) p.best = trial;
  }
  if (const auto row = file_.meta("favourite")) {
    p.best = Rows(file_).json("favourite", *row, [&](const Json& j) {
      const auto x = j.at("x").get<std::vector<double>>();
      if (x.size() != meta_.parameters.size()) throw InputError("x of another size");
      optim::Trial best{Eigen::Map<const VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())),
                        {.cost = j.at("cost").get<double>(),
                         .violated = j.at("violated").get<std::vector<bool>>()}};
      if (!best.evaluation.meaningful()) throw InputError("cost is no number");
      return std::optional(std::move(best));
    });
  }
  const std::vector<TrialRow> rows = file_.trials();
  if (!rows.empty()) p.generation = rows.back().generation + 1;
  return p;
}

void Run::append(int generation, std::span<const optim::Trial> trials, std::string_view state,
                 const RunFile::Meta& progress) {
  std::vector<TrialRow> rows;
  for (const optim::Trial& t : trials) {
    std::vector<std::string> violated;
    for (size_t i = 0; i < t.evaluation.violated.size(); ++i) {
      if (t.evaluation.violated[i]) violated.push_back(meta_.constraints[i]);
    }
    rows.push_back({generation,
                    static_cast<int>(rows.size()),
                    t.evaluation.cost,
                    t.evaluation.failed,
                    join(violated, ","),
                    {t.x.data(), t.x.data() + t.x.size()}});
  }
  file_.appendGeneration(generation, rows, state, progress);
}

std::optional<Outcome> Run::outcome() const {
  if (!file_.meta("stop")) return std::nullopt;
  const Rows rows(file_);
  Outcome o{.stop = rows.text("stop"), .ended = rows.textOr("ended", "")};
  if (file_.meta("hash")) o.hash = rows.print("hash");
  if (rows.textOr("achieved", "-") != "-") o.achieved = rows.number("achieved");
  if (const std::string reached = rows.textOr("reached", "-"); reached != "-") {
    o.reached = reached == "yes";
  }
  o.objectives = quantitiesOf(rows, "objectives");
  o.measures = quantitiesOf(rows, "measures");
  return o;
}

void Run::setOutcome(const Outcome& o) {
  RunFile::Meta rows{{"stop", o.stop}, {"reached", o.reached ? (*o.reached ? "yes" : "no") : "-"}};
  if (!o.ended.empty()) {
    rows.insert({{"achieved", o.achieved ? fmt::format("{}", *o.achieved) : "-"},
                 {"ended", o.ended},
                 {"hash", fmt::format("{:016x}", o.hash)},
                 {"objectives", toJson(o.objectives).dump()},
                 {"measures", toJson(o.measures).dump()}});
  }
  file_.setMeta(rows);
}

void Run::forgetOutcome() {
  file_.forget({"best"}, outcomeKeys());
}

sim::Recording Run::recording() const {
  if (const auto bytes = file_.recording("best")) return sim::Recording::decode(*bytes);
  if (!meta_.skill) {
    throw InputError(fmt::format("{}: a search of numbers: there is no motion to look at", name()));
  }
  if (isFamily()) {
    throw InputError(
        fmt::format("{}: a family: expected --task, which of its tasks to look at", name()));
  }
  throw InputError(
      fmt::format("{}: nothing is recorded yet: it was cut off; finish it with "
                  "traceur learn {} --out {} --resume and the same options",
                  name(), meta_.skill->file, name()));
}

// ---- A family: meta "family" is a JSON object with `kind` ("bezier" or "polyline"), `points` (K
// lists of n numbers), `folded` (whether x is the curve folded into the parameters' box, or the
// curve itself), `cost` and `task_costs`; meta "family_costs" is "trials:cost trials:cost …".

RunFile::Meta bestRow(const optim::Trial& best) {
  const Json j{{"x", std::vector<double>(best.x.begin(), best.x.end())},
               {"cost", best.evaluation.cost},
               {"violated", best.evaluation.violated}};
  return {{"favourite", j.dump()}};
}

RunFile::Meta familyRows(const optim::Family& family, const std::vector<FamilyCost>& costs) {
  nlohmann::json j;
  j["kind"] = family.curve.kind == optim::Curve::Kind::kBezier ? "bezier" : "polyline";
  for (const auto& point : family.curve.points.colwise()) {
    j["points"].push_back(std::vector<double>(point.begin(), point.end()));
  }
  j["folded"] = family.curve.bounds.any();
  j["cost"] = family.cost;
  j["task_costs"] = family.task_costs;
  std::string text;
  for (const FamilyCost& c : costs) {
    text += fmt::format("{}{}:{}", text.empty() ? "" : " ", c.trials, c.cost);
  }
  return {{"family", j.dump()}, {"family_costs", text}};
}

std::optional<std::pair<optim::Family, bool>> Run::family() const {
  const auto text = file_.meta("family");
  if (!text) return std::nullopt;
  return Rows(file_).json("family", *text, [&](const Json& j) {
    optim::Family f;
    const auto points = j.at("points").get<std::vector<std::vector<double>>>();
    if (points.empty() || points[0].empty()) throw InputError("no points");
    Eigen::MatrixXd& m = f.curve.points;
    m.resize(static_cast<Eigen::Index>(points[0].size()), static_cast<Eigen::Index>(points.size()));
    for (Eigen::Index k = 0; k < m.cols(); ++k) {
      if (points[k].size() != points[0].size()) throw InputError("points of several sizes");
      m.col(k) = Eigen::Map<const VectorXd>(points[k].data(), m.rows());
    }
    if (!m.allFinite()) throw InputError("points that are not finite");
    const auto kind = j.at("kind").get<std::string>();
    if (kind != "bezier" && kind != "polyline") throw InputError("kind \"" + kind + "\"");
    f.curve.kind = kind == "bezier" ? optim::Curve::Kind::kBezier : optim::Curve::Kind::kPolyline;
    f.cost = numberOr(j.at("cost"), kNone);
    for (const Json& cost : j.at("task_costs")) f.task_costs.push_back(numberOr(cost, kNone));
    if (static_cast<Eigen::Index>(f.task_costs.size()) != meta_.search.tasks.size()) {
      throw InputError("costs of another number of tasks");
    }
    return std::optional(std::pair(std::move(f), j.at("folded").get<bool>()));
  });
}

std::vector<FamilyCost> Run::familyCosts() const {
  const Rows rows(file_);
  const std::string where = rows.where("family_costs");
  std::vector<FamilyCost> costs;
  for (const std::string& point : split(rows.textOr("family_costs", ""), ' ')) {
    const size_t colon = std::min(point.find(':'), point.size());
    const double trials = toNumber(point.substr(0, colon), where);
    if (!(trials >= 0 && trials < 1e9)) {
      throw InputError(fmt::format("{}: \"{}\" is no number of trials", where, point));
    }
    costs.push_back({static_cast<int>(trials),
                     toNumber(point.substr(std::min(colon + 1, point.size())), where)});
  }
  return costs;
}

}  // namespace traceur::practice
