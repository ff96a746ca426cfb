// traceur reproduce: run a published table again and print it beside the original.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "apps/cli/interrupt.h"
#include "apps/cli/progress.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/render/figure.h"
#include "traceur/reproduce/figure_28.h"
#include "traceur/reproduce/table.h"

namespace traceur::cli {
namespace {

using namespace reproduce;

struct Arguments {
  std::string name;
  int seeds = 0;
  bool full = false;
  std::uint64_t first_seed = 1;
  int threads = 0;
  std::string out;
  std::vector<std::string> rows;
  std::vector<std::string> columns;
  std::string picture;
  bool no_run = false;
  bool json = false;
  bool markdown = false;
  bool quiet = false;
};

/// So many significant digits, whole numbers in full; a dash for what is not there.
std::string number(double x, int digits = 4) {
  return std::isnan(x)         ? "-"
         : std::abs(x) >= 1000 ? fmt::format("{:.0f}", x)
                               : fmt::format("{:.{}g}", x, digits);
}

std::string range(const Interval& i) {
  return fmt::format("[{}, {}]", number(i.low, 3), number(i.high, 3));
}

/// null for what is not there; JSON has no word for infinity, so that one is a text.
nlohmann::ordered_json toJson(double x) {
  if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
  return std::isnan(x) ? nlohmann::ordered_json() : nlohmann::ordered_json(x);
}

nlohmann::ordered_json toJson(const RatioSummary& r) {
  return {{"ratio", toJson(r.value)},
          {"low", toJson(r.interval.low)},
          {"high", toJson(r.interval.high)},
          {"paper", toJson(r.printed)}};
}

nlohmann::ordered_json asJson(const Table& t, const Summary& s) {
  nlohmann::ordered_json j{{"table", t.name},
                           {"title", t.title},
                           {"protocol", t.protocol},
                           {"center", nameOf(t.center)}};
  for (size_t r = 0; r < t.rows.size(); ++r) {
    nlohmann::ordered_json row{{"row", t.rows[r].name}, {"quantity", t.rows[r].quantity}};
    for (size_t c = 0; c < t.columns.size(); ++c) {
      const CellSummary& cell = s.cells[r][c];
      row["columns"][t.columns[c].name] = {{"paper", toJson(cell.printed)},
                                           {"ours", cell.runs ? toJson(cell.value) : nullptr},
                                           {"low", toJson(cell.interval.low)},
                                           {"high", toJson(cell.interval.high)},
                                           {"runs", cell.runs},
                                           {"missed", cell.missed}};
    }
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      row["ratios"][t.ratios[i].name] = toJson(s.ratios[r][i]);
    }
    j["rows"].push_back(std::move(row));
  }
  for (const Summary::Group& g : s.groups) {
    nlohmann::ordered_json group{{"group", g.name}, {"rows", g.rows}};
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      group["geometric_mean_ratios"][t.ratios[i].name] = toJson(g.ratios[i]);
    }
    j["groups"].push_back(std::move(group));
  }
  return j;
}

std::string asText(const Table& t, const Summary& s) {
  std::string text = fmt::format("{}: {}\n{}\nValues: {}, bootstrap 95 % interval.\n\n", t.name,
                                 t.title, t.protocol, nameOf(t.center));
  const auto line = [&text](const std::string& what, double paper, double ours,
                            const Interval& interval, const std::string& missed) {
    text += fmt::format("  {:<44} {:>8} {:>9}  {:<20} {}\n", what, number(paper), number(ours),
                        std::isnan(ours) ? "" : range(interval), missed);
  };
  for (size_t r = 0; r < t.rows.size(); ++r) {
    text += fmt::format("{:<46} {:>8} {:>9}  {:<20} {}\n",
                        fmt::format("{} ({})", t.rows[r].name, t.rows[r].quantity), "paper", "ours",
                        "95 %", "missed");
    for (size_t c = 0; c < t.columns.size(); ++c) {
      const CellSummary& cell = s.cells[r][c];
      line(t.columns[c].name, cell.printed, cell.runs ? cell.value : kNotPrinted, cell.interval,
           cell.runs ? fmt::format("{}/{}", cell.missed, cell.runs) : "");
    }
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      const RatioSummary& ratio = s.ratios[r][i];
      line(t.ratios[i].name, ratio.printed, ratio.value, ratio.interval, "");
    }
  }
  for (const Summary::Group& g : s.groups) {
    text +=
        fmt::format("{}, geometric mean over {} rows\n", g.name.empty() ? "all" : g.name, g.rows);
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      const RatioSummary& ratio = g.ratios[i];
      line(t.ratios[i].name, ratio.printed, ratio.value, ratio.interval, "");
    }
  }
  return text;
}

