// Words in the tables that the program writes.
#pragma once

#include <string>
#include <string_view>

namespace traceur::cli {

/// As a field of a CSV, printable and in one line: people name phases as they like.
std::string csvField(std::string_view text);

}  // namespace traceur::cli
