#include "traceur/fall/fall_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "traceur/control/stable_pd.h"
#include "traceur/core/error.h"

namespace traceur::fall {
namespace {

using Eigen::VectorXd;

/// The forces that a fall is judged by.
class Meter {
 public:
  Meter(const SagittalBody& body, const FallProtocol& protocol, std::string head)
      : body_(&body),
        model_(body.model()),
        window_(std::max(1, static_cast<int>(std::lround(protocol.window / protocol.time_step)))),
        head_(std::move(head)),
        off_(model_->bodies(), 0),
        standing_(model_->bodies(), false) {
    // What the stance stands on is its own.
    for (const std::string& name : body_->setup().graph.nodes[0].points) {
      standing_[model_->body(model_->robot()->contacts.at(name).body).value] = true;
    }
  }

  /// Once after each step.
  void read(const sim::Snapshot& s, FallTrial& trial) {
    std::vector<bool> touches(standing_.size());
    double force = 0;
    for (const sim::Contact& c : s.contacts()) {
      const bool a = model_->isRobot(c.body_a);
      if (a == model_->isRobot(c.body_b)) continue;  // the robot on itself
      const sim::BodyId b = a ? c.body_a : c.body_b;
      touches[b.value] = true;
      if (standing_[b.value]) continue;
      force += (a ? -1 : 1) * c.f_WC.z();
      note(body_->partAt(s, b, c.p_WC), s.time(), trial);
    }
    for (size_t b = 0; b < standing_.size(); ++b) {
      off_[b] = touches[b] ? 0 : off_[b] + 1;
      if (off_[b] >= window_) standing_[b] = false;
    }
    const double h = model_->timeStep();
    forces_.push_back(force);
    sum_ += force * h;
    if (static_cast<int>(forces_.size()) > window_) {
      sum_ -= forces_.front() * h;
      forces_.pop_front();
    }
    trial.impulse = std::max(trial.impulse, sum_);
    trial.raw_impulse = std::max(trial.raw_impulse, force * h);
    trial.peak_force = std::max(trial.peak_force, force);
    if (!trial.contacts.empty()) {
      trial.contacts.back().impulse = std::max(trial.contacts.back().impulse, sum_);
    }
    if (trial.windowed.empty() || s.time() - trial.windowed.back().first > 0.001 - h / 2) {
      trial.windowed.emplace_back(s.time(), sum_);
    }
    const sim::ContactPoint& head = model_->robot()->contacts.at(head_);
    sim::Matrix3Xd J = sim::Matrix3Xd::Zero(3, model_->nv());
    s.pointJacobian(model_->body(head.body), head.p_BP, J);
    const sim::Vector3d v = J * s.v();
    head_velocities_.push_back(v);
    if (static_cast<int>(head_velocities_.size()) > window_) {
      const double acceleration = (v - head_velocities_.front()).norm() / (window_ * h);
      trial.peak_head = std::max(trial.peak_head, acceleration);
      head_velocities_.pop_front();
    }
  }

 private:
  void note(const std::string& part, double time, FallTrial& trial) const {
    trial.head_hit = trial.head_hit || part == head_;
    for (const GroundContact& c : trial.contacts) {
      if (c.part == part) return;
    }
    trial.contacts.push_back({part, time, 0});
  }

  const SagittalBody* body_;
  std::shared_ptr<const sim::Model> model_;
  int window_;
  std::string head_;
  std::vector<int> off_;  // steps each body has been off the ground
  std::vector<bool> standing_;
  std::deque<double> forces_;
  double sum_ = 0;
  std::deque<sim::Vector3d> head_velocities_;
};

/// The support's limit, in weights [ours].
constexpr double kLift = 1.5;

/// Follows a plan's stages, and asks for another plan where it does not go as planned.
class Follower {
 public:
  /// Made when the fall is noticed.
  /// @param before  the joints' targets until then
  Follower(const SagittalBody& body, const FallTracking& tracking, FallSimulator::Plan plan,
           const sim::World& world, const control::JointTarget& before)
      : body_(&body),
        model_(body.model()),
        tracking_(tracking),
        plan_(std::move(plan)),
        noticed_(world.snapshot().time()),
        begun_(noticed_),
        asked_(noticed_),
        target_(before) {
    ask(world.snapshot(), world.state());
  }

