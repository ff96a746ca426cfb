// traceur coach: teach a skill in words.
#include <fmt/format.h>

#include <array>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli/arguments.h"
#include "apps/cli/coach_session.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/pictures.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/clip/bvh.h"
#include "traceur/coach/demonstration.h"
#include "traceur/coach/lesson.h"
#include "traceur/coach/why.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"
#include "traceur/practice/run.h"
#include "traceur/render/film_strip.h"
#include "traceur/skill/skill.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kTries = 16;  // of remedies: a minute or two for a jump [ours]

struct CoachArguments {
  std::string script;
  std::string out;
  coach::LessonOptions options;
  std::string clip;  // what a script is to be written from
  std::string robot = "athlete";
  bool readings = false;
  bool session = false;
  bool why = false;
  bool quiet = false;
  bool json = false;
};

Json toJson(const coach::Reading& r) {
  return {{"phase", r.phase},           {"line", r.line}, {"said", r.said},
          {"means", r.means},           {"rigs", r.rigs}, {"term", r.term},
          {"constraint", r.constraint}, {"note", r.note}};
}

void tellReadings(const std::vector<coach::Reading>& readings) {
  for (const coach::Reading& r : readings) {
    std::vector<std::string> what = r.rigs;
    if (!r.term.empty()) what.push_back("min " + r.term);
    if (!r.constraint.empty()) what.push_back("must: " + r.constraint);
    print("  {:<34}{}\n", printable(r.means), printable(join(what, "; ")));
    if (!r.note.empty()) print("  {:<34}({})\n", "", printable(r.note));
  }
}

int showReadings(const CoachArguments& a, const coach::Script& script) {
  Json all = Json::array();
  for (size_t k = 0; k < script.phases.size(); ++k) {
    const auto compiled = coach::compilePhase(script, k, {}, {});
    if (!a.json) print("{}\n", script.phases[k].name);
    if (!a.json) tellReadings(compiled.readings);
    for (const coach::Reading& r : compiled.readings) all.push_back(toJson(r));
  }
  if (a.json) printJson(Json{{"script", script.name}, {"instructions", all}});
  return kDone;
}

/// Of the phase that was not learned.
std::optional<coach::Why> whyOf(const coach::Lesson& lesson, const coach::Script& script) {
  const auto& phases = lesson.phases;
  if (phases.empty() || !phases.back().failed || lesson.interrupted) return {};
  return coach::why(script, lesson);
}

Json toJson(const coach::Remedy& r) {
  Json j{{"phase", r.phase}, {"say", r.say}, {"against", coach::nameOf(r.against)}};
  if (r.instead_of.line > 0) {
    j["instead_of"] = {{"line", r.instead_of.line}, {"text", r.instead_of.text}};
  }
  return j;
}

Json toJson(const coach::Lesson& lesson, const coach::Script& script) {
  Json j{{"script", script.name},   {"instructions", script.instructions},
         {"trials", lesson.trials}, {"run", lesson.whole.string()},
         {"ended", lesson.ended},   {"failed", lesson.whole.empty() || lesson.failed}};
  for (const coach::PhaseLesson& p : lesson.phases) {
    Json terms;
    for (const practice::Quantity& q : p.terms) terms[q.name] = numberOrNull(q.value);
    j["phases"].push_back({{"phase", p.phase},
                           {"trials", p.trials},
                           {"cost", numberOrNull(p.cost)},
                           {"ended", p.ended},
                           {"failed", p.failed},
                           {"terms", terms},
                           {"skill", p.skill.string()},
                           {"run", p.run.string()}});
  }
  if (const auto w = whyOf(lesson, script)) {
    j["why"] = {{"what", w->what}, {"often", w->often}, {"because", w->because}};
    if (!w->remedies.empty()) j["why"]["try"] = toJson(w->remedies[0]);
  }
  return j;
}

void report(const coach::Lesson& lesson, const coach::Script& script) {
  print("{}: {} instructions, {} trials\n", script.name, script.instructions, lesson.trials);
  for (const coach::PhaseLesson& p : lesson.phases) {
    print("{:<16} {:>4} trials  cost {:<9.3g} {}\n", p.phase, p.trials, p.cost,
          p.ended.empty() ? "stopped"
          : p.failed      ? "fails: " + p.ended
                          : "done");
    for (const practice::Quantity& q : p.terms) {
      if (q.name != "failed") print("  {:<34}{:.3g}\n", q.name, q.value);
    }
  }
  if (const auto w = whyOf(lesson, script)) {
    print("why: {}\n     {}\n", printable(w->what), w->often);
    if (!w->because.empty()) print("     {}\n", printable(w->because));
    if (!w->remedies.empty()) print("try: {}\n", printable(told(w->remedies[0])));
  }
  if (lesson.whole.empty()) return;
  if (lesson.failed) print("all in one: fails: {}\n", lesson.ended);
  print("  run file   {0}\n  film       traceur render {0}\n", lesson.whole.string());
}

