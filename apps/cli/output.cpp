#include "apps/cli/output.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

namespace traceur::cli {
namespace {

// Whether a broken pipe was to be survived before we came: `trap '' PIPE`, as under some servers.
bool pipes_were_ignored = false;

std::mutex notes_mutex;
bool line_is_open = false;  // the terminal's last line is a progress line

/// The start of a terminal's line, cleared.
constexpr std::string_view kClear = "\r\033[K";

void writeToStderr(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
  std::clearerr(stderr);
}

[[noreturn]] void failToWrite(int error) {
  std::clearerr(stdout);
  if (error == EPIPE && !pipes_were_ignored) throw BrokenPipe();
  throw OutputError("cannot write to standard output: " + std::generic_category().message(error));
}

/// JSON that a terminal shows: outside of its texts it is ASCII, and in them "\u009b" is JSON, too.
std::string escaped(std::string_view json) {
  std::string text;
  for (const char c : json) {
    if (c == '\x7f') {
      text += "\\u007f";  // which printable() would spell as JSON does not
    } else {
      text += c;
    }
  }
  return printableLines(text);
}

template <class Json>
std::string dumped(const Json& json, int indent) {
  return escaped(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

void openStandardDescriptors() {
  for (const int wanted : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(wanted, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free one is `wanted`: those below are open. Read-only, standard output cannot be
    // written to, as if it were closed.
    open("/dev/null", wanted == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
  pipes_were_ignored = std::signal(SIGPIPE, SIG_IGN) == SIG_IGN;
}

void endByBrokenPipe() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  _exit(128 + SIGPIPE);
}

void writeResult(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) failToWrite(errno);
}

void flushResults() {
  if (std::fflush(stdout) != 0) failToWrite(errno);
}

void writeNote(std::string_view text) {
  const std::scoped_lock lock(notes_mutex);
  if (std::exchange(line_is_open, false)) writeToStderr(kClear);
  writeToStderr(text);
}

void writeLine(std::string_view text) {
  const std::scoped_lock lock(notes_mutex);
  writeToStderr(std::string(kClear) + std::string(text));
  line_is_open = true;
}

void endLine() {
  const std::scoped_lock lock(notes_mutex);
  if (std::exchange(line_is_open, false)) writeToStderr("\n");
}

void complain(std::string_view message) {
  std::string text = "traceur: ";
  const std::string lines = printableLines(message);
  for (size_t i = 0; i < lines.size(); ++i) {
    text += lines[i];
    if (lines[i] == '\n' && i + 1 < lines.size() && lines[i + 1] != ' ') text += "  ";
  }
  writeNote(text + "\n");
}

std::string jsonText(const nlohmann::json& json, int indent) {
  return dumped(json, indent);
}

std::string jsonText(const nlohmann::ordered_json& json, int indent) {
  return dumped(json, indent);
}

}  // namespace traceur::cli
