// Run files of another's making: SQLite keeps anything anywhere, and so might a stranger.
#include "traceur/core/run_file.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"

namespace traceur {
namespace {

/// A run of one trial, after something was done to its database.
class Changed {
 public:
  explicit Changed(const std::string& sql) {
    {
      RunFile run = RunFile::create(file(), {{"seed", "1"}});
      const TrialRow rows[] = {{0, 0, 1.5, false, "", {1, 2}}};
      run.appendGeneration(0, rows, "state", {});
      run.putRecording("best", "bytes");
    }
    sqlite3* db = nullptr;
    sqlite3_open(file().c_str(), &db);
    char* wrong = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &wrong), SQLITE_OK) << wrong;
    sqlite3_close(db);
  }
  std::filesystem::path file() const { return folder_ / "a.run"; }
  /// What reading all of it says.
  std::string refusal() const {
    try {
      const RunFile run = RunFile::open(file(), false);
      run.trials();
      run.meta("seed");
      run.state();
      run.recording("best");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }

 private:
  TestFolder folder_;
};

TEST(RunFileOfAStranger, TablesThatAreNotOursAreRefusedBeforeTheyAreRead) {
  for (const char* sql :
       {("DROP TABLE trial; CREATE VIEW trial AS WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT "
         "i + 1 FROM n) SELECT i AS generation, 0 AS number, 1.0 AS cost, 0 AS failed, '' AS "
         "violated, zeroblob(8) AS x FROM n"),
        "DROP TABLE resume", "CREATE TABLE more(a)", "CREATE INDEX i ON trial(cost)",
        "CREATE TRIGGER t AFTER INSERT ON meta BEGIN DELETE FROM meta; END",
        "ALTER TABLE trial ADD COLUMN more"}) {
    const Changed run(sql);
    EXPECT_EQ(run.refusal(), run.file().string() +
                                 ": not a run file of this version: its tables are not those of a "
                                 "run")
        << sql;
  }
}

TEST(RunFileOfAStranger, ValuesOfOtherTypesAreRefusedByName) {
  const std::pair<const char*, const char*> wrong[] = {
      {"UPDATE trial SET cost = 'low'", "cost: expected a number"},
      {"UPDATE trial SET failed = x'00'", "failed: expected a whole number"},
      {"UPDATE trial SET violated = 3.5; UPDATE trial SET violated = x'66'", "violated"},
      {"UPDATE trial SET x = x'0011'", "x: 2 bytes"},
      {"UPDATE trial SET x = 'text'", "x: expected bytes"},
      {"INSERT INTO trial VALUES(1, 0, 1.0, 0, '', zeroblob(24))", "x: 24 bytes"},
      {"UPDATE trial SET generation = -1", "generation: expected 0 to"},
      {"UPDATE trial SET number = 5000000000", "number: expected 0 to"},
      {"UPDATE trial SET number = 1000000001", "number: expected 0 to 1000000000, got 1000000001"},
      {"UPDATE trial SET x = zeroblob(8); INSERT INTO trial VALUES(1, 3, 1.0, 0, '', zeroblob(16))",
       "x: 16 bytes in trial 3 of generation 1"},
      {"UPDATE meta SET value = x'ff'", "value: expected text"},
      {"UPDATE meta SET value = CAST(x'ff41' AS TEXT)", "value: expected UTF-8"},
      {"UPDATE resume SET state = NULL", "state: expected bytes"},
      {"UPDATE recording SET bytes = 7", "bytes: expected bytes"}};
  for (const auto& [sql, words] : wrong) {
    const std::string said = Changed(sql).refusal();
    EXPECT_NE(said.find(std::string(": not a run file of this version: ") + words),
              std::string::npos)
        << sql << ": " << said;
  }
  EXPECT_EQ(Changed("UPDATE trial SET cost = NULL; UPDATE trial SET failed = 1").refusal(), "");
  EXPECT_EQ(Changed("UPDATE trial SET cost = 2").refusal(), "");
  EXPECT_EQ(Changed("UPDATE trial SET number = 1000000000, generation = 0").refusal(), "");
}

TEST(RunFileOfAStranger, WhatCannotBeReadAgainIsNotWritten) {
  const TestFolder folder;
  EXPECT_THROW(RunFile::create(folder / "a.run", {{"command", "caf\xe9"}}), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace traceur
