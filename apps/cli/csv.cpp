#include "apps/cli/csv.h"

#include "traceur/core/printable.h"

namespace traceur::cli {

std::string csvField(std::string_view text) {
  std::string shown = printable(text);
  if (shown.find_first_of(",\"") == std::string::npos) return shown;
  std::string quoted = "\"";
  for (const char c : shown) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

}  // namespace traceur::cli
