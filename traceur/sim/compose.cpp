#include "traceur/sim/compose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "traceur/core/error.h"
#include "traceur/core/is_file.h"

namespace traceur::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::infinity();

std::vector<mjsElement*> all(mjSpec* spec, mjtObj type) {
  std::vector<mjsElement*> elements;
  for (mjsElement* e = mjs_firstElement(spec, type); e; e = mjs_nextElement(spec, e)) {
    elements.push_back(e);
  }
  return elements;
}

// The engine was built with another C++ library: its strings are its own and go through its
// functions.
std::string text(const mjString* s) {
  return mjs_getString(s);
}

std::string nameOf(mjsElement* e) {
  return text(mjs_getName(e));
}

/// A name like this one that nothing of this kind has.
std::string freeName(mjSpec* spec, mjtObj type, std::string name) {
  while (mjs_findElement(spec, type, name.c_str())) name += '_';
  return name;
}

void set(double (&to)[3], const Vector3d& from) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

template <size_t N, class Number>
void set(Number (&to)[N], const double (&from)[N]) {
  std::copy(from, from + N, to);
}

// ---------------------------------------------------------------------------- what a file says

/// Makes the paths of assets absolute, so that the text can be compiled from anywhere.
void resolveAssets(mjSpec* spec, const ModelFile& source) {
  const fs::path dir = source.file().parent_path();
  const fs::path mesh_dir = dir / text(spec->compiler.meshdir);
  const fs::path texture_dir = dir / text(spec->compiler.texturedir);
  const auto resolved = [&](const std::string& name, const fs::path& folder) {
    const fs::path said = spec->strippath ? fs::path(name).filename() : fs::path(name);
    const fs::path path = (folder / said).lexically_normal();
    if (!isFile(path)) source.fail("no such asset: " + path.string());
    return path.string();
  };
  const auto resolve = [&](mjString* name, const fs::path& folder) {
    if (!text(name).empty()) mjs_setString(name, resolved(text(name), folder).c_str());
  };
  for (mjsElement* e : all(spec, mjOBJ_MESH)) resolve(mjs_asMesh(e)->file, mesh_dir);
  for (mjsElement* e : all(spec, mjOBJ_HFIELD)) resolve(mjs_asHField(e)->file, mesh_dir);
  for (mjsElement* e : all(spec, mjOBJ_SKIN)) resolve(mjs_asSkin(e)->file, mesh_dir);
  for (mjsElement* e : all(spec, mjOBJ_TEXTURE)) {
    mjsTexture* texture = mjs_asTexture(e);
    resolve(texture->file, texture_dir);
    static constexpr int kSides = 6;  // of a cube
    for (int i = 0; i < kSides; ++i) {
      const char* side = mjs_getInStringVec(texture->cubefiles, i);
      if (!side || !*side) continue;
      mjs_setInStringVec(texture->cubefiles, i, resolved(side, texture_dir).c_str());
    }
  }
  mjs_setString(spec->compiler.meshdir, "");
  mjs_setString(spec->compiler.texturedir, "");
  spec->strippath = 0;
}

bool isLimited(mjtLimited said, const double (&range)[2], const mjSpec& spec) {
  return said == mjLIMITED_TRUE ||
         (said == mjLIMITED_AUTO && spec.compiler.autolimits && range[0] < range[1]);
}

double largest(const double (&range)[2]) {
  return std::max(std::abs(range[0]), std::abs(range[1]));
}

