// All that the program says. Names from files, programs and command lines pass through here, and
// nothing in them reaches a terminal that would be obeyed there.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <type_traits>

#include "traceur/core/error.h"
#include "traceur/core/printable.h"

namespace traceur::cli {

/// Standard output cannot take what was found: it is full, or closed.
class OutputError : public SystemError {
 public:
  using SystemError::SystemError;
};

/// Nobody reads standard output any more, as in `traceur show RUN | head -1`. The program ends, and
/// says nothing of it. No std::exception: nobody but main() has anything to do with it.
struct BrokenPipe {};

/// Opens what is closed of the descriptors 0, 1 and 2, so that none of our files becomes one of
/// them, and what should be said gets into it. Of standard output such that writing to it fails.
/// From here on a broken pipe is an error of writing, and no signal. Call it before all else.
void openStandardDescriptors();

/// Ends the program as a broken pipe ends any other.
[[noreturn]] void endByBrokenPipe();

/// A result, to standard output, as it is.
/// @throws OutputError, BrokenPipe
void writeResult(std::string_view text);

/// Sends on what was written until now.
/// @throws OutputError, BrokenPipe
void flushResults();

/// A note or complaint, to standard error, as it is. If that cannot be written it is lost, and the
/// work goes on.
void writeNote(std::string_view text);

/// The last line of a terminal, rewritten each time; a note takes its place. Lost as a note is.
void writeLine(std::string_view text);
/// Ends that line, if there is one, so that it stays.
void endLine();

namespace internal {

template <class T>
inline constexpr bool kIsText = std::is_convertible_v<const T&, std::string_view>;

template <class T>
using Shown = std::conditional_t<kIsText<T>, std::string, const T&>;

template <class T>
Shown<T> shown(const T& value) {
  if constexpr (kIsText<T>) {
    return printable(value);
  } else {
    return value;
  }
}

}  // namespace internal

/// A result. Text that is put into the format is shown printable, in one line; the format's own
/// lines stay.
/// @throws OutputError, BrokenPipe
template <class... Args>
void print(fmt::format_string<internal::Shown<Args>...> format, const Args&... args) {
  writeResult(fmt::format(format, internal::shown(args)...));
}

/// A note, likewise.
template <class... Args>
void note(fmt::format_string<internal::Shown<Args>...> format, const Args&... args) {
  writeNote(fmt::format(format, internal::shown(args)...));
}

/// An error's message, which may have several lines. Those after the first are indented: a name
/// with a line feed in it cannot forge a message of its own.
void complain(std::string_view message);

/// JSON in ASCII and harmless letters, for a terminal and a file alike. What is not UTF-8 is shown
/// as U+FFFD.
std::string jsonText(const nlohmann::json& json, int indent = 2);
std::string jsonText(const nlohmann::ordered_json& json, int indent = 2);

/// A result as one JSON object.
/// @throws OutputError, BrokenPipe
template <class Json>
void printJson(const Json& json) {
  writeResult(jsonText(json) + "\n");
}

}  // namespace traceur::cli
