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
                           {"metre", 1},
                           {"metres", 1},
                           {"meter", 1},
                           {"meters", 1},
                           {"cm", 0.01},
                           {"centimetre", 0.01},
                           {"centimetres", 0.01},
                           {"centimeter", 0.01},
                           {"centimeters", 0.01},
                           {"mm", 0.001},
                           {"deg", kDegree},
                           {"degs", kDegree},
                           {"degree", kDegree},
                           {"degrees", kDegree},
                           {"°", kDegree},
                           {"rad", 1},
                           {"radians", 1},
                           {"m/s", 1},
                           {"s", 1},
                           {"second", 1},
                           {"seconds", 1},
                           {"percent", 1},
                           {"percents", 1}};
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
    while (at_ < text_.size() && (std::isspace(static_cast<unsigned char>(text_[at_])) ||
                                  text_[at_] == ',' || (text_[at_] == '.' && !startsNumber()) ||
                                  text_[at_] == '!' || text_[at_] == '\'' || text_[at_] == '?')) {
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
    if (w == "C") return "com";  // the printed names of the COM and the centre of pressure
    if (w == "S") return "cop";
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
      std::string w = word();
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
    if (c == '[' || c == '(') return vector();
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
      if (t.word.starts_with("percent")) {
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
    if (at_ >= text_.size() || (text_[at_] != ']' && text_[at_] != ')')) {
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

bool isLength(const Token& t) {
  return t.kind == Token::Kind::kNumber &&
         (t.word == "m" || t.word == "cm" || t.word == "mm" || t.word.starts_with("met") ||
          t.word.starts_with("centi"));
}
bool isAngle(const Token& t) {
  return t.kind == Token::Kind::kNumber &&
         (t.word.starts_with("deg") || t.word == "°" || t.word.starts_with("rad"));
}

/// What was found in an instruction, whatever its order.
struct Slots {
  std::optional<Act> act;
  int act_column = 1;
  std::vector<Thing> things;
  std::optional<DirectionRow> direction;
  std::optional<Relation> relation;
  std::optional<char> axis;
  std::optional<Token> number, percent, vector;
  std::optional<double> share;       // "twice", "half"
  std::optional<Vector3d> velocity;  // of "2 m/s forward", world axes
  double degree = 1;                 // of "a bit", "much"
  std::string surface;
  bool by = false;
  bool spins = false;     // "spin", "somersault"
  bool attitude = false;  // "orientation"
  bool more = false;      // "more", "further"
  bool near = false;      // "near", "close to"
  bool as = false;        // "half as fast": to so much, not by so much
  bool negated = false;   // "not", "avoid"
};

/// Sorts words into slots: the longest run of words that means something, then the next.
class Sorter {
 public:
  Sorter(const Interpreter& with, const std::vector<std::string>& surfaces,
         std::vector<std::string> known)
      : with_(with), surfaces_(surfaces), known_(std::move(known)) {}

  Slots sort(const std::vector<Token>& tokens) {
    std::optional<Misunderstanding> unknown;
    speeds_ = std::ranges::any_of(
        tokens, [](const Token& t) { return t.word == "m/s" && t.kind == Token::Kind::kNumber; });
    for (size_t i = 0; i < tokens.size();) {
      token_ = &tokens[i];
      if (quantity(*token_)) {
        ++i;
        continue;
      }
      size_t used = std::min<size_t>(6, tokens.size() - i);
      while (used > 0 && !words(std::span(tokens).subspan(i, used))) --used;
      if (used == 0 && !unknown) {
        unknown = Misunderstanding{token_->column,
                                   fmt::format("\"{}\" is no word known here.{}", token_->word,
                                               didYouMean(token_->word, known_))};
      }
      i += std::max<size_t>(1, used);
    }
    if (unknown) throw *unknown;
    if (pending_) {
      throw Misunderstanding{pending_->column, "which way? Expected a direction beside the speed"};
    }
    return std::move(s_);
  }

 private:
  template <class T>
  void once(std::optional<T>& slot, const T& value, const char* what) {
    if (slot) {
      throw Misunderstanding{token_->column, fmt::format("two {}: say one thing at a time", what)};
    }
    slot = value;
  }
  bool quantity(const Token& t) {
    if (t.kind == Token::Kind::kNumber && t.word == "m/s") {
      pending_ = t;
      if (fresh_) velocityAlong(*fresh_);
      fresh_.reset();
    } else if (t.kind == Token::Kind::kNumber) {
      once(s_.number, t, "numbers");
    }
    if (t.kind == Token::Kind::kPercent) once(s_.percent, t, "percentages");
    if (t.kind == Token::Kind::kVector) once(s_.vector, t, "vectors");
    return t.kind != Token::Kind::kWord;
  }
  /// "folded", "wobbling": the verb they are of.
  bool stemmed(const std::string& w) {
    for (const std::string_view tail : {"ing", "ed", "s", "d", "es"}) {
      if (!w.ends_with(tail) || w.size() < tail.size() + 3) continue;
      const std::string stem = w.substr(0, w.size() - tail.size());
      std::vector<std::string> forms{stem, stem + "e"};
      if (stem[stem.size() - 1] == stem[stem.size() - 2])
        forms.push_back(stem.substr(0, stem.size() - 1));
      for (const std::string& f : forms) {
        if (find(verbs(), f)) return verb(f);
      }
    }
    return false;
  }
  bool words(std::span<const Token> tokens) {
    const auto is_word = [](const Token& t) { return t.kind == Token::Kind::kWord; };
    if (!std::ranges::all_of(tokens, is_word)) return false;
    const std::string w = joined(tokens);
    return place(w) || relation(w) || degree(w) || adverb(w) || verb(w) || mark(w) || share(w) ||
           direction(w) || part(w) || negation(w) ||
           std::ranges::find(fillers(), w) != fillers().end() || stemmed(w);
  }
  bool place(const std::string& w) {
    const bool known =
        w == "floor" || w == "ground" || std::ranges::find(surfaces_, w) != surfaces_.end();
    if (known) s_.surface = w == "ground" ? "floor" : w;
    return known;
  }
  bool relation(const std::string& w) {
    const auto row = find(relations(), w);
    if (row) once(s_.relation, row->relation, "relations");
    return row.has_value();
  }
  bool degree(const std::string& w) {
    const auto row = find(degrees(), w);
    if (row) s_.degree *= row->factor;
    return row.has_value();
  }
  /// "spin faster", "move more slowly": what a verb is told besides.
  bool adverb(const std::string& w) {
    if (!s_.act && !s_.spins) return false;
    const bool faster = w == "faster" || w == "quicker" || w == "quickly";
    const bool slower = w == "slower" || w == "slowly";
    if (!faster && !slower) return false;
    if (s_.act == Act::kTurnFaster || s_.act == Act::kTurnSlower) return true;
    const bool turns = s_.spins || s_.act == Act::kRotate;
    s_.act = turns ? (faster ? Act::kTurnFaster : Act::kTurnSlower)
                   : (faster ? Act::kFaster : Act::kSlower);
    return true;
  }
  bool verb(const std::string& w) {
    const auto row = find(verbs(), w);
    if (!row) return false;
    // "raise the hips higher": what is a verb and a direction is the latter behind a thing.
    if (find(directions(), w) && (s_.act || !s_.things.empty())) return false;
    s_.as = s_.as || row->act == Act::kAsFast || row->act == Act::kAsStiff;
    if (w.starts_with("so ")) s_.negated = false;  // "do not spin so fast"
    if (!s_.act) {
      s_.act = row->act;
      s_.act_column = token_->column;
      return true;
    }
    return stands(row->act);
  }
  /// A second verb: the same again, or one that says what the first is for.
  bool stands(Act next) {
    const Act first = *s_.act;
    if (first == next) return true;
    const auto is = [](Act a, std::initializer_list<Act> of) {
      return std::ranges::find(of, a) != of.end();
    };
    // "open up the hips, bend less": no. "lift off, faster", "go twist": the second is meant.
    if (is(first, {Act::kMove, Act::kPlace, Act::kLower, Act::kRaise}) &&
        !is(next, {Act::kMove, Act::kPlace})) {
      s_.act = next;
      return true;
    }
    if (is(next, {Act::kMove, Act::kPlace})) return true;
    // "kick off the wall, pull yourself in"; "spin … slower"
    if (is(first, {Act::kRotate, Act::kTwist}) && is(next, {Act::kRotate, Act::kTwist}))
      return true;
    if (is(first, {Act::kRotate, Act::kTwist}) && is(next, {Act::kFaster, Act::kSlower})) {
      s_.act = next == Act::kFaster ? Act::kTurnFaster : Act::kTurnSlower;
      return true;
    }
    if (next == Act::kBalance) {
      s_.act = next;
      return true;
    }
    // "straighten the knee until it is bent by 10 degrees"
    if (is(first, {Act::kFlex, Act::kExtend}) && is(next, {Act::kFlex, Act::kExtend})) return true;
    if (first == Act::kBalance) return true;
    if (is(first, {Act::kFaster, Act::kSlower}) && next == Act::kSpeed) return true;
    if (first == Act::kLean && next != Act::kFlex && next != Act::kExtend) {
      if (!is(next, {Act::kMove, Act::kPlace})) s_.act = next;
      return true;
    }
    if (first == Act::kPush && next == Act::kSpeed) {
      s_.act = next;  // "push off with a velocity of"
      return true;
    }
    // "your elbows are too rigid, ease them off" is one; "twice as stiff" says it more exactly.
    if (next == Act::kAsFast || next == Act::kAsStiff) {
      s_.spins =
          s_.spins || is(first, {Act::kRotate, Act::kTwist, Act::kTurnFaster, Act::kTurnSlower});
      s_.act = next;
      return true;
    }
    throw Misunderstanding{token_->column, "two verbs: say one thing at a time"};
  }
  bool mark(const std::string& w) {
    static constexpr std::string_view kSpins[] = {"spin",     "turn", "turning",   "spinning",
                                                  "rotation", "flip", "somersault"};
    if (w == "by") return s_.by = true;
    if (std::ranges::find(kSpins, w) != std::end(kSpins)) return s_.spins = true;
    if (w == "orientation" || w == "attitude" || w == "pitch") return s_.attitude = true;
    if (w == "more" || w == "further") return s_.more = true;
    static constexpr std::string_view kNear[] = {"near",           "close to", "next to", "beside",
                                                 "by the side of", "touching", "against"};
    if (std::ranges::find(kNear, w) != std::end(kNear)) return s_.near = true;
    if (w == "turn over" || w == "flip over" || w == "roll over") return s_.spins = true;
    const bool axis = (w.size() == 1 || w.ends_with("-axis")) && w[0] >= 'x' && w[0] <= 'z';
    if (axis) once(s_.axis, w[0], "axes");
    return axis;
  }
  bool share(const std::string& w) {
    const auto row = find(shares(), w);
    if (row) once(s_.share, row->factor, "shares");
    return row.has_value();
  }
  bool negation(const std::string& w) {
    const bool is = w == "not" || w == "don" || w == "dont" || w == "never" || w == "avoid" ||
                    w == "without" || w == "no" || w == "stop" || w == "t" || w == "doesn";
    s_.negated = s_.negated || is;
    return is;
  }
  void velocityAlong(const DirectionRow& d) {
    if (!s_.velocity) s_.velocity = Vector3d::Zero();
    *s_.velocity += pending_->number * Vector3d(d.x, d.y, d.z);
    pending_.reset();
  }
  bool direction(const std::string& w) {
    const auto row = find(directions(), w);
    // "the back" is a part until there is something to do.
    if (!row || (w == "back" && !s_.act && !s_.spins)) return false;
    // "forward at 2 m/s and up at 1": each speed has its own.
    if (pending_) {
      velocityAlong(*row);
    } else {
      fresh_ = *row;
    }
    if (speeds_) {
      s_.direction = *row;
      return true;
    }
    if (s_.direction && s_.direction->name != row->name) {
      throw Misunderstanding{token_->column, "two directions: say one thing at a time"};
    }
    s_.direction = *row;
    return true;
  }
  bool part(const std::string& w) {
    const auto thing = with_.thing(w);
    if (thing) s_.things.push_back(*thing);
    return thing.has_value();
  }

  const Interpreter& with_;
  const std::vector<std::string>& surfaces_;
  std::vector<std::string> known_;
  const Token* token_ = nullptr;
  bool speeds_ = false;                // a number of m/s is somewhere in it
  std::optional<Token> pending_;       // a speed whose direction is not said yet
  std::optional<DirectionRow> fresh_;  // a direction whose speed is not said yet
  Slots s_;
};

/// Makes an instruction of what was found.
class Maker {
 public:
  Maker(const Slots& s, const Interpreter& with, const sim::Model& model, Axes axes,
        Readings readings)
      : s_(s), with_(with), model_(model), axes_(axes), readings_(readings) {}

  Instruction make() {
    if (s_.negated && s_.act != Act::kBalance) {
      throw wrong("what is not to be is no instruction: say what should be");
    }
    const bool over = s_.relation == Relation::kAbove && s_.vector && s_.things.size() == 1;
    const bool which_way =
        s_.spins && s_.direction && !s_.share && !turnsPart() && (!s_.act || s_.act == Act::kMove);
    if (s_.relation && !over) {
      relation();
    } else if (s_.velocity || (s_.act == Act::kSpeed && s_.vector)) {
      speed();
    } else if (which_way) {
      spinSign();
    } else if (over) {
      placeNear();  // "keep the COM over [0.2, 1, 0]"
    } else {
      s_.act ? act() : withoutVerb();
    }
    return std::move(out_);
  }

 private:
  Misunderstanding wrong(const std::string& reason) const { return {s_.act_column, reason}; }

  /// "the head 45 degrees to the left" is turned.
  bool turnsPart() const {
    return !s_.act && s_.number && isAngle(*s_.number) && !s_.things.empty();
  }
  void withoutVerb() {
    if (s_.spins && turnsPart()) return rotate(true);
    if (s_.share) return s_.spins ? turn(*s_.share > 1) : momentum(*s_.share > 1);
    const bool place = s_.vector && s_.things.size() == 1;
    if (place || (s_.near && bodies().size() == 2)) return placeNear();
    if (s_.spins) return spinSign();
    if (s_.direction) return move({});
    throw Misunderstanding{1, "what is to be done? Expected a verb, as MOVE or PLACE"};
  }
  void act() {
    const bool two = bodies().size() == 2 && !s_.relation;
    switch (*s_.act) {
      case Act::kFlex:
        return flex(false);
      case Act::kExtend:
        return flex(true);
      case Act::kMove:
        return go(two);
      case Act::kLean:
        return lean();
      case Act::kLower:
        return move("down");
      case Act::kRaise:
        return move("up");
      case Act::kRotate:
        return s_.things.empty() && s_.spins ? spinSign() : rotate(false);
      case Act::kTwist:
        return rotate(true);
      case Act::kSpeed:
        if (s_.share) return momentum(*s_.share > 1);  // "double your speed"
        return s_.direction || s_.more ? momentum(true) : speed();
      case Act::kAsFast:
        return s_.spins ? turn(asMore()) : momentum(asMore());
      case Act::kAsStiff:
        return stiffness(asMore());
      case Act::kFaster:
        return s_.spins ? turn(true) : momentum(true);
      case Act::kSlower:
        return s_.spins ? turn(false) : momentum(false);
      case Act::kTurnFaster:
        return turn(true);
      case Act::kTurnSlower:
        return turn(false);
      case Act::kBalance:
        return balance();
      case Act::kRelax:
        return stiffness(false);
      case Act::kStiffen:
        return stiffness(true);
      case Act::kPush:
        return push(false);
      case Act::kPull:
        if (two && s_.surface.empty()) return placeNear();  // "grab your knees with your hands"
        // "pull the legs back by 0.2 m"
        return s_.direction && s_.surface.empty() ? move({}) : push(true);
      case Act::kPlace:
        return placeNear();
    }
  }
  /// "move", "bring", "lean", "get": by what else is said.
  void go(bool two) {
    if (s_.more && !s_.direction && s_.things.empty()) return momentum(true);
    if (two || (s_.vector && s_.things.size() == 1)) return placeNear();
    const bool turned = s_.number && isAngle(*s_.number) && !s_.things.empty();
    turned ? rotate(false) : move({});
  }
  /// "lean the torso forward": rotates it, unless a distance is said.
  void lean() {
    const bool part =
        std::ranges::any_of(bodies(), [](const Thing& t) { return t.kind != Thing::Kind::kCom; });
    const bool far = s_.number && isLength(*s_.number);
    part && !far && !s_.vector ? rotate(false) : move({});
  }
  bool asMore() const { return s_.share.value_or(s_.percent ? s_.percent->number / 100 : 1) >= 1; }

  // Pieces ---------------------------------------------------------------------------------------
  /// What was named, each once; "your body", "yourself" only where nothing else was.
  std::vector<Thing> bodies() const {
    std::vector<Thing> out;
    for (const Thing& t : s_.things) {
      const auto same = [&](const Thing& o) {
        return o.kind == t.kind && o.name == t.name && o.joints == t.joints;
      };
      const bool self = t.kind == Thing::Kind::kCom && (t.said == "body" || t.said == "yourself");
      if (std::ranges::none_of(out, same) && !(self && s_.things.size() > 1)) out.push_back(t);
    }
    return out;
  }
  Thing one(const std::string& expected) const {
    const std::vector<Thing> all = bodies();
    if (all.empty()) throw wrong("of what? Expected " + expected);
    if (all.size() > 1) throw wrong("two parts: say one thing at a time");
    return all[0];
  }
  /// A joint as a place: the body that it is in.
  Thing bodyFor(const Thing& t) const {
    if (t.kind != Thing::Kind::kJoints) return t;
    Thing place = t;
    place.kind = Thing::Kind::kBody;
    const auto whole = [&](std::string_view name) {
      if (const auto b = with_.thing(name)) place.name = b->name;
    };
    if (t.said.starts_with("hip")) whole("root");
    if (t.said == "spine" || t.said == "back") whole("trunk");
    if (t.said.starts_with("leg")) whole("legs");
    if (t.said.starts_with("arm")) whole("arms");
    if (place.name.empty()) place.bodies = with_.bodiesOf(t.joints);
    return place;
  }
  std::vector<std::string> jointsFor(const Thing& t) const {
    auto joints = t.kind == Thing::Kind::kJoints ? t.joints : with_.jointsOf(t.said);
    if (joints.empty()) throw wrong(fmt::format("\"{}\" has no joints", t.said));
    return joints;
  }
  Thing placeOf(const Token& v) const {
    Thing place;
    place.kind = Thing::Kind::kPlace;
    place.vector = toWorld(v.vector, axes_);
    place.said = said(v);
    return place;
  }
  static std::string said(const Token& v) {
    return fmt::format("[{}, {}, {}]", number(v.vector[0]), number(v.vector[1]),
                       number(v.vector[2]));
  }
  void direct(const DirectionRow& d) {
    out_.direction = {d.x, d.y, d.z};
    out_.direction_name = d.name;
  }
  double distance() const {
    if (s_.percent) throw wrong("a percentage of what? Expected a distance, as BY 0.1 m");
    if (s_.vector) throw wrong("a distance is one number, as BY 0.1 m");
    if (!s_.number) return kUsualDistance * s_.degree;
    needUnit("a distance", "m");
    if (!isLength(*s_.number)) {
      throw Misunderstanding{s_.number->column, "expected a distance, as BY 0.1 m"};
    }
    if (s_.number->number <= 0) {
      throw Misunderstanding{s_.number->column, "a distance is above 0; the direction says where"};
    }
    return s_.number->number;
  }
  std::optional<double> angle() const {
    if (!s_.number) return {};
    needUnit("an angle", "deg");
    if (!isAngle(*s_.number)) {
      throw Misunderstanding{s_.number->column, "expected an angle, as BY 20 deg"};
    }
    return s_.number->number;
  }
  void needUnit(std::string_view what, std::string_view unit) const {
    if (!s_.number->word.empty()) return;
    const std::string n = number(s_.number->number);
    throw Misunderstanding{s_.number->column,
                           fmt::format("{} of what unit? Expected {}, as {} {}", n, what, n, unit)};
  }
  /// On what was before.
  double factor(bool more) const {
    if (s_.number) throw Misunderstanding{s_.number->column, "expected a percentage, as 20%"};
    const double usual = kUsualShare * s_.degree;
    if (s_.as) {
      // "twice as fast", "a third as stiff", "80% as fast"
      if (s_.share) return *s_.share;
      if (s_.percent) return s_.percent->number / 100;
      throw wrong("how much? As \"twice as fast\"");
    }
    if (s_.share) {
      // "twice as fast", "half as stiff", "by a third"
      const double f = *s_.share;
      if (f > 1) return more ? f : 1 / f;
      return more ? 1 + f : s_.by || f < 0.5 ? 1 - f : f;
    }
    if (!s_.percent) return more ? 1 + usual : 1 - std::min(0.9, usual);
    const double p = s_.percent->number / 100;
    if (p <= 0) throw Misunderstanding{s_.percent->column, "expected a percentage above 0"};
    if (readings_ == Readings::kLiteral) return p;
    if (more) return p >= 1 ? p : 1 + p;
    if (p >= 1) {
      throw Misunderstanding{s_.percent->column,
                             fmt::format("{}% is not less: expected below 100%", number(p * 100))};
    }
    return s_.by || p < 0.5 ? 1 - p : p;
  }
  /// Of a factor: what is read as the same again.
  std::string percent() const {
    return out_.amount >= 1 ? number(out_.amount * 100) + "%"
                            : "BY " + number((1 - out_.amount) * 100) + "%";
  }
  static std::string degrees(double angle) { return number(angle / kDegree) + " deg"; }

  // Relations ------------------------------------------------------------------------------------
  void relation() {
    static constexpr Act kBeside[] = {Act::kPlace, Act::kBalance, Act::kMove, Act::kLower,
                                      Act::kRaise};
    if (s_.act && std::ranges::find(kBeside, *s_.act) == std::end(kBeside)) {
      throw wrong("an instruction and a relation: say one thing at a time");
    }
    out_.form = Form::kRelation;
    out_.relation = *s_.relation;
    const bool of_number = out_.relation == Relation::kGreater || out_.relation == Relation::kLess;
    of_number || s_.spins || s_.attitude ? bound() : beside();
    out_.means =
        fmt::format("{} {} {}", out_.subject->said, nameOf(out_.relation), out_.other->said);
  }
  /// "orientation about z GREATER THAN 0".
  void bound() {
    if (!s_.axis) throw wrong("about which axis? As \"spin about z GREATER THAN 0\"");
    if (!s_.number) throw wrong("than what? Expected a number");
    Thing t;
    t.kind = s_.spins ? Thing::Kind::kSpin : Thing::Kind::kAttitude;
    t.vector = axisNamed(*s_.axis, axes_);
    t.said = fmt::format("{} about {}", s_.spins ? "spin" : "orientation", *s_.axis);
    if (!s_.things.empty()) {
      t.name = bodyFor(s_.things[0]).name;
      t.said = s_.things[0].said + " " + t.said;
    } else if (!s_.spins) {
      t.name = model_.bodyName(model_.root());
    }
    Thing limit;
    limit.kind = Thing::Kind::kNumber;
    limit.number = s_.number->number;
    limit.said = number(limit.number);
    out_.subject = t;
    out_.other = limit;
  }
  /// "head IN FRONT OF root".
  void beside() {
    const std::string example = fmt::format("As \"head {} root\"", nameOf(out_.relation));
    if (s_.things.empty()) throw wrong("what is where? " + example);
    if (s_.things.size() > 2) throw wrong("three things: a relation is between two");
    out_.subject = bodyFor(s_.things[0]);
    if (s_.things.size() == 2) {
      out_.other = bodyFor(s_.things[1]);
    } else if (s_.vector) {
      out_.other = placeOf(*s_.vector);
    } else {
      throw wrong(fmt::format("{} what? {}", nameOf(out_.relation), example));
    }
  }
  /// "spin about z FORWARD".
  void spinSign() {
    if (!s_.direction) throw wrong("which way? As \"spin about z FORWARD\"");
    out_.form = Form::kRelation;
    // A forward somersault turns about the world's +y, whatever sign the named axis has there.
    const Vector3d turn(0, s_.direction->x, s_.direction->y);
    const Vector3d axis = s_.axis ? axisNamed(*s_.axis, axes_) : turn;
    if (turn.isZero() || turn.cwiseAbs().dot(axis.cwiseAbs()) < 0.5) {
      throw wrong(fmt::format("what spins {} does not turn about that axis", s_.direction->name));
    }
    Thing t;
    t.kind = Thing::Kind::kSpin;
    t.vector = turn;
    t.said = s_.axis ? fmt::format("spin about {}", *s_.axis) : "spin";
    Thing zero;
    zero.kind = Thing::Kind::kNumber;
    out_.subject = t;
    out_.other = zero;
    out_.relation = Relation::kGreater;
    direct(*s_.direction);
    std::string way(s_.direction->name);
    std::ranges::transform(way, way.begin(), [](unsigned char c) { return std::toupper(c); });
    out_.means = fmt::format("{} {}", t.said, way);
  }

  // Forms ----------------------------------------------------------------------------------------
  void flex(bool extend) {
    out_.form = Form::kFlex;
    Thing t = one("a joint, as FLEX elbows BY 20 deg");
    t.joints = jointsFor(t);
    t.kind = Thing::Kind::kJoints;
    if (t.joints.size() > 1) {
      // "bend your legs": in the joint that bends most.
      const auto main = std::ranges::find_if(t.joints, [](const std::string& j) {
        return j.ends_with("knee") || j.ends_with("elbow");
      });
      if (main == t.joints.end()) throw wrong(fmt::format("\"{}\" has several joints", t.said));
      t.joints = {*main};
      t.said = *main;
    }
    const auto asked = angle();
    out_.relative = !asked || s_.more;
    out_.amount = asked.value_or(kUsualAngle * s_.degree) * (out_.relative && extend ? -1 : 1);
    out_.means = fmt::format("{} {}{} BY {}", extend ? "EXTEND" : "FLEX", t.said,
                             out_.relative ? " more" : "", degrees(std::abs(out_.amount)));
    out_.subject = t;
  }
  void move(const std::string& towards) {
    if (!towards.empty()) direct(*find(directions(), towards));
    if (s_.direction) {
      const std::string before = out_.direction_name;
      direct(*s_.direction);
      if (!before.empty() && before != out_.direction_name) throw wrong("two directions");
    }
    if (out_.direction.isZero()) throw wrong("which way? Expected a direction, as downward");
    const std::string root = model_.bodyName(model_.root());
    const Thing whole = s_.things.empty() ? *with_.thing("com") : bodyFor(one("a part"));
    const bool limb = whole.kind == Thing::Kind::kBody && whole.name != root;
    out_.form = limb ? Form::kTranslate : Form::kMove;
    out_.subject = limb ? whole : *with_.thing("com");
    out_.amount = distance();
    out_.means = fmt::format("{}{} BY {} m", limb ? "TRANSLATE " + whole.said + " " : "MOVE ",
                             out_.direction_name, number(out_.amount));
  }
  /// @param about_vertical  "twist to the left", not "tilt to the left"
  void rotate(bool about_vertical) {
    out_.form = Form::kRotate;
    out_.subject = bodyFor(one("a limb, as ROTATE torso z-axis BY 20 deg"));
    if (s_.axis) {
      out_.direction = axisNamed(*s_.axis, axes_);
      out_.direction_name = fmt::format("{}-axis", *s_.axis);
    } else if (s_.direction && s_.direction->z == 0) {
      // "tilt forward": about the world's y; "to the left": about its x.
      const bool twists = (about_vertical || s_.spins) && s_.direction->x == 0;
      out_.direction =
          twists ? Vector3d(0, 0, s_.direction->y) : Vector3d(-s_.direction->y, s_.direction->x, 0);
      out_.direction_name = (twists ? "turn " : "") + std::string(s_.direction->name);
    } else {
      throw wrong("about which axis? As ROTATE torso z-axis BY 20 deg");
    }
    out_.amount = angle().value_or(kUsualAngle * s_.degree);
    out_.means = fmt::format("ROTATE {} {} BY {}", out_.subject->said, out_.direction_name,
                             degrees(out_.amount));
  }
  void speed() {
    out_.form = Form::kSpeed;
    if (s_.velocity) {
      out_.velocity = *s_.velocity;
      const Vector3d w = *s_.velocity;  // as the script writes vectors
      const Vector3d v = axes_ == Axes::kPublished ? Vector3d(w.x(), w.z(), -w.y()) : w;
      out_.means =
          fmt::format("SPEED NEAR [{}, {}, {}] m/s", number(v[0]), number(v[1]), number(v[2]));
      return;
    }
    if (!s_.vector) throw wrong("how fast? Expected a velocity, as SPEED NEAR [1.2, 2.4, 0.0]");
    out_.velocity = toWorld(s_.vector->vector, axes_);
    out_.means = fmt::format("SPEED NEAR {} m/s", said(*s_.vector));
  }
  void momentum(bool more) {
    out_.form = Form::kMomentum;
    out_.amount = factor(more);
    out_.means = fmt::format("{} {}", more ? "SPEEDUP" : "SLOWDOWN", percent());
  }
  void turn(bool more) {
    out_.form = Form::kTurn;
    out_.amount = factor(more);
    out_.means = fmt::format("{} {}", more ? "TURNFASTER" : "TURNSLOWER", percent());
  }
  void balance() {
    if (s_.number || s_.percent || s_.vector || s_.share) throw wrong("BALANCE takes no number");
    out_.form = Form::kBalance;
    out_.means = "BALANCE";
  }
  void stiffness(bool more) {
    out_.form = Form::kStiffness;
    Thing t = one("joints, as RELAX arms BY 30%");
    t.joints = jointsFor(t);
    t.kind = Thing::Kind::kJoints;
    out_.subject = t;
    out_.amount = factor(more);
    out_.means = fmt::format("{} {} {}", more ? "STIFFEN" : "RELAX", t.said, percent());
  }
  void push(bool pull) {
    out_.form = Form::kPush;
    out_.subject = bodyFor(one("a limb, as PUSH feet AGAINST wall"));
    out_.means = fmt::format("{} {}{}", pull ? "PULL" : "PUSH", out_.subject->said,
                             s_.surface.empty() ? "" : " AGAINST " + s_.surface);
  }
  void placeNear() {
    const std::vector<Thing> things = bodies();
    if (things.size() > 2) throw wrong("three things: expected two");
    if (!s_.vector && things.size() < 2 && s_.direction) return landFurther();
    if (things.empty()) throw wrong("place what? As PLACE feet NEAR [0.8, 0, 0]");
    out_.form = Form::kPlace;
    out_.subject = bodyFor(things[0]);
    if (s_.vector) {
      out_.other = placeOf(*s_.vector);
    } else if (things.size() == 2) {
      out_.other = bodyFor(things[1]);
    } else {
      throw wrong("near what? As PLACE feet NEAR [0.8, 0, 0]");
    }
    out_.means = fmt::format("PLACE {} NEAR {}", out_.subject->said, out_.other->said);
  }
  /// "land further ahead": the feet, from where they are.
  void landFurther() {
    const auto what = s_.things.empty() ? with_.thing("feet") : bodyFor(s_.things[0]);
    if (!what) throw wrong("place what? As PLACE feet NEAR [0.8, 0, 0]");
    out_.form = Form::kTranslate;
    out_.subject = what;
    direct(*s_.direction);
    out_.amount = distance();
    out_.means = fmt::format("TRANSLATE {} {} BY {} m", what->said, out_.direction_name,
                             number(out_.amount));
  }

  const Slots& s_;
  const Interpreter& with_;
  const sim::Model& model_;
  Axes axes_;
  Readings readings_;
  Instruction out_;
};

}  // namespace

namespace {

/// "thirty degrees", "half a metre", "forty-five percent" as numbers with their units.
class NumberWords {
 public:
  explicit NumberWords(std::vector<Token> tokens) : in_(std::move(tokens)) {}

  std::vector<Token> read() {
    for (at_ = 0; at_ < in_.size();) {
      if (triple()) continue;
      if (!digits() && !words() && !part()) out_.push_back(in_[at_++]);
    }
    return std::move(out_);
  }

 private:
  const std::string& word(size_t i) const {
    static const std::string kNone;
    return i < in_.size() && in_[i].kind == Token::Kind::kWord ? in_[i].word : kNone;
  }
  static const Unit* unitNamed(const std::string& w) {
    const auto* found = std::ranges::find_if(kUnits, [&](const Unit& u) { return u.name == w; });
    return found == std::end(kUnits) ? nullptr : found;
  }
  /// Stores a number with the unit that follows it, if it has none itself.
  void store(Token t, size_t next) {
    if (t.kind == Token::Kind::kNumber && t.word.empty()) {
      if (word(next) == "per" && word(next + 1) == "cent") {
        t.kind = Token::Kind::kPercent;
        next += 2;
      } else if (const Unit* u = unitNamed(word(next))) {
        t.kind = u->name.starts_with("percent") ? Token::Kind::kPercent : Token::Kind::kNumber;
        t.word = u->name;
        t.number *= u->factor;
        ++next;
      }
    }
    if (isLength(t) && word(next) == "and" && word(next + 1) == "a" && word(next + 2) == "half") {
      t.number *= (t.number + 0.5) / t.number;
      next += 3;
    }
    const bool per = word(next) == "per" || word(next) == "a" || word(next) == "an";
    if (isLength(t) && per && word(next + 1) == "second") {
      t.word = "m/s";
      next += 2;
    }
    out_.push_back(t);
    at_ = next;
  }
  /// "1.5, 2, 0.5 m/s": a vector without its brackets.
  bool triple() {
    if (at_ + 2 >= in_.size()) return false;
    Token t = in_[at_];
    for (int k = 0; k < 3; ++k) {
      const Token& n = in_[at_ + static_cast<size_t>(k)];
      if (n.kind != Token::Kind::kNumber || (k < 2 && !n.word.empty())) return false;
      t.vector[k] = n.number;
    }
    t.kind = Token::Kind::kVector;
    t.word = in_[at_ + 2].word;
    out_.push_back(t);
    at_ += 3;
    return true;
  }
  bool digits() {
    if (in_[at_].kind != Token::Kind::kNumber) return false;
    store(in_[at_], at_ + 1);
    return true;
  }
  /// "thirty", "forty-five", "one hundred".
  bool words() {
    double value = 0;
    size_t next = at_;
    for (; next < at_ + 2; ++next) {
      const std::string& w = word(next);
      const size_t dash = w.find('-');
      const auto first = find(numbers(), w.substr(0, dash));
      const auto second =
          dash == std::string::npos ? std::nullopt : find(numbers(), w.substr(dash + 1));
      if (w.empty() || !first || (dash != std::string::npos && !second)) break;
      value = first->factor == 100 && value > 0
                  ? value * 100
                  : value + first->factor + (second ? second->factor : 0);
    }
    // "one" alone is no number, "one metre" is.
    const bool measured = unitNamed(word(next)) || word(next) == "per";
    if (next == at_ || (value == 1 && !measured)) return false;
    Token t = in_[at_];
    t.kind = Token::Kind::kNumber;
    t.word.clear();
    t.number = value;
    store(t, next);
    return true;
  }
  /// "half a metre", "a quarter of a metre", "a quarter turn".
  bool part() {
    size_t i = at_;
    if (word(i) == "a" && find(shares(), word(i + 1))) ++i;
    // "a metre"
    if (word(i) == "a" && isLength({Token::Kind::kNumber, word(i + 1), 1, {}, 1})) {
      Token t = in_[at_];
      t.kind = Token::Kind::kNumber;
      t.word.clear();
      t.number = 1;
      store(t, i + 1);
      return true;
    }
    const auto share = find(shares(), word(i));
    if (!share) return false;
    ++i;
    if (word(i) == "of") ++i;
    if (word(i) == "a" || word(i) == "an") ++i;
    Token t = in_[at_];
    t.kind = Token::Kind::kNumber;
    const Unit* u = unitNamed(word(i));
    if (word(i) == "turn") {
      t.word = "deg";
      t.number = share->factor * 360 * kDegree;
    } else if (u && !u->name.starts_with("percent")) {
      t.word = u->name;
      t.number = share->factor * u->factor;
    } else {
      return false;
    }
    store(t, i + 1);
    return true;
  }

  std::vector<Token> in_, out_;
  size_t at_ = 0;
};

}  // namespace

std::vector<Token> tokensOf(const std::string& text) {
  return NumberWords(Scanner(text).all()).read();
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
  for (const auto& entry : robot.limbs) {
    const std::string& limb = entry.first;
    const std::vector<std::string>& chain = entry.second;
    const auto of_side = [&](const std::string& s, const char* which) {
      return (side.empty() || side == which) && limb == fmt::format("{}_{}", which, s);
    };
    const bool fits = std::ranges::any_of(stems, [&](const std::string& s) {
      return (side.empty() && limb == s) || of_side(s, "left") || of_side(s, "right");
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

std::vector<std::string> Interpreter::bodiesOf(const std::vector<std::string>& joints) const {
  std::vector<std::string> bodies;
  for (const std::string& word : joints) {
    for (const sim::SignedJoint& j : model_->robot()->jointsNamed(word)) {
      const std::string body = model_->bodyName(model_->bodyOf(model_->joint(j.joint)));
      if (std::ranges::find(bodies, body) == bodies.end()) bodies.push_back(body);
    }
  }
  return bodies;
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
  const Slots slots = Sorter(*this, surfaces_, vocabulary()).sort(tokens);
  Instruction i = Maker(slots, *this, *model_, axes_, readings_).make();
  i.said = text;
  return i;
}

std::vector<std::string> Interpreter::vocabulary() const {
  std::vector<std::string> known = surfaces_;
  for (const VerbRow& r : verbs()) known.emplace_back(r.words);
  for (const DirectionRow& r : directions()) known.emplace_back(r.words);
  for (const PartRow& r : parts()) known.emplace_back(r.words);
  for (const auto& [name, bodies] : model_->robot()->bodies) known.push_back(name);
  for (const auto& [name, pair] : model_->robot()->mirrored) known.push_back(name);
  return known;
}

}  // namespace traceur::coach
