#include "traceur/skill/skill_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "traceur/control/expression.h"
#include "traceur/core/text.h"
#include "traceur/skill/launch.h"
#include "traceur/skill/like.h"
#include "traceur/skill/part_source.h"
#include "traceur/skill/scene_reader.h"
#include "traceur/skill/words.h"

namespace traceur::skill {
namespace {

namespace fs = std::filesystem;

/// Reads one skill file. Mistakes are collected; the model is needed to check names, so a robot
/// that cannot be loaded ends the reading of everything that depends on it.
class SkillReader {
 public:
  /// The files that are read for one.
  struct Files {
    int count = 0;
    std::vector<fs::path> open = {};  ///< from the whole to the part of a part
  };

  /// @param whole  of which this is a part, performed in its scene; null for none
  SkillReader(const fs::path& file, std::string text, const Disturbance& disturbance,
              const Skill* whole, Files& files)
      : whole_(whole),
        files_(&files),
        diagnostics_(file.string()),
        like_(LikeDocument::read(text, file, diagnostics_, files.open)),
        words_(skill_, diagnostics_) {
    skill_.file = file;
    skill_.disturbance = disturbance;
    skill_.text = std::move(text);
    skill_.like = like_.others;
  }

  std::shared_ptr<const Skill> read() {
    const TomlReader top(like_.document, diagnostics_);
    skill_.name = top.string("name");
    skill_.description = top.string("description", "");
    const bool chain = top.has("skill");  // without a horizon, all of its parts
    skill_.horizon = chain ? top.number("horizon", kLongest) : top.number("horizon");
    if (!(skill_.horizon > 0 && skill_.horizon <= kLongest)) {
      top.fail("horizon", fmt::format("\"horizon\": expected seconds in (0, {}]", kLongest));
    }
    skill_.target_cost = top.number("target_cost", skill_.target_cost);
    readTask(top.table("task"));
    readConstants(top.table("constants"));
    readNumbers(top.table("conditions"), "default", skill_.conditions);
    readNumbers(top.table("parameters"), "initial", skill_.parameters);
    if (skill_.parameters.empty()) {
      diagnostics_.add(0, 0, "[parameters]: expected at least one parameter to practise");
    }
    readModel(top);
    if (skill_.model) {
      words_.modelKnown();
      readController(top.table("controller"));
      readParts(top);
      readPhases(top);
      if (chain && !top.has("horizon")) skill_.horizon = partsHorizon();
      readStart(top.table("start"));
      readFeedback(top);
      readPushes(top);
      readMeasures(top.table("measures"));
      readFailures(top);
      readObjective(top);
      skill_.stop = words_.expression(top, "stop", "", Scope::kRunning);
      skill_.task.achieved = words_.expression(top.table("task"), "achieved", "", Scope::kVerdict);
    } else {
      for (const char* key : {"start", "controller", "phase", "skill", "feedback", "push",
                              "measures", "failure", "objective", "stop", "values"}) {
        top.find(key);  // cannot be judged without the robot
      }
    }
    top.finish();
    diagnostics_.throwIfAny();
    if (skill_.launch) beginInTheAir();
    diagnostics_.throwIfAny();
    return std::make_shared<const Skill>(std::move(skill_));
  }

 private:
  /// Longest trial [s]: a mistyped horizon should not run for a day.
  static constexpr double kLongest = 600;
  /// Of parameters, phases and the like, each; more would take longer to check than a person waits,
  /// and nobody practises so many [ours].
  static constexpr size_t kMostRows = 500;
  /// Of the files that one names as its parts, and they as theirs [ours].
  static constexpr int kMostFiles = 100;

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

  void readConstants(const TomlReader& table) {
    limit(table, "constants", table.names().size());
    for (const std::string& name : table.names()) {  // each may name those before it
      words_.declare(table, name, name);
      const double value = words_.value(*table.find(name));
      skill_.constants.emplace_back(name, value);
    }
  }

