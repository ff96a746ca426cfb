// A run on disk: one SQLite file that survives being killed at any instant and opens anywhere.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace traceur {

/// One trial as stored: table `trial`, one row each.
struct TrialRow {
  int generation = 0;
  int number = 0;  ///< within its generation
  double cost = 0;
  bool failed = false;    ///< no meaningful cost
  std::string violated;   ///< names of the violated constraints, comma separated
  std::vector<double> x;  ///< the parameters, in the order and units of meta "parameters"
};

/// Schema (application_id 0x54726372, user_version kVersion):
///
///     meta(key TEXT PRIMARY KEY, value TEXT)           options, seed, texts of skill and robot, …
///     trial(generation, number, cost, failed, violated, x)      x: little-endian doubles
///     resume(id = 0, generation, state)                the optimiser's state after `generation`
///     recording(name TEXT PRIMARY KEY, bytes)          sim::Recording::encode()
///
/// A generation's trials, the optimiser's state and the progress in meta change in one transaction.
/// Meta values are UTF-8. All that read or write throw InputError for other text, and for values of
/// types that are not these. While a run is open to be written, FILE-lock beside it keeps other
/// writers out.
class RunFile {
 public:
  static constexpr int kVersion = 1;
  using Meta = std::map<std::string, std::string>;

  /// A new file with its meta rows; folders on the way are made.
  /// @throws InputError when the file exists, empty or not; SystemError when it cannot be written
  static RunFile create(const std::filesystem::path& file, const Meta& meta);
  /// An existing file, to read or to go on with.
  /// @throws InputError: missing, empty, not a run, made by a newer version, damaged, of tables
  /// that are not these, or to be written while another process writes it. Never changes it, but
  /// for a transaction that a killed process left half written, which is taken back; where that is
  /// not allowed, InputError, too.
  static RunFile open(const std::filesystem::path& file, bool to_write);
  /// Whether a file is empty, or is once what was left half written is taken back, which this does:
  /// the process that made it was killed before there was a run in it.
  /// @throws SystemError when it cannot be opened to be written
  static bool neverBegan(const std::filesystem::path& file);
  ~RunFile();
  RunFile(RunFile&&) noexcept;
  RunFile& operator=(RunFile&&) noexcept;

  std::optional<std::string> meta(const std::string& key) const;
  void setMeta(const Meta& meta);

  /// Stores a generation, all or nothing.
  void appendGeneration(int generation, std::span<const TrialRow> trials, std::string_view state,
                        const Meta& progress);
  /// Takes out recordings and meta rows that no longer hold, all or nothing.
  void forget(const std::vector<std::string>& recordings, const std::vector<std::string>& meta);
  std::vector<TrialRow> trials() const;
  /// The optimiser's state after the last stored generation; none before the first.
  std::optional<std::string> state() const;

  void putRecording(const std::string& name, std::string_view bytes);
  std::optional<std::string> recording(const std::string& name) const;
  const std::filesystem::path& path() const;

 private:
  struct Impl;
  explicit RunFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace traceur
