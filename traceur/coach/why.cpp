#include "traceur/coach/why.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <regex>

#include "traceur/coach/opposites.h"
#include "traceur/core/error.h"
#include "traceur/core/gravity.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"

namespace traceur::coach {
namespace {

// Ours: learned scripts' feet slide by up to 0.02 m while they lean and push off a dry floor, by
// 0.1 m off a wall, by 0.14 m while they come to stand. On a floor that is said to be slippery less
// is telling.
constexpr double kSlide = 0.12, kSlideLanding = 0.25;  // m
constexpr double kSlippery = 0.5;                      // coefficient of friction
constexpr double kSlideOnSlippery = 0.03, kSlideLandingOnSlippery = 0.15;  // m

/// Where the body was when the best trial ended.

class BestTrial {
 public:
  explicit BestTrial(const PhaseLesson& p) : p_(p) {}

  std::optional<double> term(std::string_view name) const {
    const auto found = std::ranges::find(p_.terms, name, &practice::Quantity::name);
    if (found == p_.terms.end() || !std::isfinite(found->value)) return {};
    return found->value;
  }
  /// How far what bears it slid [m].
  double slid() const { return measure("why_slid").value_or(0); }
  /// Whether that is more than a body does that pushes and lands well.
  bool slides(double friction) const {
    const bool slippery = friction < kSlippery;
    if (p_.phase.starts_with("landing"))
      return slid() > (slippery ? kSlideLandingOnSlippery : kSlideLanding);
    return slid() > (slippery ? kSlideOnSlippery : kSlide);
  }

  std::optional<double> measure(std::string_view name) const {
    const auto found = std::ranges::find(p_.measures, name, &practice::Quantity::name);
    if (found == p_.measures.end() || !std::isfinite(found->value)) return {};
    return found->value;
  }
  double leaning() const { return measure("why_trunk").value_or(0) * 180 / std::numbers::pi; }
  /// Of the COM ahead of the feet [m].
  double lead() const { return measure("why_lead").value_or(0); }
  std::string trunk() const {
    return fmt::format("the trunk leaning {:.0f} deg {}", std::abs(leaning()),
                       leaning() < 0 ? "backward" : "forward");
  }
  std::string com() const {
    return fmt::format("the COM {:.2f} m {} the feet", std::abs(lead()),
                       lead() < 0 ? "behind" : "ahead of");
  }
  /// What touches that should not.
  std::string touching() const {
    std::vector<std::string> parts;
    for (const practice::Quantity& q : p_.measures) {
      if (q.name.starts_with("why_on_") && q.value > 0) parts.push_back(q.name.substr(7));
    }
    return parts.empty() ? "something but what may" : join(parts, " and ");
  }

