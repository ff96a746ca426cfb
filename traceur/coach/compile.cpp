#include "traceur/coach/compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

#include "traceur/coach/rigs.h"
#include "traceur/control/expression.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"

namespace traceur::coach {
namespace {

std::string num(double v) {
  return fmt::format("{:.6g}", std::abs(v) < 1e-12 ? 0.0 : v);
}

/// A text as TOML quotes it.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

/// The first lines of a skill file.
std::string heading(const Script& s, const std::string& of, const std::string& name,
                    double horizon) {
  return fmt::format("# {}: {}. Made from {}.\nname = {}\nrobot = {}\nhorizon = {}\n",
                     printable(s.name), of, printable(s.file.filename().string()), quoted(name),
                     quoted(s.robot), num(horizon));
}

/// A phase as skill text names it.
std::string identifier(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}

/// A signal as an expression names it, also of a body with odd letters.
std::string spelled(const std::string& signal) {
  return control::Expression::spelled(signal);
}

constexpr char kAxes[] = {'x', 'y', 'z'};

constexpr double kMargin = 0.05;  // m, of the COM inside the support polygon [ours]
constexpr double kCreep = 0.02;   // m, of the feet while it comes to stand [ours]
/// Spin that is wanted where a direction is asked for, so that the sign keeps when a joint is a
/// little stiffer [ours].
constexpr double kSpin = 0.3;  // rad/s
/// A radius of gyration: what a spin is in m/s, beside a velocity [ours].
constexpr double kRadius = 0.3;  // m

constexpr const char* kExactly = "set exactly, as its only parameter is what is asked";

/// Compiles one phase.
class Compiler {
 public:
  Compiler(const Script& script, size_t phase, const Before& before, double enough)
      : script_(script),
        enough_(enough),
        phase_(script.phases[phase]),
        name_(identifier(phase_.name)),
        before_(before),
        body_(script) {}

  CompiledPhase compile(const std::filesystem::path& previous) {
    pose();
    ending();
    whereItEnds();
    for (const Instruction& i : phase_.instructions) instruct(i);
    finish();
    PhaseDraft draft{name_, draft_, phaseText(), failures_, terms_};
    return {text(previous, draft), std::move(draft), std::move(readings_), stands() && twists()};
  }

 private:
  bool stands() const { return !phase_.bears.empty(); }
  bool held() const { return phase_.ending.kind == Ending::Kind::kHeld; }
  double horizon() const { return held() ? phase_.ending.amount : phase_.longest + 0.05; }

  // Measures ------------------------------------------------------------------------------------
  /// The name of a measure of that signal at the phase's end.
  std::string measure(const std::string& name, const std::string& of,
                      const std::string& take = "last", const std::string& more = "") {
    const std::string row =
        fmt::format("{} = {{ of = \"{}\", take = \"{}\"{} }}", name, of, take, more);
    if (std::ranges::find(draft_.measures, row) == draft_.measures.end()) {
      draft_.measures.push_back(row);
    }
    return name;
  }
  std::string com(int axis) {
    return measure(fmt::format("com_{}", kAxes[axis]), fmt::format("com.{}", kAxes[axis]));
  }
  std::string speed(int axis) {
    return measure(fmt::format("speed_{}", kAxes[axis]),
                   fmt::format("com_velocity.{}", kAxes[axis]));
  }
  std::string position(const Thing& t, int axis) {
    const char a = kAxes[axis];
    if (t.kind == Thing::Kind::kCom) return com(axis);
    if (t.kind == Thing::Kind::kCop)
      return measure(fmt::format("cop_{}", a), fmt::format("cop.{}", a));
    if (t.name.empty()) {
      return measure(fmt::format("{}_{}", identifier(t.said), a), body_.mean(t.bodies, a));
    }
    return measure(fmt::format("{}_{}", identifier(t.name), a),
                   spelled(fmt::format("body.{}.{}", t.name, a)));
  }
  /// Of a thing in the world's axes.
  std::string signal(const Thing& t, int axis) const {
    const char a = kAxes[axis];
    if (t.kind == Thing::Kind::kCom) return fmt::format("com.{}", a);
    if (t.kind == Thing::Kind::kCop) return fmt::format("cop.{}", a);
    if (t.kind == Thing::Kind::kPlace) return num(body_.origin[axis] * (axis < 2) + t.vector[axis]);
    if (t.name.empty()) return body_.mean(t.bodies, a);
    return spelled(fmt::format("body.{}.{}", t.name, a));
  }
  double before(const std::string& measure) const {
    const auto found = before_.find(measure);
    return found == before_.end() ? 0 : found->second;
  }