  /// Rows of { unit, range, help } and a number within the range.
  void readNumbers(const TomlReader& table, const char* within, ParamSpecs& rows) {
    limit(table, within == std::string_view("initial") ? "parameters" : "conditions",
          table.names().size());
    for (const std::string& name : table.names()) {  // the order of the optimiser's variables
      const TomlReader row = table.table(name);
      words_.declare(table, name, name);
      ParamSpec p;
      p.name = name;
      p.unit = row.string("unit", "");
      const std::vector<double> range = row.numbers("range", 2);
      p.min = range[0];
      p.max = range[1];
      p.initial = row.number(within, (p.min + p.max) / 2);
      p.help = row.string("help", "");
      if (!(p.min < p.max)) {
        row.fail("range", fmt::format("\"{}\": expected a range [min, max] of finite numbers with "
                                      "min < max, got [{}, {}]",
                                      name, p.min, p.max));
      } else if (!(p.min <= p.initial && p.initial <= p.max)) {
        row.fail(within, fmt::format("\"{}\": {} {} is outside [{}, {}]", name, within, p.initial,
                                     p.min, p.max));
      }
      if (&rows == &skill_.conditions) skill_.drawn.push_back(readDrawn(row, p));
      row.finish();
      rows.push_back(std::move(p));
    }
  }

  static std::pair<double, double> readDrawn(const TomlReader& row, const ParamSpec& p) {
    if (!row.has("draw")) return {p.min, p.max};
    const std::vector<double> range = row.numbers("draw", 2);
    if (!(p.min <= range[0] && range[0] <= range[1] && range[1] <= p.max)) {
      row.fail("draw", fmt::format("\"draw\": expected [least, most] within \"range\", [{}, {}]",
                                   p.min, p.max));
    }
    return {range[0], range[1]};
  }

  void readValues(const TomlReader& table) {
    limit(table, "values", table.names().size());
    for (const std::string& name : table.names()) {  // each may name those before it
      words_.declare(table, name, name);
      Value v{name, words_.expression(*table.find(name), Scope::kRunning)};
      v.running = !words_.isSetup(v.expression);
      skill_.values.push_back(std::move(v));
    }
  }

  /// Of the file that says it: a path there begins there.
  fs::path folderOf(const TomlReader& row, std::string_view key) {
    const TomlValue* v = row.find(key);
    return fs::path(diagnostics_.fileOf(v ? v->line : 0)).parent_path();
  }

