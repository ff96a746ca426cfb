// traceur land: let a body fall and see how it lands.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/mishaps.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/pictures.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/landing/falls.h"
#include "traceur/landing/stress.h"
#include "traceur/practice/learned.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using landing::Fall;
using landing::Share;
using landing::Verdict;
using skill::Skill;

using landing::Way;

/// The skill in skills/ROBOT/ that says how it falls limp.
constexpr const char* kLimp = "ragdoll";

struct LandArguments {
  std::string robot = "human";
  std::string skill = "land";
  std::string strategy;
  std::optional<double> height;
  std::vector<double> velocity, spin;
  std::optional<double> lean;
  std::vector<std::string> given;
  std::string from;
  int falls = 0;
  std::string set = "m2";
  std::uint64_t seed = 1;
  int rolls = 1;
  Mishaps mishaps;
  int threads = 0;
  std::vector<std::string> files;
  bool stress = false;
  bool json = false;
};

/// The condition that says what meets the ground first.
constexpr const char* kHands = "hands";
/// Those of how often it rolls, and of the box that it comes down on first: how high, and where.
constexpr const char* kRolls = "rolls";
constexpr const char* kRoof = "roof";
constexpr const char* kAim = "aim";

/// Sets it by --strategy.
void meetWith(const LandArguments& a, const Skill& skill, Eigen::VectorXd& x) {
  const Numbers conditions{skill.conditions, "condition", skill.name};
  const std::string where = "--strategy " + a.strategy;
  if (a.strategy == "hands") assign(x, conditions, kHands, 1, where);
  if (a.strategy == "feet") assign(x, conditions, kHands, 0, where);
  if (a.strategy == "auto") assign(x, conditions, kHands, -1, where);
}

/// Sets it by --rolls.
void rollSoOften(const LandArguments& a, const Skill& skill, Eigen::VectorXd& x) {
  if (a.rolls == 1) return;
  assign(x, {skill.conditions, "condition", skill.name}, kRolls, a.rolls,
         fmt::format("--rolls {}", a.rolls));
}

Starting startingOf(const LandArguments& a) {
  return {a.height.value_or(0), a.velocity.empty() ? 0 : a.velocity[0],
          a.velocity.size() > 2 ? a.velocity[2] : 0, a.seed};
}

Eigen::VectorXd conditionsOf(const Skill& skill, const LandArguments& a) {
  Eigen::VectorXd x = skill.initialConditions();
  const Numbers conditions{skill.conditions, "condition", skill.name};
  const auto give = [&](const char* name, double value, const char* option) {
    assign(x, conditions, name, value, fmt::format("{} {:g}", option, value));
  };
  if (a.height) give("height", *a.height, "--height");
  static constexpr const char* kVelocity[] = {"forward", "lateral", "up"};
  static constexpr const char* kSpin[] = {"pitch_rate", "roll_rate", "yaw_rate"};
  for (size_t i = 0; i < a.velocity.size(); ++i) give(kVelocity[i], a.velocity[i], "--velocity");
  for (size_t i = 0; i < a.spin.size(); ++i) give(kSpin[i], a.spin[i], "--spin");
  if (a.lean) give("miss", *a.lean, "--lean");
  meetWith(a, skill, x);
  rollSoOften(a, skill, x);
  if (const auto box = a.mishaps.box(startingOf(a))) {
    give(kRoof, box->height, "--onto");
    give(kAim, box->aim, "--onto");
  }
  for (const std::string& text : a.given) assign(x, conditions, text, "--given");
  return x;
}

Json fallJson(const Fall& f) {
  const Verdict& v = f.verdict;
  const auto time = [](const std::optional<double>& t) { return t ? Json(*t) : Json(); };
  return {{"rolls", v.rolled.has_value()},
          {"stands", v.stands()},
          {"safe", v.safe()},
          {"stands_later", v.stands_later},
          {"touch_down", time(v.touch_down)},
          {"rolled", time(v.rolled)},
          {"stood", time(v.stood)},
          {"touch_down_speed", v.touch_down_speed},
          {"touch_down_somersault", v.touch_down_somersault},
          {"touch_down_forward", v.touch_down_forward},
          {"touch_down_spin", v.touch_down_spin},
          {"head_force", v.head_force},
          {"ended", f.rollout.ended},
          {"time", f.rollout.time},
          {"cost", numberOrNull(f.rollout.cost)},
          {"hash", fmt::format("{:016x}", f.rollout.hash)}};
}