  /// The joints' targets now.
  /// @param pose  the world's
  control::JointTarget target(const sim::Snapshot& s, const sim::State& pose) {
    if (stage_ < motion_.stages.size()) {
      const FallMotion::Stage& stage = motion_.stages[stage_];
      const double late = std::max(tracking_.least_wait, tracking_.late * stage.duration);
      const bool touched = touches(s, stage);
      if (touched || s.time() - begun_ > stage.duration + late) {
        if (touched) {
          node_ = stage.node;
          made_nodes_.push_back(node_);
        }
        ++stage_;
        ++made_;
        if (!(touched && ask(s, pose))) enter(s.time());
      }
    } else if (s.time() - asked_ > tracking_.again && falling(s)) {
      asked_ = s.time();
      ask(s, pose);
    }
    if (way_.empty()) return target_;
    const double n = static_cast<double>(way_.size());
    const double along = ramp_ > 0 ? std::clamp((s.time() - begun_) / ramp_, 0.0, 1.0) * n : n;
    const size_t next = std::min(static_cast<size_t>(along), way_.size() - 1);
    const VectorXd& before_it = next == 0 ? from_.q : way_[next - 1].q;
    target_.q = before_it + (along - static_cast<double>(next)) * (way_[next].q - before_it);
    return target_;
  }

  int phase() const { return made_; }
  /// There has been no plan yet: the pose is kept.
  bool waiting() const { return motion_.stages.empty() && motion_.rest.q.size() == 0; }
  /// All contacts of the plan have been made.
  bool resting() const { return stage_ >= motion_.stages.size(); }

  /// Adds what bears the COM from the part it turns about: the rod's force of Eq. 12 as a pair of
  /// equal and opposite forces on the two, by the transposed Jacobian.
  void addSupport(const sim::Snapshot& s, VectorXd& tau) {
    if (tracking_.support == 0 || resting()) return;
    const PendulumState p = body_->pendulum(s, node_);
    const double weight = model_->mass() * 9.81;
    const double force =
        model_->mass() * (9.81 * std::cos(p.theta) - p.r * p.theta_rate * p.theta_rate +
                          (motion_.stages[stage_].rod_rate - p.r_rate) / tracking_.rod_time);
    const auto& names = body_->setup().graph.nodes[node_].points;
    sim::Vector3d pivot = sim::Vector3d::Zero();
    for (const std::string& name : names) pivot += body_->point(s, name);
    const sim::Vector3d rod = s.com() - pivot / static_cast<double>(names.size());
    // The ground does not pull, and motors that could lift it faster than this there are none.
    const sim::Vector3d f =
        tracking_.support * std::clamp(force, 0.0, kLift * weight) * rod.normalized();
    J_.setZero(3, model_->nv());
    s.comJacobian(J_);
    tau += J_.transpose() * f;
    for (const std::string& name : names) {
      const sim::ContactPoint& at = model_->robot()->contacts.at(name);
      s.addPointForce(model_->body(at.body), at.p_BP, -f / static_cast<double>(names.size()), tau);
    }
  }

 private:
  sim::Matrix3Xd J_;
  /// Takes up what the plan says from here, if it says anything.
  bool ask(const sim::Snapshot& s, const sim::State& pose) {
    const FallState start{node_, s.time() - noticed_, body_->pendulum(s, node_)};
    std::vector<PoseSolver::Goal> made;
    for (const int node : made_nodes_) {
      if (node != node_) made.push_back({node, body_->node(s, node) - body_->node(s, node_)});
    }
    std::optional<FallMotion> motion = plan_(start, made, pose);
    if (!motion || (motion->stages.empty() && motion->rest.q.size() == 0)) return false;
    motion_ = std::move(*motion);
    stage_ = 0;
    enter(s.time());
    return true;
  }

