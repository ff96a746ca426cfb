// Chapter 3's experiments: whether a person lands, and what its joints bear.
#pragma once

#include <memory>
#include <vector>

#include "traceur/landing/condition.h"
#include "traceur/reproduce/table.h"

namespace traceur::reproduce {

/// Eight falls, hands first and feet first [Ha2015, Tab. 2].
Table table2();
/// What joints bear in a landing and limp [Ha2015, Fig. 17].
Table figure17();
/// The landing condition from samples of touch-downs [Ha2015, Fig. 10, 11].
Table landingCondition();
/// What became of touch-downs by lot, and the landing condition learned from them.
struct TouchDowns {
  std::vector<landing::Verdict> all;  ///< that touched down
  landing::LandingCondition condition;
};
/// @param hands  that meet the ground first, instead of the feet
/// @throws InputError as landing::learnCondition()
TouchDowns touchDowns(bool hands, std::uint64_t seed);

/// The poses that a person chooses from in the air, and how often each is the first choice
/// [Ha2015, Fig. 12].
struct AirPoses {
  std::shared_ptr<const sim::Model> model;
  std::vector<sim::State> poses;
  std::vector<int> chosen;  ///< as many; of the falls
  int none = 0;             ///< falls in which the landing's own pose was the choice
};
AirPoses airPoses(std::uint64_t seed);

/// How near the planner comes to what is wanted at touch-down, by how many poses it may take: not
/// in the paper.
Table landingFlight();
/// Whether what was learned helps in the air: not in the paper.
Table landingLean();
/// Success over drop height, forward speed and spin: not in the paper.
Table landingAtlas();

}  // namespace traceur::reproduce