/// Writes the script from what a clip shows.
int writeScript(const CoachArguments& a) {
  if (std::filesystem::exists(a.script)) {
    throw InputError(
        fmt::format("{}: is there already; a script from a clip is a new file", a.script));
  }
  const clip::Clip clip = clip::fromBvh(readFile(a.clip), a.clip);
  const auto robot =
      std::make_shared<sim::Robot>(sim::Robot::fromFile(skill::findRobot(a.robot, ".")));
  const auto model = sim::Model::fromScene({.robot = robot});
  const std::string name = std::filesystem::path(a.clip).filename().string();
  const std::string text = [&] {
    try {
      return coach::scriptOf(clip, model, "From " + printable(name));
    } catch (const InputError& e) {
      throw InputError(fmt::format("{}: {}", a.clip, e.what()));
    }
  }();
  PendingFile out(a.script);
  out.write(text);
  out.commit();
  if (a.json) {
    printJson(Json{{"script", a.script}});
  } else if (!a.quiet) {
    print("{}\n", a.script);
  }
  return kDone;
}

using NamedFolder = std::pair<std::string, fs::path>;

/// What two lessons' phases came to, and both motions, one under the other.
void compare(const coach::Script& script, const NamedFolder& a, const NamedFolder& b,
             const fs::path& picture) {
  std::map<std::string, std::array<std::string, 2>> costs;  // by the phase's file
  for (const size_t side : {0, 1}) {
    for (const auto& entry : fs::directory_iterator(side == 0 ? a.second : b.second)) {
      const std::string file = entry.path().filename().string();
      const bool phase = std::isdigit(static_cast<unsigned char>(file[0])) &&
                         file.ends_with(".run") && !file.ends_with(".before.run");
      if (!phase) continue;
      const auto best = practice::Run::open(entry.path()).progress().best;
      if (best)
        costs[file.substr(0, file.size() - 4)][side] = fmt::format("{:.3g}", best->evaluation.cost);
    }
  }
  print("{:<20} {:>12} {:>12}\n", "cost", printable(a.first), printable(b.first));
  for (const auto& [phase, of] : costs) {
    print("{:<20} {:>12} {:>12}\n", printable(phase), of[0].empty() ? "-" : of[0],
          of[1].empty() ? "-" : of[1]);
  }
  std::vector<render::TitledRecording> recordings;
  for (const auto& [name, folder] : {a, b}) {
    const fs::path run = folder / (fileNamePart(script.name) + ".run");
    if (!fs::exists(run)) continue;  // a phase was not learned
    recordings.push_back({name, practice::Run::open(run).recording()});
  }
  if (recordings.empty()) return;
  static constexpr int kPanels = 8;
  render::writePng(render::filmStrips(recordings, {.count = kPanels, .columns = kPanels}), picture);
  print("  film strips {}\n", picture.string());
}

