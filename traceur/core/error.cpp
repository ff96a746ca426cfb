#include "traceur/core/error.h"

#include <fmt/format.h>

#include <algorithm>

namespace traceur {

namespace {

/// Who makes more has not written the text; reading on would take longer than it helps [ours].
constexpr size_t kMostMistakes = 100;

}  // namespace

void Diagnostics::goesOn(std::string file, int after_line) {
  files_.push_back({std::move(file), after_line});
}

const Diagnostics::File& Diagnostics::placeOf(int line) const {
  size_t i = files_.size() - 1;
  while (i > 0 && line <= files_[i].after_line) --i;
  return files_[i];
}

void Diagnostics::add(int line, int column, std::string_view message) {
  for (const Mistake& m : mistakes_) {
    if (m.line == line && m.column == column && m.text == message) return;
  }
  mistakes_.push_back({{}, line, column, std::string(message)});
  if (mistakes_.size() == kMostMistakes) throwIfAny();
}

void Diagnostics::throwIfAny() const {
  if (mistakes_.empty()) return;
  std::vector<Mistake> sorted = mistakes_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Mistake& a, const Mistake& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  std::string text;
  for (Mistake& m : sorted) {
    const File& place = placeOf(m.line);
    m.file = place.file;
    m.line -= m.line > 0 ? place.after_line : 0;
    if (!text.empty()) text += '\n';
    if (m.line == 0) {
      text += fmt::format("{}: {}", m.file, m.text);
    } else {
      text += fmt::format("{}:{}:{}: {}", m.file, m.line, m.column, m.text);
    }
  }
  if (sorted.size() == kMostMistakes) {
    text +=
        fmt::format("\n{}: {} mistakes: the rest was not looked at", files_[0].file, kMostMistakes);
  }
  throw InputError(text, std::move(sorted));
}

}  // namespace traceur
