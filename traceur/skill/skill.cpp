#include "traceur/skill/skill.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>

#include "traceur/control/expression.h"
#include "traceur/control/signals.h"
#include "traceur/control/stable_pd.h"
#include "traceur/core/is_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/skill/names.h"

namespace traceur::skill {
namespace {

namespace fs = std::filesystem;

/// Where the installed program's data are; set by CMake.
#ifndef TRACEUR_INSTALLED_DATA
#define TRACEUR_INSTALLED_DATA ""
#endif
/// The same from where the program is, as the installation may have been moved; set by CMake.
#ifndef TRACEUR_DATA_FROM_PROGRAM
#define TRACEUR_DATA_FROM_PROGRAM ""
#endif

std::vector<fs::path> modelFolders(const fs::path& beside) {
  std::vector<fs::path> folders;
  // "jump.toml" lies beside nothing: in the working folder.
  for (fs::path dir = fs::absolute(beside.empty() ? "." : beside).lexically_normal();
       dir.has_relative_path(); dir = dir.parent_path()) {
    folders.push_back(dir / "models");
  }
  if (const char* data = std::getenv("TRACEUR_DATA")) folders.push_back(fs::path(data) / "models");
  folders.push_back(fs::current_path() / "models");
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (const std::string_view way = TRACEUR_DATA_FROM_PROGRAM; !error && !way.empty()) {
    folders.push_back((program.parent_path() / way / "models").lexically_normal());
  }
  folders.push_back(fs::path(TRACEUR_INSTALLED_DATA) / "models");
  return folders;
}

/// Reads one skill file. Mistakes are collected; the model is needed to check names, so a robot
/// that cannot be loaded ends the reading of everything that depends on it.
class SkillReader {
 public:
  SkillReader(const fs::path& file, std::string text, const Disturbance& disturbance)
      : document_(parseToml(text, file.string())), diagnostics_(file.string()) {
    skill_.file = file;
    skill_.disturbance = disturbance;
    skill_.text = std::move(text);
  }

  std::shared_ptr<const Skill> read() {
    const TomlReader top(document_, diagnostics_);
    skill_.name = top.string("name");
    skill_.description = top.string("description", "");
    skill_.horizon = top.number("horizon");
    if (!(skill_.horizon > 0 && skill_.horizon <= kLongest)) {
      top.fail("horizon", fmt::format("\"horizon\": expected seconds in (0, {}]", kLongest));
    }
    skill_.target_cost = top.number("target_cost", skill_.target_cost);
    readTask(top.table("task"));
    readParameters(top.table("parameters"));
    readScene(top);
    if (skill_.model) {
      signals_ = std::make_unique<control::Signals>(skill_.model);
      readStart(top.table("start"));
      readController(top.table("controller"));
      readPhases(top);
      readFeedback(top);
      readMeasures(top.table("measures"));
      readFailures(top);
      readObjective(top);
      skill_.stop = expression(top, "stop", "", Scope::kRunning);
      skill_.task.achieved = expression(top.table("task"), "achieved", "", Scope::kVerdict);
    } else {
      for (const char* key : {"start", "controller", "phase", "feedback", "measures", "failure",
                              "objective", "stop"}) {
        top.find(key);  // cannot be judged without the robot
      }
    }
    top.finish();
    diagnostics_.throwIfAny();
    return std::make_shared<const Skill>(std::move(skill_));
  }

 private:
  /// Longest trial [s]: a mistyped horizon should not run for a day.
  static constexpr double kLongest = 600;
  /// Of parameters, phases and the like, each; of expressions; more would take longer to check than
  /// a person waits, and nobody practises so many [ours].
  static constexpr size_t kMostRows = 500;
  static constexpr int kMostExpressions = 5000;

  /// Ends the reading where there are more rows than anyone writes.
  void limit(const TomlReader& row, std::string_view what, size_t rows) {
    if (rows <= kMostRows) return;
    diagnostics_.add(row.value().line, row.value().column,
                     fmt::format("{} {}: expected at most {}", rows, what, kMostRows));
    diagnostics_.throwIfAny();
  }