  // What every phase has -------------------------------------------------------------------------
  /// Key angles that are given as ranges are found by practice.
  void pose() {
    for (const KeyAngle& a : phase_.pose.angles) {
      if (a.spread == 0) continue;
      Reading r{.phase = phase_.name,
                .said = {},
                .means = fmt::format("POSE {} {:.3g} to {:.3g} deg", a.joint,
                                     degrees(a.angle - a.spread), degrees(a.angle + a.spread)),
                .line = 0,
                .rigs = {fmt::format("TargetJoints<{}>", a.joint)},
                .term = {},
                .constraint = {},
                .note = "found with the rest: nothing is asked of it"};
      readings_.push_back(std::move(r));
      draft_.parameters.push_back({poseNumber(a), "rad", a.angle - a.spread, a.angle + a.spread,
                                   a.angle, "Key angle of the pose."});
    }
  }
  static std::string poseNumber(const KeyAngle& a) { return "pose_" + identifier(a.joint); }
  static double degrees(double radians) { return radians * 180 / std::numbers::pi; }
  void ending() {
    const std::string& group = phase_.ending.group;
    switch (phase_.ending.kind) {
      case Ending::Kind::kComLeads:
        until_ =
            fmt::format("com.forward - body.{}.forward > {}", group, num(phase_.ending.amount));
        // What comes out of a roll has them in the air first.
        if (!stands()) until_ += fmt::format(" && contact.{} > 0", group);
        break;
      case Ending::Kind::kLeave:
        until_ = fmt::format("phase_time > 0.03 && contact.{0} == 0 && impulse.{0} == 0", group);
        break;
      case Ending::Kind::kTouch:
        until_ = fmt::format("phase_time > 0.1 && contact.{} > 0", group);
        break;
      case Ending::Kind::kTurned:
        until_ = fmt::format("abs(somersault.root) > {}", num(phase_.ending.amount));
        break;
      case Ending::Kind::kAfter:
        until_ = fmt::format("phase_time >= {}", num(phase_.ending.amount));
        break;
      case Ending::Kind::kHeld:
        break;
    }
    // Where the COM may be over the feet while they bear it [ours: further out nothing came back].
    if (phase_.bears == "feet" && !held() && !phase_.kind->wall) {
      fails("falls_backward", "com.forward - body.feet.forward < -0.15 && contact.feet > 0");
      fails("falls_forward", "com.forward - body.feet.forward > 0.45 && contact.feet > 0");
    }
    if (stands()) {
      // Out of a roll it rises from its seat.
      fails("touches", fmt::format("{}contact.robot > contact.{}",
                                   afterRoll() ? "phase_time > 0.4 && " : "", phase_.bears));
    } else if (phase_.ending.kind == Ending::Kind::kTouch) {
      fails("touches",
            fmt::format("phase_time > 0.1 && contact.robot > contact.{}", phase_.ending.group));
    }
    if (!held()) fails("late", fmt::format("phase_time >= {}", num(phase_.longest)));
    if (phase_.kind->name == "landing") {
      // After the first contact a foot that is all in the air, or slides, is a hop.
      std::vector<std::string> off;
      for (const std::string& sole : body_.soles) {
        std::vector<std::string> parts;
        for (const std::string& b : footOf(sole)) parts.push_back(spelled("contact." + b));
        off.push_back(join(parts, " + ") + " == 0");
      }
      std::string slides = "abs(body_velocity.feet.x) > 0.3";
      if (flightTwist() != 0) slides += " || abs(body_velocity.feet.y) > 0.3";
      fails("hops", fmt::format("phase_time > 0.5 && ({} || {})", join(off, " || "), slides));
    }
  }
  /// The bodies of the foot that this sole is of.
  std::vector<std::string> footOf(const std::string& sole) const {
    const sim::Robot& robot = *script_.model->robot();
    const auto& feet = robot.bodies.at("feet");
    for (const auto& [limb, chain] : robot.limbs) {
      if (std::ranges::find(chain, sole) == chain.end()) continue;
      std::vector<std::string> foot;
      for (const std::string& b : chain) {
        if (std::ranges::find(feet, b) != feet.end()) foot.push_back(b);
      }
      return foot;
    }
    return {sole};
  }
  /// What `why` tells a person of a trial's ending.
  void whereItEnds() {
    measure("why_trunk", "somersault.root");
    measure("why_lead", "com.forward - body.feet.forward");
    for (const auto& [group, bodies] : script_.model->robot()->bodies) {
      const bool within =
          group == "hands" || group == "forearms" || group == "trunk" || group == "head";
      if (within && group != phase_.bears)
        measure("why_on_" + group, fmt::format("contact.{}", group));
    }
    std::vector<std::string> knees;
    for (const auto& [limb, chain] : script_.model->robot()->limbs) {
      for (size_t i = 0; i < chain.size(); ++i) {
        if (std::ranges::find(body_.soles, chain[i]) == body_.soles.end()) continue;
        for (size_t k = 0; k < i; ++k) knees.push_back(spelled("contact." + chain[k]));
      }
    }
    measure("why_on_legs", join(knees, " + "));
    if (!stands()) return;
    std::vector<std::string> squares;
    for (const char axis : kAxes) {
      if (axis == 'z' && !phase_.kind->wall) continue;  // a heel comes up
      squares.push_back(spelled(fmt::format("body_velocity.{}.{}", phase_.bears, axis)) + "^2");
    }
    measure("why_slid", fmt::format("sqrt({})", join(squares, " + ")), "integral",
            fmt::format(", when = \"contact.{} > 0\"", phase_.bears));
  }
  void fails(const std::string& name, const std::string& when) {
    failures_.push_back({name, when});
  }
  /// A constraint at the phase's end: who violates it ranks after whom does not, the less the
  /// sooner.
  /// @param by  by how much it is violated; what is below 0 is not
  void must(const std::string& name, const std::string& by) {
    const std::string at_end = held() ? "phase_time >= " + num(horizon() - 0.01) : "ended." + name_;
    failures_.push_back({name, fmt::format("{} && {} > 0", at_end, by), true});
    term(name, fmt::format("{} * (1 + 3 * max(0, {}))", name, measure("by_" + name, by)));
  }
  void term(const std::string& name, const std::string& cost) { terms_.emplace_back(name, cost); }

