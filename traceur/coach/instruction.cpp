#include "traceur/coach/instruction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

#include "traceur/coach/words.h"
#include "traceur/core/text.h"

namespace traceur::coach {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// What an instruction without a number asks for [ours: a change one sees, and practice reaches].
constexpr double kUsualDistance = 0.1;        // m
constexpr double kUsualAngle = 20 * kDegree;  // rad
constexpr double kUsualShare = 0.2;           // of momentum or stiffness

struct Unit {
  std::string_view name;
  double factor;
};
constexpr Unit kUnits[] = {{"m", 1},
                           {"cm", 0.01},
                           {"mm", 0.001},
                           {"metres", 1},
                           {"meters", 1},
                           {"metre", 1},
                           {"meter", 1},
                           {"deg", kDegree},
                           {"degrees", kDegree},
                           {"degree", kDegree},
                           {"°", kDegree},
                           {"rad", 1},
                           {"m/s", 1},
                           {"s", 1},
                           {"n", 1},
                           {"x", 1}};
bool isLength(std::string_view u) {
  return u == "m" || u == "cm" || u == "mm" || u.starts_with("met");
}
bool isAngle(std::string_view u) {
  return u.starts_with("deg") || u == "°" || u == "rad";
}

bool isLetter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '/' ||
         static_cast<unsigned char>(c) >= 0x80;
}
char lowered(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

/// Reads tokens from left to right.
class Scanner {
 public:
  explicit Scanner(const std::string& text) : text_(text) {}

  std::vector<Token> all() {
    std::vector<Token> tokens;
    while (skip(), at_ < text_.size()) tokens.push_back(next());
    return tokens;
  }

 private:
  int column() const { return static_cast<int>(at_) + 1; }
  void skip() {
    while (at_ < text_.size() &&
           (std::isspace(static_cast<unsigned char>(text_[at_])) || text_[at_] == ',' ||
            (text_[at_] == '.' && !startsNumber()) || text_[at_] == '!' || text_[at_] == '\'')) {
      ++at_;
    }
  }
  bool startsNumber() const {
    size_t i = at_;
    if (i < text_.size() && (text_[i] == '-' || text_[i] == '+')) ++i;
    if (i < text_.size() && text_[i] == '.') ++i;
    return i < text_.size() && std::isdigit(static_cast<unsigned char>(text_[i]));
  }
  double number() {
    const size_t from = at_;
    if (text_[at_] == '-' || text_[at_] == '+') ++at_;
    while (at_ < text_.size() && (std::isdigit(static_cast<unsigned char>(text_[at_])) ||
                                  (text_[at_] == '.' && at_ + 1 < text_.size() &&
                                   std::isdigit(static_cast<unsigned char>(text_[at_ + 1]))))) {
      ++at_;
    }
    std::string digits = text_.substr(from, at_ - from);
    if (digits.front() == '+') digits.erase(0, 1);
    const auto value = parseNumber(digits);
    if (!value || !std::isfinite(*value) || std::abs(*value) > 1e6) {
      throw Misunderstanding{static_cast<int>(from) + 1,
                             fmt::format("\"{}\" is no number to be used here", digits)};
    }
    return *value;
  }
  std::string word() {
    const size_t from = at_;
    while (at_ < text_.size() &&
           (isLetter(text_[at_]) || std::isdigit(static_cast<unsigned char>(text_[at_])))) {
      ++at_;
    }
    std::string w = text_.substr(from, at_ - from);
    std::ranges::transform(w, w.begin(), lowered);
    return w;
  }
  double unitFactor(const std::string& unit, int column) const {
    if (unit.empty()) return 1;
    for (const Unit& u : kUnits) {
      if (u.name == unit) return u.factor;
    }
    throw Misunderstanding{column, fmt::format("\"{}\" is no unit known here: expected m, cm, deg, "
                                               "rad, m/s, s or %",
                                               unit)};
  }
  /// The unit right behind a number, or after one space where it is one.
  std::string unit() {
    const size_t mark = at_;
    if (at_ < text_.size() && text_[at_] == ' ') ++at_;
    if (at_ < text_.size() && isLetter(text_[at_]) && text_[at_] != '-') {
      const bool glued = at_ == mark;
      const std::string w = word();
      const bool known = std::ranges::any_of(kUnits, [&](const Unit& u) { return u.name == w; });
      if (known || glued) return w;
    }
    at_ = mark;
    return "";
  }
  Token next() {
    Token t;
    t.column = column();
    const char c = text_[at_];
    if (c == '[') return vector();
    if (startsNumber()) {
      t.number = number();
      if (at_ < text_.size() && (text_[at_] == '%' || text_.compare(at_, 2, " %") == 0)) {
        at_ += text_[at_] == '%' ? 1 : 2;
        t.kind = Token::Kind::kPercent;
        return t;
      }
      t.kind = Token::Kind::kNumber;
      const int unit_column = column();
      t.word = unit();
      if (t.word == "percent") {
        t.kind = Token::Kind::kPercent;
        return t;
      }
      t.number *= unitFactor(t.word, unit_column);
      return t;
    }
    if (isLetter(c)) {
      t.word = word();
      return t;
    }
    throw Misunderstanding{column(), fmt::format("\"{}\" has no meaning here", c)};
  }
  Token vector() {
    Token t;
    t.column = column();
    t.kind = Token::Kind::kVector;
    ++at_;
    for (int i = 0; i < 3; ++i) {
      skip();
      if (!startsNumber()) {
        throw Misunderstanding{column(), "a vector has three numbers: [1.2, 2.4, 0.0]"};
      }
      t.vector[i] = number();
    }
    skip();
    if (at_ >= text_.size() || text_[at_] != ']') {
      throw Misunderstanding{column(), "a vector has three numbers, then \"]\": [1.2, 2.4, 0.0]"};
    }
    ++at_;
    const int unit_column = column();
    t.word = unit();
    t.vector *= unitFactor(t.word, unit_column);
    return t;
  }

  const std::string& text_;
  size_t at_ = 0;
};

std::string joined(std::span<const Token> tokens) {
  std::string text;
  for (const Token& t : tokens) text += (text.empty() ? "" : " ") + t.word;
  return text;
}

/// What was found in an instruction.
struct Slots {
  std::optional<Act> act;
  int act_column = 1;
  std::vector<Thing> things;
  std::optional<DirectionRow> direction;
  std::optional<RelationRow> relation;
  std::optional<char> axis;
  std::optional<Token> number, percent, vector;
  std::optional<double> degree;
  std::string surface;
  bool by = false;
  bool spins = false;     // "spin", "turn", …
  bool attitude = false;  // "orientation"
  bool extent = false;    // "more", "further": of the usual amount
};

template <class Rows>
auto find(const Rows& rows, const std::string& words)
    -> std::optional<std::decay_t<decltype(rows[0])>> {
  for (const auto& r : rows) {
    if (r.words == words) return r;
  }
  return {};
}

std::string number(double v) {
  return fmt::format("{:.4g}", v);
}

}  // namespace