 private:
  const PhaseLesson& p_;
};

std::string whatHappened(const PhaseLesson& p, const BestTrial& e) {
  const std::string when = fmt::format("{:.2f} s into {}", p.time, p.phase);
  if (p.ended == "touches") {
    return fmt::format("{} touch{} {}, {}", e.touching(), e.touching().ends_with("s") ? "" : "es",
                       when, e.trunk());
  }
  if (p.ended == "hops") return fmt::format("a foot comes off or slides {}, {}", when, e.com());
  if (p.ended == "falls_backward") return fmt::format("it falls backward {}, {}", when, e.com());
  if (p.ended == "falls_forward") return fmt::format("it falls forward {}, {}", when, e.com());
  if (p.ended == "late")
    return fmt::format("{} never ends: after {:.1f} s, {}", p.phase, p.time, e.com());
  int relations = 0;
  for (const Reading& r : p.readings) {
    // The compiler counts them in this order.
    if (!r.constraint.empty() && p.ended == fmt::format("not_{}", ++relations)) {
      const auto by = e.measure("by_" + p.ended);
      return fmt::format("\"{}\" does not hold at the end{}", r.means,
                         by ? fmt::format(": missed by {:.2g}", *by) : "");
    }
  }
  return fmt::format("{} ended with \"{}\" {}", p.phase, p.ended, when);
}

std::string howOften(const PhaseLesson& p) {
  int failed = 0;
  std::vector<std::string> ways;
  for (const auto& [name, count] : p.failures) {
    failed += count;
    if (count > 0) ways.push_back(fmt::format("{} {}", count, name));
  }
  return fmt::format("{} of {} trials failed: {}", failed, p.trials, join(ways));
}

// What might help ---------------------------------------------------------------------------------

// Ours: a time that is long for a pose, and a share of what is asked for that is not met.
constexpr double kSlowPose = 0.35;  // s
constexpr double kUnmet = 0.3;
// Of a rank: a phase further back is less likely, one after that in which it goes wrong much less.
constexpr double kPhaseAway = 0.3, kAfterwards = 3;
/// Beyond this lead of the COM practice calls it a fall, so nobody can wait for it.
constexpr double kFurthestLead = 0.45;  // m
/// Nobody takes off faster: that would be 1.3 m up [ours].
constexpr double kFastest = 5;  // m/s
/// What the shipped jumps take off with.
constexpr double kUsual = 2.7;  // m/s
/// Where a body leans to that is going to push off: so far, and further the flatter it pushes
/// [ours: what the shipped scripts lean, from the turn on the spot to the roll, within 0.03 m].
constexpr double kLead = 0.03, kLeadBySlope = 0.2, kFlattestSlope = 1.3;  // m, m, 1

/// A text's numbers, each times its factor, the last one with the last factor.
std::string scaled(const std::string& text, const std::vector<double>& factors) {
  static const std::regex kNumber(R"((^|[\[ ,])(-?[0-9]+\.?[0-9]*))");
  std::vector<std::pair<size_t, size_t>> found;
  for (auto m = std::sregex_iterator(text.begin(), text.end(), kNumber);
       m != std::sregex_iterator(); ++m) {
    found.emplace_back(m->position(2), m->length(2));
  }
  std::string out = text;
  const size_t count = std::min(found.size(), factors.size());
  for (size_t i = 0; i < count; ++i) {  // from behind, so that places keep
    const auto [at, length] = found[found.size() - 1 - i];
    const double value = std::stod(text.substr(at, length)) * factors[factors.size() - 1 - i];
    out.replace(at, length, fmt::format("{:.3g}", value == 0 ? 0.0 : value));
  }
  return out;
}

/// All that might be said otherwise, of a script whose last practised phase failed.
class Candidates {
 public:
  Candidates(const Script& script, const Lesson& lesson) : script_(script), lesson_(lesson) {
    const size_t failed = lesson.phases.size() - 1;
    size_t culprit = 0;
    while (culprit < failed && !doesBadly(culprit)) ++culprit;
    for (size_t k = 0; k <= failed; ++k) {
      now_ = k;
      far_ = k > culprit ? kAfterwards : kPhaseAway * static_cast<double>(culprit - k);
      const Phase& phase = script.phases[k];
      contradictions(phase);
      for (const Instruction& i : phase.instructions) instruction(i);
      for (const Said& s : phase.settings) setting(s);
      if (slides()) floor();
      if (phase.ending.kind == Ending::Kind::kTouch && last()) nearerSurfaces();
    }
    std::ranges::stable_sort(found_, {}, &Remedy::rank);
  }
  std::vector<Remedy> take() { return std::move(found_); }

 private:
  bool last() const { return now_ + 1 == lesson_.phases.size(); }
  /// A phase that was learned, but hardly does what it is asked for: from there on it goes wrong.
  bool doesBadly(size_t k) const {
    double most = 0;
    for (const Instruction& i : script_.phases[k].instructions) {
      if (i.form == Form::kSpeed) most = std::max(most, kUnmet * i.velocity.norm());
    }
    const BestTrial e(lesson_.phases[k]);
    const bool misplaced = !script_.phases[k].bears.empty() && e.term("COM").value_or(0) > 0.15;
    return misplaced || e.term("speed").value_or(0) > std::max(most, 0.3);
  }
  const PhaseLesson& phase() const { return lesson_.phases[now_]; }
  bool slides() const { return BestTrial(phase()).slides(script_.friction); }
  /// @param rank  0: most likely; a phase further back is less likely than a nearer one
  void add(Fault against, double rank, Said instead_of, std::string say) {
    // What is asked of all phases is not the phase's.
    size_t from = now_;
    for (size_t k = 0; k < now_; ++k) {
      for (const Instruction& i : script_.phases[k].instructions) {
        if (i.line == instead_of.line && i.column == instead_of.column) from = std::min(from, k);
      }
    }
    found_.push_back({against, script_.phases[now_].name, std::move(instead_of), std::move(say),
                      from, rank + far_});
  }
  void instead(Fault against, double rank, const Instruction& i, const std::string& say) {
    add(against, rank, {i.said, i.line, i.column}, say);
  }

