#include "traceur/sim/snapshot.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

#include "traceur/sim/engine.h"
#include "traceur/sim/shape.h"

namespace traceur::sim {
namespace {

Vector3d vec(const mjtNum* p) {
  return {p[0], p[1], p[2]};
}

}  // namespace

double Snapshot::time() const {
  return data_->time;
}

Eigen::Map<const VectorXd> Snapshot::q() const {
  return Eigen::Map<const VectorXd>(data_->qpos, model_->nq());
}
Eigen::Map<const VectorXd> Snapshot::v() const {
  return Eigen::Map<const VectorXd>(data_->qvel, model_->nv());
}

Vector3d Snapshot::com() const {
  return vec(data_->subtree_com + 3 * model_->root().value);
}

Vector3d Snapshot::comVelocity() const {
  if (has_com_velocity_) return com_velocity_;
  // mj_subtreeVel's linear half, operation by operation: its angular half is twice the work.
  const mjModel* m = model_->raw();
  const int root = model_->root().value;
  // The engine's velocities are those of the points of their bodies that are where this is now.
  const Vector3d origin = vec(data_->subtree_com + 3 * m->body_rootid[root]);
  int end = root;
  for (; end < m->nbody && (end == root || m->body_rootid[end] == m->body_rootid[root]); ++end) {
    const mjtNum* const cvel = data_->cvel + 6 * static_cast<ptrdiff_t>(end);  // rotation first
    const Vector3d velocity = vec(cvel + 3) - (bodyCom({end}) - origin).cross(vec(cvel));
    momentum_.col(end) = m->body_mass[end] * velocity;
  }
  for (int b = end - 1; b > root; --b) momentum_.col(m->body_parentid[b]) += momentum_.col(b);
  com_velocity_ = (1 / m->body_subtreemass[root]) * momentum_.col(root);
  has_com_velocity_ = true;
  return com_velocity_;
}

Vector3d Snapshot::linearMomentum() const {
  return model_->mass() * comVelocity();
}

Vector3d Snapshot::angularMomentum() const {
  if (!has_angular_momentum_) mj_subtreeVel(model_->raw(), data_);
  has_angular_momentum_ = true;
  return vec(data_->subtree_angmom + 3 * model_->root().value);
}

Matrix3d Snapshot::inertia() const {
  const mjModel* m = model_->raw();
  const Vector3d com = this->com();
  Matrix3d sum = Matrix3d::Zero();
  for (int b = 1; b < m->nbody; ++b) {
    if (!model_->isRobot({b})) continue;
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Map<const RowMajor> R(data_->ximat + 9 * static_cast<ptrdiff_t>(b));
    const Vector3d r = bodyCom({b}) - com;
    sum += R * vec(m->body_inertia + 3 * static_cast<ptrdiff_t>(b)).asDiagonal() * R.transpose();
    sum += m->body_mass[b] * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  return sum;
}

Vector3d Snapshot::spin() const {
  return inertia().llt().solve(angularMomentum());
}

Vector3d Snapshot::heading() const {
  const Vector3d left = bodyRotation(model_->root()).col(1);
  const Vector3d forward = left.cross(Vector3d::UnitZ());
  const double length = forward.norm();
  if (!(length > 1e-9)) return Vector3d::UnitX();
  return forward / length;
}

Vector3d Snapshot::bodyPosition(BodyId body) const {
  return vec(data_->xpos + 3 * body.value);
}

Matrix3d Snapshot::bodyRotation(BodyId body) const {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(data_->xmat + 9 * body.value);
}

Vector3d Snapshot::bodyCom(BodyId body) const {
  return vec(data_->xipos + 3 * body.value);
}

Vector3d Snapshot::bodyVelocity(BodyId body) const {
  mjtNum velocity[6];  // rotation, then translation
  mj_objectVelocity(model_->raw(), data_, mjOBJ_XBODY, body.value, velocity, 0);
  return vec(velocity + 3);
}

Vector3d Snapshot::jointAxis(const Joint& joint) const {
  return vec(data_->xaxis + 3 * static_cast<ptrdiff_t>(model_->raw()->dof_jntid[joint.v]));
}

Vector3d Snapshot::jointAnchor(const Joint& joint) const {
  return vec(data_->xanchor + 3 * static_cast<ptrdiff_t>(model_->raw()->dof_jntid[joint.v]));
}

double Snapshot::jointInertia(const Joint& joint) const {
  const mjModel* m = model_->raw();
  return data_->M[m->M_rowadr[joint.v] + m->M_rownnz[joint.v] - 1];  // the row's last: the diagonal
}

std::optional<Vector3d> Snapshot::farthestPoint(BodyId body, const Vector3d& u) const {
  const mjModel* m = model_->raw();
  std::optional<Vector3d> farthest;
  for (int g = m->body_geomadr[body.value], end = g + m->body_geomnum[body.value]; g < end; ++g) {
    if (m->geom_contype[g] == 0 && m->geom_conaffinity[g] == 0) continue;
    const auto point = sim::farthestPoint(m, data_, g, u);
    if (point && (!farthest || u.dot(*point) > u.dot(*farthest))) farthest = point;
  }
  return farthest;
}

Vector3d Snapshot::position(const BodyPoint& p) const {
  return bodyPosition(p.body) + bodyRotation(p.body) * p.p_BP;
}

Vector3d Snapshot::velocity(const BodyPoint& p) const {
  mjtNum velocity[6];  // rotation, then translation of the origin
  mj_objectVelocity(model_->raw(), data_, mjOBJ_XBODY, p.body.value, velocity, 0);
  return vec(velocity + 3) + vec(velocity).cross(bodyRotation(p.body) * p.p_BP);
}

Eigen::Map<const VectorXd> Snapshot::torque() const {
  return Eigen::Map<const VectorXd>(data_->ctrl, model_->nu());
}

bool Snapshot::touchesWorld() const {
  return std::any_of(contacts_.begin(), contacts_.end(), [&](const Contact& c) {
    return model_->isRobot(c.body_a) != model_->isRobot(c.body_b);
  });
}

bool Snapshot::willTouchWorld() const {
  const int* body = model_->raw()->geom_bodyid;
  return std::any_of(data_->contact, data_->contact + data_->ncon, [&](const mjContact& c) {
    return c.efc_address >= 0 &&
           model_->isRobot({body[c.geom1]}) != model_->isRobot({body[c.geom2]});
  });
}

int Snapshot::support(const Contact& c) const {
  const bool a = model_->isRobot(c.body_a);
  if (a == model_->isRobot(c.body_b)) return 0;
  if (!model_->isStatic(a ? c.body_b : c.body_a)) return 0;
  return a ? -1 : 1;
}

// What is steeper than 60 degrees is a wall [ours].
constexpr double kSteep = 0.5;

std::optional<Vector3d> Snapshot::cop() const {
  double total = 0;
  Vector3d moment = Vector3d::Zero();
  for (const Contact& c : contacts_) {
    const int sign = support(c);
    if (sign == 0) continue;
    // On a wall what is vertical is friction, of either sign.
    const bool steep = std::abs(c.normal.z()) < kSteep;
    const double f = steep ? c.f_WC.dot(c.normal) : sign * c.f_WC.z();
    total += f;
    moment += f * c.p_WC;
  }
  if (!(total > 0)) return std::nullopt;
  return moment / total;
}

std::vector<Vector2d> Snapshot::supportPolygon() const {
  std::vector<Vector2d> points;
  for (const Contact& c : contacts_) {
    if (support(c) != 0) points.push_back(c.p_WC.head<2>());
  }
  // Andrew's monotone chain.
  const auto less = [](const Vector2d& a, const Vector2d& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  };
  std::sort(points.begin(), points.end(), less);
  if (points.size() < 3) return points;
  const auto turn = [](const Vector2d& o, const Vector2d& a, const Vector2d& b) {
    return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
  };
  std::vector<Vector2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t start = hull.size();
    for (const Vector2d& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();  // it begins the other chain
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

void Snapshot::pointJacobian(BodyId body, const Vector3d& p_BP, Eigen::Ref<Matrix3Xd> J) const {
  assert(J.cols() == model_->nv());
  const Vector3d p_WP = bodyPosition(body) + bodyRotation(body) * p_BP;
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> rows(3, model_->nv());
  mj_jac(model_->raw(), data_, rows.data(), nullptr, p_WP.data(), body.value);
  J = rows;
}

void Snapshot::angularMomentumJacobian(Eigen::Ref<Matrix3Xd> J) const {
  assert(J.cols() == model_->nv());
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> rows(3, model_->nv());
  mj_angmomMat(model_->raw(), data_, rows.data(), model_->root().value);
  J = rows;
}

void Snapshot::comJacobian(Eigen::Ref<Matrix3Xd> J) const {
  assert(J.cols() == model_->nv());
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> rows(3, model_->nv());
  mj_jacSubtreeCom(model_->raw(), data_, rows.data(), model_->root().value);
  J = rows;
}

void Snapshot::rotationJacobian(BodyId body, Eigen::Ref<Matrix3Xd> J) const {
  assert(J.cols() == model_->nv());
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> rows(3, model_->nv());
  mj_jac(model_->raw(), data_, nullptr, rows.data(), data_->xpos + 3 * body.value, body.value);
  J = rows;
}

void Snapshot::addComForce(const Vector3d& f, Eigen::Ref<VectorXd> tau) const {
  com_jacobian_.resize(3, model_->nv());
  comJacobian(com_jacobian_);
  tau += com_jacobian_.transpose() * f;
}

void Snapshot::addPointForce(BodyId body, const Vector3d& p_BP, const Vector3d& f,
                             Eigen::Ref<VectorXd> tau) const {
  assert(tau.size() == model_->nv());
  const Vector3d p_WP = bodyPosition(body) + bodyRotation(body) * p_BP;
  const Vector3d none = Vector3d::Zero();
  mj_applyFT(model_->raw(), data_, f.data(), none.data(), p_WP.data(), body.value, tau.data());
}

void Snapshot::addMoment(BodyId body, const Vector3d& moment, Eigen::Ref<VectorXd> tau) const {
  assert(tau.size() == model_->nv());
  const Vector3d none = Vector3d::Zero();
  mj_applyFT(model_->raw(), data_, none.data(), moment.data(), data_->xpos + 3 * body.value,
             body.value, tau.data());
}

void Snapshot::externalForce(Eigen::Ref<VectorXd> tau) const {
  using Map = Eigen::Map<const VectorXd>;
  const int n = model_->nv();
  tau = Map(data_->qfrc_passive, n) - Map(data_->qfrc_bias, n) + Map(data_->qfrc_constraint, n);
  if (!pushed_) return;
  for (int b = 1; b < model_->bodies(); ++b) {
    const mjtNum* push = data_->xfrc_applied + 6 * b;  // force and moment at the body's COM
    if (std::all_of(push, push + 6, [](mjtNum x) { return x == 0; })) continue;
    mj_applyFT(model_->raw(), data_, push, push + 3, data_->xipos + 3 * b, b, tau.data());
  }
}

void Snapshot::solveInertia(const VectorXd& d, Eigen::Ref<VectorXd> b) const {
  factor_->solve(data_->M, d.data(), b.data());
}

/// What sleeps is pressed on as it was when it fell asleep; the engine does not look any more.
void Snapshot::keepSleeping() {
  const int* state = data_->body_awake;  // of what never moves: neither
  const size_t seen = contacts_.size();
  const auto has = [&](BodyId body) {
    return std::any_of(contacts_.begin(), contacts_.begin() + static_cast<ptrdiff_t>(seen),
                       [&](const Contact& c) { return c.body_a == body || c.body_b == body; });
  };
  for (const Contact& c : before_) {
    const bool sleeps = state[c.body_a.value] == mjS_ASLEEP || state[c.body_b.value] == mjS_ASLEEP;
    const bool wakes = state[c.body_a.value] == mjS_AWAKE || state[c.body_b.value] == mjS_AWAKE;
    const BodyId sleeper = state[c.body_a.value] == mjS_ASLEEP ? c.body_a : c.body_b;
    if (sleeps && !wakes && !has(sleeper)) contacts_.push_back(c);  // not in its last step awake
  }
}

void Snapshot::capture() {
  const mjModel* m = model_->raw();
  before_.swap(contacts_);
  contacts_.clear();
  robot_contacts_.clear();
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& c = data_->contact[i];
    if (c.efc_address < 0) continue;  // in the margin, not pressing
    mjtNum wrench[6];                 // force and moment in the contact's frame
    mj_contactForce(m, data_, i, wrench);
    // The frame's rows are its axes in the world's; the first is the normal.
    const Vector3d f =
        vec(c.frame) * wrench[0] + vec(c.frame + 3) * wrench[1] + vec(c.frame + 6) * wrench[2];
    contacts_.push_back(
        {{m->geom_bodyid[c.geom1]}, {m->geom_bodyid[c.geom2]}, vec(c.pos), vec(c.frame), f});
    const Contact& found = contacts_.back();
    const bool a = model_->isRobot(found.body_a);
    if (a == model_->isRobot(found.body_b)) continue;
    robot_contacts_.push_back(
        {a ? found.body_a : found.body_b, a ? found.body_b : found.body_a, found.p_WC, a ? -f : f});
  }
  if ((m->opt.enableflags & mjENBL_SLEEP) != 0) keepSleeping();
  if (wants_joint_forces_) {
    mj_rnePostConstraint(m, data_);
    for (int b = 0; b < m->nbody; ++b) joint_forces_.col(b) = vec(data_->cfrc_int + 6 * b + 3);
  }
  has_com_velocity_ = has_angular_momentum_ = false;  // a reset comes here too
}

}  // namespace traceur::sim