std::vector<Token> tokensOf(const std::string& text) {
  return Scanner(text).all();
}

Vector3d toWorld(const Vector3d& w, Axes axes) {
  return axes == Axes::kPublished ? Vector3d(w.x(), -w.z(), w.y()) : w;
}

Vector3d axisNamed(char letter, Axes axes) {
  return toWorld(letter == 'x'   ? Vector3d(Vector3d::UnitX())
                 : letter == 'y' ? Vector3d(Vector3d::UnitY())
                                 : Vector3d(Vector3d::UnitZ()),
                 axes);
}

std::vector<std::string> Interpreter::jointsOf(std::string_view words) const {
  const sim::Robot& robot = *model_->robot();
  std::string word(words);
  std::string side;
  for (const std::string_view s : {"left ", "right "}) {
    if (word.starts_with(s)) {
      side = s.substr(0, s.size() - 1);
      word = word.substr(s.size());
    }
  }
  const auto known = [&](const std::string& name) -> std::vector<std::string> {
    const auto pair = robot.mirrored.find(name);
    if (pair != robot.mirrored.end()) {
      if (side.empty()) return {name};
      return {side == "left" ? pair->second.left : pair->second.right};
    }
    for (const sim::Joint& j : model_->joints()) {
      if (j.name == name && j.motor >= 0 && side.empty()) return {name};
    }
    return {};
  };
  std::vector<std::string> stems{word};
  if (word.ends_with("s")) stems.push_back(word.substr(0, word.size() - 1));
  if (const auto part = find(parts(), word)) stems.emplace_back(part->name);
  for (const std::string& stem : stems) {
    for (const char* tail : {"", "_flex"}) {
      auto found = known(stem + tail);
      if (!found.empty()) return found;
    }
  }
  // All joints of limbs: "arms" are left_arm and right_arm.
  std::set<std::string> bodies;
  for (const auto& [limb, chain] : robot.limbs) {
    const bool fits = std::ranges::any_of(stems, [&](const std::string& s) {
      return limb == (side.empty() ? s : side + "_" + s) ||
             (side.empty() && (limb == "left_" + s || limb == "right_" + s));
    });
    if (fits) bodies.insert(chain.begin(), chain.end());
  }
  if (word == "all" || word == "everything" || word == "whole body") {
    for (int b = 0; b < model_->bodies(); ++b) bodies.insert(model_->bodyName({b}));
  }
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (const sim::Joint& j : model_->joints()) {
    if (j.motor < 0 || !bodies.contains(model_->bodyName(model_->bodyOf(j)))) continue;
    std::string name = j.name;
    if (side.empty()) {
      for (const auto& [pair, m] : robot.mirrored) {
        if (m.left == j.name || m.right == j.name) name = pair;
      }
    }
    if (seen.insert(name).second) names.push_back(name);
  }
  return names;
}

