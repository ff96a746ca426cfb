#include "traceur/render/standard_figures.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "traceur/core/error.h"
#include "traceur/render/motion.h"

namespace traceur::render {
namespace {

constexpr int kLeftColor = 0;   // of the palette: blue
constexpr int kRightColor = 1;  // vermilion

std::vector<Mark> phaseMarks(const sim::Recording& recording) {
  std::vector<Mark> marks;
  for (const PhaseStart& p : phaseStarts(recording)) marks.push_back({p.time, p.name});
  return marks;
}

std::vector<double> timesOf(const sim::Recording& recording) {
  std::vector<double> times;
  for (const sim::Frame& f : recording.frames) times.push_back(f.state.time);
  return times;
}

enum class Side { kNone, kLeft, kRight };

struct SidedName {
  Side side = Side::kNone;
  std::string base;  // the name without its side
};

SidedName sidedName(const std::string& name) {
  struct Sign {
    std::string_view left;
    std::string_view right;
  };
  static constexpr Sign kBefore[] = {{"left_", "right_"}, {"Left", "Right"}, {"left-", "right-"},
                                     {"l_", "r_"},        {"L_", "R_"},      {"l-", "r-"}};
  static constexpr Sign kAfter[] = {{"_left", "_right"}, {"Left", "Right"}, {"-left", "-right"},
                                    {"_l", "_r"},        {"_L", "_R"},      {"-l", "-r"}};
  for (const Sign& s : kBefore) {
    if (name.starts_with(s.left)) return {Side::kLeft, name.substr(s.left.size())};
    if (name.starts_with(s.right)) return {Side::kRight, name.substr(s.right.size())};
  }
  for (const Sign& s : kAfter) {
    if (name.ends_with(s.left)) return {Side::kLeft, name.substr(0, name.size() - s.left.size())};
    if (name.ends_with(s.right)) {
      return {Side::kRight, name.substr(0, name.size() - s.right.size())};
    }
  }
  return {Side::kNone, name};
}

}  // namespace

Figure jointFigure(const sim::Recording& recording) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  checkRecording(*model, recording);
  const std::vector<double> times = timesOf(recording);

  // In the joints' order; a base name that only one side has is no pair.
  std::map<std::string, int> members;
  for (const sim::Joint& j : model->joints()) {
    const SidedName s = sidedName(j.name);
    if (s.side != Side::kNone) ++members[s.base];
  }
  Figure figure;
  figure.title = "Joint angles";
  std::map<std::string, size_t> panel_of;
  std::vector<Panel> unpaired;
  for (const sim::Joint& j : model->joints()) {
    Series series;
    series.x = times;
    for (const sim::Frame& f : recording.frames) series.y.push_back(f.state.q[j.q]);
    const SidedName s = sidedName(j.name);
    const char* unit = j.slides ? "position [m]" : "angle [rad]";
    if (s.side != Side::kNone && members[s.base] == 2) {
      const auto [at, is_new] = panel_of.emplace(s.base, figure.panels.size());
      if (is_new) {
        Panel& panel = figure.panels.emplace_back();
        panel.title = s.base;
        panel.ylabel = unit;
      }
      series.label = s.side == Side::kLeft ? "left" : "right";
      series.color = s.side == Side::kLeft ? kLeftColor : kRightColor;
      // The right one dashed: where both are equal, both are seen.
      series.style = s.side == Side::kLeft ? Style::kLine : Style::kDashed;
      figure.panels[at->second].series.push_back(series);
    } else {
      Panel& panel = unpaired.emplace_back();
      panel.title = j.name;
      panel.ylabel = unit;
      panel.series.push_back(series);
    }
  }
  figure.panels.insert(figure.panels.end(), unpaired.begin(), unpaired.end());
  if (figure.panels.empty()) {
    Panel& panel = figure.panels.emplace_back();
    panel.title = "this model has no hinges or slides";
  }
  const int n = static_cast<int>(figure.panels.size());
  figure.columns = n <= 3 ? 1 : n <= 12 ? 2 : 3;
  figure.width = figure.columns == 3 ? 1350 : 900;
  figure.panel_height = figure.columns == 1 ? 240 : 180;
  for (Panel& p : figure.panels) {
    p.xlabel = "time [s]";
    p.least_span = 0.2;
    p.marks = phaseMarks(recording);
  }
  return figure;
}

