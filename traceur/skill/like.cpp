#include "traceur/skill/like.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace traceur::skill {
namespace {

namespace fs = std::filesystem;
using Table = TomlValue::Table;

/// One like another that is like another, … [ours].
constexpr size_t kMostLike = 8;

void moveDown(TomlValue& v, int lines) {
  v.line += lines;
  if (auto* table = std::get_if<Table>(&v.value)) {
    for (auto& [key, inner] : *table) moveDown(inner, lines);
  } else if (auto* array = std::get_if<TomlValue::Array>(&v.value)) {
    for (TomlValue& inner : *array) moveDown(inner, lines);
  }
}

/// Tables become one, key by key; of all else the own one counts.
void merge(Table& into, const Table& own) {
  for (const auto& [key, v] : own) {
    const auto at = into.find(key);
    if (at != into.end() && at->second.isTable() && v.isTable()) {
      merge(std::get<Table>(at->second.value), v.table());
    } else {
      into.insert_or_assign(key, v);
    }
  }
}

/// A number alone stands for this key of the other's row.
void spellOut(Table& own, const char* table, const char* key) {
  const auto at = own.find(table);
  if (at == own.end() || !at->second.isTable()) return;
  for (auto& [name, v] : std::get<Table>(at->second.value)) {
    if (!v.isNumber()) continue;
    TomlValue row{Table{{key, v}}, v.line, v.column};
    v = std::move(row);
  }
}

/// Refuses what a skill that is like another takes from it as it is.
void refuseOthers(Table& own, Diagnostics& diagnostics) {
  static constexpr std::array kOwn = {"controller", "scene",      "start",
                                      "constants",  "parameters", "conditions"};
  for (auto at = own.begin(); at != own.end();) {
    const auto& [key, v] = *at;
    const bool single = !v.isTable() && !v.isArray();
    if (single || std::find(kOwn.begin(), kOwn.end(), key) != kOwn.end()) {
      ++at;
      continue;
    }
    diagnostics.add(v.line, v.column,
                    fmt::format("\"{}\": expected in the skill that this one is like", key));
    at = own.erase(at);
  }
}

void refuseUnknown(const Table& own, const Table& other, const char* table,
                   Diagnostics& diagnostics) {
  const auto ours = own.find(table);
  if (ours == own.end() || !ours->second.isTable()) return;
  const auto theirs = other.find(table);
  for (const auto& [name, v] : ours->second.table()) {
    if (theirs != other.end() && theirs->second.isTable() &&
        theirs->second.table().contains(name)) {
      continue;
    }
    diagnostics.add(v.line, v.column,
                    fmt::format("\"{}\": the skill that this one is like has none of this name in "
                                "[{}]",
                                name, table));
  }
}

}  // namespace

LikeDocument LikeDocument::read(const std::string& text, const fs::path& file,
                                Diagnostics& diagnostics, std::vector<fs::path>& open) {
  LikeDocument all{parseToml(text, file.string()), ""};
  // From the own file to what it is like, and what that is like.
  std::vector<TomlValue> documents = {std::move(all.document)};
  int lines = static_cast<int>(std::count(text.begin(), text.end(), '\n')) + 1;
  fs::path folder = file.parent_path();
  while (true) {
    Table& own = std::get<Table>(documents.back().value);
    const auto like = own.find("like");
    if (like == own.end()) break;
    const TomlValue v = like->second;
    own.erase(like);
    const auto fail = [&](const std::string& why) {
      diagnostics.add(v.line, v.column, "\"like\": " + why);
      diagnostics.throwIfAny();
    };
    if (!v.isString()) fail(fmt::format("expected the path of a skill file, got {}", v.kind()));
    const fs::path path = (folder / v.string()).lexically_normal();
    if (std::find(open.begin(), open.end(), path) != open.end()) {
      fail(fmt::format("{} is like itself", path.string()));
    }
    if (documents.size() > kMostLike) {
      fail(fmt::format("more than {} files, one like the other", kMostLike));
    }
    std::string other;
    try {
      other = readFile(path);
      documents.push_back(parseToml(other, path.string()));
    } catch (const InputError& e) {
      fail(e.what());
    }
    open.push_back(path);
    diagnostics.goesOn(path.string(), lines);
    moveDown(documents.back(), lines);
    lines += static_cast<int>(std::count(other.begin(), other.end(), '\n')) + 1;
    all.others += other + "\n";
    folder = path.parent_path();
  }
  all.document = std::move(documents.back());
  documents.pop_back();
  while (!documents.empty()) {
    Table& own = std::get<Table>(documents.back().value);
    Table& other = std::get<Table>(all.document.value);
    refuseOthers(own, diagnostics);
    for (const char* table : {"parameters", "conditions"}) {
      refuseUnknown(own, other, table, diagnostics);
    }
    spellOut(own, "parameters", "initial");
    spellOut(own, "conditions", "default");
    merge(other, own);
    documents.pop_back();
  }
  return all;
}

}  // namespace traceur::skill
