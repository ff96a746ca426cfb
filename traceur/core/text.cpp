#include "traceur/core/text.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "traceur/core/error.h"

namespace traceur {
namespace {

/// Edits (insert, delete, replace, swap of neighbours) that turn a into b, ignoring case.
int editDistance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    for (size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (same ? 0 : 1)});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
          lower(a[i - 2]) == lower(b[j - 1])) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string didYouMean(std::string_view word, std::span<const std::string> candidates) {
  static constexpr size_t kLongest = 100;  // nobody mistypes more [ours]
  if (word.size() > kLongest) return "";
  const std::string* nearest = nullptr;
  int least = std::max(1, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& c : candidates) {
    if (c.size() > kLongest) continue;
    // The beginning of a name counts as nearly the name.
    const bool begins = word.size() >= 3 && c.starts_with(word);
    const int d = begins ? 1 : editDistance(word, c);
    if (d < least) {
      least = d;
      nearest = &c;
    }
  }
  return nearest ? " Did you mean \"" + *nearest + "\"?" : "";
}

std::optional<double> parseNumber(const std::string& text) {
  if (text.empty() || std::isspace(static_cast<unsigned char>(text.front())) != 0) return {};
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);  // ±∞ or 0 out of range, as wanted
  if (end != text.c_str() + text.size()) return {};
  return value;
}

double toNumber(const std::string& text, const std::string& where) {
  const std::optional<double> value = parseNumber(text);
  if (!value || std::isnan(*value)) {
    throw InputError(where + ": \"" + text + "\" is not a number");
  }
  return *value;
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const size_t end = std::min(text.find(separator), text.size());
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

std::string join(std::span<const std::string> words, std::string_view separator) {
  std::string text;
  for (const std::string& w : words) {
    if (!text.empty()) text += separator;
    text += w;
  }
  return text;
}

}  // namespace traceur
