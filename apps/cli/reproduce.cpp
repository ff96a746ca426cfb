// traceur reproduce: run a published table again and print it beside the original.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "apps/cli/arguments.h"
#include "apps/cli/interrupt.h"
#include "apps/cli/output.h"
#include "apps/cli/progress.h"
#include "apps/cli/reproduce_pictures.h"
#include "apps/cli/verbs.h"
#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"
#include "traceur/reproduce/table.h"

namespace traceur::cli {
namespace {

using namespace reproduce;

struct ReproduceArguments {
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
nlohmann::ordered_json numberOrWord(double x) {
  if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
  return std::isnan(x) ? nlohmann::ordered_json() : nlohmann::ordered_json(x);
}

nlohmann::ordered_json ratioJson(const RatioSummary& r) {
  return {{"ratio", numberOrWord(r.value)},
          {"low", numberOrWord(r.interval.low)},
          {"high", numberOrWord(r.interval.high)},
          {"paper", numberOrWord(r.printed)}};
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
      row["columns"][t.columns[c].name] = {{"paper", numberOrWord(cell.printed)},
                                           {"ours", cell.runs ? numberOrWord(cell.value) : nullptr},
                                           {"low", numberOrWord(cell.interval.low)},
                                           {"high", numberOrWord(cell.interval.high)},
                                           {"runs", cell.runs},
                                           {"missed", cell.missed}};
    }
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      row["ratios"][t.ratios[i].name] = ratioJson(s.ratios[r][i]);
    }
    for (size_t i = 0; i < t.differences.size(); ++i) {
      const PairedDifference& d = s.differences[r][i];
      if (d.pairs == 0) continue;
      row["differences"][t.differences[i].name] = {{"mean", d.mean},
                                                   {"low", d.interval.low},
                                                   {"high", d.interval.high},
                                                   {"p", d.p},
                                                   {"pairs", d.pairs}};
    }
    j["rows"].push_back(std::move(row));
  }
  for (const Summary::Group& g : s.groups) {
    nlohmann::ordered_json group{{"group", g.name}, {"rows", g.rows}};
    for (size_t i = 0; i < t.ratios.size(); ++i) {
      group["geometric_mean_ratios"][t.ratios[i].name] = ratioJson(g.ratios[i]);
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
    for (size_t i = 0; i < t.differences.size(); ++i) {
      const PairedDifference& d = s.differences[r][i];
      if (d.pairs == 0) continue;
      line(t.differences[i].name, kNotPrinted, d.mean, d.interval,
           fmt::format("p = {:.2g}, {} pairs", d.p, d.pairs));
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
  for (const Difference& d : t.differences) text += fmt::format(" {} |", d.name);
  text += "\n|---|";
  for (size_t i = 0; i < t.columns.size() + t.ratios.size() + t.differences.size(); ++i)
    text += "---|";
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
    for (const PairedDifference& d : s.differences[r]) {
      text += d.pairs == 0 ? std::string(" |")
                           : fmt::format(" **{}** {}, p = {:.2g}, {} pairs |", number(d.mean),
                                         range(d.interval), d.p, d.pairs);
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
    for (size_t d = 0; d < t.differences.size(); ++d) text += " |";
  }
  return text + "\n";
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

/// A figure that is drawn anew each time, without a CSV.
int draw(const Drawing& drawing, const ReproduceArguments& a) {
  const std::string out = a.out.empty() ? fmt::format("runs/{}.png", drawing.name) : a.out;
  const std::filesystem::path file(out);
  const std::pair<const char*, bool> of_runs[] = {
      {"--seeds", a.seeds > 0},         {"--full", a.full},     {"--row", !a.rows.empty()},
      {"--column", !a.columns.empty()}, {"--no-run", a.no_run}, {"--markdown", a.markdown},
      {"--picture", !a.picture.empty()}};
  for (const auto& [option, given] : of_runs) {
    if (given) {
      throw InputError(fmt::format(
          "{}: {} is drawn anew each time, from --seed into --out; it has no runs to choose",
          option, drawing.name));
    }
  }
  if (file.extension() != ".png" && (drawing.pixels || file.extension() != ".svg")) {
    throw InputError(
        fmt::format("--out {}: expected {}", out, drawing.pixels ? ".png" : ".png or .svg"));
  }
  makeFolder(file.parent_path());
  nlohmann::ordered_json j{{"figure", drawing.name}, {"seed", a.first_seed}, {"file", out}};
  const nlohmann::ordered_json told = drawing.draw(a.first_seed, out);
  j.update(told);
  if (a.json) {
    printJson(j);
    return kDone;
  }
  if (told.contains("summary")) writeResult(told["summary"].get<std::string>() + "\n");
  print("{}\n", out);
  return kDone;
}

int reproduceTable(const ReproduceArguments& a) {
  for (const Drawing& drawing : drawings()) {
    if (drawing.name == a.name) return draw(drawing, a);
  }
  const Table& table = findTable(a.name);
  const std::string out = a.out.empty() ? fmt::format("runs/{}.csv", table.name) : a.out;
  Interrupt interrupt;  // before any other thread
  Results results(table);
  if (a.no_run || std::filesystem::exists(out)) results = Results::read(table, out);
  if (a.no_run && results.outcomes().empty()) {
    throw InputError(fmt::format("{}: there is no whole run in it", out));
  }
  const bool figure = !table.points.empty() && table.drawn != Drawn::kNothing;
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
    note("stopped; the same command goes on with {}\n", out);
    return kInterrupted;
  }
  interrupt.release();
  nlohmann::ordered_json json;
  for (const Results& told : table.readings ? table.readings(results) : std::vector{results}) {
    const Summary summary = summarise(told);
    if (a.json) {
      json["tables"].push_back(asJson(told.table(), summary));
    } else {
      writeResult(a.markdown ? asMarkdown(told.table(), summary) : asText(told.table(), summary));
      if (table.readings) writeResult("\n");
    }
  }
  if (a.json) printJson(table.readings ? json : json["tables"][0]);
  std::string picture = a.picture;
  if (picture.empty() && figure && !a.no_run) {
    picture = std::filesystem::path(out).replace_extension(".png").string();
  }
  if (!picture.empty()) drawTable(results, picture);
  if (!a.quiet && !picture.empty()) note("figure: {}\n", picture);
  if (!a.quiet && !a.no_run) note("every run: {}\n", out);
  return kDone;
}

}  // namespace

void addReproduce(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<ReproduceArguments>();
  CLI::App* verb = program.add_subcommand(
      "reproduce", "Run a published table again; print the paper's numbers beside ours.");
  std::vector<std::string> names;
  for (const Table& t : allTables()) names.push_back(t.name);
  for (const Drawing& d : drawings()) names.emplace_back(d.name);
  verb->add_option("TABLE", a->name, "One of: " + join(names))->required();
  auto* seeds =
      verb->add_option("--seeds", a->seeds,
                       "Runs of each cell; default: minutes in all, but hours for figure-32 to 34")
          ->check(CLI::Range(1, 100'000));
  verb->add_flag("--full", a->full, "As many runs as the committed results have")->excludes(seeds);
  verb->add_option("--seed", a->first_seed, "The first seed")
      ->check(isSeed())
      ->capture_default_str();
  verb->add_option("--threads", a->threads, "0: one for each processor; changes no result")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--out", a->out,
                   "CSV of every run; runs it already has are not made again, and only one process "
                   "may write it at a time. Default: runs/TABLE.csv. Of figure-10 to 12, 28, 39 "
                   "and 40: the picture");
  verb->add_option("--row", a->rows, "Run only these rows; all that was run is told")
      ->delimiter(',');
  verb->add_option("--column", a->columns, "Run only these columns")->delimiter(',');
  verb->add_option(
      "--picture", a->picture,
      "Of figure-22, 32 to 34, 41, 42, families and table-13: the figure, .png or .svg; default "
      "beside --out");
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
      "  traceur reproduce figure-42 --row model --seeds 20\n"
      "  traceur reproduce figure-28 --seed 3 --out figure-28.png");
  verb->callback([a, &exit_code] { exit_code = reproduceTable(*a); });
}

}  // namespace traceur::cli