  void readTask(const TomlReader& t) {
    Task& task = skill_.task;
    task.name = t.string("name", "task");
    task.unit = t.string("unit", "");
    const std::vector<double> range =
        t.has("range") ? t.numbers("range", 2) : std::vector<double>{0, 0};
    task.min = range[0];
    task.max = range[1];
    task.initial = t.number("default", range[0]);
    // Without it no trial could ever be said to have reached the task.
    task.tolerance = t.has("achieved") ? t.number("tolerance") : t.number("tolerance", 0);
    if (!(task.tolerance >= 0)) t.fail("tolerance", "\"tolerance\": expected a number >= 0");
    if (!(task.min <= task.initial && task.initial <= task.max)) {
      t.fail("default", "\"default\": expected min <= default <= max of \"range\"");
    }
    t.find("achieved");  // read when measures are known
    t.finish();
  }

  void readParameters(const TomlReader& table) {
    limit(table, "parameters", table.names().size());
    for (const std::string& name : table.names()) {  // the order of the optimiser's variables
      const TomlReader row = table.table(name);
      checkName(table, name, name);
      ParamSpec p;
      p.name = name;
      p.unit = row.string("unit", "");
      const std::vector<double> range = row.numbers("range", 2);
      p.min = range[0];
      p.max = range[1];
      p.initial = row.number("initial", (p.min + p.max) / 2);
      p.help = row.string("help", "");
      if (!(p.min < p.max)) {
        row.fail("range", fmt::format("\"{}\": expected a range [min, max] of finite numbers with "
                                      "min < max, got [{}, {}]",
                                      name, p.min, p.max));
      } else if (!(p.min <= p.initial && p.initial <= p.max)) {
        row.fail("initial", fmt::format("\"{}\": initial {} is outside [{}, {}]", name, p.initial,
                                        p.min, p.max));
      }
      row.finish();
      skill_.parameters.push_back(std::move(p));
    }
    if (skill_.parameters.empty()) {
      diagnostics_.add(0, 0, "[parameters]: expected at least one parameter to practise");
    }
  }

  static sim::Material material(const TomlReader& r, double time_step) {
    sim::Material m;
    m.friction = r.number("friction", m.friction);
    m.rolling = r.number("rolling_friction", m.rolling);
    m.compliance = r.number("compliance", m.compliance);
    for (const char* key : {"friction", "rolling_friction"}) {
      if (r.number(key, 0) < 0) r.fail(key, fmt::format("\"{}\": expected a number >= 0", key));
    }
    m.friction = std::max(0.0, m.friction);
    m.rolling = std::max(0.0, m.rolling);
    if (!(m.compliance >= 2 * time_step)) {
      r.fail("compliance",
             fmt::format("\"compliance\" {} s: expected at least twice the time step, "
                         "{} s",
                         m.compliance, 2 * time_step));
      m.compliance = 2 * time_step;  // the rest can still be judged
    }
    return m;
  }

  static Vector3d vector(const TomlReader& r, const char* key) {
    const std::vector<double> v = r.numbers(key, 3);
    return {v[0], v[1], v[2]};
  }

  static double positive(const TomlReader& r, const char* key) {
    const double x = r.number(key);
    if (r.has(key) && !(x > 0)) r.fail(key, fmt::format("\"{}\": expected a number > 0", key));
    return x > 0 ? x : 1;
  }

