#include "traceur/sim/robot.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>
#include <limits>
#include <set>

#include "traceur/core/is_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"

namespace traceur::sim {
namespace {

template <class Map>
std::vector<std::string> keysOf(const Map& map) {
  std::vector<std::string> keys;
  for (const auto& [key, unused] : map) keys.push_back(key);
  return keys;
}

void readMirrored(const TomlReader& reader, Robot& robot) {
  for (const std::string& name : reader.names()) {
    const TomlReader row = reader.table(name);
    MirroredPair pair{row.string("left"), row.string("right"), row.number("sign", 1)};
    if (std::abs(pair.sign) != 1) row.fail("sign", "\"sign\": expected 1 or -1");
    row.finish();
    robot.mirrored.emplace(name, pair);
  }
}

/// Reads each row once and calls set(joint, what was read, sign) for each joint its name means.
template <class Read, class Set>
void forEachJointRow(const TomlReader& reader, const Robot& robot, const Read& read,
                     const Set& set) {
  for (const std::string& name : reader.names()) {
    const TomlReader row = reader.table(name);
    const auto value = read(row);
    for (const SignedJoint& j : robot.jointsNamed(name)) set(j.joint, value, j.sign);
    row.finish();
  }
}

JointLimit readLimit(const TomlReader& row) {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<double> angle = {-kNone, kNone};
  if (row.has("angle")) angle = row.numbers("angle", 2);
  const JointLimit limit{row.numberOrInfinity("torque"), row.numberOrInfinity("speed"), angle[0],
                         angle[1]};
  if (!(limit.torque > 0)) row.fail("torque", "\"torque\": expected a positive number [N·m]");
  if (!(limit.speed > 0)) row.fail("speed", "\"speed\": expected a positive number [rad/s]");
  if (!(angle[0] < angle[1])) row.fail("angle", "\"angle\": expected [min, max] with min < max");
  return limit;
}

/// The <limit> of each joint of a URDF; an MJCF has none of this (its ranges are in the model).
void readUrdfLimits(const std::filesystem::path& file, Robot& robot) {
  tinyxml2::XMLDocument document;
  const std::string text = readFile(file);
  document.Parse(text.data(), text.size());
  const tinyxml2::XMLElement* root = document.RootElement();
  if (!root || std::string_view(root->Name()) != "robot") return;
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  for (auto* j = root->FirstChildElement("joint"); j; j = j->NextSiblingElement("joint")) {
    const tinyxml2::XMLElement* limit = j->FirstChildElement("limit");
    const char* name = j->Attribute("name");
    const char* type = j->Attribute("type");
    const std::string_view kind = type ? type : "";
    const bool turns_on = kind == "continuous";
    const bool has_none = kind == "fixed" || kind == "floating" || kind == "planar";
    if (!limit || !name || has_none) continue;
    JointLimit l{limit->DoubleAttribute("effort"), limit->DoubleAttribute("velocity"),
                 limit->DoubleAttribute("lower"), limit->DoubleAttribute("upper")};
    if (!(l.torque > 0)) l.torque = kNone;
    if (!(l.speed > 0)) l.speed = kNone;
    if (l.min > l.max && !turns_on) {
      throw InputError(
          fmt::format("{}:{}: joint \"{}\": lower {} > upper {}: expected lower < upper",
                      file.string(), limit->GetLineNum(), printable(name), l.min, l.max));
    }
    if (l.min == l.max || turns_on) {
      l.min = -kNone;
      l.max = kNone;
    }
    robot.limits[name] = l;
  }
}

}  // namespace

Eigen::Quaterniond rotationOf(const Vector3d& rpy) {
  return Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
         Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX());
}

Vector3d rpyOf(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d R = rotation.normalized().toRotationMatrix();
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0))),
          std::atan2(R(1, 0), R(0, 0))};
}

Vector3d rpyOf(const Eigen::Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
          std::atan2(R(1, 0), R(0, 0))};
}

std::vector<SignedJoint> Robot::jointsNamed(const std::string& word) const {
  const auto pair = mirrored.find(word);
  if (pair == mirrored.end()) return {{word, 1}};
  return {{pair->second.left, 1}, {pair->second.right, pair->second.sign}};
}

