// A published table or figure as something to run again: what was printed, and one function that
// repeats a single run of a single cell.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <limits>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "traceur/reproduce/statistics.h"

namespace traceur::reproduce {

struct Point {
  double x = 0;
  double y = 0;
};

/// What one run gave.
struct Outcome {
  double value = 0;     ///< in Row::quantity
  bool missed = false;  ///< it did not get there; value is then what the protocol counts for it
  /// What the run drew, where a figure is made of it: the cost over trials, the error over tasks.
  std::vector<Point> points = {};
};

inline constexpr double kNotPrinted = std::numeric_limits<double>::quiet_NaN();

/// What stands for a cell's runs.
enum class Center {
  kMean,
  kTrimmedMean,  ///< without the ninth of runs at either end: seven of nine [Ha2015, §7.4.2]
  kMedian
};

struct Row {
  std::string name;       ///< "Toy1"; unique in its table
  std::string group;      ///< rows of one group are summed up together; "" for a single one
  std::string quantity;   ///< "evaluations", "cost"
  std::string unit = {};  ///< of `task` and `error` in Table::points
  /// Where it is not the table's, to be said in `quantity`.
  std::optional<Center> center = {};
};

struct Column {
  std::string name;             ///< "CMA-ES"; unique in its table
  int seeds = 0;                ///< runs of a cell by default: minutes for the whole table
  int full = 0;                 ///< runs of a cell in the committed results
  std::vector<double> printed;  ///< a row each, kNotPrinted where the source says nothing
};

/// The quotient of two columns' values in each row.
struct Ratio {
  std::string name;                  ///< "speed-up"
  int numerator = 0;                 ///< column
  int denominator = 0;               ///< column
  std::vector<double> printed = {};  ///< a row each; empty: what the columns' printed values give
};

/// What one column's runs have more than another's of the same seeds, which are alike but for what
/// the columns differ in.
struct Difference {
  std::string name;    ///< "with noise - without"
  int minuend = 0;     ///< column
  int subtrahend = 0;  ///< column
  /// Without the pairs one of which was missed: then it is no longer the seeds that were set out
  /// with, which is to be said beside it.
  bool without_missed = false;
};

/// How a table's picture shows Outcome::points.
enum class Drawn {
  kNothing,
  kLines,  ///< a panel for each row, a colour for each column, a line for each seed
  kMap     ///< a panel for each cell: x numbers the squares of a Table::map, y is 0 to 1, the mean
           ///< over the seeds is shown
};

/// Squares in rows from the lowest left one, x = j·count + i.
struct Map {
  int count = 0;             ///< each way
  double low = 0, high = 0;  ///< of x
  double y_offset = 0;       ///< y goes from low + y_offset to high + y_offset
  std::string xlabel, ylabel;
};

/// The word for it: "trimmed mean".
std::string_view nameOf(Center center);

class Results;

struct Table {
  std::string name;      ///< the word a person types: "table-7"
  std::string title;     ///< a sentence
  std::string protocol;  ///< start, stop rule, counting, trimming: what it takes to repeat it
  std::vector<Row> rows;
  std::vector<Column> columns;
  std::vector<Ratio> ratios;
  std::vector<Difference> differences = {};
  Center center = Center::kMean;
  /// "trials:cost": what Outcome::points are; empty for a table without.
  std::string points = {};
  Drawn drawn = Drawn::kLines;  ///< of a table with points
  Map map = {};                 ///< of Drawn::kMap
  /// Pure, and callable from several threads. Asked to stop, it may return anything soon.
  std::function<Outcome(int row, int column, std::uint64_t seed, const std::stop_token& stop)> run;
  /// What its runs depend on besides this program, in a few words, such as the skill files' prints;
  /// runs made with something else are not added to. Empty: nothing.
  std::function<std::string()> made_with = {};
  /// What the source's figure has for a cell; empty: nothing is printed of any.
  std::function<std::vector<Point>(int row, int column)> printed_points = {};
  /// The tables that are told in place of this one, made from what its runs drew; empty: itself.
  std::function<std::vector<Results>(const Results&)> readings = {};
};

const std::vector<Table>& allTables();

/// @throws InputError with the names there are for one there is not
const Table& findTable(std::string_view name);

/// The runs made so far: (row, column, seed) → outcome, as a CSV file with the lines
///
///     # traceur reproduce table-7            or, with Table::made_with: …, made with jump 1a2b
///     row,column,seed,value,missed
///     Toy1,CMA-ES,1,664,0
///
/// with one more field, `points`, of "x:y" separated by spaces or "-", for a table whose runs draw
/// some. Equal runs give equal files. A line cut short by a crash is run again.
class Results {
 public:
  using Key = std::tuple<int, int, std::uint64_t>;  // row, column, seed

  explicit Results(Table table) : table_(std::move(table)) {}

  /// @throws InputError naming file and line for what is not such a file, of another table or of a
  /// row or column the table does not have; SystemError when it cannot be read
  static Results read(const Table& table, const std::filesystem::path& file);

  struct RunOptions {
    std::uint64_t first_seed = 1;
    int seeds = 0;  ///< of each cell; 0: Column::seeds; negative: Column::full
    int threads = 1;
    std::function<bool(int row, int column)> wanted = {};  ///< empty: every cell
    std::stop_token stop = {};
    /// Before the first run and after each; not from two threads at once.
    std::function<void(int done, int total)> on_progress = {};
  };
  /// Makes the runs that are missing, appending them to the file as they end.
  /// @param file  empty: kept in memory only
  /// @return false when it was asked to stop before the last
  /// @throws InputError when there are runs already, made with something else; when another process
  /// writes the file; when what it holds by then cannot be read
  bool run(const RunOptions& options, const std::filesystem::path& file);

  const Table& table() const { return table_; }
  const std::map<Key, Outcome>& outcomes() const { return outcomes_; }
  void add(const Key& key, Outcome outcome) { outcomes_[key] = std::move(outcome); }
  /// The values of one cell in the order of seeds.
  Sample values(int row, int column) const;
  int missed(int row, int column) const;

 private:
  std::vector<Key> wanted(const RunOptions& options) const;
  void write(const std::filesystem::path& file) const;
  void writeLine(std::ostream& out, const Key& key, const Outcome& outcome) const;

  Table table_;
  std::string made_with_;  // of the runs there are; "" for none
  std::map<Key, Outcome> outcomes_;
};

/// One cell, summed up.
struct CellSummary {
  int runs = 0;
  int missed = 0;
  double value = 0;  ///< the row's Center of the runs
  Interval interval;
  double printed = kNotPrinted;
};

struct RatioSummary {
  double value = 0;  ///< of the two cells' values
  Interval interval;
  double printed = kNotPrinted;
};

struct Summary {
  std::vector<std::vector<CellSummary>> cells;    ///< [row][column]; runs = 0: not run
  std::vector<std::vector<RatioSummary>> ratios;  ///< [row][ratio]; NaN where a cell is missing
  /// [row][difference]; of the seeds both cells have, pairs = 0 for none
  std::vector<std::vector<PairedDifference>> differences;
  struct Group {
    std::string name;
    std::string quantity;
    int rows = 0;
    std::vector<RatioSummary> ratios;  ///< geometric means over the group's rows
  };
  std::vector<Group> groups;  ///< of more than one row
};

Summary summarise(const Results& results);

}  // namespace traceur::reproduce
