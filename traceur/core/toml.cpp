#include "traceur/core/toml.h"

#include <fmt/format.h>

// Values in values: deeper than anyone writes, shallower than what recursion bears [ours].
#define TOML_MAX_NESTED_VALUES 32
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <toml++/toml.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>

#include "traceur/core/infinity.h"
#include "traceur/core/text.h"

namespace traceur {
namespace {

TomlValue convert(const toml::node& node) {
  TomlValue v;
  v.line = static_cast<int>(node.source().begin.line);
  v.column = static_cast<int>(node.source().begin.column);
  if (const auto* table = node.as_table()) {
    TomlValue::Table out;
    for (const auto& [key, child] : *table) out.emplace(std::string(key.str()), convert(child));
    v.value = std::move(out);
  } else if (const auto* array = node.as_array()) {
    TomlValue::Array out;
    for (const auto& child : *array) out.push_back(convert(child));
    v.value = std::move(out);
  } else if (const auto* text = node.as_string()) {
    v.value = text->get();
  } else if (const auto* flag = node.as_boolean()) {
    v.value = flag->get();
  } else if (const auto number = node.value<double>()) {
    v.value = *number;
  } else {
    v.value = std::string("a date");
  }
  return v;
}

const TomlValue kEmptyTable{TomlValue::Table{}, 0, 0};

/// More than any person writes; what is longer is refused before it is read [ours].
constexpr size_t kMostToml = 1 << 20;  // [bytes]
constexpr int kMostDots = 16;          // in one key
constexpr off_t kMostText = 64 << 20;  // of any file [bytes]
constexpr double kPatience = 5;        // with a pipe that says nothing [s]

/// The last character of the text that begins with the quote at i; where it does not end, the last
/// of its line, or of all if it may have several.
size_t endOfText(std::string_view text, size_t i) {
  const char quote = text[i];
  const std::string thrice(3, quote);
  const bool many = text.substr(i, 3) == thrice;
  const std::string_view end = std::string_view(thrice).substr(0, many ? 3 : 1);
  for (i += end.size(); i < text.size(); ++i) {
    if (text.substr(i, end.size()) == end) return i + end.size() - 1;
    if (text[i] == '\n' && !many) return i - 1;
    if (text[i] == '\\' && quote == '"') ++i;
  }
  return text.size() - 1;
}

/// The line of the first key with more than kMostDots dots; 0 if there is none. Each dot is a table
/// in a table, and toml++ follows them by recursion. Between two of , = [ ] { } and line ends, and
/// outside text and comments, only a key has more than one dot.
int lineOfTooDeepKey(std::string_view text) {
  int line = 1;
  int dots = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      const size_t end = endOfText(text, i);
      line += static_cast<int>(std::count(text.begin() + i, text.begin() + end, '\n'));
      i = end;
    } else if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (c == '.' && ++dots > kMostDots) {
      return line;
    } else if (std::string_view(",=[]{}\n").find(c) != std::string_view::npos) {
      dots = 0;
      line += c == '\n';
    }
  }
  return 0;
}

/// A file that is closed again.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return fd_; }  // NOLINT(google-explicit-constructor): as system calls want

 private:
  int fd_;
};

/// What stands there instead of a finite number.
std::string got(const TomlValue& v) {
  return v.isNumber() ? fmt::format("{}", v.number()) : std::string(v.kind());
}

/// Where a line and a column, both from 1, stand in the text; columns count letters, not bytes.
size_t placeOf(std::string_view text, int line, int column) {
  size_t at = 0;
  for (; line > 1; --line) at = text.find('\n', at) + 1;
  for (; column > 1; --column) {
    do ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80);
  }
  return at;
}

}  // namespace

std::string_view TomlValue::kind() const {
  static constexpr std::string_view kKinds[] = {"true or false", "a number", "text", "a list",
                                                "a table"};
  return kKinds[value.index()];
}

TomlReader::TomlReader(const TomlValue& table, Diagnostics& diagnostics)
    : table_(&table),
      diagnostics_(&diagnostics),
      known_(std::make_shared<std::set<std::string, std::less<>>>()) {}

