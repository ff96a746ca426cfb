#include "traceur/core/toml.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

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

/// What stands there instead of a finite number.
std::string got(const TomlValue& v) {
  return v.isNumber() ? fmt::format("{}", v.number()) : std::string(v.kind());
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
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
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
  try {
    return convert(toml::parse(text, file));
  } catch (const toml::parse_error& e) {
    Diagnostics d(file);
    d.add(static_cast<int>(e.source().begin.line), static_cast<int>(e.source().begin.column),
          fmt::format("not TOML: {}", e.description()));
    d.throwIfAny();
  }
  return {};
}

std::string readFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw InputError(fmt::format("{}: expected a file, got a folder", file.string()));
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  }
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

}  // namespace traceur
