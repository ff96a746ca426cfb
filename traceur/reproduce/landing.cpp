#include "traceur/reproduce/landing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>

#include "traceur/control/expression.h"
#include "traceur/core/hash.h"
#include "traceur/core/lender.h"
#include "traceur/core/toml.h"
#include "traceur/landing/condition.h"
#include "traceur/landing/stress.h"

namespace traceur::reproduce {
namespace {

using Eigen::VectorXd;
using landing::Fall;
using landing::Way;
using skill::Skill;

constexpr const char* kCounted =
    "Rolled and stood as docs/guide/landing.md counts it; steps of 1 ms.";

Way wayOf(const char* name) {
  const std::filesystem::path file = skill::findSkill("human", name);
  const auto skill = Skill::fromText(readFile(file), file);
  return {skill, skill->initialParameters()};
}

/// A person that lands, and one that falls limp.
struct Body {
  Way way = wayOf("land");
  landing::Faller lands{way};
  landing::Faller limp{wayOf("ragdoll")};
};
using Bodies = Lender<Body>;

std::shared_ptr<Bodies> bodies() {
  return std::make_shared<Bodies>([] { return std::make_unique<Body>(); });
}

std::string landingPrints() {
  Hash hash;
  for (const char* name : {"land", "ragdoll"}) {
    hash.add(readFile(skill::findSkill("human", name)));
  }
  hash.add(fmt::format("{}", wayOf("land").skill->model->fingerprint()));
  return fmt::format("{} human {:08x}", sim::engineVersion(), hash.value() & 0xffffffff);
}

/// A fall of Table 2; its velocities and spins are (left, up, forward), ours (forward, left, up).
struct Printed {
  const char* name;
  bool hands;
  double height;
  double velocity[3], spin[3];
};

constexpr Printed kPrinted[] = {
    {"hands 1", true, 10.6, {0, 0, 4.0}, {8.7, 0, 0}},
    {"hands 2", true, 5.8, {0, 0, 2.3}, {5.0, 0, 0}},
    {"hands 3", true, 10.6, {0, 0, 6.0}, {2.5, 0, 0}},
    {"hands 4", true, 2.5, {0, 0.4, 8.0}, {5.0, 0, 0}},
    {"feet 1", false, 6.0, {0, 0, 5.0}, {4.0, -1.0, -5.8}},
    {"feet 2", false, 2.7, {0, -1.0, 0}, {0, 0, 0}},
    {"feet 3", false, 5.5, {1.0, 0, 0}, {0, 5.0, 0}},
    {"feet 4", false, 9.6, {-2.0, 0, -3.5}, {0.9, 2.1, -3.9}},
};

}  // namespace

Table table2() {
  Table t;
  t.name = "table-2";
  t.title = "Landings hands first and feet first [Ha2015, Tab. 2].";
  t.protocol = fmt::format(
      "The paper prints no attitude to begin with; here, in all rows, rigid flight would miss the "
      "somersault that is wanted at touch-down by as much as the column says, in rad. One set of "
      "numbers for all "
      "rows. 1: it rolls and stands. {}",
      kCounted);
  for (const Printed& p : kPrinted) {
    t.rows.push_back({p.name, p.hands ? "hands first" : "feet first", "stands"});
  }
  static constexpr double kOff[] = {-0.1, 0, 0.1};
  for (const double off : kOff) t.columns.push_back({fmt::format("{:+g}", off), 1, 1, {}});
  t.columns[1].name = "0";
  t.made_with = landingPrints;
  t.run = [all = bodies()](int row, int column, std::uint64_t /*seed*/, const std::stop_token&) {
    return all->with([&](Body& body) {
      const Printed& p = kPrinted[row];
      const Fall fall =
          body.lands.fall(body.way.skill->conditionsWith({{"height", p.height},
                                                          {"forward", p.velocity[2]},
                                                          {"lateral", p.velocity[0]},
                                                          {"up", p.velocity[1]},
                                                          {"pitch_rate", p.spin[0]},
                                                          {"yaw_rate", p.spin[1]},
                                                          {"roll_rate", p.spin[2]},
                                                          {"miss", kOff[column]},
                                                          {"hands", p.hands ? 1 : 0}}));
      return Outcome{fall.verdict.stands() ? 1.0 : 0.0, !fall.verdict.rolled.has_value()};
    });
  };
  return t;
}

Table figure17() {
  Table t;
  t.name = "figure-17";
  t.title = "Largest forces on joints, limp and in a landing [Ha2015, Fig. 17].";
  t.protocol = fmt::format(
      "Largest means over 2 ms since touch-down of the force that a joint bears; of a left and a "
      "right joint the larger. Falls of the set m2, a seed a fall, and the same fall limp. The "
      "paper's are of one landing hands first, in a unit that it does not say. {}",
      kCounted);
  // Pixels of the figure: limp, in the landing.
  struct Bars {
    const char* joint;
    double limp, landing;
  };
  static constexpr Bars kBars[] = {{"lower_spine", 35.1, 14.1}, {"upper_spine", 73.3, 9.7},
                                   {"neck", 89.4, 5.0},         {"clavicle", 20.4, 7.2},
                                   {"shoulder", 17.4, 8.8},     {"elbow", 21.9, 16.4},
                                   {"wrist", 29.6, 29.1},       {"hip", 14.0, 7.9},
                                   {"knee", 17.1, 4.2},         {"ankle", 11.9, 8.1}};
  t.columns = {{"limp", 20, 100, {}}, {"landing", 20, 100, {}}};
  for (const Bars& bars : kBars) {
    t.rows.push_back({bars.joint, "", "kN"});
    t.columns[0].printed.push_back(bars.limp);
    t.columns[1].printed.push_back(bars.landing);
  }
  t.ratios = {{"limp / landing", 0, 1}};
  t.center = Center::kMedian;
  t.made_with = landingPrints;
  // Each fall is that of ten rows.
  struct Known {
    std::mutex mutex;
    std::map<std::pair<int, std::uint64_t>, landing::Verdict> verdicts;
  };
  t.run = [all = bodies(), known = std::make_shared<Known>()](
              int row, int column, std::uint64_t seed, const std::stop_token&) {
    return all->with([&](Body& body) {
      std::unique_lock lock(known->mutex);
      auto at = known->verdicts.find({column, seed});
      if (at == known->verdicts.end()) {
        lock.unlock();
        const auto x = landing::drawFalls(*body.way.skill, landing::findFallSet("m2"), 1, seed)[0];
        const Fall fall =
            column == 1 ? body.lands.fall(x) : body.limp.fall({}, body.lands.start(x));
        lock.lock();
        at = known->verdicts.insert({{column, seed}, fall.verdict}).first;
      }
      const landing::Verdict& verdict = at->second;
      const auto joints = landing::stressedJoints(*body.way.skill->model);
      const auto joint = std::find_if(joints.begin(), joints.end(),
                                      [&](const auto& j) { return j.name == kBars[row].joint; });
      return Outcome{joint->stress(verdict.stress) / 1000, !verdict.touch_down.has_value()};
    });
  };
  return t;
}

namespace {

const Map kAtlas = {.count = 7,
                    .low = -1,
                    .high = 6,
                    .y_offset = 3,
                    .xlabel = "forward [m/s]",
                    .ylabel = "height of the COM [m]"};
constexpr double kSpins[] = {0, 1.5, 3};

}  // namespace

Table landingAtlas() {
  Table t;
  t.name = "landing-atlas";
  t.title = "Where a person lands, rolls and stands, by drop height, forward speed and spin.";
  t.protocol = fmt::format(
      "Not in the paper. Squares of 1 m by 1 m/s, a fall from anywhere in each for each seed; the "
      "attitude as docs/guide/landing.md says, with up to 0.3 rad of lean, roll and yaw. Share of "
      "falls that roll and stand. {}",
      kCounted);
  for (const double spin : kSpins) {
    t.rows.push_back({fmt::format("{:g} rad/s", spin), "", "percent"});
  }
  t.columns = {{"stands", 4, 100, {}}};
  t.points = "square:stands";
  t.drawn = Drawn::kMap;
  t.map = kAtlas;
  t.made_with = landingPrints;
  t.run = [all = bodies()](int row, int /*column*/, std::uint64_t seed,
                           const std::stop_token& stop) {
    return all->with([&](Body& body) {
      Outcome outcome;
      double good = 0;
      for (int k = 0; k < kAtlas.count * kAtlas.count && !stop.stop_requested(); ++k) {
        const double forward = kAtlas.low + k % kAtlas.count;
        const int above = k / kAtlas.count;
        const double height = kAtlas.low + kAtlas.y_offset + above;
        const landing::FallSet set{"",
                                   "",
                                   {{"height", height, height + 1},
                                    {"forward", forward, forward + 1},
                                    {"pitch_rate", kSpins[row] - 0.25, kSpins[row] + 0.25},
                                    {"miss", -0.3, 0.3},
                                    {"roll", -0.3, 0.3},
                                    {"yaw", -0.3, 0.3}}};
        // Of each square other falls.
        const std::uint64_t drawn = seed * 1000 + static_cast<std::uint64_t>(k);
        const auto x = landing::drawFalls(*body.way.skill, set, 1, drawn)[0];
        const bool stands = body.lands.fall(x).verdict.stands();
        outcome.points.push_back({static_cast<double>(k), stands ? 1.0 : 0.0});
        good += stands;
      }
      outcome.value = 100 * good / (kAtlas.count * kAtlas.count);
      return outcome;
    });
  };
  return t;
}

namespace {

/// Touch-downs that the landing condition is learned from, for each seed.
constexpr int kTouchDowns = 600;

landing::LandingCondition learnedFrom(const Way& way, std::uint64_t seed) {
  const auto drawn = landing::drawTouchDowns(*way.skill, kTouchDowns, seed);
  return landing::learnCondition(landing::fallAll(way, drawn, {.threads = 1}));
}

/// The numbers of a landing that wants this in the air.
VectorXd wanting(const Way& way, const landing::Plane& plane) {
  // lean + lean_forward w + lean_spin ω + lean_down (6 m/s + v)
  const std::pair<std::string_view, double> numbers[] = {{"lean", plane.constant - 6 * plane.up},
                                                         {"lean_forward", plane.forward},
                                                         {"lean_spin", plane.spin},
                                                         {"lean_down", plane.up}};
  VectorXd x = way.parameters;
  for (const auto& [name, value] : numbers) {
    for (size_t i = 0; i < way.skill->parameters.size(); ++i) {
      const ParamSpec& p = way.skill->parameters[i];
      if (p.name == name) x[static_cast<Eigen::Index>(i)] = std::clamp(value, p.min, p.max);
    }
  }
  return x;
}

/// What a landing with these numbers wants in the air.
landing::Plane wantedBy(const Way& way) {
  const auto number = [&](std::string_view name) {
    for (size_t i = 0; i < way.skill->parameters.size(); ++i) {
      if (way.skill->parameters[i].name == name) {
        return way.parameters[static_cast<Eigen::Index>(i)];
      }
    }
    return std::nan("");
  };
  const double down = number("lean_down");
  return {down, number("lean_forward"), number("lean_spin"), number("lean") + 6 * down};
}

}  // namespace

TouchDowns touchDowns(bool hands, std::uint64_t seed) {
  const Way way = wayOf("land");
  const auto drawn = landing::drawTouchDowns(*way.skill, kTouchDowns, seed, hands);
  const std::vector<Fall> falls = landing::fallAll(way, drawn, {});
  TouchDowns t;
  t.condition = landing::learnCondition(falls);
  for (const Fall& f : falls) {
    if (f.verdict.touch_down) t.all.push_back(f.verdict);
  }
  return t;
}

AirPoses airPoses(std::uint64_t seed) {
  static constexpr int kFalls = 100;
  const Way way = wayOf("land");
  const Skill& skill = *way.skill;
  const auto phase = std::find_if(skill.phases.begin(), skill.phases.end(),
                                  [](const skill::Phase& p) { return p.name == "flight"; });
  const std::vector<flight::FlightPose>& poses = phase->flight->poses;
  AirPoses air{skill.model, {}, std::vector<int>(poses.size(), 0)};
  for (const flight::FlightPose& pose : poses) {
    sim::Pose at;
    for (size_t i = 0; i < skill.model->joints().size(); ++i) {
      at.joints[skill.model->joints()[i].name] = pose.joints[static_cast<Eigen::Index>(i)];
    }
    air.poses.push_back(skill.model->stateOf(at));
  }
  flight::FlightPlanner planner(skill.model, poses);
  VectorXd landing_pose = phase->base;
  const control::Expression::Lookup numbers = [&](const std::string& name) -> const double* {
    for (size_t i = 0; i < skill.parameters.size(); ++i) {
      if (skill.parameters[i].name == name) {
        return &way.parameters[static_cast<Eigen::Index>(i)];
      }
    }
    return nullptr;
  };
  for (const skill::JointValue& v : phase->targets) {
    landing_pose[v.joint] = v.sign * control::Expression(v.expression, numbers).value();
  }
  planner.landIn(landing_pose);
  sim::World world(skill.model);
  const landing::Plane plane = wantedBy(way);
  landing::Faller faller(way);
  for (const VectorXd& x : landing::drawFalls(skill, landing::findFallSet("m3"), kFalls, seed)) {
    world.reset(faller.start(x));
    const auto wanted = [&](const flight::TouchDown& t) {
      const sim::Vector3d heading = world.snapshot().heading();
      return plane.at(t.velocity.z(), t.velocity.dot(heading),
                      t.spin.dot(sim::Vector3d::UnitZ().cross(heading)));
    };
    const int pose = planner.plan(world.snapshot(), wanted, 0).pose;
    ++(pose < 0 ? air.none : air.chosen[static_cast<size_t>(pose)]);
  }
  return air;
}

Table landingCondition() {
  Table t;
  t.name = "landing-condition";
  t.title = "The landing condition, learned from touch-downs [Ha2015, Fig. 10, 11, Eq. 1].";
  t.protocol = fmt::format(
      "Feet first; {} touch-downs a seed with velocities of 5 to 10 m/s down and -0.5 to 6 m/s "
      "forward, spins of -1 to 4 rad/s and a somersault up to 0.9 rad from the wanted one. Least "
      "and most leave a tenth of the successes outside each, wanted is the plane between. Printed "
      "are numbers of another body and controller. {}",
      kTouchDowns, kCounted);
  t.rows = {{"of the velocity upwards", "", "rad s/m"},
            {"of the velocity forward", "", "rad s/m"},
            {"of the spin", "", "s"},
            {"constant", "", "rad"},
            {"at 6 m/s down and 2.5 m/s forward and 1 rad/s", "", "rad"}};
  t.columns = {{"least", 1, 3, {}},
               {"wanted", 1, 3, {-0.01, -0.06, -0.03, 0.45, kNotPrinted}},
               {"most", 1, 3, {}}};
  t.made_with = landingPrints;
  struct Learned {
    std::mutex mutex;
    std::map<std::uint64_t, landing::LandingCondition> by_seed;
  };
  t.run = [learned = std::make_shared<Learned>()](int row, int column, std::uint64_t seed,
                                                  const std::stop_token&) {
    const std::lock_guard lock(learned->mutex);
    auto found = learned->by_seed.find(seed);
    if (found == learned->by_seed.end()) {
      found = learned->by_seed.emplace(seed, learnedFrom(wayOf("land"), seed)).first;
    }
    const landing::LandingCondition& c = found->second;
    const landing::Plane plane = column == 0 ? c.least : column == 1 ? c.wanted() : c.most;
    const double numbers[] = {plane.up, plane.forward, plane.spin, plane.constant,
                              plane.at(-6, 2.5, 1)};
    return Outcome{numbers[row]};
  };
  return t;
}

Table landingFlight() {
  Table t;
  t.name = "landing-flight";
  t.title = "How far from the wanted attitude a person touches down.";
  t.protocol = fmt::format(
      "Not in the paper. The angle of the somersault from the wanted one and of the tilt together, "
      "feet first; a seed a fall. {}",
      kCounted);
  static constexpr const char* kSets[] = {"m2", "m3"};
  for (const char* set : kSets) t.rows.push_back({set, "", "rad"});
  static constexpr int kPoses[] = {16, 4, 1};
  for (const int poses : kPoses) {
    t.columns.push_back({fmt::format("{} pose{}", poses, poses > 1 ? "s" : ""), 20, 100, {}});
  }
  t.differences = {{"4 poses - 16 poses", 1, 0}, {"1 pose - 4 poses", 2, 1}};
  t.center = Center::kMedian;
  t.made_with = landingPrints;
  struct Flier {
    Way way;
    landing::Faller faller{way};
  };
  const auto fliers = [](int poses) {
    return std::make_shared<Lender<Flier>>([poses] {
      const std::filesystem::path file = skill::findSkill("human", "land");
      std::string text = readFile(file);
      // A fall is over as it touches down; its flights have so many poses.
      const std::string flight = "[phase.flight]\n";
      for (size_t at = text.find(flight); at != std::string::npos; at = text.find(flight, at + 1)) {
        text.insert(at + flight.size(), fmt::format("poses = {}\n", poses));
      }
      const auto skill = Skill::fromText(text, file);
      return std::make_unique<Flier>(Flier{.way = {skill, skill->initialParameters()}});
    });
  };
  t.run = [all = std::array{fliers(kPoses[0]), fliers(kPoses[1]), fliers(kPoses[2])}](
              int row, int column, std::uint64_t seed, const std::stop_token&) {
    return all[static_cast<size_t>(column)]->with([&](Flier& f) {
      VectorXd x = landing::drawFalls(*f.way.skill, landing::findFallSet(kSets[row]), 1, seed)[0];
      for (size_t i = 0; i < f.way.skill->conditions.size(); ++i) {
        const std::string& name = f.way.skill->conditions[i].name;
        if (name == "hands") x[static_cast<Eigen::Index>(i)] = 0;
        if (name == "practice") x[static_cast<Eigen::Index>(i)] = 1;  // no getting up
      }
      const landing::Verdict v = f.faller.fall(x).verdict;
      const double wanted =
          wantedBy(f.way).at(-v.touch_down_speed, v.touch_down_forward, v.touch_down_spin);
      const double off = std::remainder(v.touch_down_somersault - wanted, 2 * std::numbers::pi);
      return Outcome{std::hypot(off, v.touch_down_tilt), !v.touch_down.has_value()};
    });
  };
  return t;
}

Table landingLean() {
  Table t;
  t.name = "landing-lean";
  t.title = "How often a person stands, by what it wants in the air.";
  t.protocol = fmt::format(
      "Not in the paper. Searched: the numbers that were learned with the rest of the landing. "
      "Learned: the plane of landing-condition, of its first seed. Constant: that plane at 6 m/s "
      "down, 2.5 m/s forward and 1 rad/s, whatever comes. The same falls of each, which all begin "
      "with an attitude about what was searched. {}",
      kCounted);
  static constexpr const char* kSets[] = {"easy", "m2", "m3"};
  for (const char* set : kSets) t.rows.push_back({set, "", "stands"});
  t.columns = {{"searched", 20, 100, {}}, {"learned", 20, 100, {}}, {"constant", 20, 100, {}}};
  t.differences = {{"learned - constant", 1, 2}, {"learned - searched", 1, 0}};
  t.made_with = landingPrints;
  struct Plane {
    std::mutex mutex;
    std::optional<landing::Plane> plane;
  };
  t.run = [learned = std::make_shared<Plane>(), all = bodies()](
              int row, int column, std::uint64_t seed, const std::stop_token&) {
    landing::Plane plane;
    if (column > 0) {
      const std::lock_guard lock(learned->mutex);
      if (!learned->plane) learned->plane = learnedFrom(wayOf("land"), 1).wanted();
      plane = *learned->plane;
    }
    return all->with([&](Body& body) {
      const auto x =
          landing::drawFalls(*body.way.skill, landing::findFallSet(kSets[row]), 1, seed)[0];
      Way way = body.way;
      if (column == 1) way.parameters = wanting(way, plane);
      if (column == 2) way.parameters = wanting(way, {0, 0, 0, plane.at(-6, 2.5, 1)});
      const Fall fall =
          column == 0 ? body.lands.fall(x) : landing::Faller(way).fall(x, body.lands.start(x));
      return Outcome{fall.verdict.stands() ? 1.0 : 0.0};
    });
  };
  return t;
}

}  // namespace traceur::reproduce
