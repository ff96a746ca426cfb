#include "apps/cli/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "apps/cli/output.h"
#include "traceur/core/printable.h"
#include "traceur/core/text.h"

namespace traceur::cli {

namespace {

constexpr int kBarWidth = 24;
constexpr int kLeastBar = 6;              // columns: a shorter one shows nothing [ours]
constexpr int kShortTitle = 12;           // columns: of a longer one so much stays [ours]
constexpr double kEveryOnTerminal = 0.1;  // [s]
constexpr double kEveryElsewhere = 5;     // [s]: a log stays readable

std::string inWords(const optim::Progress& p) {
  if (!p.best) return "";
  std::string text = fmt::format("best {:.3g}", p.best->evaluation.cost);
  if (!p.best->evaluation.feasible()) text += " (failing)";
  if (p.failed > 0) text += fmt::format("  {} without a cost", p.failed);
  return text;
}

/// What each task costs on the best curve, while there is room; else their mean and the worst.
std::string inWords(const optim::Family& family) {
  static constexpr size_t kRoom = 8;
  std::string text = fmt::format("mean {:.2g}, tasks", family.cost);
  if (family.task_costs.size() > kRoom) {
    return fmt::format("mean {:.2g}, worst task {:.2g}", family.cost,
                       *std::max_element(family.task_costs.begin(), family.task_costs.end()));
  }
  for (const double cost : family.task_costs) text += fmt::format(" {:.1g}", cost);
  return text;
}

/// Of the terminal, now: a person may resize it.
int terminalColumns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  static constexpr double kMost = 10'000;
  const char* columns = std::getenv("COLUMNS");
  const std::optional<double> told = columns ? parseNumber(columns) : std::nullopt;
  return told && *told >= 1 && *told <= kMost ? static_cast<int>(*told) : 80;
}

}  // namespace

ProgressLine::ProgressLine(const std::string& title, double total, double done, bool quiet)
    : title_(printable(title)),
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
  std::string text = fmt::format("{:.0f}/{:.0f}  {}", done, total_, printable(note));
  if (rate > 0) {
    text += fmt::format("  {:.{}f} {}  {} left", rate, rate < 1 ? 4 : 1, unit_rate,
                        duration(std::max(0.0, total_ - done) / rate));
  }
  if (terminal_) {
    writeLine(progressText(title_, done / total_, text, terminalColumns()));
  } else {
    writeNote(title_ + " " + text + "\n");
  }
}

void ProgressLine::finish() {
  if (!quiet_ && terminal_) endLine();
}

SearchLine::SearchLine(std::string title, int budget, bool families, bool quiet)
    : title_(std::move(title)), budget_(budget), families_(families), quiet_(quiet) {}

void SearchLine::show(const optim::Progress& p, const std::optional<optim::Family>& family) {
  if (!line_) {
    line_.emplace(title_, budget_, p.evaluations, quiet_);
    return;
  }
  line_->update(p.evaluations,
                family      ? inWords(*family)
                : families_ ? "no curve has been run yet"
                            : inWords(p),
                "trials/s");
}

std::string progressText(const std::string& title, double part, const std::string& text,
                         int columns) {
  const int room = std::max(0, columns - 1);
  const int least = columnsOf(title) + 1 + columnsOf(text);
  const int bar = std::min(kBarWidth, room - least - 3);  // [, ] and a space
  if (bar >= kLeastBar) {
    const int full = static_cast<int>(std::lround(std::clamp(part, 0.0, 1.0) * bar));
    return fmt::format("{} [{}{}] {}", title, std::string(full, '='), std::string(bar - full, ' '),
                       text);
  }
  const int for_title = std::max(kShortTitle, room - 1 - columnsOf(text));
  return cutToColumns(cutToColumns(title, for_title) + " " + text, room);
}

std::string duration(double seconds) {
  const int s = static_cast<int>(std::lround(seconds));
  return s < 60 ? fmt::format("{} s", s) : fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace traceur::cli