  void contradictions(const Phase& phase) {
    const auto& all = phase.instructions;
    for (size_t k = 0; k < all.size(); ++k) {
      for (size_t i = 0; i < k; ++i) {
        if (!opposed(all[i], all[k])) continue;
        instead(Fault::kContradiction, 0, all[k], "");
        instead(Fault::kContradiction, 0.5, all[i], "");
      }
    }
  }

  /// What a relation of this phase missed its number by; nothing: it held.
  std::optional<double> missedBy(const Instruction& i) const {
    // Of a trial that failed before its end, only by much.
    const double least =
        phase().ended.starts_with("not_") || !i.other ? 0 : kUnmet * std::abs(i.other->number);
    int relations = 0;
    for (const Reading& r : phase().readings) {
      if (r.constraint.empty()) continue;
      ++relations;
      if (r.line != i.line || r.means != i.means) continue;
      const auto by = BestTrial(phase()).measure(fmt::format("by_not_{}", relations));
      if (by && *by > least) return by;
    }
    return {};
  }

  void instruction(const Instruction& i) {
    switch (i.form) {
      case Form::kSpeed:
        return speed(i);
      case Form::kMomentum:
      case Form::kTurn:
        if (i.amount >= 1) return instead(Fault::kTooStrong, 3, i, "");
        return instead(Fault::kTooWeak, fliesShort() ? 0.9 : 3, i, "");
      case Form::kRelation:
        return relation(i);
      case Form::kMove:
      case Form::kTranslate:
      case Form::kRotate: {
        const bool unmet = unmetPlace(i);
        instead(Fault::kOutOfReach, unmet ? 2 : 8, i, scaled(i.means, {0.5}));
        if (unmet) instead(Fault::kOutOfReach, 2.5, i, scaled(i.means, {0.25}));
        return;
      }
      case Form::kPlace:
        return place(i);
      default:
        return;
    }
  }
  /// Whether the COM, or what is placed, did not come where it was to; of a failed phase's best
  /// trial nobody knows.
  bool unmetPlace(const Instruction& i) const {
    if (last()) return false;
    const bool com = i.form == Form::kMove || (i.subject && i.subject->kind == Thing::Kind::kCom);
    const auto missed = BestTrial(phase()).term(com ? "COM" : i.means);
    return missed && *missed > 0.12;
  }
  /// Whether the flight after this phase did not bring something where it was to: in the air only
  /// the take-off counts.
  bool fliesShort() const {
    for (size_t k = now_ + 1; k + 1 < lesson_.phases.size(); ++k) {
      if (!script_.phases[k].bears.empty()) return false;
      for (const practice::Quantity& q : lesson_.phases[k].terms) {
        if ((q.name == "COM" || q.name.starts_with("PLACE")) && q.value > 0.12) return true;
      }
    }
    return false;
  }
  /// How many times as fast a point would fly as far as the feet are to come down: its range is
  /// 2 v_x v_z / g. 0: nothing is asked for, or there is no such flight.
  double forTheDistance(const Instruction& speed) const {
    const double product = speed.velocity.head<2>().norm() * speed.velocity.z();
    if (product <= 0) return 0;
    for (size_t k = now_ + 1; k < script_.phases.size() && script_.phases[k].bears.empty(); ++k) {
      for (const Instruction& i : script_.phases[k].instructions) {
        if (i.form != Form::kPlace || i.subject->name != "feet" ||
            i.other->kind != Thing::Kind::kPlace)
          continue;
        const double distance = i.other->vector.head<2>().norm();
        if (distance < 0.3) return 0;  // m; a jump on the spot
        return std::min(std::sqrt(kGravity * distance / 2 / product), 12.0);
      }
    }
    return 0;
  }
  void speed(const Instruction& i) {
    const size_t up = script_.axes == Axes::kPublished ? 1 : 2;
    const bool unmet = !last() && doesBadly(now_);
    const double fast = i.velocity.norm();
    if (fast > kFastest) {
      const double usual = kUsual / fast;
      instead(Fault::kOutOfReach, 0.8, i, scaled(i.means, {usual, usual, usual}));
      return instead(Fault::kOutOfReach, 0.9, i, "");
    }
    if (unmet) {
      instead(Fault::kOutOfReach, 2, i, scaled(i.means, {0.7, 0.7, 0.7}));
      instead(Fault::kOutOfReach, 2.5, i, scaled(i.means, {0.5, 0.5, 0.5}));
      instead(Fault::kOutOfReach, 2.7, i, scaled(i.means, {0.25, 0.25, 0.25}));
    }
    std::vector<double> upward{0.5, 0.5, 0.5};
    upward[up] = 1.2;
    instead(slides() ? Fault::kSlips : Fault::kTooStrong, slides() ? 1 : 6, i,
            scaled(i.means, upward));
    // Under this it hardly leaves the ground: a flight of a quarter of a second [ours].
    const bool hardly = i.velocity.z() < 1.25 && !script_.phases[now_].bears.empty();
    if (const double faster = forTheDistance(i); faster > 1.2) {
      instead(Fault::kTooWeak, hardly || fliesShort() ? 0.8 : 2.5, i,
              scaled(i.means, {faster, faster, faster}));
    }
    const double weak = hardly || fliesShort() ? 1 : unmet ? 5 : 3;
    instead(Fault::kTooWeak, weak, i, scaled(i.means, {2, 2, 2}));
    instead(Fault::kTooWeak, weak + 0.2, i, scaled(i.means, {1.5, 1.5, 1.5}));
    if (hardly) instead(Fault::kTooWeak, weak + 0.4, i, scaled(i.means, {4, 4, 4}));
    if (!unmet) instead(Fault::kTooStrong, 5, i, scaled(i.means, {0.7, 0.7, 0.7}));
  }
  void relation(const Instruction& i) {
    const auto missed = last() ? missedBy(i) : std::nullopt;
    const bool number = i.other && i.other->kind == Thing::Kind::kNumber;
    if (number && i.other->number != 0) {
      const double asked = std::abs(i.other->number);
      if (missed) {
        // What was reached, and a little less; at least a tenth of what was asked.
        const double reached = std::max(0.1, 0.8 * (1 - *missed / asked));
        instead(Fault::kOutOfReach, 1.3, i, scaled(i.means, {reached}));
        instead(Fault::kOutOfReach, 1.5, i, scaled(i.means, {0.25}));
        instead(Fault::kOutOfReach, 2, i, scaled(i.means, {0.5 * reached}));
      } else {
        instead(Fault::kTooWeak, 5, i, scaled(i.means, {1.5}));
        instead(Fault::kTooStrong, 6, i, scaled(i.means, {0.6}));
      }
    }
    instead(missed ? Fault::kOutOfReach : Fault::kUnknown, missed ? 3 : 10, i, "");
  }
  void place(const Instruction& i) {
    if (!i.other || i.other->kind != Thing::Kind::kPlace) return;
    const size_t up = script_.axes == Axes::kPublished ? 1 : 2;
    const auto nearer = [&](double by) {
      std::vector<double> factors{by, by, by};
      factors[up] = 1;
      return scaled(i.means, factors);
    };
    const double away = i.other->vector.head<2>().norm();
    if (i.subject && i.subject->kind == Thing::Kind::kCom && away > kFurthestLead &&
        script_.phases[now_].bears == "feet" && now_ == 0) {
      // Nobody who stands leans that far.
      instead(Fault::kOutOfReach, 0.8, i, nearer(kLead / away));
      instead(Fault::kOutOfReach, 0.9, i, nearer(0.25));
    }
    const bool unmet = unmetPlace(i);
    instead(Fault::kOutOfReach, unmet ? 2 : 8, i, nearer(0.5));
    instead(Fault::kOutOfReach, unmet ? 2.5 : 9, i, nearer(0.3));
  }

