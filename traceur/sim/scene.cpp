#include "traceur/sim/scene.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <set>

#include "traceur/core/is_file.h"
#include "traceur/core/toml.h"
#include "traceur/sim/mujoco_compat.h"

namespace traceur::sim {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
namespace fs = std::filesystem;

/// Thickness of a wall behind its face [m]: more than anything penetrates at our speeds.
constexpr double kWallThickness = 0.2;

std::string numbers(const Vector3d& v) {
  return fmt::format("{} {} {}", v.x(), v.y(), v.z());
}

std::string quaternion(const Vector3d& rpy) {
  const Eigen::Quaterniond R = rotationOf(rpy);
  return fmt::format("{} {} {} {}", R.w(), R.x(), R.y(), R.z());
}

[[noreturn]] void fail(const fs::path& file, const XMLElement* at, const std::string& what) {
  throw InputError(at ? fmt::format("{}:{}: {}", file.string(), at->GetLineNum(), what)
                      : fmt::format("{}: {}", file.string(), what));
}

void forEachElement(XMLElement* root, const std::function<void(XMLElement*)>& visit) {
  for (XMLElement* e = root->FirstChildElement(); e;) {
    XMLElement* next = e->NextSiblingElement();
    visit(e);
    forEachElement(e, visit);
    e = next;
  }
}

void parse(XMLDocument& document, const std::string& text, const fs::path& file) {
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(fmt::format("{}:{}: not well-formed XML ({})", file.string(),
                                 document.ErrorLineNum(), document.ErrorName()));
  }
}

XMLElement* childOrNew(XMLElement* parent, const char* name) {
  XMLElement* child = parent->FirstChildElement(name);
  return child ? child : parent->InsertNewChildElement(name);
}

/// Puts the children of every <include file="…"/> in its place. As for MuJoCo, each file is
/// included once.
void resolveIncludes(XMLElement* root, const fs::path& file, std::set<fs::path>& included_files) {
  for (XMLElement* e = root->FirstChildElement(); e;) {
    XMLElement* next = e->NextSiblingElement();
    if (std::strcmp(e->Name(), "include") == 0) {
      const char* name = e->Attribute("file");
      if (!name) fail(file, e, "<include> without a file");
      const fs::path path = (file.parent_path() / name).lexically_normal();
      if (!included_files.insert(path).second) {
        fail(file, e, fmt::format("{} is included twice", path.string()));
      }
      XMLDocument included;
      parse(included, readFile(path), path);
      if (!included.RootElement()) fail(path, nullptr, "expected an element, got none");
      resolveIncludes(included.RootElement(), path, included_files);
      tinyxml2::XMLNode* after = e;
      for (auto* c = included.RootElement()->FirstChild(); c; c = c->NextSibling()) {
        after = root->InsertAfterChild(after, c->DeepClone(root->GetDocument()));
      }
      root->DeleteChild(e);
    } else {
      resolveIncludes(e, file, included_files);
    }
    e = next;
  }
}

/// Makes mesh and texture paths absolute, so that the text can be compiled from anywhere.
void resolveAssets(XMLElement* mujoco, const fs::path& file) {
  fs::path mesh_dir = file.parent_path();
  fs::path texture_dir = file.parent_path();
  for (XMLElement* c = mujoco->FirstChildElement("compiler"); c;
       c = c->NextSiblingElement("compiler")) {
    if (const char* dir = c->Attribute("assetdir")) mesh_dir = texture_dir = mesh_dir / dir;
    if (const char* dir = c->Attribute("meshdir")) mesh_dir = file.parent_path() / dir;
    if (const char* dir = c->Attribute("texturedir")) texture_dir = file.parent_path() / dir;
    for (const char* a : {"assetdir", "meshdir", "texturedir"}) c->DeleteAttribute(a);
  }
  for (XMLElement* assets = mujoco->FirstChildElement("asset"); assets;
       assets = assets->NextSiblingElement("asset")) {
    forEachElement(assets, [&](XMLElement* e) {
      const bool is_mesh = std::strcmp(e->Name(), "mesh") == 0;
      for (const tinyxml2::XMLAttribute* a = e->FirstAttribute(); a; a = a->Next()) {
        if (std::strncmp(a->Name(), "file", 4) != 0) continue;
        const fs::path path = (is_mesh ? mesh_dir : texture_dir) / a->Value();
        if (!isFile(path)) fail(file, e, "no such asset: " + path.string());
        e->SetAttribute(a->Name(), path.c_str());
      }
    });
  }
}

