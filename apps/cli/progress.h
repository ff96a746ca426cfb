// How far a long verb is: a bar on a terminal, plain lines elsewhere, nothing when quiet.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "traceur/optim/minimise.h"

namespace traceur::cli {

class ProgressLine {
 public:
  /// @param total  work in all, in whatever `done` counts
  /// @param done   work that was there already when the clock starts
  ProgressLine(const std::string& title, double total, double done, bool quiet);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// @param unit_rate  what done counts, for "12 trials/s"
  void update(double done, const std::string& note, const char* unit_rate);
  /// Ends the line, so that other text can follow.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string title_;  // printable
  double total_;
  double first_;
  bool quiet_;
  bool terminal_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_{};
};

/// A search as it goes: how it stands at its beginning, and after each generation.
class SearchLine {
 public:
  /// @param budget    trials in all
  /// @param families  whether a curve is sought
  SearchLine(std::string title, int budget, bool families, bool quiet);
  void show(const optim::Progress& progress, const std::optional<optim::Family>& family);
  /// What is printed from now on stands under it.
  void end() { line_.reset(); }

 private:
  std::string title_;
  int budget_;
  bool families_, quiet_;
  std::optional<ProgressLine> line_;
};

/// "title [====    ] text" in fewer columns than a terminal has: in the last one, some begin a new
/// line. Where room is short the bar shrinks and goes, then the title is cut, then the text.
/// @param title, text  printable
/// @param part         how much is done, 0 to 1
/// @param columns      of the terminal
std::string progressText(const std::string& title, double part, const std::string& text,
                         int columns);

/// "1:04" or "12 s".
std::string duration(double seconds);

}  // namespace traceur::cli