  void setting(const Said& s) {
    const Phase& phase = script_.phases[now_];
    const std::string& text = s.text;
    const auto words = [&](std::string_view word) {
      return text.size() >= word.size() &&
             std::ranges::equal(text.substr(0, word.size()), word, {},
                                [](unsigned char c) { return std::tolower(c); });
    };
    if (words("within")) {
      add(Fault::kTooEarly, last() && lesson_.phases.back().ended == "late" ? 2 : 9, s,
          scaled(text, {2}));
    } else if (words("until")) {
      until(phase, s);
      leads(phase, s);
    } else if (words("pose") && phase.pose.blend >= kSlowPose) {
      const auto sooner = [&](double blend) {
        static const std::regex kIn(R"(\b([Ii][Nn]) +[0-9.]+ *s\b)");
        return std::regex_replace(text, kIn, fmt::format("$1 {:.2g} s", blend));
      };
      add(Fault::kTooLate, 2, s, sooner(0.1));
      add(Fault::kTooLate, 4, s, sooner(0.25));
    }
  }
  void until(const Phase& phase, const Said& s) {
    const std::string& ended = lesson_.phases.back().ended;
    using K = Ending::Kind;
    const K kind = phase.ending.kind;
    if (kind == K::kLeave || kind == K::kTouch) return;
    const bool leads = kind == K::kComLeads;
    // The phase never came to its end.
    const bool here = last() && !ended.starts_with("not_");
    const bool never = leads && phase.ending.amount > kFurthestLead;
    const Fault sooner = never ? Fault::kOutOfReach : Fault::kTooLate;
    const double amount = phase.ending.amount;
    if (amount > 0) {
      // Longer than a lean takes, or further than it goes, where scripts that are learned end one.
      const bool far = here || (leads && amount > 0.25) ||
                       (kind == K::kAfter && amount > 0.7 && !phase.bears.empty());
      const double rank = far ? 1.2 : 4;
      add(sooner, rank, s, scaled(s.text, {0.5}));
      add(sooner, rank + 0.2, s, scaled(s.text, {0.25}));
      add(sooner, rank + (kind == K::kTurned ? -0.1 : 0.4), s, scaled(s.text, {0.8}));
      if (!here) add(Fault::kTooEarly, 8, s, scaled(s.text, {1.4}));
      if (phase.kind->ending.kind != kind) add(sooner, rank + 0.3, s, "");  // it ends as usual
    } else {
      add(sooner, here ? 1.5 : 6, s, scaled(s.text, {2}));  // so far behind
      add(Fault::kTooEarly, 8, s, scaled(s.text, {0.5}));
    }
  }
  /// As far ahead as the push after it wants.
  void leads(const Phase& phase, const Said& s) {
    const double now = phase.ending.amount;
    const bool com_leads = phase.ending.kind == Ending::Kind::kComLeads && now != 0;
    if (!com_leads || now_ + 1 >= script_.phases.size()) return;
    for (const Instruction& i : script_.phases[now_ + 1].instructions) {
      if (i.form != Form::kSpeed || i.velocity.x() < 0 || i.velocity.z() <= 0) continue;
      const double slope = std::min(i.velocity.head<2>().norm() / i.velocity.z(), kFlattestSlope);
      const double lead = kLead + kLeadBySlope * slope;
      if (std::abs(now - lead) < 0.05) return;
      const Fault further = now > kFurthestLead ? Fault::kOutOfReach : Fault::kTooLate;
      add(now > lead ? further : Fault::kTooEarly, now > lead ? 1.1 : 3, s,
          scaled(s.text, {lead / now}));
      return;
    }
  }
  /// What it does not touch may stand too far away.
  void nearerSurfaces() {
    const size_t up = script_.axes == Axes::kPublished ? 1 : 2;
    for (const Said& s : script_.scene) {
      if (s.text.find(" at ") == std::string::npos) continue;
      for (const double by : {0.7, 0.5, 0.35}) {
        std::vector<double> factors{by, by, by};
        factors[up] = 1;
        add(Fault::kOutOfReach, 3 - by, s, scaled(s.text, factors));
        found_.back().from = 0;
        found_.back().phase = "scene";
      }
    }
  }
  void floor() {
    for (const Said& s : script_.scene) {
      if (s.text.find("friction") == std::string::npos || script_.friction >= kSlippery) continue;
      add(Fault::kSlips, 1.5, s, "floor friction 0.8");
      found_.back().from = 0;
      found_.back().phase = "scene";
    }
  }

