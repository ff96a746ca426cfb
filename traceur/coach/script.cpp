#include "traceur/coach/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>

#include "traceur/coach/opposites.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/skill/skill.h"

namespace traceur::coach {
namespace {

constexpr size_t kLargest = 64 * 1024;  // bytes of a script: a thousand instructions [ours]

std::string lowered(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

Said trimmed(Said p) {
  const auto space = [](unsigned char c) { return std::isspace(c) != 0; };
  while (!p.text.empty() && space(static_cast<unsigned char>(p.text.front()))) {
    p.text.erase(0, 1);
    ++p.column;
  }
  while (!p.text.empty() && space(static_cast<unsigned char>(p.text.back()))) p.text.pop_back();
  return p;
}

/// What stands under one heading.
struct Section {
  Said heading;
  std::vector<Said> lines;
};

/// "Leaning: MOVE downward BY 0.1m; BALANCE" and the lines below it.
std::vector<Section> sectionsOf(const std::string& text, Diagnostics& wrong) {
  std::vector<Section> sections;
  int line = 0;
  for (std::string whole : split(text + "\n", '\n')) {
    ++line;
    if (const size_t c = whole.find('#'); c != std::string::npos) whole.resize(c);
    Said rest{whole, line, 1};
    if (const size_t colon = whole.find(':'); colon != std::string::npos) {
      sections.push_back({trimmed({whole.substr(0, colon), line, 1}), {}});
      rest = {whole.substr(colon + 1), line, static_cast<int>(colon) + 2};
    }
    int column = rest.column;
    for (const std::string& part : split(rest.text, ';')) {
      const Said p = trimmed({part, line, column});
      column += static_cast<int>(part.size()) + 1;
      if (p.text.empty()) continue;
      if (sections.empty()) {
        wrong.add(p.line, p.column,
                  fmt::format("\"{}\" stands before any heading: expected a phase, as \"Leaning:\"",
                              p.text));
        continue;
      }
      sections.back().lines.push_back(p);
    }
  }
  return sections;
}

class Reader {
 public:
  Reader(const std::string& text, const std::filesystem::path& file)
      : wrong_(file.string()), sections_(sectionsOf(text, wrong_)) {
    script_.text = text;
    script_.file = file;
    script_.name = file.stem().string();
  }

  Script read() {
    for (const Section& s : sections_) setting(s);
    if (script_.robot.empty()) {
      wrong_.add(0, 0, "no robot: expected a line as \"Robot: athlete\"");
    }
    wrong_.throwIfAny();
    const auto file = skill::findRobot(script_.robot, script_.file.parent_path());
    // What is compiled stands elsewhere: from there it is to be found, too.
    if (script_.robot.find_first_of("./") != std::string::npos || !foundAnywhere(script_.robot)) {
      script_.robot = std::filesystem::absolute(file).string();
    }
    const auto robot = std::make_shared<sim::Robot>(sim::Robot::fromFile(file));
    script_.model = sim::Model::fromScene({.robot = robot});
    if (!robot->poses.contains(script_.start) && script_.start != "zero") {
      wrong_.add(start_line_, start_column_, unknownPose(script_.start));
    }
    std::vector<std::string> surfaces;
    for (const SceneBox& b : script_.boxes) surfaces.push_back(b.name);
    for (const SceneWall& w : script_.walls) surfaces.push_back(w.name);
    interpreter_.emplace(*script_.model, script_.axes, script_.readings, surfaces);
    for (const Section& s : sections_) phase(s);
    for (const Section& s : sections_) all(s);
    for (Phase& p : script_.phases) {
      p.instructions.insert(p.instructions.begin(), of_all_.begin(), of_all_.end());
      noteOpposed(p);
    }
    if (script_.phases.empty() && wrong_.empty()) {
      wrong_.add(0, 0, fmt::format("no phase: expected one of {}", kindNames()));
    }
    wrong_.throwIfAny();
    return std::move(script_);
  }

 private:
  /// Whether a robot has this name wherever one asks, not only beside the script.
  static bool foundAnywhere(const std::string& robot) {
    try {
      skill::findRobot(robot, {});
      return true;
    } catch (const InputError&) {
      return false;
    }
  }
  static std::string kindNames() {
    std::vector<std::string> names;
    for (const PhaseKind& k : phaseKinds()) names.emplace_back(k.name);
    return join(names);
  }
  std::string unknownPose(const std::string& name) const {
    std::vector<std::string> names;
    for (const auto& [pose, angles] : script_.model->robot()->poses) names.push_back(pose);
    return fmt::format("no pose \"{}\" of {}: expected one of {}.{}", name, script_.robot,
                       join(names), didYouMean(name, names));
  }
  static bool isSetting(const std::string& heading) {
    return heading == "robot" || heading == "axes" || heading == "start" || heading == "scene" ||
           heading == "name" || heading == "readings" || heading == "budget";
  }

  void setting(const Section& s) {
    const std::string heading = lowered(s.heading.text);
    if (!isSetting(heading)) return;
    if (heading == "scene") return scene(s);
    if (s.lines.size() != 1) {
      wrong_.add(s.heading.line, s.heading.column,
                 fmt::format("\"{}\": expected one thing behind it", s.heading.text));
      return;
    }
    const Said& value = s.lines[0];
    const std::string low = lowered(value.text);
    if (heading == "robot") script_.robot = value.text;
    if (heading == "name") script_.name = value.text;
    if (heading == "start") {
      script_.start = value.text;
      start_line_ = value.line;
      start_column_ = value.column;
    }
    if (heading == "axes") {
      if (low == "x forward, y up" || low == "published") {
        script_.axes = Axes::kPublished;
      } else if (low == "x forward, z up" || low == "world") {
        script_.axes = Axes::kWorld;
      } else {
        wrong_.add(value.line, value.column,
                   fmt::format("axes \"{}\": expected \"x forward, y up\" (the dissertation's) or "
                               "\"x forward, z up\" (Traceur's)",
                               value.text));
      }
    }
    if (heading == "budget") budget(value);
    if (heading == "readings") {
      if (low == "literal") {
        script_.readings = Readings::kLiteral;
      } else if (low != "ours") {
        wrong_.add(value.line, value.column,
                   fmt::format("readings \"{}\": expected \"ours\" or \"literal\"", value.text));
      }
    }
  }

  void budget(const Said& value) {
    static constexpr int kMost = 1'000'000;
    const char* const end = value.text.data() + value.text.size();
    const auto read = std::from_chars(value.text.data(), end, script_.budget);
    const bool all = read.ec == std::errc() && read.ptr == end;
    if (all && script_.budget >= 1 && script_.budget <= kMost) return;
    wrong_.add(value.line, value.column,
               fmt::format("budget \"{}\": expected a whole number of trials from 1 to {}, for "
                           "each number that practice moves",
                           value.text, kMost));
  }

  /// "box vault SIZE [0.4, 0.55, 3] AT [1.2, 0.275, 0]", "floor none", "floor friction 0.8".
  void scene(const Section& s) {
    for (const Said& p : s.lines) {
      try {
        sceneLine(tokensOf(p.text), p);
        script_.scene.push_back(p);
      } catch (const Misunderstanding& m) {
        wrong_.add(p.line, p.column + m.column - 1, m.reason);
      }
    }
  }
  void sceneLine(const std::vector<Token>& t, const Said& p) {
    const auto word = [&](size_t i) { return i < t.size() ? t[i].word : ""; };
    const auto vector = [&](size_t i) -> Vector3d {
      if (i >= t.size() || t[i].kind != Token::Kind::kVector) {
        throw Misunderstanding{1, "expected a vector, as [0.4, 0.55, 3]"};
      }
      return toWorld(t[i].vector, script_.axes);
    };
    const std::string what = word(0);
    if (what == "floor" && word(1) == "none" && t.size() == 2) {
      script_.ground = false;
    } else if (what == "floor" && word(1) == "friction" && t.size() == 3 &&
               t[2].kind == Token::Kind::kNumber && t[2].number > 0) {
      script_.friction = t[2].number;
    } else if (what == "box" && t.size() == 6 && word(2) == "size" && word(4) == "at") {
      const Vector3d size = vector(3).cwiseAbs();
      if (size.minCoeff() <= 0) throw Misunderstanding{t[3].column, "a size is above 0"};
      script_.boxes.push_back({word(1), size, vector(5)});
    } else if (what == "wall" && t.size() == 4 && word(2) == "at") {
      script_.walls.push_back({word(1), vector(3)});
    } else {
      throw Misunderstanding{1, fmt::format("\"{}\": expected \"floor none\", \"floor friction "
                                            "0.8\", \"box NAME size [x, y, z] at [x, y, z]\" or "
                                            "\"wall NAME at [x, y, z]\"",
                                            p.text)};
    }
  }

  void phase(const Section& s) {
    const std::string heading = lowered(s.heading.text);
    if (isSetting(heading) || heading == "all") return;
    const auto kind = std::ranges::find_if(
        phaseKinds(), [&](const PhaseKind& k) { return heading.starts_with(k.name); });
    if (kind == phaseKinds().end()) {
      std::vector<std::string> names{"robot", "axes",     "start",  "scene",
                                     "name",  "readings", "budget", "all"};
      for (const PhaseKind& k : phaseKinds()) names.emplace_back(k.name);
      wrong_.add(s.heading.line, s.heading.column,
                 fmt::format("no phase \"{}\": expected one of {}.{}", s.heading.text, kindNames(),
                             didYouMean(heading, names)));
      return;
    }
    const bool plain = std::ranges::all_of(heading, [](unsigned char c) {
      return std::islower(c) || std::isdigit(c) || c == ' ' || c == '-';
    });
    if (!plain) {
      wrong_.add(
          s.heading.line, s.heading.column,
          fmt::format("phase \"{}\": expected letters, digits, spaces and '-'", s.heading.text));
      return;
    }
    if (std::ranges::find(script_.phases, heading, &Phase::name) != script_.phases.end()) {
      note(s.heading, fmt::format("\"{}\" is there already: these lines are added to it. A phase "
                                  "that comes again has a number, as \"{} 2\"",
                                  s.heading.text, s.heading.text));
    }
    if (kind->wall && script_.walls.empty()) {
      note(s.heading, fmt::format("\"{}\" is off a wall, and the Scene has none", s.heading.text));
    }
    Phase& phase = phaseNamed(heading, *kind);
    for (const Said& p : s.lines) {
      try {
        if (structure(phase, p)) {
          phase.settings.push_back(p);
        } else if (add(phase.instructions, p)) {
          ++script_.instructions;
        }
      } catch (const Misunderstanding& m) {
        wrong_.add(p.line, p.column + m.column - 1, m.reason);
      }
    }
  }
  /// What is asked of all phases is put before a phase's own instructions, which so replace it.
  void all(const Section& s) {
    if (lowered(s.heading.text) != "all") return;
    for (const Said& p : s.lines) {
      try {
        if (add(of_all_, p)) ++script_.instructions;
      } catch (const Misunderstanding& m) {
        wrong_.add(p.line, p.column + m.column - 1, m.reason);
      }
    }
  }
  Phase& phaseNamed(const std::string& name, const PhaseKind& kind) {
    const auto found = std::ranges::find(script_.phases, name, &Phase::name);
    if (found != script_.phases.end()) return *found;
    Phase p;
    p.name = name;
    p.kind = &kind;
    p.ending = kind.ending;
    p.longest = kind.longest;
    p.bears = kind.bears;
    p.pose.base = "previous";
    return script_.phases.emplace_back(p);
  }

  /// False where the same is said already.
  bool add(std::vector<Instruction>& to, const Said& p) {
    Instruction i = interpreter_->understand(p.text);
    i.line = p.line;
    i.column = p.column;
    if (std::ranges::find(to, i.means, &Instruction::means) != to.end()) {
      note(p, fmt::format("said twice: \"{}\"", i.means));
      return false;
    }
    to.push_back(std::move(i));
    return true;
  }
  void noteOpposed(const Phase& phase) {
    const auto& all = phase.instructions;
    for (size_t k = 0; k < all.size(); ++k) {
      for (size_t i = 0; i < k; ++i) {
        if (!opposed(all[i], all[k])) continue;
        note({all[k].said, all[k].line, all[k].column},
             fmt::format("\"{}\" opposes \"{}\" of line {}: a compromise is sought", all[k].said,
                         all[i].said, all[i].line));
      }
    }
  }
  void note(const Said& p, std::string text) {
    script_.notes.push_back({script_.file.string(), p.line, p.column, std::move(text)});
  }

  /// "POSE crouch, elbows 20 deg IN 0.3 s", "UNTIL COM leads BY 0.16 m", "FOR 0.3 s".
  bool structure(Phase& phase, const Said& p) {
    const std::vector<Token> t = tokensOf(p.text);
    if (t.empty() || t[0].kind != Token::Kind::kWord) return false;
    if (t[0].word == "pose") return pose(phase, t), true;
    if (t[0].word == "until") return until(phase, t), true;
    if (t[0].word == "within" && t.size() == 2 && t[1].word == "s") {
      phase.longest = positive(t[1]);
      return true;
    }
    if (t[0].word == "for" && t.size() == 2 && t[1].word == "s") {
      phase.ending = {Ending::Kind::kHeld, "", positive(t[1])};
      return true;
    }
    return false;
  }
  static bool isAngle(const Token& t) {
    return t.kind == Token::Kind::kNumber &&
           (t.word.starts_with("deg") || t.word == "rad" || t.word == "°");
  }
  static double positive(const Token& t) {
    if (t.kind != Token::Kind::kNumber || t.number <= 0) {
      throw Misunderstanding{t.column, "expected a number above 0"};
    }
    return t.number;
  }
  void pose(Phase& phase, const std::vector<Token>& t) {
    KeyPose& k = phase.pose;
    size_t i = 1;
    const auto& poses = script_.model->robot()->poses;
    if (i < t.size() && t[i].kind == Token::Kind::kWord &&
        (poses.contains(t[i].word) || t[i].word == "zero" || t[i].word == "previous")) {
      k.base = t[i++].word;
    }
    while (i < t.size()) {
      std::string words;
      const int column = t[i].column;
      while (i < t.size() && t[i].kind == Token::Kind::kWord && t[i].word != "in") {
        words += (words.empty() ? "" : " ") + t[i++].word;
      }
      if (words.empty() && i + 1 < t.size() && t[i].word == "in" && t[i + 1].word == "s") {
        k.blend = positive(t[i + 1]);
        i += 2;
        continue;
      }
      if (words.empty()) throw Misunderstanding{column, "expected a joint and an angle"};
      const auto joints = interpreter_->jointsOf(words);
      if (joints.size() != 1) {
        if (i >= t.size() && k.angles.empty()) throw Misunderstanding{column, unknownPose(words)};
        throw Misunderstanding{column, fmt::format("\"{}\" is no joint", words)};
      }
      k.angles.push_back(angle(t, i, joints[0], words, column));
    }
  }
  /// "20 deg", or "20 to 60 deg", which practice is to find.
  static KeyAngle angle(const std::vector<Token>& t, size_t& i, const std::string& joint,
                        const std::string& words, int column) {
    const bool range = i + 2 < t.size() && t[i].kind == Token::Kind::kNumber &&
                       t[i + 1].kind == Token::Kind::kWord && t[i + 1].word == "to" &&
                       isAngle(t[i + 2]) && (isAngle(t[i]) || t[i].word.empty());
    if (!range && (i >= t.size() || !isAngle(t[i]))) {
      throw Misunderstanding{
          column, fmt::format("\"{}\": expected an angle, as 20 deg, or as 20 to 60 deg", words)};
    }
    if (!range) return {joint, t[i++].number};
    const Token& last = t[i + 2];
    const bool degrees = t[i].word.empty() && last.word != "rad";
    const double first = t[i].number * (degrees ? std::numbers::pi / 180 : 1);
    if (first >= last.number) {
      throw Misunderstanding{t[i].column, "expected the smaller angle first, as 20 to 60 deg"};
    }
    i += 3;
    return {joint, (first + last.number) / 2, (last.number - first) / 2};
  }
  void until(Phase& phase, const std::vector<Token>& t) {
    const auto expected = [&] {
      return Misunderstanding{
          t[0].column,
          "expected \"UNTIL COM leads BY 0.16 m\", \"UNTIL feet leave\", \"UNTIL "
          "hands touch\", \"UNTIL root turns BY 260 deg\" or \"UNTIL 0.3 s\""};
    };
    if (t.size() == 2 && t[1].kind == Token::Kind::kNumber && t[1].word == "s") {
      phase.ending = {Ending::Kind::kAfter, "", positive(t[1])};
      return;
    }
    if (t.size() == 5 && t[1].word == "com" && t[2].word == "leads" && t[3].word == "by" &&
        t[4].kind == Token::Kind::kNumber && (t[4].word == "m" || t[4].word == "cm")) {
      phase.ending = {Ending::Kind::kComLeads,
                      phase.bears.empty() ? "feet" : std::string(phase.bears), t[4].number};
      return;
    }
    if (t.size() == 5 && t[1].word == "root" && t[2].word == "turns" && t[3].word == "by" &&
        isAngle(t[4])) {
      phase.ending = {Ending::Kind::kTurned, "", positive(t[4])};
      return;
    }
    if (t.size() == 3 && (t[2].word == "leave" || t[2].word == "touch")) {
      const auto thing = interpreter_->thing(t[1].word);
      if (!thing || thing->kind != Thing::Kind::kBody) throw expected();
      phase.ending = {t[2].word == "leave" ? Ending::Kind::kLeave : Ending::Kind::kTouch,
                      thing->name, 0};
      return;
    }
    throw expected();
  }

  Diagnostics wrong_;
  std::vector<Section> sections_;
  Script script_;
  std::optional<Interpreter> interpreter_;
  int start_line_ = 0, start_column_ = 0;
  std::vector<Instruction> of_all_;
};

}  // namespace

const std::vector<PhaseKind>& phaseKinds() {
  using K = Ending::Kind;
  // longest: [ours], twice to three times what the phases of a jump take. stiffness: the motors are
  // not at their limits then, and a virtual force still counts [ours].
  static const std::vector<PhaseKind> kKinds{
      {.name = "leaning",
       .help = "The body sinks and leans until the COM is ahead of the feet.",
       .ending = {K::kComLeads, "feet", 0.16},
       .blend = 0.3,
       .bears = "feet"},
      {.name = "thrusting",
       .help = "The legs push until the feet leave.",
       .ending = {K::kLeave, "feet", 0},
       .longest = 0.6,
       .blend = 0.02,
       .stiffness = 0.35,
       .damping = 0.3,
       .bears = "feet"},
      {.name = "airborne",
       .help = "It flies until the feet touch.",
       .ending = {K::kTouch, "feet", 0},
       .damping = 0.5},
      {.name = "landing",
       .help = "The legs give, and it comes to stand.",
       .ending = {K::kHeld, "", 3.5},
       .bears = "feet"},
      {.name = "pushing",
       .help = "The hands push until they leave.",
       .ending = {K::kLeave, "hands", 0},
       .longest = 1,
       .blend = 0.05,
       .bears = "hands"},
      {.name = "extending",
       .help = "The body opens until the feet touch.",
       .ending = {K::kTouch, "feet", 0},
       .damping = 0.5},
      {.name = "kicking",
       .help = "The feet push off a wall until they leave.",
       .ending = {K::kLeave, "feet", 0},
       .longest = 0.8,
       .blend = 0.02,
       .stiffness = 0.35,
       .damping = 0.3,
       .bears = "feet",
       .wall = true},
      {.name = "flipping",
       .help = "It turns in the air until the feet touch.",
       .ending = {K::kTouch, "feet", 0},
       .longest = 2,
       .damping = 0.5},
      {.name = "rolling",
       .help = "It turns over its back.",
       .ending = {K::kTurned, "", 4.9},
       .blend = 0.1},
      {.name = "gathering",
       .help = "The feet come under it until they bear it.",
       .ending = {K::kComLeads, "feet", -0.1},
       .longest = 1,
       .stiffness = 0.4,
       .damping = 0.4},
      {.name = "follow-through", .help = "It goes on as it is.", .ending = {K::kHeld, "", 2.0}},
  };
  return kKinds;
}

Script Script::fromText(const std::string& text, const std::filesystem::path& file) {
  if (text.size() > kLargest) {
    throw InputError(fmt::format("{}: {} bytes are more than the {} a script may have",
                                 file.string(), text.size(), kLargest));
  }
  return Reader(text, file).read();
}

Script Script::fromFile(const std::filesystem::path& file) {
  return fromText(readFile(file), file);
}

std::string withLine(const std::string& text, const std::string& phase, const std::string& line) {
  std::vector<std::string> lines = split(text, '\n');
  std::vector<std::string> headings;
  std::optional<size_t> last;  // of the phase's lines
  bool inside = false;
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string code = lines[i].substr(0, lines[i].find('#'));
    const size_t colon = code.find(':');
    if (colon != std::string::npos) {
      const std::string heading = lowered(trimmed({code.substr(0, colon)}).text);
      headings.push_back(heading);
      inside = heading == lowered(phase);
    }
    if (inside && !trimmed({code}).text.empty()) last = i;
  }
  if (!last) {
    throw InputError(
        fmt::format("the script has no \"{}:\"{}", phase, didYouMean(phase, headings)));
  }
  lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(*last) + 1, "  " + line);
  return join(lines, "\n");
}

std::string withInstead(const std::string& text, const Said& said, const std::string& words) {
  std::vector<std::string> lines = split(text, '\n');
  std::string& line = lines.at(static_cast<size_t>(said.line) - 1);
  line.replace(static_cast<size_t>(said.column) - 1, said.text.size(), words);
  return join(lines, "\n");
}

}  // namespace traceur::coach
