#include "apps/cli/reproduce_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/cli/balance_pictures.h"
#include "apps/cli/landing_pictures.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/render/figure.h"
#include "traceur/reproduce/figure_28.h"
#include "traceur/reproduce/figures_39_40.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using namespace reproduce;
using Json = nlohmann::ordered_json;

/// Gives what has no value, as falls, a row of its own below all lines: among them it is not seen.
void putBelow(render::Panel* panel) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto scaled = [&](double y) { return panel->log_y ? std::log10(y) : y; };
  for (const render::Series& s : panel->series) {
    for (const double y : s.y) {
      if (!std::isfinite(scaled(y))) continue;
      low = std::min(low, scaled(y));
      high = std::max(high, scaled(y));
    }
  }
  if (!(low <= high)) low = high = 0;
  const double row = high > low ? 0.03 * (high - low) : 1;
  for (render::Series& s : panel->series) {
    if (!s.y.empty() || s.x.empty()) continue;
    low -= row;
    s.y.assign(s.x.size(), panel->log_y ? std::pow(10, low) : low);
  }
}

/// A panel for each row, a colour for each column, a line for each seed; what
/// is printed dashed.
render::Figure linesOf(const Results& results) {
  const Table& t = results.table();
  const std::vector<std::string> axes = split(t.points, ':');
  render::Figure figure;
  figure.title = t.title;
  figure.panel_height = 380;
  for (size_t r = 0; r < t.rows.size(); ++r) {
    render::Panel panel;
    panel.title = t.rows[r].name;
    const auto labelled_axis = [&](const std::string& axis) {
      const bool has_unit = !t.rows[r].unit.empty() && (axis == "task" || axis == "error");
      return has_unit ? fmt::format("{} [{}]", axis, t.rows[r].unit) : axis;
    };
    panel.xlabel = labelled_axis(axes.at(0));
    panel.ylabel = labelled_axis(axes.at(1));
    panel.log_y = axes.at(1) == "cost";
    bool printed = false;  // and labelled
    for (size_t c = 0; c < t.columns.size(); ++c) {
      bool labelled = false;
      render::Series falls{t.columns[c].name + " falls", {}, {}, render::Style::kCrosses};
      falls.color = static_cast<int>(c);
      const auto draw = [&](const std::vector<Point>& points, render::Style style) {
        const bool is_printed = style == render::Style::kDashed;
        bool& named = is_printed ? printed : labelled;
        const std::string label = is_printed ? "printed" : t.columns[c].name;
        render::Series line{named ? "" : label, {}, {}, style};
        line.color = static_cast<int>(c);
        for (const Point& p : points) {
          line.x.push_back(p.x);
          line.y.push_back(p.y);
          if (std::isnan(p.y)) falls.x.push_back(p.x);
        }
        if (line.x.empty()) return;
        named = true;
        if (line.x.size() == 1) {  // which as a line nobody would see
          render::Series alone = line;
          alone.label = "";
          alone.style = render::Style::kCrosses;
          panel.series.push_back(std::move(alone));
        }
        panel.series.push_back(std::move(line));
      };
      for (const auto& [key, outcome] : results.outcomes()) {
        if (std::get<0>(key) == static_cast<int>(r) && std::get<1>(key) == static_cast<int>(c)) {
          draw(outcome.points, axes[0] == "trials" ? render::Style::kStep : render::Style::kLine);
        }
      }
      if (!falls.x.empty()) panel.series.push_back(falls);
      if (labelled && t.printed_points) {
        draw(t.printed_points(static_cast<int>(r), static_cast<int>(c)), render::Style::kDashed);
      }
    }
    putBelow(&panel);
    if (!panel.series.empty()) figure.panels.push_back(std::move(panel));
  }
  return figure;
}

