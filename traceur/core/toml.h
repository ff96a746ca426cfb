// Reading TOML that people write: every mistake is collected with its line and column, unknown keys
// are refused with a suggestion, and nothing is used until all of it is right.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "traceur/core/error.h"

namespace traceur {

/// One value of a document and where it stands.
struct TomlValue {
  using Array = std::vector<TomlValue>;
  using Table = std::map<std::string, TomlValue, std::less<>>;
  std::variant<bool, double, std::string, Array, Table> value;
  int line = 0;
  int column = 0;

  bool isNumber() const { return std::holds_alternative<double>(value); }
  bool isString() const { return std::holds_alternative<std::string>(value); }
  bool isArray() const { return std::holds_alternative<Array>(value); }
  bool isTable() const { return std::holds_alternative<Table>(value); }
  double number() const { return std::get<double>(value); }
  const std::string& string() const { return std::get<std::string>(value); }
  const Array& array() const { return std::get<Array>(value); }
  const Table& table() const { return std::get<Table>(value); }
  /// "a number", "text", "a list", …: for messages.
  std::string_view kind() const;
};

/// One table of a document while it is being read. Each accessor notes its key as known; a wrong or
/// missing value is added to the diagnostics and a neutral value returned, so that reading goes on.
/// finish() reports the keys that no accessor asked for.
class TomlReader {
 public:
  TomlReader(const TomlValue& table, Diagnostics& diagnostics);

  bool has(std::string_view key) const;
  /// A finite number.
  double number(std::string_view key) const;
  double number(std::string_view key, double otherwise) const;
  /// A number that may be inf, for limits: none.
  double numberOrInfinity(std::string_view key) const;
  std::string string(std::string_view key) const;
  std::string string(std::string_view key, std::string_view otherwise) const;
  bool boolean(std::string_view key, bool otherwise) const;
  /// A list of exactly size finite numbers.
  std::vector<double> numbers(std::string_view key, int size) const;
  std::vector<std::string> strings(std::string_view key) const;
  /// The table under key; an empty one if it is missing.
  TomlReader table(std::string_view key) const;
  /// The tables of `[[key]]`; none if it is missing.
  std::vector<TomlReader> tables(std::string_view key) const;
  /// All keys in the order of the text, marked as known: for tables whose keys are names.
  std::vector<std::string> names() const;
  /// The value under key or null.
  const TomlValue* find(std::string_view key) const;
  const TomlValue& value() const { return *table_; }

  /// Adds a mistake at key's place (or at the table's when it has no such key).
  void fail(std::string_view key, std::string_view message) const;
  void finish() const;
  Diagnostics& diagnostics() const { return *diagnostics_; }

 private:
  const TomlValue* table_;
  Diagnostics* diagnostics_;
  std::shared_ptr<std::set<std::string, std::less<>>> known_;
};

/// Parses a document of at most 1 MiB, 32 values in values and 16 dots in a key.
/// @throws InputError with file, line and column where the text is not such TOML
TomlValue parseToml(std::string_view text, const std::string& file);

/// A number of a document, by the keys that lead to it.
struct TomlNumber {
  std::vector<std::string> path;
  double value = 0;
};

/// The same document with other numbers: everything else, comments too, stays as it was written.
/// @throws InputError as parseToml, and for a path that leads to no number
std::string withNumbers(std::string_view text, const std::string& file,
                        std::span<const TomlNumber> numbers);

/// A whole text file of at most 64 MiB, or what comes through a pipe within 5 s.
/// @throws InputError naming the file when it is missing, unreadable, a folder, a device or larger
std::string readFile(const std::filesystem::path& file);

}  // namespace traceur