Figure comFigure(const sim::Recording& recording) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  checkRecording(*model, recording);
  static constexpr const char* kAxes[] = {"x (forward)", "y (left)", "z (up)"};
  Figure figure;
  figure.title = "Centre of mass";
  Panel position;
  position.ylabel = "position [m]";
  Panel velocity;
  velocity.ylabel = "velocity [m/s]";
  for (int k = 0; k < 3; ++k) {
    Series p;
    p.label = kAxes[k];
    p.x = timesOf(recording);
    Series v = p;
    for (const sim::Frame& f : recording.frames) {
      p.y.push_back(f.com[k]);
      v.y.push_back(f.com_velocity[k]);
    }
    position.series.push_back(std::move(p));
    velocity.series.push_back(std::move(v));
  }
  figure.panels = {std::move(position), std::move(velocity)};
  for (Panel& p : figure.panels) {
    p.xlabel = "time [s]";
    p.marks = phaseMarks(recording);
  }
  return figure;
}

Figure contactFigure(const sim::Recording& recording) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  checkRecording(*model, recording);
  const size_t n = recording.frames.size();
  std::map<int, std::vector<double>> force;  // by body, [N] in each frame
  for (size_t i = 0; i < n; ++i) {
    for (const sim::Contact& c : recording.frames[i].contacts) {
      const auto add = [&](sim::BodyId body, sim::BodyId other, double f) {
        if (!model->isRobot(body) || model->isRobot(other)) return;
        std::vector<double>& sum = force[body.value];
        sum.resize(n);
        sum[i] += f;
      };
      add(c.body_a, c.body_b, -c.f_WC.z());
      add(c.body_b, c.body_a, c.f_WC.z());
    }
  }
  Panel panel;
  panel.xlabel = "time [s]";
  panel.ylabel = "vertical force [N]";
  panel.marks = phaseMarks(recording);
  for (const auto& [body, f] : force) {
    Series s;
    s.label = model->bodyName({body});
    s.x = timesOf(recording);
    // On the ground of zero only where a contact begins or ends: the rest would hide other bodies.
    for (size_t i = 0; i < n; ++i) {
      const bool alone = f[i] == 0 && (i == 0 || f[i - 1] == 0) && (i + 1 == n || f[i + 1] == 0);
      s.y.push_back(alone ? std::nan("") : f[i]);
    }
    panel.series.push_back(std::move(s));
  }
  Series weight;
  weight.label = "weight";
  weight.x = {recording.frames.front().state.time, recording.frames.back().state.time};
  weight.y.assign(2, model->mass() * std::abs(model->raw()->opt.gravity[2]));
  weight.style = Style::kDashed;
  weight.color = kGrey;
  panel.series.push_back(std::move(weight));
  Figure figure;
  figure.title = "Contact forces";
  figure.panel_height = 340;
  figure.panels = {std::move(panel)};
  return figure;
}

CostHistory costHistory(const std::vector<CostTrial>& trials) {
  CostHistory h;
  const bool all = std::all_of(trials.begin(), trials.end(),
                               [](const CostTrial& t) { return t.failed || t.violates; });
  double best = std::numeric_limits<double>::infinity();
  double number = 0;
  for (const CostTrial& t : trials) {
    number += 1;
    if (t.failed) {
      h.failed.push_back(number);
    } else {
      h.trials.push_back(number);
      h.costs.push_back(t.cost);
      if (all || !t.violates) best = std::min(best, t.cost);
    }
    if (!std::isfinite(best)) continue;
    h.evaluations.push_back(number);
    h.best.push_back(best);
  }
  return h;
}

Figure costFigure(const CostHistory& history) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const std::vector<double>* costs : {&history.best, &history.costs}) {
    for (const double c : *costs) {
      if (!std::isfinite(c)) continue;
      low = std::min(low, c);
      high = std::max(high, c);
    }
  }
  Panel panel;
  panel.xlabel = "trials";
  panel.ylabel = "cost";
  panel.log_y = low > 0 && high > 20 * low;
  const bool has_trials = !history.trials.empty();
  if (has_trials) {
    Series trials;
    trials.label = "single trials";
    trials.x = history.trials;
    trials.y = history.costs;
    trials.style = Style::kPoints;
    trials.color = 5;  // sky blue: light, behind the rest
    panel.series.push_back(std::move(trials));
  }
  if (!history.failed.empty()) {
    Series failed;
    failed.label = "failed";
    failed.x = history.failed;
    failed.y.assign(history.failed.size(), low > high ? 1 : high);
    failed.style = Style::kCrosses;
    failed.color = 1;
    panel.series.push_back(std::move(failed));
  }
  Series best;
  best.label = "best so far";
  best.x = history.evaluations;
  best.y = history.best;
  best.style = Style::kStep;
  best.color = 0;
  panel.series.push_back(std::move(best));
  Figure figure;
  figure.panel_height = 420;
  figure.panels = {std::move(panel)};
  return figure;
}

}  // namespace traceur::render