/// A panel for each cell that was run: the mean over its seeds of every square.
render::Figure mapsOf(const Results& results) {
  const Table& t = results.table();
  render::Figure figure;
  figure.title = t.title;
  figure.columns = static_cast<int>(t.columns.size());
  figure.width = 470 * figure.columns;
  figure.panel_height = 420;
  const double side = (t.map.high - t.map.low) / t.map.count;
  for (int r = 0; r < static_cast<int>(t.rows.size()); ++r) {
    for (int c = 0; c < static_cast<int>(t.columns.size()); ++c) {
      std::vector<double> sum(static_cast<size_t>(t.map.count) * t.map.count);
      double all = 0;
      int runs = 0;
      for (const auto& [key, outcome] : results.outcomes()) {
        if (std::get<0>(key) != r || std::get<1>(key) != c) continue;
        ++runs;
        all += outcome.value;
        for (const Point& p : outcome.points) {
          if (p.x >= 0 && p.x < static_cast<double>(sum.size())) {
            sum[static_cast<size_t>(p.x)] += p.y;
          }
        }
      }
      if (runs == 0) continue;
      render::Panel panel;
      panel.title = fmt::format("{}, {}: {:.0f} {}, {} seeds", t.rows[r].name, t.columns[c].name,
                                all / runs, t.rows[r].quantity, runs);
      panel.xlabel = t.map.xlabel;
      panel.ylabel = t.map.ylabel;
      render::Series squares{"", {}, {}, render::Style::kSquares};
      squares.side = side;
      for (size_t k = 0; k < sum.size(); ++k) {
        const auto [j, i] = std::div(static_cast<int>(k), t.map.count);
        squares.x.push_back(t.map.low + (i + 0.5) * side);
        squares.y.push_back(t.map.low + t.map.y_offset + (j + 0.5) * side);
        squares.share.push_back(sum[k] / runs);
      }
      panel.series.push_back(std::move(squares));
      figure.panels.push_back(std::move(panel));
    }
  }
  return figure;
}

/// The printed preset and the default side by side, on Toy3.
Json drawFigure28(std::uint64_t seed, const fs::path& file) {
  render::Figure figure;
  figure.title = "What CMA-C takes to be feasible of Toy3 (grey), after a run";
  figure.columns = 2;
  figure.width = 1200;
  figure.panel_height = 560;
  Json j;
  for (const char* algorithm : {"CMA-C 2015", "CMA-C"}) {
    const LearnedRegion r = learnRegion(algorithm, seed);
    render::Panel panel;
    // Under the panel: over it stands the legend.
    panel.xlabel =
        fmt::format("{}: {} trials, {:.0f} % of the region right, {:.0f} % of the L found",
                    algorithm, r.x.size(), 100 * r.precision, 100 * r.recall);
    panel.ylabel = "y";
    render::Series learned{"learned", {}, {}, render::Style::kPoints, {}, {}, render::kGrey};
    static constexpr double kCell =
        (LearnedRegion::kHigh - LearnedRegion::kLow) / LearnedRegion::kCells;
    for (size_t c = 0; c < r.learned.size(); ++c) {
      if (!r.learned[c]) continue;
      const auto [j_row, i_column] = std::div(static_cast<int>(c), LearnedRegion::kCells);
      learned.x.push_back(LearnedRegion::kLow + (i_column + 0.5) * kCell);
      learned.y.push_back(LearnedRegion::kLow + (j_row + 0.5) * kCell);
    }
    render::Series good{"feasible trials", {}, {}, render::Style::kPoints};
    render::Series bad{"infeasible", {}, {}, render::Style::kCrosses};
    for (size_t t = 0; t < r.x.size(); ++t) {
      const bool inside = std::min(r.x[t], r.y[t]) >= LearnedRegion::kLow &&
                          std::max(r.x[t], r.y[t]) <= LearnedRegion::kHigh;
      if (!inside) continue;
      render::Series& trials = r.feasible[t] ? good : bad;
      trials.x.push_back(r.x[t]);
      trials.y.push_back(r.y[t]);
    }
    const render::Series truth{
        "truth", {3, 3.5, 3.5, 4, 4, 3, 3}, {3.5, 3.5, 3, 3, 4, 4, 3.5}, render::Style::kLine};
    for (const render::Series& series : {learned, truth, good, bad}) {
      if (!series.x.empty()) panel.series.push_back(series);
    }
    figure.panels.push_back(std::move(panel));
    j["learned"].push_back({{"algorithm", algorithm},
                            {"trials", r.x.size()},
                            {"precision", r.precision},
                            {"recall", r.recall}});
  }
  render::writeFigure(figure, file);
  return j;
}

/// Four runs from one start: the model's policy on model and machine, the learned one on both.
Json drawFigure39(std::uint64_t seed, const fs::path& file) {
  const PolicyTrials p = policyTrials(seed);
  std::vector<BalanceRun> runs;
  Json j{{"machine", p.machine}, {"solved", p.solved}, {"iterations", p.iterations}};
  for (const BalanceTrial& t : p.trials) {
    runs.push_back({fmt::format("{} policy, {}", t.policy, t.plant), t.log, t.failure});
    j["runs"].push_back({{"policy", t.policy},
                         {"plant", t.plant},
                         {"seconds", 1e-3 * t.log.steps()},
                         {"failure", t.failure}});
  }
  writeBalanceStrip(file, runs);
  return j;
}

