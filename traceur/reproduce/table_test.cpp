#include "traceur/reproduce/table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <regex>
#include <sstream>

#include "traceur/core/error.h"
#include "traceur/core/file_lock.h"
#include "traceur/core/random.h"
#include "traceur/core/test_folder.h"
#include "traceur/reproduce/falls.h"

namespace traceur::reproduce {
namespace {

namespace fs = std::filesystem;

/// A table whose truth is known: the second column needs a third of the first.
Table known() {
  Table t;
  t.name = "known";
  t.rows = {{"a", "", "trials"}, {"b", "", "trials"}};
  t.columns = {{"slow", 8, 20, {300, 600}}, {"fast", 6, 10, {100, 200}}};
  t.ratios = {{"speed-up", 0, 1, {}}};
  t.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    Random random(seed, row, column);
    const double noise = 1 + 0.1 * random.uniform(-1, 1);
    return Outcome{(row + 1) * (column == 0 ? 300 : 100) * noise, seed == 2 && column == 0};
  };
  return t;
}

class TableFile : public testing::Test {
 protected:
  static std::string text(const fs::path& file) {
    std::stringstream s;
    s << std::ifstream(file).rdbuf();
    return s.str();
  }
  TestFolder dir;
};

TEST_F(TableFile, SumsUpWhatWasRun) {
  const Table table = known();
  Results results(table);
  EXPECT_TRUE(results.run({}, {}));
  const Summary s = summarise(results);
  EXPECT_EQ(s.cells[0][0].runs, 8);
  EXPECT_EQ(s.cells[0][0].missed, 1);
  EXPECT_EQ(s.cells[0][1].missed, 0);
  EXPECT_NEAR(s.cells[1][0].value, 600, 40);
  EXPECT_EQ(s.cells[1][0].printed, 600);
  EXPECT_EQ(s.cells[0][1].printed, 100);
  for (const auto& row : s.ratios) {
    EXPECT_NEAR(row[0].value, 3, 0.3);
    EXPECT_LT(row[0].interval.low, row[0].value);
    EXPECT_GT(row[0].interval.high, row[0].value);
    EXPECT_DOUBLE_EQ(row[0].printed, 3);
  }
  ASSERT_EQ(s.groups.size(), 1U);
  EXPECT_NEAR(s.groups[0].ratios[0].value, std::sqrt(s.ratios[0][0].value * s.ratios[1][0].value),
              1e-12);
}

/// Of the squares of 1 to 72, eight of which a trimmed mean leaves out at either end.
TEST_F(TableFile, ACellIsItsRowsCenterElseTheTables) {
  Table table = known();
  table.rows.push_back({"c", "other", "trials"});
  for (Column& c : table.columns) c.printed.clear();
  table.center = Center::kTrimmedMean;
  table.rows[1].center = Center::kMedian;
  table.rows[2].center = Center::kMean;
  Results results(table);
  double sum = 0, inner = 0;
  for (int k = 72; k >= 1; --k) {
    const double square = k * k;
    for (int row = 0; row < 3; ++row) {
      results.add({row, 0, static_cast<std::uint64_t>(k)}, {square});
    }
    sum += square;
    if (k > 8 && k <= 64) inner += square;
  }
  for (int row = 0; row < 3; ++row) results.add({row, 1, 1}, {10});
  const Summary s = summarise(results);
  EXPECT_DOUBLE_EQ(s.cells[0][0].value, inner / 56);
  EXPECT_DOUBLE_EQ(s.cells[1][0].value, (36 * 36 + 37 * 37) / 2.0);
  EXPECT_DOUBLE_EQ(s.cells[2][0].value, sum / 72);
  for (int row = 0; row < 3; ++row) {
    EXPECT_DOUBLE_EQ(s.ratios[row][0].value, s.cells[row][0].value / 10);
    EXPECT_LT(s.cells[row][0].interval.low, s.cells[row][0].value);
    EXPECT_GT(s.cells[row][0].interval.high, s.cells[row][0].value);
    // A cell of one run moves no ratio.
    EXPECT_DOUBLE_EQ(s.ratios[row][0].interval.low, s.cells[row][0].interval.low / 10);
  }
  ASSERT_EQ(s.groups.size(), 1U);
  EXPECT_NEAR(s.groups[0].ratios[0].value,
              std::sqrt(s.cells[0][0].value * s.cells[1][0].value) / 10, 1e-9);
  EXPECT_EQ(nameOf(Center::kMean), "mean");
  EXPECT_EQ(nameOf(Center::kTrimmedMean), "mean without the ninth of runs at either end");
  EXPECT_EQ(nameOf(Center::kMedian), "median");
}

TEST_F(TableFile, ARatioIsPrintedOnItsOwnOrOfWhatIsPrinted) {
  Table table = known();
  table.columns.push_back({"unprinted", 1, 1, {}});
  table.ratios = {{"own", 0, 1, {2, 8}}, {"none", 0, 2, {}}, {"of columns", 1, 0, {}}};
  Results results(table);
  for (int row = 0; row < 2; ++row) {
    results.add({row, 0, 1}, {3});
    if (row == 0) results.add({row, 1, 1}, {4});
    if (row == 1) results.add({row, 2, 1}, {6});
  }
  const Summary s = summarise(results);
  EXPECT_DOUBLE_EQ(s.ratios[0][0].printed, 2);
  EXPECT_DOUBLE_EQ(s.ratios[0][2].printed, 1.0 / 3);
  EXPECT_TRUE(std::isnan(s.ratios[1][1].printed));
  EXPECT_DOUBLE_EQ(s.ratios[0][0].value, 0.75);
  EXPECT_DOUBLE_EQ(s.ratios[1][1].value, 0.5);
  // One of the two cells is empty, the denominator or the numerator.
  EXPECT_TRUE(std::isnan(s.ratios[1][0].value));
  EXPECT_TRUE(std::isnan(s.ratios[1][2].value));
  ASSERT_EQ(s.groups.size(), 1U);
  EXPECT_TRUE(std::isnan(s.groups[0].ratios[0].value));
}

TEST_F(TableFile, GroupsAreOfTwoRowsOrMoreAndOfRatios) {
  Table table = known();
  table.rows = {{"a", "even", "trials"},
                {"b", "odd", "runs"},
                {"c", "even", "runs"},  // the first one's is the group's
                {"d", "even", "trials"}};
  for (Column& c : table.columns) c.printed.clear();
  Results results(table);
  results.run({}, {});
  const Summary s = summarise(results);
  ASSERT_EQ(s.groups.size(), 1U);
  EXPECT_EQ(s.groups[0].name, "even");
  EXPECT_EQ(s.groups[0].quantity, "trials");
  EXPECT_EQ(s.groups[0].rows, 3);
  double product = 1;
  for (const int row : {0, 2, 3}) product *= s.ratios[row][0].value;
  EXPECT_NEAR(s.groups[0].ratios[0].value, std::cbrt(product), 1e-12);
  EXPECT_TRUE(std::isnan(s.groups[0].ratios[0].printed));

  Table none = table;
  none.ratios.clear();
  Results plain(none);
  for (const auto& [key, outcome] : results.outcomes()) plain.add(key, outcome);
  EXPECT_TRUE(summarise(plain).groups.empty());

  Results few(table);  // a row without runs has no ratio, nor has its group
  for (const auto& [key, outcome] : results.outcomes()) {
    if (std::get<0>(key) != 2) few.add(key, outcome);
  }
  EXPECT_TRUE(std::isnan(summarise(few).groups[0].ratios[0].value));
}

TEST_F(TableFile, RunsAsManySeedsAsAskedAndSaysHowFarItIs) {
  const Table table = known();
  const auto seeds_of = [&](const Results::RunOptions& options) {
    Results results(table);
    EXPECT_TRUE(results.run(options, {}));
    std::vector<std::vector<std::uint64_t>> seeds(4);
    for (const auto& [key, outcome] : results.outcomes()) {
      const auto [row, column, seed] = key;
      seeds[2 * row + column].push_back(seed);
    }
    EXPECT_EQ(seeds[2], seeds[0]);
    EXPECT_EQ(seeds[3], seeds[1]);
    return std::array{seeds[0], seeds[1]};
  };
  const auto from = [](std::uint64_t first, int count) {
    std::vector<std::uint64_t> seeds(count);
    std::iota(seeds.begin(), seeds.end(), first);
    return seeds;
  };
  EXPECT_EQ(seeds_of({}), (std::array{from(1, 8), from(1, 6)}));
  EXPECT_EQ(seeds_of({.seeds = -1}), (std::array{from(1, 20), from(1, 10)}));
  EXPECT_EQ(seeds_of({.seeds = 3}), (std::array{from(1, 3), from(1, 3)}));
  EXPECT_EQ(seeds_of({.first_seed = 7, .seeds = 2}), (std::array{from(7, 2), from(7, 2)}));

  std::vector<std::pair<int, int>> told;
  const Results::RunOptions two{
      .seeds = 2, .on_progress = [&](int done, int total) { told.emplace_back(done, total); }};
  Results results(table);
  results.run({.seeds = 1}, {});
  results.run(two, {});
  std::vector<std::pair<int, int>> expected;
  for (int done = 4; done <= 8; ++done) expected.emplace_back(done, 8);
  EXPECT_EQ(told, expected);
}

TEST_F(TableFile, PairsTheRunsOfASeed) {
  Table table = known();
  table.differences = {{"slow - fast", 0, 1}};
  Results results(table);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    results.add({0, 0, seed}, {10.0 * static_cast<double>(seed) + 1});
    results.add({0, 1, seed}, {10.0 * static_cast<double>(seed)});
  }
  results.add({0, 0, 9}, {1000});  // has no partner
  const Summary s = summarise(results);
  EXPECT_EQ(s.differences[0][0].pairs, 4);
  EXPECT_DOUBLE_EQ(s.differences[0][0].mean, 1);
  EXPECT_DOUBLE_EQ(s.differences[0][0].interval.low, 1);
  EXPECT_DOUBLE_EQ(s.differences[0][0].p, 2.0 / 16);
  EXPECT_EQ(s.differences[1][0].pairs, 0);

