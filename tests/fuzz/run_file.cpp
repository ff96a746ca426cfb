// A run file of another's making: the first byte chooses whether the rest are its bytes, or values
// of any type in the tables of a run.
#include "traceur/core/run_file.h"

#include <fuzzer/FuzzedDataProvider.h>
#include <sqlite3.h>

#include "tests/fuzz/fuzz.h"
#include "traceur/practice/run.h"

namespace {

using namespace traceur;

void bindAnything(sqlite3_stmt* statement, int i, FuzzedDataProvider& from) {
  switch (from.ConsumeIntegralInRange(0, 4)) {
    case 0:
      sqlite3_bind_null(statement, i);
      break;
    case 1:
      sqlite3_bind_int64(statement, i, from.ConsumeIntegral<std::int64_t>());
      break;
    case 2:
      sqlite3_bind_double(statement, i, from.ConsumeFloatingPoint<double>());
      break;
    case 3: {
      const std::string text = from.ConsumeRandomLengthString(200);
      sqlite3_bind_text(statement, i, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
      break;
    }
    default: {
      const std::string bytes = from.ConsumeRandomLengthString(200);
      sqlite3_bind_blob(statement, i, bytes.data(), static_cast<int>(bytes.size()),
                        SQLITE_TRANSIENT);
    }
  }
}

void insert(sqlite3* db, const char* sql, int values, FuzzedDataProvider& from) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(db, sql, -1, &statement, nullptr) != SQLITE_OK) std::abort();
  for (int i = 1; i <= values; ++i) bindAnything(statement, i, from);
  sqlite3_step(statement);
  sqlite3_finalize(statement);
}

/// A run whose rows hold what the bytes say.
void fill(const std::filesystem::path& file, FuzzedDataProvider& from) {
  practice::Run::begin(file,
                       {.search = {.optimiser = "contextual",
                                   .tasks = Eigen::VectorXd::LinSpaced(3, 0, 1),
                                   .curve = "linear"},
                        .parameters = {{"x", "m", 0, 1, 0.5, ""}},
                        .constraints = {"fell"},
                        .command = practice::CommandInRun{"./f", "x=0:1"}},
                       false);
  sqlite3* db = nullptr;
  sqlite3_open(file.c_str(), &db);
  sqlite3_exec(db, "PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY", nullptr, nullptr,
               nullptr);
  while (from.remaining_bytes() > 0) {
    switch (from.ConsumeIntegralInRange(0, 4)) {
      case 0:
        insert(db, "INSERT OR REPLACE INTO meta VALUES('family', ?)", 1, from);
        break;
      case 1:
        insert(db, "INSERT OR REPLACE INTO meta VALUES(?, ?)", 2, from);
        break;
      case 2:
        insert(db, "INSERT OR REPLACE INTO trial VALUES(?, ?, ?, ?, ?, ?)", 6, from);
        break;
      case 3:
        insert(db, "INSERT OR REPLACE INTO resume VALUES(0, ?, ?)", 2, from);
        break;
      default:
        insert(db, "INSERT OR REPLACE INTO recording VALUES('best', ?)", 1, from);
    }
  }
  sqlite3_close(db);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::filesystem::path file = fuzz::folder() / "fuzzed.run";
  std::filesystem::remove(file);
  if (data[0] % 2 == 0) {
    fuzz::fileOf(fuzz::textOf(data + 1, size - 1), "fuzzed.run");
  } else {
    FuzzedDataProvider from(data + 1, size - 1);
    fill(file, from);
  }
  try {
    const practice::Run run = practice::Run::open(file);
    fuzz::maybeRefused([&] { run.progress(); });
    fuzz::maybeRefused([&] { run.file().state(); });
    fuzz::maybeRefused([&] { run.recording(); });
    fuzz::maybeRefused([&] { run.family(); });
    fuzz::maybeRefused([&] { run.familyCosts(); });
    fuzz::maybeRefused([&] { run.outcome(); });
  } catch (const InputError&) {   // as it should be
  } catch (const SystemError&) {  // what SQLite says of a file that it cannot use
  }
  return 0;
}
