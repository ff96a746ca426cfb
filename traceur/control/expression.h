// Arithmetic a person writes in a skill file, bound to numbers that change.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace traceur::control {

/// An arithmetic expression: + - * / ^, comparisons, && ||, c ? a : b, and abs, min, max, sqrt,
/// exp, sin, cos, tan, atan2, sign, … and pi (muParser's language, without assignment). Names may
/// hold dots, and what is between single quotes is a part of one whatever it holds: joint.'hip-l'.
/// True is 1, false is 0. Comparisons with not-a-number are false, but for != .
class Expression {
 public:
  /// Where a name's value lives, or null if nothing has that name.
  using Lookup = std::function<const double*(const std::string& name)>;

  /// @param lookup  called once for each name; what it returns must outlive the expression
  /// @throws InputError: what is wrong and, where one place is, its column in the text
  Expression(const std::string& text, const Lookup& lookup);
  /// A constant.
  explicit Expression(double value);
  ~Expression();
  Expression(Expression&&) noexcept;
  Expression& operator=(Expression&&) noexcept;

  double value() const;
  /// The value is a number and not 0.
  bool holds() const {
    const double v = value();
    return v == v && v != 0;
  }

  /// The names a text uses, sorted.
  /// @throws InputError as the constructor, but for unknown names
  static std::vector<std::string> namesIn(const std::string& text);
  /// Whether a text can be a name in an expression: letters, digits, '_' and '.', no digit first,
  /// and no function or constant of the language.
  static bool isName(const std::string& text);
  /// How a text reads what has this name: where it is none by itself, with quotes about the parts
  /// between its dots that need them.
  static std::string spelled(const std::string& name);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;  // null for a constant
  double constant_ = 0;
};

}  // namespace traceur::control
