// traceur fall: break a robot's fall by planned contacts, and see what else it could have done.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/verbs.h"
#include "fall_plan_text.h"
#include "traceur/core/error.h"
#include "traceur/core/is_file.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/fall/fall_experiment.h"
#include "traceur/fall/plan_library.h"
#include "traceur/render/figure.h"
#include "traceur/render/film_strip.h"
#include "traceur/render/video.h"
#include "traceur/skill/skill.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using fall::FallExperiment;

struct FallArguments {
  std::string robot;
  std::string stance;
  std::string direction = "forward";
  double push = 0;
  std::string strategy = "all";
  std::vector<std::string> without;
  double delay = 0;          // [s]
  double encoder_noise = 0;  // [rad]
  std::uint64_t seed = 1;
  std::string out;
  bool literal = false;
  bool once = false;
  bool exact = false;
  bool video = false;
  bool no_pictures = false;
  bool json = false;
};

/// What --strategy may say, and the ways to fall that it means.
std::map<std::string, std::vector<std::string>> strategies() {
  std::map<std::string, std::vector<std::string>> found;
  for (const fall::WayToFall& w : fall::allWays()) {
    found[std::string(w.name)] = {std::string(w.name)};
    found["all"].emplace_back(w.name);
  }
  return found;
}

/// falls.toml beside the robot's file.
std::shared_ptr<const fall::FallRobot> readFalls(const std::string& name) {
  const fs::path robot = skill::findRobot(name, fs::current_path());
  const fs::path file =
      robot.filename() == "falls.toml" ? robot : robot.parent_path() / "falls.toml";
  if (!isFile(file)) {
    throw InputError(
        fmt::format("{} has no falls.toml beside it: expected {}, which says which parts may touch "
                    "the ground; models/atlas/falls.toml is an example",
                    robot.string(), file.string()));
  }
  return std::make_shared<const fall::FallRobot>(fall::FallRobot::fromFile(file));
}

std::string planInWords(const fall::FallProblem& problem, const FallExperiment::Outcome& outcome) {
  const fall::FallPlan& plan = outcome.plan;
  const double since = outcome.trial.noticed;
  if (std::isinf(plan.cost)) return "no plan: nothing can stop this fall";
  if (plan.contacts.empty()) {
    return "no plan yet: the fall should stop by itself, so the pose is kept";
  }
  std::string words = fmt::format("plan: {} on the ground", problem.graph.nodes[0].name);
  for (const fall::PlannedContact& c : plan.contacts) {
    words +=
        fmt::format("; {} at {:.2f} s ({:.3g} N·s)", problem.graph.nodes[c.action.contact].name,
                    since + c.from.time + c.action.duration, c.impact.impulse);
  }
  words += fmt::format("; largest impulse {:.3g} N·s", plan.cost);
  return outcome.refused ? words + "; not followed: keeping the pose costs less" : words;
}

/// What makes another plan of the same fall, for names of files: "-without-hands-literal".
std::string variantOf(const FallArguments& a) {
  std::string variant;
  for (const std::string& node : a.without) variant += "-without-" + fileNamePart(node);
  if (a.literal) variant += "-literal";
  if (a.once) variant += "-once";
  if (a.exact) variant += "-exact";
  if (a.seed != 1) variant += fmt::format("-seed{}", a.seed);
  return variant;
}

struct Ran {
  std::string strategy;
  FallExperiment::Outcome outcome;
  sim::Recording recording;
};

