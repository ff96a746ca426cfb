#include "traceur/motion/session.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace traceur::motion {
namespace {

int inSteps(double time, double dt) {
  static constexpr double kMost = 1e9;
  return static_cast<int>(std::lround(std::clamp(time / dt, -kMost, kMost)));
}

std::span<const double> numbers(const Eigen::Ref<const Eigen::VectorXd>& x) {
  return {x.data(), static_cast<size_t>(x.size())};
}

}  // namespace

class Session::NoisySenses : public Senses {
 public:
  NoisySenses(const sim::Snapshot& s, double velocity_noise, Random& noise)
      : s_(&s), velocity_noise_(velocity_noise), noise_(&noise) {}
  Eigen::Vector3d comVelocity() override {
    Eigen::Vector3d v = s_->comVelocity();
    if (velocity_noise_ > 0) {
      for (double& x : v) x += velocity_noise_ * noise_->normal();
    }
    return v;
  }

 private:
  const sim::Snapshot* s_;
  double velocity_noise_;
  Random* noise_;
};

Session::Session(sim::World& world, control::Actuation& actuation, Controller& controller,
                 std::span<Observer* const> observers)
    : world_(&world),
      actuation_(&actuation),
      controller_(&controller),
      observers_(observers.begin(), observers.end()) {}

int Session::stepsOf(double interval, double dt) {
  return std::max(1, inSteps(interval, dt));
}

void Session::prepare(const TrialOptions& options) {
  options_ = options;
  trial_ = {};
  hash_ = {};
  step_ = 0;
  ended_ = false;
  steps_ = inSteps(options_.horizon, world_->model().timeStep());
  every_ = stepsOf(options_.decision_interval, world_->model().timeStep());
  actuation_->holdFor(every_ * world_->model().timeStep());
  noise_ = Random(options_.seed, options_.stream);
  world_->watchJointForces(options_.recording != nullptr || options_.joint_forces);
  command_ = {};
  late_.clear();
  torque_.tau.setZero(world_->model().nu());
}

void Session::begin(const sim::State& start, const TrialOptions& options) {
  prepare(options);
  world_->reset(start);
  actuation_->begin();
  command_.target = control::targetOf(world_->model(), start);
  if (const int delay = inSteps(options_.delay, world_->model().timeStep()); delay > 0) {
    // Until the first answer comes, motors do what holds the start.
    actuation_->torque(world_->snapshot(), command_, torque_);
    late_.assign(static_cast<size_t>(delay), torque_);
  }
  this->start();
}

void Session::begin(const Ending& start, const TrialOptions& options) {
  prepare(options);
  world_->restore(start.world);
  world_->endPushes();
  actuation_->begin(start.integral);
  command_.target = start.target;
  torque_.tau = world_->snapshot().torque();
  late_ = start.late;
  assert(static_cast<int>(late_.size()) == inSteps(options_.delay, world_->model().timeStep()));
  this->start();
}

void Session::start() {
  began_ = world_->snapshot().time();
  if (options_.recording) {
    peaks_.setZero(world_->model().bodies());
    options_.recording->mjcf = world_->model().mjcf();
    options_.recording->frames.clear();
  }
  const Moment m{world_->snapshot(), 0, 0};
  controller_->begin(m, command_.target);
  for (Observer* o : observers_) o->begin(m);
  if (options_.recording) options_.recording->phases = controller_->phases();
}

Ending Session::ending() const {
  return {world_->save(), command_.target, actuation_->integral(), late_};
}

bool Session::step() {
  assert(!ended_);
  const sim::Snapshot& s = world_->snapshot();
  const double dt = world_->model().timeStep();
  const Moment m{s, step_, step_ * dt, step_ % every_ == 0};
  const bool meddled = step_ < steps_ && meddle();
  if (m.decides) controller_->update(m);
  std::string_view why = step_ >= steps_ ? "horizon" : "";
  for (Observer* o : observers_) {
    const std::string_view word = o->ends(m);
    if (why.empty() || why == "horizon") why = word.empty() ? why : word;
  }
  const bool last = !why.empty();
  for (Observer* o : observers_) o->see(m, last);
  const bool due = step_ % std::max(1, inSteps(kInterval, dt)) == 0;
  if (due || last) {
    hash_.add(numbers(s.q()));
    hash_.add(numbers(s.v()));
  }
  if (options_.recording) record(due);
  if (last) return finish(m, why);

  push(m, meddled);
  if (m.decides) decide(m);
  torque_ = decided_;
  if (!late_.empty()) {
    late_.push_back(torque_);
    torque_ = late_.front();
    late_.pop_front();
  }
  world_->step(torque_);
  ++step_;
  if (!world_->diverged() && !world_->overflowed()) return true;
  trial_.diverged = true;
  return finish(m, world_->diverged() ? "diverged" : "too many contacts");
}