  // Instructions ---------------------------------------------------------------------------------
  void rig(const char* name, const std::string& shown, RigUse use, Reading& r) {
    r.rigs.push_back(shown);
    const bool again = draft_.has(shown);
    // What is set exactly replaces what was set before, what is searched is there already.
    if (again && use.value == 0) return;
    if (again) r.note = "replaces what was asked before";
    use.body = &body_;
    use.phase = &phase_;
    rigNamed(name).add(use, draft_);
    if (!again) draft_.rigs.push_back(shown);
  }
  void ikRig(Reading& r) {
    const double twist = stands() ? 0 : flightTwist();
    rig("IKPose", stands() ? "IKPose<contact, root>" : "IKPose<root, feet>",
        {.twist = twist, .wall = meetsWall(), .from_wall = cameFromWall()}, r);
  }

  /// Whether the phase after it begins on a wall.
  bool meetsWall() const {
    const size_t next = static_cast<size_t>(&phase_ - script_.phases.data()) + 1;
    return !stands() && next < script_.phases.size() && script_.phases[next].kind->wall;
  }

  /// Whether the phase before it is one on the ground that feet do not bear: a roll's end.
  bool afterRoll() const {
    return &phase_ != script_.phases.data() &&
           (&phase_ - 1)->ending.kind == Ending::Kind::kComLeads && (&phase_ - 1)->bears.empty();
  }

  bool cameFromWall() const {
    return std::any_of(script_.phases.data(), &phase_, [](const Phase& p) { return p.kind->wall; });
  }

  void instruct(const Instruction& i) {
    Reading r{.phase = phase_.name,
              .said = i.said,
              .means = i.means,
              .line = i.line,
              .rigs = {},
              .term = {},
              .constraint = {},
              .note = {}};
    switch (i.form) {
      case Form::kFlex:
        flex(i, r);
        break;
      case Form::kMove:
        move(i, r);
        break;
      case Form::kTranslate:
        translate(i, r);
        break;
      case Form::kRotate:
        rotate(i, r);
        break;
      case Form::kSpeed:
        speedNear(i, r);
        break;
      case Form::kMomentum:
        momentum(i, r);
        break;
      case Form::kTurn:
        turn(i, r);
        break;
      case Form::kBalance:
        balance(r);
        break;
      case Form::kStiffness:
        stiffen(i, r);
        break;
      case Form::kPush:
        push(i, r);
        break;
      case Form::kPlace:
        place(i, r);
        break;
      case Form::kRelation:
        relate(i, r);
        break;
    }
    readings_.push_back(std::move(r));
  }

  void flex(const Instruction& i, Reading& r) {
    const std::string& joint = i.subject->joints[0];
    double angle = i.amount;
    if (i.relative)
      angle += before(measure("angle_" + identifier(joint), spelled("joint." + joint)));
    // An angle of 0 is one, too.
    rig("TargetJoints", fmt::format("TargetJoints<{}>", joint),
        {.joints = {joint}, .value = angle == 0 ? 1e-9 : angle}, r);
    if (r.note.empty()) r.note = kExactly;
  }