/// A URDF's base floats in MuJoCo when a link named "world" carries it by a floating joint.
/// Limits that MuJoCo 2.2 does not read from URDF (effort, velocity) come from the TOML.
std::string mjcfOfUrdf(XMLElement* robot, const fs::path& file) {
  std::set<std::string> children;
  for (auto* j = robot->FirstChildElement("joint"); j; j = j->NextSiblingElement("joint")) {
    const XMLElement* child = j->FirstChildElement("child");
    if (child && child->Attribute("link")) children.insert(child->Attribute("link"));
  }
  std::string base;
  for (auto* l = robot->FirstChildElement("link"); l; l = l->NextSiblingElement("link")) {
    const char* name = l->Attribute("name");
    if (name && !children.contains(name) && base.empty()) base = name;
  }
  if (base.empty()) fail(file, robot, "no link without a parent: where does the robot begin?");
  if (base != "world") {
    robot->InsertNewChildElement("link")->SetAttribute("name", "world");
    XMLElement* joint = robot->InsertNewChildElement("joint");
    joint->SetAttribute("name", "root");
    joint->SetAttribute("type", "floating");
    joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
    joint->InsertNewChildElement("child")->SetAttribute("link", base.c_str());
  }
  forEachElement(robot, [&](XMLElement* e) {
    const char* name = e->Attribute("filename");
    if (!name || std::strcmp(e->Name(), "mesh") != 0) return;
    std::string_view text(name);
    if (const size_t scheme = text.find("://"); scheme != text.npos) {
      // package://name/path: looked for beside the URDF and in the folders above it.
      text.remove_prefix(scheme + 3);
      const fs::path inside = text.substr(std::min(text.find('/') + 1, text.size()));
      fs::path dir = fs::absolute(file).parent_path();
      while (!isFile(dir / inside) && dir.has_relative_path()) dir = dir.parent_path();
      e->SetAttribute("filename", (dir / inside).c_str());
    } else {
      e->SetAttribute("filename", fs::absolute(file.parent_path() / name).c_str());
    }
    if (!isFile(e->Attribute("filename"))) {
      fail(file, e, fmt::format("no such mesh: {}", name));
    }
  });
  XMLElement* compiler = childOrNew(childOrNew(robot, "mujoco"), "compiler");
  compiler->SetAttribute("strippath", "false");
  compiler->SetAttribute("fusestatic", "false");
  tinyxml2::XMLPrinter printer;
  robot->GetDocument()->Print(&printer);
  std::string error;
  std::string mjcf = urdfToMjcf(printer.CStr(), error);
  if (mjcf.empty()) fail(file, nullptr, error);
  return mjcf;
}

ModelPointer compile(const XMLDocument& document, const fs::path& file) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  std::string error;
  ModelPointer model(loadXmlText(printer.CStr(), error), mj_deleteModel);
  if (!model) fail(file, nullptr, error);
  return model;
}