  /// @return each prop's place in the text
  static std::vector<TomlReader> readProps(const TomlReader& scene, double time_step,
                                           std::vector<sim::Prop>& props) {
    std::vector<TomlReader> rows;
    const auto finish = [&](const TomlReader& r, sim::Prop prop) {
      prop.material = material(r, time_step);
      r.finish();
      props.push_back(std::move(prop));
      rows.push_back(r);
    };
    for (const TomlReader& r : scene.tables("box")) {
      finish(r, {.name = r.string("name"),
                 .shape = sim::Prop::Shape::kBox,
                 .size = vector(r, "size") / 2,
                 .position = vector(r, "at"),
                 .rpy = {0, 0, r.number("yaw", 0)},
                 .mass = r.number("mass", 0)});
    }
    for (const TomlReader& r : scene.tables("ball")) {
      finish(r, {.name = r.string("name"),
                 .shape = sim::Prop::Shape::kBall,
                 .size = Vector3d::Constant(positive(r, "radius")),
                 .position = vector(r, "at"),
                 .mass = positive(r, "mass"),
                 .hollow = r.boolean("hollow", false)});
    }
    for (const TomlReader& r : scene.tables("wall")) {
      finish(r, sim::wall(r.string("name"), vector(r, "at"), r.number("yaw", 0),
                          positive(r, "width"), positive(r, "height")));
    }
    for (const TomlReader& r : scene.tables("rail")) {
      finish(r, sim::rail(r.string("name"), vector(r, "from"), vector(r, "to"),
                          positive(r, "radius")));
    }
    return rows;
  }

  void readScene(const TomlReader& top) {
    sim::Scene scene;
    scene.time_step = top.number("time_step", scene.time_step);
    if (!(scene.time_step >= 1e-6 && scene.time_step <= 0.02)) {
      top.fail("time_step", "\"time_step\": expected seconds in [0.000001, 0.02]");
      scene.time_step = 0.001;
    }
    const TomlReader s = top.table("scene");
    scene.ground = s.boolean("ground", true);
    scene.ground_material = material(s, scene.time_step);
    scene.ground_material.friction =
        skill_.disturbance.friction.value_or(scene.ground_material.friction);
    const std::vector<TomlReader> rows = readProps(s, scene.time_step, scene.props);
    limit(s, "props", rows.size());
    s.finish();
    const std::string robot = top.string("robot");
    if (robot.empty()) return;
    std::string wrong;
    try {
      sim::Robot read = sim::Robot::fromFile(findRobot(robot, skill_.file.parent_path()));
      read.mass_scale *= skill_.disturbance.mass;
      scene.robot = std::make_shared<const sim::Robot>(std::move(read));
      skill_.model = sim::Model::fromScene(scene);
      if (scene.ground && skill_.model->rootDofs() == 6 && !skill_.model->canTouchWorld()) {
        top.fail("robot", fmt::format("\"robot\": nothing of it can touch the ground: expected a "
                                      "shape that collides in {}",
                                      scene.robot->file.string()));
      }
      return;
    } catch (const InputError& e) {
      wrong = e.what();
    }
    // Whose mistake is it? A prop's is reported at its own line.
    bool found = false;
    sim::Scene good = scene;
    good.props.clear();
    if (scene.robot && !rows.empty() && !complaint(good)) {
      for (size_t i = 0; i < rows.size(); ++i) {
        good.props.push_back(scene.props[i]);
        if (const auto why = complaint(good)) {
          rows[i].fail("name", *why);
          good.props.pop_back();
          found = true;
        }
      }
    }
    if (!found) top.fail("robot", fmt::format("\"robot\": {}", wrong));
  }

  static std::optional<std::string> complaint(const sim::Scene& scene) {
    try {
      sim::Model::fromScene(scene);
    } catch (const InputError& e) {
      return e.what();
    }
    return std::nullopt;
  }