  void move(const Instruction& i, Reading& r) {
    if (stands() || phase_.ending.kind == Ending::Kind::kTouch) ikRig(r);
    for (int a = 0; a < 3; ++a) {
      if (std::abs(i.direction[a]) < 0.5) continue;
      const double delta = i.direction[a] * i.amount;
      if (com_wanted_[a]) r.note = "replaces what was asked before along this axis";
      com_wanted_[a] = before(com(a)) + delta;
      com(a);
    }
    r.term = "|C·d - (C before·d + delta)|";
  }
  void translate(const Instruction& i, Reading& r) {
    limbRig(*i.subject, r);
    for (int a = 0; a < 3; ++a) {
      if (std::abs(i.direction[a]) < 0.5) continue;
      const std::string m = position(*i.subject, a);
      term(i.means, fmt::format("abs({} - ({}))", m, num(before(m) + i.direction[a] * i.amount)));
    }
    r.term = "|p·d - (p before·d + delta)|";
  }
  void limbRig(const Thing& limb, Reading& r) {
    if (limb.name == "feet") return ikRig(r);
    r.note = "no rig yet for this limb: it moves as the others make it";
  }
  static int axisOf(const Vector3d& v) {
    return std::abs(v.y()) > 0.5 ? 1 : std::abs(v.z()) > 0.5 ? 2 : 0;
  }
  /// How far a body, or a group on the mean, is turned about a world axis, right-handed [rad]. A
  /// tilt counts to the left, which is about -x.
  std::string angle(const Thing& t, int axis) const {
    static constexpr const char* kAngle[] = {"tilt", "somersault", "heading"};
    std::vector<std::string> bodies = t.bodies;
    if (!t.name.empty()) {
      const auto& groups = script_.model->robot()->bodies;
      const auto group = groups.find(t.name);
      bodies = group == groups.end() ? std::vector{t.name} : group->second;
    }
    std::vector<std::string> terms;
    terms.reserve(bodies.size());
    for (const std::string& b : bodies)
      terms.push_back(spelled(fmt::format("{}.{}", kAngle[axis], b)));
    return fmt::format("{}({}) / {}", axis == 0 ? "-" : "", join(terms, " + "), terms.size());
  }
  void rotate(const Instruction& i, Reading& r) {
    const int a = axisOf(i.direction);
    const std::string of = i.subject->name.empty() ? i.subject->said : i.subject->name;
    const std::string m =
        measure(fmt::format("turned_{}_{}", identifier(of), kAxes[a]), angle(*i.subject, a));
    if (stands()) ikRig(r);
    term(i.means, fmt::format("abs({} - ({}))", m, num(before(m) + i.direction[a] * i.amount)));
    r.term = "|angle - (angle before + delta)|";
  }
  void force(Reading& r) {
    rig("VirtualForce", "VirtualForce<contact>",
        {.target = Body::contactOf(phase_), .twist = twistOf(phase_)}, r);
  }
  /// A spin that satisfies what was asked of it, and has a little to spare [rad/s].
  static double spinWanted(const Instruction& i) {
    const double beyond = i.relation == Relation::kLess ? -kSpin : kSpin;
    return (i.other->number + beyond) / i.subject->vector[axisOf(i.subject->vector)];
  }
  /// The spin about the vertical that the phase is to end with [rad/s]; 0: none is asked for.
  static double twistOf(const Phase& phase) {
    for (const Instruction& i : phase.instructions) {
      const bool spin = i.subject && i.subject->kind == Thing::Kind::kSpin;
      if (spin && axisOf(i.subject->vector) == 2) return spinWanted(i);
    }
    return 0;
  }
  bool twists() const { return twistOf(phase_) != 0; }
  /// The twist that the script's first such phase takes into its flight [rad/s].
  double flightTwist() const {
    for (const Phase& p : script_.phases) {
      if (const double twist = twistOf(p); twist != 0) return twist;
    }
    return 0;
  }
  void speedNear(const Instruction& i, Reading& r) {
    force(r);
    velocity_ = i.velocity;
    for (int a = 0; a < 3; ++a) speed(a);
    r.term = "|v - v asked|";
  }
  void momentum(const Instruction& i, Reading& r) {
    force(r);
    if (velocity_) {
      *velocity_ *= i.amount;
      r.note = "of the speed asked before; in m/s, the momentum divided by the mass";
    } else {
      velocity_ = i.amount * Vector3d(before(speed(0)), before(speed(1)), before(speed(2)));
      r.note = "in m/s, the momentum divided by the mass";
    }
    for (int a = 0; a < 3; ++a) speed(a);
    r.term = "|P - gamma P before|";
  }
  std::string momentum(int axis) {
    return measure(fmt::format("turning_{}", kAxes[axis]),
                   fmt::format("angular_momentum.{}", kAxes[axis]));
  }
  std::string spin(int axis) {
    return measure(fmt::format("spin_{}", kAxes[axis]), fmt::format("spin.{}", kAxes[axis]));
  }
  void turn(const Instruction& i, Reading& r) {
    force(r);
    std::vector<std::string> squares;
    for (int a = 0; a < 3; ++a) {
      const std::string m = spin(a);
      squares.push_back(fmt::format("({} - {})^2", m, num(i.amount * before(m))));
    }
    term(i.means, fmt::format("0.1 * sqrt({})", join(squares, " + ")));
    r.term = "|L - gamma L before|";
    r.note = "in rad/s, L divided by the inertia, a tenth of it";
  }
  void balance(Reading& r) {
    rig("FeedbackVirtualForce", "FeedbackVirtualForce<contact, C_bal>", {}, r);
    rig("Stiffness", "Stiffness<legs>", {.joints = body_.leg_joints}, r);
    const std::vector<std::string> squares{speed(0) + "^2", speed(1) + "^2", speed(2) + "^2"};
    // Balanced is who is still with the COM well inside the feet.
    const std::string margin =
        measure("margin", "support.margin", "min", ", when = \"phase_time > 1\", otherwise = -1");
    // … whose feet stay where they came down.
    const std::string down = ", when = \"phase_time > 0.1\", otherwise = 0";
    const auto range = [&](char axis) {
      const std::string of = fmt::format("body.feet.{}", axis);
      const std::string least = measure(fmt::format("feet_{}_min", axis), of, "min", down);
      const std::string most = measure(fmt::format("feet_{}_max", axis), of, "max", down);
      return fmt::format("{} - {}", most, least);
    };
    // Who has turned creeps the way that was sideways.
    const std::string creep =
        flightTwist() == 0 ? range('x') : fmt::format("max({}, {})", range('x'), range('y'));
    term("BALANCE", fmt::format("sqrt({}) + 3 * max(0, {} - {}) + 3 * max(0, {} - {})",
                                join(squares, " + "), kMargin, margin, creep, kCreep));
    r.term = "|v| + 3 max(0, 0.05 m - support margin) + 3 max(0, creep of the feet - 0.02 m)";
    r.note =
        "acts on the COM against the soles, 3000 N/m and 600 N·s/m; the legs' stiffness is "
        "found with it";
  }
  void stiffen(const Instruction& i, Reading& r) {
    rig("Stiffness", fmt::format("Stiffness<{}>", i.subject->said),
        {.joints = i.subject->joints, .value = i.amount}, r);
    if (r.note.empty()) r.note = kExactly;
  }
  void push(const Instruction& i, Reading& r) {
    const std::string& limb = i.subject->name;
    if (limb.empty()) {
      r.note = "no rig for this part: name a limb or a group of bodies";
      return;
    }
    rig("VirtualForce",
        limb == Body::contactOf(phase_) ? "VirtualForce<contact>"
                                        : fmt::format("VirtualForce<{}>", limb),
        {.target = limb}, r);
  }
  void place(const Instruction& i, Reading& r) {
    const Thing& what = *i.subject;
    const Thing& where = *i.other;
    if (what.kind == Thing::Kind::kCom && where.kind == Thing::Kind::kPlace) {
      if (stands()) {
        ikRig(r);
        r.note = "on the ground it needs a rig; printed without";
      }
      for (int a = 0; a < 3; ++a) {
        com_wanted_[a] = where.vector[a] + (a < 2 ? body_.origin[a] : 0);
        com(a);
      }
      r.term = "|C - place|";
      return;
    }
    if (what.kind == Thing::Kind::kBody && what.name == "feet" && !stands()) {
      ikRig(r);
      r.note = "in the air it needs a rig; printed without";
    }
    std::vector<std::string> squares;
    for (int a = 0; a < 3; ++a) {
      std::string to;
      if (where.kind == Thing::Kind::kPlace) {
        // A foot is on the ground when its frame is as high as standing has it.
        const double up = what.name == "feet" ? body_.origin.z() : 0;
        to = num(where.vector[a] + (a < 2 ? body_.origin[a] : up));
      } else {
        to = position(where, a);
      }
      squares.push_back(fmt::format("({} - ({}))^2", position(what, a), to));
    }
    term(i.means, fmt::format("sqrt({})", join(squares, " + ")));
    r.term = "|A - B|";
  }
  void relate(const Instruction& i, Reading& r) {
    const std::string id = fmt::format("not_{}", ++relations_);
    r.constraint = fmt::format("{} at the end", i.means);
    if (i.subject->kind == Thing::Kind::kSpin) return spinWithin(i, id, r);
    if (i.subject->kind == Thing::Kind::kAttitude) {
      const int axis = axisOf(i.subject->vector);
      return within(
          i, id, fmt::format("{} * ({})", num(i.subject->vector[axis]), angle(*i.subject, axis)));
    }
    // The first is to be further along this axis, or less far.
    const auto [axis, further] = [&]() -> std::pair<int, bool> {
      switch (i.relation) {
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
          return {0, true};
      }
    }();
    const std::string a = signal(*i.subject, axis);
    const std::string b = signal(*i.other, axis);
    must(id, further ? fmt::format("{} - ({})", b, a) : fmt::format("{} - ({})", a, b));
  }
  /// A quantity is to be greater or less than a number.
  void within(const Instruction& i, const std::string& id, const std::string& quantity) {
    const std::string limit = num(i.other->number);
    must(id, i.relation == Relation::kLess ? fmt::format("{} - ({})", quantity, limit)
                                           : fmt::format("{} - ({})", limit, quantity));
  }
  void spinWithin(const Instruction& i, const std::string& id, Reading& r) {
    const Vector3d about = i.subject->vector;  // ± an axis
    const int axis = axisOf(about);
    // In rad/s: a momentum has its sign.
    within(i, id, fmt::format("{} * spin.{}", num(about[axis]), kAxes[axis]));
    if (!stands()) return;
    // Nothing printed keeps it small, and 30 kg m²/s satisfy a sign: a somersault.
    if (twists()) force(r);
    const double wanted = spinWanted(i);
    if (twists()) {
      // Flying, a somersault about what was across becomes a cartwheel: all of the spin counts.
      r.note = fmt::format("and no more of it than needed: {} m |spin - {} rad/s|", kRadius,
                           num(wanted));
      return;
    }
    term(fmt::format("{}, no more than needed", i.means),
         fmt::format("0.1 * abs({} - ({}))", spin(axis), num(wanted)));
    r.note = fmt::format("and no more of it than needed: 0.1 |spin - {} rad/s|", num(wanted));
  }

