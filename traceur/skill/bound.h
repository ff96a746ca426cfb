// Expressions of a skill file bound to a trial's numbers.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "traceur/control/pose_solver.h"
#include "traceur/control/stable_pd.h"
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

}  // namespace traceur::skill