  void enter(double time) {
    begun_ = asked_ = time;
    from_ = target_;
    if (stage_ >= motion_.stages.size()) {
      if (motion_.rest.q.size() == 0) return;
      way_ = {control::targetOf(*model_, motion_.rest)};
      ramp_ = tracking_.rest;
      return;
    }
    way_.clear();
    for (const sim::State& pose : motion_.stages[stage_].poses) {
      way_.push_back(control::targetOf(*model_, pose));
    }
    ramp_ = tracking_.ramp * motion_.stages[stage_].duration;
  }

  /// Whether the extrapolated COM is past the node it should turn about.
  bool falling(const sim::Snapshot& s) const {
    const Vector2d com = body_->com(s);
    return com.x() + body_->comVelocity(s).x() * std::sqrt(com.y() / 9.81) >
           body_->node(s, node_).x();
  }

  bool touches(const sim::Snapshot& s, const FallMotion::Stage& stage) const {
    for (const sim::Contact& c : s.contacts()) {
      const bool a = model_->isRobot(c.body_a);
      if (a == model_->isRobot(c.body_b)) continue;
      const std::string part = body_->partAt(s, a ? c.body_a : c.body_b, c.p_WC);
      if (std::find(stage.points.begin(), stage.points.end(), part) != stage.points.end()) {
        return true;
      }
    }
    return false;
  }