  table.differences[0].without_missed = true;
  Results without(table);
  for (const auto& [key, outcome] : results.outcomes()) without.add(key, outcome);
  without.add({0, 1, 4}, {40, true});
  EXPECT_EQ(summarise(without).differences[0][0].pairs, 3);
  without.add({0, 0, 1}, {11, true});
  EXPECT_EQ(summarise(without).differences[0][0].pairs, 2);
  table.differences[0].without_missed = false;
  Results with(table);
  for (const auto& [key, outcome] : without.outcomes()) with.add(key, outcome);
  EXPECT_EQ(summarise(with).differences[0][0].pairs, 4);
}

TEST_F(TableFile, ACellHasAllSeedsOfItsOwn) {
  Results results(known());
  results.add({0, 1, 0}, {5});
  results.add({0, 1, 3}, {6});
  results.add({0, 0, 9}, {7, true});
  results.add({1, 1, 0}, {8, true});
  EXPECT_EQ(results.values(0, 1), (Sample{5, 6}));
  EXPECT_EQ(results.values(0, 0), (Sample{7}));
  EXPECT_TRUE(results.values(1, 0).empty());
  EXPECT_EQ(results.missed(0, 1), 0);
  EXPECT_EQ(results.missed(0, 0), 1);
  EXPECT_EQ(results.missed(1, 1), 1);
}