/// Which joints the file's actuators drive, directly or by tendons and sites, and with how much
/// where that is said of the joint [N·m | N].
std::map<std::string, double> drivenJoints(mjSpec* spec, const ModelFile& source) {
  bool others = false;
  std::map<std::string, double> driven;
  for (mjsElement* e : all(spec, mjOBJ_ACTUATOR)) {
    const mjsActuator* a = mjs_asActuator(e);
    if (a->trntype != mjTRN_JOINT && a->trntype != mjTRN_JOINTINPARENT) {
      others = others || a->trntype != mjTRN_BODY;  // not adhesion
      continue;
    }
    const double gear = std::abs(a->gear[0]);
    double torque = kNone;
    if (isLimited(a->forcelimited, a->forcerange, *spec)) torque = gear * largest(a->forcerange);
    const bool is_motor = a->gaintype == mjGAIN_FIXED && a->biastype == mjBIAS_NONE;
    if (is_motor && isLimited(a->ctrllimited, a->ctrlrange, *spec)) {
      torque = std::min(torque, gear * std::abs(a->gainprm[0]) * largest(a->ctrlrange));
    }
    const auto [known, is_new] = driven.emplace(text(a->target), torque);
    if (!is_new) known->second += torque;  // two that pull on one joint
  }
  if (!others) return driven;
  // The others drive what they have a lever on, here a little away from where levers may vanish.
  std::string error;
  const SpecPointer copy(mj_copySpec(spec), mj_deleteSpec);
  copy->compiler.LRopt.mode = mjLRMODE_NONE;  // muscles' lengths, which are found by simulation
  const ModelPointer model = compilePhysics(*copy, error);
  if (!model) source.fail(error);
  const mjModel& m = *model;
  mjData* d = mj_makeData(&m);
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] == mjJNT_HINGE) d->qpos[m.jnt_qposadr[j]] += 0.1;
  }
  mj_fwdPosition(&m, d);
  for (int a = 0; a < m.nactuator; ++a) {
    if (m.actuator_trntype[a] == mjTRN_BODY) continue;  // adhesion
    for (int row = m.actuator_outadr[a]; row < m.actuator_outadr[a] + m.actuator_outnum[a]; ++row) {
      for (int at = d->moment_rowadr[row]; at < d->moment_rowadr[row] + d->moment_rownnz[row];
           ++at) {
        const int joint = m.dof_jntid[d->moment_colind[at]];
        const char* name = mj_id2name(&m, mjOBJ_JOINT, joint);
        if (name && d->actuator_moment[at] != 0) driven[name] = kNone;
      }
    }
  }
  mj_deleteData(d);
  return driven;
}

/// Joints that follow others by an equality: a motor of their own would fight it.
std::set<std::string> followers(mjSpec* spec) {
  std::set<std::string> found;
  for (mjsElement* e : all(spec, mjOBJ_EQUALITY)) {
    const mjsEquality* q = mjs_asEquality(e);
    if (q->type == mjEQ_JOINT && q->active && !text(q->name2).empty()) {
      found.insert(text(q->name1));
    };
  }
  return found;
}

/// Takes out what belongs to the file's own scene or to its actuators.
void clear(mjSpec* spec, bool ground) {
  // What refers to others goes first.
  for (const mjtObj type : {mjOBJ_KEY, mjOBJ_SENSOR, mjOBJ_TUPLE, mjOBJ_ACTUATOR, mjOBJ_LIGHT}) {
    for (mjsElement* e : all(spec, type)) mjs_delete(spec, e);
  }
  if (mjsElement* count = mjs_findElement(spec, mjOBJ_NUMERIC, kPropsName)) mjs_delete(spec, count);
  std::set<std::string> used;
  for (mjsElement* e : all(spec, mjOBJ_MATERIAL)) {
    for (int role = 0; role < mjNTEXROLE; ++role) {
      if (const char* name = mjs_getInStringVec(mjs_asMaterial(e)->textures, role))
        used.insert(name);
    }
  }
  for (mjsElement* e : all(spec, mjOBJ_TEXTURE)) {
    const bool is_sky = mjs_asTexture(e)->type == mjTEXTURE_SKYBOX;
    if (is_sky && !used.contains(nameOf(e))) mjs_delete(spec, e);
  }
  if (ground) {
    mjsBody* world = mjs_findBody(spec, "world");
    std::vector<mjsElement*> floors;
    for (mjsElement* e = mjs_firstChild(world, mjOBJ_GEOM, 0); e; e = mjs_nextChild(world, e, 0)) {
      if (mjs_asGeom(e)->type == mjGEOM_PLANE) floors.push_back(e);
    }
    for (mjsElement* e : floors) {
      const std::string name = nameOf(e);
      for (mjsElement* p : all(spec, mjOBJ_PAIR)) {
        const mjsPair* pair = mjs_asPair(p);
        if (!name.empty() && (text(pair->geomname1) == name || text(pair->geomname2) == name)) {
          mjs_delete(spec, p);
        }
      }
      mjs_delete(spec, e);
    }
  }
  // What a person switches off to look at a file would switch off ours.
  spec->option.disableflags &=
      ~(mjDSBL_CONTACT | mjDSBL_CONSTRAINT | mjDSBL_ACTUATION | mjDSBL_GRAVITY);
  spec->option.enableflags = 0;
  spec->option.disableactuator = 0;
  spec->memory = -1;  // room for the file's own contacts, not for a scene's
  spec->nstack = spec->njmax = spec->nconmax = -1;
  spec->nkey = 0;
}