std::string asMarkdown(const Table& t, const Summary& s) {
  std::string text = fmt::format(
      "## {}\n\n{}\n\n{} Values: paper → **ours** ({}) with its bootstrap 95 % interval.\n\n| |",
      t.name, t.title, t.protocol, nameOf(t.center));
  for (const Column& c : t.columns) text += fmt::format(" {} |", c.name);
  for (const Ratio& r : t.ratios) text += fmt::format(" {} |", r.name);
  text += "\n|---|";
  for (size_t i = 0; i < t.columns.size() + t.ratios.size(); ++i) text += "---|";
  const auto printed = [](double x) { return std::isnan(x) ? std::string() : number(x) + " → "; };
  for (size_t r = 0; r < t.rows.size(); ++r) {
    text += fmt::format("\n| {} ({}) |", t.rows[r].name, t.rows[r].quantity);
    for (const CellSummary& cell : s.cells[r]) {
      text += cell.runs == 0
                  ? std::string(" |")
                  : fmt::format(" {}**{}** {}{} |", printed(cell.printed), number(cell.value),
                                range(cell.interval),
                                cell.missed ? fmt::format(", {}/{} missed", cell.missed, cell.runs)
                                            : fmt::format(", {} runs", cell.runs));
    }
    for (const RatioSummary& ratio : s.ratios[r]) {
      text += std::isnan(ratio.value) ? std::string(" |")
                                      : fmt::format(" {}**{:.3g}** {} |", printed(ratio.printed),
                                                    ratio.value, range(ratio.interval));
    }
  }
  for (const Summary::Group& g : s.groups) {
    text += fmt::format("\n| {}geometric mean |", g.name.empty() ? "" : g.name + ", ");
    for (size_t c = 0; c < t.columns.size(); ++c) text += " |";
    for (const RatioSummary& ratio : g.ratios) {
      text += std::isnan(ratio.value) ? std::string(" |")
                                      : fmt::format(" {}**{:.3g}** {} |", printed(ratio.printed),
                                                    ratio.value, range(ratio.interval));
    }
  }
  return text + "\n";
}