const TomlValue* TomlReader::find(std::string_view key) const {
  known_->emplace(key);
  const auto it = table_->table().find(key);
  return it == table_->table().end() ? nullptr : &it->second;
}

bool TomlReader::has(std::string_view key) const {
  return find(key) != nullptr;
}

void TomlReader::fail(std::string_view key, std::string_view message) const {
  const TomlValue* v = find(key);
  const TomlValue& place = v ? *v : *table_;
  diagnostics_->add(place.line, place.column, message);
}

double TomlReader::number(std::string_view key) const {
  if (!has(key)) {
    fail(key, fmt::format("\"{}\" is missing: expected a number", key));
    return 0;
  }
  return number(key, 0);
}

double TomlReader::number(std::string_view key, double otherwise) const {
  const TomlValue* v = find(key);
  if (!v) return otherwise;
  if (v->isNumber() && std::isfinite(v->number())) return v->number();
  fail(key, fmt::format("\"{}\": expected a finite number, got {}", key, got(*v)));
  return otherwise;
}

double TomlReader::numberOrInfinity(std::string_view key) const {
  const TomlValue* v = find(key);
  return v && v->isNumber() && v->number() == kInfinity ? kInfinity : number(key);
}

std::string TomlReader::string(std::string_view key) const {
  if (!has(key)) {
    fail(key, fmt::format("\"{}\" is missing: expected text", key));
    return {};
  }
  return string(key, {});
}

std::string TomlReader::string(std::string_view key, std::string_view otherwise) const {
  const TomlValue* v = find(key);
  if (!v) return std::string(otherwise);
  if (v->isString()) return v->string();
  fail(key, fmt::format("\"{}\": expected text, got {}", key, v->kind()));
  return std::string(otherwise);
}

bool TomlReader::boolean(std::string_view key, bool otherwise) const {
  const TomlValue* v = find(key);
  if (!v) return otherwise;
  if (const bool* flag = std::get_if<bool>(&v->value)) return *flag;
  fail(key, fmt::format("\"{}\": expected true or false, got {}", key, v->kind()));
  return otherwise;
}

std::vector<double> TomlReader::numbers(std::string_view key, int size) const {
  std::vector<double> out(size, 0.0);
  const TomlValue* v = find(key);
  bool good = v && v->isArray() && static_cast<int>(v->array().size()) == size;
  for (int i = 0; good && i < size; ++i) {
    const TomlValue& item = v->array()[i];
    good = item.isNumber() && std::isfinite(item.number());
    if (good) out[i] = item.number();
  }
  if (!good) {
    fail(key, fmt::format("\"{}\"{}: expected a list of {} finite numbers{}", key,
                          v ? "" : " is missing", size,
                          v && !v->isArray() ? fmt::format(", got {}", v->kind()) : ""));
  }
  return out;
}

std::vector<std::string> TomlReader::strings(std::string_view key) const {
  std::vector<std::string> out;
  const TomlValue* v = find(key);
  bool good = v && v->isArray();
  if (good) {
    for (const TomlValue& item : v->array()) {
      good = good && item.isString();
      if (good) out.push_back(item.string());
    }
  }
  if (!good) {
    fail(key, fmt::format("\"{}\"{}: expected a list of names", key, v ? "" : " is missing"));
  }
  return out;
}

TomlReader TomlReader::table(std::string_view key) const {
  const TomlValue* v = find(key);
  if (v && !v->isTable()) {
    fail(key, fmt::format("\"{}\": expected a table, got {}", key, v->kind()));
    v = nullptr;
  }
  return {v ? *v : kEmptyTable, *diagnostics_};
}

std::vector<TomlReader> TomlReader::tables(std::string_view key) const {
  std::vector<TomlReader> out;
  const TomlValue* v = find(key);
  if (!v) return out;
  if (!v->isArray()) {
    fail(key, fmt::format("\"{0}\": expected [[{0}]] tables, got {1}", key, v->kind()));
    return out;
  }
  for (const TomlValue& item : v->array()) {
    if (item.isTable()) {
      out.emplace_back(item, *diagnostics_);
    } else {
      diagnostics_->add(item.line, item.column,
                        fmt::format("\"{}\": expected a table, got {}", key, item.kind()));
    }
  }
  return out;
}

