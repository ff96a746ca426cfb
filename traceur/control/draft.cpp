#include "traceur/control/draft.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/core/utf8.h"

namespace traceur::control {
namespace {

namespace fs = std::filesystem;

using sim::Joint;
using sim::JointGain;
using sim::JointLimit;
using sim::MirroredPair;
using sim::Pose;
using sim::Robot;

constexpr double kBend = 0.25;  // of the knees: of the Atlas under models/ [rad]

double roundedTo(double x, double unit) {
  const double inverse = std::round(1 / unit);
  return std::round(x * inverse) / inverse + 0.0;  // no -0
}

// --------------------------------------------------------------------------------- what is derived

struct Candidate {
  std::string is;
  Pose pose;
};

/// Digits that a person reads: what is checked is what is written.
Pose readable(const Pose& pose, const sim::Model& model) {
  static constexpr double kUnit = 1e-4;
  Pose rounded;
  for (int i = 0; i < 3; ++i) rounded.root_rpy[i] = roundedTo(pose.root_rpy[i], kUnit);
  for (const Joint& j : model.joints()) {
    const auto at = pose.joints.find(j.name);
    const double angle = at == pose.joints.end() ? 0 : roundedTo(at->second, kUnit);
    // "root" is the attitude's key.
    if (angle != 0 && j.name != "root") rounded.joints[j.name] = angle;
  }
  return rounded;
}

std::vector<Candidate> candidates(const Robot& bare, sim::World& world,
                                  const sim::Mirroring& mirroring, const sim::Anatomy& anatomy) {
  std::vector<Candidate> found;
  for (const auto& [name, pose] : keyPoses(bare)) {
    found.push_back({fmt::format("the file's key frame \"{}\"", printable(name)), pose});
  }
  std::stable_partition(found.begin(), found.end(),
                        [](const Candidate& c) { return c.is.find("stand") != std::string::npos; });
  if (const auto bent = bentPose(world, mirroring, anatomy, kBend)) {
    found.push_back(
        {"knees a little bent, the centre of mass over the middle of the soles", *bent});
  }
  found.push_back({"joint angles 0", {}});
  for (Candidate& c : found) c.pose = readable(c.pose, world.model());
  return found;
}

/// Gains and a standing pose: tries each candidate with each factor until one stands.
/// @param gains  of a factor
void findStance(Draft& draft, const std::vector<Candidate>& candidates,
                const std::function<std::vector<JointGain>(double)>& gains,
                const sim::Anatomy& anatomy) {
  const std::vector<sim::BodyId> feet = feetOf(*draft.model, anatomy);
  for (const Candidate& c : candidates) {
    for (const double factor : kLadder) {
      const Standing standing = hold(draft.model, c.pose, gains(factor), feet, kHeld);
      if (draft.stand_is.empty() || standing.stands || standing.time > draft.standing.time) {
        draft.stand_is = c.is;
        draft.stiffness = factor;
        draft.standing = standing;
        draft.robot.poses["stand"] = c.pose;
      }
      if (standing.stands) return;
    }
  }
}

/// Bodies that press on each other in the pose "stand", by name.
std::set<std::string> overlaps(const Draft& draft) {
  std::set<std::string> found;
  const auto stand = draft.robot.poses.find("stand");
  if (stand == draft.robot.poses.end()) return found;
  const sim::Model& model = *draft.model;
  sim::World world(draft.model);
  world.reset(model.stateOf(stand->second));
  for (const sim::Contact& c : world.snapshot().contacts()) {
    if (!model.isRobot(c.body_a) || !model.isRobot(c.body_b)) continue;
    found.insert(model.bodyName(c.body_a) + " and " + model.bodyName(c.body_b));
  }
  return found;
}

bool saysAnything(const JointLimit& limit) {
  return std::isfinite(limit.torque) || std::isfinite(limit.speed) || std::isfinite(limit.max);
}

void addDoubts(Draft& draft, const sim::Mirroring& mirroring, bool floats) {
  const auto doubt = [&](std::string sentence) { draft.doubts.push_back(std::move(sentence)); };
  std::vector<std::string> no_torque;
  for (const Joint& j : draft.model->joints()) {
    if (j.motor >= 0 && !std::isfinite(j.limit.torque)) no_torque.push_back(j.name);
  }
  if (!no_torque.empty()) {
    doubt(
        fmt::format("The file says nothing of the torque of {} motors ({}{}): they are given as "
                    "much as they ask for.",
                    no_torque.size(), no_torque[0], no_torque.size() > 1 ? ", …" : ""));
  }
  for (const std::string& pair : mirroring.refused) {
    doubt(fmt::format("{} are a pair by name, but not each other's mirror image at joint angles 0.",
                      pair));
  }
  if (mirroring.pairs.empty()) doubt("No two joints are a left and a right one.");
  if (mirroring.plane.left.y() < 0.9) {
    doubt(
        fmt::format("Its left is along ({:.2g}, {:.2g}, 0), not along y: skills take x for "
                    "forward.",
                    mirroring.plane.left.x(), mirroring.plane.left.y()));
  }
  if (floats && !draft.robot.limbs.contains("left_leg")) {
    doubt("No limb reaches the ground at joint angles 0: is that how it stands, with z up?");
  }
  if (const auto pairs = overlaps(draft); !pairs.empty()) {
    doubt(fmt::format("In the pose stand {} pairs of its parts press on each other ({}{}).",
                      pairs.size(), *pairs.begin(), pairs.size() > 1 ? ", …" : ""));
  }
  if (!floats) doubt("Its base is fixed to the world: it was not made to stand.");
}

}  // namespace

Draft draftRobot(const Robot& bare) {
  Draft draft;
  draft.model = sim::Model::fromScene({.robot = std::make_shared<const Robot>(bare)});
  const sim::Model& model = *draft.model;
  Robot& robot = draft.robot;
  robot.file = bare.file;
  robot.name = model.name().empty() ? bare.name : model.name();

  sim::World world(draft.model);
  world.reset(model.stateOf({}));
  const sim::Mirroring mirroring = mirroringOf(world);
  const sim::Anatomy anatomy = anatomyOf(world, mirroring);
  robot.description = fmt::format("{:.4g} kg, {} joints, centre of mass {:.3g} m above the ground",
                                  model.mass(), model.joints().size(), world.snapshot().com().z());
  robot.mirrored = mirroring.pairs;
  robot.limbs = anatomy.limbs;
  robot.bodies = anatomy.bodies;
  for (const auto& [name, point] : anatomy.contacts) {
    sim::ContactPoint& rounded = robot.contacts[name];
    rounded.body = point.body;
    for (int i = 0; i < 3; ++i) rounded.p_BP[i] = roundedTo(point.p_BP[i], 1e-4);
  }
  for (const Joint& j : model.joints()) {
    if (saysAnything(j.limit)) robot.limits[j.name] = j.limit;
  }
  const auto gains = [&](double factor) {
    world.reset(model.stateOf({}));
    return gainsByPhysics(world, mirroring, anatomy, factor);
  };
  const bool floats = model.rootDofs() == 6;
  if (floats) findStance(draft, candidates(bare, world, mirroring, anatomy), gains, anatomy);
  const std::vector<JointGain> chosen = gains(draft.stiffness);
  for (size_t i = 0; i < chosen.size(); ++i) {
    const Joint& j = model.joints()[i];
    if (j.motor >= 0) robot.gains[j.name] = chosen[i];
  }
  addDoubts(draft, mirroring, floats);
  return draft;
}

// --------------------------------------------------------------------------------- what is written

namespace {

/// A basic string of TOML.
std::string quoted(const std::string& text) {
  if (!isUtf8(text)) {
    throw InputError(fmt::format(
        "\"{}\": expected a name in UTF-8, which is all that TOML can hold", printable(text)));
  }
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || code == 0x7f) {
      out += fmt::format("\\u{:04x}", code);
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string key(const std::string& text) {
  const bool bare = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return bare ? text : quoted(text);
}

std::string list(const std::vector<std::string>& words) {
  std::vector<std::string> each;
  each.reserve(words.size());
  for (const std::string& word : words) each.push_back(quoted(word));
  return "[" + join(each) + "]";
}

/// The rows of a table, their signs of equality under each other.
class Table {
 public:
  void add(const std::string& name, std::string value) {
    rows_.emplace_back(key(name), std::move(value));
  }
  std::string text(const std::string& title, const std::string& comment) const {
    if (rows_.empty()) return "";
    size_t width = 0;
    for (const auto& [name, value] : rows_) width = std::max(width, name.size());
    std::string out = fmt::format("\n{}[{}]\n", comment, title);
    for (const auto& [name, value] : rows_) {
      out += fmt::format("{}{} = {}\n", name, std::string(width - name.size(), ' '), value);
    }
    return out;
  }

 private:
  std::vector<std::pair<std::string, std::string>> rows_;
};

/// One word for both joints of a pair where what is said of them is the same, else a joint's own.
struct Row {
  std::string word;
  std::string joint;
};

class Writer {
 public:
  explicit Writer(const Draft& draft) : draft_(draft), robot_(draft.robot) {
    for (const auto& [name, pair] : robot_.mirrored) {
      word_[pair.left] = name;
      follows_.insert(pair.right);
    }
  }

  std::string text(const fs::path& folder) const;

 private:
  /// In the order of the model's joints.
  /// @param same  whether a pair's two may be said in one row
  template <class Same>
  std::vector<Row> rows(const Same& same) const;
  std::string mirrored() const;
  std::string limits() const;
  std::string gains() const;
  std::string places() const;
  std::string poses() const;

  const Draft& draft_;
  const Robot& robot_;
  std::map<std::string, std::string> word_;  // of a left joint
  std::set<std::string> follows_;            // right joints
};

template <class Same>
std::vector<Row> Writer::rows(const Same& same) const {
  std::vector<Row> found;
  for (const Joint& j : draft_.model->joints()) {
    const auto word = word_.find(j.name);
    if (word == word_.end()) {
      if (!follows_.contains(j.name)) found.push_back({j.name, j.name});
      continue;
    }
    const MirroredPair& pair = robot_.mirrored.at(word->second);
    if (same(pair)) {
      found.push_back({word->second, pair.left});
    } else {
      found.push_back({pair.left, pair.left});
      found.push_back({pair.right, pair.right});
    }
  }
  return found;
}

std::string Writer::mirrored() const {
  Table table;
  for (const Row& row : rows([](const MirroredPair&) { return true; })) {
    const auto pair = robot_.mirrored.find(row.word);
    if (pair == robot_.mirrored.end()) continue;
    table.add(row.word,
              fmt::format("{{ left = {}, right = {}, sign = {} }}", quoted(pair->second.left),
                          quoted(pair->second.right), pair->second.sign));
  }
  return table.text("mirrored",
                    "# One name for a left and a right joint: value v means left = v, right = sign "
                    "* v. sign = -1 where equal\n# motions have opposite angles, by the joints' "
                    "axes at joint angles 0.\n");
}

std::string Writer::limits() const {
  const auto said = [&](const std::string& joint) {
    const auto at = robot_.limits.find(joint);
    return at == robot_.limits.end() ? nullptr : &at->second;
  };
  Table table;
  const auto same = [&](const MirroredPair& pair) {
    const JointLimit* left = said(pair.left);
    const JointLimit* right = said(pair.right);
    if (!left || !right) return false;
    const double min = pair.sign > 0 ? left->min : -left->max;
    const double max = pair.sign > 0 ? left->max : -left->min;
    return left->torque == right->torque && left->speed == right->speed && min == right->min &&
           max == right->max;
  };
  for (const Row& row : rows(same)) {
    const JointLimit* limit = said(row.joint);
    if (!limit) continue;
    std::string angle;
    if (std::isfinite(limit->max)) {
      angle = fmt::format(", angle = [{}, {}]", limit->min, limit->max);
    }
    table.add(row.word,
              fmt::format("{{ torque = {}, speed = {}{} }}", limit->torque, limit->speed, angle));
  }
  return table.text("limits",
                    "# What the file says. torque N·m, speed rad/s, angle rad (of a pair: of the "
                    "left one); inf: it says none.\n");
}

std::string Writer::gains() const {
  const Standing& held = draft_.standing;
  std::string comment =
      "# kp N·m/rad, kd N·m·s/rad: by the weight that each joint carries "
      "(traceur/control/stance.h)";
  if (draft_.stiffness != 1) comment += fmt::format(", times {}", draft_.stiffness);
  comment += ".\n";
  if (held.stands) {
    comment += fmt::format(
        "# Checked: `stand` was held for {} s in simulation and withstood a nudge, the "
        "centre of mass within {:.1f} mm.\n",
        held.time, 1000 * held.drift);
  } else if (!draft_.stand_is.empty() && held.time < kHeld) {
    comment += fmt::format(
        "# It does NOT stand: with these it fell after {:.2f} s, with others no later.\n",
        held.time);
  } else if (!draft_.stand_is.empty()) {
    comment += fmt::format(
        "# It does NOT stand still: after {} s its joints move with up to {:.2g} rad/s.\n",
        held.time, held.speed);
  }
  const auto same = [&](const MirroredPair& pair) {
    const auto left = robot_.gains.find(pair.left);
    const auto right = robot_.gains.find(pair.right);
    return left != robot_.gains.end() && right != robot_.gains.end() &&
           left->second.kp == right->second.kp && left->second.kd == right->second.kd;
  };
  Table table;
  for (const Row& row : rows(same)) {
    const auto gain = robot_.gains.find(row.joint);
    if (gain == robot_.gains.end()) continue;
    table.add(row.word, fmt::format("{{ kp = {}, kd = {} }}", gain->second.kp, gain->second.kd));
  }
  return table.text("gains", comment);
}

std::string Writer::places() const {
  Table limbs;
  for (const auto& [name, bodies] : robot_.limbs) limbs.add(name, list(bodies));
  Table contacts;
  for (const auto& [name, point] : robot_.contacts) {
    contacts.add(name, fmt::format("{{ body = {}, at = [{}, {}, {}] }}", quoted(point.body),
                                   point.p_BP.x(), point.p_BP.y(), point.p_BP.z()));
  }
  Table groups;
  for (const auto& [name, bodies] : robot_.bodies) groups.add(name, list(bodies));
  return limbs.text("limbs", "# Bodies from the root outwards.\n") +
         contacts.text("contacts",
                       "# Corners of the soles, finger tips: m, in the body's frame.\n") +
         groups.text("bodies", "");
}

std::string Writer::poses() const {
  if (draft_.stand_is.empty()) return "";
  Table table;
  table.add("zero", "{}");
  for (const auto& entry : robot_.poses) {  // whole: clang before 16 captures no parts of one
    const Pose& pose = entry.second;
    const auto angle = [&](const std::string& joint) {
      const auto at = pose.joints.find(joint);
      return at == pose.joints.end() ? 0 : at->second;
    };
    const auto same = [&](const MirroredPair& pair) {
      return angle(pair.right) == pair.sign * angle(pair.left);
    };
    std::vector<std::string> words;
    for (const Row& row : rows(same)) {
      if (angle(row.joint) == 0) continue;
      words.push_back(fmt::format("{} = {}", key(row.word), angle(row.joint)));
    }
    const sim::Vector3d& rpy = pose.root_rpy;
    if (!rpy.isZero(0)) {
      words.push_back(
          fmt::format("root = {{ roll = {}, pitch = {}, yaw = {} }}", rpy.x(), rpy.y(), rpy.z()));
    }
    table.add(entry.first, words.empty() ? "{}" : "{ " + join(words) + " }");
  }
  return table.text("poses", fmt::format("# rad. stand: {}.\n", draft_.stand_is));
}

std::string Writer::text(const fs::path& folder) const {
  std::string out = fmt::format(
      "# Drafted from {} by `traceur inspect --write`: a first guess, to be changed by who knows "
      "better.\n# Units: m, rad, N·m, s, kg.\n",
      printable(robot_.file.filename().string()));
  for (const std::string& doubt : draft_.doubts) out += "# Look: " + printable(doubt) + "\n";
  out += fmt::format("name = {}\n", quoted(robot_.name));
  out += fmt::format("description = {}\n", quoted(robot_.description));
  out += fmt::format("model = {}\n",
                     quoted(fs::proximate(robot_.file, fs::absolute(folder)).string()));
  return out + mirrored() + limits() + gains() + places() + poses();
}

}  // namespace

std::string tomlOf(const Draft& draft, const fs::path& folder) {
  return Writer(draft).text(folder);
}

}  // namespace traceur::control
