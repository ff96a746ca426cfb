// Which stoppers a robot can form, from random poses of its real kinematics.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "traceur/fall/fall_robot.h"
#include "traceur/fall/sagittal_body.h"

namespace traceur::fall {

/// K[r₁][r₂][θ₂] of one edge of a contact graph: whether some pose has its COM r₁ from the part
/// that is on the ground and the next part r₂ from the COM, θ₂ from the prolonged rod [Ha2015,
/// §4.3.2].
class ReachTable {
 public:
  static constexpr int kAngles = 72;  ///< of 5 degrees [ours]

  /// @param cell     of r₁ and r₂ [m]
  /// @param longest  what r₁ and r₂ do not exceed [m]
  ReachTable(double cell, double longest);

  /// Marks the cell and its neighbours: the tolerance, one cell each way [ours; the paper prints
  /// none].
  void mark(double r1, double r2, double theta2);
  bool reachable(double r1, double r2, double theta2) const;
  /// The part of all cells that is marked.
  double filled() const;
  double cell() const { return cell_; }
  int cells() const { return cells_; }                                 ///< of r₁ and of r₂
  const std::vector<std::uint8_t>& marked() const { return marked_; }  ///< [r₁][r₂][θ₂], 0 or 1

 private:
  size_t index(int i1, int i2, int angle) const {
    return (static_cast<size_t>(i1) * cells_ + i2) * kAngles + angle;
  }
  static int angleOf(double theta2);

  double cell_;
  int cells_;
  std::vector<std::uint8_t> marked_;
};

/// By node and edge, as ContactGraph::edges.
using ReachTables = std::vector<std::vector<ReachTable>>;

struct ReachOptions {
  int poses = 10'000;      ///< [Ha2015, §4.3.2]
  std::uint64_t seed = 1;  ///< of the random poses
  double cell = 0;         ///< [m]
};

/// Fills the tables of a setup's graph from random angles, uniform within their limits, of the
/// joints that a plan moves; the others stay as in the stance. A pair of joints moves alike
/// unless a node is on one side of it only. Poses are drawn one after another: equal seeds, equal
/// tables.
/// @param lengths  if given: least and greatest r₁ of each node [m]
ReachTables sampleReach(const SagittalBody& body, const FallRobot& falls,
                        const ReachOptions& options,
                        std::vector<std::pair<double, double>>* lengths = nullptr);

}  // namespace traceur::fall