// ------------------------------------------------------------------------------ what is put in

void scaleMasses(mjSpec* spec, double factor, const ModelFile& source) {
  for (mjsElement* e : all(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (nameOf(e) == "world") continue;
    if (mjs_adoptInertial(body, nullptr) != 0) source.fail(mjs_getError(spec));
    body->mass *= factor;
    for (double& i : body->inertia) i *= factor;
    for (double& i : body->fullinertia) i *= factor;  // NaN where the diagonal is given
  }
}

/// @throws InputError for the first body that scaleMasses did not scale, as with settotalmass
void checkMasses(const mjModel& before, const mjModel& after, double factor, const fs::path& file) {
  for (int b = 1; b < before.nbody; ++b) {
    const double expected = factor * before.body_mass[b];
    if (std::abs(after.body_mass[b] - expected) <= 1e-6 * expected) continue;
    const char* name = mj_id2name(&before, mjOBJ_BODY, b);
    throw InputError(
        fmt::format("{}: mass_scale {} cannot be applied: body \"{}\" weighs {} kg instead of {} "
                    "kg with it (the "
                    "file's compiler options decide masses themselves)",
                    file.string(), factor, name ? name : "", after.body_mass[b], expected));
  }
}

/// Writes the limits into the joints and gives each driven hinge and slide a motor of gear 1.
void addLimitsAndMotors(mjSpec* spec, const Robot& robot,
                        const std::map<std::string, double>& driven) {
  const std::set<std::string> follow = followers(spec);
  const double per_radian = spec->compiler.degree ? 180 / M_PI : 1;
  int number = 0;
  for (mjsElement* e : all(spec, mjOBJ_JOINT)) {
    mjsJoint* joint = mjs_asJoint(e);
    const bool is_motors = joint->type == mjJNT_HINGE || joint->type == mjJNT_SLIDE;
    if (++number; is_motors && nameOf(e).empty()) {  // a motor needs a name to pull on
      mjs_setName(e, freeName(spec, mjOBJ_JOINT, fmt::format("joint_{}", number)).c_str());
    }
    const std::string name = nameOf(e);
    if (!is_motors) continue;
    const double unit = joint->type == mjJNT_SLIDE ? 1 : per_radian;
    const auto limit = robot.limits.find(name);
    if (limit != robot.limits.end() && std::isfinite(limit->second.max)) {
      joint->limited = mjLIMITED_TRUE;
      joint->range[0] = limit->second.min * unit;
      joint->range[1] = limit->second.max * unit;
    }
    double torque = kNone;
    if (isLimited(joint->actfrclimited, joint->actfrcrange, *spec)) {
      torque = largest(joint->actfrcrange);
    }
    joint->actfrclimited = mjLIMITED_FALSE;  // one place limits torques, and it is not this one
    const auto drive = driven.find(name);
    if (drive != driven.end()) torque = std::min(torque, drive->second);
    const bool moves = robot.motors     ? robot.motors->contains(name)
                       : driven.empty() ? !follow.contains(name)
                                        : drive != driven.end();
    if (!moves) continue;
    mjsActuator* motor = mjs_addActuator(spec, nullptr);
    mjs_setName(motor->element, name.c_str());
    mjs_setToMotor(motor);
    motor->trntype = mjTRN_JOINT;
    mjs_setString(motor->target, name.c_str());
    std::fill(std::begin(motor->gear), std::end(motor->gear), 0);
    motor->gear[0] = 1;  // whatever the file's defaults say of actuators
    std::fill(std::begin(motor->damping), std::end(motor->damping), 0);
    motor->armature = motor->delay = 0;
    motor->nsample = 0;
    motor->ctrllimited = motor->forcelimited = motor->actlimited = mjLIMITED_FALSE;
    if (std::isfinite(torque)) {
      motor->forcerange[0] = -torque;
      motor->forcerange[1] = torque;
    }
  }
}

void setMaterial(mjsGeom* geom, const Material& m) {
  // Every shape that can touch anything touches what the scene puts in, whatever its file's bits.
  geom->contype = geom->conaffinity = std::numeric_limits<int>::max();
  geom->margin = geom->gap = 0;
  geom->priority = 1;  // the scene's surface decides, whatever the robot's file says
  geom->condim = m.rolling > 0 ? 6 : 3;
  set(geom->friction, {m.friction, 0.005, m.rolling});  // sliding [-], torsional and rolling [m]
  set(geom->solref, {m.compliance, m.damping_ratio});
  const double impedance[] = {0.95, 0.99, 0.001};
  std::copy(std::begin(impedance), std::end(impedance), geom->solimp);
  std::fill(std::begin(geom->surfacevel), std::end(geom->surfacevel), 0);
  geom->adhesion = 0;
  geom->typeinertia = mjINERTIA_VOLUME;
  geom->group = 0;
}

void setColour(float (&rgba)[4], float r, float g, float b) {
  rgba[0] = r;
  rgba[1] = g;
  rgba[2] = b;
  rgba[3] = 1;
}

void addGround(mjSpec* spec, const Material& material, const std::string& look) {
  mjsGeom* geom = mjs_addGeom(mjs_findBody(spec, "world"), nullptr);
  mjs_setName(geom->element, freeName(spec, mjOBJ_GEOM, "ground").c_str());
  geom->type = mjGEOM_PLANE;
  set(geom->size, {0, 0, 0.05});  // endless
  mjs_setString(geom->material, look.c_str());
  setMaterial(geom, material);
}

void addProp(mjSpec* spec, const Prop& p) {
  mjsBody* body = mjs_addBody(mjs_findBody(spec, "world"), nullptr);
  mjs_setName(body->element, p.name.c_str());
  set(body->pos, p.position);
  const Eigen::Quaterniond R = rotationOf(p.rpy);
  set(body->quat, {R.w(), R.x(), R.y(), R.z()});
  if (p.mass > 0) mjs_setName(mjs_addFreeJoint(body)->element, p.name.c_str());
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  mjs_setName(geom->element, p.name.c_str());
  switch (p.shape) {
    case Prop::Shape::kBox:
      geom->type = mjGEOM_BOX;
      set(geom->size, p.size);
      break;
    case Prop::Shape::kBall:
      geom->type = mjGEOM_SPHERE;
      set(geom->size, {p.size.x(), 0, 0});
      break;
    case Prop::Shape::kCapsule:
      geom->type = mjGEOM_CAPSULE;
      set(geom->size, {p.size.x(), p.size.y(), 0});
      break;
  }
  if (p.mass > 0) {
    geom->mass = p.mass;
    if (p.hollow) {
      const double inertia = 2.0 / 3.0 * p.mass * p.size.x() * p.size.x();
      body->explicitinertial = 1;
      body->mass = p.mass;
      set(body->ipos, {0, 0, 0});
      set(body->inertia, {inertia, inertia, inertia});
    }
    setColour(geom->rgba, 0.85F, 0.45F, 0.15F);
  } else {
    setColour(geom->rgba, 0.62F, 0.66F, 0.70F);
  }
  setMaterial(geom, p.material);
}

/// Sky, light and ground grid: what makes a picture readable, without effect on the physics.
/// @param square  of the grid [m]
/// @return the ground's material
std::string addLook(mjSpec* spec, double square) {
  mjVisual& visual = spec->visual;
  const auto grey = [](float(&rgb)[3], float value) { std::fill(rgb, rgb + 3, value); };
  grey(visual.headlight.ambient, 0.4F);
  grey(visual.headlight.diffuse, 0.35F);
  grey(visual.headlight.specular, 0);
  visual.quality.shadowsize = 4096;
  visual.quality.offsamples = 4;
  visual.map.znear = 0.01F;
  visual.map.shadowclip = 2;
  visual.map.fogstart = 5;
  visual.map.fogend = 18;
  setColour(visual.rgba.fog, 0.95F, 0.955F, 0.96F);
  setColour(visual.rgba.haze, 0.95F, 0.955F, 0.96F);

  const auto texture = [&](const char* name, mjtTexture type, mjtBuiltin builtin, int width,
                           int height) {
    mjsTexture* t = mjs_addTexture(spec, nullptr);
    mjs_setName(t->element, freeName(spec, mjOBJ_TEXTURE, name).c_str());
    t->type = type;
    t->builtin = builtin;
    t->width = width;
    t->height = height;
    return t;
  };
  mjsTexture* sky = texture("traceur_sky", mjTEXTURE_SKYBOX, mjBUILTIN_GRADIENT, 128, 768);
  set(sky->rgb1, {1, 1, 1});
  set(sky->rgb2, {0.95, 0.955, 0.96});
  mjsTexture* grid = texture("traceur_grid", mjTEXTURE_2D, mjBUILTIN_CHECKER, 512, 512);
  set(grid->rgb1, {0.96, 0.965, 0.97});
  set(grid->rgb2, {0.90, 0.905, 0.91});
  grid->mark = mjMARK_EDGE;
  set(grid->markrgb, {0.80, 0.81, 0.82});

  mjsMaterial* material = mjs_addMaterial(spec, nullptr);
  std::string name = freeName(spec, mjOBJ_MATERIAL, "traceur_ground");
  mjs_setName(material->element, name.c_str());
  mjs_setInStringVec(material->textures, mjTEXROLE_RGB, nameOf(grid->element).c_str());
  material->texrepeat[0] = material->texrepeat[1] = static_cast<float>(1 / square);
  material->texuniform = 1;
  material->reflectance = material->specular = 0;

  mjsLight* sun = mjs_addLight(mjs_findBody(spec, "world"), nullptr);
  mjs_setName(sun->element, freeName(spec, mjOBJ_LIGHT, "traceur_sun").c_str());
  sun->type = mjLIGHT_DIRECTIONAL;
  set(sun->pos, {0, 0, 4});
  set(sun->dir, {-0.25, 0.45, -1});
  grey(sun->diffuse, 0.48F);
  grey(sun->specular, 0.15F);
  sun->castshadow = 1;
  return name;
}

/// 0.1 m for a small robot, else 1 m.
double gridSquare(const Scene& scene) {
  static constexpr double kSmall =
      0.8;  // published height [m]: toddler-size robots and less [ours]
  const bool small =
      scene.robot && scene.robot->published && scene.robot->published->height < kSmall;
  return small ? 0.1 : 1.0;
}

// ------------------------------------------------------------------------- the caller's mistakes

void checkMaterial(const std::string& of, const Material& m, double time_step) {
  if (!(m.compliance >= 2 * time_step)) {
    throw InputError(
        fmt::format("scene: {}: compliance {} s: expected at least twice the time step, {} s", of,
                    m.compliance, 2 * time_step));
  }
  if (!(m.damping_ratio > 0)) {
    throw InputError(
        fmt::format("scene: {}: damping_ratio {}: expected a number > 0", of, m.damping_ratio));
  }
  if (!(m.friction >= 0) || !(m.rolling >= 0)) {
    throw InputError(fmt::format("scene: {}: friction {}, rolling {}: expected numbers >= 0", of,
                                 m.friction, m.rolling));
  }
}

/// @param spec  of the robot, to which the props are added
void checkProps(const Scene& scene, mjSpec* spec) {
  std::set<std::string> taken = {"world", "ground"};
  for (const mjtObj type : {mjOBJ_BODY, mjOBJ_GEOM, mjOBJ_JOINT}) {
    for (mjsElement* e : all(spec, type)) taken.insert(nameOf(e));
  }
  taken.erase("");
  for (const Prop& p : scene.props) {
    const std::string who = fmt::format("prop \"{}\"", p.name);
    const auto refuse = [&](const std::string& why) {
      throw InputError(fmt::format("scene: {}: {}", who, why));
    };
    if (p.name.empty()) refuse("expected a name");
    if (!taken.insert(p.name).second) refuse("something else in the scene has this name");
    const int sizes = p.shape == Prop::Shape::kBox ? 3 : p.shape == Prop::Shape::kCapsule ? 2 : 1;
    if (!(p.size.head(sizes).minCoeff() > 0) || !p.size.head(sizes).allFinite()) {
      refuse(
          fmt::format("size {} {} {}: expected lengths > 0", p.size.x(), p.size.y(), p.size.z()));
    }
    if (!p.position.allFinite() || !p.rpy.allFinite()) refuse("expected a finite place");
    if (!(p.mass >= 0) || !std::isfinite(p.mass)) {
      refuse(fmt::format("mass {} kg: expected 0 (fixed) or more", p.mass));
    }
    checkMaterial(who, p.material, scene.time_step);
  }
}

SpecPointer robotSpec(const Robot& robot, const ModelFile& source, bool ground) {
  std::string error;
  SpecPointer spec = parseText(source.text(), error);
  if (!spec) source.fail(error);
  resolveAssets(spec.get(), source);
  const std::map<std::string, double> driven = drivenJoints(spec.get(), source);
  clear(spec.get(), ground);
  if (robot.mass_scale != 1) {
    const SpecPointer copy(mj_copySpec(spec.get()), mj_deleteSpec);
    const ModelPointer original = compilePhysics(*copy, error);
    if (!original) source.fail(error);
    scaleMasses(spec.get(), robot.mass_scale, source);
    const SpecPointer scaled_copy(mj_copySpec(spec.get()), mj_deleteSpec);
    const ModelPointer scaled = compilePhysics(*scaled_copy, error);
    if (!scaled) source.fail(error);
    checkMasses(*original, *scaled, robot.mass_scale, robot.file);
  }
  addLimitsAndMotors(spec.get(), robot, driven);
  return spec;
}

SpecPointer compose(const Scene& scene, const ModelFile* source) {
  if (!(scene.time_step > 0)) {
    throw InputError(fmt::format("scene: time step {} s: expected > 0", scene.time_step));
  }
  if (scene.ground) checkMaterial("the ground", scene.ground_material, scene.time_step);
  std::string error;
  SpecPointer spec =
      source ? robotSpec(*scene.robot, *source, scene.ground) : parseText("<mujoco/>", error);
  checkProps(scene, spec.get());
  spec->option.timestep = scene.time_step;
  set(spec->option.gravity, {scene.gravity.x(), scene.gravity.y(), scene.gravity.z()});
  spec->option.integrator = mjINT_EULER;
  const bool loose =
      std::any_of(scene.props.begin(), scene.props.end(), [](const Prop& p) { return p.mass > 0; });
  // One robot is one island: looking for others took 5 % of learning a jump.
  if (!loose) spec->option.disableflags |= mjDSBL_ISLAND;
  if (loose && scene.props_sleep) {
    spec->option.enableflags |= mjENBL_SLEEP;
    for (mjsElement* e : all(spec.get(), mjOBJ_BODY)) {  // of the robot: props come after
      mjsBody* body = mjs_asBody(e);
      if (mjs_getParent(e) == mjs_findBody(spec.get(), "world")) body->sleep = mjSLEEP_NEVER;
    }
  }
  const std::string look = addLook(spec.get(), gridSquare(scene));
  if (scene.ground) addGround(spec.get(), scene.ground_material, look);
  for (const Prop& p : scene.props) addProp(spec.get(), p);
  if (!scene.props.empty()) {
    mjsNumeric* count = mjs_addNumeric(spec.get());
    mjs_setName(count->element, kPropsName);
    const auto props = static_cast<double>(scene.props.size());
    mjs_setDouble(count->data, &props, 1);
    count->size = 1;
  }
  return spec;
}

[[noreturn]] void fail(const ModelFile* source, const std::string& error) {
  if (source) source->fail(error);
  throw InputError("scene: " + error);
}

}  // namespace

