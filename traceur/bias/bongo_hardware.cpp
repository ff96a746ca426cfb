#include "traceur/bias/bongo_hardware.h"

#include <box2d/box2d.h>

#include <cassert>
#include <cmath>
#include <deque>
#include <numbers>

#include "traceur/core/random.h"

namespace traceur::bias {
namespace {

/// Enough: 20, 100 and 750 velocity iterations fall alike within a percent [ours].
constexpr int kVelocityIterations = 50;
constexpr int kPositionIterations = 20;
constexpr float kSkin = 0.001F;  // of polygons [m], the paper's
constexpr float kGap = 1e-4F;    // between surfaces at a reset [m], the paper's

b2Vec2 vec(double x, double y) {
  return {static_cast<float>(x), static_cast<float>(y)};
}

void setMass(b2Body* body, double mass, double inertia_about_com, const b2Vec2& com) {
  b2MassData data;
  data.mass = static_cast<float>(mass);
  data.center = com;
  data.I = static_cast<float>(inertia_about_com) + data.mass * b2Dot(com, com);
  body->SetMassData(&data);
}

}  // namespace

struct BongoHardware::World {
  BongoParameters p;
  BongoFaults faults;
  std::uint64_t seed;
  double time_step;

  std::unique_ptr<b2World> world;
  b2Body* wheel = nullptr;
  b2Body* board = nullptr;
  b2Body* left = nullptr;
  b2Body* right = nullptr;

  std::uint64_t episode = 0;
  std::uint64_t step = 0;
  std::deque<double> late;
  VectorXd truth = VectorXd::Zero(6);
  VectorXd reading = VectorXd::Zero(6);

  b2Body* body(const b2Vec2& at, double angle) {
    b2BodyDef def;
    def.type = b2_dynamicBody;
    def.position = at;
    def.angle = static_cast<float>(angle);
    def.allowSleep = false;
    return world->CreateBody(&def);
  }

  void box(b2Body* b, double half_length, double half_height, const b2Vec2& centre,
           double friction) const {
    b2PolygonShape shape;
    shape.SetAsBox(static_cast<float>(half_length), static_cast<float>(half_height), centre, 0);
    shape.m_radius = kSkin;
    b2FixtureDef fixture;
    fixture.shape = &shape;
    fixture.friction = static_cast<float>(friction);
    b->CreateFixture(&fixture);
  }

  void hinge(b2Body* a, b2Body* b, const Eigen::Vector2d& at, double friction = 0) const {
    b2RevoluteJointDef def;
    def.Initialize(a, b, vec(at.x(), at.y()));
    if (friction > 0) {  // a motor that wants no motion and is only so strong
      def.enableMotor = true;
      def.maxMotorTorque = static_cast<float>(friction);
    }
    world->CreateJoint(&def);
  }

  void build(const VectorXd& x) {
    world = std::make_unique<b2World>(vec(0, -p.gravity));
    world->SetContinuousPhysics(false);
    const double scale = faults.inertia_scale;
    const double r = p.wheel_radius;
    const BongoBoard::State state = x;
    const BongoPose pose = poseOf(p, state);
    const double f = x[0] + x[1];
    const double leg_angle = f + x[2];
    const double half = p.thickness / 2;
    const auto rod = [&](double mass, double length) {
      return mass / 12 * (length * length + p.thickness * p.thickness);
    };

    b2BodyDef fixed;
    b2Body* ground = world->CreateBody(&fixed);
    // Two bodies of friction a and b touch with √(ab).
    box(ground, 10, 0.5, vec(0, -0.5 - kSkin), faults.ground_friction * faults.ground_friction);

    wheel = body(vec(pose.wheel.x(), pose.wheel.y() + kGap), x[0]);
    b2CircleShape disc;
    disc.m_radius = static_cast<float>(r);
    b2FixtureDef fixture;
    fixture.shape = &disc;
    fixture.friction = 1;
    wheel->CreateFixture(&fixture);
    const double wheel_mass = scale * std::numbers::pi * r * r * p.wheel_density;
    setMass(wheel, wheel_mass, 0.5 * wheel_mass * r * r, {0, 0});

    // The model's bodies are lines: the board's lower face is where its line is.
    const auto raised = [](const Eigen::Vector2d& at) { return vec(at.x(), at.y() + 2 * kGap); };
    board = body(raised(pose.board), f);
    box(board, p.board_length / 2, half, vec(0, half + kSkin),
        faults.board_friction * faults.board_friction);
    setMass(board, scale * p.board_mass, rod(scale * p.board_mass, p.board_length), {0, 0});

    const double m1 = scale * p.leg_mass;
    left = body(raised(0.5 * (pose.left_foot + pose.left_hip)), leg_angle);
    right = body(raised(0.5 * (pose.right_foot + pose.right_hip)), leg_angle);
    for (b2Body* leg : {left, right}) setMass(leg, m1, rod(m1, p.leg_length), {0, 0});
    b2Body* pelvis = body(raised(pose.pelvis), f);
    const double m2 = scale * p.pelvis_mass;
    setMass(pelvis, 2 * m2, 2 * rod(m2, p.pelvis_length), vec(faults.com_offset, 0));

    const Eigen::Vector2d up(0, 2 * kGap);
    hinge(board, left, pose.left_foot + up, faults.coulomb_friction / 2);
    hinge(board, right, pose.right_foot + up, faults.coulomb_friction / 2);
    hinge(left, pelvis, pose.left_hip + up);
    hinge(right, pelvis, pose.right_hip + up);

    setVelocities(state);
  }