  void readStart(const TomlReader& start) {
    const TomlReader row = start.table("pose");
    const VectorXd base = basePose(row, "base");
    sim::Pose pose;
    for (size_t i = 0; i < skill_.model->joints().size(); ++i) {
      pose.joints[skill_.model->joints()[i].name] = base[static_cast<Eigen::Index>(i)];
    }
    pose.root_rpy = base_root_;
    for (const JointValue& v : jointValues(row, {"base"}, Scope::kSetup)) {
      const TomlValue* number = nullptr;
      try {
        pose.joints[skill_.model->joints()[v.joint].name] =
            v.sign * control::Expression(v.expression, [](auto&) { return nullptr; }).value();
      } catch (const InputError&) {
        number = &row.value();
      }
      if (number) {
        diagnostics_.add(number->line, number->column,
                         fmt::format("\"{}\": the start is the same in every trial: expected a "
                                     "number",
                                     v.expression));
      }
    }
    start.finish();
    skill_.start = skill_.model->stateOf(pose);
    static constexpr double kDepth = 1e-3;  // of a robot's own geometry set on z = 0: none [ours]
    if (const auto in = skill_.model->bodyReachedInto(skill_.start, kDepth)) {
      diagnostics_.add(0, 0,
                       fmt::format("[start.pose]: the robot begins inside \"{}\": expected it "
                                   "beside or above, its lowest point is on z = 0",
                                   skill_.model->bodyName(*in)));
    }
  }

  void readController(const TomlReader& c) {
    const auto optional = [&](const char* key, bool limit) -> std::optional<double> {
      if (!c.has(key)) return std::nullopt;
      const double x = limit ? c.numberOrInfinity(key) : c.number(key);
      if (!(x >= 0)) c.fail(key, fmt::format("\"{}\": expected a number >= 0", key));
      return x;
    };
    skill_.controller = {optional("kp", false), optional("kd", false),
                         optional("torque_limit", true), optional("speed_limit", true)};
    c.finish();
  }

  void readPhases(const TomlReader& top) {
    const std::vector<TomlReader> rows = top.tables("phase");
    if (rows.empty()) {
      diagnostics_.add(0, 0, "[[phase]]: expected at least one phase");
    }
    limit(top, "phases", rows.size());
    for (const TomlReader& row : rows) {  // names first: phases are named in "during"
      Phase p;
      p.name = row.string("name");
      for (const Phase& other : skill_.phases) {
        if (other.name == p.name && !p.name.empty()) {
          row.fail("name", fmt::format("\"{}\": two phases have this name", p.name));
        }
      }
      skill_.phases.push_back(std::move(p));
    }
    for (size_t i = 0; i < rows.size(); ++i) {
      const TomlReader& row = rows[i];
      Phase& p = skill_.phases[i];
      const TomlReader pose = row.table("pose");
      p.from_previous = pose.string("base", "") == "previous";
      p.base = p.from_previous ? VectorXd() : basePose(pose, "base");
      p.targets = jointValues(pose, {"base"}, Scope::kSetup);
      p.blend = expression(row, "blend", "0", Scope::kSetup);
      p.limited = row.boolean("limited", true);
      for (const TomlReader& f : row.tables("force")) readForce(f, p);
      p.until = expression(row, "until", "", Scope::kRunning);
      p.next = static_cast<int>(i) + 1;
      if (row.has("then")) p.next = phaseIndex(row, "then", row.string("then")).value_or(0);
      const bool last = p.next == static_cast<int>(rows.size());
      if (p.until.empty() && !last) {
        row.fail("until", fmt::format("phase \"{}\": \"until\" is missing: expected the condition "
                                      "that begins \"{}\"",
                                      p.name, skill_.phases[p.next].name));
      }
      row.finish();
    }
  }

  void readForce(const TomlReader& f, Phase& phase) {
    ForceTerm term;
    if (f.has("at")) term.p_BP = vector(f, "at");
    const TomlValue* force = f.find("force");
    if (!force || !force->isArray() || force->array().size() != 3) {
      f.fail("force", "\"force\": expected a list of 3 numbers or expressions [N]");
    } else {
      std::string* const parts[] = {&term.x, &term.y, &term.z};
      for (int i = 0; i < 3; ++i) *parts[i] = expression(force->array()[i], Scope::kSetup);
    }
    const std::vector<std::string> bodies = f.strings("bodies");
    for (const std::string& name : bodies) {
      try {
        term.body = skill_.model->body(name);
        phase.forces.push_back(term);
      } catch (const InputError& e) {
        f.fail("bodies", fmt::format("\"bodies\": {}", e.what()));
      }
    }
    f.finish();
  }

