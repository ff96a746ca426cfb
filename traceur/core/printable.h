// Names and words from files, programs and command lines, made harmless where they leave us: a
// terminal obeys what is in them, a line can be forged, a file's name is a path.
#pragma once

#include <string>
#include <string_view>

namespace traceur {

/// The text with nothing in it that a terminal would obey or that would hide or reorder what stands
/// beside it. Control characters, bidirectional overrides (U+202A–E, U+2066–9) and the separators
/// of lines (U+2028–9) become "\n", "\r", "\t", "\x1b" or "\u202e"; bytes that are not UTF-8 become
/// "\xff". All else, a backslash too, stays as it is.
std::string printable(std::string_view text);

/// The same of a text that has lines: its line feeds stay.
std::string printableLines(std::string_view text);

/// The name as a part of a file's name that is never a path, an option or hidden: letters and
/// digits of any script, '-', '_' and '.' stay, each run of other characters becomes one '-', and
/// so does a first '.'. At most 100 bytes; "unnamed" for nothing.
std::string fileNamePart(std::string_view name);

/// Columns of a terminal that printable text takes, at most: wide letters (Chinese, emoji) take
/// two.
int columnsOf(std::string_view text);

/// As much of printable text as fits, ending in "…" if that is not all.
std::string cutToColumns(std::string_view text, int columns);

}  // namespace traceur
