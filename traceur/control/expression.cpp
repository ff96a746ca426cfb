#include "traceur/control/expression.h"

#include <fmt/format.h>
#include <muParser.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::control {

namespace {
constexpr const char* kNameChars =
    "0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

constexpr size_t kLongest = 10'000;  // characters [ours]

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
    reading(text, [&] { parser.SetExpr(text); });
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
    for (const auto& [name, unused] : p.parser.GetUsedVar()) names.push_back(name);
    return names;
  });
}

bool Expression::isName(const std::string& text) {
  if (text.empty() || text.find_first_not_of(kNameChars) != std::string::npos) return false;
  if (text[0] == '.' || (text[0] >= '0' && text[0] <= '9')) return false;
  const Parser p(text);
  return !p.parser.GetFunDef().contains(text) && !p.parser.GetConst().contains(text);
}

Expression::Expression(const std::string& text, const Lookup& lookup)
    : parser_(std::make_unique<Parser>(text)) {
  const std::vector<std::string> names = namesIn(text);
  for (const std::string& name : names) {
    const double* place = lookup(name);
    if (!place) throw InputError(fmt::format("\"{}\": nothing is named \"{}\"", text, name));
    // muParser wants a mutable variable for its assignment operator, which we refuse.
    reading(text, [&] { parser_->parser.DefineVar(name, const_cast<double*>(place)); });
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