  // The cost -------------------------------------------------------------------------------------
  void finish() {
    std::vector<std::string> squares;
    for (int a = 0; a < 3; ++a) {
      if (com_wanted_[a])
        squares.push_back(fmt::format("({} - ({}))^2", com(a), num(*com_wanted_[a])));
    }
    if (squares.size() == 1) {
      term("COM", fmt::format("sqrt({})", squares[0]));
    } else if (!squares.empty()) {
      term("COM", fmt::format("sqrt({})", join(squares, " + ")));
    }
    if (stands() && twists()) {
      // A body that leans while it turns has spin about other axes without any momentum about them.
      for (const int a : {0, 1}) momentum(a);
      const double arm = script_.model->mass() * kRadius;
      term("spin", fmt::format("{} * abs({} - ({}))", kRadius, spin(2), num(twistOf(phase_))));
      term("no other spin",
           fmt::format("sqrt({}^2 + {}^2) / {}", momentum(0), momentum(1), num(arm)));
    }
    if (velocity_) {
      squares.clear();
      for (int a = 0; a < 3; ++a) {
        squares.push_back(fmt::format("({} - ({}))^2", speed(a), num((*velocity_)[a])));
      }
      term("speed", fmt::format("sqrt({})", join(squares, " + ")));
    }
    std::string failed;
    for (const DraftFailure& f : failures_) {
      if (!f.asked) failed += (failed.empty() ? "" : " || ") + f.name;
    }
    // Whoever fails ranks last, the sooner the worse. The printed K of 1000 1/s is as large as a
    // squared momentum.
    if (!failed.empty()) {
      term("failed",
           fmt::format("({0}) * ({1} + {1} * (horizon - time))", failed, num(kFailedCost)));
    } else if (terms_.empty()) {
      term("time", "0 * time");
    }
  }