/// Removes the actuators of joints, which get motors of their own, the sensors of those actuators,
/// and the key frames, whose sizes another actuator or a prop would make wrong.
void removeActuators(XMLElement* mujoco) {
  const auto remove = [&](const char* section, const auto& condition) {
    for (XMLElement* s = mujoco->FirstChildElement(section); s;
         s = s->NextSiblingElement(section)) {
      for (XMLElement* e = s->FirstChildElement(); e;) {
        XMLElement* next = e->NextSiblingElement();
        if (condition(*e)) s->DeleteChild(e);
        e = next;
      }
    }
  };
  std::set<std::string> removed;
  remove("actuator", [&](const XMLElement& e) {
    if (!e.Attribute("joint") && !e.Attribute("jointinparent")) return false;
    if (const char* name = e.Attribute("name")) removed.insert(name);
    return true;
  });
  remove("sensor", [&](const XMLElement& e) {
    const char* actuator = e.Attribute("actuator");
    return actuator && removed.contains(actuator);
  });
  remove("keyframe", [](const XMLElement&) { return true; });
}

void scaleNumbers(XMLElement* e, const char* name, double factor) {
  const char* text = e->Attribute(name);
  if (!text) return;
  std::string scaled;
  for (const char* at = text; *at;) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at) break;
    scaled += fmt::format("{}{}", scaled.empty() ? "" : " ", value * factor);
    at = end;
  }
  e->SetAttribute(name, scaled.c_str());
}

/// Scales every mass and inertia, whether the file says it or leaves it to geoms.
void scaleMasses(XMLElement* mujoco, double factor) {
  static constexpr double kDensity = 1000;  // [kg/m³], MJCF's where the file says none
  XMLElement* geom = childOrNew(childOrNew(mujoco, "default"), "geom");
  if (!geom->Attribute("density")) geom->SetAttribute("density", kDensity);
  forEachElement(mujoco, [&](XMLElement* e) {
    if (std::strcmp(e->Name(), "inertial") == 0) {
      for (const char* name : {"mass", "diaginertia", "fullinertia"}) scaleNumbers(e, name, factor);
    } else if (std::strcmp(e->Name(), "geom") == 0) {
      for (const char* name : {"mass", "density"}) scaleNumbers(e, name, factor);
    }
  });
}

/// @throws InputError for the first body that scaleMasses did not scale, as with settotalmass
void checkMasses(const mjModel& before, const mjModel& after, double factor, const fs::path& file) {
  for (int b = 1; b < before.nbody; ++b) {
    const double expected = factor * before.body_mass[b];
    if (std::abs(after.body_mass[b] - expected) <= 1e-6 * expected) continue;
    const char* name = mj_id2name(&before, mjOBJ_BODY, b);
    fail(file, nullptr,
         fmt::format("mass_scale {} cannot be applied: body \"{}\" weighs {} kg instead of {} kg "
                     "with it (the file's compiler options decide masses themselves)",
                     factor, name ? name : "", after.body_mass[b], expected));
  }
}

/// Writes the limits into the joints and gives each hinge and slide a motor of gear 1.
void addLimitsAndMotors(XMLElement* mujoco, const Robot& robot, const mjModel& compiled) {
  double per_radian = 180 / M_PI;  // MJCF angles are degrees unless its compiler says otherwise
  for (XMLElement* c = mujoco->FirstChildElement("compiler"); c;
       c = c->NextSiblingElement("compiler")) {
    const char* angle = c->Attribute("angle");
    if (angle) per_radian = std::strcmp(angle, "radian") == 0 ? 1 : 180 / M_PI;
  }
  XMLElement* actuators = nullptr;
  for (XMLElement* w = mujoco->FirstChildElement("worldbody"); w;
       w = w->NextSiblingElement("worldbody")) {
    forEachElement(w, [&](XMLElement* e) {
      if (std::strcmp(e->Name(), "joint") != 0 || !e->Attribute("name")) return;
      const std::string name = e->Attribute("name");
      // A default class may have said the type: the compiled model knows.
      const int joint = mj_name2id(&compiled, mjOBJ_JOINT, name.c_str());
      const int type = joint < 0 ? -1 : compiled.jnt_type[joint];
      if (type != mjJNT_HINGE && type != mjJNT_SLIDE) return;
      const double unit = type == mjJNT_SLIDE ? 1 : per_radian;
      const auto limit = robot.limits.find(name);
      if (limit != robot.limits.end() && std::isfinite(limit->second.max)) {
        e->SetAttribute("limited", "true");
        e->SetAttribute(
            "range",
            fmt::format("{} {}", limit->second.min * unit, limit->second.max * unit).c_str());
      }
      if (!actuators) actuators = mujoco->InsertNewChildElement("actuator");
      XMLElement* motor = actuators->InsertNewChildElement("motor");
      motor->SetAttribute("name", name.c_str());
      motor->SetAttribute("joint", name.c_str());
      motor->SetAttribute("gear", 1);  // whatever the file's defaults say of actuators
      motor->SetAttribute("ctrllimited", "false");
      motor->SetAttribute("forcelimited", "false");
    });
  }
}

