#include "traceur/reproduce/coach_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "traceur/coach/why.h"
#include "traceur/core/hash.h"
#include "traceur/core/temporary_folder.h"
#include "traceur/core/toml.h"
#include "traceur/sim/model.h"
#include "traceur/skill/skill.h"

namespace traceur::reproduce {
namespace {

/// One line of a script, and what it becomes.
struct PutIn {
  coach::Fault fault;
  const char* script;
  const char* right;
  const char* wrong;
};
constexpr int kOfAKind = 8;
constexpr std::array<PutIn, 40> kFaults = {{
    {coach::Fault::kTooWeak, "precision-jump", "SPEED near [1.2,2.4,0.0]",
     "SPEED near [0.15,0.3,0.0]"},
    {coach::Fault::kTooWeak, "monkey-vault", "SPEED NEAR [1.79,1.63,0]", "SPEED NEAR [0.1,0.1,0]"},
    {coach::Fault::kTooWeak, "turnaround-jump", "SPEED NEAR [0,2.2,0]", "SPEED NEAR [0,0.05,0]"},
    {coach::Fault::kTooWeak, "half-turn-jump", "SPEED NEAR [0.01,2.63,-0.00]",
     "SPEED NEAR [0,0.4,0]"},
    {coach::Fault::kTooWeak, "monkey-vault", "SPEED NEAR [1.59,1.86,0]", "SPEED NEAR [0.8,1.0,0]"},
    {coach::Fault::kTooWeak, "wall-backflip", "SPEED NEAR [-0.81,1.63,0]",
     "SPEED NEAR [-0.3,0.4,0]"},
    {coach::Fault::kTooWeak, "drop-and-roll", "SPEED NEAR [1.37,0.84,0]", "SPEED NEAR [0.5,0.5,0]"},
    {coach::Fault::kTooWeak, "wall-backflip", "SPEED NEAR [0.41,3.07,0]", "SPEED NEAR [0.3,2.0,0]"},
    {coach::Fault::kTooLate, "precision-jump", "POSE lean, shoulders 70deg",
     "POSE lean, shoulders 70deg\n  UNTIL COM leads BY 0.4 m"},
    {coach::Fault::kTooLate, "precision-jump", "POSE lean, shoulders 70deg",
     "POSE lean, shoulders 70deg\n  UNTIL 2.5 s"},
    {coach::Fault::kTooLate, "turnaround-jump", "UNTIL COM leads BY 0.03 m",
     "UNTIL COM leads BY 0.4 m"},
    {coach::Fault::kTooLate, "half-turn-jump", "UNTIL 0.31 s", "UNTIL COM leads BY 0.4 m"},
    {coach::Fault::kTooLate, "monkey-vault", "POSE tuck IN 0.09 s, hips 51deg",
     "POSE tuck IN 0.9 s, hips 51deg"},
    {coach::Fault::kTooLate, "drop-and-roll", "UNTIL root turns BY 58 deg",
     "UNTIL root turns BY 130 deg"},
    {coach::Fault::kTooLate, "wall-backflip", "POSE tuck IN 0.05 s", "POSE tuck IN 0.8 s"},
    {coach::Fault::kTooLate, "wall-backflip", "UNTIL root turns BY 276 deg",
     "UNTIL root turns BY 350 deg"},
    {coach::Fault::kSlips, "precision-jump", "Start: stand",
     "Start: stand\nScene: floor friction 0.1"},
    {coach::Fault::kSlips, "turnaround-jump", "Start: stand",
     "Start: stand\nScene: floor friction 0.15"},
    {coach::Fault::kSlips, "half-turn-jump", "Start: stand",
     "Start: stand\nScene: floor friction 0.2"},
    {coach::Fault::kSlips, "monkey-vault", "Scene: box", "Scene: floor friction 0.25; box"},
    {coach::Fault::kSlips, "drop-and-roll", "Start: stand",
     "Start: stand\nScene: floor friction 0.2"},
    {coach::Fault::kSlips, "wall-backflip", "Scene: wall", "Scene: floor friction 0.12; wall"},
    {coach::Fault::kSlips, "turnaround-jump", "Start: stand",
     "Start: stand\nScene: floor friction 0.08"},
    {coach::Fault::kSlips, "half-turn-jump", "Start: stand",
     "Start: stand\nScene: floor friction 0.1"},
    {coach::Fault::kOutOfReach, "precision-jump", "SPEED near [1.2,2.4,0.0]",
     "SPEED near [7.2,14.4,0.0]"},
    {coach::Fault::kOutOfReach, "drop-and-roll", "spin about z LESS THAN -2.88",
     "spin about z LESS THAN -12"},
    {coach::Fault::kOutOfReach, "turnaround-jump", "spin about y GREATER THAN 1.5",
     "spin about y GREATER THAN 12"},
    {coach::Fault::kOutOfReach, "half-turn-jump", "PLACE COM NEAR [0.024,0.775,0]",
     "PLACE COM NEAR [0.6,0.775,0]"},
    {coach::Fault::kOutOfReach, "monkey-vault", "at [0.725, 0.275, 0]", "at [1.6, 0.275, 0]"},
    {coach::Fault::kOutOfReach, "monkey-vault", "spin about z LESS THAN -0.72",
     "spin about z LESS THAN -9"},
    {coach::Fault::kOutOfReach, "drop-and-roll", "UNTIL COM leads BY 0.29 m",
     "UNTIL COM leads BY 0.8 m"},
    {coach::Fault::kOutOfReach, "wall-backflip", "at [0.85, 0, 0]", "at [2.2, 0, 0]"},
    {coach::Fault::kContradiction, "precision-jump", "head IN FRONT OF root",
     "head IN FRONT OF root\n  head BEHIND root"},
    {coach::Fault::kContradiction, "precision-jump", "spin about z FORWARD",
     "spin about z FORWARD\n  spin about z GREATER THAN 1"},
    {coach::Fault::kContradiction, "turnaround-jump", "spin about y GREATER THAN 1.5",
     "spin about y GREATER THAN 1.5\n  spin about y LESS THAN -1"},
    {coach::Fault::kContradiction, "half-turn-jump", "BALANCE", "BALANCE\n  SPEED NEAR [2,0,0]"},
    {coach::Fault::kContradiction, "monkey-vault", "head IN FRONT OF root",
     "head IN FRONT OF root\n  head BEHIND root"},
    {coach::Fault::kContradiction, "monkey-vault", "spin about z LESS THAN -0.72",
     "spin about z LESS THAN -0.72\n  spin about z GREATER THAN 1"},
    {coach::Fault::kContradiction, "drop-and-roll", "spin about z LESS THAN -2.88",
     "spin about z LESS THAN -2.88\n  spin about z GREATER THAN 1"},
    {coach::Fault::kContradiction, "wall-backflip", "head IN FRONT OF root",
     "head IN FRONT OF root\n  head BEHIND root"},
}};
constexpr std::array kKinds = {coach::Fault::kTooWeak, coach::Fault::kTooLate, coach::Fault::kSlips,
                               coach::Fault::kOutOfReach, coach::Fault::kContradiction};
static_assert(kFaults.size() == kOfAKind * kKinds.size());

/// Of the coach, and of those who are told what the coach found.
constexpr std::uint64_t kCoach = 41000;
constexpr std::array<std::uint64_t, 5> kOthers = {41100, 41200, 41300, 41400, 41500};
constexpr int kTries = 16;  // as `traceur coach --why`

std::filesystem::path fileOf(const char* script) {
  return skill::findSkill("athlete", "jump-leaning").parent_path() /
         (std::string(script) + ".coach");
}

coach::Script scriptOf(const PutIn& f) {
  const std::filesystem::path file = fileOf(f.script);
  std::string text = readFile(file);
  const size_t at = text.find(f.right);
  assert(at != std::string::npos && text.find(f.right, at + 1) == std::string::npos);
  text.replace(at, std::string(f.right).size(), f.wrong);
  return coach::Script::fromText(text, file);
}

coach::LessonOptions optionsFor(std::uint64_t seed, const std::stop_token& stop) {
  return {.seed = seed, .until_it_succeeds = true, .threads = 1, .stop = stop};
}
bool succeeds(const coach::Lesson& lesson) {
  return !lesson.whole.empty() && !lesson.failed;
}

/// The share of the others who learn it.
double shareOf(const coach::Script& script, const std::stop_token& stop) {
  int learned = 0;
  for (const std::uint64_t seed : kOthers) {
    const TemporaryFolder folder;
    learned += succeeds(coach::practise(script, folder.path(), optionsFor(seed, stop))) ? 1 : 0;
  }
  return learned / static_cast<double>(kOthers.size());
}

/// What the coach is told of a script that is not learned.
struct Advice {
  bool failed = false;
  coach::Fault named = coach::Fault::kUnknown;
  std::vector<coach::Remedy> helps;  ///< one, or none
};
Advice adviceOn(const PutIn& f, const std::stop_token& stop) {
  const coach::Script script = scriptOf(f);
  const TemporaryFolder folder;
  const coach::LessonOptions options = optionsFor(kCoach, stop);
  const coach::Lesson lesson = coach::practise(script, folder.path(), options);
  if (lesson.phases.empty() || !lesson.phases.back().failed) return {};
  const coach::Why w = coach::why(script, lesson);
  const auto helps = coach::whatHelps(script, folder.path(), w, options, kTries);
  Advice a{.failed = true, .named = w.seen, .helps = {}};
  if (helps) a.helps.push_back(helps->remedy);
  if (helps && a.named == coach::Fault::kUnknown) a.named = helps->remedy.against;
  return a;
}
/// Two columns are about one piece of advice, which takes a minute: the first to ask makes it.
Advice adviceOnce(size_t fault, const std::stop_token& stop) {
  static std::mutex mutex;
  static std::map<size_t, std::shared_future<Advice>> all;
  std::promise<Advice> promise;
  std::shared_future<Advice> advice;
  bool mine = false;
  {
    const std::scoped_lock lock(mutex);
    const auto found = all.find(fault);
    mine = found == all.end();
    advice = mine ? promise.get_future().share() : found->second;
    if (mine) all.emplace(fault, advice);
  }
  if (mine) {
    try {
      promise.set_value(adviceOn(kFaults[fault], stop));
    } catch (...) {
      promise.set_exception(std::current_exception());
    }
  }
  return advice.get();
}

std::string faultyScripts() {
  Hash hash;
  std::string scripts;
  for (const PutIn& f : kFaults) hash.add(scriptOf(f).text);
  hash.add(fmt::format("{}", scriptOf(kFaults[0]).model->fingerprint()));
  return fmt::format("{} athlete {:08x}", sim::engineVersion(), hash.value() & 0xffffffff);
}

}  // namespace

Table coachFaults() {
  Table t;
  t.name = "coach-faults";
  t.title =
      "Faults put into a coach's scripts: named, and mended by what is advised. Not in the paper.";
  t.protocol =
      "Eight scripts of each kind, those shipped with one line made wrong. As it is: the share of "
      "five seeds (41100 to 41500) that learn all phases and then do all of it; the last phase "
      "ends "
      "with its first trial that succeeds. Another seed (41000) tries the likeliest other words, "
      "16 "
      "at most, until it learns with some, or takes those that get furthest. Named: what is seen, "
      "or what those words are against, is what was put in. Advised: the share of the five who "
      "learn the script with those words. Missed: the seed that asks learns the script as it is, "
      "or nothing that was tried helps.";
  for (const coach::Fault kind : kKinds) {
    t.rows.push_back({std::string(coach::nameOf(kind)), "", "share"});
  }
  for (const char* column : {"as it is", "named", "advised"}) {
    t.columns.push_back({column, 1, kOfAKind, {}});
  }
  t.made_with = faultyScripts;
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token& stop) -> Outcome {
    const size_t fault = static_cast<size_t>(row) * kOfAKind + (seed - 1) % kOfAKind;
    const PutIn& f = kFaults[fault];
    if (column == 0) return {.value = shareOf(scriptOf(f), stop)};
    const Advice advice = adviceOnce(fault, stop);
    if (column == 1) {
      return {.value = advice.named == f.fault ? 1.0 : 0.0, .missed = !advice.failed};
    }
    if (advice.helps.empty()) return {.value = 0, .missed = true};
    return {.value = shareOf(coach::withRemedy(scriptOf(f), advice.helps[0]), stop)};
  };
  return t;
}

}  // namespace traceur::reproduce
