#include "traceur/core/run_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/file_lock.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/utf8.h"

namespace traceur {
namespace {

constexpr int kApplicationId = 0x54726372;  // "Trcr"

constexpr const char* kSchema = R"(
  CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE trial(generation INTEGER, number INTEGER, cost REAL, failed INTEGER NOT NULL,
                     violated TEXT NOT NULL, x BLOB NOT NULL, PRIMARY KEY(generation, number));
  CREATE TABLE resume(id INTEGER PRIMARY KEY CHECK(id = 0), generation INTEGER, state BLOB);
  CREATE TABLE recording(name TEXT PRIMARY KEY, bytes BLOB NOT NULL) WITHOUT ROWID;
)";

}  // namespace

struct RunFile::Impl {
  std::filesystem::path file;
  std::optional<FileLock> lock;  // given back after the database is closed
  sqlite3* db = nullptr;

  ~Impl() { sqlite3_close(db); }

  void openDatabase(bool to_write) {
    sqlite3_close(db);
    db = nullptr;
    if (sqlite3_open_v2(file.c_str(), &db, to_write ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY,
                        nullptr) != SQLITE_OK) {
      fail("cannot be opened");
    }
    sqlite3_busy_timeout(db, 5000);
  }

  /// A process killed while it wrote leaves a journal, and the first to open the file takes its
  /// half-written generation back. A reader may not, so it borrows the lock to do it.
  void takeBackWhatWasCutOff() {
    sqlite3_exec(db, "PRAGMA schema_version", nullptr, nullptr, nullptr);
    const int code = sqlite3_extended_errcode(db);
    if (code != SQLITE_READONLY_ROLLBACK && code != SQLITE_READONLY_CANTINIT &&
        code != SQLITE_READONLY_DIRECTORY) {
      return;
    }
    try {
      lock = FileLock::tryToTake(file);
      if (lock) {
        openDatabase(true);
        execute("PRAGMA schema_version", "cannot be taken back to its last whole generation");
        lock.reset();
      }
      openDatabase(false);
    } catch (const SystemError& e) {
      throw InputError(
          fmt::format("{}: was cut off while it was being written, and cannot be put right here "
                      "({}); resume it, or copy it and its -journal to where you may write",
                      file.string(), e.what()));
    }
  }

  /// SQLite's complaint as ours: what is wrong with the file is the caller's, the rest the
  /// machine's.
  [[noreturn]] void fail(const std::string& what) const {
    const int code = sqlite3_errcode(db) & 0xff;
    const std::string message = fmt::format("{}: {}: {}", file.string(), what, sqlite3_errmsg(db));
    if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) {
      throw InputError(message + " (left as it is)");
    }
    throw SystemError(message);
  }

  /// The file is a run by its mark, but not as we write one.
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(fmt::format("{}: not a run file of this version: {}", file.string(), what));
  }

  void execute(const char* sql, const std::string& what) const {
    if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(what);
  }
};