void Session::decide(const Moment& m) {
  const sim::Snapshot& s = m.s;
  NoisySenses senses(s, options_.velocity_noise, noise_);
  command_.stiffness.resize(0);
  command_.damping.resize(0);
  command_.forces.clear();
  command_.limited = command_.expected = true;
  controller_->command(m, senses, command_);
  const control::Command* told = &command_;
  if (options_.encoder_noise > 0) {
    // To a PD controller an angle read too large is a target too small.
    misread_ = command_;
    for (double& q : misread_.target.q) q -= options_.encoder_noise * noise_.normal();
    told = &misread_;
  }
  actuation_->torque(s, *told, decided_);
  for (Observer* o : observers_) o->commanded(m, *told, decided_);
}

void Session::record(bool due) {
  const sim::Snapshot& s = world_->snapshot();
  // At the start no step has made any.
  if (step_ > 0) peaks_ = peaks_.cwiseMax(s.jointForces().colwise().norm().transpose());
  if (!due) return;
  options_.recording->frames.push_back(sim::frameOf(s, controller_->phase(), torque_.tau));
  options_.recording->frames.back().joint_forces = peaks_;
  options_.recording->frames.back().state.time -= began_;
  peaks_.setZero();
}

bool Session::finish(const Moment& m, std::string_view why) {
  ended_ = true;
  trial_.ended = why;
  trial_.time = m.time;
  trial_.end = world_->state();
  trial_.hash = hash_.value();
  if (options_.recording) options_.recording->phases = controller_->phases();
  return false;
}

/// Puts things elsewhere where it is time to.
bool Session::meddle() {
  const sim::Model& model = world_->model();
  const auto now = [&](double start) { return step_ == inSteps(start, model.timeStep()); };
  bool meddled = false;
  const auto change = [&](const auto& how) {
    sim::State state = world_->state();
    how(state);
    world_->reset(state);
    meddled = true;
  };
  const sim::Snapshot& s = world_->snapshot();
  for (const Drag& d : options_.drags) {
    if (!now(d.start)) continue;
    change([&](sim::State& state) {
      const Eigen::Vector3d com = s.com();
      const Eigen::Vector3d velocity = s.comVelocity();
      auto at = state.q.segment<3>(model.rootQ());
      at = com + d.turn * (at - com) + d.by;
      auto v = state.v.segment<3>(model.rootV());
      v = velocity + d.turn * (v - velocity);
      auto q = state.q.segment<4>(model.rootQ() + 3);  // w x y z
      const Eigen::Quaterniond turned =
          Eigen::Quaterniond(d.turn) * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
      q << turned.w(), turned.x(), turned.y(), turned.z();
    });
  }
  for (const Shot& shot : options_.shots) {
    if (!now(shot.start)) continue;
    change([&](sim::State& state) {
      const Eigen::Vector3d towards = (shot.velocity - s.comVelocity()).normalized();
      model.putFree(state, shot.body, s.com() - shot.distance * towards, shot.velocity);
    });
  }
  return meddled;
}

/// @param anew  nothing is pushed any more
void Session::push(const Moment& m, bool anew) {
  const double dt = world_->model().timeStep();
  const auto begins = [&](const Push& p) { return inSteps(p.start, dt); };
  const auto ends = [&](const Push& p) { return begins(p) + inSteps(p.duration, dt); };
  for (const Push& changed : options_.pushes) {
    const bool under_way = begins(changed) < m.step && ends(changed) > m.step;
    const bool first = (m.step == 0 || anew) && under_way;
    if (!first && m.step != begins(changed) && m.step != ends(changed)) continue;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (const Push& p : options_.pushes) {
      if (p.body != changed.body || m.step < begins(p) || m.step >= ends(p)) continue;
      force += p.force;
      moment += p.moment;
    }
    world_->push(changed.body, force, moment);
  }
}

const Trial& Session::run(const sim::State& start, const TrialOptions& options) {
  begin(start, options);
  while (step()) {
  }
  return trial_;
}

const Trial& Session::run(const Ending& start, const TrialOptions& options) {
  begin(start, options);
  while (step()) {
  }
  return trial_;
}

}  // namespace traceur::motion
