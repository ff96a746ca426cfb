#include "traceur/sim/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "traceur/core/error.h"
#include "traceur/sim/engine.h"

namespace traceur::sim {

namespace {

/// The velocities of a floating root and all that hangs on it: mj_comVel's, operation by operation,
/// without the axes' derivatives and without what else lies in the scene.
void bodyVelocities(const mjModel* m, mjData* d, int root) {
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  const auto part = [](mjtNum* of, int i) { return Eigen::Map<Vector6d>(of + 6 * size_t(i)); };
  for (int b = root; b < m->nbody && (b == root || m->body_rootid[b] == m->body_rootid[root]);
       ++b) {
    Vector6d velocity = part(d->cvel, m->body_parentid[b]);
    const int end = m->body_dofadr[b] + m->body_dofnum[b];
    for (int i = m->body_dofadr[b]; i < end;) {
      // A joint's parts are summed before they are added: six of a free one are two joints of
      // three.
      const int type = m->jnt_type[m->dof_jntid[i]];
      const int parts = type == mjJNT_FREE || type == mjJNT_BALL ? 3 : 1;
      Vector6d sum = part(d->cdof, i) * d->qvel[i];
      for (int k = 1; k < parts; ++k) sum += part(d->cdof, i + k) * d->qvel[i + k];
      velocity += sum;
      i += parts;
    }
    part(d->cvel, b) = velocity;
  }
}

}  // namespace

World::World(std::shared_ptr<const Model> model)
    : model_(std::move(model)), data_(mj_makeData(model_->raw())) {
  snapshot_.model_ = model_.get();
  snapshot_.data_ = data_;
  const mjModel* m = model_->raw();
  snapshot_.factor_.emplace(*m);
  snapshot_.momentum_.resize(3, m->nbody);
  snapshot_.joint_forces_.resize(3, 0);
  snapshot_.contacts_.reserve(128);
  reset(model_->initialState());
}

World::~World() {
  mj_deleteData(data_);
}

void World::watchJointForces(bool watch) {
  if (watch == snapshot_.wants_joint_forces_) return;
  snapshot_.wants_joint_forces_ = watch;
  snapshot_.joint_forces_.setZero(3, watch ? model_->bodies() : 0);
}

void World::check(const State& state, const char* caller) const {
  const mjModel* m = model_->raw();
  if (state.q.size() != m->nq || state.v.size() != m->nv) {
    throw InputError(fmt::format("World::{}: expected q({}), v({}), got q({}), v({})", caller,
                                 m->nq, m->nv, state.q.size(), state.v.size()));
  }
  if (!state.q.allFinite() || !state.v.allFinite()) {
    throw InputError(fmt::format("World::{}: q and v must be finite, got NaN or infinity", caller));
  }
}

void World::write(const State& state) {
  const mjModel* m = model_->raw();
  data_->time = state.time;
  Eigen::Map<VectorXd>(data_->qpos, m->nq) = state.q;
  Eigen::Map<VectorXd>(data_->qvel, m->nv) = state.v;
}

void World::reset(const State& state) {
  check(state, "reset");
  const mjModel* m = model_->raw();
  mj_resetData(m, data_);
  snapshot_.pushed_ = false;
  write(state);
  out_of_room_ = !completes(mj_forward, m, data_);
  if (out_of_room_) data_->ncon = 0;
  snapshot_.contacts_.clear();
  snapshot_.capture();
}

void World::place(const State& state) {
  const mjModel* m = model_->raw();
  check(state, "place");
  write(state);
  data_->ncon = 0;
  snapshot_.contacts_.clear();
  mj_kinematics(m, data_);
  mj_comPos(m, data_);
  snapshot_.capture();
}

bool World::placePressed(const State& state) {
  place(state);
  completes(mj_collision, model_->raw(), data_);  // of too many contacts those that were found
  mjContact* const end = data_->contact + data_->ncon;
  const bool pressed =
      std::any_of(data_->contact, end, [](const mjContact& c) { return c.exclude == 0; });
  data_->ncon = 0;
  return pressed;
}

void World::step(const Torque& torque) {
  const mjModel* m = model_->raw();
  assert(torque.tau.size() == m->nu);
  if (out_of_room_) return;
  Eigen::Map<VectorXd>(data_->ctrl, m->nu) = torque.tau;
  // No contact whose force is being solved for: the step will be one of flight.
  const bool awake = data_->body_awake[model_->root().value] == mjS_AWAKE;
  const bool flies =
      awake && model_->gravityAlone() && !snapshot_.pushed_ && !snapshot_.willTouchWorld();
  const Vector3d v_before = flies ? snapshot_.comVelocity() : Vector3d::Zero();
  // reset() and the end of step() leave positions and velocities evaluated, so the second half
  // comes first: between the halves the engine still holds the forces it has just solved for.
  out_of_room_ = !completes(mj_step2, m, data_);
  if (out_of_room_) return;
  snapshot_.capture();
  mj_checkPos(m, data_);
  mj_checkVel(m, data_);
  out_of_room_ = !completes(mj_fwdPosition, m, data_);
  if (out_of_room_) return;
  if (flies) {
    // In flight gravity alone moves the COM. Euler's step in joint coordinates keeps that only to
    // O(Δt); shifting the root's velocity by the error makes linear momentum exact.
    bodyVelocities(m, data_, model_->root().value);
    const Vector3d g(m->opt.gravity[0], m->opt.gravity[1], m->opt.gravity[2]);
    const Vector3d error = v_before + g * m->opt.timestep - snapshot_.comVelocity();
    const int root = m->body_dofadr[model_->root().value];
    Eigen::Map<Vector3d>(data_->qvel + root) += error;
  }
  out_of_room_ = !completes(mj_fwdVelocity, m, data_);
  snapshot_.has_com_velocity_ = snapshot_.has_angular_momentum_ = false;
}

void World::push(BodyId body, const Vector3d& force, const Vector3d& moment) {
  snapshot_.pushed_ = true;
  Eigen::Map<Vector3d>(data_->xfrc_applied + 6 * body.value) = force;
  Eigen::Map<Vector3d>(data_->xfrc_applied + 6 * body.value + 3) = moment;
  // The engine wakes what is pushed as a step begins, which ours does in its middle.
  const bool sleeps = data_->body_awake[body.value] == mjS_ASLEEP;
  if (sleeps && !out_of_room_) out_of_room_ = !completes(mj_forward, model_->raw(), data_);
}

void World::endPushes() {
  std::fill_n(data_->xfrc_applied, 6 * model_->bodies(), 0);
}

State World::state() const {
  return {snapshot_.time(), snapshot_.q(), snapshot_.v()};
}

Checkpoint World::save() const {
  const mjModel* m = model_->raw();
  Checkpoint c;
  c.model_ = model_;
  c.data_ = {mj_copyData(nullptr, m, data_),
             [](const mjData* d) { mj_deleteData(const_cast<mjData*>(d)); }};
  c.snapshot_ = snapshot_;
  c.state_ = state();
  c.out_of_room_ = out_of_room_;
  return c;
}

void World::restore(const Checkpoint& from) {
  assert(!from.empty() && from.model_ == model_);
  mj_copyData(data_, model_->raw(), from.data_.get());
  const bool watches = snapshot_.wants_joint_forces_;
  snapshot_ = from.snapshot_;
  snapshot_.data_ = data_;
  watchJointForces(watches);
  out_of_room_ = from.out_of_room_;
}

bool World::diverged() const {
  for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC, mjWARN_BADCTRL}) {
    if (data_->warning[warning].number > 0) return true;
  }
  return false;
}

bool World::overflowed() const {
  return out_of_room_ || data_->warning[mjWARN_CONTACTFULL].number > 0 ||
         data_->warning[mjWARN_CNSTRFULL].number > 0;
}

}  // namespace traceur::sim
