// UTF-8 that may be wrong: what of it is right.
#pragma once

#include <cstddef>
#include <string_view>

namespace traceur {

/// A character of Unicode, or a byte that is none.
struct Character {
  char32_t code = 0;  ///< of one that is none: the byte
  size_t bytes = 1;   ///< 1 to 4
  bool valid = false;
};

/// The first character of a text: UTF-8 in its shortest form, no surrogate, up to U+10FFFF.
/// @param text  not empty
Character firstCharacter(std::string_view text);

/// Whether all of a text is UTF-8.
bool isUtf8(std::string_view text);

}  // namespace traceur
