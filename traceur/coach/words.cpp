#include "traceur/coach/words.h"

#include <array>

namespace traceur::coach {

std::span<const VerbRow> verbs() {
  // Of several that fit, the longest wins.
  static constexpr std::array kRows = {
      VerbRow{"flex", Act::kFlex},
      VerbRow{"bend", Act::kFlex},
      VerbRow{"fold", Act::kFlex},
      VerbRow{"curl", Act::kFlex},
      VerbRow{"extend", Act::kExtend},
      VerbRow{"straighten", Act::kExtend},
      VerbRow{"stretch", Act::kExtend},
      VerbRow{"unbend", Act::kExtend},
      VerbRow{"move", Act::kMove},
      VerbRow{"shift", Act::kMove},
      VerbRow{"translate", Act::kMove},
      VerbRow{"bring", Act::kMove},
      VerbRow{"reach", Act::kMove},
      VerbRow{"swing", Act::kMove},
      VerbRow{"slide", Act::kMove},
      VerbRow{"lean", Act::kMove},
      VerbRow{"lower", Act::kLower},
      VerbRow{"drop", Act::kLower},
      VerbRow{"sink", Act::kLower},
      VerbRow{"squat", Act::kLower},
      VerbRow{"crouch", Act::kLower},
      VerbRow{"go down", Act::kLower},
      VerbRow{"get down", Act::kLower},
      VerbRow{"raise", Act::kRaise},
      VerbRow{"lift", Act::kRaise},
      VerbRow{"rise", Act::kRaise},
      VerbRow{"stand up", Act::kRaise},
      VerbRow{"rotate", Act::kRotate},
      VerbRow{"tilt", Act::kRotate},
      VerbRow{"twist", Act::kRotate},
      VerbRow{"speed", Act::kSpeed},
      VerbRow{"take off", Act::kSpeed},
      VerbRow{"leave the ground", Act::kSpeed},
      VerbRow{"speedup", Act::kFaster},
      VerbRow{"speed up", Act::kFaster},
      VerbRow{"accelerate", Act::kFaster},
      VerbRow{"faster", Act::kFaster},
      VerbRow{"quicker", Act::kFaster},
      VerbRow{"slowdown", Act::kSlower},
      VerbRow{"slow down", Act::kSlower},
      VerbRow{"slower", Act::kSlower},
      VerbRow{"decelerate", Act::kSlower},
      VerbRow{"turnfaster", Act::kTurnFaster},
      VerbRow{"turn faster", Act::kTurnFaster},
      VerbRow{"spin faster", Act::kTurnFaster},
      VerbRow{"rotate faster", Act::kTurnFaster},
      VerbRow{"turnslower", Act::kTurnSlower},
      VerbRow{"turn slower", Act::kTurnSlower},
      VerbRow{"spin slower", Act::kTurnSlower},
      VerbRow{"rotate slower", Act::kTurnSlower},
      VerbRow{"balance", Act::kBalance},
      VerbRow{"steady", Act::kBalance},
      VerbRow{"stand still", Act::kBalance},
      VerbRow{"hold still", Act::kBalance},
      VerbRow{"stay upright", Act::kBalance},
      VerbRow{"do not fall", Act::kBalance},
      VerbRow{"relax", Act::kRelax},
      VerbRow{"loosen", Act::kRelax},
      VerbRow{"soften", Act::kRelax},
      VerbRow{"stiffen", Act::kStiffen},
      VerbRow{"tighten", Act::kStiffen},
      VerbRow{"harden", Act::kStiffen},
      VerbRow{"tense", Act::kStiffen},
      VerbRow{"push", Act::kPush},
      VerbRow{"press", Act::kPush},
      VerbRow{"shove", Act::kPush},
      VerbRow{"pull", Act::kPull},
      VerbRow{"place", Act::kPlace},
      VerbRow{"put", Act::kPlace},
      VerbRow{"land", Act::kPlace},
      VerbRow{"jump", Act::kJump},
  };
  return kRows;
}

std::span<const DirectionRow> directions() {
  static constexpr std::array kRows = {
      DirectionRow{"upward", 0, 0, 1, "upward"},
      DirectionRow{"upwards", 0, 0, 1, "upward"},
      DirectionRow{"up", 0, 0, 1, "upward"},
      DirectionRow{"higher", 0, 0, 1, "upward"},
      DirectionRow{"downward", 0, 0, -1, "downward"},
      DirectionRow{"downwards", 0, 0, -1, "downward"},
      DirectionRow{"down", 0, 0, -1, "downward"},
      DirectionRow{"lower", 0, 0, -1, "downward"},
      DirectionRow{"deeper", 0, 0, -1, "downward"},
      DirectionRow{"forward", 1, 0, 0, "forward"},
      DirectionRow{"forwards", 1, 0, 0, "forward"},
      DirectionRow{"ahead", 1, 0, 0, "forward"},
      DirectionRow{"to the front", 1, 0, 0, "forward"},
      DirectionRow{"farther", 1, 0, 0, "forward"},
      DirectionRow{"backward", -1, 0, 0, "backward"},
      DirectionRow{"backwards", -1, 0, 0, "backward"},
      DirectionRow{"back", -1, 0, 0, "backward"},
      DirectionRow{"left", 0, 1, 0, "left"},
      DirectionRow{"to the left", 0, 1, 0, "left"},
      DirectionRow{"leftward", 0, 1, 0, "left"},
      DirectionRow{"leftwards", 0, 1, 0, "left"},
      DirectionRow{"right", 0, -1, 0, "right"},
      DirectionRow{"to the right", 0, -1, 0, "right"},
      DirectionRow{"rightward", 0, -1, 0, "right"},
      DirectionRow{"rightwards", 0, -1, 0, "right"},
  };
  return kRows;
}

std::span<const RelationRow> relations() {
  static constexpr std::array kRows = {
      RelationRow{"in front of", Relation::kInFrontOf},
      RelationRow{"ahead of", Relation::kInFrontOf},
      RelationRow{"before", Relation::kInFrontOf},
      RelationRow{"behind", Relation::kBehind},
      RelationRow{"in back of", Relation::kBehind},
      RelationRow{"above", Relation::kAbove},
      RelationRow{"over", Relation::kAbove},
      RelationRow{"higher than", Relation::kAbove},
      RelationRow{"below", Relation::kBelow},
      RelationRow{"under", Relation::kBelow},
      RelationRow{"beneath", Relation::kBelow},
      RelationRow{"lower than", Relation::kBelow},
      RelationRow{"left of", Relation::kLeftOf},
      RelationRow{"to the left of", Relation::kLeftOf},
      RelationRow{"right of", Relation::kRightOf},
      RelationRow{"to the right of", Relation::kRightOf},
      RelationRow{"greater than", Relation::kGreater},
      RelationRow{"more than", Relation::kGreater},
      RelationRow{"less than", Relation::kLess},
  };
  return kRows;
}

std::string_view nameOf(Relation r) {
  switch (r) {
    case Relation::kInFrontOf:
      return "IN FRONT OF";
    case Relation::kBehind:
      return "BEHIND";
    case Relation::kAbove:
      return "ABOVE";
    case Relation::kBelow:
      return "BELOW";
    case Relation::kLeftOf:
      return "LEFT OF";
    case Relation::kRightOf:
      return "RIGHT OF";
    case Relation::kGreater:
      return "GREATER THAN";
    case Relation::kLess:
      return "LESS THAN";
    case Relation::kNone:
      break;
  }
  return "";
}

std::span<const DegreeRow> degrees() {
  // Of the usual amount of an instruction: kUsual in instruction.cpp.
  static constexpr std::array kRows = {
      DegreeRow{"a tiny bit", 0.25}, DegreeRow{"very slightly", 0.25},
      DegreeRow{"a touch", 0.25},    DegreeRow{"a little bit", 0.5},
      DegreeRow{"a bit", 0.5},       DegreeRow{"a little", 0.5},
      DegreeRow{"slightly", 0.5},    DegreeRow{"somewhat", 0.75},
      DegreeRow{"a lot", 2},         DegreeRow{"much", 2},
      DegreeRow{"far", 2},           DegreeRow{"a great deal", 2},
      DegreeRow{"strongly", 2},      DegreeRow{"way", 2},
  };
  return kRows;
}

std::span<const PartRow> parts() {
  static constexpr std::array kRows = {
      PartRow{"torso", "trunk"},
      PartRow{"body", "com"},
      PartRow{"upper body", "trunk"},
      PartRow{"pelvis", "root"},
      PartRow{"center of mass", "com"},
      PartRow{"centre of mass", "com"},
      PartRow{"c", "com"},
      PartRow{"c of m", "com"},
      PartRow{"center of pressure", "cop"},
      PartRow{"centre of pressure", "cop"},
      PartRow{"s", "cop"},
      PartRow{"back", "spine"},
      PartRow{"weight", "com"},
      PartRow{"yourself", "com"},
      PartRow{"chest", "trunk"},
      PartRow{"thighs", "hips"},
      PartRow{"thigh", "hips"},
      PartRow{"waist", "spine"},
  };
  return kRows;
}

std::span<const std::string_view> fillers() {
  static constexpr std::array<std::string_view, 49> kWords = {
      "the",     "your", "a",     "an",    "by",      "to",   "of",     "please",  "more",
      "further", "and",  "with",  "be",    "is",      "it",   "should", "keep",    "must",
      "that",    "so",   "now",   "about", "around",  "at",   "in",     "on",      "degrees",
      "stay",    "his",  "her",   "their", "its",     "near", "close",  "against", "than",
      "get",     "make", "let",   "try",   "through", "then", "also",   "just",    "come",
      "go",      "you",  "while", "both"};
  return kWords;
}

}  // namespace traceur::coach
