#include "traceur/core/utf8.h"

#include <array>

namespace traceur {

Character firstCharacter(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  static constexpr std::array<char32_t, 3> kLeast = {0x80, 0x800, 0x10000};  // of 2, 3, 4 bytes
  if (lead < 0xC0 || lead >= 0xF8 || text.size() < bytes) return {lead, 1, false};
  char32_t code = lead & (0x7FU >> bytes);
  for (size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return {lead, 1, false};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[bytes - 2] || surrogate || code > 0x10FFFF) return {lead, 1, false};
  return {code, bytes, true};
}

bool isUtf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = firstCharacter(text);
    if (!c.valid) return false;
    text.remove_prefix(c.bytes);
  }
  return true;
}

}  // namespace traceur