void draw(const std::vector<Ran>& runs, const FallArguments& a, const fs::path& folder,
          const std::stop_token& stop) {
  makeFolder(folder);
  render::Figure impulse{.title = "Impulse of the last 10 ms", .panels = {{}}};
  impulse.panels[0].xlabel = "time [s]";
  impulse.panels[0].ylabel = "impulse [N s]";
  render::Figure com{.title = "Centre of mass from the first pivot", .panels = {{}}};
  com.panels[0].xlabel = "along the fall [m]";
  com.panels[0].ylabel = "height [m]";
  for (const Ran& r : runs) {
    const std::string& name = r.strategy;
    render::Series series{.label = name, .x = {}, .y = {}};
    for (const auto& [t, j] : r.outcome.trial.windowed) {
      series.x.push_back(t);
      series.y.push_back(j);
    }
    impulse.panels[0].series.push_back(series);
    if (r.strategy == "planned") {
      render::Series model{.label = "model", .x = {}, .y = {}, .style = render::Style::kDashed};
      double pivot = 0;
      for (const fall::PlannedContact& c : r.outcome.plan.contacts) {
        for (const fall::PendulumState& s : {c.from.pendulum, c.before}) {
          model.x.push_back(pivot + s.com().x());
          model.y.push_back(s.com().y());
        }
        pivot += c.impact.advance;
      }
      render::Series robot{.label = "robot", .x = {}, .y = {}};
      for (const fall::Vector2d& p : r.outcome.trial.com) {
        robot.x.push_back(p.x());
        robot.y.push_back(p.y());
      }
      com.panels[0].series = {model, robot};
    }
    if (r.strategy != "planned" && r.strategy != "hold" && runs.size() > 1) {
      continue;
    }
    if (stop.stop_requested()) return;
    const fs::path strip = folder / (name + ".png");
    render::FilmStripOptions options{.count = 10, .even = true};
    render::writePng(render::filmStrip(r.recording, options), strip);
    print("{}\n", strip.string());
    if (!a.video) continue;
    const fs::path video = folder / (name + ".mp4");
    render::writeVideo(r.recording, video, {.speed = 0.25});
    print("{}\n", video.string());
  }
  render::writeFigure(impulse, folder / "impulse.png");
  print("{}\n", (folder / "impulse.png").string());
  if (com.panels[0].series.empty()) return;
  render::writeFigure(com, folder / "com.png");
  print("{}\n", (folder / "com.png").string());
}

nlohmann::json ranJson(const Ran& r, const fall::FallProblem& problem) {
  const fall::FallTrial& t = r.outcome.trial;
  nlohmann::json j = {{"strategy", r.strategy},
                      {"impulse_Ns", t.impulse},
                      {"raw_impulse_Ns", t.raw_impulse},
                      {"peak_force_N", t.peak_force},
                      {"peak_torque_share", t.peak_torque},
                      {"peak_head_acceleration_m_s2", t.peak_head},
                      {"head_hit", t.head_hit},
                      {"diverged", t.diverged},
                      {"contacts", nlohmann::json::array()}};
  for (const fall::GroundContact& c : t.contacts) {
    j["contacts"].push_back({{"part", c.part}, {"time_s", c.time}, {"impulse_Ns", c.impulse}});
  }
  if (r.strategy != "planned") return j;
  j["plan"] = {{"impulse_Ns", r.outcome.plan.cost}, {"contacts", nlohmann::json::array()}};
  for (const fall::PlannedContact& c : r.outcome.plan.contacts) {
    j["plan"]["contacts"].push_back({{"part", problem.graph.nodes[c.action.contact].name},
                                     {"time_s", t.noticed + c.from.time + c.action.duration},
                                     {"impulse_Ns", c.impact.impulse}});
  }
  return j;
}

