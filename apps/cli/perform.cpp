// traceur perform: a learnt family does what is asked of it, without practising again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli/arguments.h"
#include "apps/cli/csv.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/perturb.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"
#include "traceur/core/thread_pool.h"
#include "traceur/render/figure.h"
#include "traceur/render/film_strip.h"
#include "traceur/reproduce/statistics.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostInName = 8;  // tasks that the name of a strip lists

struct PerformArguments {
  std::string run;
  std::optional<std::string> tasks;
  int sweep = 0;
  bool perturb = false;
  std::uint64_t seed = 1;
  int threads = 0;
  int count = 8;
  bool json = false;
  bool no_picture = false;
};

/// The tasks of --task and their parameters: all are checked before the first is performed.
std::vector<practice::LearnedSkill> asked(const std::string& words,
                                          const practice::LearnedFamily& f) {
  std::vector<practice::LearnedSkill> tasks;
  for (std::string word : split(words, ',')) {
    word.erase(0, word.find_first_not_of(' '));
    word.erase(word.find_last_not_of(' ') + 1);
    tasks.push_back(f.at(toNumber(word, "--task")));
  }
  if (tasks.empty()) throw InputError("--task: expected a number, got none");
  return tasks;
}

/// The tasks that were asked for, one strip under the other.
int performTasks(const PerformArguments& a, const practice::LearnedFamily& f) {
  const skill::Task& t = f.skill->task;
  nlohmann::ordered_json j;
  std::vector<render::TitledRecording> recordings;
  bool failed = false;
  bool reached = true;
  const auto tasks = asked(*a.tasks, f);
  std::string name = "-perform";
  for (const practice::LearnedSkill& one : tasks) {
    if (tasks.size() <= kMostInName) name += fmt::format("-{:g}", one.task);
    render::TitledRecording recording;
    const Performance p{one.task, one.perform(&recording.recording)};
    failed = failed || p.rollout.failed();
    reached = reached && p.reached(t).value_or(true);
    j["performed"].push_back(toJson(p, t));
    recording.title = toText(p, t);
    if (!a.json) print("{}: {}\n", f.skill->name, recording.title);
    if (!a.no_picture) recordings.push_back(std::move(recording));
  }
  if (tasks.size() > kMostInName) name += fmt::format("-{}-tasks", tasks.size());
  if (!recordings.empty()) {
    const fs::path picture = beside(a.run, name + ".png");
    render::writePng(render::filmStrips(recordings, {.count = a.count, .columns = a.count}),
                     picture);
    j["picture"] = picture.string();
    if (!a.json) print("{}\n", picture.string());
  }
  if (a.json) printJson(j);
  return failed ? kFailed : exitCode(reached);
}