Robot Robot::fromFile(const std::filesystem::path& file) {
  Robot robot;
  if (file.extension() != ".toml") {
    readFile(file);  // says what is wrong with it, if anything
    robot.name = file.stem().string();
    robot.file = std::filesystem::absolute(file);
    readUrdfLimits(robot.file, robot);
    return robot;
  }
  robot.toml = file;
  const TomlValue document = parseToml(readFile(file), file.string());
  Diagnostics diagnostics(file.string());
  const TomlReader reader(document, diagnostics);
  robot.name = reader.string("name");
  robot.description = reader.string("description", "");
  const std::string model = reader.string("model");
  robot.file = std::filesystem::absolute(file.parent_path() / model);
  if (isFile(robot.file)) {
    readUrdfLimits(robot.file, robot);
  } else if (!model.empty()) {
    reader.fail("model", fmt::format("\"model\": no file {}", robot.file.string()));
  }
  robot.mass_scale = reader.number("mass_scale", 1);
  if (!(robot.mass_scale > 0)) reader.fail("mass_scale", "\"mass_scale\": expected a factor > 0");
  if (reader.has("published")) {
    const TomlReader p = reader.table("published");
    robot.published = PublishedFigures{p.number("mass"), p.number("height"), p.number("com_height"),
                                       static_cast<int>(p.number("joints")), p.string("source")};
    p.finish();
  }
  readMirrored(reader.table("mirrored"), robot);
  if (reader.has("motors")) {
    robot.motors.emplace();
    for (const std::string& word : reader.strings("motors")) {
      for (const SignedJoint& j : robot.jointsNamed(word)) robot.motors->insert(j.joint);
    }
  }
  forEachJointRow(reader.table("limits"), robot, readLimit,
                  [&](const std::string& joint, JointLimit limit, double sign) {
                    if (sign < 0) limit = {limit.torque, limit.speed, -limit.max, -limit.min};
                    robot.limits[joint] = limit;
                  });
  forEachJointRow(
      reader.table("gains"), robot,
      [](const TomlReader& row) {
        const JointGain gain{row.number("kp"), row.number("kd"), row.number("ki", 0)};
        if (!(gain.kp >= 0)) row.fail("kp", "\"kp\": expected a number >= 0 [N·m/rad]");
        if (!(gain.kd >= 0)) row.fail("kd", "\"kd\": expected a number >= 0 [N·m·s/rad]");
        if (!(gain.ki >= 0)) row.fail("ki", "\"ki\": expected a number >= 0 [N·m/(rad·s)]");
        return gain;
      },
      [&](const std::string& joint, JointGain gain, double) { robot.gains[joint] = gain; });
  const TomlReader limbs = reader.table("limbs");
  for (const std::string& name : limbs.names()) robot.limbs[name] = limbs.strings(name);
  const TomlReader bodies = reader.table("bodies");
  for (const std::string& name : bodies.names()) robot.bodies[name] = bodies.strings(name);
  const TomlReader contacts = reader.table("contacts");
  for (const std::string& name : contacts.names()) {
    const TomlReader row = contacts.table(name);
    const std::vector<double> at = row.numbers("at", 3);
    robot.contacts[name] = {row.string("body"), {at[0], at[1], at[2]}};
    row.finish();
  }
  const TomlReader poses = reader.table("poses");
  for (const std::string& name : poses.names()) {
    const TomlReader row = poses.table(name);
    Pose pose;
    for (const std::string& key : row.names()) {
      if (key == "root") {
        const TomlReader root = row.table("root");
        pose.root_rpy = {root.number("roll", 0), root.number("pitch", 0), root.number("yaw", 0)};
        root.finish();
        continue;
      }
      const double angle = row.number(key);
      for (const SignedJoint& j : robot.jointsNamed(key)) pose.joints[j.joint] = j.sign * angle;
    }
    robot.poses.emplace(name, std::move(pose));
  }
  reader.finish();
  diagnostics.throwIfAny();
  return robot;
}

}  // namespace traceur::sim
