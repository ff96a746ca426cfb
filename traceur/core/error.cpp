#include "traceur/core/error.h"

#include <fmt/format.h>

#include <algorithm>

namespace traceur {

namespace {

/// Who makes more has not written the text; reading on would take longer than it helps [ours].
constexpr size_t kMostMistakes = 100;

}  // namespace

void Diagnostics::add(int line, int column, std::string_view message) {
  for (const Entry& e : entries_) {
    if (e.line == line && e.column == column && e.message == message) return;
  }
  entries_.push_back({line, column, std::string(message)});
  if (entries_.size() < kMostMistakes) return;
  try {
    throwIfAny();
  } catch (const InputError& e) {
    throw InputError(fmt::format("{}\n{}: {} mistakes: the rest was not looked at", e.what(), file_,
                                 kMostMistakes));
  }
}

void Diagnostics::throwIfAny() const {
  if (entries_.empty()) return;
  auto sorted = entries_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Entry& a, const Entry& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  std::string text;
  for (const Entry& e : sorted) {
    if (!text.empty()) text += '\n';
    if (e.line == 0) {
      text += fmt::format("{}: {}", file_, e.message);
    } else {
      text += fmt::format("{}:{}:{}: {}", file_, e.line, e.column, e.message);
    }
  }
  throw InputError(text);
}

}  // namespace traceur
