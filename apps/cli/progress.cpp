#include "apps/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace traceur::cli {

namespace {

constexpr int kBarWidth = 24;
constexpr double kEveryOnTerminal = 0.1;  // [s]
constexpr double kEveryElsewhere = 5;     // [s]: a log stays readable

}  // namespace

ProgressLine::ProgressLine(std::string title, double total, double done, bool quiet)
    : title_(std::move(title)),
      total_(total),
      first_(done),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressLine::~ProgressLine() {
  finish();
}

void ProgressLine::update(double done, const std::string& note, const char* unit_rate) {
  if (quiet_) return;
  const auto now = Clock::now();
  const double every = terminal_ ? kEveryOnTerminal : kEveryElsewhere;
  if (last_ != Clock::time_point{} && done < total_ &&
      std::chrono::duration<double>(now - last_).count() < every) {
    return;
  }
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double rate = elapsed > 0 ? (done - first_) / elapsed : 0;
  std::string text = fmt::format("{:.0f}/{:.0f}  {}", done, total_, note);
  if (rate > 0) {
    text += fmt::format("  {:.{}f} {}  {} left", rate, rate < 1 ? 4 : 1, unit_rate,
                        duration(std::max(0.0, total_ - done) / rate));
  }
  if (terminal_) {
    const double part = std::clamp(done / total_, 0.0, 1.0);
    const int full = static_cast<int>(std::lround(part * kBarWidth));
    fmt::print(stderr, "\r\033[K{} [{}{}] {}", title_, std::string(full, '='),
               std::string(kBarWidth - full, ' '), text);
    open_ = true;
  } else {
    fmt::print(stderr, "{} {}\n", title_, text);
  }
  std::fflush(stderr);
}

void ProgressLine::finish() {
  if (open_) fmt::print(stderr, "\n");
  open_ = false;
}

std::string duration(double seconds) {
  const int s = static_cast<int>(std::lround(seconds));
  return s < 60 ? fmt::format("{} s", s) : fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace traceur::cli
