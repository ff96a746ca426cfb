#include "traceur/reproduce/table.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <sstream>

#include "traceur/core/error.h"
#include "traceur/core/file_lock.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/text.h"
#include "traceur/core/thread_pool.h"

namespace traceur::reproduce {
namespace {

/// The names of the fields of a line.
std::string header(const Table& table) {
  return std::string("row,column,seed,value,missed") + (table.points.empty() ? "" : ",points");
}

/// "0:1.5 10:0.25", the points of a line; "-" for none.
std::vector<Point> toPoints(const std::string& text) {
  std::vector<Point> points;
  if (text == "-") return points;
  for (const std::string& word : split(text, ' ')) {
    const std::vector<std::string> f = split(word, ':');
    points.push_back({std::stod(f.at(0)), std::stod(f.at(1))});
  }
  return points;
}

constexpr std::string_view kMadeWith = ", made with ";

std::string title(const Table& table) {
  return fmt::format("# traceur reproduce {}", table.name);
}

template <typename T>
int indexOf(const std::vector<T>& named, const std::string& name) {
  const auto found =
      std::find_if(named.begin(), named.end(), [&](const T& t) { return t.name == name; });
  return found == named.end() ? -1 : static_cast<int>(found - named.begin());
}

double center(const Sample& values, Center c) {
  return c == Center::kMean          ? mean(values)
         : c == Center::kTrimmedMean ? trimmedMean(values, 1.0 / 9)
                                     : median(values);
}

double printedRatio(const Table& t, const Ratio& ratio, size_t row) {
  if (!ratio.printed.empty()) return ratio.printed[row];
  const auto at = [&](int column) {
    const std::vector<double>& printed = t.columns[column].printed;
    return printed.empty() ? kNotPrinted : printed[row];
  };
  return at(ratio.numerator) / at(ratio.denominator);
}

}  // namespace

Results Results::read(const Table& table, const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw SystemError(fmt::format("{}: {}", file.string(), std::strerror(errno)));
  if (std::filesystem::is_directory(file)) {
    throw InputError(fmt::format("{}: expected a CSV of runs, got a folder", file.string()));
  }
  std::stringstream whole;
  whole << in.rdbuf();
  const std::string text = whole.str();

  Results results(table);
  int number = 0;
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}:{}: {}", file.string(), number, what));
  };
  for (size_t from = 0; from < text.size();) {
    const size_t to = text.find('\n', from);
    if (to == std::string::npos) {  // cut short: run again, unless it is no file of ours
      const std::string whole_title = title(table);
      const size_t common = std::min(text.size() - from, whole_title.size());
      if (number == 0 && text.compare(0, common, whole_title, 0, common) != 0) {
        number = 1;
        fail(fmt::format("expected \"{}\", got \"{}\"", whole_title, text.substr(0, 80)));
      }
      break;
    }
    const std::string line = text.substr(from, to - from);
    from = to + 1;
    ++number;
    if (number == 1) {
      const size_t comma = line.find(kMadeWith);
      if (line.substr(0, comma) != title(table)) {
        fail(fmt::format("expected \"{}\", got \"{}\"", title(table), line));
      }
      if (comma != std::string::npos) {
        results.made_with_ = line.substr(comma + kMadeWith.size());
      }
      continue;
    }
    if (number == 2) {
      if (line != header(table)) {
        fail(fmt::format("expected \"{}\", got \"{}\"", header(table), line));
      }
      continue;
    }
    const std::vector<std::string> f = split(line, ',');
    const size_t fields = table.points.empty() ? 5 : 6;
    if (f.size() != fields) fail(fmt::format("expected {} fields, got {}", fields, f.size()));
    const int row = indexOf(table.rows, f[0]);
    const int column = indexOf(table.columns, f[1]);
    if (row < 0) fail(fmt::format("{} has no row \"{}\"", table.name, f[0]));
    if (column < 0) fail(fmt::format("{} has no column \"{}\"", table.name, f[1]));
    try {
      Outcome outcome{std::stod(f[3]), f[4] == "1"};
      if (!table.points.empty()) outcome.points = toPoints(f[5]);
      results.outcomes_[{row, column, std::stoull(f[2])}] = std::move(outcome);
    } catch (const std::exception&) {
      fail(fmt::format("expected numbers, got \"{}\"", line));
    }
  }
  return results;
}