  const Script& script_;
  const Lesson& lesson_;
  size_t now_ = 0;
  double far_ = 0;  // how much less likely this phase is
  std::vector<Remedy> found_;
};

/// What the script or the trials show of the cause.
std::pair<Fault, std::string> seen(const Script& script, const Lesson& lesson) {
  const size_t last = lesson.phases.size() - 1;
  const auto& asked = script.phases[last].instructions;
  for (size_t k = 0; k < asked.size(); ++k) {
    for (size_t i = 0; i < k; ++i) {
      if (!opposed(asked[i], asked[k])) continue;
      return {Fault::kContradiction,
              fmt::format("\"{}\" opposes \"{}\"", asked[k].said, asked[i].said)};
    }
  }
  for (size_t k = last + 1; k-- > 0;) {
    const BestTrial e(lesson.phases[k]);
    if (!e.slides(script.friction)) continue;
    return {Fault::kSlips, fmt::format("the {} slid {:.2f} m in {}", script.phases[k].bears,
                                       e.slid(), lesson.phases[k].phase)};
  }
  return {Fault::kUnknown, ""};
}

}  // namespace

std::string_view nameOf(Fault fault) {
  switch (fault) {
    case Fault::kTooWeak:
      return "too weak";
    case Fault::kTooStrong:
      return "too strong";
    case Fault::kTooLate:
      return "too late";
    case Fault::kTooEarly:
      return "too early";
    case Fault::kSlips:
      return "it slips";
    case Fault::kOutOfReach:
      return "out of reach";
    case Fault::kContradiction:
      return "a contradiction";
    case Fault::kUnknown:
      break;
  }
  return "not known";
}

Why why(const Script& script, const Lesson& lesson) {
  const PhaseLesson& p = lesson.phases.back();
  const BestTrial e(p);
  auto [fault, because] = seen(script, lesson);
  return {whatHappened(p, e),
          howOften(p),
          fault,
          std::move(because),
          lesson.phases.size() - 1,
          Candidates(script, lesson).take()};
}

std::string told(const Remedy& r) {
  if (r.say.empty()) return fmt::format("leave out \"{}\" of {}", r.instead_of.text, r.phase);
  if (r.instead_of.line == 0) return fmt::format("\"{}\" in {}", r.say, r.phase);
  return fmt::format("\"{}\" in {}, instead of \"{}\"", r.say, r.phase, r.instead_of.text);
}

Script withRemedy(const Script& script, const Remedy& r) {
  const std::string text = r.instead_of.line == 0 ? withLine(script.text, r.phase, r.say)
                                                  : withInstead(script.text, r.instead_of, r.say);
  return Script::fromText(text, script.file);
}

std::optional<Helps> whatHelps(const Script& script, const std::filesystem::path& folder,
                               const Why& why, const LessonOptions& options, int most,
                               const std::function<void(const Remedy&)>& on_try) {
  namespace fs = std::filesystem;
  const fs::path scratch = folder / "tried";
  LessonOptions o = options;
  o.resume = true;
  o.until_it_succeeds = true;
  Helps best{.remedy = {}, .learned = why.failed + 1};  // a phase more than there was
  std::optional<Helps> helps;
  for (size_t i = 0; i < why.remedies.size() && static_cast<int>(i) < most; ++i) {
    const Remedy& r = why.remedies[i];
    if (on_try) on_try(r);
    const Script changed = withRemedy(script, r);
    fs::remove_all(scratch);
    makeFolder(scratch);
    for (const auto& file : fs::directory_iterator(folder)) {
      const std::string name = file.path().filename().string();
      // What was learned before the change.
      const bool before = file.is_regular_file() &&
                          std::isdigit(static_cast<unsigned char>(name[0])) &&
                          static_cast<size_t>(std::stoi(name)) <= r.from;
      if (before) fs::copy_file(file.path(), scratch / name);
    }
    Lesson lesson;
    try {
      lesson = practise(changed, scratch, o);
    } catch (const InputError&) {
      continue;  // nobody can do that: a box that is moved into the robot
    }
    if (lesson.interrupted) break;
    const auto learned =
        static_cast<size_t>(std::ranges::count(lesson.phases, false, &PhaseLesson::failed));
    const bool all = !lesson.whole.empty() && !lesson.failed;
    if (all || learned > best.learned || (learned == best.learned && !helps)) {
      best = {r, learned, all};
      helps = best;
    }
    if (all) break;
  }
  fs::remove_all(scratch);
  return helps;
}

}  // namespace traceur::coach