std::vector<std::string> TomlReader::names() const {
  std::vector<std::string> out;
  for (const auto& [key, unused] : table_->table()) {
    known_->insert(key);
    out.push_back(key);
  }
  const auto place = [&](const std::string& key) {
    const TomlValue& v = table_->table().at(key);
    return std::pair(v.line, v.column);
  };
  std::stable_sort(out.begin(), out.end(),
                   [&](const std::string& a, const std::string& b) { return place(a) < place(b); });
  return out;
}

void TomlReader::finish() const {
  const std::vector<std::string> known(known_->begin(), known_->end());
  for (const auto& [key, v] : table_->table()) {
    if (known_->contains(key)) continue;
    diagnostics_->add(v.line, v.column,
                      fmt::format("\"{}\": no such key here.{} Known: {}", key,
                                  didYouMean(key, known), join(known)));
  }
}

TomlValue parseToml(std::string_view text, const std::string& file) {
  Diagnostics d(file);
  if (text.size() > kMostToml) {
    d.add(0, 0, fmt::format("{} bytes: expected at most {}", text.size(), kMostToml));
  } else if (const int line = lineOfTooDeepKey(text); line > 0) {
    d.add(line, 1, fmt::format("a key of more than {} dots: expected fewer", kMostDots));
  }
  d.throwIfAny();
  try {
    return convert(toml::parse(text, file));
  } catch (const toml::parse_error& e) {
    d.add(static_cast<int>(e.source().begin.line), static_cast<int>(e.source().begin.column),
          fmt::format("not TOML: {}", e.description()));
    d.throwIfAny();
  }
  return {};
}

std::string withNumbers(std::string_view text, const std::string& file,
                        std::span<const TomlNumber> numbers) {
  const TomlValue document = parseToml(text, file);
  std::map<size_t, std::pair<size_t, std::string>> written;  // where, how long, anew
  for (const TomlNumber& n : numbers) {
    const TomlValue* at = &document;
    for (const std::string& key : n.path) {
      const bool in_table = at && at->isTable() && at->table().contains(key);
      at = in_table ? &at->table().find(key)->second : nullptr;
    }
    if (!at || !at->isNumber()) {
      throw InputError(fmt::format("{}: it has no number \"{}\"", file, join(n.path, ".")));
    }
    const size_t from = placeOf(text, at->line, at->column);
    const size_t to = std::min(text.find_first_of(" \t\r\n,]}#", from), text.size());
    written[from] = {to - from, fmt::format("{}", n.value)};
  }
  std::string out(text);
  for (auto w = written.rbegin(); w != written.rend(); ++w) {
    out.replace(w->first, w->second.first, w->second.second);
  }
  return out;
}

std::string readFile(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why));
  };
  // Without O_NONBLOCK a pipe that nobody writes to would keep us here.
  const Descriptor in(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  struct stat about = {};
  if (in < 0 || fstat(in, &about) != 0) {
    refuse(fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  if (S_ISDIR(about.st_mode)) refuse("expected a file, got a folder");
  const bool pipe = S_ISFIFO(about.st_mode);  // as of a shell's <(…)
  if (!S_ISREG(about.st_mode) && !pipe) refuse("expected a file, got a device");

  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience);
  std::string text;
  while (true) {
    const std::chrono::duration<double, std::milli> left = end - std::chrono::steady_clock::now();
    pollfd wait{in, POLLIN, 0};
    if (pipe && poll(&wait, 1, std::max(0, static_cast<int>(left.count()))) == 0) {
      refuse(fmt::format("a pipe that is not at its end within {:g} s", kPatience));
    }
    char buffer[1 << 16];
    const ssize_t n = read(in, buffer, sizeof buffer);
    if (n == 0) return text;
    if (n < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (n < 0) refuse(fmt::format("cannot be read: {}", std::strerror(errno)));
    text.append(buffer, n);
    if (static_cast<off_t>(text.size()) > kMostText) {
      refuse(fmt::format("expected at most {} MiB", kMostText >> 20));
    }
  }
}

}  // namespace traceur