/// What the runs drew: a panel for each row, a colour for each column, a line for each seed; what
/// is printed dashed.
void drawPoints(const Results& results, const std::filesystem::path& file) {
  const Table& t = results.table();
  const std::vector<std::string> axes = split(t.points, ':');
  render::Figure figure;
  figure.title = t.title;
  figure.panel_height = 380;
  for (size_t r = 0; r < t.rows.size(); ++r) {
    render::Panel panel;
    panel.title = t.rows[r].name;
    panel.xlabel = axes.at(0);
    panel.ylabel = axes.at(1);
    panel.log_y = axes.at(1) == "cost";
    for (size_t c = 0; c < t.columns.size(); ++c) {
      bool labelled = false;
      render::Series falls{"falls", {}, {}, render::Style::kCrosses};
      const auto draw = [&](const std::vector<Point>& points, render::Style style) {
        render::Series line{labelled ? "" : t.columns[c].name, {}, {}, style};
        line.color = static_cast<int>(c);
        for (const Point& p : points) {
          line.x.push_back(p.x);
          line.y.push_back(p.y);
          if (!std::isnan(p.y)) continue;
          falls.x.push_back(p.x);
          falls.y.push_back(0);
        }
        labelled = labelled || !line.x.empty();
        if (!line.x.empty()) panel.series.push_back(std::move(line));
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
    if (!panel.series.empty()) figure.panels.push_back(std::move(panel));
  }
  if (figure.panels.empty()) throw InputError("no runs to draw");
  render::writeFigure(figure, file);
}

/// Whether a row or column was asked for.
template <typename T>
std::vector<bool> chosen(const std::vector<T>& named, const std::vector<std::string>& names,
                         const char* option) {
  std::vector<bool> in(named.size(), names.empty());
  std::vector<std::string> there;
  there.reserve(named.size());
  for (const T& t : named) there.push_back(t.name);
  for (const std::string& name : names) {
    const auto found = std::find(there.begin(), there.end(), name);
    if (found == there.end()) {
      throw InputError(fmt::format("{} {}: none of this name.{} There is: {}", option, name,
                                   didYouMean(name, there), join(there)));
    }
    in[found - there.begin()] = true;
  }
  return in;
}

/// The printed preset and the default side by side, on Toy3.
int drawFigure28(const Arguments& a) {
  const std::string out = a.out.empty() ? "runs/figure-28.png" : a.out;
  render::Figure figure;
  figure.title = "What CMA-C takes to be feasible of Toy3 (grey), after a run";
  figure.columns = 2;
  figure.width = 1200;
  figure.panel_height = 560;
  nlohmann::ordered_json j{{"figure", "figure-28"}, {"seed", a.first_seed}, {"file", out}};
  for (const char* algorithm : {"CMA-C 2015", "CMA-C"}) {
    const LearnedRegion r = learnRegion(algorithm, a.first_seed);
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
  if (const auto folder = std::filesystem::path(out).parent_path(); !folder.empty()) {
    std::filesystem::create_directories(folder);
  }
  render::writeFigure(figure, out);
  fmt::print("{}\n", a.json ? j.dump(2) : out);
  return kDone;
}

int reproduceTable(const Arguments& a) {
  if (a.name == "figure-28") return drawFigure28(a);
  const Table& table = findTable(a.name);
  const std::string out = a.out.empty() ? fmt::format("runs/{}.csv", table.name) : a.out;
  Interrupt interrupt;  // before any other thread
  Results results(table);
  if (a.no_run || std::filesystem::exists(out)) results = Results::read(table, out);
  const bool figure = !table.points.empty() && table.figure;
  if (!a.picture.empty() && !figure) {
    throw InputError(fmt::format("--picture: {} is no figure", table.name));
  }
  // Hours may lie between here and the picture.
  const auto is_picture = [](const std::filesystem::path& file) {
    return file.extension() == ".png" || file.extension() == ".svg";
  };
  if (!a.picture.empty() && !is_picture(a.picture)) {
    throw InputError(fmt::format("--picture {}: expected .png or .svg", a.picture));
  }
  if (is_picture(out)) {
    throw InputError(
        fmt::format("--out {}: expected the name of a CSV; --picture names the figure", out));
  }
  const std::vector<bool> rows = chosen(table.rows, a.rows, "--row");
  const std::vector<bool> columns = chosen(table.columns, a.columns, "--column");
  bool whole = true;
  if (!a.no_run) {
    std::optional<ProgressLine> line;
    whole = results.run({.first_seed = a.first_seed,
                         .seeds = a.full ? -1 : a.seeds,
                         .threads = a.threads,
                         .wanted = [&](int r, int c) { return rows[r] && columns[c]; },
                         .stop = interrupt.token(),
                         .on_progress =
                             [&](int done, int total) {
                               if (!line) line.emplace(table.name, total, done, a.quiet);
                               line->update(done, "", "runs/s");
                             }},
                        out);
  }
  if (!whole) {
    fmt::print(stderr, "stopped; the same command goes on with {}\n", out);
    return kInterrupted;
  }
  nlohmann::ordered_json json;
  for (const Results& told : table.readings ? table.readings(results) : std::vector{results}) {
    const Summary summary = summarise(told);
    if (a.json) {
      json["tables"].push_back(asJson(told.table(), summary));
    } else {
      fmt::print("{}{}",
                 a.markdown ? asMarkdown(told.table(), summary) : asText(told.table(), summary),
                 table.readings ? "\n" : "");
    }
  }
  if (a.json) fmt::print("{}\n", (table.readings ? json : json["tables"][0]).dump(2));
  std::string picture = a.picture;
  if (picture.empty() && figure && !a.no_run) {
    picture = std::filesystem::path(out).replace_extension(".png").string();
  }
  if (!picture.empty()) drawPoints(results, picture);
  if (!a.quiet && !picture.empty()) fmt::print(stderr, "figure: {}\n", picture);
  if (!a.quiet && !a.no_run) fmt::print(stderr, "every run: {}\n", out);
  return kDone;
}

}  // namespace

void addReproduce(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = program.add_subcommand(
      "reproduce", "Run a published table again; print the paper's numbers beside ours.");
  std::vector<std::string> names;
  for (const Table& t : allTables()) names.push_back(t.name);
  names.push_back("figure-28");
  verb->add_option("TABLE", a->name, "One of: " + join(names))->required();
  auto* seeds =
      verb->add_option("--seeds", a->seeds,
                       "Runs of each cell; default: minutes in all, but hours for figure-32 to 34")
          ->check(CLI::Range(1, 100'000));
  verb->add_flag("--full", a->full, "As many runs as the committed results have")->excludes(seeds);
  verb->add_option("--seed", a->first_seed, "The first seed")->capture_default_str();
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--out", a->out,
                   "CSV of every run; runs it already has are not made again, and only one process "
                   "may write it at a time. Default: runs/TABLE.csv. Of figure-28: the picture");
  verb->add_option("--row", a->rows, "Run only these rows; all that was run is told")
      ->delimiter(',');
  verb->add_option("--column", a->columns, "Run only these columns")->delimiter(',');
  verb->add_option(
      "--picture", a->picture,
      "Of figure-32 to 34, families and table-13: the figure, .png or .svg; default beside --out");
  verb->add_flag("--no-run", a->no_run, "Only sum up what the CSV has");
  auto* json = verb->add_flag("--json", a->json, "Print one JSON object");
  verb->add_flag("--markdown", a->markdown, "Print a Markdown section")->excludes(json);
  verb->add_flag("--quiet", a->quiet, "No progress");
  verb->footer(
      "Examples:\n"
      "  traceur reproduce table-7\n"
      "  traceur reproduce table-11 --seeds 30 --out table-11.csv     # Ctrl-C, then again: goes "
      "on\n"
      "  traceur reproduce table-11 --no-run --out docs/reproduction/table-11.csv\n"
      "  traceur reproduce figure-32 --row jump --column curve,contextual --seeds 3\n"
      "  traceur reproduce figure-28 --seed 3 --out figure-28.png");
  verb->callback([a, &exit_code] { exit_code = reproduceTable(*a); });
}

}  // namespace traceur::cli