void tellFall(const Skill& skill, const Fall& f) {
  const Verdict& v = f.verdict;
  print("{}: {}\n", skill.name,
        v.safe()               ? "rolls, stands, and spares the head"
        : v.stands()           ? "rolls and stands"
        : v.rolled.has_value() ? "rolls, and does not stand"
                               : "does not roll");
  const auto time = [](const char* what, const std::optional<double>& t) {
    if (t) print("{:<16} {:.3f} s\n", what, *t);
  };
  time("touches down", v.touch_down);
  if (v.touch_down) {
    print("{:<16} {:.2f} m/s down, somersault {:.2f} rad\n", "", v.touch_down_speed,
          v.touch_down_somersault);
  }
  time("has rolled", v.rolled);
  time("has stood", v.stood);
  print("{:<16} {:.0f} N at most\n", "on the head", v.head_force);
  print("{:<16} {} after {:.2f} s\n", "ended", f.rollout.ended, f.rollout.time);
}

Json stressJson(const landing::StressRatio& r) {
  return {
      {"mean", r.mean}, {"geometric_mean", r.geometric}, {"of_sums", r.sums}, {"least", r.worst}};
}

/// What joints bore in the fall and limp, a row each [Ha2015, Fig. 17].
void tellStress(const sim::Model& model, const Verdict& ours, const Verdict& limp, Json* json) {
  const auto joints = landing::stressedJoints(model);
  if (json) {
    for (const landing::StressedJoint& j : joints) {
      (*json)["stress"][j.name] = {{"landing", j.stress(ours.stress)},
                                   {"ragdoll", j.stress(limp.stress)},
                                   {"carries", j.carries}};
    }
    (*json)["stress_ratio"] = stressJson(compared(joints, limp.stress, ours.stress));
    (*json)["stress_ratio_without_ends"] =
        stressJson(compared(withoutEnds(joints), limp.stress, ours.stress));
    return;
  }
  print("{:<14}{:>10}{:>10}{:>8}{:>12}\n", "joint", "limp [kN]", "here [kN]", "ratio", "[kN/kg]");
  for (const landing::StressedJoint& j : joints) {
    const double here = j.stress(ours.stress);
    const double there = j.stress(limp.stress);
    print("{:<14}{:>10.2f}{:>10.2f}{:>8.1f}{:>12.3f}\n", j.name, there / 1000, here / 1000,
          there / here, here / 1000 / j.carries);
  }
  const auto all = compared(joints, limp.stress, ours.stress);
  const auto inner = compared(withoutEnds(joints), limp.stress, ours.stress);
  print("{:<34}{:>8.2f}   {:.2f} without hands and feet\n", "mean of the ratios", all.mean,
        inner.mean);
  print("{:<34}{:>8.2f}   {:.2f}\n", "geometric mean", all.geometric, inner.geometric);
  print("{:<34}{:>8.2f}   {:.2f}\n", "ratio of the sums", all.sums, inner.sums);
}

/// The middle and the worst tenth of many falls' ratios, of all joints, without ends, and joint by
/// joint.
void tellStress(const sim::Model& model, const std::vector<Fall>& falls,
                const std::vector<Fall>& limp, Json* json) {
  const auto at = [](std::vector<double> x, double share) {
    std::sort(x.begin(), x.end());
    return x[static_cast<size_t>(share * static_cast<double>(x.size() - 1))];
  };
  const auto joints = landing::stressedJoints(model);
  const auto tell = [&](const std::string& name, const auto& ratio) {
    std::vector<double> all;
    for (size_t k = 0; k < falls.size(); ++k) {
      all.push_back(ratio(limp[k].verdict.stress, falls[k].verdict.stress));
    }
    if (json) {
      (*json)["stress_ratio"][name] = {{"median", at(all, 0.5)}, {"worst_tenth", at(all, 0.1)}};
    } else {
      print("{:<28}{:>8.2f}{:>14.2f}\n", name, at(all, 0.5), at(all, 0.1));
    }
  };
  if (!json) print("{:<28}{:>8}{:>14}\n", "stress, limp / landing", "median", "worst tenth");
  using Vector = Eigen::VectorXd;
  for (const bool ends : {true, false}) {
    const auto some = ends ? joints : withoutEnds(joints);
    const std::string of = ends ? "" : ", inner joints";
    tell("mean" + of, [&](const Vector& l, const Vector& o) { return compared(some, l, o).mean; });
    tell("geometric mean" + of,
         [&](const Vector& l, const Vector& o) { return compared(some, l, o).geometric; });
    tell("of sums" + of,
         [&](const Vector& l, const Vector& o) { return compared(some, l, o).sums; });
  }
  for (const landing::StressedJoint& j : joints) {
    tell(j.name, [&](const Vector& l, const Vector& o) { return j.stress(l) / j.stress(o); });
  }
}

