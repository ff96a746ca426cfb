// How far a long verb is: a bar on a terminal, plain lines elsewhere, nothing when quiet.
#pragma once

#include <chrono>
#include <string>

namespace traceur::cli {

class ProgressLine {
 public:
  /// @param total  work in all, in whatever `done` counts
  /// @param done   work that was there already when the clock starts
  ProgressLine(std::string title, double total, double done, bool quiet);
  ~ProgressLine();

  /// @param unit_rate  what done counts, for "12 trials/s"
  void update(double done, const std::string& note, const char* unit_rate);
  /// Ends the line, so that other text can follow.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string title_;
  double total_;
  double first_;
  bool quiet_;
  bool terminal_;
  bool open_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_{};
};

/// "1:04" or "12 s".
std::string duration(double seconds);

}  // namespace traceur::cli