int runFall(const FallArguments& a) {
  Interrupt interrupt;  // before any other thread
  const auto falls = readFalls(a.robot);
  fall::FallSetup setup =
      falls->setup(a.stance.empty() ? falls->setups.front().stance : a.stance, a.direction);
  for (const std::string& node : a.without) setup = setup.without(node);
  fall::FallExperimentOptions options;
  options.problem.seed = a.seed;
  options.problem.stall = a.literal ? fall::Stall::kLiteral : fall::Stall::kStops;
  options.replans = !a.once;
  options.exact = a.exact;
  options.tables = fall::tableCache();
  FallExperiment experiment(falls, setup, options);
  const fall::Push push{a.push};
  std::vector<Ran> runs;
  const std::map<std::string, std::vector<std::string>> known = strategies();
  for (const std::string& strategy : known.at(a.strategy)) {
    Ran r{strategy, {}, {}};
    r.outcome = experiment.run(push, strategy,
                               {.delay = a.delay,
                                .encoder_noise = a.encoder_noise,
                                .seed = a.seed,
                                .recording = &r.recording});
    if (r.outcome.trial.diverged) {
      throw InputError(
          fmt::format("--push {:g}: the simulation of \"{}\" diverges", push.force, strategy));
    }
    if (!r.outcome.trial.fell) {
      const std::string words = fmt::format(
          "a push of {:g} N for {:g} s does not make {} fall {} from \"{}\": no plan is needed",
          push.force, push.duration, falls->robot->name, a.direction, setup.stance);
      if (a.json) {
        printJson(nlohmann::json{{"fell", false}, {"message", words}});
      } else {
        print("{}\n", words);
      }
      return kDone;
    }
    runs.push_back(std::move(r));
  }
  if (a.json) {
    nlohmann::json all = {{"robot", falls->robot->name},
                          {"stance", setup.stance},
                          {"direction", a.direction},
                          {"push_N", push.force},
                          {"without", a.without},
                          {"literal", a.literal},
                          {"fell", true},
                          {"noticed_s", runs.front().outcome.trial.noticed},
                          {"runs", nlohmann::json::array()}};
    for (const Ran& r : runs) all["runs"].push_back(ranJson(r, experiment.problem()));
    printJson(all);
    return kDone;
  }
  print("{} pushed {} with {:g} N for {:g} s from \"{}\" falls, noticed at {:.2f} s\n",
        falls->robot->name, a.direction, push.force, push.duration, setup.stance,
        runs.front().outcome.trial.noticed);
  double held = 0;
  for (const Ran& r : runs) {
    if (r.strategy == "planned") {
      print("{}\n", planInWords(experiment.problem(), r.outcome));
    }
    if (r.strategy == "hold") held = r.outcome.trial.impulse;
  }
  print("\n{:8}  {:>8}  {:>6}  {:>8}  {:>7}  {:>9}  {:>4}  contacts\n", "", "impulse", "/ hold",
        "force", "torque", "head", "head");
  print("{:8}  {:>8}  {:>6}  {:>8}  {:>7}  {:>9}  {:>4}\n", "", "N·s", "", "N", "/ limit", "m/s²",
        "hit");
  for (const Ran& r : runs) {
    const fall::FallTrial& t = r.outcome.trial;
    std::string contacts;
    for (const fall::GroundContact& c : t.contacts) {
      contacts += fmt::format("{}{} {:.2f} s", contacts.empty() ? "" : ", ", c.part, c.time);
    }
    print("{:8}  {:8.3g}  {:>6}  {:8.3g}  {:7.2f}  {:9.3g}  {:>4}  {}\n", r.strategy, t.impulse,
          held > 0 ? fmt::format("{:.2f}", t.impulse / held) : "", t.peak_force, t.peak_torque,
          t.peak_head, t.head_hit ? "yes" : "no", contacts);
  }
  if (a.no_pictures) return kDone;
  print("\n");
  const std::string folder =
      a.out.empty() ? fmt::format("runs/fall-{}-{}-{}-{:g}N{}", fileNamePart(falls->robot->name),
                                  fileNamePart(setup.stance), a.direction, push.force, variantOf(a))
                    : a.out;
  draw(runs, a, folder, interrupt.token());
  return interrupt.asked() ? kInterrupted : kDone;
}

int compileFalls(const FallArguments& a) {
  const auto falls = readFalls(a.robot);
  const fs::path folder = a.out.empty()
                              ? fs::path("runs") / ("fall-" + fileNamePart(falls->robot->name))
                              : fs::path(a.out);
  std::map<fs::path, std::string> files = {{folder / "fall_plan.h", kFallPlanHeader}};
  const auto write = [](const fs::path& file, std::string_view bytes) {
    PendingFile pending(file);
    pending.write(bytes);
    pending.commit();
    print("{}  {:.0f} kB\n", file.string(), static_cast<double>(bytes.size()) / 1e3);
  };
  fall::FallExperimentOptions options;
  options.problem.seed = a.seed;
  options.problem.stall = a.literal ? fall::Stall::kLiteral : fall::Stall::kStops;
  for (const std::string& node : a.without) {
    const bool known = std::any_of(falls->setups.begin(), falls->setups.end(),
                                   [&](const fall::FallSetup& s) { return s.graph.has(node); });
    if (!known) throw InputError(fmt::format("--without: no fall has a \"{}\"", node));
  }
  for (fall::FallSetup setup : falls->setups) {
    for (const std::string& node : a.without) {
      if (setup.graph.has(node)) setup = setup.without(node);
    }
    const FallExperiment experiment(falls, setup, options);
    const fall::FallProblem& problem = experiment.problem();
    const fall::LibraryLabel label{falls->robot->name, setup.stance, setup.direction};
    const fs::path file = folder / fmt::format("{}-{}{}.fallplan", fileNamePart(setup.stance),
                                               setup.direction, variantOf(a));
    if (files.contains(file)) {
      throw InputError(
          fmt::format("{}: two falls would be this file: expected stances that differ in letters, "
                      "digits, - or _, got another \"{}\"",
                      file.string(), setup.stance));
    }
    files[file] =
        fall::compileLibrary(problem, fall::cachedTable(problem, label, fall::tableCache()), label);
  }
  makeFolder(folder);  // only now: all or nothing
  for (const auto& [file, bytes] : files) write(file, bytes);
  return kDone;
}

}  // namespace