int coachScript(const CoachArguments& a) {
  if (!a.clip.empty()) return writeScript(a);
  Interrupt interrupt;
  const coach::Script script = coach::Script::fromFile(a.script);
  if (!a.quiet && !a.json) {
    for (const Mistake& n : script.notes) {
      note("note: {}:{}:{}: {}\n", n.file, n.line, n.column, n.text);
    }
  }
  if (a.readings) return showReadings(a, script);
  coach::LessonOptions options = a.options;
  const std::string folder =
      a.out.empty() ? fmt::format("runs/{}-seed{}", fileNamePart(script.name), options.seed)
                    : a.out;
  const auto practise = [&](const coach::Script& now) {
    std::optional<SearchLine> line;
    std::string shown;
    options.on_progress = [&](const std::string& phase, int budget, const optim::Progress& p) {
      if (phase != shown) {
        if (line) line->end();
        line.emplace(phase, budget, false, a.quiet || a.json);
        shown = phase;
      }
      line->show(p, {});
    };
    options.stop = interrupt.token();
    coach::Lesson lesson = coach::practise(now, folder, options);
    interrupt.release();  // at a prompt Ctrl-C ends the program
    if (line) line->end();
    return lesson;
  };
  // Tries what may help, and tells what does.
  const auto help = [&](const coach::Script& now, const coach::Why& w) {
    Interrupt while_trying;
    coach::LessonOptions o = a.options;
    o.stop = while_trying.token();
    int tried = 0;
    auto found = coach::whatHelps(now, folder, w, o, kTries, [&](const coach::Remedy& r) {
      ++tried;
      if (!a.quiet && !a.json) note("trying: {}\n", printable(told(r)));
    });
    if (a.json || a.quiet) return found;
    if (found) {
      print("helps: {}\n", printable(told(found->remedy)));
      if (found->all) {
        print("       with it all of it is learned (seed {}): {}\n", a.options.seed,
              coach::nameOf(found->remedy.against));
      } else {
        print("       with it {} of {} phases are learned (seed {}), instead of {}: {}\n",
              found->learned, now.phases.size(), a.options.seed, w.failed,
              coach::nameOf(found->remedy.against));
      }
    } else {
      print("none of {} that were tried helps\n", tried);
    }
    return found;
  };
  if (a.session) {
    options.resume = true;
    const SessionHooks hooks{
        .practise = practise,
        .report = [](const auto& lesson, const auto& now) { report(lesson, now); },
        .help = [&](const auto& now, const auto& w) { help(now, w); },
        .draw =
            [&](const coach::Lesson& lesson) {
              const std::string strip = fmt::format("{}/strip.png", folder);
              draw(practice::Run::open(lesson.whole).recording(), strip, {.size = {300, 300}},
                   interrupt, true);
              print("  film strip {}\n", strip);
            },
        .compare =
            [&](const auto& one, const auto& other) {
              compare(
                  script, one, other,
                  fs::path(folder) / "branches" / fmt::format("{}-{}.png", one.first, other.first));
            }};
    return runSession(script, folder, std::cin, hooks);
  }
  const coach::Lesson lesson = practise(script);
  if (!a.json && !a.quiet) report(lesson, script);
  Json told = a.json ? toJson(lesson, script) : Json();
  if (const auto w = whyOf(lesson, script); a.why && w) {
    const auto helps = help(script, *w);
    told["helps"] = helps ? toJson(helps->remedy) : Json();
    if (helps) told["helps"]["learned"] = helps->learned;
    if (helps) told["helps"]["all"] = helps->all;
  }
  if (a.json) printJson(told);
  if (lesson.interrupted) {
    note("stopped; the same command with --resume goes on\n");
    return kInterrupted;
  }
  return lesson.whole.empty() || lesson.failed ? kNotReached : kDone;
}

}  // namespace

void addCoach(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<CoachArguments>();
  CLI::App* verb =
      program.add_subcommand("coach", "Teach a skill in words: practise a script of instructions.");
  verb->add_option("SCRIPT", a->script, "Script (.coach)")->required();
  verb->add_option("--seed", a->options.seed, "Equal seeds give equal runs")
      ->check(isSeed())
      ->capture_default_str();
  verb->add_option(
          "--budget", a->options.budget,
          "Trials of a phase for each number that practice moves; default: the script's, 48")
      ->check(CLI::Range(1, 1'000'000));
  verb->add_option("--threads", a->options.threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--out", a->out, "Folder; default: runs/SCRIPT-seedN");
  verb->add_flag("--resume", a->options.resume, "Go on with what is in the folder");
  verb->add_option("--from", a->options.from,
                   "Another script's folder: phases begin with what was found there")
      ->check(CLI::ExistingDirectory);
  auto* demonstration = verb->add_option(
      "--demonstration", a->clip,
      "Only write SCRIPT, from the jump that a .bvh file shows: edit it, practise it");
  verb->add_option("--robot", a->robot, "Of a demonstration: who is to do it")
      ->needs(demonstration)
      ->capture_default_str();
  verb->add_flag("--readings", a->readings,
                 "Only say what each instruction is understood as, and what it adds");
  verb->add_flag("--why", a->why,
                 "Where a phase is not learned: try what may help, and tell what does");
  verb->add_flag("--session", a->session,
                 "Go on in the folder with a prompt: type an instruction, see what comes of it")
      ->excludes("--readings");
  for (const char* other : {"--readings", "--session", "--resume", "--from", "--out"}) {
    demonstration->excludes(other);
  }
  verb->add_flag("--quiet", a->quiet, "Print nothing but errors");
  verb->add_flag("--json", a->json, "Print one JSON object at the end");
  std::string phases = "Phases:\n";
  for (const coach::PhaseKind& k : coach::phaseKinds()) {
    phases += fmt::format("  {:<16}{}\n", k.name, k.help);
  }
  verb->footer(
      phases +
      "Examples:\n"
      "  traceur coach skills/athlete/precision-jump.coach\n"
      "  traceur coach skills/athlete/precision-jump.coach --readings\n"
      "  traceur coach skills/athlete/precision-jump.coach --session\n"
      "  traceur coach mine.coach --resume --why\n"
      "  traceur coach skills/athlete/precision-jump-rail.coach --from runs/precision-jump-seed1\n"
      "  traceur coach mine.coach --demonstration clip.bvh\n"
      "Exit code: 0 done, 1 failed, 2 wrong use, 3 a phase was not learned, 130 stopped by "
      "Ctrl-C.");
  verb->callback([a, &exit_code] { exit_code = coachScript(*a); });
}

}  // namespace traceur::cli