std::shared_ptr<const ModelFile> sourceOf(const Scene& scene) {
  return scene.robot ? std::make_shared<const ModelFile>(scene.robot->file) : nullptr;
}

ModelPointer compilePhysics(mjSpec& spec, std::string& error) {
  // It fails where the file has inertias follow from all shapes: then they all stay.
  mjs_discardVisual(&spec, nullptr);
  return compile(spec, error);
}

ModelPointer composePhysics(const Scene& scene, const ModelFile* source) {
  const SpecPointer spec = compose(scene, source);
  std::string error;
  ModelPointer model = compilePhysics(*spec, error);
  if (!model) fail(source, error);
  return model;
}

ModelPointer compileAlone(const ModelFile& source) {
  std::string error;
  const SpecPointer spec = parseText(source.text(), error);
  if (!spec) source.fail(error);
  resolveAssets(spec.get(), source);
  ModelPointer model = compilePhysics(*spec, error);
  if (!model) source.fail(error);
  return model;
}

std::string composeMjcf(const Scene& scene, const ModelFile* source) {
  const SpecPointer spec = compose(scene, source);
  std::string error;
  std::string text;
  if (compile(*spec, error)) text = toXml(*spec, error);
  if (text.empty()) fail(source, error);
  return text;
}

}  // namespace traceur::sim