std::vector<Results::Key> Results::wanted(const RunOptions& options) const {
  std::vector<Key> keys;
  int most = 0;
  const auto seeds_of = [&](const Column& c) {
    return options.seeds > 0 ? options.seeds : options.seeds < 0 ? c.full : c.seeds;
  };
  for (const Column& c : table_.columns) most = std::max(most, seeds_of(c));
  for (int s = 0; s < most; ++s) {
    for (int r = 0; r < static_cast<int>(table_.rows.size()); ++r) {
      for (int c = 0; c < static_cast<int>(table_.columns.size()); ++c) {
        if (s >= seeds_of(table_.columns[c])) continue;
        if (options.wanted && !options.wanted(r, c)) continue;
        keys.push_back({r, c, options.first_seed + s});
      }
    }
  }
  return keys;
}

bool Results::run(const RunOptions& options, const std::filesystem::path& file) {
  std::vector<Key> todo = wanted(options);
  const int total = static_cast<int>(todo.size());
  const auto is_there = [&](const Key& key) { return outcomes_.contains(key); };
  std::erase_if(todo, is_there);
  std::optional<FileLock> only_we;
  if (!file.empty()) {
    PendingFile::sweep(file);
    FileLock::sweep(file);
  }
  if (!file.empty() && !todo.empty()) {
    makeFolder(file.parent_path());
    only_we = FileLock::take(file);
    if (std::filesystem::exists(file)) {  // there may be more by now
      Results there = read(table_, file);
      outcomes_.merge(there.outcomes_);
      if (made_with_.empty()) made_with_ = there.made_with_;
      std::erase_if(todo, is_there);
    }
  }

  if (table_.made_with && !todo.empty()) {
    const std::string now = table_.made_with();
    if (!outcomes_.empty() && made_with_ != now) {
      throw InputError(fmt::format(
          "{}: its runs were made with {}; now there is {}: give another file", file.string(),
          made_with_.empty() ? "what it does not say" : made_with_, now));
    }
    made_with_ = now;
  }
  const bool keep = !file.empty() && !todo.empty();
  std::ofstream out;
  if (keep) {
    write(file);  // anew: a line cut short by a crash must not stay in the middle
    out.open(file, std::ios::app);
  }

  int done = total - static_cast<int>(todo.size());
  const auto progress = [&] {
    if (options.on_progress) options.on_progress(done, total);
  };
  progress();
  ThreadPool pool(options.threads);
  std::mutex mutex;                  // of all below but the run itself
  std::atomic<bool> failed = false;  // the rest need not be run
  bool whole = true;
  pool.forEach(static_cast<int>(todo.size()), [&](int i) {
    const auto [row, column, seed] = todo[i];
    if (failed) return;
    Outcome outcome;
    try {
      if (!options.stop.stop_requested()) outcome = table_.run(row, column, seed, options.stop);
    } catch (...) {
      failed = true;
      throw;
    }
    const std::lock_guard lock(mutex);
    if (options.stop.stop_requested()) {  // it may have cut the run short
      whole = false;
      return;
    }
    if (keep) {
      writeLine(out, todo[i], outcome);
      if (!out.flush()) {
        failed = true;
        throw SystemError(fmt::format("{}: cannot be written", file.string()));
      }
    }
    outcomes_[todo[i]] = std::move(outcome);
    ++done;
    progress();
  });
  out.close();
  if (keep) write(file);  // in order, whatever the runs' order was
  return whole;
}

void Results::write(const std::filesystem::path& file) const {
  std::ostringstream text;
  fmt::print(text, "{}{}{}\n{}\n", title(table_), made_with_.empty() ? "" : kMadeWith, made_with_,
             header(table_));
  for (const auto& [key, outcome] : outcomes_) writeLine(text, key, outcome);
  PendingFile pending(file);
  pending.write(text.str());
  pending.commit();
}

void Results::writeLine(std::ostream& out, const Key& key, const Outcome& outcome) const {
  const auto [row, column, seed] = key;
  fmt::print(out, "{},{},{},{},{}", table_.rows[row].name, table_.columns[column].name, seed,
             outcome.value, outcome.missed ? 1 : 0);
  if (!table_.points.empty() && outcome.points.empty()) out << ",-";
  const char* separator = ",";
  for (const Point& p : outcome.points) {
    fmt::print(out, "{}{}:{}", separator, p.x, p.y);
    separator = " ";
  }
  out << '\n';
}

Sample Results::values(int row, int column) const {
  Sample values;
  for (auto i = outcomes_.lower_bound({row, column, 0}); i != outcomes_.end(); ++i) {
    if (std::get<0>(i->first) != row || std::get<1>(i->first) != column) break;
    values.push_back(i->second.value);
  }
  return values;
}