void addMaterial(XMLElement* geom, const Material& m) {
  geom->SetAttribute("contype", 1);  // whatever the robot's file has as defaults
  geom->SetAttribute("conaffinity", 1);
  geom->SetAttribute("margin", 0);
  geom->SetAttribute("gap", 0);
  geom->SetAttribute("priority", 1);  // the scene's surface decides, whatever the robot's file says
  geom->SetAttribute("condim", m.rolling > 0 ? 6 : 3);
  // sliding [-], torsional and rolling [m]
  geom->SetAttribute("friction", fmt::format("{} 0.005 {}", m.friction, m.rolling).c_str());
  geom->SetAttribute("solref", fmt::format("{} 1", m.compliance).c_str());
  geom->SetAttribute("solimp", "0.95 0.99 0.001");
}

void addGround(XMLElement* world, const Material& material) {
  XMLElement* geom = world->InsertNewChildElement("geom");
  geom->SetAttribute("name", "ground");
  geom->SetAttribute("type", "plane");
  geom->SetAttribute("size", "0 0 0.05");  // endless
  geom->SetAttribute("material", "traceur_ground");
  addMaterial(geom, material);
}

void addProp(XMLElement* world, const Prop& p) {
  XMLElement* body = world->InsertNewChildElement("body");
  body->SetAttribute("name", p.name.c_str());
  body->SetAttribute("pos", numbers(p.position).c_str());
  body->SetAttribute("quat", quaternion(p.rpy).c_str());
  if (p.mass > 0) body->InsertNewChildElement("freejoint")->SetAttribute("name", p.name.c_str());
  XMLElement* geom = body->InsertNewChildElement("geom");
  geom->SetAttribute("name", p.name.c_str());
  switch (p.shape) {
    case Prop::Shape::kBox:
      geom->SetAttribute("type", "box");
      geom->SetAttribute("size", numbers(p.size).c_str());
      break;
    case Prop::Shape::kBall:
      geom->SetAttribute("type", "sphere");
      geom->SetAttribute("size", p.size.x());
      break;
    case Prop::Shape::kCapsule:
      geom->SetAttribute("type", "capsule");
      geom->SetAttribute("size", fmt::format("{} {}", p.size.x(), p.size.y()).c_str());
      break;
  }
  if (p.mass > 0) {
    geom->SetAttribute("mass", p.mass);
    if (p.hollow) {
      const double inertia = 2.0 / 3.0 * p.mass * p.size.x() * p.size.x();
      XMLElement* inertial = body->InsertNewChildElement("inertial");
      inertial->SetAttribute("pos", "0 0 0");
      inertial->SetAttribute("mass", p.mass);
      inertial->SetAttribute("diaginertia", numbers(Vector3d::Constant(inertia)).c_str());
    }
  }
  geom->SetAttribute("rgba", p.mass > 0 ? "0.85 0.45 0.15 1" : "0.62 0.66 0.70 1");
  addMaterial(geom, p.material);
}

