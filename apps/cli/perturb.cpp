#include "apps/cli/perturb.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli/csv.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/performance.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/practice/withstands.h"
#include "traceur/render/figure.h"
#include "traceur/reproduce/statistics.h"

namespace traceur::cli {
namespace {

/// What became of a kind's trials.
struct Count {
  int trials = 0;
  int failed = 0;
  int within = 0;              // the task's tolerance
  std::vector<double> errors;  // of those that did not fail
};

}  // namespace

int perturb(const practice::LearnedFamily& f, const PerturbOptions& o) {
  const skill::Task& task = f.skill->task;
  requireAchieved(*f.skill);
  const Eigen::VectorXd tasks =
      Eigen::VectorXd::LinSpaced(o.tasks, f.tasks[0], f.tasks[f.tasks.size() - 1]);
  std::vector<practice::LearnedSkill> performances;
  for (const double t : tasks) performances.push_back(f.at(t));
  Interrupt interrupt;  // before any other thread
  std::optional<ProgressLine> line;
  const std::stop_token stop = interrupt.token();
  const std::vector<practice::Withstood> cases = practice::withstands(
      performances,
      {.seed = o.seed, .threads = o.threads, .stop = stop, .on_done = [&](int done, int of) {
         if (done == 0) {
           line.emplace("perturb", of, 0, o.json);
           return;
         }
         line->update(done, fmt::format("{} tasks each", o.tasks), "robots/s");
       }});
  line.reset();
  interrupt.release();
  if (stop.stop_requested()) {
    note("stopped; nothing was written\n");
    return kInterrupted;
  }

  std::string csv = fmt::format(
      "# {} of {}, task and achieved in {}; delay in s, noise in rad and m/s\n"
      "kind,mass,friction,delay,encoder_noise,velocity_noise,task,achieved,error,failed,ended\n",
      printable(task.name), printable(f.skill->name), printable(task.unit));
  const std::vector<practice::DisturbanceKind>& kinds = practice::disturbanceKinds();
  std::vector<Count> counts(kinds.size());
  render::Figure figure;
  figure.title = fmt::format("{}: what the family withstands", f.skill->name);
  figure.columns = 2;
  figure.width = 1100;
  figure.panel_height = 280;
  for (size_t k = 0; k < kinds.size(); ++k) {
    render::Series good{"within tolerance", {}, {}, render::Style::kPoints, {}, {}, 0};
    render::Series off{"off", {}, {}, render::Style::kPoints, {}, {}, 1};
    render::Series bad{"failed", {}, {}, render::Style::kCrosses, {}, {}, 3};
    Count& count = counts[k];
    for (const practice::Withstood& c : cases) {
      if (c.kind != kinds[k].name) continue;
      const skill::Disturbance& d = c.disturbance;
      for (int t = 0; t < o.tasks; ++t) {
        const Performance p{tasks[t], c.rollouts[t]};
        const skill::Rollout& r = p.rollout;
        const double error = p.error();
        const bool within = p.reached(task) == true;
        csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", c.kind, d.mass,
                           d.friction ? fmt::format("{}", *d.friction) : "", d.delay,
                           d.encoder_noise, d.velocity_noise, tasks[t], r.achieved, error,
                           r.failed() ? 1 : 0, csvField(r.ended));
        ++count.trials;
        count.failed += r.failed();
        count.within += within;
        if (!r.failed() && !std::isnan(error)) count.errors.push_back(std::abs(error));
        render::Series& series = r.failed() ? bad : within ? good : off;
        series.x.push_back(tasks[t]);
        series.y.push_back(c.level);
      }
    }
    render::Panel panel;
    panel.xlabel = fmt::format("{} asked [{}]", task.name, task.unit);
    panel.ylabel = kinds[k].level;
    for (const render::Series& s : {good, off, bad}) {
      if (!s.x.empty()) panel.series.push_back(s);
    }
    figure.panels.push_back(std::move(panel));
  }
  const std::filesystem::path table = beside(o.run, "-perturb.csv");
  PendingFile file(table);
  file.write(csv);
  file.commit();
  const std::filesystem::path picture = beside(o.run, "-perturb.png");
  if (o.picture) render::writeFigure(figure, picture);

  nlohmann::ordered_json j{{"skill", f.skill->name}, {"tolerance", task.tolerance}};
  if (!o.json) {
    print("{}: trials that fail, that are within {:g} {} of the task, median |error|\n",
          f.skill->name, task.tolerance, task.unit);
  }
  for (size_t k = 0; k < kinds.size(); ++k) {
    const Count& c = counts[k];
    const double error = c.errors.empty() ? NAN : reproduce::median(c.errors);
    j["kinds"][kinds[k].name] = {
        {"trials", c.trials},
        {"failed", c.failed},
        {"within", c.within},
        {"median_error",
         std::isnan(error) ? nlohmann::ordered_json() : nlohmann::ordered_json(error)}};
    if (o.json) continue;
    print("  {:<10} {:>4} trials  {:>5.1f} % fail  {:>5.1f} % within  {}\n", kinds[k].name,
          c.trials, 100.0 * c.failed / c.trials, 100.0 * c.within / c.trials,
          std::isnan(error) ? "-" : fmt::format("{:.2g} {}", error, task.unit));
  }
  j["csv"] = table.string();
  if (o.picture) j["picture"] = picture.string();
  if (o.json) {
    printJson(j);
  } else {
    print("{}\n", table.string());
    if (o.picture) print("{}\n", picture.string());
  }
  return kDone;
}

}  // namespace traceur::cli