  std::string text(const std::filesystem::path& previous, const PhaseDraft& d) const {
    std::string out = heading(script_, phase_.name, script_.name + " " + phase_.name, horizon());
    if (!held()) out += fmt::format("stop = \"ended.{}\"\n", name_);
    out += fmt::format("target_cost = {}\n", num(enough_)) + sceneText(script_);
    out += previous.empty()
               ? fmt::format("\n[start.pose]\nbase = \"{}\"\n", script_.start)
               : fmt::format("\n[start]\nafter = {{ file = {} }}\n", quoted(previous.string()));
    out += rows("[constants]", d.draft.constants);
    std::vector<DraftParameter> parameters = d.draft.parameters;
    if (parameters.empty()) parameters.push_back({"still", "1", 0, 1, 0, "Nothing to practise."});
    out += rows("[parameters]", parameterRows(parameters));
    out += "\n" + d.phase + rows("[measures]", d.draft.measures);
    for (const DraftFailure& f : d.failures) {
      out += fmt::format("\n[[failure]]\nname = \"{}\"\nwhen = \"{}\"\n", f.name, f.when);
    }
    for (const auto& [name, cost] : d.terms) {
      out += fmt::format("\n[[objective]]\nname = \"{}\"\ncost = \"{}\"\n", name, cost);
    }
    return out;
  }
  std::string phaseText() const {
    std::string out =
        fmt::format("[[phase]]\nname = \"{}\"\npose = {}\nblend = {}\n", name_, poseText(),
                    num(phase_.pose.blend > 0 ? phase_.pose.blend : phase_.kind->blend));
    const auto factors = [&](const char* key, double legs, const auto& asked) {
      std::vector<std::pair<std::string, std::string>> f;
      if (legs != 1) {
        for (const std::string& j : body_.leg_joints) f.emplace_back(j, num(legs));
      }
      f.insert(f.end(), asked.begin(), asked.end());
      if (!f.empty()) out += fmt::format("{} = {}\n", key, table(f));
    };
    factors("stiffness", phase_.kind->stiffness, draft_.stiffness);
    factors("damping", phase_.kind->damping, draft_.damping);
    if (!until_.empty()) out += fmt::format("until = \"{}\"\n", until_);
    if (!draft_.reach.empty()) {
      out += "[phase.reach]\n";
      for (const std::string& l : draft_.reach) out += l + "\n";
    }
    for (const std::string& f : draft_.forces) out += "[[phase.force]]\n" + f + "\n";
    return out;
  }
  static std::string table(const std::vector<std::pair<std::string, std::string>>& entries) {
    std::vector<std::string> out;
    std::vector<std::string> seen;
    for (auto e = entries.rbegin(); e != entries.rend(); ++e) {  // the latest of a joint
      if (std::ranges::find(seen, e->first) != seen.end()) continue;
      seen.push_back(e->first);
      out.insert(out.begin(), fmt::format("{} = \"{}\"", e->first, e->second));
    }
    return "{ " + join(out) + " }";
  }
  std::string poseText() const {
    std::vector<std::pair<std::string, std::string>> entries;
    for (const KeyAngle& a : phase_.pose.angles) {
      entries.emplace_back(a.joint, a.spread > 0 ? poseNumber(a) : num(a.angle));
    }
    entries.insert(entries.end(), draft_.pose.begin(), draft_.pose.end());
    const std::string joints = entries.empty() ? "" : ", " + table(entries).substr(2);
    return entries.empty() ? fmt::format("{{ base = \"{}\" }}", phase_.pose.base)
                           : fmt::format("{{ base = \"{}\"{}", phase_.pose.base, joints);
  }