int many(const LandArguments& a, const Way& start, const Way& way, const Way& limp,
         Interrupt& interrupt) {
  const Skill& skill = *start.skill;
  const landing::FallSet& set = landing::findFallSet(a.set);
  auto conditions = landing::drawFalls(skill, set, a.falls, a.seed);
  for (Eigen::VectorXd& x : conditions) {
    meetWith(a, skill, x);
    rollSoOften(a, skill, x);
  }
  ProgressLine line("falls", (a.stress ? 2.0 : 1.0) * a.falls, 0, a.json);
  int done = 0;
  const landing::Execution how{.threads = a.threads, .stop = interrupt.token(), .on_done = [&] {
                                 line.update(++done, "", "falls");
                               }};
  std::vector<Fall> falls;
  if (way.skill == start.skill) {
    falls = landing::fallAll(start, conditions, how);
  } else {  // limp
    landing::Faller faller(start);
    std::vector<sim::State> starts;
    starts.reserve(conditions.size());
    for (const Eigen::VectorXd& x : conditions) starts.push_back(faller.start(x));
    const std::vector<Eigen::VectorXd> initial(starts.size());
    falls = landing::fallAll(way, initial, how, starts);
  }
  std::vector<Fall> limply;
  if (a.stress) limply = landing::fallAgain(limp, falls, how);
  line.finish();
  if (interrupt.token().stop_requested()) return kInterrupted;
  Json rows = Json::array();
  Share rolled, stands, safe, later;
  for (size_t k = 0; k < falls.size(); ++k) {
    const Verdict& v = falls[k].verdict;
    const auto count = [](Share& share, bool yes) {
      ++share.all;
      share.of += yes;
    };
    count(rolled, v.rolled.has_value());
    count(stands, v.stands());
    count(safe, v.safe());
    count(later, v.stands() && v.stands_later);
    if (!a.json) continue;
    Json row = fallJson(falls[k]);
    Json under;
    for (size_t c = 0; c < skill.conditions.size(); ++c) {
      under[skill.conditions[c].name] = conditions[k][static_cast<Eigen::Index>(c)];
    }
    row["conditions"] = std::move(under);
    rows.push_back(std::move(row));
  }
  if (a.json) {
    Json all{{"set", set.name}, {"seed", a.seed}, {"falls", std::move(rows)}};
    if (a.stress) tellStress(*way.skill->model, falls, limply, &all);
    printJson(all);
    return kDone;
  }
  print("{} falls of {} ({})\n", a.falls, set.name, set.help);
  const auto tell = [](const char* what, const Share& s) {
    print("{:<16} {:>3} of {}  [{:.0f} %, {:.0f} %]\n", what, s.of, s.all, 100 * s.low(),
          100 * s.high());
  };
  tell("roll", rolled);
  tell("stand", stands);
  tell("safe", safe);
  tell("stand 5 s later", later);
  if (a.stress) tellStress(*way.skill->model, falls, limply, nullptr);
  return kDone;
}

void requireInTheAir(const sim::Model& model, const sim::State& start) {
  static constexpr double kDepth = 0.001;  // [m]
  if (const auto body = model.bodyReachedInto(start, kDepth)) {
    throw InputError(
        fmt::format("the fall begins inside {}: expected a larger --height",
                    model.bodyName(*body) == Mishaps::kBox ? "the box" : "the ground"));
  }
}

/// Of a strip: most of it is happening in the roll, little in the seconds of getting up after it.
std::vector<double> momentsOf(const landing::Verdict& v, double end) {
  static constexpr int kInTheRoll = 5;
  if (!v.touch_down) return {};
  const double turned = std::min(end, v.rolled ? *v.rolled + 0.4 : *v.touch_down + 1.5);
  std::vector<double> moments = {0, 0.5 * *v.touch_down};
  for (int k = 0; k <= kInTheRoll; ++k) {
    moments.push_back(*v.touch_down + (turned - *v.touch_down) * k / kInTheRoll);
  }
  if (end - turned > 0.2) moments.insert(moments.end(), {0.5 * (turned + end), end});
  return moments;
}

int one(const LandArguments& a, const Way& start, const Way& way, const Way& limp,
        Interrupt& interrupt) {
  for (const fs::path picture : a.files) requirePicture(picture);
  const Eigen::VectorXd conditions = conditionsOf(*start.skill, a);
  sim::Recording recording;
  landing::Faller faller(start);
  requireInTheAir(*start.skill->model, faller.start(conditions));
  const Fall fall = way.skill == start.skill
                        ? faller.fall(conditions, {}, &recording)
                        : landing::Faller(way).fall({}, faller.start(conditions), &recording);
  for (const fs::path picture : a.files) {
    const double end = recording.frames.back().state.time;
    if (!draw(recording, picture, {.times = momentsOf(fall.verdict, end)}, interrupt, a.json)) {
      return kInterrupted;
    }
  }
  std::optional<Fall> limply;
  if (a.stress) limply = landing::Faller(limp).fall({}, fall.start);
  if (a.json) {
    Json json = fallJson(fall);
    if (limply) tellStress(*way.skill->model, fall.verdict, limply->verdict, &json);
    printJson(json);
    return kDone;
  }
  tellFall(*way.skill, fall);
  if (limply) tellStress(*way.skill->model, fall.verdict, limply->verdict, nullptr);
  for (const std::string& picture : a.files) print("{}\n", picture);
  return kDone;
}