std::optional<Thing> Interpreter::thing(std::string_view words) const {
  const sim::Robot& robot = *model_->robot();
  Thing t;
  t.said = words;
  std::string word(words);
  if (const auto part = find(parts(), word)) word = part->name;
  if (word == "com") return t;
  if (word == "cop") {
    t.kind = Thing::Kind::kCop;
    return t;
  }
  t.kind = Thing::Kind::kBody;
  if (word == "root") {
    t.name = model_->bodyName(model_->root());
    return t;
  }
  std::string side;
  std::string bare = word;
  for (const std::string_view s : {"left ", "right "}) {
    if (word.starts_with(s)) {
      side = s.substr(0, 1);
      bare = word.substr(s.size());
    }
  }
  std::vector<std::string> names{word};
  if (!side.empty()) {
    std::string single = bare.ends_with("s") ? bare.substr(0, bare.size() - 1) : bare;
    names = {side + "_" + single, (side == "l" ? "left_" : "right_") + single};
  } else {
    names.push_back(word + "s");
    if (word == "foot") names.emplace_back("feet");
  }
  for (const std::string& name : names) {
    const bool group = robot.bodies.contains(name);
    bool body = false;
    for (int b = 1; b < model_->bodies() && !body; ++b) {
      body = model_->isRobot({b}) && model_->bodyName({b}) == name;
    }
    if (group || body) {
      t.name = name;
      return t;
    }
  }
  t.kind = Thing::Kind::kJoints;
  t.joints = jointsOf(words);
  if (!t.joints.empty()) return t;
  return {};
}

