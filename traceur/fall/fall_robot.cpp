#include "traceur/fall/fall_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "traceur/core/text.h"
#include "traceur/core/toml.h"

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

/// What a table says of it, the rest as in `otherwise`.
FallSetup::Quickness readQuickness(const TomlReader& reader,
                                   const FallSetup::Quickness& otherwise) {
  const FallSetup::Quickness quick{reader.number("rod_speed", otherwise.rod_speed),
                                   reader.number("stopper_speed", otherwise.stopper_speed),
                                   reader.number("stiffness", otherwise.stiffness)};
  if (!(quick.rod_speed >= 0)) reader.fail("rod_speed", "\"rod_speed\": expected ≥ 0 [m/s]");
  if (!(quick.stopper_speed > 0)) {
    reader.fail("stopper_speed", "\"stopper_speed\": expected > 0 [rad/s]");
  }
  if (!(quick.stiffness >= 0)) reader.fail("stiffness", "\"stiffness\": expected a factor ≥ 0");
  return quick;
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
    setup.quick_without[name] = readQuickness(row, setup.quick);
    row.finish();
  }
  reader.finish();
}

}  // namespace

FallSetup FallSetup::without(const std::string& node) const {
  FallSetup less = *this;
  less.graph = graph.without(node);
  if (const auto quicker = quick_without.find(node); quicker != quick_without.end()) {
    less.quick = quicker->second;
  }
  return less;
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
  const FallSetup::Quickness quick =
      readQuickness(reader, {reader.number("rod_speed"), reader.number("stopper_speed"), 1});
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
  falls.tracking.damping = reader.number("damping", 1);
  falls.tracking.rest_stiffness = reader.number("rest_stiffness", quick.stiffness);
  falls.tracking.rest_damping = reader.number("rest_damping", falls.tracking.damping);
  falls.tracking.support = reader.number("support", 0);
  falls.tracking.ramp = reader.number("ramp", 0.8);
  falls.tracking.rest_height = reader.number("rest_height", 0.9);
  for (const char* factor :
       {"damping", "rest_stiffness", "rest_damping", "support", "ramp", "rest_height"}) {
    if (!(reader.number(factor, 1) >= 0)) {
      reader.fail(factor, fmt::format("\"{}\": expected a factor ≥ 0", factor));
    }
  }
  for (const TomlReader& row : reader.tables("fall")) {
    FallSetup setup{read_pose(row, "stance"), row.string("direction"),
                    readGraph(row.table("graph"), robot), readQuickness(row, quick)};
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
    if (nodes.empty() || !graph.table(nodes.front()).has("next")) {
      row.fail("graph", "expected a first node, what the robot stands on, with a \"next\"");
    }
    row.finish();
    falls.setups.push_back(std::move(setup));
  }
  if (falls.setups.empty()) reader.fail("fall", "expected at least one [[fall]]");
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