Way wayOf(const LandArguments& a, const std::string& name) {
  const fs::path file = skill::findSkill(a.robot, name);
  const auto skill = Skill::fromText(readFile(file), file, a.mishaps.changes(startingOf(a)));
  return {skill, skill->initialParameters(), a.mishaps.meddling(*skill->model)};
}

int land(const LandArguments& a) {
  Interrupt interrupt;  // before any other thread
  if (a.falls > 0 && !a.files.empty()) {
    throw InputError("--out: pictures are of one fall: expected no --falls");
  }
  Way landing = wayOf(a, a.skill);
  if (!a.from.empty()) {
    landing.parameters =
        initialOf(practice::beginningFrom(practice::Run::open(a.from), landing.skill->parameters,
                                          landing.skill->task.initial)
                      .parameters);
  }
  if (a.falls > 0 && a.mishaps.box(startingOf(a))) {
    throw InputError("--onto: the box stands where one fall comes down: expected no --falls");
  }
  if (a.mishaps.box(startingOf(a)) && (!a.height || a.velocity.empty())) {
    throw InputError("--onto: expected --height and --velocity too: the box stands by them");
  }
  const bool limp = a.strategy == "ragdoll";
  const Way ragdoll = limp || a.stress ? wayOf(a, kLimp) : Way{};
  const Way& way = limp ? ragdoll : landing;
  return a.falls > 0 ? many(a, landing, way, ragdoll, interrupt)
                     : one(a, landing, way, ragdoll, interrupt);
}

}  // namespace

void addLand(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<LandArguments>();
  CLI::App* verb =
      program.add_subcommand("land", "Let a body fall: fly, meet the ground, roll, get up, stand.");
  verb->add_option("--robot", a->robot, "A name under models/")->capture_default_str();
  verb->add_option("--skill", a->skill,
                   "Of its skills the one that lands, in skills/ROBOT/: land-dissertation is as "
                   "published")
      ->capture_default_str();
  verb->add_option("--strategy", a->strategy,
                   "What meets the ground first: feet, hands, or as the skill chooses (auto); "
                   "ragdoll: limp. Default: the skill's")
      ->check(CLI::IsMember({"auto", "feet", "hands", "ragdoll"}));
  verb->add_option("--height", a->height, "Of the centre of mass [m]");
  verb->add_option("--velocity", a->velocity, "Forward, to the left, up [m/s]")->expected(1, 3);
  verb->add_option("--spin", a->spin, "Forward somersault, to the right, to the left [rad/s]")
      ->expected(1, 3);
  verb->add_option("--lean", a->lean,
                   "By how much rigid flight would miss the lean that is wanted on landing [rad]");
  verb->add_option("--given", a->given, "NAME=VALUE: another condition of the skill")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("--from", a->from, "A run of traceur learn whose numbers to land with");
  verb->add_option("--falls", a->falls, "So many falls by lot, and how many succeed")
      ->check(CLI::Range(1, 100'000));
  std::vector<std::string> sets;
  for (const landing::FallSet& set : landing::fallSets()) sets.push_back(set.name);
  verb->add_option("--set", a->set, "Of falls by lot: " + join(sets, " or "))
      ->capture_default_str();
  verb->add_option("--seed", a->seed, "Of falls by lot")->check(isSeed())->capture_default_str();
  verb->add_option("--rolls", a->rolls, "So many rolls, one after the other")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  a->mishaps.addTo(*verb);
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--out", a->files, ".png for a film strip, .mp4 for a video. One for each")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_flag("--stress", a->stress, "What joints bear, against the same fall limp");
  verb->add_flag("--json", a->json, "Print one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur land --height 3 --velocity 2.5 --out land.png\n"
      "  traceur land --height 4 --velocity 2 0.3 --spin 1\n"
      "  traceur land --height 4 --cannon time=0.2 mass=5 left=10 --out hit.mp4\n"
      "  traceur land --surface ice\n"
      "  traceur land --falls 100 --set m2");
  verb->callback([a, &exit_code] { exit_code = land(*a); });
}

}  // namespace traceur::cli