int Results::missed(int row, int column) const {
  int count = 0;
  for (const auto& [key, outcome] : outcomes_) {
    count += std::get<0>(key) == row && std::get<1>(key) == column && outcome.missed;
  }
  return count;
}

Summary summarise(const Results& results) {
  const Table& t = results.table();
  const size_t rows = t.rows.size();
  const auto center_of = [&t](size_t row) { return t.rows[row].center.value_or(t.center); };
  std::vector<std::vector<Sample>> samples(rows);
  Summary summary;
  summary.cells.resize(rows);
  summary.ratios.resize(rows);
  summary.differences.resize(rows);
  for (size_t r = 0; r < rows; ++r) {
    for (size_t c = 0; c < t.columns.size(); ++c) {
      samples[r].push_back(results.values(static_cast<int>(r), static_cast<int>(c)));
      const Sample& sample = samples[r].back();
      CellSummary cell;
      cell.runs = static_cast<int>(sample.size());
      if (!t.columns[c].printed.empty()) cell.printed = t.columns[c].printed[r];
      if (cell.runs > 0) {
        cell.missed = results.missed(static_cast<int>(r), static_cast<int>(c));
        const Center of = center_of(r);
        cell.value = center(sample, of);
        cell.interval =
            bootstrap({&sample, 1}, [&](const auto& drawn) { return center(drawn[0], of); });
      }
      summary.cells[r].push_back(cell);
    }
  }

  // The geometric mean over rows of the ratio of two columns' means.
  const auto ratio_over = [&](const std::vector<size_t>& over, const Ratio& ratio) {
    RatioSummary s;
    std::vector<Sample> pairs;
    std::vector<double> printed;
    for (const size_t r : over) {
      pairs.push_back(samples[r][ratio.numerator]);
      pairs.push_back(samples[r][ratio.denominator]);
      printed.push_back(printedRatio(t, ratio, r));
      if (pairs.back().empty() || pairs[pairs.size() - 2].empty()) {
        s.value = kNotPrinted;
        return s;
      }
    }
    const auto statistic = [&](std::span<const Sample> drawn) {
      std::vector<double> each;
      for (size_t i = 0; i < over.size(); ++i) {
        const Center c = center_of(over[i]);
        each.push_back(center(drawn[2 * i], c) / center(drawn[2 * i + 1], c));
      }
      return geometricMean(each);
    };
    s.value = statistic(pairs);
    s.interval = bootstrap(pairs, [&](const auto& drawn) {
      // Of infinite by infinite nothing is known, not even an upper bound.
      const double value = statistic(drawn);
      return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    });
    s.printed = geometricMean(printed);
    return s;
  };
  std::vector<std::pair<std::string, std::vector<size_t>>> groups;
  for (size_t r = 0; r < rows; ++r) {
    for (const Ratio& ratio : t.ratios) summary.ratios[r].push_back(ratio_over({r}, ratio));
    for (const Difference& d : t.differences) {
      Sample of_seeds;
      for (const auto& [key, outcome] : results.outcomes()) {
        const auto [row, column, seed] = key;
        if (row != static_cast<int>(r) || column != d.minuend) continue;
        const auto other = results.outcomes().find({row, d.subtrahend, seed});
        if (other == results.outcomes().end()) continue;
        if (d.without_missed && (outcome.missed || other->second.missed)) continue;
        of_seeds.push_back(outcome.value - other->second.value);
      }
      summary.differences[r].push_back(of_seeds.empty() ? PairedDifference()
                                                        : pairedDifference(of_seeds));
    }
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const auto& g) { return g.first == t.rows[r].group; });
    if (group == groups.end()) group = groups.insert(groups.end(), {t.rows[r].group, {}});
    group->second.push_back(r);
  }
  for (const auto& [name, members] : groups) {
    if (members.size() < 2 || t.ratios.empty()) continue;
    Summary::Group group{name, t.rows[members[0]].quantity, static_cast<int>(members.size()), {}};
    for (const Ratio& ratio : t.ratios) group.ratios.push_back(ratio_over(members, ratio));
    summary.groups.push_back(std::move(group));
  }
  return summary;
}

std::string_view nameOf(Center center) {
  return center == Center::kMean          ? "mean"
         : center == Center::kTrimmedMean ? "mean without the ninth of runs at either end"
                                          : "median";
}

const Table& findTable(std::string_view name) {
  std::vector<std::string> names;
  for (const Table& table : allTables()) {
    if (table.name == name) return table;
    names.push_back(table.name);
  }
  throw InputError(fmt::format("no table or figure \"{}\".{} There is: {}", name,
                               didYouMean(name, names), join(names)));
}

}  // namespace traceur::reproduce
