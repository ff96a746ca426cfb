#include "traceur/coach/opposites.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace traceur::coach {
namespace {

bool sameThing(const Thing& a, const Thing& b) {
  return a.kind == b.kind && a.name == b.name && a.bodies == b.bodies && a.vector == b.vector;
}

/// Along an axis: which, and whether the first thing is the further one.
struct Order {
  int axis = -1;
  bool further = false;
};
Order orderOf(Relation r) {
  switch (r) {
    case Relation::kInFrontOf:
      return {0, true};
    case Relation::kBehind:
      return {0, false};
    case Relation::kLeftOf:
      return {1, true};
    case Relation::kRightOf:
      return {1, false};
    case Relation::kAbove:
      return {2, true};
    case Relation::kBelow:
      return {2, false};
    default:
      return {};
  }
}

bool ordersOppose(const Instruction& a, const Instruction& b) {
  const Order first = orderOf(a.relation);
  const Order second = orderOf(b.relation);
  if (first.axis < 0 || first.axis != second.axis) return false;
  if (sameThing(*a.subject, *b.subject) && sameThing(*a.other, *b.other)) {
    return first.further != second.further;
  }
  return sameThing(*a.subject, *b.other) && sameThing(*a.other, *b.subject) &&
         first.further == second.further;
}

/// What a spin or an attitude may be about the axis's positive direction.
std::pair<double, double> allowed(const Instruction& i) {
  static constexpr double kAny = std::numeric_limits<double>::infinity();
  const double sign = i.subject->vector.sum() < 0 ? -1 : 1;  // ± an axis
  const bool below = (i.relation == Relation::kLess) == (sign > 0);
  const double limit = sign * i.other->number;
  return below ? std::pair{-kAny, limit} : std::pair{limit, kAny};
}

bool limitsOppose(const Instruction& a, const Instruction& b) {
  const auto measured = [](const Instruction& i) {
    return i.subject->kind == Thing::Kind::kSpin || i.subject->kind == Thing::Kind::kAttitude;
  };
  if (!measured(a) || !measured(b) || a.subject->kind != b.subject->kind) return false;
  if (a.subject->name != b.subject->name || a.subject->bodies != b.subject->bodies) return false;
  if (a.subject->vector.cwiseAbs() != b.subject->vector.cwiseAbs()) return false;
  const auto [low_a, high_a] = allowed(a);
  const auto [low_b, high_b] = allowed(b);
  return std::max(low_a, low_b) >= std::min(high_a, high_b);
}

/// Moved or turned along one axis by two amounts: each is a goal of its own.
bool shiftsOppose(const Instruction& a, const Instruction& b) {
  const double along = a.direction.dot(b.direction);
  return sameThing(*a.subject, *b.subject) && std::abs(along) > 0.9 && a.amount != along * b.amount;
}

bool standsAndMoves(const Instruction& still, const Instruction& moving) {
  return still.form == Form::kBalance && moving.form == Form::kSpeed && !moving.velocity.isZero();
}

}  // namespace

bool opposed(const Instruction& a, const Instruction& b) {
  if (standsAndMoves(a, b) || standsAndMoves(b, a)) return true;
  if (a.form != b.form) return false;
  switch (a.form) {
    case Form::kRelation:
      return ordersOppose(a, b) || limitsOppose(a, b);
    case Form::kTranslate:
    case Form::kRotate:
      return shiftsOppose(a, b);
    case Form::kTurn:
      return a.amount != b.amount;
    case Form::kPlace:
      // The COM's place is replaced.
      return a.subject->kind != Thing::Kind::kCom && sameThing(*a.subject, *b.subject) &&
             !sameThing(*a.other, *b.other);
    default:
      return false;
  }
}

}  // namespace traceur::coach