void addFall(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<FallArguments>();
  CLI::App* verb = program.add_subcommand(
      "fall", "Push a robot over; plan which parts touch the ground, and compare.");
  static constexpr const char* kRobot = "A name under models/, a robot's file, or its falls.toml";
  CLI::App* compile = verb->add_subcommand(
      "compile", "Write each stance's planner for a microcontroller: a file and a C header.");
  compile->add_option("--robot", a->robot, kRobot)->required();
  compile->add_option("--out", a->out, "Folder; default: runs/fall-ROBOT");
  static constexpr const char* kWithout = "Parts that must not be used, such as hands";
  static constexpr const char* kLiteral =
      "A fall that stalls between contacts has not ended, as printed";
  static constexpr const char* kSeed = "Of the random poses of the reach tables";
  compile->add_option("--without", a->without, kWithout);
  compile->add_flag("--literal", a->literal, kLiteral);
  compile->add_option("--seed", a->seed, kSeed)->check(isSeed())->capture_default_str();
  compile->callback([a, verb, &exit_code] {
    for (const CLI::Option* o : verb->get_options()) {
      if (o->count() > 0) {
        throw CLI::ArgumentMismatch("options of compile come after it, not " + o->get_name());
      }
    }
    exit_code = compileFalls(*a);
  });
  CLI::Option* robot = verb->add_option("--robot", a->robot, kRobot);
  CLI::Option* push = verb->add_option("--push", a->push, "Force on the trunk for 0.1 s [N]");
  push->check(CLI::Range(0.0, 1e6));
  verb->add_option("--stance", a->stance, "A pose of falls.toml; default: its first");
  verb->add_option("--direction", a->direction, "forward or backward")
      ->check(CLI::IsMember({"forward", "backward"}))
      ->capture_default_str();
  std::vector<std::string> names;
  names.reserve(strategies().size());
  for (const auto& [name, unused] : strategies()) names.push_back(name);
  verb->add_option("--strategy", a->strategy, "What the robot does")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  verb->add_option("--without", a->without, kWithout);
  verb->add_flag("--literal", a->literal, kLiteral);
  verb->add_flag("--once", a->once, "Follow the first plan to its end, as published");
  verb->add_flag("--exact", a->exact, "Plan exactly, some ten times slower");
  verb->add_option("--delay", a->delay, "From a state to the torque that answers it [s]")
      ->check(CLI::Range(0.0, 0.1));
  verb->add_option("--encoder-noise", a->encoder_noise,
                   "Of the angles that motors read, standard deviation [rad]")
      ->check(CLI::Range(0.0, 0.5));
  verb->add_option("--seed", a->seed, kSeed)->check(isSeed())->capture_default_str();
  verb->add_option("--out", a->out, "Folder for pictures; default: under runs/");
  verb->add_flag("--video", a->video, "Also videos, four times slower than real");
  verb->add_flag("--no-pictures", a->no_pictures, "Only the table");
  verb->add_flag("--json", a->json, "Print one JSON object, no pictures");
  verb->footer(
      "Examples:\n"
      "  traceur fall --robot bioloid-gp --push 5\n"
      "  traceur fall --robot atlas --stance two_feet --direction backward --push 500\n"
      "  traceur fall --robot bioloid-gp --push 8 --without hands --strategy planned --video\n"
      "  traceur fall --robot bioloid-gp --push 5 --delay 0.01 --encoder-noise 0.01\n"
      "  traceur fall compile --robot atlas --out plans");
  verb->callback([a, verb, compile, robot, push, &exit_code] {
    if (verb->got_subcommand(compile)) return;
    for (const CLI::Option* needed : {robot, push}) {
      if (needed->count() == 0) throw CLI::RequiredError(needed->get_name());
    }
    exit_code = runFall(*a);
  });
}

}  // namespace traceur::cli