/// Runs are lines, in the order of rows, columns and seeds.
TEST_F(TableFile, IsWrittenAsTheHeaderHasIt) {
  Table table = known();
  table.points = "trials:cost";
  table.run = [](int row, int column, std::uint64_t seed, const std::stop_token&) {
    Outcome outcome{100.0 * row + 10 * column + 0.5 * static_cast<double>(seed), row == 1};
    if (seed == 1) outcome.points = {{1, 0.5}, {2, NAN}};
    return outcome;
  };
  Results(table).run({.seeds = 2, .wanted = [](int row, int column) { return row + column > 0; }},
                     dir / "new/folder/a.csv");
  EXPECT_EQ(text(dir / "new/folder/a.csv"),
            "# traceur reproduce known\n"
            "row,column,seed,value,missed,points\n"
            "a,fast,1,10.5,0,1:0.5 2:nan\n"
            "a,fast,2,11,0,-\n"
            "b,slow,1,100.5,1,1:0.5 2:nan\n"
            "b,slow,2,101,1,-\n"
            "b,fast,1,110.5,1,1:0.5 2:nan\n"
            "b,fast,2,111,1,-\n");
}

TEST_F(TableFile, ARunIsInTheFileWhenItIsTold) {
  const Table table = known();
  Results(table).run({.seeds = 1}, dir / "a.csv");
  std::ofstream(dir / "a.csv", std::ios::app) << "a,slow,2,2";  // cut short
  Results fresh(table);                                         // it has not read the file
  int told = 0;
  const auto on_progress = [&](int done, int total) {
    EXPECT_EQ(done, 4 + told++);
    EXPECT_EQ(total, 12);
    EXPECT_EQ(static_cast<int>(Results::read(table, dir / "a.csv").outcomes().size()), done);
  };
  EXPECT_TRUE(fresh.run({.seeds = 3, .on_progress = on_progress}, dir / "a.csv"));
  EXPECT_EQ(told, 9);
}

TEST_F(TableFile, WithNothingToRunTheFileIsLeftAlone) {
  const Table table = known();
  Results results(table);
  results.run({.seeds = 2}, dir / "a.csv");
  fs::remove(dir / "a.csv");
  const FileLock theirs = FileLock::take(dir / "a.csv");
  EXPECT_TRUE(results.run({.seeds = 2}, dir / "a.csv"));
  EXPECT_FALSE(fs::exists(dir / "a.csv"));
}

TEST_F(TableFile, ARunThatThrowsEndsThem) {
  Table table = known();
  int calls = 0;
  table.run = [&](int, int, std::uint64_t, const std::stop_token&) -> Outcome {
    if (++calls == 3) throw InputError("no such thing");
    return {1};
  };
  Results results(table);
  EXPECT_THROW(results.run({}, dir / "a.csv"), InputError);
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(Results::read(table, dir / "a.csv").outcomes().size(), 2U);
}

TEST_F(TableFile, AFileIsTheSameForAnyThreadsAndAfterBeingCutShort) {
  const Table table = known();
  for (const int threads : {1, 3}) {
    Results r(table);
    r.run({.threads = threads}, dir / fmt::format("{}.csv", threads));
  }
  const std::string whole = text(dir / "1.csv");
  EXPECT_EQ(text(dir / "3.csv"), whole);

  int calls = 0;
  Table counting = table;
  counting.run = [&](int row, int column, std::uint64_t seed, const std::stop_token& stop) {
    ++calls;
    return table.run(row, column, seed, stop);
  };
  std::ofstream(dir / "cut.csv") << whole.substr(0, whole.size() - 5);  // in the last line
  Results cut = Results::read(counting, dir / "cut.csv");
  cut.run({}, dir / "cut.csv");
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(text(dir / "cut.csv"), whole);
}

