// traceur land: let a body fall and see how it lands.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/pictures.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/landing/falls.h"
#include "traceur/practice/learned.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using landing::Fall;
using landing::Share;
using landing::Verdict;
using skill::Skill;

/// A way to land, and the skill that says it: skills/ROBOT/FILE.toml.
struct Strategy {
  const char* name;
  const char* file;
};
constexpr Strategy kStrategies[] = {{"feet", "land"}, {"ragdoll", "ragdoll"}};

struct Arguments {
  std::string robot = "human";
  std::string strategy = "feet";
  std::optional<double> height;
  std::vector<double> velocity, spin;
  std::optional<double> lean;
  std::vector<std::string> given;
  std::string from;
  int falls = 0;
  std::string set = "m2";
  std::uint64_t seed = 1;
  std::optional<double> time_step, compliance, friction;
  int threads = 0;
  std::vector<std::string> files;
  bool json = false;
};

Eigen::VectorXd conditionsOf(const Skill& skill, const Arguments& a) {
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
  for (const std::string& text : a.given) assign(x, conditions, text, "--given");
  return x;
}

Json toJson(const Fall& f) {
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
          {"head_force", v.head_force},
          {"ended", f.rollout.ended},
          {"time", f.rollout.time},
          {"cost", numberOrNull(f.rollout.cost)},
          {"hash", fmt::format("{:016x}", f.rollout.hash)}};
}

void print(const Skill& skill, const Fall& f) {
  const Verdict& v = f.verdict;
  cli::print("{}: {}\n", skill.name,
             v.safe()               ? "rolls, stands, and spares the head"
             : v.stands()           ? "rolls and stands"
             : v.rolled.has_value() ? "rolls, and does not stand"
                                    : "does not roll");
  const auto time = [](const char* what, const std::optional<double>& t) {
    if (t) cli::print("{:<16} {:.3f} s\n", what, *t);
  };
  time("touches down", v.touch_down);
  if (v.touch_down) {
    cli::print("{:<16} {:.2f} m/s down, somersault {:.2f} rad\n", "", v.touch_down_speed,
               v.touch_down_somersault);
  }
  time("has rolled", v.rolled);
  time("has stood", v.stood);
  cli::print("{:<16} {:.0f} N at most\n", "on the head", v.head_force);
  cli::print("{:<16} {} after {:.2f} s\n", "ended", f.rollout.ended, f.rollout.time);
}

int many(const Arguments& a, const std::shared_ptr<const Skill>& skill,
         const Eigen::VectorXd& parameters) {
  const landing::FallSet& set = landing::findFallSet(a.set);
  const auto conditions = landing::drawFalls(*skill, set, a.falls, a.seed);
  const std::vector<Fall> falls = landing::fallAll(skill, parameters, conditions, a.threads);
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
    Json row = toJson(falls[k]);
    Json under;
    for (size_t c = 0; c < skill->conditions.size(); ++c) {
      under[skill->conditions[c].name] = conditions[k][static_cast<Eigen::Index>(c)];
    }
    row["conditions"] = std::move(under);
    rows.push_back(std::move(row));
  }
  if (a.json) {
    printJson(Json{{"set", set.name}, {"seed", a.seed}, {"falls", std::move(rows)}});
    return kDone;
  }
  cli::print("{} falls of {} ({})\n", a.falls, set.name, set.help);
  const auto tell = [](const char* what, const Share& s) {
    cli::print("{:<16} {:>3} of {}  [{:.0f} %, {:.0f} %]\n", what, s.of, s.all, 100 * s.low(),
               100 * s.high());
  };
  tell("roll", rolled);
  tell("stand", stands);
  tell("safe", safe);
  tell("stand 5 s later", later);
  return kDone;
}

int land(const Arguments& a) {
  Interrupt interrupt;  // before any other thread
  const auto strategy = std::find_if(std::begin(kStrategies), std::end(kStrategies),
                                     [&](const Strategy& s) { return a.strategy == s.name; });
  const fs::path file = skill::findSkill(a.robot, strategy->file);
  skill::Disturbance changed;
  changed.time_step = a.time_step;
  changed.compliance = a.compliance;
  changed.friction = a.friction;
  const auto skill = Skill::fromText(readFile(file), file, changed);
  Eigen::VectorXd parameters = skill->initialParameters();
  if (!a.from.empty()) {
    parameters = initialOf(
        practice::beginningFrom(practice::Run::open(a.from), skill->parameters, skill->task.initial)
            .parameters);
  }
  if (a.falls > 0) {
    if (!a.files.empty()) throw InputError("--out: pictures are of one fall: expected no --falls");
    return many(a, skill, parameters);
  }
  for (const fs::path picture : a.files) requirePicture(picture);
  const Eigen::VectorXd conditions = conditionsOf(*skill, a);
  skill::Runner runner(skill);
  landing::Judge judge(skill->model);
  runner.watchedBy({&judge}, true);
  runner.under(conditions);
  sim::Recording recording;
  Fall fall;
  fall.rollout = runner.run(parameters, skill->task.initial, &recording);
  fall.verdict = judge.verdict();
  for (const fs::path picture : a.files) {
    if (!draw(recording, picture, {}, interrupt, a.json)) return kInterrupted;
  }
  if (a.json) {
    printJson(toJson(fall));
  } else {
    print(*skill, fall);
    for (const std::string& picture : a.files) cli::print("{}\n", picture);
  }
  return kDone;
}

}  // namespace

void addLand(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb =
      program.add_subcommand("land", "Let a body fall: fly, meet the ground, roll, get up, stand.");
  std::vector<std::string> names;
  for (const Strategy& s : kStrategies) names.emplace_back(s.name);
  verb->add_option("--robot", a->robot, "A name under models/")->capture_default_str();
  verb->add_option("--strategy", a->strategy, "What meets the ground first")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
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
  verb->add_option("--time-step", a->time_step, "Of the simulation [s]; default: the skill's")
      ->check(CLI::Range(1e-5, 0.005));
  verb->add_option("--compliance", a->compliance, "Of the ground [s]; default: the skill's")
      ->check(CLI::Range(1e-4, 0.2));
  verb->add_option("--friction", a->friction, "Of the ground; default: the skill's")
      ->check(CLI::Range(0.0, 10.0));
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--out", a->files, ".png for a film strip, .mp4 for a video. One for each")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_flag("--json", a->json, "Print one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur land --height 3 --velocity 2.5 --out land.png\n"
      "  traceur land --height 4 --velocity 2 0.3 --spin 1\n"
      "  traceur land --falls 100 --set m2");
  verb->callback([a, &exit_code] { exit_code = land(*a); });
}

}  // namespace traceur::cli
