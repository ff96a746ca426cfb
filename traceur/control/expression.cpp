#include "traceur/control/expression.h"

#include <fmt/format.h>
#include <muParser.h>

#include <cmath>

#include "traceur/core/error.h"

namespace traceur::control {

namespace {
constexpr const char* kNameChars =
    "0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
}  // namespace

struct Expression::Parser {
  mu::Parser parser;

  explicit Parser(const std::string& text) {
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
    parser.SetExpr(text);
  }

  static InputError error(const std::string& text, const mu::ParserError& e) {
    std::string message = e.GetMsg();
    while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) {
      message.pop_back();
    }
    return InputError(fmt::format("\"{}\": {}", text, message));
  }
};

Expression::Expression(double value) : constant_(value) {}
Expression::~Expression() = default;
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;

std::vector<std::string> Expression::namesIn(const std::string& text) {
  Parser p(text);
  try {
    std::vector<std::string> names;
    for (const auto& [name, unused] : p.parser.GetUsedVar()) names.push_back(name);
    return names;
  } catch (const mu::ParserError& e) {
    throw Parser::error(text, e);
  }
}

bool Expression::isName(const std::string& text) {
  if (text.empty() || text.find_first_not_of(kNameChars) != std::string::npos) return false;
  if (text[0] == '.' || (text[0] >= '0' && text[0] <= '9')) return false;
  const Parser p(text);
  return !p.parser.GetFunDef().contains(text) && !p.parser.GetConst().contains(text);
}

Expression::Expression(const std::string& text, const Lookup& lookup)
    : parser_(std::make_unique<Parser>(text)) {
  for (const std::string& name : namesIn(text)) {
    const double* place = lookup(name);
    if (!place) throw InputError(fmt::format("\"{}\": nothing is named \"{}\"", text, name));
    // muParser wants a mutable variable for its assignment operator, which we refuse.
    parser_->parser.DefineVar(name, const_cast<double*>(place));
  }
  try {
    constant_ = parser_->parser.Eval();
  } catch (const mu::ParserError& e) {
    throw Parser::error(text, e);
  }
  if (parser_->parser.GetUsedVar().empty()) parser_.reset();  // it will never change
}

double Expression::value() const {
  return parser_ ? parser_->parser.Eval() : constant_;
}

}  // namespace traceur::control
