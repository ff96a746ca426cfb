#include "traceur/sim/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/text.h"
#include "traceur/sim/compose.h"
#include "traceur/sim/shape.h"

namespace traceur::sim {
namespace {

std::vector<std::string> namesOf(const mjModel* m, mjtObj type, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    const char* name = mj_id2name(m, type, i);
    if (name && *name) names.emplace_back(name);
  }
  return names;
}

[[noreturn]] void failNoName(const mjModel* m, mjtObj type, int count, std::string_view what,
                             std::string_view name) {
  throw InputError(
      fmt::format("no {} named \"{}\".{}", what, name, didYouMean(name, namesOf(m, type, count))));
}

/// Whether a command of 1 to an actuator is 1 N·m (N) at a joint.
bool isPlainMotor(const mjModel* m, int a) {
  return m->actuator_trntype[a] == mjTRN_JOINT && m->actuator_gear[6 * a] == 1 &&
         m->actuator_dyntype[a] == mjDYN_NONE && m->actuator_gaintype[a] == mjGAIN_FIXED &&
         m->actuator_gainprm[mjNGAIN * a] == 1 && m->actuator_biastype[a] == mjBIAS_NONE &&
         !m->actuator_ctrllimited[a] && !m->actuator_forcelimited[a];
}

/// The physics as bytes. A world of it can be made and put into its first state.
std::string checked(const ModelPointer& model) {
  mjData* data = mj_makeData(model.get());
  mj_forward(model.get(), data);
  mj_deleteData(data);
  return toBytes(*model);
}

/// Meshes that are only seen take a thousand times as long as physics, and a robot that has learned
/// for hours is worth the wait.
constexpr GuardLimits kPictureLimits = {.seconds = 60, .memory = 4'000'000'000};

std::string nameOf(const Scene& scene) {
  return scene.robot ? scene.robot->file.string() : "scene";
}

/// The body under the world whose tree has the most degrees of freedom: of several things in a
/// robot's file, the robot.
/// @param end  of the bodies that are asked
int rootOf(const mjModel* m, int end) {
  std::vector<int> freedoms(m->nbody, 0);
  for (int v = 0; v < m->nv; ++v) ++freedoms[m->body_rootid[m->dof_bodyid[v]]];
  int root = end > 1 ? 1 : 0;
  for (int b = 1; b < end; ++b) {
    if (freedoms[b] > freedoms[root]) root = b;
  }
  return root;
}

}  // namespace

std::string engineVersion() {
  return std::string("MuJoCo ") + mj_versionString();
}

Model::Model(std::string_view physics, std::function<std::string()> make_mjcf,
             std::shared_ptr<const Robot> robot)
    : make_mjcf_(std::move(make_mjcf)),
      robot_(std::move(robot)),
      model_(toModel(physics).release()) {
  const mjModel* m = model_;
  // Props come last in the document. Without a robot they stand in for one.
  const int numeric = mj_name2id(m, mjOBJ_NUMERIC, kPropsName);
  const int bodies = static_cast<int>(m->nbody);
  // Of a text it may be anything.
  const double said = numeric < 0 ? 0 : m->numeric_data[m->numeric_adr[numeric]];
  const int count = said > 0 ? static_cast<int>(std::min(said, bodies - 1.0)) : 0;
  root_.value = rootOf(m, bodies - count > 1 ? bodies - count : bodies);
  if (m->body_jntnum[root_.value] > 0 && m->jnt_type[m->body_jntadr[root_.value]] == mjJNT_FREE) {
    root_dofs_ = 6;
  }
  if (root_dofs_ == 6) {
    const int joint = m->body_jntadr[root_.value];
    const double* damping = m->dof_damping + m->jnt_dofadr[joint];
    gravity_alone_ = m->neq == 0 && m->ntendon == 0 && m->opt.density == 0 &&
                     m->opt.viscosity == 0 && m->ngravcomp == 0 && m->jnt_stiffness[joint] == 0 &&
                     std::all_of(damping, damping + 6, [](double d) { return d == 0; });
  }
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  for (int j = 0; j < m->njnt; ++j) {
    if (!isRobot({m->jnt_bodyid[j]})) continue;
    if (m->jnt_type[j] == mjJNT_FREE) continue;
    const char* name = mj_id2name(m, mjOBJ_JOINT, j);
    Joint joint;
    joint.name = name ? name : fmt::format("joint {}", j);
    if (m->jnt_type[j] == mjJNT_BALL) {
      ball_joints_.push_back(joint.name);
      continue;
    }
    joint.q = m->jnt_qposadr[j];
    joint.v = m->jnt_dofadr[j];
    joint.body = {m->jnt_bodyid[j]};
    joint.slides = m->jnt_type[j] == mjJNT_SLIDE;
    for (int a = 0; a < m->nu; ++a) {
      if (isPlainMotor(m, a) && m->actuator_trnid[2 * a] == j) joint.motor = a;
    }
    joint.limit = {kNone, kNone, -kNone, kNone};
    if (joint.motor >= 0 && m->actuator_forcerange[2 * joint.motor + 1] > 0) {
      joint.limit.torque = m->actuator_forcerange[2 * joint.motor + 1];
    }
    if (m->jnt_limited[j]) {
      joint.limit.min = m->jnt_range[2 * j];
      joint.limit.max = m->jnt_range[2 * j + 1];
    }
    if (robot_) {
      const auto limit = robot_->limits.find(joint.name);
      if (limit != robot_->limits.end()) {
        joint.limit.torque = limit->second.torque;
        joint.limit.speed = limit->second.speed;
        if (std::isfinite(limit->second.max)) {  // else as the file has it
          joint.limit.min = limit->second.min;
          joint.limit.max = limit->second.max;
        }
      }
    }
    joints_.push_back(joint);
  }
}

Model::~Model() {
  if (model_) mj_deleteModel(model_);
}

std::shared_ptr<const Model> Model::fromScene(const Scene& scene) {
  const std::shared_ptr<const ModelFile> source = sourceOf(scene);
  const std::string physics =
      compiledApart(nameOf(scene), [&] { return checked(composePhysics(scene, source.get())); });
  const auto make_mjcf = [scene, source] {
    return compiledApart(
        nameOf(scene), [&] { return composeMjcf(scene, source.get()); }, kPictureLimits);
  };
  std::shared_ptr<const Model> model(new Model(physics, make_mjcf, scene.robot));
  if (const Robot* robot = scene.robot.get()) {
    // Every name of the TOML must mean something in the model.
    Diagnostics diagnostics((robot->toml.empty() ? robot->file : robot->toml).string());
    const auto check = [&](auto&& look_up) {
      try {
        look_up();
      } catch (const InputError& e) {
        diagnostics.add(0, 0, e.what());
      }
    };
    // By entry: clang before 16 captures no parts of one.
    for (const auto& pair : robot->mirrored) {
      check([&] { model->joint(pair.second.left), model->joint(pair.second.right); });
    }
    for (const auto& limit : robot->limits) check([&] { model->joint(limit.first); });
    for (const auto& gain : robot->gains) check([&] { model->joint(gain.first); });
    for (const auto& contact : robot->contacts) check([&] { model->body(contact.second.body); });
    for (const auto* groups : {&robot->limbs, &robot->bodies}) {
      for (const auto& [name, list] : *groups) {
        for (const std::string& body : list) check([&] { model->body(body); });
      }
    }
    for (const auto& pose : robot->poses) check([&] { model->stateOf(pose.second); });
    diagnostics.throwIfAny();
  }
  return model;
}

std::shared_ptr<const Model> Model::fromMjcf(const std::string& text) {
  const std::string physics = compiledApart("scene", [&] {
    std::string error;
    const SpecPointer spec = parseText(text, error);
    ModelPointer model(nullptr, mj_deleteModel);
    if (spec) model = compilePhysics(*spec, error);
    if (!model) throw InputError("scene: " + error);
    return checked(model);
  });
  return std::shared_ptr<const Model>(new Model(
      physics, [text] { return text; }, nullptr));
}

const std::string& Model::mjcf() const {
  std::call_once(mjcf_made_, [&] { mjcf_ = make_mjcf_(); });
  return mjcf_;
}

std::uint64_t Model::fingerprint() const {
  // Where meshes lie is not what they are.
  const ModelPointer placeless(mj_copyModel(nullptr, model_), mj_deleteModel);
  std::fill_n(placeless->paths, placeless->npaths, '\0');
  Hash hash;
  hash.add(toBytes(*placeless));
  return hash.value();
}

std::string Model::name() const {
  // The engine's own word for a model without a name.
  const std::string said = model_->names;
  return said == "MuJoCo Model" ? "" : said;
}
int Model::nq() const {
  return model_->nq;
}
int Model::nv() const {
  return model_->nv;
}
int Model::nu() const {
  return model_->nu;
}
int Model::bodies() const {
  return model_->nbody;
}
double Model::timeStep() const {
  return model_->opt.timestep;
}
double Model::gravity() const {
  return -model_->opt.gravity[2];
}
double Model::mass() const {
  return model_->body_subtreemass[root_.value];
}

int Model::rootQ() const {
  assert(root_dofs_ == 6);
  return model_->jnt_qposadr[model_->body_jntadr[root_.value]];
}
int Model::rootV() const {
  assert(root_dofs_ == 6);
  return model_->jnt_dofadr[model_->body_jntadr[root_.value]];
}

BodyId Model::body(std::string_view name) const {
  const int id = mj_name2id(model_, mjOBJ_BODY, std::string(name).c_str());
  if (id < 0) failNoName(model_, mjOBJ_BODY, model_->nbody, "body", name);
  return {id};
}

std::string Model::bodyName(BodyId body) const {
  const char* name = mj_id2name(model_, mjOBJ_BODY, body.value);
  return name && *name ? name : fmt::format("body {}", body.value);
}

BodyPoint Model::contactPoint(std::string_view name) const {
  std::vector<std::string> names;
  if (robot_) {
    const auto point = robot_->contacts.find(std::string(name));
    if (point != robot_->contacts.end()) return {body(point->second.body), point->second.p_BP};
    for (const auto& [known, unused] : robot_->contacts) names.push_back(known);
  }
  throw InputError(fmt::format("no contact point named \"{}\".{}", name, didYouMean(name, names)));
}

BodyId Model::parent(BodyId body) const {
  return {model_->body_parentid[body.value]};
}
bool Model::hangsOn(BodyId body, BodyId ancestor) const {
  while (body.value > ancestor.value) body = parent(body);  // parents come first
  return body == ancestor;
}
bool Model::isStatic(BodyId body) const {
  return model_->body_weldid[body.value] == 0;
}
bool Model::isRobot(BodyId body) const {
  return body.value > 0 && body.value < model_->nbody &&
         model_->body_rootid[body.value] == model_->body_rootid[root_.value];
}
double Model::bodyMass(BodyId body) const {
  return model_->body_mass[body.value];
}

bool Model::canTouchWorld() const {
  const mjModel* m = model_;
  const auto is_robots = [&](int geom) { return isRobot({m->geom_bodyid[geom]}); };
  for (int g = 0; g < m->ngeom; ++g) {
    if (is_robots(g) && (m->geom_contype[g] != 0 || m->geom_conaffinity[g] != 0)) return true;
  }
  for (int p = 0; p < m->npair; ++p) {
    if (is_robots(m->pair_geom1[p]) != is_robots(m->pair_geom2[p])) return true;
  }
  return false;
}

const Joint& Model::joint(std::string_view name) const {
  for (const Joint& j : joints_) {
    if (j.name == name) return j;
  }
  failNoName(model_, mjOBJ_JOINT, model_->njnt, "joint", name);
}

BodyId Model::bodyOf(const Joint& joint) const {
  return {model_->dof_bodyid[joint.v]};
}

State Model::initialState() const {
  return {0, Eigen::Map<const VectorXd>(model_->qpos0, nq()), VectorXd::Zero(nv())};
}

State Model::stateOf(const Pose& pose) const {
  State state = initialState();
  for (const auto& [name, angle] : pose.joints) state.q[joint(name).q] = angle;
  if (root_dofs_ != 6) return state;
  const int root = rootQ();
  const Eigen::Quaterniond R = rotationOf(pose.root_rpy);
  state.q.segment<3>(root) = Vector3d::Zero();
  state.q.segment<4>(root + 3) << R.w(), R.x(), R.y(), R.z();

  mjData* d = mj_makeData(model_);
  Eigen::Map<VectorXd>(d->qpos, nq()) = state.q;
  mj_kinematics(model_, d);
  double lowest = std::numeric_limits<double>::infinity();
  for (int g = 0; g < model_->ngeom; ++g) {
    const bool collides = model_->geom_contype[g] || model_->geom_conaffinity[g];
    if (collides && isRobot({model_->geom_bodyid[g]})) {
      if (const auto point = farthestPoint(model_, d, g, -Vector3d::UnitZ())) {
        lowest = std::min(lowest, point->z());
      }
    }
  }
  mj_deleteData(d);
  if (std::isfinite(lowest)) state.q[root + 2] -= lowest;
  return state;
}

State Model::launched(State state, double height, const Vector3d& velocity,
                      const Vector3d& spin) const {
  assert(root_dofs_ == 6);
  state.q[rootQ() + 2] += height;
  mjData* d = mj_makeData(model_);
  Eigen::Map<VectorXd>(d->qpos, nq()) = state.q;
  mj_kinematics(model_, d);
  mj_comPos(model_, d);
  const Eigen::Map<const Vector3d> com(d->subtree_com + 3 * root_.value);
  const Vector3d arm = state.q.segment<3>(rootQ()) - com;
  mj_deleteData(d);
  const Eigen::Quaterniond R(state.q[rootQ() + 3], state.q[rootQ() + 4], state.q[rootQ() + 5],
                             state.q[rootQ() + 6]);
  state.v.segment<3>(rootV()) = velocity + spin.cross(arm);
  state.v.segment<3>(rootV() + 3) = R.conjugate() * spin;
  return state;
}

void Model::putFree(State& state, BodyId prop, const Vector3d& at, const Vector3d& velocity) const {
  const int joint = model_->body_jntadr[prop.value];
  assert(joint >= 0 && model_->jnt_type[joint] == mjJNT_FREE);
  state.q.segment<7>(model_->jnt_qposadr[joint]) << at, 1, 0, 0, 0;
  state.v.segment<6>(model_->jnt_dofadr[joint]) << velocity, Vector3d::Zero();
}

std::optional<BodyId> Model::bodyReachedInto(const State& state, double depth) const {
  mjData* d = mj_makeData(model_);
  Eigen::Map<VectorXd>(d->qpos, nq()) = state.q;
  completes(
      [](const mjModel* model, mjData* data) {
        mj_kinematics(model, data);
        mj_comPos(model, data);
        mj_collision(model, data);
      },
      model_, d);  // of too many contacts those that were found
  std::optional<BodyId> found;
  for (int c = 0; c < d->ncon && !found; ++c) {
    const BodyId a{model_->geom_bodyid[d->contact[c].geom1]};
    const BodyId b{model_->geom_bodyid[d->contact[c].geom2]};
    if (d->contact[c].dist < -depth && isRobot(a) != isRobot(b)) found = isRobot(a) ? b : a;
  }
  mj_deleteData(d);
  return found;
}

std::map<std::string, Pose> keyPoses(const Robot& robot) {
  const ModelFile source(robot.file);
  const ModelPointer model =
      toModel(compiledApart(robot.file.string(), [&] { return toBytes(*compileAlone(source)); }));
  const mjModel& m = *model;
  std::map<std::string, Pose> poses;
  for (int k = 0; k < m.nkey; ++k) {
    const double* q = m.key_qpos + static_cast<ptrdiff_t>(k) * m.nq;
    const char* said = mj_id2name(&m, mjOBJ_KEY, k);
    Pose pose;
    for (int j = 0; j < m.njnt; ++j) {
      const double* at = q + m.jnt_qposadr[j];
      const char* name = mj_id2name(&m, mjOBJ_JOINT, j);
      const bool turns_or_slides = m.jnt_type[j] == mjJNT_HINGE || m.jnt_type[j] == mjJNT_SLIDE;
      if (turns_or_slides && name && *at != 0) pose.joints[name] = *at;
      if (m.jnt_type[j] == mjJNT_FREE && m.body_rootid[m.jnt_bodyid[j]] == rootOf(&m, m.nbody)) {
        pose.root_rpy = rpyOf(Eigen::Quaterniond(at[3], at[4], at[5], at[6]));
      }
    }
    poses.emplace(said && *said ? said : fmt::format("key {}", k), std::move(pose));
  }
  return poses;
}

}  // namespace traceur::sim
