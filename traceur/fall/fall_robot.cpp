#include "traceur/fall/fall_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/sim/model.h"

namespace traceur::fall {
namespace {

int indexOf(const ContactGraph& graph, std::string_view name) {
  for (size_t i = 0; i < graph.nodes.size(); ++i) {
    if (graph.nodes[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

template <class Map>
std::vector<std::string> keysOf(const Map& map) {
  std::vector<std::string> keys;
  keys.reserve(map.size());
  for (const auto& [key, unused] : map) keys.push_back(key);
  return keys;
}

/// A walk that comes back to a node of its own, in words; "" if there is none.
std::string cycleOf(const ContactGraph& graph) {
  std::vector<int> path;
  std::vector<bool> done(graph.nodes.size());
  std::string found;
  const std::function<bool(int)> visit = [&](int node) {
    const auto again = std::find(path.begin(), path.end(), node);
    if (again != path.end()) {
      for (auto i = again; i != path.end(); ++i) found += graph.nodes[*i].name + " -> ";
      found += graph.nodes[node].name;
      return true;
    }
    if (done[node]) return false;
    path.push_back(node);
    for (const int next : graph.edges[node]) {
      if (visit(next)) return true;
    }
    path.pop_back();
    done[node] = true;
    return false;
  };
  for (size_t i = 0; i < graph.nodes.size(); ++i) {
    if (visit(static_cast<int>(i))) break;
  }
  return found;
}

/// Reads `name = { points = […], next = […] }` for each node, in the order of the text.
ContactGraph readGraph(const TomlReader& reader, const sim::Robot& robot) {
  ContactGraph graph;
  std::vector<std::vector<std::string>> next;
  for (const std::string& name : reader.names()) {
    const TomlReader row = reader.table(name);
    ContactNode node{name, row.strings("points")};
    if (node.points.empty()) row.fail("points", fmt::format("\"{}\" has no contact point", name));
    for (const std::string& point : node.points) {
      if (robot.contacts.contains(point)) continue;
      const std::vector<std::string> known = keysOf(robot.contacts);
      row.fail("points", fmt::format("no contact point \"{}\" in {}'s file.{} There is: {}", point,
                                     robot.name, didYouMean(point, known), join(known)));
    }
    next.push_back(row.has("next") ? row.strings("next") : std::vector<std::string>());
    graph.nodes.push_back(std::move(node));
    row.finish();
  }
  graph.edges.resize(graph.nodes.size());
  for (size_t i = 0; i < next.size(); ++i) {
    for (const std::string& to : next[i]) {
      const int j = indexOf(graph, to);
      if (j >= 0) {
        graph.edges[i].push_back(j);
        continue;
      }
      std::vector<std::string> known;
      for (const ContactNode& n : graph.nodes) known.push_back(n.name);
      reader.fail(graph.nodes[i].name, fmt::format("\"next\": no node \"{}\" in this graph.{}", to,
                                                   didYouMean(to, known)));
    }
  }
  return graph;
}

/// What a table says of it, within what it may be.
FallSetup::QuicknessChange readQuickness(const TomlReader& reader) {
  const auto read = [&](const char* key, bool zero, const char* unit) -> std::optional<double> {
    if (!reader.has(key)) return std::nullopt;
    const double value = reader.number(key);
    if (!(zero ? value >= 0 : value > 0)) {
      reader.fail(key, fmt::format("\"{}\": expected {} 0{}", key, zero ? "≥" : ">", unit));
    }
    return value;
  };
  return {read("rod_speed", true, " [m/s]"), read("stopper_speed", false, " [rad/s]"),
          read("stiffness", true, ", a factor")};
}

FallSetup::Quickness changed(const FallSetup::Quickness& quick,
                             const FallSetup::QuicknessChange& to) {
  return {to.rod_speed.value_or(quick.rod_speed), to.stopper_speed.value_or(quick.stopper_speed),
          to.stiffness.value_or(quick.stiffness)};
}

void readWithout(const TomlReader& reader, FallSetup& setup) {
  for (const std::string& name : reader.names()) {
    const TomlReader row = reader.table(name);
    if (indexOf(setup.graph, name) <= 0) {
      std::vector<std::string> known;
      for (size_t i = 1; i < setup.graph.nodes.size(); ++i) {
        known.push_back(setup.graph.nodes[i].name);
      }
      reader.fail(name, fmt::format("\"without\": no node \"{}\" to leave out.{} There is: {}",
                                    name, didYouMean(name, known), join(known)));
    }
    setup.quick_without[name] = readQuickness(row);
    row.finish();
  }
  reader.finish();
}

/// Complains of names in "joints" and "push_body" that the robot lacks.
void checkNames(const TomlReader& reader, const FallRobot& falls) {
  const auto model = sim::Model::fromScene({.robot = falls.robot});
  std::vector<std::string> joints = keysOf(falls.robot->mirrored);
  for (const sim::Joint& j : model->joints()) joints.push_back(j.name);
  for (const std::string& name : falls.joints) {
    if (std::find(joints.begin(), joints.end(), name) != joints.end()) continue;
    reader.fail("joints", fmt::format("\"joints\": {} has no joint \"{}\".{}", falls.robot->name,
                                      name, didYouMean(name, joints)));
  }
  std::vector<std::string> bodies;
  for (int b = 0; b < model->bodies(); ++b) {
    if (model->isRobot({b})) bodies.push_back(model->bodyName({b}));
  }
  if (std::find(bodies.begin(), bodies.end(), falls.push_body) == bodies.end()) {
    reader.fail("push_body",
                fmt::format("\"push_body\": {} has no body \"{}\".{}", falls.robot->name,
                            falls.push_body, didYouMean(falls.push_body, bodies)));
  }
}

}  // namespace

FallSetup FallSetup::without(const std::string& node) const {
  FallSetup less = *this;
  try {
    less.graph = graph.without(node);
  } catch (const InputError& e) {
    throw InputError(fmt::format("{} {}: {}", stance, direction, e.what()));
  }
  if (const auto change = quick_without.find(node); change != quick_without.end()) {
    less.quick = changed(quick, change->second);
  }
  return less;
}

bool ContactGraph::has(std::string_view node) const {
  return indexOf(*this, node) >= 0;
}

std::vector<int> ContactGraph::order() const {
  std::vector<int> sorted;
  std::vector<bool> done(nodes.size());
  const std::function<void(int)> visit = [&](int node) {
    if (done[node]) return;
    done[node] = true;
    for (const int next : edges[node]) visit(next);
    sorted.push_back(node);
  };
  for (size_t i = 0; i < nodes.size(); ++i) visit(static_cast<int>(i));
  std::reverse(sorted.begin(), sorted.end());
  return sorted;
}

ContactGraph ContactGraph::without(std::string_view name) const {
  const int gone = indexOf(*this, name);
  std::vector<std::string> names;
  for (size_t i = 1; i < nodes.size(); ++i) names.push_back(nodes[i].name);
  if (gone <= 0) {
    throw InputError(fmt::format("cannot leave out \"{}\": expected one of {}", name, join(names)));
  }
  ContactGraph graph;
  const auto moved = [&](int i) { return i < gone ? i : i - 1; };
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (static_cast<int>(i) == gone) continue;
    graph.nodes.push_back(nodes[i]);
    graph.edges.emplace_back();
    for (const int to : edges[i]) {
      if (to != gone) graph.edges.back().push_back(moved(to));
    }
  }
  if (graph.edges[0].empty()) {
    throw InputError(fmt::format("cannot leave out \"{}\": nothing else follows \"{}\"", name,
                                 graph.nodes[0].name));
  }
  return graph;
}

FallRobot FallRobot::fromFile(const std::filesystem::path& file) {
  const TomlValue document = parseToml(readFile(file), file.string());
  Diagnostics diagnostics(file.string());
  const TomlReader reader(document, diagnostics);
  FallRobot falls;
  const std::string robot_file = reader.string("robot", "robot.toml");
  const sim::Robot robot = sim::Robot::fromFile(file.parent_path() / robot_file);
  falls.robot = std::make_shared<const sim::Robot>(robot);
  const std::vector<std::string> contacts = keysOf(robot.contacts);
  const std::vector<std::string> poses = keysOf(robot.poses);
  falls.push_body = reader.string("push_body");
  falls.head = reader.string("head");
  if (!robot.contacts.contains(falls.head)) {
    reader.fail("head", fmt::format("\"head\": no contact point \"{}\" in {}.{}", falls.head,
                                    robot_file, didYouMean(falls.head, contacts)));
  }
  const auto read_pose = [&](const TomlReader& from, const std::string& key) {
    std::string pose = from.string(key);
    if (!robot.poses.contains(pose)) {
      from.fail(key, fmt::format("\"{}\": no pose \"{}\" in {}.{}", key, pose, robot_file,
                                 didYouMean(pose, poses)));
    }
    return pose;
  };
  falls.tuck = read_pose(reader, "tuck");
  falls.joints = reader.strings("joints");
  for (const char* needed : {"rod_speed", "stopper_speed"}) reader.number(needed);
  const FallSetup::Quickness quick = changed({}, readQuickness(reader));
  falls.least_interval = reader.number("least_interval", 0);
  if (!(falls.least_interval >= 0)) {
    reader.fail("least_interval", "\"least_interval\": expected ≥ 0 [s]");
  }
  if (reader.has("ranges")) {
    const TomlReader ranges = reader.table("ranges");
    for (const std::string& name : ranges.names()) {
      const std::vector<double> range = ranges.numbers(name, 2);
      if (std::find(falls.joints.begin(), falls.joints.end(), name) == falls.joints.end()) {
        ranges.fail(name, fmt::format("\"{}\" is not one of \"joints\".{}", name,
                                      didYouMean(name, falls.joints)));
      }
      if (!(range[0] < range[1])) {
        ranges.fail(name, fmt::format("\"{}\": expected [min, max] with min < max", name));
      }
      for (const sim::SignedJoint& j : robot.jointsNamed(name)) {
        falls.ranges[j.joint] = std::minmax(j.sign * range[0], j.sign * range[1]);
      }
    }
    ranges.finish();
  }
  const auto factor = [&](const char* key, double otherwise) {
    const double value = reader.number(key, otherwise);
    if (reader.has(key) && !(value >= 0)) {
      reader.fail(key, fmt::format("\"{}\": expected a factor ≥ 0", key));
    }
    return value;
  };
  FallTracking& tracking = falls.tracking;
  tracking.damping = factor("damping", tracking.damping);
  if (reader.has("rest_stiffness")) tracking.rest_stiffness = factor("rest_stiffness", {});
  tracking.rest_damping = factor("rest_damping", tracking.damping);
  tracking.support = factor("support", tracking.support);
  tracking.ramp = factor("ramp", tracking.ramp);
  tracking.rest_height = factor("rest_height", tracking.rest_height);
  for (const TomlReader& row : reader.tables("fall")) {
    FallSetup setup{read_pose(row, "stance"), row.string("direction"),
                    readGraph(row.table("graph"), robot), changed(quick, readQuickness(row))};
    setup.stands = row.boolean("stands", true);
    if (row.has("without")) readWithout(row.table("without"), setup);
    if (setup.direction != "forward" && setup.direction != "backward") {
      row.fail("direction", "\"direction\": expected forward or backward");
    }
    if (const std::string cycle = cycleOf(setup.graph); !cycle.empty()) {
      row.fail("graph", fmt::format("a fall along {} need not end", cycle));
    }
    const TomlReader graph = row.table("graph");
    const std::vector<std::string> nodes = graph.names();
    if (nodes.empty() || !graph.table(nodes.front()).has("next") ||
        graph.table(nodes.front()).strings("next").empty()) {
      row.fail("graph", "expected a first node, what the robot stands on, with a \"next\"");
    }
    row.finish();
    falls.setups.push_back(std::move(setup));
  }
  if (falls.setups.empty()) reader.fail("fall", "expected at least one [[fall]]");
  checkNames(reader, falls);
  reader.finish();
  diagnostics.throwIfAny();
  return falls;
}

const FallSetup& FallRobot::setup(std::string_view stance, std::string_view direction) const {
  std::vector<std::string> known;
  for (const FallSetup& s : setups) {
    if (s.stance == stance && s.direction == direction) return s;
    known.push_back(s.stance + " " + s.direction);
  }
  throw InputError(fmt::format("{} has no fall \"{} {}\". There is: {}", robot->name, stance,
                               direction, join(known)));
}

}  // namespace traceur::fall
