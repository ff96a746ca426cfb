#include "apps/cli/perturb.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "apps/cli/csv.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/random.h"
#include "traceur/core/thread_pool.h"
#include "traceur/render/figure.h"
#include "traceur/reproduce/statistics.h"
#include "traceur/skill/rollout.h"

namespace traceur::cli {
namespace {

using skill::Disturbance;

/// How far from the model a robot may be. Noise: one step of a small servo's encoder, 0.29°, and
/// what a cheap inertial unit makes of a velocity [ours].
constexpr double kMass = 0.1;
constexpr double kLeastFriction = 0.6;
constexpr double kMostFriction = 1.2;
constexpr double kDelay = 0.010;         // [s]
constexpr double kEncoderNoise = 0.005;  // [rad]
constexpr double kVelocityNoise = 0.05;  // [m/s]
constexpr int kLevels = 5;
constexpr int kDrawn = 20;

/// One disturbance and where it stands in the report.
struct Case {
  std::string kind;  // "mass"
  double level;      // of it, as its panel shows
  Disturbance disturbance;
};

std::vector<Case> casesOf(std::uint64_t seed, double time_step) {
  const auto whole = [&](double delay) { return time_step * std::round(delay / time_step); };
  std::vector<Case> cases;
  for (int i = 0; i < kLevels; ++i) {
    const double part = i / (kLevels - 1.0);
    Disturbance d;
    d.mass = 1 - kMass + 2 * kMass * part;
    cases.push_back({"mass", d.mass, d});
    d = {};
    d.friction = kLeastFriction + (kMostFriction - kLeastFriction) * part;
    cases.push_back({"friction", *d.friction, d});
    d = {};
    d.delay = whole(kDelay * part);
    cases.push_back({"delay", 1e3 * d.delay, d});
    d = {};
    d.encoder_noise = part * kEncoderNoise;
    d.velocity_noise = part * kVelocityNoise;
    d.seed = seed + i;
    cases.push_back({"noise", part, d});
  }
  for (int i = 0; i < kDrawn; ++i) {
    Random random(seed, 0, i);
    Disturbance d;
    d.mass = random.uniform(1 - kMass, 1 + kMass);
    d.friction = random.uniform(kLeastFriction, kMostFriction);
    d.delay = whole(random.uniform(0, kDelay));
    const double noise = random.uniform();
    d.encoder_noise = noise * kEncoderNoise;
    d.velocity_noise = noise * kVelocityNoise;
    d.seed = random.bits();
    cases.push_back({"drawn", static_cast<double>(i + 1), d});
  }
  return cases;
}

struct Kind {
  std::string name;
  std::string axis;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> kKinds = {
      {"mass", "mass [of the model's]"},
      {"friction", "ground friction"},
      {"delay", "control delay [ms]"},
      {"noise", fmt::format("sensor noise [{} rad, {} m/s]", kEncoderNoise, kVelocityNoise)},
      {"drawn", "all at random, number"}};
  return kKinds;
}

/// What became of a kind's trials.
struct Count {
  int trials = 0;
  int failed = 0;
  int within = 0;              // the task's tolerance
  std::vector<double> errors;  // of those that did not fail
};

}  // namespace

int perturb(const FamilyRun& f, const PerturbOptions& o) {
  const skill::Task& task = f.skill->task;
  requireAchieved(*f.skill);
  const std::vector<Case> cases = casesOf(o.seed, f.skill->model->timeStep());
  const Eigen::VectorXd tasks =
      Eigen::VectorXd::LinSpaced(o.tasks, f.tasks[0], f.tasks[f.tasks.size() - 1]);
  std::vector<std::vector<skill::Rollout>> rollouts(cases.size());
  Interrupt interrupt;  // before any other thread
  ProgressLine line("perturb", static_cast<double>(cases.size()), 0, o.json);
  const std::stop_token stop = interrupt.token();
  std::mutex mutex;
  int done = 0;
  ThreadPool pool(o.threads);
  pool.forEach(static_cast<int>(cases.size()), [&](int i) {
    if (stop.stop_requested()) return;
    // A robot of its own for each: masses and friction are part of the model.
    skill::Runner runner(
        skill::Skill::fromText(f.skill->text, f.skill->file, cases[i].disturbance));
    for (const double t : tasks) {
      if (stop.stop_requested()) return;
      rollouts[i].push_back(runner.run(f.at(t), t));
    }
    const std::scoped_lock lock(mutex);
    line.update(++done, fmt::format("{} tasks each", o.tasks), "robots/s");
  });
  line.finish();
  interrupt.release();
  if (stop.stop_requested()) {
    note("stopped; nothing was written\n");
    return kInterrupted;
  }

  std::string csv = fmt::format(
      "# {} of {}, task and achieved in {}; delay in s, noise in rad and m/s\n"
      "kind,mass,friction,delay,encoder_noise,velocity_noise,task,achieved,error,failed,ended\n",
      printable(task.name), printable(f.skill->name), printable(task.unit));
  std::vector<Count> counts(kinds().size());
  render::Figure figure;
  figure.title = fmt::format("{}: what the family withstands", f.skill->name);
  figure.columns = 2;
  figure.width = 1100;
  figure.panel_height = 280;
  for (size_t k = 0; k < kinds().size(); ++k) {
    render::Series good{"within tolerance", {}, {}, render::Style::kPoints, {}, {}, 0};
    render::Series off{"off", {}, {}, render::Style::kPoints, {}, {}, 1};
    render::Series bad{"failed", {}, {}, render::Style::kCrosses, {}, {}, 3};
    Count& count = counts[k];
    for (size_t i = 0; i < cases.size(); ++i) {
      const Case& c = cases[i];
      if (c.kind != kinds()[k].name) continue;
      const Disturbance& d = c.disturbance;
      for (int t = 0; t < o.tasks; ++t) {
        const skill::Rollout& r = rollouts[i][t];
        const double error = r.achieved - tasks[t];
        const bool within = !r.failed() && std::abs(error) <= task.tolerance;
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
    panel.ylabel = kinds()[k].axis;
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
  for (size_t k = 0; k < kinds().size(); ++k) {
    const Count& c = counts[k];
    const double error = c.errors.empty() ? NAN : reproduce::median(c.errors);
    j["kinds"][kinds()[k].name] = {
        {"trials", c.trials},
        {"failed", c.failed},
        {"within", c.within},
        {"median_error",
         std::isnan(error) ? nlohmann::ordered_json() : nlohmann::ordered_json(error)}};
    if (o.json) continue;
    print("  {:<10} {:>4} trials  {:>5.1f} % fail  {:>5.1f} % within  {}\n", kinds()[k].name,
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