  void readFeedback(const TomlReader& top) {
    for (const TomlReader& row : top.tables("feedback")) {
      Feedback f;
      const std::string add = expression(row, "add", "0", Scope::kRunning);
      for (const std::string& name : row.strings("joints")) {
        for (const auto& [joint, sign] : joints(row, "joints", name)) {
          f.joints.push_back({joint, sign, add});
        }
      }
      f.during = during(row);
      row.finish();
      skill_.feedback.push_back(std::move(f));
    }
  }

  void readMeasures(const TomlReader& table) {
    static const std::vector<std::string> kTakes = {"first", "last", "min",
                                                    "max",   "mean", "integral"};
    limit(table, "measures", table.names().size());
    for (const std::string& name : table.names()) {
      const TomlReader row = table.table(name);
      checkName(table, name, name);
      Measure m;
      m.name = name;
      m.of = expression(row, "of", "", Scope::kRunning);
      if (m.of.empty()) row.fail("of", fmt::format("measure \"{}\": \"of\" is missing", name));
      const std::string take = row.string("take");
      const auto it = std::find(kTakes.begin(), kTakes.end(), take);
      if (it == kTakes.end()) {
        row.fail("take", fmt::format("\"take\": expected one of {}, got \"{}\".{}", join(kTakes),
                                     take, didYouMean(take, kTakes)));
      } else {
        m.take = static_cast<Measure::Take>(it - kTakes.begin());
      }
      m.during = during(row);
      if (m.take == Measure::Take::kIntegral) m.otherwise = 0;
      m.otherwise = row.number("otherwise", m.otherwise);
      row.finish();
      skill_.measures.push_back(std::move(m));
    }
  }

  void readFailures(const TomlReader& top) {
    limit(top, "failures", top.tables("failure").size());
    for (const TomlReader& row : top.tables("failure")) {
      Failure f;
      f.name = row.string("name");
      checkName(row, "name", f.name);
      f.when = expression(row, "when", "", Scope::kRunning);
      if (f.when.empty())
        row.fail("when", fmt::format("failure \"{}\": \"when\" is missing", f.name));
      f.during = during(row);
      row.finish();
      skill_.failures.push_back(std::move(f));
    }
  }

  void readObjective(const TomlReader& top) {
    for (const TomlReader& row : top.tables("objective")) {
      Term t;
      t.name = row.string("name");
      t.cost = expression(row, "cost", "", Scope::kVerdict);
      if (t.cost.empty())
        row.fail("cost", fmt::format("objective \"{}\": \"cost\" is missing", t.name));
      row.finish();
      skill_.terms.push_back(std::move(t));
    }
    if (skill_.terms.empty()) {
      diagnostics_.add(0, 0, "[[objective]]: expected at least one term");
    }
  }

  // --- pieces ---

  /// Expressions name parameters, measures and failures, and a trial's end is a failure's name: one
  /// that cannot be spelled or that means two things is noted at key.
  void checkName(const TomlReader& row, std::string_view key, const std::string& name) {
    if (name.empty()) return;  // said to be missing already
    if (!control::Expression::isName(name) || name.find('.') != std::string::npos) {
      row.fail(key, fmt::format("\"{}\": expected a name of letters, digits and _, that is no "
                                "function",
                                name));
      return;
    }
    static const std::set<std::string> kOurs = {"task",       "horizon", "time",
                                                "phase_time", "stop",    "diverged"};
    if (kOurs.contains(name)) {
      row.fail(key, fmt::format("\"{}\" has a meaning of its own: expected another name", name));
    } else if (!names_.insert(name).second) {
      row.fail(key,
               fmt::format("\"{}\": two parameters, measures or failures have this name", name));
    }
  }

