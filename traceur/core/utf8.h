// UTF-8 that may be wrong: what of it is right.
#pragma once

#include <cstddef>
#include <string_view>

namespace traceur {

/// How many bytes the first character of a text has, 1 to 4; 0 where it is none of Unicode's:
/// truncated, overlong, a surrogate, above U+10FFFF, or where the text is empty.
size_t utf8Length(std::string_view text);

/// Whether all of a text is UTF-8.
bool isUtf8(std::string_view text);

}  // namespace traceur
