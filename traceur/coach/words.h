// The words a coach uses: one row each. Adding a synonym is adding a row.
#pragma once

#include <span>
#include <string_view>

#include "traceur/coach/instruction.h"

namespace traceur::coach {

/// What a verb asks for.
enum class Act {
  kFlex,
  kExtend,
  kMove,  ///< where to is said beside it
  kLean,  ///< move, or rotate a part
  kLower,
  kRaise,
  kRotate,  ///< about an axis, or over towards a direction
  kTwist,   ///< about the vertical
  kSpeed,
  kAsFast,   ///< "half as fast"
  kAsStiff,  ///< "twice as stiff"
  kFaster,   ///< momentum, or spin where it is about spinning
  kSlower,
  kTurnFaster,
  kTurnSlower,
  kBalance,
  kRelax,
  kStiffen,
  kPush,
  kPull,
  kPlace,
};

struct VerbRow {
  std::string_view words;
  Act act;
};
std::span<const VerbRow> verbs();

struct DirectionRow {
  std::string_view words;
  double x, y, z;  ///< unit, world axes
  std::string_view name;
};
std::span<const DirectionRow> directions();

struct RelationRow {
  std::string_view words;
  Relation relation;
};
std::span<const RelationRow> relations();
std::string_view nameOf(Relation r);

/// "a bit", "much": how much of the usual amount.
struct DegreeRow {
  std::string_view words;
  double factor;
};
std::span<const DegreeRow> degrees();

/// A person's name for a part, and the robot's.
struct PartRow {
  std::string_view words;
  std::string_view name;
};
std::span<const PartRow> parts();

/// "twice as": a factor, of a quantity that a verb names.
std::span<const DegreeRow> shares();

/// Number words: "thirty".
std::span<const DegreeRow> numbers();

/// Words that change nothing.
std::span<const std::string_view> fillers();

}  // namespace traceur::coach