/// Sky, light and ground grid: what makes a picture readable, without effect on the physics.
/// Its grid has squares of `square` metres.
std::string look(double square) {
  return fmt::format(R"(
<mujoco>
  <visual>
    <headlight ambient="0.4 0.4 0.4" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
    <quality shadowsize="4096" offsamples="4"/>
    <map znear="0.01" shadowclip="2" fogstart="5" fogend="18"/>
    <rgba fog="0.95 0.955 0.96 1" haze="0.95 0.955 0.96 1"/>
  </visual>
  <asset>
    <texture name="traceur_sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0.95 0.955 0.96" width="128" height="768"/>
    <texture name="traceur_grid" type="2d" builtin="checker" rgb1="0.96 0.965 0.97" rgb2="0.90 0.905 0.91" mark="edge" markrgb="0.80 0.81 0.82" width="512" height="512"/>
    <material name="traceur_ground" texture="traceur_grid" texrepeat="{0} {0}" texuniform="true" reflectance="0" specular="0"/>
  </asset>
  <worldbody>
    <light name="traceur_sun" directional="true" pos="0 0 4" dir="-0.25 0.45 -1" diffuse="0.48 0.48 0.48" specular="0.15 0.15 0.15" castshadow="true"/>
  </worldbody>
</mujoco>)",
                     1 / square);
}

/// 0.1 m for a small robot, else 1 m.
double gridSquare(const Scene& scene) {
  static constexpr double kSmall =
      0.8;  // published height [m]: toddler-size robots and less [ours]
  const bool small =
      scene.robot && scene.robot->published && scene.robot->published->height < kSmall;
  return small ? 0.1 : 1.0;
}

void addLook(XMLElement* mujoco, double square) {
  XMLDocument parts;
  parts.Parse(look(square).c_str());
  for (auto* c = parts.RootElement()->FirstChild(); c; c = c->NextSibling()) {
    mujoco->InsertEndChild(c->DeepClone(mujoco->GetDocument()));
  }
}

void checkMaterial(const std::string& of, const Material& m, double time_step) {
  if (!(m.compliance >= 2 * time_step)) {
    throw InputError(
        fmt::format("scene: {}: compliance {} s: expected at least twice the time step, {} s", of,
                    m.compliance, 2 * time_step));
  }
  if (!(m.friction >= 0) || !(m.rolling >= 0)) {
    throw InputError(fmt::format("scene: {}: friction {}, rolling {}: expected numbers >= 0", of,
                                 m.friction, m.rolling));
  }
}

/// @param robot  the document that the props are added to
void checkProps(const Scene& scene, XMLElement* robot) {
  std::set<std::string> taken = {"world", "ground"};
  forEachElement(robot, [&](XMLElement* e) {
    for (const char* kind : {"body", "geom", "joint", "freejoint"}) {
      if (std::strcmp(e->Name(), kind) != 0) continue;
      if (const char* name = e->Attribute("name")) taken.insert(name);
    }
  });
  for (const Prop& p : scene.props) {
    const std::string who = fmt::format("prop \"{}\"", p.name);
    const auto refuse = [&](const std::string& why) {
      throw InputError(fmt::format("scene: {}: {}", who, why));
    };
    if (p.name.empty()) refuse("expected a name");
    if (!taken.insert(p.name).second) refuse("something else in the scene has this name");
    const int sizes = p.shape == Prop::Shape::kBox ? 3 : p.shape == Prop::Shape::kCapsule ? 2 : 1;
    if (!(p.size.head(sizes).minCoeff() > 0) || !p.size.head(sizes).allFinite()) {
      refuse(fmt::format("size {}: expected lengths > 0", numbers(p.size)));
    }
    if (!p.position.allFinite() || !p.rpy.allFinite()) refuse("expected a finite place");
    if (!(p.mass >= 0) || !std::isfinite(p.mass)) {
      refuse(fmt::format("mass {} kg: expected 0 (fixed) or more", p.mass));
    }
    checkMaterial(who, p.material, scene.time_step);
  }
}

