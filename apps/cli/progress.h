// How far a long verb is: a bar on a terminal, plain lines elsewhere, nothing when quiet.
#pragma once

#include <chrono>
#include <string>

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
