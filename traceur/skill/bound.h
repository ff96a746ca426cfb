// Expressions of a skill file bound to a trial's numbers.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "traceur/control/pose_solver.h"
#include "traceur/control/stable_pd.h"
#include "traceur/flight/planner.h"
#include "traceur/skill/places.h"

namespace traceur::skill {

struct BoundVector {
  control::Expression x, y, z;

  BoundVector(const VectorText& text, const control::Expression::Lookup& lookup)
      : x(text.x, lookup), y(text.y, lookup), z(text.z, lookup) {}
  Vector3d value() const { return {x.value(), y.value(), z.value()}; }
};

/// Null for an empty text.
inline std::optional<control::Expression> maybeBound(const std::string& text,
                                                     const control::Expression::Lookup& lookup) {
  if (text.empty()) return std::nullopt;
  return control::Expression(text, lookup);
}

/// A phase's Reach.
class BoundReach {
 public:
  BoundReach(const Reach& reach, const std::shared_ptr<const sim::Model>& model, Places& places);

  /// The targets of the joints that may move; those of `target` are what it keeps near to.
  void solve(const sim::Snapshot& s, const VectorXd& wanted, control::JointTarget& target);

 private:
  struct Goal {
    const ReachGoal* goal;
    std::optional<control::Expression> x, y, z, distance, roll, pitch, yaw;
    control::Expression weight;
  };

  const Reach* reach_;
  std::shared_ptr<const sim::Model> model_;
  std::vector<Goal> goals_;
  control::PoseSolver solver_;
};

/// A phase's Flight: which target the joints have now.
class BoundFlight {
 public:
  BoundFlight(const Flight& flight, const std::shared_ptr<const sim::Model>& model, Places& places);

  /// The flight begins, of which the landing's pose is by joint [rad].
  void begin(const VectorXd& landing);
  /// Plans where it is time to: how long to hold a pose every kReplan, which pose every kChoose,
  /// and neither once less than kSettle is left, but for what pushes the body out of its way.
  /// Sets what places foresee.
  /// @return the joints' target if it is another one from now on
  const VectorXd* update(const sim::Snapshot& s);

  static constexpr double kReplan = 0.02;  ///< [s] [Ha2015, §3.4.1]
  static constexpr double kChoose = 0.2;   ///< [s] [ours; published: much more seldom]
  static constexpr double kSettle = 0.3;   ///< [s] [Ha2015, §3.4.1]

 private:
  bool disturbed(const sim::Snapshot& s, double since) const;
  void plan(const sim::Snapshot& s, std::optional<int> only);
  flight::TouchDown counted() const;

  Places* places_;
  sim::BodyId root_;
  double gravity_;  // [m/s²]
  flight::FlightPlanner planner_;
  control::Expression somersault_, ground_;
  const double* counting_;  // the root's somersault, counted on
  VectorXd landing_;
  flight::FlightPlan plan_;
  double planned_ = 0;  // when [s]
  double chosen_ = 0;
  double seen_ = 0;
  Vector3d com_, velocity_, momentum_;  // when it was planned
  sim::Matrix3d turned_;                // the root's, when it was seen
  int target_ = 0;                      // a pose, -1 the landing's; kNone at first
  static constexpr int kNone = -2;
};

}  // namespace traceur::skill
