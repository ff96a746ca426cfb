#include "traceur/bias/run_log_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"
#include "traceur/core/toml.h"

namespace traceur::bias {
namespace {

constexpr const char* kFormat = "traceur log";
constexpr int kVersion = 1;
/// More columns beside ours are a file of another kind.
constexpr std::ptrdiff_t kMostColumns = 1000;
/// What some editors and spreadsheets put before a text, to say that it is UTF-8.
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// States, then inputs.
std::vector<LogFormat::Column> columnsOf(const LogFormat& format) {
  std::vector<LogFormat::Column> columns = format.states;
  columns.insert(columns.end(), format.inputs.begin(), format.inputs.end());
  return columns;
}

}  // namespace

LogFormat bongoLogFormat() {
  return {"bongo board",
          {{"wheel", "rad"},
           {"board", "rad"},
           {"leg", "rad"},
           {"wheel_rate", "rad/s"},
           {"board_rate", "rad/s"},
           {"leg_rate", "rad/s"}},
          {{"torque", "N·m"}}};
}

void writeLog(const std::filesystem::path& file, const RunLog& log, const LogFormat& format) {
  nlohmann::ordered_json header{{"format", kFormat},
                                {"version", kVersion},
                                {"plant", format.plant},
                                {"time_step", log.time_step},
                                {"units", {{"time", "s"}}}};
  std::string names = "time";
  for (const LogFormat::Column& c : columnsOf(format)) {
    header["units"][c.name] = c.unit;
    names += "," + c.name;
  }
  std::string text = fmt::format("# {}\n{}\n", header.dump(), names);
  for (int t = 0; t <= log.steps(); ++t) {
    text += fmt::format("{:.9g}", t * log.time_step);
    for (const double x : log.x.col(t)) text += fmt::format(",{}", x);
    for (Eigen::Index i = 0; i < log.u.rows(); ++i) {
      text += t < log.steps() ? fmt::format(",{}", log.u(i, t)) : ",";
    }
    text += '\n';
  }
  PendingFile pending(file);
  pending.write(text);
  pending.commit();
}

RunLog readLog(const std::filesystem::path& file, const LogFormat& format) {
  const std::string text = readFile(file);
  int number = 0;
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}:{}: {}", file.string(), number, what));
  };
  size_t from = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  const auto next = [&]() -> std::optional<std::string> {
    if (from >= text.size()) return std::nullopt;
    const size_t to = std::min(text.find('\n', from), text.size());
    std::string line = text.substr(from, to - from);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    from = to + 1;
    ++number;
    return line;
  };

  const std::optional<std::string> first = next();
  if (!first || first->substr(0, 1) != "#") {
    number = 1;
    fail("expected a line \"# {…}\" that says what this log is");
  }
  const std::vector<LogFormat::Column> wanted = columnsOf(format);
  RunLog log;
  try {
    const nlohmann::json header = nlohmann::json::parse(first->substr(1));
    const std::string kind = header.at("format");
    const int version = header.at("version");
    const std::string plant = header.at("plant");
    if (kind != kFormat || version != kVersion) {
      fail(fmt::format("expected \"{}\", version {}, got \"{}\", version {}", kFormat, kVersion,
                       kind, version));
    }
    if (plant != format.plant) {
      fail(fmt::format("a log of the plant \"{}\", expected \"{}\"", plant, format.plant));
    }
    log.time_step = header.at("time_step");
    if (!(log.time_step > 0)) fail("\"time_step\": expected seconds > 0");
    const auto& units = header.at("units");
    const auto unit = [&](const std::string& name, const std::string& expected) {
      const std::string got = units.value(name, "");
      if (got == expected) return;
      fail(fmt::format("\"{}\" is in \"{}\", expected \"{}\"", name, got, expected));
    };
    unit("time", "s");
    for (const LogFormat::Column& c : wanted) unit(c.name, c.unit);
  } catch (const nlohmann::json::exception& e) {
    fail(fmt::format("the first line is not the header of a log: {}", e.what()));
  }

  // Counted before it is taken apart, so that a line of millions costs nothing.
  const auto columns = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',') + 1;
  };
  const std::string heads = next().value_or("");
  if (heads.empty()) fail("expected a line with the names of the columns after the first");
  if (columns(heads) > kMostColumns) {
    fail(fmt::format("{} columns: expected {} at most", columns(heads), kMostColumns));
  }
  const std::vector<std::string> names = split(heads, ',');
  const auto place = [&](const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) fail(fmt::format("no column \"{}\".{}", name, didYouMean(name, names)));
    if (std::find(at + 1, names.end(), name) != names.end()) {
      fail(fmt::format("two columns \"{}\": which one counts?", name));
    }
    return static_cast<size_t>(at - names.begin());
  };
  const size_t time = place("time");
  std::vector<size_t> places;
  places.reserve(wanted.size());
  for (const LogFormat::Column& c : wanted) places.push_back(place(c.name));

  const size_t states = format.states.size();
  std::vector<std::vector<double>> rows;
  bool ended = false;  // a reading without an input has been seen
  double last = 0;
  while (const std::optional<std::string> line = next()) {
    if (line->empty()) continue;
    if (ended) fail("a row after one without an input, which only the last may be");
    if (columns(*line) > columns(heads)) {
      fail(fmt::format("{} cells, expected {} as the columns", columns(*line), columns(heads)));
    }
    // split() drops an empty last field: the last reading's input.
    const std::vector<std::string> fields = split(*line, ',');
    const auto field = [&](size_t at) { return at < fields.size() ? fields[at] : std::string(); };
    const auto numeric = [&](size_t at, const std::string& name) {
      const std::optional<double> x = parseNumber(field(at));
      if (!x || !std::isfinite(*x)) {
        fail(fmt::format("\"{}\": expected a finite number, got \"{}\"", name, field(at)));
      }
      return x.value_or(0);
    };
    const double now = numeric(time, "time");
    if (!rows.empty() && std::abs(now - last - log.time_step) > 0.01 * log.time_step) {
      fail(fmt::format("time {} s after {} s: expected a step of {} s", now, last, log.time_step));
    }
    last = now;
    std::vector<double> row;
    for (size_t i = 0; i < wanted.size(); ++i) {
      if (i >= states && field(places[i]).empty()) {
        ended = true;
        row.push_back(0);
        continue;
      }
      row.push_back(numeric(places[i], wanted[i].name));
    }
    rows.push_back(std::move(row));
  }
  if (rows.size() < 2) fail(fmt::format("{} readings: expected at least two", rows.size()));

  const auto steps = static_cast<Eigen::Index>(rows.size()) - 1;
  log.x.resize(static_cast<Eigen::Index>(states), steps + 1);
  log.u.resize(static_cast<Eigen::Index>(wanted.size() - states), steps);
  for (Eigen::Index t = 0; t <= steps; ++t) {
    for (size_t i = 0; i < wanted.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (i < states) {
        log.x(at, t) = rows[t][i];
      } else if (t < steps) {
        log.u(at - static_cast<Eigen::Index>(states), t) = rows[t][i];
      }
    }
  }
  return log;
}

}  // namespace traceur::bias