TEST_F(TableFile, StopsWhenAskedAndGoesOn) {
  const Table table = known();
  std::stop_source stop;
  Results first(table);
  EXPECT_FALSE(first.run({.stop = stop.get_token(),
                          .on_progress =
                              [&](int done, int) {
                                if (done >= 8) stop.request_stop();
                              }},
                         dir / "a.csv"));
  Results second = Results::read(table, dir / "a.csv");
  EXPECT_FALSE(second.values(0, 0).empty());
  EXPECT_TRUE(second.run({}, dir / "a.csv"));
  Results whole(table);
  whole.run({}, dir / "b.csv");
  EXPECT_EQ(text(dir / "a.csv"), text(dir / "b.csv"));
}

TEST_F(TableFile, OneProcessAtATimeAndNoRunIsLost) {
  const Table table = known();
  Results first(table);
  Results second(table);
  {
    const FileLock theirs = FileLock::take(dir / "a.csv");
    EXPECT_THROW(first.run({.seeds = 1}, dir / "a.csv"), InputError);
  }
  EXPECT_FALSE(fs::exists(dir / "a.csv"));
  first.run({.seeds = 2, .wanted = [](int row, int) { return row == 0; }}, dir / "a.csv");
  second.run({.seeds = 2, .wanted = [](int row, int) { return row == 1; }}, dir / "a.csv");
  Results whole(table);
  whole.run({.seeds = 2}, dir / "b.csv");
  EXPECT_EQ(text(dir / "a.csv"), text(dir / "b.csv"));
  // What killed processes left goes, also when there is nothing to do.
  std::ofstream(dir / "a.csv-lock").flush();
  std::ofstream(dir / ".a.csv.1-0.part").flush();
  whole.run({.seeds = 2}, dir / "a.csv");
  EXPECT_FALSE(fs::exists(dir / "a.csv-lock"));
  EXPECT_FALSE(fs::exists(dir / ".a.csv.1-0.part"));
}

TEST_F(TableFile, KeepsWhatRunsDrewAndRunsOnlyWhatIsWanted) {
  Table table = known();
  table.points = "trials:cost";
  table.run = [](int, int, std::uint64_t seed, const std::stop_token&) {
    return Outcome{1, false, {{static_cast<double>(seed), NAN}, {2.5, 1e-7}}};
  };
  Results results(table);
  results.run({.seeds = 2, .wanted = [](int row, int column) { return row == 1 && column == 0; }},
              dir / "a.csv");
  EXPECT_EQ(results.outcomes().size(), 2U);
  const Results again = Results::read(table, dir / "a.csv");
  const Outcome& o = again.outcomes().at({1, 0, 2});
  ASSERT_EQ(o.points.size(), 2U);
  EXPECT_EQ(o.points[0].x, 2);
  EXPECT_TRUE(std::isnan(o.points[0].y));
  EXPECT_EQ(o.points[1].y, 1e-7);

  Table none = table;  // a run that drew nothing
  none.run = [](int, int, std::uint64_t, const std::stop_token&) { return Outcome{1, true}; };
  Results(none).run({.seeds = 1}, dir / "b.csv");
  EXPECT_TRUE(Results::read(none, dir / "b.csv").outcomes().at({0, 0, 1}).points.empty());
}

TEST_F(TableFile, RunsMadeWithSomethingElseAreNotMixed) {
  Table table = known();
  std::string skill = "jump 1";
  table.made_with = [&] { return skill; };
  Results(table).run({.seeds = 1}, dir / "a.csv");
  EXPECT_EQ(text(dir / "a.csv").substr(0, 43), "# traceur reproduce known, made with jump 1");
  EXPECT_TRUE(Results::read(table, dir / "a.csv").run({.seeds = 2}, dir / "a.csv"));
  fs::copy_file(dir / "a.csv", dir / "c.csv");
  EXPECT_TRUE(Results(table).run({.seeds = 3}, dir / "c.csv"));
  EXPECT_EQ(Results::read(table, dir / "c.csv").outcomes().size(), 12U);
  skill = "jump 2";
  Results other = Results::read(table, dir / "a.csv");
  EXPECT_EQ(other.outcomes().size(), 8U);  // to look at they are as good as ever
  EXPECT_TRUE(other.run({.seeds = 2}, dir / "a.csv"));
  EXPECT_THROW(other.run({.seeds = 3}, dir / "a.csv"), InputError);
}

TEST_F(TableFile, ARunThatWasCutShortIsNotKept) {
  Table table = known();
  std::stop_source stop;
  table.run = [&](int, int, std::uint64_t, const std::stop_token&) {
    stop.request_stop();
    return Outcome{7, false};
  };
  Results results(table);
  EXPECT_FALSE(results.run({.stop = stop.get_token()}, dir / "a.csv"));
  EXPECT_TRUE(Results::read(table, dir / "a.csv").outcomes().empty());
}