  /// The phase of this name; nothing after complaining about `key`.
  std::optional<int> phaseIndex(const TomlReader& row, const char* key, const std::string& name) {
    std::vector<std::string> names;
    for (size_t i = 0; i < skill_.phases.size(); ++i) {
      if (skill_.phases[i].name == name) return static_cast<int>(i);
      names.push_back(skill_.phases[i].name);
    }
    row.fail(key,
             fmt::format("\"{}\": no phase named \"{}\".{}", key, name, didYouMean(name, names)));
    return std::nullopt;
  }

  std::vector<bool> during(const TomlReader& row) {
    std::vector<bool> in(skill_.phases.size(), !row.has("during"));
    if (!row.has("during")) return in;
    for (const std::string& name : row.strings("during")) {
      if (const auto phase = phaseIndex(row, "during", name)) in[*phase] = true;
    }
    return in;
  }

  /// The robot's pose that key names ("zero" is always there), as joint angles.
  VectorXd basePose(const TomlReader& row, const char* key) {
    const sim::Model& m = *skill_.model;
    VectorXd q = VectorXd::Zero(static_cast<Eigen::Index>(m.joints().size()));
    base_root_.setZero();
    const std::string name = row.string(key, "zero");
    const auto pose = m.robot()->poses.find(name);
    if (pose == m.robot()->poses.end()) {
      if (name == "zero") return q;
      std::vector<std::string> names = {"zero", "previous"};
      for (const auto& [known, unused] : m.robot()->poses) names.push_back(known);
      row.fail(key, fmt::format("\"{}\": {} has no pose \"{}\".{} Known: {}", key, m.robot()->name,
                                name, didYouMean(name, names), join(names)));
      return q;
    }
    base_root_ = pose->second.root_rpy;
    for (size_t i = 0; i < m.joints().size(); ++i) {
      const auto angle = pose->second.joints.find(m.joints()[i].name);
      if (angle != pose->second.joints.end()) q[static_cast<Eigen::Index>(i)] = angle->second;
    }
    return q;
  }

  /// The joints a word means, with signs; a mistake is noted at key.
  std::vector<std::pair<int, double>> joints(const TomlReader& row, const std::string& key,
                                             const std::string& word) {
    const sim::Model& m = *skill_.model;
    std::vector<std::pair<int, double>> out;
    for (const sim::SignedJoint& j : m.robot()->jointsNamed(word)) {
      int index = -1;
      for (size_t i = 0; i < m.joints().size(); ++i) {
        if (m.joints()[i].name == j.joint) index = static_cast<int>(i);
      }
      if (index < 0) {
        std::vector<std::string> names;
        for (const auto& [pair, unused] : m.robot()->mirrored) names.push_back(pair);
        for (const sim::Joint& joint : m.joints()) names.push_back(joint.name);
        row.fail(key, fmt::format("no joint or pair of joints named \"{}\".{}", word,
                                  didYouMean(word, names)));
      } else {
        out.emplace_back(index, j.sign);
      }
    }
    return out;
  }

  std::vector<JointValue> jointValues(const TomlReader& row, const std::set<std::string>& except,
                                      Scope scope) {
    std::vector<JointValue> out;
    for (const std::string& key : row.names()) {
      if (except.contains(key)) continue;
      const std::string text = expression(*row.find(key), scope);
      for (const auto& [joint, sign] : joints(row, key, key)) out.push_back({joint, sign, text});
    }
    return out;
  }

  std::string expression(const TomlReader& row, const char* key, const char* otherwise,
                         Scope scope) {
    const TomlValue* v = row.find(key);
    return v ? expression(*v, scope) : otherwise;
  }