Instruction Interpreter::understand(const std::string& text) const {
  const std::vector<Token> tokens = tokensOf(text);
  if (tokens.empty()) throw Misunderstanding{1, "nothing is said here"};
  Slots s;
  std::vector<std::string> unknown;
  std::optional<Misunderstanding> first_unknown;
  for (size_t i = 0; i < tokens.size();) {
    const Token& t = tokens[i];
    const auto once = [&](auto& slot, const auto& value, const char* what) {
      if (slot) {
        throw Misunderstanding{t.column, fmt::format("two {}: say one thing at a time", what)};
      }
      slot = value;
    };
    if (t.kind == Token::Kind::kNumber) {
      once(s.number, t, "numbers");
      ++i;
      continue;
    }
    if (t.kind == Token::Kind::kPercent) {
      once(s.percent, t, "percentages");
      ++i;
      continue;
    }
    if (t.kind == Token::Kind::kVector) {
      once(s.vector, t, "vectors");
      ++i;
      continue;
    }
    size_t used = 0;
    for (size_t n = std::min<size_t>(4, tokens.size() - i); n > 0 && used == 0; --n) {
      const auto slice = std::span(tokens).subspan(i, n);
      if (!std::ranges::all_of(slice,
                               [](const Token& x) { return x.kind == Token::Kind::kWord; })) {
        continue;
      }
      const std::string words = joined(slice);
      const auto verb = find(verbs(), words);
      const auto direction = find(directions(), words);
      const auto part = [&]() -> std::optional<Thing> {
        // "c", "s" and "back" are parts only where nothing else is meant.
        return thing(words);
      };
      if (words == "floor" || words == "ground" ||
          std::ranges::find(surfaces_, words) != surfaces_.end()) {
        s.surface = words == "ground" ? "floor" : words;
        used = n;
      } else if (const auto r = find(relations(), words)) {
        once(s.relation, *r, "relations");
        used = n;
      } else if (const auto d = find(degrees(), words)) {
        s.degree = s.degree.value_or(1) * d->factor;
        used = n;
      } else if (verb && !s.act && !(direction && !s.things.empty())) {
        s.act = verb->act;
        s.act_column = t.column;
        used = n;
      } else if (words == "by") {
        s.by = true;
        used = n;
      } else if (n == 1 &&
                 (words == "spin" || words == "turn" || words == "turning" || words == "spinning" ||
                  words == "rotation" || words == "flip" || words == "somersault")) {
        s.spins = true;
        used = n;
      } else if (n == 1 && (words == "orientation" || words == "attitude" || words == "pitch")) {
        s.attitude = true;
        used = n;
      } else if (n == 1 && (words == "x" || words == "y" || words == "z" || words == "x-axis" ||
                            words == "y-axis" || words == "z-axis")) {
        once(s.axis, words[0], "axes");
        used = n;
      } else if (direction && (s.act || s.spins || s.relation == std::nullopt) &&
                 !(words == "back" && !s.act && !s.spins)) {
        if (s.direction && s.direction->name != direction->name) {
          throw Misunderstanding{t.column, "two directions: say one thing at a time"};
        }
        s.direction = *direction;
        used = n;
      } else if (const auto p = part()) {
        s.things.push_back(*p);
        used = n;
      } else if (n == 1 && (words == "faster" || words == "quicker" || words == "quickly") &&
                 s.act) {
        // "move faster", "spin quicker"
        s.act = s.act == Act::kRotate ? Act::kTurnFaster : Act::kFaster;
        used = n;
      } else if (n == 1 && (words == "slower" || words == "slowly") && s.act) {
        s.act = s.act == Act::kRotate ? Act::kTurnSlower : Act::kSlower;
        used = n;
      } else if (n == 1 && (words == "more" || words == "further")) {
        s.extent = true;
        used = n;
      } else if (std::ranges::find(fillers(), words) != fillers().end()) {
        used = n;
      }
    }
    if (used == 0) {
      if (!first_unknown) {
        std::vector<std::string> known;
        for (const auto& r : verbs()) known.emplace_back(r.words);
        for (const auto& r : directions()) known.emplace_back(r.words);
        for (const auto& r : parts()) known.emplace_back(r.words);
        for (const auto& [name, b] : model_->robot()->bodies) known.push_back(name);
        for (const auto& [name, b] : model_->robot()->mirrored) known.push_back(name);
        first_unknown = Misunderstanding{t.column, fmt::format("\"{}\" is no word known here.{}",
                                                               t.word, didYouMean(t.word, known))};
      }
      used = 1;
    }
    i += used;
  }
  if (first_unknown) throw *first_unknown;

  Instruction out;
  out.said = text;
  const double degree = s.degree.value_or(1);
  const auto wrong = [&](std::string_view reason) -> Misunderstanding {
    return {s.act_column, std::string(reason)};
  };
  const auto bodyFor = [&](Thing t) {
    // Joints as places: hips are the root, knees the shanks, and so on: the body the joint moves.
    if (t.kind != Thing::Kind::kJoints) return t;
    if (t.said.starts_with("hip")) return *thing("root");
    if (t.said == "spine" || t.said == "back") return thing("trunk").value_or(t);
    if (t.said.starts_with("ankle")) return thing("feet").value_or(t);
    if (t.said.starts_with("wrist")) return thing("hands").value_or(t);
    if (t.said.starts_with("elbow")) return thing("forearms").value_or(t);
    throw Misunderstanding{1,
                           fmt::format("\"{}\" is a joint: expected a part of the body", t.said)};
  };
  const auto direct = [&](const DirectionRow& d) {
    out.direction = {d.x, d.y, d.z};
    out.direction_name = d.name;
  };
  const auto distance = [&]() -> double {
    if (s.percent) throw wrong("a percentage of what? Expected a distance, as BY 0.1 m");
    if (s.vector) throw wrong("a distance is one number: BY 0.1 m");
    if (!s.number) return kUsualDistance * degree;
    if (s.number->word.empty()) {
      throw Misunderstanding{s.number->column,
                             fmt::format("{} of what unit? Expected a distance, as {} m",
                                         number(s.number->number), number(s.number->number))};
    }
    if (!isLength(s.number->word)) {
      throw Misunderstanding{s.number->column, "expected a distance, as BY 0.1 m"};
    }
    return s.number->number;
  };
  const auto angle = [&]() -> std::optional<double> {
    if (!s.number) return {};
    if (!isAngle(s.number->word)) {
      throw Misunderstanding{s.number->column,
                             s.number->word.empty()
                                 ? fmt::format("{} of what unit? Expected an angle, as {} deg",
                                               number(s.number->number), number(s.number->number))
                                 : std::string("expected an angle, as BY 20 deg")};
    }
    return s.number->number;
  };
  // A factor on what was before.
  const auto factor = [&](bool more) {
    if (s.number) throw Misunderstanding{s.number->column, "expected a percentage, as 20%"};
    if (!s.percent)
      return more ? 1 + kUsualShare * degree : 1 - std::min(0.9, kUsualShare * degree);
    const double p = s.percent->number / 100;
    if (p <= 0) throw Misunderstanding{s.percent->column, "expected a percentage above 0"};
    if (readings_ == Readings::kLiteral) return p;
    if (more) return p >= 1 ? p : 1 + p;
    if (p >= 1) {
      throw Misunderstanding{s.percent->column,
                             fmt::format("{}% is not less: expected below 100%", p * 100)};
    }
    return s.by || p < 0.5 ? 1 - p : p;
  };
  const auto none = [&](bool numbers, const char* what) {
    if (numbers && (s.number || s.percent || s.vector)) {
      throw wrong(fmt::format("{} takes no number", what));
    }
  };
  const auto percentText = [&] { return fmt::format("{:.4g}%", out.amount * 100); };

  // Relations first: they have no verb of their own, "keep" and "be" aside.
  if (s.relation) {
    if (s.act && *s.act != Act::kPlace && *s.act != Act::kBalance && *s.act != Act::kMove &&
        *s.act != Act::kLower && *s.act != Act::kRaise) {
      throw wrong("an instruction and a relation: say one thing at a time");
    }
    out.form = Form::kRelation;
    out.relation = s.relation->relation;
    const bool of_number = out.relation == Relation::kGreater || out.relation == Relation::kLess;
    if (of_number || s.spins || s.attitude) {
      Thing t;
      t.kind = s.spins ? Thing::Kind::kSpin : Thing::Kind::kAttitude;
      if (!s.axis) throw wrong("about which axis? As \"spin about z GREATER THAN 0\"");
      t.vector = axisNamed(*s.axis, axes_);
      t.said = fmt::format("{} about {}", s.spins ? "spin" : "orientation", *s.axis);
      if (!s.things.empty()) {
        t.name = bodyFor(s.things[0]).name;
        t.said = s.things[0].said + " " + t.said;
      } else if (!s.spins) {
        t.name = model_->bodyName(model_->root());
      }
      Thing limit;
      limit.kind = Thing::Kind::kNumber;
      if (!s.number) throw wrong("than what? Expected a number");
      limit.number = s.number->number;
      out.subject = t;
      out.other = limit;
      out.means = fmt::format("{} {} {}", t.said, nameOf(out.relation), number(limit.number));
      return out;
    }
    if (s.things.empty()) throw wrong("what is where? As \"head IN FRONT OF root\"");
    out.subject = bodyFor(s.things[0]);
    if (s.things.size() > 1) {
      out.other = bodyFor(s.things[1]);
    } else if (s.vector) {
      Thing place;
      place.kind = Thing::Kind::kPlace;
      place.vector = toWorld(s.vector->vector, axes_);
      place.said = fmt::format("[{}, {}, {}]", number(s.vector->vector[0]),
                               number(s.vector->vector[1]), number(s.vector->vector[2]));
      out.other = place;
    } else {
      throw wrong(
          fmt::format("{} what? As \"head {} root\"", nameOf(out.relation), nameOf(out.relation)));
    }
    if (s.things.size() > 2) throw wrong("three things: a relation is between two");
    out.means = fmt::format("{} {} {}", out.subject->said, nameOf(out.relation), out.other->said);
    return out;
  }
  if (s.spins && !s.act) {
    if (!s.direction) throw wrong("which way? As \"spin about z FORWARD\"");
    out.form = Form::kRelation;
    Thing t;
    t.kind = Thing::Kind::kSpin;
    // A forward somersault turns about the world's +y, whatever the sign of the axis that is named.
    const Vector3d d(s.direction->x, s.direction->y, s.direction->z);
    const Vector3d axis = s.axis ? axisNamed(*s.axis, axes_) : Vector3d(Vector3d::UnitY());
    const Vector3d turn = std::abs(d.x()) > 0 ? Vector3d(Vector3d::UnitY() * d.x())
                                              : Vector3d(Vector3d::UnitZ() * d.y());
    if (turn.cwiseAbs().dot(axis.cwiseAbs()) < 0.5) {
      throw wrong(
          fmt::format("a body that spins {} does not turn about that axis", s.direction->name));
    }
    t.vector = turn;
    t.said = s.axis ? fmt::format("spin about {}", *s.axis) : "spin";
    out.subject = t;
    Thing zero;
    zero.kind = Thing::Kind::kNumber;
    out.other = zero;
    out.relation = Relation::kGreater;
    direct(*s.direction);
    out.means = fmt::format("{} {}", t.said,
                            s.direction->name == "forward"    ? "FORWARD"
                            : s.direction->name == "backward" ? "BACKWARD"
                                                              : std::string(s.direction->name));
    return out;
  }
  if (!s.act) throw Misunderstanding{1, "what is to be done? Expected a verb, as MOVE or PLACE"};

  Act act = *s.act;
  if (s.spins && act == Act::kFaster) act = Act::kTurnFaster;
  if (s.spins && act == Act::kSlower) act = Act::kTurnSlower;
  const auto one = [&](const char* what) -> const Thing& {
    if (s.things.empty()) throw wrong(fmt::format("of what? Expected {}", what));
    if (s.things.size() > 1) throw wrong("two parts: say one thing at a time");
    return s.things[0];
  };
  switch (act) {
    case Act::kFlex:
    case Act::kExtend: {
      out.form = Form::kFlex;
      out.reversed = act == Act::kExtend;
      Thing t = one("a joint, as FLEX elbows BY 20 deg");
      if (t.kind != Thing::Kind::kJoints) {
        const auto joints = jointsOf(t.said);
        if (joints.empty()) throw wrong(fmt::format("\"{}\" is no joint", t.said));
        t.kind = Thing::Kind::kJoints;
        t.joints = joints;
      }
      if (t.joints.size() > 1) {
        // "bend your legs": the joint that bends most.
        const auto main = std::ranges::find_if(t.joints, [](const std::string& j) {
          return j.ends_with("knee") || j.ends_with("elbow");
        });
        if (main == t.joints.end()) throw wrong(fmt::format("\"{}\" has several joints", t.said));
        t.joints = {*main};
        t.said = *main;
      }
      out.subject = t;
      const auto a = angle();
      out.relative = !a;
      out.amount = a.value_or((out.reversed ? -1 : 1) * kUsualAngle * degree);
      out.means = out.relative
                      ? fmt::format("{} {} BY {} deg {}", out.reversed ? "EXTEND" : "FLEX", t.said,
                                    number(std::abs(out.amount) / kDegree), "from what it is")
                      : fmt::format("{} {} BY {} deg", out.reversed ? "EXTEND" : "FLEX", t.said,
                                    number(out.amount / kDegree));
      return out;
    }
    case Act::kMove:
    case Act::kLower:
    case Act::kRaise: {
      if (act == Act::kLower) direct(*find(directions(), "down"));
      if (act == Act::kRaise) direct(*find(directions(), "up"));
      if (s.direction) {
        const Vector3d said(s.direction->x, s.direction->y, s.direction->z);
        if (act != Act::kMove && said != out.direction) throw wrong("two directions");
        direct(*s.direction);
      }
      if (out.direction.isZero()) throw wrong("which way? Expected a direction, as downward");
      const bool limb = !s.things.empty() && bodyFor(s.things[0]).kind == Thing::Kind::kBody &&
                        bodyFor(s.things[0]).name != model_->bodyName(model_->root());
      out.form = limb ? Form::kTranslate : Form::kMove;
      out.subject = limb ? bodyFor(one("a limb")) : *thing("com");
      if (s.things.size() > 1) throw wrong("two parts: say one thing at a time");
      out.amount = distance();
      if (out.amount < 0) {
        throw Misunderstanding{s.number->column, "a distance is above 0; the direction says where"};
      }
      out.means = limb ? fmt::format("TRANSLATE {} {} BY {} m", out.subject->said,
                                     out.direction_name, number(out.amount))
                       : fmt::format("MOVE {} BY {} m", out.direction_name, number(out.amount));
      return out;
    }
    case Act::kRotate: {
      out.form = Form::kRotate;
      out.subject = bodyFor(one("a limb, as ROTATE torso z-axis BY 20 deg"));
      if (s.axis) {
        out.direction = axisNamed(*s.axis, axes_);
        out.direction_name = fmt::format("{}-axis", *s.axis);
      } else if (s.direction) {
        out.direction = std::abs(s.direction->x) > 0   ? Vector3d(0, s.direction->x, 0)
                        : std::abs(s.direction->y) > 0 ? Vector3d(-s.direction->y, 0, 0)
                                                       : Vector3d(0, 0, 0);
        out.direction_name = s.direction->name;
        if (out.direction.isZero()) throw wrong("about which axis? As ROTATE torso z-axis");
      } else {
        throw wrong("about which axis? As ROTATE torso z-axis BY 20 deg");
      }
      out.amount = angle().value_or(kUsualAngle * degree);
      out.means = fmt::format("ROTATE {} {} BY {} deg", out.subject->said, out.direction_name,
                              number(out.amount / kDegree));
      return out;
    }
    case Act::kSpeed: {
      out.form = Form::kSpeed;
      if (!s.vector) throw wrong("how fast? Expected a velocity, as SPEED NEAR [1.2, 2.4, 0.0]");
      out.velocity = toWorld(s.vector->vector, axes_);
      out.means = fmt::format("SPEED NEAR [{}, {}, {}] m/s", number(s.vector->vector[0]),
                              number(s.vector->vector[1]), number(s.vector->vector[2]));
      return out;
    }
    case Act::kJump:
    case Act::kFaster:
    case Act::kSlower: {
      const bool more = act != Act::kSlower;
      if (act == Act::kJump && !s.direction && !s.extent)
        throw wrong("jump how? As \"jump higher\"");
      out.form = Form::kMomentum;
      out.amount = factor(more);
      out.reversed = !more;
      out.means = fmt::format("{} to {}", more ? "SPEEDUP" : "SLOWDOWN", percentText());
      return out;
    }
    case Act::kTurnFaster:
    case Act::kTurnSlower: {
      const bool more = act == Act::kTurnFaster;
      out.form = Form::kTurn;
      out.amount = factor(more);
      out.reversed = !more;
      out.means = fmt::format("{} to {}", more ? "TURNFASTER" : "TURNSLOWER", percentText());
      return out;
    }
    case Act::kBalance:
      none(true, "BALANCE");
      out.form = Form::kBalance;
      out.means = "BALANCE";
      return out;
    case Act::kRelax:
    case Act::kStiffen: {
      out.form = Form::kStiffness;
      Thing t = one("joints, as RELAX arms BY 30%");
      const auto joints = jointsOf(t.said);
      if (joints.empty()) throw wrong(fmt::format("\"{}\" has no joints", t.said));
      t.kind = Thing::Kind::kJoints;
      t.joints = joints;
      out.subject = t;
      out.amount = factor(act == Act::kStiffen);
      out.means = fmt::format("{} {} to {}", act == Act::kRelax ? "RELAX" : "STIFFEN", t.said,
                              percentText());
      return out;
    }
    case Act::kPush:
    case Act::kPull: {
      out.form = Form::kPush;
      out.reversed = act == Act::kPull;
      out.subject = bodyFor(one("a limb, as PUSH feet AGAINST wall"));
      out.surface = s.surface;
      out.means = fmt::format("{} {} AGAINST {}", out.reversed ? "PULL" : "PUSH", out.subject->said,
                              s.surface.empty() ? "what it touches" : s.surface);
      return out;
    }
    case Act::kPlace: {
      if (!s.vector && s.things.size() < 2 && s.direction) {
        // "land further ahead": the feet, from where they are
        out.form = Form::kTranslate;
        out.subject = s.things.empty() ? thing("feet") : bodyFor(s.things[0]);
        if (!out.subject) throw wrong("place what? As PLACE feet NEAR [0.8, 0, 0]");
        direct(*s.direction);
        out.amount = distance();
        out.means = fmt::format("TRANSLATE {} {} BY {} m", out.subject->said, out.direction_name,
                                number(out.amount));
        return out;
      }
      out.form = Form::kPlace;
      if (s.things.empty()) throw wrong("place what? As PLACE feet NEAR [0.8, 0, 0]");
      out.subject = bodyFor(s.things[0]);
      if (s.vector) {
        Thing place;
        place.kind = Thing::Kind::kPlace;
        place.vector = toWorld(s.vector->vector, axes_);
        place.said = fmt::format("[{}, {}, {}]", number(s.vector->vector[0]),
                                 number(s.vector->vector[1]), number(s.vector->vector[2]));
        out.other = place;
      } else if (s.things.size() > 1) {
        out.other = bodyFor(s.things[1]);
      } else {
        throw wrong("near what? As PLACE feet NEAR [0.8, 0, 0]");
      }
      if (s.things.size() > 2) throw wrong("three things: expected two");
      none(false, "PLACE");
      out.means = fmt::format("PLACE {} NEAR {}", out.subject->said, out.other->said);
      return out;
    }
  }
  throw wrong("not understood");
}

}  // namespace traceur::coach