TEST_F(TableFile, RefusesForeignFilesByLine) {
  const Table table = known();
  const auto refused = [&](const std::string& content, const std::string& words) {
    std::ofstream(dir / "x.csv") << content;
    try {
      Results::read(table, dir / "x.csv");
      FAIL() << "accepted: " << content;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  const std::string head = "# traceur reproduce known\nrow,column,seed,value,missed\n";
  refused("# traceur reproduce table-7\n", "x.csv:1");
  refused(head + "c,slow,1,3,0\n", "no row \"c\"");
  refused(head + "a,medium,1,3,0\n", "no column \"medium\"");
  refused(head + "a,slow,1,much,0\n", "x.csv:3");
  refused(head + "a,slow,1\n", "expected 5 fields, got 3");
  refused(head + "a,slow,1,3,0,-\n", "expected 5 fields, got 6");
  refused(head + "a,slow,1,3,0\na,slow,one,3,0\n", "x.csv:4: expected numbers");
  refused("# traceur reproduce known\nrow,column\n", "x.csv:2: expected \"row,column,seed");
  refused("# traceur reproduce knows", "x.csv:1: expected \"# traceur reproduce known\", got");
  refused("some notes", "x.csv:1");
  refused(std::string(100, 'x'), "got \"" + std::string(80, 'x') + "\"");
  refused("# traceur reproduce known, made with\n", "x.csv:1");
  // Cut short in the first line, or later, it is ours.
  for (const std::string& cut :
       {std::string("# trace"), std::string("# traceur reproduce known"),
        std::string("# traceur reproduce known, made wi"), head + "a,sl"}) {
    std::ofstream(dir / "x.csv") << cut;
    EXPECT_TRUE(Results::read(table, dir / "x.csv").outcomes().empty()) << cut;
  }
  Table drawing = table;
  drawing.points = "trials:cost";
  std::ofstream(dir / "x.csv") << "# traceur reproduce known\nrow,column,seed,value,missed,points\n"
                                  "a,slow,1,3,0\n";
  EXPECT_THROW(Results::read(drawing, dir / "x.csv"), InputError);
  EXPECT_THROW(Results::read(table, dir.path()), InputError);
  EXPECT_THROW(Results::read(table, dir / "none.csv"), SystemError);
}

/// What a table copies from print, added up with weights that tell places apart.
double printedSum(const Table& t) {
  double sum = 0;
  int n = 0;
  const auto add = [&](double x) {
    if (!std::isnan(x)) sum += x * (1 + 0.01 * n++);
  };
  for (const Column& c : t.columns) {
    for (const double x : c.printed) add(x);
  }
  for (const Ratio& r : t.ratios) {
    for (const double x : r.printed) add(x);
  }
  if (t.readings) {
    for (const Results& reading : t.readings(Results(t))) add(printedSum(reading.table()));
  }
  if (!t.printed_points) return sum;
  for (int row = 0; row < static_cast<int>(t.rows.size()); ++row) {
    for (int column = 0; column < static_cast<int>(t.columns.size()); ++column) {
      for (const Point& p : t.printed_points(row, column)) {
        add(p.x);
        add(p.y);
      }
    }
  }
  return sum;
}

/// Nothing but the source tells whether a copied number is right: the sums are those of what is
/// copied, so that none changes unseen. Whoever mends a number mends its sum.
TEST(Tables, CopyWhatIsPrinted) {
  std::map<std::string, double> sums;
  for (const Table& t : allTables()) {
    if (const double sum = printedSum(t); sum != 0) sums[t.name] = sum;
  }
  const std::map<std::string, double> expected = {
      {"figure-17", 466.718},     {"landing-condition", 0.3623}, {"figure-22", 90.16952},
      {"figure-32", 717519.6826}, {"figure-33", 130207.4132},    {"figure-34", 2.3706476},
      {"figure-41", 4390110.44},  {"table-11", 112770.5658},     {"table-13", 468.50109},
      {"table-3", 6.605641},      {"table-4", 3471.151},         {"table-7", 8164.152},
      {"table-7-motions", 596.7}, {"table-8", 6837.096},         {"table-9", 22326.688},
      {"tables-7-9", 35090.712}};
  for (const auto& [name, sum] : sums) {
    const auto known = expected.find(name);
    EXPECT_NEAR(sum, known == expected.end() ? 0 : known->second, 1e-9 * std::abs(sum)) << name;
  }
  EXPECT_EQ(sums.size(), expected.size());
}

/// The columns a ratio or a difference is of are those that its name says.
TEST(Tables, RatiosAndDifferencesAreOfTheColumnsTheyName) {
  using Names = std::pair<std::string, std::string>;
  const std::map<std::string, Names> otherwise = {
      {"CMA-ES 21 / 6", {"CMA-ES 21 tasks", "CMA-ES"}},
      {"contextual 21 / 6", {"contextual 21 tasks", "contextual"}},
      {"distance / path", {"robot", "model"}},
      {"with - without", {"with noise", "without noise"}},
      {"the same, no search of the pair missed", {"with noise", "without noise"}}};
  const auto expect = [&](const Table& t, const std::string& name, const std::string& sign,
                          int first, int second) {
    SCOPED_TRACE(t.name + ": " + name);
    const size_t middle = name.find(sign);
    Names names = otherwise.contains(name)
                      ? otherwise.at(name)
                      : Names(name.substr(0, middle), name.substr(middle + sign.size()));
    if (t.name == "fall-robustness") names.first = "the plan for 5 N";
    EXPECT_EQ(t.columns[first].name, names.first);
    EXPECT_EQ(t.columns[second].name, names.second);
  };
  const auto check = [&](const Table& t) {
    for (const Ratio& r : t.ratios) expect(t, r.name, " / ", r.numerator, r.denominator);
    for (const Difference& d : t.differences) expect(t, d.name, " - ", d.minuend, d.subtrahend);
  };
  for (const Table& t : allTables()) {
    check(t);
    if (!t.readings) continue;
    for (const Results& reading : t.readings(Results(t))) check(reading.table());
  }
}

/// What stands for a cell's runs, what they draw, how many there are: told here once more, so that
/// none is lost.
TEST(Tables, AreToldAsTheyAre) {
  struct Kind {
    std::string name;
    Center center;
    std::string points;
    int seeds, full;
    Drawn drawn = Drawn::kLines;
  };
  const std::vector<Kind> kinds = {
      {"table-7", Center::kMean, "", 20, 100},
      {"table-8", Center::kMean, "", 20, 100},
      {"table-9", Center::kMean, "", 20, 100},
      {"tables-7-9", Center::kMean, "", 20, 100},
      {"table-7-motions", Center::kMean, "", 3, 30},
      {"coach-faults", Center::kMean, "", 1, 8},
      {"constrained", Center::kMedian, "", 11, 51},
      {"table-11", Center::kTrimmedMean, "", 9, 90},
      {"families", Center::kMedian, "task:error", 1, 9},
      {"figure-32", Center::kTrimmedMean, "trials:cost", 1, 9},
      {"figure-33", Center::kTrimmedMean, "trials:cost", 1, 9},
      {"figure-34", Center::kMedian, "task:cost", 1, 9},
      {"table-13", Center::kMean, "iteration:cost", 3, 20},
      {"figure-41", Center::kMean, "iteration:cost", 5, 10},
      {"figure-42", Center::kMean, "square:balanced", 10, 30, Drawn::kMap},
      {"bongo-faults", Center::kMean, "starts:balanced", 3, 20, Drawn::kNothing},
      {"table-3", Center::kMean, "", 3, 9},
      {"table-4", Center::kMean, "", 3, 9},
      {"fall-robustness", Center::kMean, "", 3, 9},
      {"figure-22", Center::kMean, "x:y", 1, 9},
      {"random-falls", Center::kMedian, "push:share", 10, 100, Drawn::kNothing},
      {"table-2", Center::kMean, "", 1, 1},
      {"figure-17", Center::kMedian, "", 20, 100},
      {"landing-condition", Center::kMean, "", 1, 3},
      {"landing-flight", Center::kMedian, "", 20, 100},
      {"landing-lean", Center::kMean, "", 20, 100},
      {"landing-atlas", Center::kMean, "square:stands", 4, 100, Drawn::kMap}};
  ASSERT_EQ(allTables().size(), kinds.size());
  const auto worded = [](const Table& t) {
    EXPECT_EQ(t.title.back(), '.') << t.title;
    EXPECT_EQ(t.protocol.back(), '.') << t.protocol;
  };
  for (size_t i = 0; i < kinds.size(); ++i) {
    const Kind& k = kinds[i];
    const Table& t = allTables()[i];
    SCOPED_TRACE(k.name);
    EXPECT_EQ(t.name, k.name);
    EXPECT_EQ(nameOf(t.center), nameOf(k.center));
    EXPECT_EQ(t.points, k.points);
    EXPECT_EQ(t.drawn, k.drawn);
    for (const Column& c : t.columns) {
      EXPECT_EQ(c.seeds, k.seeds);
      EXPECT_EQ(c.full, c.name == "CMA-ES" && k.full == 100 ? 200 : k.full);
    }
    worded(t);
    if (!t.readings) continue;
    for (const Results& reading : t.readings(Results(t))) {
      worded(reading.table());
      EXPECT_EQ(reading.table().points, "");
      EXPECT_FALSE(reading.table().readings);
    }
  }
  // Those of the robots' files, not of a formula.
  for (const Table& t : allTables()) {
    const bool of_skills = t.name == "families" || t.name == "table-7-motions" ||
                           t.name == "coach-faults" || t.name.starts_with("figure-3");
    const bool of_falls = t.name.find("fall") != std::string::npos || t.name == "table-3" ||
                          t.name == "table-4" || t.name == "figure-22";
    const bool of_landings =
        t.name == "table-2" || t.name == "figure-17" || t.name.starts_with("landing-");
    EXPECT_EQ(static_cast<bool>(t.made_with), of_skills || of_falls || of_landings) << t.name;
  }
}

/// The engine, then a print of each robot that falls.
TEST(Tables, SayWhatFallsAreMadeWith) {
  const std::string prints = findTable("table-3").made_with();
  EXPECT_TRUE(std::regex_match(
      prints, std::regex("MuJoCo [0-9.]+ bioloid-gp [0-9a-f]{8} atlas [0-9a-f]{8}")))
      << prints;
  EXPECT_NE(prints.substr(prints.size() - 8), prints.substr(prints.find("-gp ") + 4, 8));
}

/// The runs committed for a table.
Results committed(const Table& table) {
  const fs::path folder = "docs/reproduction";
  const std::string file = table.name + ".csv";
  const fs::path finished = folder / file;
  return Results::read(table, fs::exists(finished) ? finished : folder / "unfinished" / file);
}

/// So that rows and columns are called as they were, and have as many runs as they say.
TEST(Tables, AreThoseOfTheCommittedRuns) {
  // Which some columns have not all of.
  const std::map<std::string, std::vector<std::string>> fewer = {
      {"bongo-faults", {"published", "published none"}},
      {"figure-32", {"CMA-ES", "CMA-ES cubic", "curve cubic", "contextual cubic"}},
      {"figure-33", {"CMA-ES", "CMA-ES 21 tasks", "curve 21 tasks"}}};
  int count = 0;
  for (const auto& entry : fs::directory_iterator("docs/reproduction")) {
    if (entry.path().extension() != ".csv") continue;
    const Table& table = findTable(entry.path().stem().string());
    const Results results = committed(table);
    ++count;
    for (int c = 0; c < static_cast<int>(table.columns.size()); ++c) {
      int most = 0;
      for (int r = 0; r < static_cast<int>(table.rows.size()); ++r) {
        most = std::max(most, static_cast<int>(results.values(r, c).size()));
      }
      SCOPED_TRACE(table.name + " " + table.columns[c].name);
      const auto some = fewer.find(table.name);
      if (some != fewer.end() && std::ranges::count(some->second, table.columns[c].name) > 0) {
        EXPECT_LT(most, table.columns[c].full);
      } else {
        EXPECT_EQ(most, table.columns[c].full);
      }
    }
  }
  EXPECT_GE(count, 13);
}

/// Cells of a table whose runs take no more than a second.
struct Cells {
  std::string table;
  std::vector<int> rows, columns;
  std::uint64_t seed = 1;
};

class CommittedRuns : public testing::TestWithParam<Cells> {};

/// What was committed is what this program gives.
TEST_P(CommittedRuns, ComeAgain) {
  const Cells& cells = GetParam();
  const Table& table = findTable(cells.table);
  const Results known = committed(table);
  for (const int row : cells.rows) {
    for (const int column : cells.columns) {
      SCOPED_TRACE(table.rows[row].name + ", " + table.columns[column].name);
      const Outcome again = table.run(row, column, cells.seed, {});
      const auto before = known.outcomes().find({row, column, cells.seed});
      ASSERT_NE(before, known.outcomes().end());
      EXPECT_NEAR(again.value, before->second.value, 1e-9 * std::abs(before->second.value));
      EXPECT_EQ(again.missed, before->second.missed);
      ASSERT_EQ(again.points.size(), before->second.points.size());
      for (size_t i = 0; i < again.points.size(); ++i) {
        const Point& p = before->second.points[i];
        EXPECT_NEAR(again.points[i].x, p.x, 1e-9 * std::abs(p.x)) << i;
        EXPECT_NEAR(again.points[i].y, p.y, 1e-9 * std::abs(p.y)) << i;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, CommittedRuns,
    testing::Values(Cells{"tables-7-9", {0, 10}, {0, 1, 2, 3, 4}},
                    Cells{"tables-7-9", {9, 19}, {0, 2, 3, 4}},
                    Cells{"tables-7-9", {1, 2, 3, 4, 5, 6, 7, 8}, {0, 3}},
                    Cells{"constrained", {0, 2, 3, 4, 6, 8, 9, 10}, {1, 2}},
                    Cells{"constrained", {0, 6, 8}, {0, 3}}, Cells{"constrained", {1, 5}, {2}},
                    Cells{"table-11", {3, 6, 8}, {0, 1, 2}}, Cells{"table-3", {4}, {0, 2}},
                    Cells{"table-3", {1}, {3}}, Cells{"table-3", {0}, {4}},
                    Cells{"table-4", {5}, {4}}, Cells{"fall-robustness", {8}, {0, 1}, 2},
                    Cells{"random-falls", {0}, {1}, 2}, Cells{"figure-22", {0}, {0}, 2},
                    Cells{"table-13", {0, 6}, {0}, 4}, Cells{"figure-41", {1}, {0}, 2},
                    Cells{"figure-42", {1}, {1}, 2}),
    [](const auto& cells) {
      std::string name = fmt::format("{}_{}", cells.param.table, cells.index);
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

TEST(Tables, TheFallsOfFigure22GoForwardAndDown) {
  const Table& t = findTable("figure-22");
  for (int row = 0; row < static_cast<int>(t.rows.size()); ++row) {
    for (const int column : {0, 1}) {
      SCOPED_TRACE(fmt::format("{} {}", t.rows[row].name, t.columns[column].name));
      const std::vector<Point> path = t.printed_points(row, column);
      ASSERT_GE(path.size(), 5U);
      const double length = std::hypot(path.back().x - path[0].x, path.back().y - path[0].y);
      for (size_t i = 1; i < path.size(); ++i) {
        EXPECT_GT(path[i].x, path[i - 1].x) << i;
        EXPECT_LT(path[i].y, path[i - 1].y + 0.05 * length) << i;
        const double step = std::hypot(path[i].x - path[i - 1].x, path[i].y - path[i - 1].y);
        EXPECT_LT(step, 0.35 * length) << i;
      }
    }
  }
}

TEST(Figure22, TellsHowFarTheRobotIsFromTheModelsPath) {
  const std::vector<fall::Vector2d> path = {{0, 1}, {3, 1}, {3, 0}};
  const std::vector<fall::Vector2d> com = {{0, 1}, {3, 3}, {3, 4}, {9, 9}};
  const Outcome robot = alongPath(com, path, true);
  EXPECT_NEAR(robot.value, (0 + 2 + 4) / 3.0, 1e-12);
  EXPECT_FALSE(robot.missed);
  ASSERT_EQ(robot.points.size(), 3U);
  EXPECT_EQ(robot.points[2].y, 4);
  const Outcome model = alongPath(com, path, false);
  EXPECT_NEAR(model.value, 4, 1e-12);
  EXPECT_EQ(model.points[2].y, 0);
  EXPECT_FALSE(alongPath(path, path, true).missed);
  EXPECT_TRUE(alongPath({{0, 1}, {3, 3}}, path, true).missed);
  EXPECT_TRUE(alongPath(com, {}, true).missed);
}

TEST(RandomFalls, AreSharesOfTheHeldPose) {
  const auto trial = [](bool fell, double impulse, bool diverged = false) {
    fall::FallTrial t;
    t.fell = fell;
    t.impulse = impulse;
    t.diverged = diverged;
    return t;
  };
  const fall::FallTrial held = trial(true, 4), planned = trial(true, 1);
  const Outcome quarter = shareOfHeld(held, planned, 6);
  EXPECT_EQ(quarter.value, 0.25);
  EXPECT_FALSE(quarter.missed);
  EXPECT_EQ(quarter.points[0].x, 6);
  EXPECT_EQ(quarter.points[0].y, 0.25);
  EXPECT_TRUE(shareOfHeld(held, held, 6).missed);
  EXPECT_EQ(shareOfHeld(planned, held, 6).value, 4);
  EXPECT_TRUE(shareOfHeld(planned, held, 6).missed);
  // Nothing is told by one that stood or that the simulation lost.
  for (const auto& [a, b] :
       {std::pair(trial(false, 4), planned), std::pair(trial(true, 4, true), planned),
        std::pair(held, trial(true, 1, true))}) {
    const Outcome nothing = shareOfHeld(a, b, 6);
    EXPECT_EQ(nothing.value, 1);
    EXPECT_TRUE(nothing.missed);
    EXPECT_EQ(nothing.points[0].y, 1);
  }
  EXPECT_EQ(outcomeOf(held).value, 4);
  EXPECT_FALSE(outcomeOf(held).missed);
  for (const fall::FallTrial& none : {trial(false, 4), trial(true, 4, true)}) {
    EXPECT_EQ(outcomeOf(none).value, 0);
    EXPECT_TRUE(outcomeOf(none).missed);
  }
}

TEST(Tables, AreWhole) {
  for (const Table& t : allTables()) {
    SCOPED_TRACE(t.name);
    EXPECT_EQ(&findTable(t.name), &t);
    EXPECT_FALSE(t.protocol.empty());
    for (const Row& r : t.rows) EXPECT_EQ(r.name.find(','), std::string::npos) << r.name;
    for (const Column& c : t.columns) {
      EXPECT_EQ(c.name.find(','), std::string::npos) << c.name;
      EXPECT_GT(c.seeds, 0);
      EXPECT_GE(c.full, c.seeds);
      EXPECT_TRUE(c.printed.empty() || c.printed.size() == t.rows.size()) << c.name;
    }
    for (const Ratio& r : t.ratios) {
      EXPECT_LT(std::max(r.numerator, r.denominator), static_cast<int>(t.columns.size()));
      EXPECT_TRUE(r.printed.empty() || r.printed.size() == t.rows.size()) << r.name;
    }
    for (const Difference& d : t.differences) {
      EXPECT_LT(std::max(d.minuend, d.subtrahend), static_cast<int>(t.columns.size()));
    }
    EXPECT_TRUE(t.drawn != Drawn::kMap || t.map.count > 0);
  }
  EXPECT_THROW(findTable("table-99"), InputError);
}

}  // namespace
}  // namespace traceur::reproduce