namespace {

/// Trials and generations are counted up to here; what says more was not counted [ours].
constexpr sqlite3_int64 kMostCount = 1'000'000'000;

/// A prepared statement; columns and parameters count from 1 when bound, from 0 when read. SQLite
/// keeps a value of any type in any column: of another than ours, InputError.
class Statement {
 public:
  template <class Impl>
  Statement(const Impl& impl, const char* sql)
      : fail_([&impl] { impl.fail("cannot be used"); }),
        refuse_([&impl](const std::string& what) { impl.refuse(what); }) {
    if (sqlite3_prepare_v2(impl.db, sql, -1, &statement_, nullptr) != SQLITE_OK) fail_();
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(int i, std::string_view text) {
    sqlite3_bind_text(statement_, i, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
    return *this;
  }
  Statement& bind(int i, double x) {
    sqlite3_bind_double(statement_, i, x);
    return *this;
  }
  Statement& bind(int i, int x) {
    sqlite3_bind_int(statement_, i, x);
    return *this;
  }
  Statement& bindBlob(int i, std::string_view bytes) {
    sqlite3_bind_blob(statement_, i, bytes.data(), static_cast<int>(bytes.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  /// @return whether there is a row
  bool step() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail_();
    return code == SQLITE_ROW;
  }
  void run() {
    step();
    sqlite3_reset(statement_);
  }
  std::string text(int i) const {
    require(i, SQLITE_TEXT, "text");
    std::string text = bytes(i);
    if (!isUtf8(text)) refuse_(name(i) + ": expected UTF-8");
    return text;
  }
  std::string blob(int i) const {
    require(i, SQLITE_BLOB, "bytes");
    return bytes(i);
  }
  /// NaN is kept as NULL.
  double real(int i) const {
    const int type = sqlite3_column_type(statement_, i);
    if (type == SQLITE_NULL) return std::numeric_limits<double>::quiet_NaN();
    if (type != SQLITE_INTEGER) require(i, SQLITE_FLOAT, "a number");
    return sqlite3_column_double(statement_, i);
  }
  int count(int i) const {
    require(i, SQLITE_INTEGER, "a whole number");
    const sqlite3_int64 n = sqlite3_column_int64(statement_, i);
    if (n < 0 || n > kMostCount) {
      refuse_(fmt::format("{}: expected 0 to {}, got {}", name(i), kMostCount, n));
    }
    return static_cast<int>(n);
  }
  /// What a PRAGMA answers, whatever it is.
  std::string answer() { return step() ? bytes(0) : std::string(); }

 private:
  std::string name(int i) const { return sqlite3_column_name(statement_, i); }
  void require(int i, int type, const char* what) const {
    if (sqlite3_column_type(statement_, i) != type) {
      refuse_(fmt::format("{}: expected {}", name(i), what));
    }
  }
  std::string bytes(int i) const {
    const void* p = sqlite3_column_blob(statement_, i);
    const int n = sqlite3_column_bytes(statement_, i);
    return p ? std::string(static_cast<const char*>(p), n) : std::string();
  }

  std::function<void()> fail_;
  std::function<void(const std::string&)> refuse_;
  sqlite3_stmt* statement_ = nullptr;
};

void putMeta(const auto& impl, const RunFile::Meta& meta) {
  Statement insert(
      impl, "INSERT INTO meta VALUES(?, ?) ON CONFLICT DO UPDATE SET value = excluded.value");
  for (const auto& [key, value] : meta) {
    if (!isUtf8(value)) throw InputError(fmt::format("{}: expected UTF-8 text", key));
    insert.bind(1, key).bind(2, value).run();
  }
}

/// Every table, index, view and trigger of a database, as it was declared.
std::vector<std::string> declarationsOf(sqlite3* db) {
  std::vector<std::string> all;
  const auto keep = [](void* list, int, char** values, char**) {
    std::string row;
    for (int i = 0; i < 3; ++i) row += fmt::format("{} ", values[i] ? values[i] : "");
    static_cast<std::vector<std::string>*>(list)->push_back(row);
    return 0;
  };
  sqlite3_exec(db, "SELECT type, name, sql FROM sqlite_schema ORDER BY type, name", keep, &all,
               nullptr);
  return all;
}

/// A view or a trigger could compute for ever, a column could be another's.
bool isOurSchema(sqlite3* db) {
  static const std::vector<std::string> kOurs = [] {
    sqlite3* empty = nullptr;
    sqlite3_open(":memory:", &empty);
    sqlite3_exec(empty, kSchema, nullptr, nullptr, nullptr);
    std::vector<std::string> all = declarationsOf(empty);
    sqlite3_close(empty);
    return all;
  }();
  return declarationsOf(db) == kOurs;
}

/// Commits when done() was called, otherwise takes everything back.
class Transaction {
 public:
  explicit Transaction(sqlite3* db) : db_(db) {}
  ~Transaction() {
    if (!done_) sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
  void done() { done_ = true; }

 private:
  sqlite3* db_;
  bool done_ = false;
};

}  // namespace

RunFile::RunFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RunFile::~RunFile() = default;
RunFile::RunFile(RunFile&&) noexcept = default;
RunFile& RunFile::operator=(RunFile&&) noexcept = default;

RunFile RunFile::create(const std::filesystem::path& file, const Meta& meta) {
  makeFolder(file.parent_path());
  const int made = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (made < 0 && errno == EEXIST) {
    throw InputError(fmt::format("{}: exists already", file.string()));
  }
  if (made < 0) {
    throw SystemError(fmt::format("{}: cannot be made: {}", file.string(), std::strerror(errno)));
  }
  ::close(made);
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  try {
    impl->lock = FileLock::take(file);
    impl->openDatabase(true);
    Transaction transaction(impl->db);
    impl->execute("BEGIN IMMEDIATE", "cannot be written");
    impl->execute(kSchema, "cannot be written");
    impl->execute(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}",
                              kApplicationId, kVersion)
                      .c_str(),
                  "cannot be written");
    putMeta(*impl, meta);
    impl->execute("COMMIT", "cannot be written");
    transaction.done();
  } catch (...) {
    std::error_code error;
    std::filesystem::remove(file, error);  // made above: nothing half-written stays
    throw;
  }
  return RunFile(std::move(impl));
}

RunFile RunFile::open(const std::filesystem::path& file, bool to_write) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: no such run file", file.string()));
  }
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  // Two programs that resume the same run would write the same generations.
  if (to_write) impl->lock = FileLock::take(file);
  impl->openDatabase(to_write);
  if (!to_write) impl->takeBackWhatWasCutOff();
  const auto pragma = [&](const char* name) {
    Statement s(*impl, fmt::format("PRAGMA {}", name).c_str());
    return s.answer();
  };
  if (pragma("page_count") == "0") {
    throw InputError(fmt::format("{}: empty: it was cut off before it began", file.string()));
  }
  if (pragma("application_id") != std::to_string(kApplicationId)) {
    throw InputError(fmt::format("{}: an SQLite file, but not a Traceur run", file.string()));
  }
  if (const int version = std::stoi(pragma("user_version")); version > kVersion) {
    throw InputError(fmt::format("{}: run file version {}, this program reads up to {}",
                                 file.string(), version, kVersion));
  }
  if (!isOurSchema(impl->db)) impl->refuse("its tables are not those of a run");
  if (const std::string verdict = pragma("quick_check(1)"); verdict != "ok") {
    throw InputError(fmt::format("{}: damaged: {} (left as it is)", file.string(), verdict));
  }
  return RunFile(std::move(impl));
}

std::optional<std::string> RunFile::meta(const std::string& key) const {
  Statement s(*impl_, "SELECT value FROM meta WHERE key = ?");
  s.bind(1, key);
  if (!s.step()) return std::nullopt;
  return s.text(0);
}

void RunFile::setMeta(const Meta& meta) {
  Transaction transaction(impl_->db);
  impl_->execute("BEGIN IMMEDIATE", "cannot be written");
  putMeta(*impl_, meta);
  impl_->execute("COMMIT", "cannot be written");
  transaction.done();
}

void RunFile::appendGeneration(int generation, std::span<const TrialRow> trials,
                               std::string_view state, const Meta& progress) {
  Transaction transaction(impl_->db);
  impl_->execute("BEGIN IMMEDIATE", "cannot be written");
  Statement insert(*impl_, "INSERT INTO trial VALUES(?, ?, ?, ?, ?, ?)");
  for (const TrialRow& t : trials) {
    insert.bind(1, generation).bind(2, t.number).bind(3, t.cost).bind(4, t.failed ? 1 : 0);
    insert.bind(5, t.violated);
    insert.bindBlob(6, {reinterpret_cast<const char*>(t.x.data()), t.x.size() * sizeof(double)});
    insert.run();
  }
  Statement resume(*impl_, "INSERT OR REPLACE INTO resume VALUES(0, ?, ?)");
  resume.bind(1, generation).bindBlob(2, state).run();
  putMeta(*impl_, progress);
  impl_->execute("COMMIT", "cannot be written");
  transaction.done();
}

void RunFile::forget(const std::vector<std::string>& recordings,
                     const std::vector<std::string>& meta) {
  Transaction transaction(impl_->db);
  impl_->execute("BEGIN IMMEDIATE", "cannot be written");
  Statement recording(*impl_, "DELETE FROM recording WHERE name = ?");
  for (const std::string& name : recordings) recording.bind(1, name).run();
  Statement value(*impl_, "DELETE FROM meta WHERE key = ?");
  for (const std::string& key : meta) value.bind(1, key).run();
  impl_->execute("COMMIT", "cannot be written");
  transaction.done();
}

bool RunFile::neverBegan(const std::filesystem::path& file) {
  Impl impl;
  impl.file = file;
  impl.lock = FileLock::tryToTake(file);
  if (!impl.lock) return false;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;
  if (!std::filesystem::is_empty(file, error) &&
      !std::filesystem::exists(file.string() + "-journal", error)) {
    return false;
  }
  impl.openDatabase(true);
  Statement pages(impl, "PRAGMA page_count");
  return pages.answer() == "0";
}

std::vector<TrialRow> RunFile::trials() const {
  std::vector<TrialRow> rows;
  Statement s(*impl_,
              "SELECT generation, number, cost, failed, violated, x FROM trial "
              "ORDER BY generation, number");
  while (s.step()) {
    TrialRow row{s.count(0), s.count(1), s.real(2), s.count(3) != 0, s.text(4), {}};
    const std::string x = s.blob(5);
    row.x.resize(x.size() / sizeof(double));
    if (x.size() % sizeof(double) != 0 || (!rows.empty() && row.x.size() != rows[0].x.size())) {
      impl_->refuse(fmt::format("x: {} bytes in trial {} of generation {}, of other parameters",
                                x.size(), row.number, row.generation));
    }
    std::memcpy(row.x.data(), x.data(), x.size());
    rows.push_back(std::move(row));
  }
  return rows;
}

std::optional<std::string> RunFile::state() const {
  Statement s(*impl_, "SELECT state FROM resume");
  if (!s.step()) return std::nullopt;
  return s.blob(0);
}

void RunFile::putRecording(const std::string& name, std::string_view bytes) {
  Statement s(*impl_, "INSERT OR REPLACE INTO recording VALUES(?, ?)");
  s.bind(1, name).bindBlob(2, bytes).run();
}

std::optional<std::string> RunFile::recording(const std::string& name) const {
  Statement s(*impl_, "SELECT bytes FROM recording WHERE name = ?");
  s.bind(1, name);
  if (!s.step()) return std::nullopt;
  return s.blob(0);
}

const std::filesystem::path& RunFile::path() const {
  return impl_->file;
}

}  // namespace traceur
