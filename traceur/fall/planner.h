// Which parts to put to the ground, where and when, so that the largest impulse is as small as can
// be: [Ha2015, §4.3.2] with the gaps of its Algorithm 1 closed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "traceur/fall/pendulum.h"
#include "traceur/fall/reach_table.h"

namespace traceur::fall {

/// What a pendulum that turns back before the next contact means. Algorithm 1 would simulate it for
/// ever.
enum class Stall {
  kStops,   ///< the fall has ended without another contact [default]
  kLiteral  ///< only an impact that turns the pendulum back ends a fall, as printed
};

/// How finely actions are tried.
struct Discretisation {
  int rod_rates = 3;      ///< of ṙ₁, evenly over ± rod_speed; odd, so that 0 is one of them
  double time = 0.02;     ///< between possible contacts [s]; a multiple of PendulumModel::step
  double angle = 0.1745;  ///< of θ₂ [rad]
};

/// All that planning needs of a robot in a stance.
struct FallProblem {
  PendulumModel model;
  ContactGraph graph;
  ReachTables reach;
  std::vector<std::vector<double>> first_angle;  ///< θ̂₂ of the stance, by node and edge [rad]
  /// Least and greatest r₁ among the random poses, by node [m]; a rod is planned for within, give
  /// or take a twentieth. Empty: no bounds, and no value table.
  std::vector<std::pair<double, double>> lengths;
  double rod_speed = 0;       ///< largest |ṙ₁| [m/s]
  double stopper_speed = 0;   ///< largest |θ̇₂| [rad/s]
  double least_interval = 0;  ///< from the beginning or a contact to the next contact [s]
  Discretisation grid;
  Stall stall = Stall::kStops;
  /// Longest time between two contacts that is looked at [s] [ours: twice what Atlas takes to the
  /// ground after the least published push].
  double horizon = 3;
};

struct FallState {
  int contact = 0;  ///< node on the ground
  double time = 0;  ///< since the fall began [s]
  PendulumState pendulum;
};

struct FallAction {
  int contact = 0;      ///< node that touches next
  double theta2 = 0;    ///< where its stopper is then [rad]
  double duration = 0;  ///< until then [s]
  double rod_rate = 0;  ///< ṙ₁ until then [m/s]
};

/// One contact of a plan.
struct PlannedContact {
  FallState from;        ///< when the contact before was made
  FallAction action;     ///< what leads to this one
  PendulumState before;  ///< the pendulum when it touches
  Impact impact;

  /// What it leads to.
  FallState next() const { return {action.contact, from.time + action.duration, impact.after}; }
};

struct FallPlan {
  double cost = 0;  ///< the largest impulse [N·s]; infinite where nothing can stop the fall
  std::vector<PlannedContact> contacts;
};

/// What a search looked at.
struct PlanEffort {
  std::uint64_t states = 0;
  std::uint64_t actions = 0;
};

/// The best plan of the discretised problem:
///
///     v(x) = min_a max(j(x, a), v(f(x, a))),   v = 0 where the pendulum has stopped
///
/// by branch and bound: actions in the order of their impulse, none tried whose impulse is not
/// below the best found. Exact.
FallPlan planExactly(const FallProblem& problem, const FallState& start,
                     PlanEffort* effort = nullptr);

/// The same by Algorithm 1 as printed, every action tried.
FallPlan planUnpruned(const FallProblem& problem, const FallState& start,
                      PlanEffort* effort = nullptr);

/// The same with the printed cache: a state nearer than `tolerance` to one seen before, by the
/// weights of [Ha2015, §4.3.2], has its value. Its cost is that of the plan it returns.
FallPlan planCached(const FallProblem& problem, const FallState& start, double tolerance = 0.1,
                    PlanEffort* effort = nullptr);

/// A part of a pose that is kept, seen from a node: its distance from the COM [m], and its angle
/// from the prolonged rod [rad].
struct HeldPart {
  std::string name;
  double r2 = 0;
  double theta2 = 0;
};

/// The fall of a pose as it is, rigid: the impulses of its parts as they meet the ground, in order.
/// The largest is what a plan has to be better than.
struct HeldImpact {
  std::string part;
  double time = 0;     ///< since the fall began [s]
  double impulse = 0;  ///< [N·s]
};
std::vector<HeldImpact> heldFall(const FallProblem& problem, const std::vector<HeldPart>& parts,
                                 const FallState& start);

/// The contact after an action, where the problem allows it.
std::optional<PlannedContact> tryAction(const FallProblem& problem, const FallState& from,
                                        const FallAction& action);

/// The plan of these actions from another state: where it leads there and what it costs. Ends where
/// the fall stops by itself or an action is not possible any more, with infinite cost then.
FallPlan replay(const FallProblem& problem, const FallState& start,
                const std::vector<FallAction>& actions);

}  // namespace traceur::fall