/// Room for what props add to a robot's contacts.
std::string roomFor(const Scene& scene) {
  // A box that lies on another one touches it in up to 8 points, and another lies on it; what is
  // fixed is touched by others only [ours].
  static constexpr int kFree = 16;
  static constexpr int kFixed = 8;
  bool rolls = scene.ground_material.rolling > 0;
  int contacts = 0;
  for (const Prop& p : scene.props) {
    contacts += p.mass > 0 ? kFree : kFixed;
    rolls = rolls || p.material.rolling > 0;
  }
  return sizeAttributes(contacts, rolls ? 10 : 4);  // rows of a friction pyramid, condim 6 or 3
}

}  // namespace

Prop wall(std::string name, const Vector3d& position, double yaw, double width, double height) {
  const Vector3d facing(std::cos(yaw), std::sin(yaw), 0);
  return {.name = std::move(name),
          .shape = Prop::Shape::kBox,
          .size = {kWallThickness / 2, width / 2, height / 2},
          .position = position - facing * kWallThickness / 2 + Vector3d(0, 0, height / 2),
          .rpy = {0, 0, yaw}};
}

Prop rail(std::string name, const Vector3d& from, const Vector3d& to, double radius) {
  const Vector3d along = to - from;
  // A capsule's axis is its z: pitch it down to the horizontal, then yaw it.
  const double pitch = std::atan2(along.head<2>().norm(), along.z());
  const double yaw = std::atan2(along.y(), along.x());
  return {.name = std::move(name),
          .shape = Prop::Shape::kCapsule,
          .size = {radius, along.norm() / 2, 0},
          .position = (from + to) / 2,
          .rpy = {0, pitch, yaw}};
}

std::string composeMjcf(const Scene& scene) {
  if (!(scene.time_step > 0)) {
    throw InputError(fmt::format("scene: time step {} s: expected > 0", scene.time_step));
  }
  if (scene.ground) checkMaterial("the ground", scene.ground_material, scene.time_step);
  XMLDocument document;
  const fs::path file = scene.robot ? scene.robot->file : fs::path("scene");
  parse(document, scene.robot ? readFile(file) : "<mujoco/>", file);
  XMLElement* root = document.RootElement();
  if (root && std::strcmp(root->Name(), "robot") == 0) {
    const std::string mjcf = mjcfOfUrdf(root, file);
    parse(document, mjcf, file);
    root = document.RootElement();
  } else if (!root || std::strcmp(root->Name(), "mujoco") != 0) {
    fail(file, root,
         fmt::format("expected <mujoco> (MJCF) or <robot> (URDF), got <{}>",
                     root ? root->Name() : ""));
  } else {
    std::set<fs::path> included = {file.lexically_normal()};
    resolveIncludes(root, file, included);
    resolveAssets(root, file);
  }
  checkProps(scene, root);
  if (scene.robot) {
    removeActuators(root);
    const ModelPointer original = compile(document, file);
    if (const double factor = scene.robot->mass_scale; factor != 1) {
      scaleMasses(root, factor);
      checkMasses(*original, *compile(document, file), factor, file);
    }
    addLimitsAndMotors(root, *scene.robot, *original);
  }
  XMLElement* option = root->InsertNewChildElement("option");
  option->SetAttribute("timestep", scene.time_step);
  option->SetAttribute("gravity", numbers(scene.gravity).c_str());
  option->SetAttribute("integrator", "Euler");
  if (const std::string size = roomFor(scene); !size.empty()) {
    XMLDocument fragment;
    fragment.Parse(("<size " + size + "/>").c_str());
    root->InsertEndChild(fragment.RootElement()->DeepClone(&document));
  }
  addLook(root, gridSquare(scene));
  XMLElement* world = root->InsertNewChildElement("worldbody");
  if (scene.ground) addGround(world, scene.ground_material);
  for (const Prop& p : scene.props) addProp(world, p);
  if (!scene.props.empty()) {
    XMLElement* count = root->InsertNewChildElement("custom")->InsertNewChildElement("numeric");
    count->SetAttribute("name", kPropsName);
    count->SetAttribute("data", static_cast<int>(scene.props.size()));
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace traceur::sim
