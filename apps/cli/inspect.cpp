// traceur inspect: what Traceur understands of a robot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/output.h"
#include "apps/cli/verbs.h"
#include "traceur/control/draft.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/render/offscreen.h"
#include "traceur/sim/recording.h"
#include "traceur/sim/world.h"
#include "traceur/skill/skill.h"

namespace traceur::cli {
namespace {

struct InspectArguments {
  std::string robot;
  std::string mjcf;
  std::string write;
  std::string picture;
  std::string pose;
  bool json = false;
};

/// A verb that takes a robot and what this one lacks for it; empty when nothing.
struct Need {
  std::string verb;
  std::vector<std::string> missing;
};

std::vector<Need> needs(const sim::Model& model) {
  const auto has_motor = [](const sim::Joint& j) { return j.motor >= 0; };
  const bool moves = std::any_of(model.joints().begin(), model.joints().end(), has_motor);
  std::vector<std::string> missing;
  if (!moves) missing.emplace_back("a hinge or slide with a name");
  if (!model.canTouchWorld()) {
    missing.emplace_back("a shape that collides: nothing of it can touch the ground");
  }
  return {{"learn", missing}};
}

/// What the robot's file leaves to each skill to say, or to be without.
std::vector<std::string> leftToSkills(const sim::Robot& robot, const sim::Model& model) {
  bool limits = true;
  bool gains = true;
  for (const sim::Joint& j : model.joints()) {
    limits = limits && std::isfinite(j.limit.torque) && std::isfinite(j.limit.speed);
    gains = gains && robot.gains.contains(j.name);
  }
  std::vector<std::string> left;
  if (!gains) left.emplace_back("kp and kd ([gains])");
  if (!limits) left.emplace_back("torque_limit and speed_limit ([limits])");
  if (robot.poses.empty()) left.emplace_back("every pose ([poses])");
  return left;
}

/// A pose of the robot's file or "zero"; without a name the standing one, or joint angles 0.
/// @throws InputError with a suggestion
sim::Pose poseOf(const sim::Robot& robot, const std::string& name) {
  const auto pose = robot.poses.find(name.empty() ? "stand" : name);
  if (pose != robot.poses.end()) return pose->second;
  if (name.empty() || name == "zero") return {};
  std::vector<std::string> names;
  for (const auto& [known, unused] : robot.poses) names.push_back(known);
  if (!robot.poses.contains("zero")) names.emplace_back("zero");
  throw InputError(fmt::format("--pose {}: no pose of that name: expected one of {}.{}", name,
                               join(names), didYouMean(name, names)));
}

/// Refuses to write over what might be the robot's own file.
void expectNew(const char* option, const std::string& file) {
  if (!std::filesystem::exists(file)) return;
  throw InputError(fmt::format("{} {}: exists already: expected a new file", option, file));
}

void writeNew(const char* option, const std::string& name, std::string_view text) {
  expectNew(option, name);
  PendingFile file(name);
  file.write(text);
  file.commit();
}

/// Drafts a robot.toml and says what came of it.
void writeDraft(const sim::Robot& bare, const std::string& file) {
  if (!bare.toml.empty()) {
    throw InputError(
        fmt::format("--write {}: {} says already what a draft would: expected an MJCF or URDF",
                    file, bare.toml.string()));
  }
  if (std::filesystem::path(file).extension() != ".toml") {
    throw InputError(fmt::format("--write {}: expected a name ending in .toml", file));
  }
  expectNew("--write", file);  // before the work
  const control::Draft draft = control::draftRobot(bare);
  writeNew("--write", file, control::tomlOf(draft, std::filesystem::absolute(file).parent_path()));
  for (const std::string& doubt : draft.doubts) note("{}: look: {}\n", file, doubt);
  const control::Standing& held = draft.standing;
  if (draft.stand_is.empty()) return;
  if (held.stands) {
    note("{}: stands: {}, held for {} s within {:.1f} mm\n", file, draft.stand_is, held.time,
         1000 * held.drift);
  } else {
    note("{}: does not stand: {}, held for {:.2f} s: change [gains] or poses.stand\n", file,
         draft.stand_is, held.time);
  }
}

void drawPicture(const std::shared_ptr<const sim::Model>& model, const std::string& pose,
                 const std::string& file) {
  static constexpr render::OffscreenOptions kSize = {.width = 640, .height = 640};  // [ours]
  if (std::filesystem::path(file).extension() != ".png") {
    throw InputError(fmt::format("--picture {}: expected a name ending in .png", file));
  }
  sim::World world(model);
  world.reset(model->stateOf(poseOf(*model->robot(), pose)));
  const sim::VectorXd no_torque = sim::VectorXd::Zero(model->nu());
  render::Offscreen drawing(model, kSize);
  render::writePng(drawing.draw(sim::frameOf(world.snapshot(), 0, no_torque)), file);
}

/// All that is told, as --json prints it.
nlohmann::ordered_json reportOf(const std::shared_ptr<const sim::Model>& model) {
  const sim::Robot* robot = model->robot().get();
  sim::World world(model);
  const sim::State zero = model->stateOf({});
  world.reset(zero);
  const double com_height = world.snapshot().com().z();
  int self_contacts = 0;
  world.reset(model->stateOf(poseOf(*robot, "")));
  for (const sim::Contact& c : world.snapshot().contacts()) {
    self_contacts += !model->isStatic(c.body_a) && !model->isStatic(c.body_b);
  }
  nlohmann::ordered_json j;
  j["name"] = robot->name;
  j["description"] = robot->description;
  j["file"] = robot->file.string();
  j["mass_kg"] = model->mass();
  j["com_height_at_zero_m"] = com_height;
  j["floating_base"] = model->rootDofs() == 6;
  j["root"] = model->bodyName(model->root());
  j["bodies"] = model->bodies() - 1;
  j["self_contacts_at_rest"] = self_contacts;
  j["dof"] = model->nv();
  for (const sim::Joint& joint : model->joints()) {
    const auto number = [](double x) {
      return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr);
    };
    const auto gain = robot->gains.find(joint.name);
    j["joints"].push_back({{"name", joint.name},
                           {"slides", joint.slides},
                           {"motor", joint.motor >= 0},
                           {"min_rad", number(joint.limit.min)},
                           {"max_rad", number(joint.limit.max)},
                           {"torque_Nm", number(joint.limit.torque)},
                           {"speed_rad_s", number(joint.limit.speed)},
                           {"kp", gain == robot->gains.end() ? 0 : gain->second.kp},
                           {"kd", gain == robot->gains.end() ? 0 : gain->second.kd}});
  }
  if (!model->ballJoints().empty()) j["ball_joints"] = model->ballJoints();
  for (const auto& [name, pair] : robot->mirrored) {
    j["mirrored"][name] = fmt::format("{}, {}{}", pair.left, pair.sign < 0 ? "-" : "", pair.right);
  }
  for (const auto& [name, bodies] : robot->limbs) j["limbs"][name] = bodies;
  for (const auto& [name, bodies] : robot->bodies) j["groups"][name] = bodies;
  for (const auto& [name, point] : robot->contacts) {
    j["contacts"][name] =
        fmt::format("{} at {} {} {} m", point.body, point.p_BP.x(), point.p_BP.y(), point.p_BP.z());
  }
  for (const auto& [name, unused] : robot->poses) j["poses"].push_back(name);
  for (const Need& n : needs(*model)) j["missing"][n.verb] = n.missing;
  j["left_to_skills"] = leftToSkills(*robot, *model);
  return j;
}

/// The same for a person.
void tell(const sim::Model& model, const nlohmann::ordered_json& j) {
  const sim::Robot* robot = model.robot().get();
  print("{}: {}\n", robot->name,
        robot->description.empty() ? robot->file.string() : robot->description);
  print("  mass {:.4g} kg, COM {:.4g} m above the ground at joint angles 0\n", model.mass(),
        j["com_height_at_zero_m"].get<double>());
  print("  root \"{}\" ({}), {} bodies, {} joints, {} degrees of freedom\n",
        model.bodyName(model.root()), model.rootDofs() == 6 ? "floats" : "fixed",
        model.bodies() - 1, model.joints().size(), model.nv());
  const int self_contacts = j["self_contacts_at_rest"];
  if (self_contacts > 0) {
    print("  warning: {} contacts inside the robot at rest\n", self_contacts);
  }
  print("\n  {:<18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>7}  motor\n", "joint", "min rad", "max rad",
        "N·m", "rad/s", "kp", "kd");
  const auto number = [](double x) {
    return std::isfinite(x) ? fmt::format("{:.4g}", x) : std::string("-");
  };
  for (const sim::Joint& joint : model.joints()) {
    const auto gain = robot->gains.find(joint.name);
    const bool has_gain = gain != robot->gains.end();
    print("  {:<18} {:>9} {:>9} {:>9} {:>9} {:>8} {:>7}  {}\n", joint.name, number(joint.limit.min),
          number(joint.limit.max), number(joint.limit.torque), number(joint.limit.speed),
          has_gain ? number(gain->second.kp) : "-", has_gain ? number(gain->second.kd) : "-",
          joint.motor >= 0 ? "yes" : "no");
  }
  if (std::any_of(model.joints().begin(), model.joints().end(),
                  [](const sim::Joint& joint) { return joint.slides; })) {
    print("  slides (m, N, m/s): {}\n", [&] {
      std::vector<std::string> names;
      for (const sim::Joint& joint : model.joints()) {
        if (joint.slides) names.push_back(joint.name);
      }
      return join(names);
    }());
  }
  if (!model.ballJoints().empty()) {
    print("  ball joints, which turn freely, without a motor: {}\n", join(model.ballJoints()));
  }
  for (const char* part : {"mirrored", "limbs", "groups", "contacts"}) {
    if (!j.contains(part)) continue;
    print("\n  {}\n", part);
    for (const auto& [name, value] : j[part].items()) {
      print("    {:<16} {}\n", name,
            value.is_string() ? value.get<std::string>()
                              : join(value.get<std::vector<std::string>>()));
    }
  }
  if (j.contains("poses")) {
    print("\n  poses: {}\n", join(j["poses"].get<std::vector<std::string>>()));
  }
  print("\n");
  for (const Need& n : needs(model)) {
    print("  {:<6} {}\n", n.verb,
          n.missing.empty() ? "has all it needs" : "misses " + join(n.missing, "; "));
  }
  if (const auto left = leftToSkills(*robot, model); !left.empty()) {
    print("  left to each skill to say: {}\n", join(left, "; "));
  }
}

int inspect(const InspectArguments& a) {
  std::filesystem::path robot_file = skill::findRobot(a.robot, std::filesystem::current_path());
  if (!a.write.empty()) {
    writeDraft(sim::Robot::fromFile(robot_file), a.write);
    robot_file = a.write;  // what is told from here on is what a person would be told of it
  }
  const auto robot = std::make_shared<const sim::Robot>(sim::Robot::fromFile(robot_file));
  const auto model = sim::Model::fromScene({.robot = robot});
  const nlohmann::ordered_json report = reportOf(model);
  if (!a.mjcf.empty()) writeNew("--mjcf", a.mjcf, model->mjcf());
  if (!a.picture.empty()) drawPicture(model, a.pose, a.picture);
  if (a.json) {
    printJson(report);
  } else {
    tell(*model, report);
  }
  return kDone;
}

}  // namespace

void addInspect(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<InspectArguments>();
  CLI::App* verb = program.add_subcommand(
      "inspect", "Say what Traceur understands of a robot, and what is missing to learn with it.");
  verb->add_option("ROBOT", a->robot, "A robot's name, its robot.toml, or any MJCF or URDF file")
      ->required();
  verb->add_option("--mjcf", a->mjcf, "Also write the composed scene, for other MuJoCo programs");
  verb->add_option("--write", a->write,
                   "Draft a robot.toml of an MJCF or URDF: pairs, limits, gains that hold it, "
                   "limbs, contact points, a standing pose");
  CLI::Option* picture =
      verb->add_option("--picture", a->picture, "Draw it: a .png, which is written over");
  verb->add_option("--pose", a->pose, "In the picture: a pose of its file; default: stand, or zero")
      ->needs(picture);
  verb->add_flag("--json", a->json, "As one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur inspect bioloid-gp\n"
      "  traceur inspect my_robot.urdf\n"
      "  traceur inspect my_robot.urdf --write robot.toml --picture stand.png\n"
      "  traceur inspect atlas --picture tuck.png --pose tuck");
  verb->callback([a, &exit_code] { exit_code = inspect(*a); });
}

}  // namespace traceur::cli