/// The whole range: a CSV and a figure of the error.
int sweep(const PerformArguments& a, const practice::LearnedFamily& f) {
  requireAchieved(*f.skill);
  const skill::Task& t = f.skill->task;
  const Eigen::VectorXd tasks =
      Eigen::VectorXd::LinSpaced(a.sweep, f.tasks[0], f.tasks[f.tasks.size() - 1]);
  std::vector<Performance> all(a.sweep);
  ThreadPool pool(a.threads);
  pool.forEach(a.sweep, [&](int i) { all[i] = {tasks[i], f.at(tasks[i]).perform()}; });

  std::string csv =
      fmt::format("# {} of {}, task and achieved in {}\ntask,achieved,error,cost,failed,ended\n",
                  printable(t.name), printable(f.skill->name), printable(t.unit));
  std::vector<double> errors;
  int fails = 0;
  int within = 0;
  render::Series line{"", {}, {}, render::Style::kLine, {}, {}, 0};
  render::Series bad{"failed", {}, {}, render::Style::kCrosses, {}, {}, 3};
  const double last = f.tasks[f.tasks.size() - 1];
  render::Series allowed{"tolerance",
                         {f.tasks[0], last},
                         {0, 0},
                         render::Style::kDashed,
                         {-t.tolerance, -t.tolerance},
                         {t.tolerance, t.tolerance},
                         render::kGrey};
  for (const Performance& p : all) {
    csv += fmt::format("{},{},{},{},{},{}\n", p.task, p.rollout.achieved, p.error(), p.rollout.cost,
                       p.rollout.failed() ? 1 : 0, csvField(p.rollout.ended));
    if (!p.rollout.failed() && !std::isnan(p.error())) errors.push_back(std::abs(p.error()));
    fails += p.rollout.failed();
    within += p.reached(t) == true;
    line.x.push_back(p.task);
    line.y.push_back(p.rollout.failed() ? NAN : p.error());
    if (!p.rollout.failed()) continue;
    bad.x.push_back(p.task);
    bad.y.push_back(std::isnan(p.error()) ? 0 : p.error());
  }
  const double median = errors.empty() ? NAN : reproduce::median(errors);
  const double largest = errors.empty() ? NAN : *std::max_element(errors.begin(), errors.end());
  const fs::path table = beside(a.run, "-sweep.csv");
  PendingFile file(table);
  file.write(csv);
  file.commit();
  const fs::path picture = beside(a.run, "-sweep.png");
  if (!a.no_picture) {
    render::Panel panel;
    panel.title = fmt::format("{}, {} tasks (trained ones dashed): {} within {:g} {}, {} failed",
                              f.skill->name, a.sweep, within, t.tolerance, t.unit, fails);
    panel.xlabel = fmt::format("{} asked [{}]", t.name, t.unit);
    panel.ylabel = fmt::format("error [{}]", t.unit);
    panel.series.push_back(allowed);
    panel.series.push_back(line);
    if (!bad.x.empty()) panel.series.push_back(bad);
    for (const double task : f.tasks) panel.marks.push_back({task, ""});
    render::Figure figure;
    figure.panels.push_back(std::move(panel));
    render::writeFigure(figure, picture);
  }
  if (a.json) {
    nlohmann::ordered_json j{{"tasks", a.sweep},
                             {"failed", fails},
                             {"within", within},
                             {"tolerance", t.tolerance},
                             {"median_error", numberOrNull(median)},
                             {"max_error", numberOrNull(largest)},
                             {"csv", table.string()}};
    if (!a.no_picture) j["picture"] = picture.string();
    printJson(j);
  } else {
    print("{}: {} tasks, {} failed, {} within {:g} {}", f.skill->name, a.sweep, fails, within,
          t.tolerance, t.unit);
    if (!errors.empty()) {
      print("; |error| of those that did not fail: median {:.3g} {}, largest {:.3g} {}", median,
            t.unit, largest, t.unit);
    }
    print("\n{}\n", table.string());
    if (!a.no_picture) print("{}\n", picture.string());
  }
  return fails > 0 ? kFailed : exitCode(within == a.sweep);
}

int perform(const PerformArguments& a) {
  const practice::LearnedFamily f = practice::learnedFamily(practice::Run::open(a.run));
  if (a.perturb) {
    return perturb(f, {.run = a.run,
                       .tasks = a.sweep,
                       .seed = a.seed,
                       .threads = a.threads,
                       .picture = !a.no_picture,
                       .json = a.json});
  }
  if (a.sweep > 0) return sweep(a, f);
  if (!a.tasks) throw InputError("expected --task or --sweep");
  return performTasks(a, f);
}

}  // namespace

void addPerform(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<PerformArguments>();
  CLI::App* verb = program.add_subcommand(
      "perform", "Let a learned family do a task of its range, without practising again.");
  verb->add_option("RUN", a->run, "Run file of traceur learn --tasks")->required();
  auto* task = verb->add_option("--task", a->tasks,
                                "What to ask for, in the skill's own unit; several, comma "
                                "separated, are drawn under each other");
  auto* sweep = verb->add_option("--sweep", a->sweep,
                                 "So many tasks, evenly over the range: a CSV and a figure")
                    ->check(CLI::Range(2, 100'000))
                    ->excludes(task);
  auto* perturb =
      verb->add_flag("--perturb", a->perturb,
                     "Sweep with another mass, friction, control delay and sensor noise than was "
                     "learned with: what the family withstands, as CSV and figure")
          ->needs(sweep);
  verb->add_option("--seed", a->seed, "Of the disturbances drawn at random")
      ->check(isSeed())
      ->capture_default_str()
      ->needs(perturb);
  verb->add_option("--count", a->count, "Film strip: panels of each task")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_flag("--no-picture", a->no_picture, "Draw nothing");
  verb->add_flag("--json", a->json, "Print one JSON object");
  verb->footer(
      "Examples:\n"
      "  traceur perform runs/jump-family-seed1.run --task 0.06\n"
      "  traceur perform runs/jump-family-seed1.run --task 0.03,0.055,0.08\n"
      "  traceur perform runs/jump-family-seed1.run --sweep 51\n"
      "  traceur perform runs/jump-family-seed1.run --sweep 11 --perturb\n"
      "Exit code: 0 done, 1 a performance failed (but for --perturb) or a file cannot be written, "
      "2 wrong use, 3 none failed, and a task was not reached within the tolerance.");
  verb->callback([a, &exit_code] { exit_code = perform(*a); });
}

}  // namespace traceur::cli