  /// A number or an expression, checked: the text that Expression takes.
  std::string expression(const TomlValue& v, Scope scope) {
    const auto fail = [&](std::string_view message) {
      diagnostics_.add(v.line, v.column, message);
      return std::string("0");
    };
    if (v.isNumber()) {
      if (!std::isfinite(v.number())) return fail("expected a finite number");
      return fmt::format("({})", v.number());
    }
    if (!v.isString()) {
      return fail(fmt::format("expected a number or an expression, got {}", v.kind()));
    }
    if (++expressions_ > kMostExpressions) {
      fail(fmt::format("the {}. expression: expected at most {}", expressions_, kMostExpressions));
      diagnostics_.throwIfAny();
    }
    const double somewhere = 1;
    try {
      for (const std::string& name : control::Expression::namesIn(v.string())) {
        if (known(scope, name)) continue;
        const std::vector<std::string> candidates = names(scope);
        return fail(fmt::format("\"{}\": nothing here is named \"{}\".{}", v.string(), name,
                                didYouMean(name, candidates)));
      }
      const control::Expression checked(v.string(), [&](auto&) { return &somewhere; });
    } catch (const InputError& e) {
      return fail(e.what());
    }
    return v.string();
  }

  bool known(Scope scope, const std::string& name) {
    const std::vector<std::string> plain = plainNames(scope);
    if (std::find(plain.begin(), plain.end(), name) != plain.end()) return true;
    return scope == Scope::kRunning && signals_->find(name);
  }

  std::vector<std::string> plainNames(Scope scope) const {
    std::vector<std::string> out = {"task", "horizon", "pi"};
    for (const ParamSpec& p : skill_.parameters) out.push_back(p.name);
    if (scope == Scope::kRunning) out.insert(out.end(), {"time", "phase_time"});
    if (scope == Scope::kVerdict) {
      out.push_back("time");
      for (const Measure& m : skill_.measures) out.push_back(m.name);
      for (const Failure& f : skill_.failures) out.push_back(f.name);
    }
    return out;
  }

  std::vector<std::string> names(Scope scope) const {
    std::vector<std::string> out = plainNames(scope);
    if (scope == Scope::kRunning) {
      for (const std::string& s : signals_->names()) out.push_back(s);
    }
    return out;
  }

  TomlValue document_;
  Diagnostics diagnostics_;
  Skill skill_;
  std::unique_ptr<control::Signals> signals_;
  int expressions_ = 0;                    // checked so far
  std::set<std::string> names_;            // of parameters, measures and failures
  Vector3d base_root_ = Vector3d::Zero();  // the attitude of the pose basePose() read last
};

}  // namespace

VectorXd Skill::initialParameters() const {
  VectorXd x(parameters.size());
  for (size_t i = 0; i < parameters.size(); ++i) {
    x[static_cast<Eigen::Index>(i)] = parameters[i].initial;
  }
  return x;
}

std::shared_ptr<const Skill> Skill::fromFile(const fs::path& file) {
  return fromText(readFile(file), file);
}

std::shared_ptr<const Skill> Skill::fromText(const std::string& text, const fs::path& file,
                                             const Disturbance& disturbance) {
  return SkillReader(file, text, disturbance).read();
}

fs::path findRobot(const std::string& name, const fs::path& beside) {
  for (const fs::path& path : {beside / name, fs::path(name)}) {
    if (isFile(path)) return path;
  }
  std::vector<std::string> names;
  for (const fs::path& folder : modelFolders(beside)) {
    if (isFile(folder / name / "robot.toml")) return folder / name / "robot.toml";
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (isFile(entry.path() / "robot.toml")) {
        names.push_back(entry.path().filename().string());
      }
    }
  }
  if (names.empty()) {
    std::vector<std::string> folders;
    for (const fs::path& folder : modelFolders(beside)) folders.push_back(folder.string());
    throw InputError(fmt::format("no robot \"{}\": no such file, and found no models/ in: {}", name,
                                 join(folders)));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  throw InputError(fmt::format("no robot \"{}\": neither a file nor one of: {}.{}", name,
                               join(names), didYouMean(name, names)));
}

}  // namespace traceur::skill