 public:
  static std::string rows(const char* heading, const std::vector<std::string>& lines) {
    if (lines.empty()) return "";
    std::string out = fmt::format("\n{}\n", heading);
    for (const std::string& l : lines) out += l + "\n";
    return out;
  }
  static std::vector<std::string> parameterRows(const std::vector<DraftParameter>& parameters) {
    std::vector<std::string> out;
    out.reserve(parameters.size());
    for (const DraftParameter& p : parameters) {
      out.push_back(fmt::format(
          "{} = {{ unit = \"{}\", range = [{:.6g}, {:.6g}], initial = {:.17g}, help = \"{}\" }}",
          p.name, p.unit, p.min, p.max, p.initial, p.help));
    }
    return out;
  }
  static std::string sceneText(const Script& s) {
    std::string out = fmt::format("\n[scene]\nground = {}\nfriction = {}\n",
                                  s.ground ? "true" : "false", num(s.friction));
    for (const SceneBox& b : s.boxes) {
      out += fmt::format("[[scene.box]]\nname = \"{}\"\nsize = [{}, {}, {}]\nat = [{}, {}, {}]\n",
                         b.name, num(b.size.x()), num(b.size.y()), num(b.size.z()), num(b.at.x()),
                         num(b.at.y()), num(b.at.z()));
    }
    for (const SceneWall& w : s.walls) {
      out += fmt::format(
          "[[scene.wall]]\nname = \"{}\"\nat = [{}, {}, {}]\nyaw = {}\nwidth = 4\nheight = 3\n",
          w.name, num(w.at.x()), num(w.at.y()), num(w.at.z()), w.at.x() > 0 ? "3.14159265" : "0");
    }
    return out;
  }