  const SagittalBody* body_;
  std::shared_ptr<const sim::Model> model_;
  FallTracking tracking_;
  FallSimulator::Plan plan_;
  FallMotion motion_;
  size_t stage_ = 0;
  int made_ = 0;  // stages ended
  int node_ = 0;  // the last that touched
  std::vector<int> made_nodes_ = {0};
  double noticed_;
  double begun_;  // the stage, or the way to rest
  double asked_;
  double ramp_ = 0;
  control::JointTarget from_, target_;
  std::vector<control::JointTarget> way_;
};

std::shared_ptr<const sim::Model> modelOf(const FallRobot& falls, const FallProtocol& protocol) {
  return sim::Model::fromScene(
      {.robot = falls.robot, .ground_material = protocol.ground, .time_step = protocol.time_step});
}

}  // namespace

std::string_view nameOf(Strategy strategy) {
  switch (strategy) {
    case Strategy::kPlanned:
      return "planned";
    case Strategy::kHold:
      return "hold";
    case Strategy::kLimp:
      return "limp";
    case Strategy::kDamp:
      return "damp";
    case Strategy::kTuck:
      return "tuck";
  }
  return "";
}

FallMotion motionOf(const FallPlan& plan, const PendulumModel& model, const SagittalBody& body,
                    PoseSolver& poses, const FallTracking& tracking, const FallState& start,
                    const std::vector<PoseSolver::Goal>& made, const sim::State& pose) {
  FallMotion motion;
  // At rest over the middle of the last two parts that touched, a little lower, so that both are
  // reached.
  const auto body_of = [&](int node) {
    const std::string& point = body.setup().graph.nodes[node].points.front();
    return body.model()->robot()->contacts.at(point).body;
  };
  const auto rest = [&](const PoseSolver::Goal& last, const std::vector<PoseSolver::Goal>& before,
                        double height, const sim::State& near) {
    std::vector<PoseSolver::Goal> on = {last};
    for (auto b = before.rbegin(); b != before.rend() && on.size() < 2; ++b) {
      if (body_of(b->node) != body_of(last.node)) on.push_back(*b);
    }
    double least = 0;
    double most = 0;
    for (PoseSolver::Goal& g : on) {
      g.weight = 1;
      g.place.y() = 0;
      least = std::min(least, g.place.x());
      most = std::max(most, g.place.x());
    }
    return poses.solve(on, {(least + most) / 2, tracking.rest_height * height}, near);
  };
  if (plan.contacts.empty()) {
    if (start.contact == 0) return motion;
    motion.rest = rest({start.contact, Vector2d::Zero()}, made, start.pendulum.com().y(), pose);
    return motion;
  }
  std::vector<PoseSolver::Goal> kept = made;
  for (PoseSolver::Goal& k : kept) k.weight = tracking.kept;
  sim::State from = pose;
  for (const PlannedContact& c : plan.contacts) {
    const Vector2d tip(c.impact.advance, 0);
    FallMotion::Stage stage{c.action.contact,
                            body.setup().graph.nodes[c.action.contact].points,
                            c.action.duration,
                            c.action.rod_rate,
                            {}};
    std::vector<PoseSolver::Goal> goals = {{c.from.contact, Vector2d::Zero()},
                                           {c.action.contact, tip}};
    goals.insert(goals.end(), kept.begin(), kept.end());
    // Where the pendulum is on the way; the next part is drawn to its place more and more.
    PendulumState s = c.from.pendulum;
    const int steps = static_cast<int>(std::lround(c.action.duration / model.step));
    int done = 0;
    for (int k = 1; k <= tracking.waypoints; ++k) {
      for (; done < steps * k / tracking.waypoints; ++done) step(model, c.action.rod_rate, s);
      const double part = static_cast<double>(k) / tracking.waypoints;
      goals[1].weight = k == tracking.waypoints ? 1 : tracking.approach * part;
      from = poses.solve(goals, s.com(), from);
      stage.poses.push_back(from);
    }
    motion.stages.push_back(std::move(stage));
    kept.push_back({c.from.contact, Vector2d::Zero(), tracking.kept});
    for (PoseSolver::Goal& k : kept) k.place -= tip;
    if (&c == &plan.contacts.back()) {
      motion.rest = rest({c.action.contact, Vector2d::Zero()}, kept, c.before.com().y(), from);
    }
  }
  return motion;
}

FallSimulator::FallSimulator(const FallRobot& falls, FallSetup setup, FallProtocol protocol)
    : falls_(&falls),
      protocol_(protocol),
      body_(modelOf(falls, protocol), std::move(setup)),
      stance_(body_.model()->stateOf(falls.robot->poses.at(body_.setup().stance))) {}

void FallSimulator::checkStance() const {
  static constexpr double kStill = 0.5;       // [s]
  static constexpr double kOffGround = 0.02;  // of the COM's height
  const std::string& stance = body_.setup().stance;
  const ContactNode& first = body_.setup().graph.nodes[0];
  sim::World world(body_.model());
  world.reset(stance_);
  const sim::Snapshot& s = world.snapshot();
  for (const std::string& name : first.points) {
    const double height = body_.point(s, name).z();
    if (height <= kOffGround * body_.com(s).y()) continue;
    throw InputError(fmt::format(
        "{}: in the stance \"{}\" the contact point \"{}\" of \"{}\", on which it should stand, is "
        "{:.3g} m above the ground",
        falls_->robot->name, stance, name, first.name, height));
  }
  if (!body_.setup().stands) return;
  control::StablePd pd = control::defaultController(body_.model());
  const control::JointTarget held = control::targetOf(*body_.model(), stance_);
  VectorXd tau(body_.model()->nv());
  sim::Torque command{VectorXd::Zero(body_.model()->nu())};
  while (s.time() < kStill) {
    tau.setZero();
    pd.addTorque(s, held, tau);
    control::toMotors(*body_.model(), tau, command);
    world.step(command);
    if (!world.diverged() && body_.com(s).x() <= body_.node(s, 0).x()) continue;
    throw InputError(
        fmt::format("{}: the stance \"{}\" cannot stand still: unpushed, it begins to fall after "
                    "{:.2f} s",
                    falls_->robot->name, stance, s.time()));
  }
}

FallTrial FallSimulator::run(const Push& push, Strategy strategy, const Plan& plan,
                             sim::Recording* recording) {
  const std::shared_ptr<const sim::Model>& model = body_.model();
  const double h = protocol_.time_step;
  sim::World world(model);
  world.reset(stance_);
  const sim::Snapshot& s = world.snapshot();
  control::StablePd pd = control::defaultController(model);
  const FallTracking& tracking = falls_->tracking;
  const std::vector<sim::JointGain> gains(pd.gains().begin(), pd.gains().end());
  const double stiffness = body_.setup().quick.stiffness;
  control::JointTarget goal;
  const control::JointTarget held = control::targetOf(*model, stance_);
  const control::JointTarget tuck =
      control::targetOf(*model, model->stateOf(falls_->robot->poses.at(falls_->tuck)));
  const sim::BodyId pushed = model->body(falls_->push_body);
  const sim::Vector3d force(body_.setup().sign() * push.force, 0, 0);
  FallTrial trial;
  Meter meter(body_, protocol_, falls_->head);
  std::optional<Follower> follower;
  VectorXd tau(model->nv());
  sim::Torque command{VectorXd::Zero(model->nu())};
  double pivot = body_.node(s, 0).x();
  const int push_steps = static_cast<int>(std::lround(push.duration / h));
  const int patience = push_steps + static_cast<int>(std::lround(protocol_.patience / h));
  const int settle = static_cast<int>(std::lround(protocol_.settle / h));
  const int record_every = std::max(1, static_cast<int>(std::lround(0.01 / h)));
  int noticed = -1;
  if (recording) {
    recording->mjcf = model->mjcf();
    recording->phases = {"push"};
    recording->frames.clear();
  }
  for (int k = 0;; ++k) {
    if (recording && k % record_every == 0) {
      const int phase = noticed < 0 ? 0 : 1 + (follower ? follower->phase() : 0);
      recording->frames.push_back(sim::frameOf(s, phase, command.tau));
    }
    if (k > 0) meter.read(s, trial);
    if (world.diverged() || world.overflowed()) {
      trial.diverged = true;
      break;
    }
    if (noticed < 0 && k >= push_steps) {
      const Vector2d com = body_.com(s);
      const double rate = std::sqrt(9.81 / com.y());
      if (com.x() + body_.comVelocity(s).x() / rate > pivot) {
        noticed = k;
        trial.fell = true;
        trial.noticed = s.time();
        trial.start = {0, 0, body_.pendulum(s, 0)};
        pivot = body_.node(s, 0).x();
        if (strategy == Strategy::kPlanned) {
          follower.emplace(body_, tracking, plan, world, held);
        }
      } else if (k > patience) {
        break;
      }
    }
    if (noticed >= 0) {
      if (k >= noticed + settle) break;
      if ((k - noticed) % record_every == 0) {
        trial.com.push_back(body_.com(s) - Vector2d(pivot, 0));
      }
    }
    if (k == 0 && push.force != 0) world.push(pushed, force);
    if (k == push_steps && push.force != 0) world.push(pushed, sim::Vector3d::Zero());
    tau.setZero();
    const Strategy now = noticed < 0 ? Strategy::kHold : strategy;
    switch (now) {
      case Strategy::kHold:
        pd.addTorque(s, held, tau);
        break;
      case Strategy::kTuck:
        pd.addTorque(s, tuck, tau);
        break;
      case Strategy::kPlanned:
        goal = follower->target(s, world.state());
        for (size_t i = 0; i < gains.size(); ++i) {
          if (follower->waiting()) {
            pd.gains()[i] = gains[i];
          } else if (follower->resting()) {
            pd.gains()[i] = {gains[i].kp * tracking.rest_stiffness.value_or(stiffness),
                             gains[i].kd * tracking.rest_damping};
          } else {
            pd.gains()[i] = {gains[i].kp * stiffness, gains[i].kd * tracking.damping};
          }
        }
        pd.addTorque(s, goal, tau);
        follower->addSupport(s, tau);
        for (const sim::Joint& j : model->joints()) {  // both together
          tau[j.v] = control::limitedTorque(tau[j.v], s.v()[j.v], j.limit);
        }
        break;
      case Strategy::kLimp:
        break;
      case Strategy::kDamp:
        for (sim::JointGain& g : pd.gains()) g.kp = 0;
        pd.addTorque(s, held, tau);
        break;
    }
    control::toMotors(*model, tau, command);
    for (const sim::Joint& j : model->joints()) {
      if (j.motor < 0) continue;
      trial.peak_torque =
          std::max(trial.peak_torque, std::abs(command.tau[j.motor]) / j.limit.torque);
    }
    world.step(command);
  }
  if (recording) {
    int last = 0;
    for (const sim::Frame& f : recording->frames) last = std::max(last, f.phase);
    while (static_cast<int>(recording->phases.size()) <= last) {
      recording->phases.push_back(strategy == Strategy::kPlanned
                                      ? "contact " + std::to_string(recording->phases.size())
                                      : std::string(nameOf(strategy)));
    }
  }
  return trial;
}

}  // namespace traceur::fall
