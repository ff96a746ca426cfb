// Chapter 4's experiments: what a fall costs with a plan and without.
#pragma once

#include "traceur/fall/fall_trial.h"
#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Largest impulses of BioloidGP, pushed forward from one foot [Ha2015, Tab. 3].
Table table3();
/// Largest impulses of Atlas [Ha2015, Tab. 4].
Table table4();
/// One plan, made for 5 N, followed after other pushes [Ha2015, §4.4.1.1].
Table fallRobustness();
/// The COM's path of the model and of the robot that follows one plan [Ha2015, Fig. 22].
Table figure22();
/// Random pushes in the published ranges, by robot and direction: not in the paper.
Table randomFalls();

/// Of a robot whose COM went along `com` while the model's went along `path`, at equal times [m]:
/// the mean distance between the two, with the robot's way as points; or, of the model, its path's
/// length and points. Missed where the robot's way ends sooner, or there is no path.
Outcome alongPath(const std::vector<fall::Vector2d>& com, const std::vector<fall::Vector2d>& path,
                  bool of_robot);

/// The largest impulse of a fall [N·s]; missed, with 0, where nothing fell or the simulation
/// diverged.
Outcome outcomeOf(const fall::FallTrial& trial);

/// Of a fall after a push [N]: the largest impulse as a share of what it is with the pose held;
/// missed if it is no smaller. Missed with a share of 1 where the held one did not fall or either
/// diverged: then nothing is told.
Outcome shareOfHeld(const fall::FallTrial& held, const fall::FallTrial& other, double push);

}  // namespace traceur::reproduce
