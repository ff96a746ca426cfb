#include "traceur/control/expression.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "traceur/core/error.h"

namespace traceur::control {

namespace {
constexpr const char* kNameChars =
    "0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

constexpr size_t kLongest = 10'000;  // characters [ours]
constexpr char kQuote = '\'';

bool isNameChar(char c) {
  return std::string_view(kNameChars).find(c) != std::string_view::npos;
}

/// A text in which names with quotes have become names that the parser knows how to read.
struct Unquoted {
  std::string text;
  std::map<std::string, std::string> names;  // what was written for those in the text, unquoted

  explicit Unquoted(const std::string& written) {
    for (size_t i = 0; i < written.size();) {
      if (!isNameChar(written[i]) && written[i] != kQuote) {
        text += written[i++];
        continue;
      }
      std::string name;
      bool quoted = false;
      const size_t begin = i;
      while (i < written.size() && (isNameChar(written[i]) || written[i] == kQuote)) {
        if (written[i] != kQuote) {
          name += written[i++];
          continue;
        }
        quoted = true;
        const size_t end = written.find(kQuote, i + 1);
        if (end == std::string::npos) {
          throw InputError(
              fmt::format("\"{}\": a quote in column {} is not closed", written, i + 1));
        }
        name += written.substr(i + 1, end - i - 1);
        i = end + 1;
      }
      if (!quoted) {
        text += written.substr(begin, i - begin);
        continue;
      }
      const std::string instead = fmt::format("quoted_{}_", names.size());
      names[instead] = name;
      text += instead;
    }
  }
};

/// What `read` gives; muParser's complaint about the text, which is no std::exception, as ours.
template <typename Read>
auto reading(const std::string& text, Read read) {
  try {
    return read();
  } catch (const mu::ParserError& e) {
    std::string message = e.GetMsg();
    while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) {
      message.pop_back();
    }
    throw InputError(fmt::format("\"{}\": {}", text, message));
  }
}

}  // namespace

struct Expression::Parser {
  mu::Parser parser;
  std::map<std::string, std::string> quoted;

  /// The name that stands for `inside` in the text that a person wrote.
  const std::string& written(const std::string& inside) const {
    const auto at = quoted.find(inside);
    return at == quoted.end() ? inside : at->second;
  }

  explicit Parser(const std::string& text) {
    if (text.size() > kLongest) {
      throw InputError(fmt::format("an expression of {} characters: expected at most {}",
                                   text.size(), kLongest));
    }
    // muParser's assignment would let a mistyped comparison change a value.
    for (size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '=') continue;
      const bool second = i > 0 && std::string_view("=<>!").find(text[i - 1]) != std::string::npos;
      const bool first = i + 1 < text.size() && text[i + 1] == '=';
      if (!first && !second) {
        throw InputError(fmt::format("\"{}\": '=' assigns; did you mean '=='?", text));
      }
    }
    parser.DefineNameChars(kNameChars);
    parser.DefineConst("pi", M_PI);
    parser.DefineFun("atan2", [](double y, double x) { return std::atan2(y, x); });
    Unquoted unquoted(text);
    quoted = std::move(unquoted.names);
    reading(text, [&] { parser.SetExpr(unquoted.text); });
  }
};

Expression::Expression(double value) : constant_(value) {}
Expression::~Expression() = default;
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;

std::vector<std::string> Expression::namesIn(const std::string& text) {
  Parser p(text);
  return reading(text, [&] {
    std::vector<std::string> names;
    for (const auto& [name, unused] : p.parser.GetUsedVar()) names.push_back(p.written(name));
    std::sort(names.begin(), names.end());
    return names;
  });
}

bool Expression::isName(const std::string& text) {
  if (text.empty() || text.find_first_not_of(kNameChars) != std::string::npos) return false;
  if (text[0] == '.' || (text[0] >= '0' && text[0] <= '9')) return false;
  const Parser p(text);
  return !p.parser.GetFunDef().contains(text) && !p.parser.GetConst().contains(text);
}

std::string Expression::spelled(const std::string& name) {
  if (isName(name)) return name;
  std::string out;
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('.', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    const bool plain = !part.empty() && std::all_of(part.begin(), part.end(), isNameChar);
    out += plain ? part : kQuote + part + kQuote;
    if (end < name.size()) out += '.';
    begin = end + 1;
  }
  return out;
}

Expression::Expression(const std::string& text, const Lookup& lookup)
    : parser_(std::make_unique<Parser>(text)) {
  const auto names = reading(text, [&] { return parser_->parser.GetUsedVar(); });
  for (const auto& used : names) {
    const std::string& inside = used.first;
    const std::string& name = parser_->written(inside);
    const double* place = lookup(name);
    if (!place) throw InputError(fmt::format("\"{}\": nothing is named \"{}\"", text, name));
    // muParser wants a mutable variable for its assignment operator, which we refuse.
    reading(text, [&] { parser_->parser.DefineVar(inside, const_cast<double*>(place)); });
  }
  constant_ = reading(text, [&] { return parser_->parser.Eval(); });
  if (const int values = parser_->parser.GetNumResults(); values != 1) {
    throw InputError(
        fmt::format("\"{}\": expected one value, got {} with commas between; decimals have a point",
                    text, values));
  }
  if (names.empty()) parser_.reset();  // it will never change
}

double Expression::value() const {
  return parser_ ? parser_->parser.Eval() : constant_;
}

}  // namespace traceur::control