/// A panel for each machine: the bias of the rates of wheel and board at states of runs that were
/// not learned from, over the angles of wheel and board.
Json drawFigure40(std::uint64_t seed, const fs::path& file) {
  static constexpr double kDegrees = 180 / std::numbers::pi;
  static constexpr double kStep = 0.001;  // s
  static constexpr size_t kArrows = 35;   // of each kind, or nothing can be seen
  render::Figure figure;
  figure.title = "Bias of the rates: learned, predicted and true";
  figure.columns = 2;
  figure.width = 1240;
  figure.panel_height = 600;
  Json j;
  std::string summary;
  for (const BiasField& f : biasFields(seed)) {
    // Arrows share a scale: the longest true one is a quarter of the angles' range.
    double longest = 0, low = 0, high = 0;
    for (const bias::BiasSample& s : f.truth) {
      longest = std::max(longest, s.difference.segment<2>(3).norm() / kStep);
      low = std::min(low, kDegrees * s.x.head<2>().minCoeff());
      high = std::max(high, kDegrees * s.x.head<2>().maxCoeff());
    }
    const double scale = 0.25 * (high - low) / longest;  // deg for 1 rad/s²
    const auto arrows = [&](const char* label, int color) {
      render::Series s{label, {}, {}, render::Style::kArrows};
      s.color = color;
      return s;
    };
    const auto add = [&](render::Series& s, const bias::VectorXd& x, const bias::VectorXd& bias) {
      s.x.push_back(kDegrees * x[0]);
      s.y.push_back(kDegrees * x[1]);
      s.dx.push_back(scale * bias[3] / kStep);
      s.dy.push_back(scale * bias[4] / kStep);
    };
    render::Series training = arrows("training", render::kGrey);
    render::Series truth = arrows("truth", 0);
    render::Series predicted = arrows("predicted", 1);
    const size_t every = std::max<size_t>(1, f.training.size() / kArrows);
    for (size_t i = 0; i < f.training.size(); i += every) {
      add(training, f.training[i].x, f.training[i].difference);
    }
    const size_t each = std::max<size_t>(1, f.truth.size() / kArrows);
    for (size_t i = 0; i < f.truth.size(); i += each) {
      add(truth, f.truth[i].x, f.truth[i].difference);
      add(predicted, f.truth[i].x, f.predicted[i]);
    }
    render::Panel panel;
    panel.title = f.machine;
    panel.xlabel =
        fmt::format("wheel [deg]; 10 deg of arrow: {:.2g} rad/s²; R² {:.3f}, {:.3f}, {:.3f}",
                    10 / scale, f.explained[0], f.explained[1], f.explained[2]);
    panel.ylabel = "board from it [deg]";
    panel.series = {training, truth, predicted};
    figure.panels.push_back(std::move(panel));
    j["fields"].push_back({{"machine", f.machine},
                           {"training", f.training.size()},
                           {"unseen", f.truth.size()},
                           {"r2",
                            {{"wheel_rate", f.explained[0]},
                             {"board_rate", f.explained[1]},
                             {"leg_rate", f.explained[2]}}}});
    summary +=
        fmt::format("{}{}: R² on {} states of unseen runs {:.3f} wheel, {:.3f} board, {:.3f} legs",
                    summary.empty() ? "" : "\n", f.machine, f.truth.size(), f.explained[0],
                    f.explained[1], f.explained[2]);
  }
  j["summary"] = summary;
  render::writeFigure(figure, file);
  return j;
}

}  // namespace

const std::vector<Drawing>& drawings() {
  const auto condition = [](bool hands) {
    return [hands](std::uint64_t seed, const fs::path& file) {
      return drawLandingCondition(hands, seed, file);
    };
  };
  static const std::vector<Drawing> kAll = {
      {"figure-10", false, condition(true)}, {"figure-11", false, condition(false)},
      {"figure-12", true, drawAirPoses},     {"figure-28", false, drawFigure28},
      {"figure-39", true, drawFigure39},     {"figure-40", false, drawFigure40}};
  return kAll;
}

void drawTable(const Results& results, const fs::path& file) {
  const render::Figure figure =
      results.table().drawn == Drawn::kMap ? mapsOf(results) : linesOf(results);
  if (figure.panels.empty()) throw InputError("no runs to draw");
  render::writeFigure(figure, file);
}

}  // namespace traceur::cli