  /// Of all bodies' COMs, as the mechanism moves.
  void setVelocities(const BongoBoard::State& x) {
    const double vf = x[3] + x[4];
    const double vp = vf + x[5];
    const double h = 1e-6;  // poses are smooth: central differences are exact enough
    BongoBoard::State later = x, earlier = x;
    later.head<3>() += h * x.tail<3>();
    earlier.head<3>() -= h * x.tail<3>();
    const BongoPose a = poseOf(p, earlier);
    const BongoPose b = poseOf(p, later);
    const auto set = [&](b2Body* body, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                         double rate) {
      const Eigen::Vector2d v = (to - from) / (2 * h);
      body->SetLinearVelocity(vec(v.x(), v.y()));
      body->SetAngularVelocity(static_cast<float>(rate));
    };
    set(wheel, a.wheel, b.wheel, x[3]);
    set(board, a.board, b.board, vf);
    set(left, 0.5 * (a.left_foot + a.left_hip), 0.5 * (b.left_foot + b.left_hip), vp);
    set(right, 0.5 * (a.right_foot + a.right_hip), 0.5 * (b.right_foot + b.right_hip), vp);
    b2Body* pelvis = world->GetBodyList();  // the last one made
    set(pelvis, a.pelvis, b.pelvis, vf);
  }

  void read() {
    truth << wheel->GetAngle(), board->GetAngle() - wheel->GetAngle(),
        right->GetAngle() - board->GetAngle(), wheel->GetAngularVelocity(),
        board->GetAngularVelocity() - wheel->GetAngularVelocity(),
        right->GetAngularVelocity() - board->GetAngularVelocity();
    reading = truth;
    Random noise(seed, episode, 2 * step);
    for (int i = 0; i < 6; ++i) {
      const double variance = i < 3 ? faults.angle_variance : faults.rate_variance;
      if (variance > 0) reading[i] += std::sqrt(variance) * noise.normal();
      if (i < 3 && faults.encoder_step > 0) {
        reading[i] = faults.encoder_step * std::round(reading[i] / faults.encoder_step);
      }
    }
  }
};

BongoHardware::BongoHardware(const BongoParameters& parameters, const BongoFaults& faults,
                             std::uint64_t seed, double time_step)
    : world_(std::make_unique<World>()) {
  world_->p = parameters;
  world_->faults = faults;
  world_->seed = seed;
  world_->time_step = time_step;
  reset(VectorXd::Zero(6));
  world_->episode = 0;
}

BongoHardware::~BongoHardware() = default;

double BongoHardware::timeStep() const {
  return world_->time_step;
}

void BongoHardware::reset(const VectorXd& x) {
  assert(x.size() == 6);
  World& w = *world_;
  ++w.episode;
  w.step = 0;
  w.late.assign(static_cast<size_t>(std::lround(w.faults.delay / w.time_step)), 0.0);
  w.build(x);
  w.read();
}

void BongoHardware::step(const VectorXd& u) {
  assert(u.size() == 1);
  World& w = *world_;
  w.late.push_back(u[0]);
  double torque = w.faults.torque_gain * w.late.front();
  w.late.pop_front();
  if (w.faults.torque_variance > 0) {
    Random noise(w.seed, w.episode, 2 * w.step + 1);
    torque += std::sqrt(w.faults.torque_variance) * noise.normal();
  }
  torque -= w.faults.viscous_friction * w.truth[5];
  const auto each = static_cast<float>(torque / 2);
  w.left->ApplyTorque(each, true);
  w.right->ApplyTorque(each, true);
  w.board->ApplyTorque(-2 * each, true);
  w.world->Step(static_cast<float>(w.time_step), kVelocityIterations, kPositionIterations);
  ++w.step;
  w.read();
}

const VectorXd& BongoHardware::state() const {
  return world_->reading;
}

const VectorXd& BongoHardware::trueState() const {
  return world_->truth;
}

bool BongoHardware::boardOnWheel() const {
  for (const b2ContactEdge* e = world_->board->GetContactList(); e; e = e->next) {
    if (e->other == world_->wheel && e->contact->IsTouching()) return true;
  }
  return false;
}

double BongoHardware::boardHeight() const {
  const auto half = static_cast<float>(world_->p.board_length / 2);
  return std::min(world_->board->GetWorldPoint({half, 0}).y,
                  world_->board->GetWorldPoint({-half, 0}).y);
}

}  // namespace traceur::bias
