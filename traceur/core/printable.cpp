#include "traceur/core/printable.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "traceur/core/utf8.h"

namespace traceur {
namespace {

bool isObeyed(char32_t c) {
  return c < 0x20 || (c >= 0x7F && c <= 0x9F) || (c >= 0x2028 && c <= 0x202E) ||
         (c >= 0x2066 && c <= 0x2069);
}

/// Of a letter or digit, as far as one can tell without tables of Unicode: spaces and what has no
/// ink are not.
bool isNamed(char32_t c) {
  if (c < 0x80) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  }
  const bool blank = c <= 0xA0 || c == 0xAD || c == 0x1680 || (c >= 0x2000 && c <= 0x206F) ||
                     c == 0x3000 || c == 0xFEFF || (c >= 0xFFF0 && c <= 0xFFFF) || c >= 0xE0000;
  return !blank;
}

bool isWide(char32_t c) {
  return (c >= 0x1100 && c <= 0x115F) || (c >= 0x2E80 && c <= 0xA4CF) ||
         (c >= 0xAC00 && c <= 0xD7A3) || (c >= 0xF900 && c <= 0xFAFF) ||
         (c >= 0xFE30 && c <= 0xFE6F) || (c >= 0xFF00 && c <= 0xFF60) ||
         (c >= 0xFFE0 && c <= 0xFFE6) || (c >= 0x1F300 && c <= 0x1FAFF) ||
         (c >= 0x20000 && c <= 0x3FFFD);
}

void append(std::string& shown, const Character& c, std::string_view bytes) {
  if (c.valid && !isObeyed(c.code)) {
    shown += bytes;
  } else if (c.code == '\n' || c.code == '\r' || c.code == '\t') {
    shown += c.code == '\n' ? "\\n" : c.code == '\r' ? "\\r" : "\\t";
  } else if (c.code < 0x80 || !c.valid) {
    fmt::format_to(std::back_inserter(shown), "\\x{:02x}", static_cast<unsigned>(c.code));
  } else {
    fmt::format_to(std::back_inserter(shown), "\\u{:04x}", static_cast<unsigned>(c.code));
  }
}

}  // namespace

std::string printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const Character c = firstCharacter(text);
    append(shown, c, text.substr(0, c.bytes));
    text.remove_prefix(c.bytes);
  }
  return shown;
}

std::string printableLines(std::string_view text) {
  std::string shown;
  while (true) {
    const size_t end = std::min(text.find('\n'), text.size());
    shown += printable(text.substr(0, end));
    if (end == text.size()) return shown;
    shown += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string fileNamePart(std::string_view name) {
  static constexpr size_t kMostBytes = 100;  // two such and our own words are a name of 255 [ours]
  std::string part;
  bool replaced = false;
  while (!name.empty()) {
    const Character c = firstCharacter(name);
    const bool stays = c.valid && isNamed(c.code) && !(part.empty() && c.code == '.');
    const std::string_view bytes = stays ? name.substr(0, c.bytes) : "-";
    if (stays || !replaced) {
      if (part.size() + bytes.size() > kMostBytes) break;
      part += bytes;
    }
    replaced = !stays;
    name.remove_prefix(c.bytes);
  }
  return part.empty() ? "unnamed" : part;
}

int columnsOf(std::string_view text) {
  int columns = 0;
  while (!text.empty()) {
    const Character c = firstCharacter(text);
    columns += c.valid && isWide(c.code) ? 2 : 1;
    text.remove_prefix(c.bytes);
  }
  return columns;
}

std::string cutToColumns(std::string_view text, int columns) {
  if (columnsOf(text) <= columns) return std::string(text);
  if (columns <= 0) return "";
  size_t end = 0;
  int left = columns - 1;  // one is the dots'
  while (true) {
    const Character c = firstCharacter(text.substr(end));
    left -= c.valid && isWide(c.code) ? 2 : 1;
    if (left < 0) return std::string(text.substr(0, end)) + "…";
    end += c.bytes;
  }
}

}  // namespace traceur
