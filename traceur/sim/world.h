// One thread's copy of what changes.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "traceur/sim/model.h"
#include "traceur/sim/snapshot.h"

struct mjData_;  // NOLINT(readability-identifier-naming): MuJoCo's name

namespace traceur::sim {

/// Motor command, (nu) [N·m].
struct Torque {
  VectorXd tau;
};

/// All that a world is: put into another world of the same model, it goes on from there with the
/// same bits, contacts, warm starts and pushes included. Cheap to copy: immutable.
class Checkpoint {
 public:
  Checkpoint() = default;  // of nothing

  bool empty() const { return !data_; }
  const State& state() const { return state_; }

 private:
  friend class World;
  std::shared_ptr<const Model> model_;
  std::shared_ptr<const mjData_> data_;
  Snapshot snapshot_;
  State state_;
  bool out_of_room_ = false;
};

/// Life of a world:
///   1. reset(state) before the first step of an episode.
///   2. step(torque) once per time step; allocates nothing but, where contacts never were so many,
///      room for them.
///   3. snapshot() between steps, from the stepping thread only; it sees the world as it is then.
/// Integration is MuJoCo's semi-implicit Euler, implicit in joint damping; in flight the robot's
/// linear momentum is kept exactly.
/// Equal resets and torques give equal bits, in a new world and in one used before.
class World {
 public:
  explicit World(std::shared_ptr<const Model> model);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Whether Snapshot::jointForces is computed each step, which takes up to a tenth of it; from the
  /// next reset() or step() on.
  void watchJointForces(bool watch);
  /// @throws InputError when q or v have the wrong size or hold NaN
  void reset(const State& state);
  /// Only where things are, for much less than a reset(): of the snapshot the time, q, v,
  /// places, rotations, Jacobians and the COM hold, contacts are none, velocities and forces mean
  /// nothing. A reset() comes before the next step.
  /// @throws InputError as reset()
  void place(const State& state);
  /// place(), and whether any two bodies press on each other there.
  /// @throws InputError as reset()
  bool placePressed(const State& state);
  void step(const Torque& torque);
  Checkpoint save() const;
  /// Instead of reset(): as the world was that the checkpoint was taken from, of the same model.
  void restore(const Checkpoint& from);
  /// A force [N] and moment [N·m] in world axes on a body at its COM, held until changed or reset.
  /// It wakes what sleeps.
  void push(BodyId body, const Vector3d& force, const Vector3d& moment = Vector3d::Zero());

  void endPushes();

  const Snapshot& snapshot() const { return snapshot_; }
  State state() const;
  /// The simulation left the numbers it can represent (NaN or beyond 1e10 in position,
  /// velocity, acceleration or torque): what follows means nothing. Cleared by reset().
  bool diverged() const;
  /// There were more contacts than the model has room for, so that some were left out and bodies
  /// went through each other: what follows means nothing. Cleared by reset().
  bool overflowed() const;
  const Model& model() const { return *model_; }
  mjData_* raw() { return data_; }

 private:
  void check(const State& state, const char* caller) const;
  void write(const State& state);

  std::shared_ptr<const Model> model_;
  mjData_* data_ = nullptr;
  bool out_of_room_ = false;  // the engine gave up in a step: no other before a reset
  Snapshot snapshot_;
};

}  // namespace traceur::sim