  void readModel(const TomlReader& top) {
    sim::Scene scene;
    scene.time_step = top.number("time_step", scene.time_step);
    if (!(scene.time_step >= 1e-6 && scene.time_step <= 0.02)) {
      top.fail("time_step", "\"time_step\": expected seconds in [0.000001, 0.02]");
      scene.time_step = 0.001;
    }
    skill_.decision_interval = scene.time_step;
    scene.time_step = skill_.disturbance.time_step.value_or(scene.time_step);
    const TomlReader s = top.table("scene");
    const std::vector<TomlReader> rows = readScene(s, scene);
    scene.ground_material.friction =
        skill_.disturbance.friction.value_or(scene.ground_material.friction);
    scene.ground_material.compliance =
        skill_.disturbance.compliance.value_or(scene.ground_material.compliance);
    scene.ground_material.damping_ratio =
        skill_.disturbance.damping_ratio.value_or(scene.ground_material.damping_ratio);
    for (const sim::Prop& p : skill_.disturbance.props) scene.props.push_back(p);
    limit(s, "props", rows.size());
    s.finish();
    const std::string robot = top.string("robot");
    if (robot.empty()) return;
    if (whole_) {
      useModelOfWhole(top, robot, scene.time_step);
      return;
    }
    std::string wrong;
    try {
      sim::Robot read = sim::Robot::fromFile(findRobot(robot, folderOf(top, "robot")));
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

  /// A part is performed by the same robot in the whole's scene.
  void useModelOfWhole(const TomlReader& top, const std::string& robot, double time_step) {
    skill_.model = whole_->model;
    const sim::Robot& ours = *skill_.model->robot();
    try {
      const fs::path found = findRobot(robot, folderOf(top, "robot"));
      const fs::path& known = ours.toml.empty() ? ours.file : ours.toml;
      std::error_code ignored;
      if (!fs::equivalent(found, known, ignored)) {
        top.fail("robot", fmt::format("\"robot\": {} is not that of the skill it is a part of: {}",
                                      found.string(), known.string()));
      }
    } catch (const InputError& e) {
      top.fail("robot", fmt::format("\"robot\": {}", e.what()));
    }
    if (time_step != skill_.model->timeStep()) {
      top.fail("time_step", fmt::format("\"time_step\": {} s: expected that of the skill it is a "
                                        "part of, {} s",
                                        time_step, skill_.model->timeStep()));
    }
  }

  void readStart(const TomlReader& start) {
    const TomlReader row = start.table("pose");
    const auto [base, attitude] = words_.basePose(row, "base");
    sim::Pose pose;
    for (size_t i = 0; i < skill_.model->joints().size(); ++i) {
      pose.joints[skill_.model->joints()[i].name] = base[static_cast<Eigen::Index>(i)];
    }
    pose.root_rpy = attitude;
    for (const std::string& key : row.names()) {
      if (key == "base") continue;
      const double value = words_.value(*row.find(key));
      for (const auto& [joint, sign] : words_.joints(row, key, key)) {
        pose.joints[skill_.model->joints()[joint].name] = sign * value;
      }
    }
    readLaunch(start, pose);
    if (start.has("after")) {
      const TomlReader after = start.table("after");
      if (skill_.launch || start.has("pose")) {
        start.fail("after", "\"after\": expected this alone: the start is where that one ends");
      }
      skill_.after = readPart(after, Scope::kConstant);
      if (!skill_.after->skill) skill_.after.reset();
      after.finish();
    }
    start.finish();
    skill_.start = skill_.model->stateOf(pose);
    if (!whole_ && !skill_.launch && !skill_.after) refuseInside("[start.pose]");
  }

  void readLaunch(const TomlReader& start, const sim::Pose& pose) {
    bool any = false;
    for (const char* key :
         {"height", "com_height", "velocity", "spin", "roll", "pitch", "yaw", "lands", "ground"}) {
      if (!start.has(key)) continue;
      any = true;
      if (skill_.model->rootDofs() != 6) {
        start.fail(key, fmt::format("\"{}\": the robot is fixed to the world: it cannot start "
                                    "elsewhere than there",
                                    key));
        start.find(key);
        return;
      }
    }
    if (!any) return;
    Launch l;
    l.pose = pose;
    l.of_com = start.has("com_height");
    if (l.of_com && start.has("height")) {
      start.fail("com_height", "expected one of \"height\" and \"com_height\"");
      start.find("height");
    }
    l.height = words_.expression(start, l.of_com ? "com_height" : "height", "0", Scope::kSetup);
    l.velocity = words_.vector(start, "velocity", Scope::kSetup);
    l.spin = words_.vector(start, "spin", Scope::kSetup);
    l.roll = words_.expression(start, "roll", "", Scope::kSetup);
    l.pitch = words_.expression(start, "pitch", "", Scope::kSetup);
    l.yaw = words_.expression(start, "yaw", "", Scope::kSetup);
    l.lands = words_.expression(start, "lands", "", Scope::kSetup);
    l.ground = words_.expression(start, "ground", "0", Scope::kSetup);
    if (start.has("ground") && l.lands.empty()) {
      start.fail("ground", "expected \"lands\" too, for which it is the height of the surface");
    }
    if (!l.lands.empty() && !l.pitch.empty()) {
      start.fail("lands", "expected one of \"pitch\" and \"lands\", which chooses it");
    }
    skill_.launch = std::move(l);
  }

  /// The state that the initial parameters and task start from.
  void beginInTheAir() {
    Places places(skill_);
    places.parameters = skill_.initialParameters();
    places.task = skill_.task.initial;
    places.settle();
    skill_.start = LaunchState(skill_, places).state();
    if (!skill_.start.q.allFinite() || !skill_.start.v.allFinite()) {
      diagnostics_.add(0, 0, "[start]: of the initial parameters and task it is not finite");
    } else {
      refuseInside("[start]");
    }
  }

  /// A robot begins beside things, not in them.
  void refuseInside(const char* where) {
    static constexpr double kDepth = 1e-3;  // of a robot's own geometry set on z = 0: none [ours]
    const auto in = skill_.model->bodyReachedInto(skill_.start, kDepth);
    // What is put beside the skill's own things, a caller has other starts for.
    const std::vector<sim::Prop>& beside = skill_.disturbance.props;
    const bool known = in && std::none_of(beside.begin(), beside.end(), [&](const sim::Prop& p) {
                         return p.name == skill_.model->bodyName(*in);
                       });
    if (known) {
      diagnostics_.add(0, 0,
                       fmt::format("{}: the robot begins inside \"{}\": expected it "
                                   "beside or above, its lowest point is on z = 0",
                                   where, skill_.model->bodyName(*in)));
    }
  }

  /// As long as the parts last at most.
  double partsHorizon() const {
    double sum = 0;
    for (const Part& part : skill_.parts) sum += part.skill->horizon;
    return std::clamp(sum, skill_.model->timeStep(), kLongest);
  }

  void readController(const TomlReader& c) {
    using Override = ControllerOptions::Override;
    std::vector<Override>& all = skill_.controller.joints;
    all.resize(skill_.model->joints().size());
    const auto read = [&](const char* key, std::optional<double> Override::*member, bool limit) {
      const TomlValue* v = c.find(key);
      if (!v) return;
      const auto number = [&](const TomlReader& row, const std::string& name) {
        const double x = limit ? row.numberOrInfinity(name) : row.number(name);
        if (!(x >= 0)) row.fail(name, fmt::format("\"{}\": expected a number >= 0", name));
        return x;
      };
      if (!v->isTable()) {
        const double x = number(c, key);
        for (Override& o : all) o.*member = x;
        return;
      }
      const TomlReader row = c.table(key);
      for (const auto& [name, joints] : jointRows(row)) {
        const double x = number(row, name);
        for (const int joint : joints) all[joint].*member = x;
      }
    };
    read("kp", &Override::kp, false);
    read("kd", &Override::kd, false);
    read("ki", &Override::ki, false);
    read("torque_limit", &Override::torque, true);
    read("speed_limit", &Override::speed, true);
    c.finish();
    if (whole_ && c.names().empty()) {
      skill_.controller = whole_->controller;
    } else if (whole_ && skill_.controller != whole_->controller) {
      diagnostics_.add(c.value().line, c.value().column,
                       "[controller]: expected that of the skill it is a part of, or none");
    }
  }

  /// The keys of a table of joints, pairs and "all", which comes first, with the joints they mean.
  std::vector<std::pair<std::string, std::vector<int>>> jointRows(const TomlReader& row) {
    std::vector<std::pair<std::string, std::vector<int>>> rows;
    for (const std::string& name : row.names()) {
      std::vector<int> joints;
      if (name == "all") {
        for (size_t i = 0; i < skill_.model->joints().size(); ++i) {
          joints.push_back(static_cast<int>(i));
        }
        rows.insert(rows.begin(), {name, joints});
        continue;
      }
      for (const auto& [joint, unused] : words_.joints(row, name, name)) joints.push_back(joint);
      rows.emplace_back(name, joints);
    }
    return rows;
  }

  /// Factors on gains: one for all joints, or a table.
  std::vector<GainFactor> readFactors(const TomlReader& phase, const char* key) {
    std::vector<GainFactor> out;
    const TomlValue* v = phase.find(key);
    if (!v) return out;
    if (!v->isTable()) {
      const std::string text = words_.expression(*v, Scope::kRunning);
      for (size_t i = 0; i < skill_.model->joints().size(); ++i) {
        out.push_back({static_cast<int>(i), text});
      }
      return out;
    }
    const TomlReader row = phase.table(key);
    for (const auto& [name, joints] : jointRows(row)) {
      const std::string text = words_.expression(*row.find(name), Scope::kRunning);
      for (const int joint : joints) out.push_back({joint, text});
    }
    return out;
  }

  void readParts(const TomlReader& top) {
    const std::vector<TomlReader> rows = top.tables("skill");
    limit(top, "skills", rows.size());
    for (const TomlReader& row : rows) {
      if (top.has("phase")) {
        row.fail("file", "[[skill]]: expected either skills or phases");
        return;
      }
      Part part = readPart(row, Scope::kSetup);
      part.otherwise = row.number("otherwise", part.otherwise);
      const bool spelled = control::Expression::isName(part.name);
      if (!spelled && !row.has("name") && !part.name.empty()) {
        row.fail("file", fmt::format("\"{}\" is no name for expressions: expected a \"name\", too",
                                     part.name));
      } else {
        words_.declare(row, row.has("name") ? "name" : "file", part.name);
      }
      row.find("until");  // read when all parts can be named
      row.finish();
      if (part.skill) skill_.parts.push_back(std::move(part));
    }
    if (skill_.parts.size() < rows.size()) diagnostics_.throwIfAny();  // the rest names them
    words_.stagesKnown();
    for (size_t i = 0; i < rows.size(); ++i) {
      skill_.parts[i].until = words_.expression(rows[i], "until", "", Scope::kRunning);
    }
    for (const Part& part : skill_.parts) {
      for (const Failure& f : part.skill->failures) {
        skill_.failures.push_back({part.name + "." + f.name, "", {}});
      }
    }
  }

  /// @param scope  of what its parameters and its task are set to
  Part readPart(const TomlReader& row, Scope scope) {
    Part part;
    const std::string file = row.string("file");
    part.name = row.string("name", fs::path(file).stem().string());
    const TomlReader set = row.table("parameters");
    PartSource source;
    if (file.empty()) return part;
    const fs::path path = folderOf(row, "file") / file;
    const size_t depth = files_->open.size();
    try {
      const auto& open = files_->open;
      if (std::find(open.begin(), open.end(), path.lexically_normal()) != open.end()) {
        throw InputError(fmt::format("{} is a part of itself", path.string()));
      }
      if (++files_->count > kMostFiles) {
        throw InputError(
            fmt::format("the {}. file: expected at most {}", files_->count, kMostFiles));
      }
      source = PartSource::fromFile(path);
      files_->open.push_back(path.lexically_normal());
      SkillReader reader(source.file, source.text, skill_.disturbance, &skill_, *files_);
      reader.chained_ = scope == Scope::kSetup;
      part.skill = reader.read();
      files_->open.resize(depth);
      if (!source.learned.empty() && source.learned.size() != part.skill->parameters.size()) {
        throw InputError(fmt::format("{}: {} numbers for {} parameters", file,
                                     source.learned.size(), part.skill->parameters.size()));
      }
    } catch (const InputError& e) {
      files_->open.resize(depth);
      row.fail("file", fmt::format("\"file\": {}", e.what()));
      for (const std::string& name : set.names()) set.find(name);
      row.find("task");
      return part;
    }
    for (size_t i = 0; i < part.skill->parameters.size(); ++i) {
      const ParamSpec& p = part.skill->parameters[i];
      const TomlValue* v = set.find(p.name);
      const double otherwise = source.learned.empty() ? p.initial : source.learned[i];
      part.parameters.push_back(v ? words_.expression(*v, scope) : fmt::format("({})", otherwise));
      const double x = words_.constant(part.parameters.back()).value_or(p.initial);
      if (v && !(p.min <= x && x <= p.max)) {
        set.fail(p.name, fmt::format("\"{}\": expected a number in [{}, {}], got {}", p.name, p.min,
                                     p.max, x));
      }
    }
    set.finish();
    part.task = words_.expression(row, "task", "", scope);
    if (part.task.empty()) {
      part.task = fmt::format("({})", source.task.value_or(part.skill->task.initial));
    }
    return part;
  }

  void readPhases(const TomlReader& top) {
    const std::vector<TomlReader> rows = top.tables("phase");
    if (rows.empty() && !top.has("skill")) {
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
    words_.stagesKnown();
    readValues(top.table("values"));
    for (size_t i = 0; i < rows.size(); ++i) {
      const TomlReader& row = rows[i];
      Phase& p = skill_.phases[i];
      const TomlReader pose = row.table("pose");
      p.from_previous = pose.string("base", "") == "previous";
      p.base = p.from_previous ? VectorXd() : words_.basePose(pose, "base").first;
      p.targets = words_.jointValues(pose, {"base"}, Scope::kRunning);
      p.blend = words_.expression(row, "blend", "0", Scope::kRunning);
      p.stiffness = readFactors(row, "stiffness");
      p.damping = readFactors(row, "damping");
      p.limited = row.boolean("limited", true);
      if (row.has("reach")) p.reach = readReach(row.table("reach"));
      if (row.has("flight")) p.flight = readFlight(row.table("flight"));
      if (p.reach && p.flight) {
        row.fail("flight", "expected one of \"flight\" and \"reach\", which both choose the pose");
      }
      limit(row, "forces", row.tables("force").size());
      for (const TomlReader& f : row.tables("force")) readForce(f, p);
      limit(row, "exits", row.tables("exit").size());
      for (const TomlReader& exit : row.tables("exit")) {
        const std::string when = words_.expression(exit, "when", "", Scope::kRunning);
        if (!exit.has("when")) exit.fail("when", "\"when\": expected the condition of this exit");
        p.exits.push_back({when, words_.phaseIndex(exit, "then", exit.string("then")).value_or(0)});
        exit.finish();
      }
      Exit until{words_.expression(row, "until", "", Scope::kRunning), static_cast<int>(i) + 1};
      const bool last = i + 1 == rows.size();
      if (row.has("then"))
        until.next = words_.phaseIndex(row, "then", row.string("then")).value_or(0);
      if (!until.when.empty()) {
        p.exits.push_back(until);
      } else if (row.has("then") || (!last && p.exits.empty())) {
        row.fail("until", fmt::format("phase \"{}\": \"until\" is missing: expected the condition "
                                      "that begins \"{}\"",
                                      p.name, skill_.phases[until.next].name));
      }
      row.finish();
    }
  }

  Flight readFlight(const TomlReader& row) {
    /// More cost more time in each plan than they bring [ours].
    static constexpr int kMostPoses = 64;
    Flight flight;
    flight.somersault = words_.expression(row, "somersault", "0", Scope::kRunning);
    if (!row.has("somersault")) {
      row.fail("somersault",
               "\"somersault\": expected what the root should have turned on landing");
    }
    flight.ground = words_.expression(row, "ground", "0", Scope::kRunning);
    const double poses = row.number("poses", 16);  // as many as published [Ha2015, §3.4.1]
    const VectorXd from = words_.basePose(row, "from").first;
    row.finish();
    if (!(poses >= 0 && poses <= kMostPoses) || poses != std::floor(poses)) {
      row.fail("poses", fmt::format("\"poses\": expected a whole number in [0, {}]", kMostPoses));
    } else if (skill_.model->rootDofs() != 6) {
      row.fail("somersault", "[phase.flight]: the robot is fixed to the world: it does not fly");
    } else if (poses > 0) {
      // Drawing them takes long; a skill's flights mostly choose from the same.
      auto& drawn = flight_poses_[{static_cast<int>(poses), {from.begin(), from.end()}}];
      if (drawn.empty()) {
        drawn = flight::unlikePoses(skill_.model, from, static_cast<int>(poses));
      }
      flight.poses = drawn;
    }
    return flight;
  }

  Reach readReach(const TomlReader& row) {
    Reach reach;
    limit(row, "goals", row.tables("goal").size());
    for (const TomlReader& g : row.tables("goal")) {
      ReachGoal goal;
      goal.of = words_.place(g, "of");
      if (g.has("from")) goal.from = words_.place(g, "from");
      const auto read = [&](const char* key, std::string& text) {
        text = words_.expression(g, key, "", Scope::kRunning);
        return !text.empty();
      };
      bool any = false;
      for (const auto& [key, text] :
           std::initializer_list<std::pair<const char*, std::string*>>{{"x", &goal.x},
                                                                       {"y", &goal.y},
                                                                       {"z", &goal.z},
                                                                       {"distance", &goal.distance},
                                                                       {"roll", &goal.roll},
                                                                       {"pitch", &goal.pitch},
                                                                       {"yaw", &goal.yaw}}) {
        any = read(key, *text) || any;
      }
      if (!any) {
        g.fail("of", "a goal: expected where it should be: x, y, z, distance, roll, pitch or yaw");
      }
      const bool turns = !(goal.roll + goal.pitch + goal.yaw).empty();
      if (turns && goal.of.points.size() != 1) {
        g.fail("of", "\"of\": expected one body, whose roll, pitch and yaw are meant");
      }
      const bool placed = !(goal.x + goal.y + goal.z + goal.distance).empty();
      if (g.has("from") && !placed) {
        g.fail("from", "\"from\": expected x, y, z or distance with it");
      }
      goal.weight = words_.expression(g, "weight", "1", Scope::kRunning);
      g.finish();
      reach.goals.push_back(std::move(goal));
    }
    if (row.has("hold")) reach.hold = words_.bodies(row, "hold");
    if (reach.goals.empty()) row.fail("goal", "[[phase.reach.goal]]: expected at least one goal");
    if (row.has("joints")) {
      std::set<int> joints;
      for (const std::string& name : row.strings("joints")) {
        for (const auto& [joint, unused] : words_.joints(row, "joints", name)) {
          joints.insert(joint);
        }
      }
      reach.joints.assign(joints.begin(), joints.end());
      if (joints.empty()) row.fail("joints", "\"joints\": expected at least one joint");
    } else {
      for (size_t i = 0; i < skill_.model->joints().size(); ++i) {
        if (skill_.model->joints()[i].motor >= 0) reach.joints.push_back(static_cast<int>(i));
      }
    }
    reach.every = row.number("every", 0);
    if (!(reach.every >= 0)) row.fail("every", "\"every\": expected seconds >= 0");
    row.finish();
    return reach;
  }

  void readForce(const TomlReader& f, Phase& phase) {
    ForceTerm term;
    term.com = f.boolean("com", false);
    if (f.has("bodies") + f.has("points") + term.com > 1) {
      f.fail("bodies", "expected one of \"bodies\", \"points\" and \"com\"");
    } else if (f.has("points")) {
      for (const std::string& name : f.strings("points")) {
        try {
          term.points.push_back(skill_.model->contactPoint(name));
        } catch (const InputError& e) {
          f.fail("points", fmt::format("\"points\": {}", e.what()));
        }
      }
    } else if (!term.com) {
      const sim::Vector3d at =
          f.has("at") ? readVector(f, "at") : sim::Vector3d(sim::Vector3d::Zero());
      for (const sim::BodyId body : words_.bodies(f, "bodies")) term.points.push_back({body, at});
    }
    for (const char* key : {"bodies", "points"}) f.find(key);
    if (!f.has("force") && !f.has("moment")) {
      f.fail("force", "\"force\": expected a list of 3 numbers or expressions [N]");
    }
    term.force = words_.vector(f, "force", Scope::kRunning);
    term.moment = words_.vector(f, "moment", Scope::kRunning);
    if (term.com && f.has("moment")) {
      f.fail("moment", "\"moment\": expected \"bodies\" or \"points\": a moment is on a body");
    }
    const std::string frame = f.string("frame", "world");
    static const std::vector<std::string> kFrames = {"world", "cop to com", "heading"};
    const auto at = std::find(kFrames.begin(), kFrames.end(), frame);
    if (at == kFrames.end()) {
      f.fail("frame", fmt::format("\"frame\": expected one of {}, got \"{}\".{}", join(kFrames),
                                  frame, didYouMean(frame, kFrames)));
    } else {
      term.frame = static_cast<Frame>(at - kFrames.begin());
    }
    term.touching = f.boolean("touching", false);
    if (f.has("against")) term.against = words_.bodies(f, "against");
    if (term.touching && term.com && !f.has("against")) {
      f.fail("touching", "\"touching\": expected \"against\" with it: the COM touches nothing");
    }
    f.finish();
    phase.forces.push_back(std::move(term));
  }

  void readPushes(const TomlReader& top) {
    limit(top, "pushes", top.tables("push").size());
    for (const TomlReader& row : top.tables("push")) {
      PushTerm p;
      const std::string body = row.string("body");
      if (chained_) row.fail("body", "[[push]]: expected in the skill that this is a part of");
      try {
        if (!body.empty()) p.body = skill_.model->body(body);
      } catch (const InputError& e) {
        const bool group = skill_.model->robot()->bodies.contains(body);
        row.fail("body", group ? fmt::format("\"body\": \"{}\" is a group: expected one body", body)
                               : fmt::format("\"body\": {}", e.what()));
      }
      if (!row.has("force") && !row.has("moment")) {
        row.fail("force", "\"force\": expected a list of 3 numbers or expressions [N]");
      }
      p.force = words_.vector(row, "force", Scope::kSetup);
      p.moment = words_.vector(row, "moment", Scope::kSetup);
      if (!row.has("start")) row.fail("start", "\"start\": expected when it begins [s]");
      p.start = words_.expression(row, "start", "0", Scope::kSetup);
      p.duration = words_.expression(row, "duration", "0.1", Scope::kSetup);
      if (!(words_.constant(p.duration).value_or(0) >= 0)) {
        row.fail("duration", "\"duration\": expected seconds >= 0");
      }
      row.finish();
      skill_.pushes.push_back(std::move(p));
    }
  }

  void readFeedback(const TomlReader& top) {
    limit(top, "feedback rows", top.tables("feedback").size());
    for (const TomlReader& row : top.tables("feedback")) {
      if (!skill_.parts.empty()) row.fail("add", "[[feedback]]: expected in the parts");
      if (!row.has("add")) row.fail("add", "\"add\" is missing");
      Feedback f;
      const std::string add = words_.expression(row, "add", "0", Scope::kRunning);
      for (const std::string& name : row.strings("joints")) {
        for (const auto& [joint, sign] : words_.joints(row, "joints", name)) {
          f.joints.push_back({joint, sign, add});
        }
      }
      f.during = words_.during(row);
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
      words_.declare(table, name, name);
      Measure m;
      m.name = name;
      m.of = words_.expression(row, "of", "", Scope::kRunning);
      m.unit = row.string("unit", "");
      if (m.of.empty()) row.fail("of", fmt::format("measure \"{}\": \"of\" is missing", name));
      const std::string take = row.string("take");
      const auto it = std::find(kTakes.begin(), kTakes.end(), take);
      if (it == kTakes.end()) {
        row.fail("take", fmt::format("\"take\": expected one of {}, got \"{}\".{}", join(kTakes),
                                     take, didYouMean(take, kTakes)));
      } else {
        m.take = static_cast<Measure::Take>(it - kTakes.begin());
      }
      m.during = words_.during(row);
      m.when = words_.expression(row, "when", "", Scope::kRunning);
      if (m.take == Measure::Take::kIntegral) m.otherwise = 0;
      m.otherwise = row.number("otherwise", m.otherwise);
      row.finish();
      skill_.measures.push_back(std::move(m));
    }
  }

  void readFailures(const TomlReader& top) {
    for (Failure& f : skill_.failures) f.during.assign(skill_.phaseNames().size(), true);
    limit(top, "failures", top.tables("failure").size());
    for (const TomlReader& row : top.tables("failure")) {
      Failure f;
      f.name = row.string("name");
      words_.declare(row, "name", f.name);
      f.when = words_.expression(row, "when", "", Scope::kRunning);
      if (f.when.empty())
        row.fail("when", fmt::format("failure \"{}\": \"when\" is missing", f.name));
      f.during = words_.during(row);
      row.finish();
      skill_.failures.push_back(std::move(f));
    }
  }

  void readObjective(const TomlReader& top) {
    for (const TomlReader& row : top.tables("objective")) {
      Term t;
      t.name = row.string("name");
      t.cost = words_.expression(row, "cost", "", Scope::kVerdict);
      if (t.cost.empty())
        row.fail("cost", fmt::format("objective \"{}\": \"cost\" is missing", t.name));
      row.finish();
      skill_.terms.push_back(std::move(t));
    }
    if (skill_.terms.empty()) {
      diagnostics_.add(0, 0, "[[objective]]: expected at least one term");
    }
  }

  const Skill* whole_;
  Files* files_;
  bool chained_ = false;  // a part that follows another
  Diagnostics diagnostics_;
  LikeDocument like_;
  Skill skill_;
  Words words_;
  std::map<std::pair<int, std::vector<double>>, std::vector<flight::FlightPose>> flight_poses_;
};

}  // namespace

std::shared_ptr<const Skill> readSkill(const std::string& text, const std::filesystem::path& file,
                                       const Disturbance& disturbance) {
  SkillReader::Files files{.open = {file.lexically_normal()}};
  return SkillReader(file, text, disturbance, nullptr, files).read();
}

}  // namespace traceur::skill
