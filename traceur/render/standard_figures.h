// The figures every run has: joint angles, centre of mass, contact forces, cost.
#pragma once

#include <vector>

#include "traceur/render/figure.h"
#include "traceur/sim/recording.h"

namespace traceur::render {

/// Joint angles over time, a left and a right joint in one panel. Pairs are found by name
/// ("l_knee", "left_knee", "knee_l", "L_knee", …); what has no partner gets a panel with its like.
/// Phase changes are marked.
/// @throws InputError for an empty recording, or one whose model cannot be made
Figure jointFigure(const sim::Recording& recording);

/// Position and velocity of the centre of mass over time: forward, left, up.
/// @throws InputError as jointFigure
Figure comFigure(const sim::Recording& recording);

/// The vertical force on each robot body that touches something else [N], and the robot's weight.
/// @throws InputError as jointFigure
Figure contactFigure(const sim::Recording& recording);

/// A search as it went; the vectors of a pair are equally long.
struct CostHistory {
  std::vector<double> evaluations;  ///< trials made so far
  std::vector<double> best;         ///< lowest cost among those that count
  /// Every single trial, optional: its number, counted from 1, and its cost.
  std::vector<double> trials;
  std::vector<double> costs;
  std::vector<double> failed;  ///< numbers of the trials that gave no cost, optional
};

/// One trial of a search.
struct CostTrial {
  double cost = 0;
  bool violates = false;  ///< some constraint
  bool failed = false;    ///< it gave no cost
};

/// The trials of a search, in order. The best so far, which never rises, is the lowest cost of
/// those that violate nothing, from the first of them on; of all, where each violates something.
CostHistory costHistory(const std::vector<CostTrial>& trials);

/// Cost against trials: the best so far as steps, single trials as dots, failures as crosses along
/// the top. Logarithmic when all costs are positive and span more than a factor of 20.
/// @throws InputError when a pair is not equally long
Figure costFigure(const CostHistory& history);

}  // namespace traceur::render
