// Small text helpers for messages people read.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace traceur {

/// " Did you mean X?" for the candidate nearest to word (Damerau-Levenshtein distance at most a
/// third of its length, at least 1; or beginning with word), or "" when none is near.
std::string didYouMean(std::string_view word, std::span<const std::string> candidates);

/// What stands between separators; none for an empty text.
std::vector<std::string> split(std::string_view text, char separator);

/// The number that the whole text is, also "nan", "inf", and what is too large or too small for a
/// double; nothing for any other text.
std::optional<double> parseNumber(const std::string& text);

/// @param where  begins the message: "--var x=0:one"
/// @throws InputError unless the whole text is one number, which may be infinite but not NaN
double toNumber(const std::string& text, const std::string& where);

/// "a, b, c".
std::string join(std::span<const std::string> words, std::string_view separator = ", ");

}  // namespace traceur