 private:
  const Script& script_;
  double enough_;
  const Phase& phase_;
  std::string name_;
  const Before& before_;
  Body body_;
  SkillDraft draft_;
  std::string until_;
  std::vector<DraftFailure> failures_;
  std::vector<std::pair<std::string, std::string>> terms_;
  std::vector<Reading> readings_;
  std::optional<double> com_wanted_[3];
  std::optional<Vector3d> velocity_;
  int relations_ = 0;
};

}  // namespace

CompiledPhase compilePhase(const Script& script, size_t phase,
                           const std::filesystem::path& previous, const Before& before,
                           double enough) {
  return Compiler(script, phase, before, enough).compile(previous);
}

namespace {

/// A text in which the phase's own names have the phase's name before them.
class Renamed {
 public:
  explicit Renamed(const PhaseDraft& p) : prefix_(p.name + "_") {
    for (const DraftParameter& x : p.draft.parameters) names_.insert(x.name);
    for (const auto* rows : {&p.draft.constants, &p.draft.measures}) {
      for (const std::string& row : *rows) names_.insert(row.substr(0, row.find(' ')));
    }
    for (const DraftFailure& f : p.failures) names_.insert(f.name);
  }
  std::string operator()(const std::string& text) const {
    std::string out;
    for (size_t i = 0; i < text.size();) {
      const auto part = [&](size_t k) {
        return std::isalnum(static_cast<unsigned char>(text[k])) || text[k] == '_' ||
               text[k] == '.';
      };
      size_t end = i;
      while (end < text.size() && part(end)) ++end;
      const std::string word = text.substr(i, end - i);
      if (names_.contains(word)) out += prefix_;
      out += end > i ? word : text.substr(i, 1);
      i = std::max(end, i + 1);
    }
    return out;
  }

 private:
  std::string prefix_;
  std::set<std::string> names_;
};

}  // namespace

std::string wholeText(const Script& script, const std::vector<PhaseDraft>& phases,
                      const std::vector<Eigen::VectorXd>& learned) {
  std::vector<std::string> constants, parameters, measures;
  std::string blocks, failures, terms;
  double horizon = 0;
  for (size_t k = 0; k < phases.size(); ++k) {
    const PhaseDraft& p = phases[k];
    const Phase& asked = script.phases[k];
    const Renamed renamed(p);
    horizon +=
        asked.ending.kind == Ending::Kind::kHeld ? asked.ending.amount : asked.longest + 0.05;
    std::vector<DraftParameter> own = p.draft.parameters;
    for (size_t i = 0; i < own.size(); ++i) {
      own[i].initial = learned[k][static_cast<Eigen::Index>(i)];
      own[i].name = p.name + "_" + own[i].name;
    }
    for (std::string& row : Compiler::parameterRows(own)) parameters.push_back(std::move(row));
    for (const std::string& row : p.draft.constants) constants.push_back(renamed(row));
    for (const std::string& row : p.draft.measures) {
      std::string r = renamed(row);
      const bool has = r.find("otherwise") != std::string::npos;
      r.insert(r.rfind(" }"),
               fmt::format(", during = [\"{}\"]{}", p.name, has ? "" : ", otherwise = 5"));
      measures.push_back(r);
    }
    blocks += "\n" + renamed(p.phase);
    for (const DraftFailure& f : p.failures) {
      if (f.asked) continue;
      failures += fmt::format("\n[[failure]]\nname = \"{}\"\nwhen = \"{}\"\nduring = [\"{}\"]\n",
                              renamed(f.name), renamed(f.when), p.name);
    }
    for (const auto& term : p.terms) {
      const std::string& name = term.first;
      const std::string& cost = term.second;
      const bool of_asked = std::ranges::any_of(
          p.failures, [&](const DraftFailure& f) { return f.asked && f.name == name; });
      if (of_asked) continue;
      terms += fmt::format("\n[[objective]]\nname = \"{}: {}\"\ncost = \"{}\"\n", p.name, name,
                           renamed(cost));
    }
  }
  if (parameters.empty()) {
    parameters = Compiler::parameterRows({{"still", "1", 0, 1, 0, "Nothing to practise."}});
  }
  std::string out = heading(script, "all of it", script.name, horizon);
  // As when the phases were practised one after another: the last is held so long.
  const Phase& last = script.phases[phases.size() - 1];
  out += last.ending.kind == Ending::Kind::kHeld
             ? fmt::format("stop = \"in.{} && phase_time >= {}\"\n", phases.back().name,
                           num(last.ending.amount))
             : fmt::format("stop = \"ended.{}\"\n", phases.back().name);
  out += Compiler::sceneText(script) + fmt::format("\n[start.pose]\nbase = \"{}\"\n", script.start);
  return out + Compiler::rows("[constants]", constants) +
         Compiler::rows("[parameters]", parameters) + blocks +
         Compiler::rows("[measures]", measures) + failures + terms;
}

}  // namespace traceur::coach
