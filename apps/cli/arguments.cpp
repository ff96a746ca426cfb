#include "apps/cli/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "traceur/core/error.h"
#include "traceur/core/text.h"
#include "traceur/optim/all.h"

namespace traceur::cli {

std::string optimisersHelp() {
  std::string text;
  for (const bool families : {false, true}) {
    text += families ? "With --tasks:\n" : "Optimisers:\n";
    for (const optim::OptimizerEntry& entry : optim::allOptimizers()) {
      if (entry.learns_families != families) continue;
      text += fmt::format("  {:<14}{}\n", entry.name, entry.help);
    }
  }
  return text;
}

void assign(Eigen::VectorXd& x, const Numbers& numbers, const std::string& name, double value,
            const std::string& where) {
  std::vector<std::string> names;
  for (const ParamSpec& p : numbers.rows) names.push_back(p.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError(fmt::format("{}: {} has no {} \"{}\".{}{}", where, numbers.owner, numbers.kind,
                                 name, didYouMean(name, names),
                                 names.empty() ? "" : " There is: " + join(names)));
  }
  const ParamSpec& p = numbers.rows[found - names.begin()];
  if (!(value >= p.min && value <= p.max)) {
    throw InputError(fmt::format("{}: {} is within [{}, {}]{}", where, name, p.min, p.max,
                                 p.unit.empty() ? "" : " " + p.unit));
  }
  x[found - names.begin()] = value;
}

void assign(Eigen::VectorXd& x, const Numbers& numbers, const std::string& text,
            const char* option) {
  const std::string where = fmt::format("{} {}", option, text);
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw InputError(fmt::format("{}: expected NAME=VALUE", where));
  }
  assign(x, numbers, text.substr(0, equals), toNumber(text.substr(equals + 1), where), where);
}

CLI::Validator isSeed() {
  return {[](const std::string& text) {
            std::uint64_t seed = 0;
            const char* end = text.data() + text.size();
            const auto read = std::from_chars(text.data(), end, seed);
            const bool octal = text.size() > 1 && text.front() == '0';
            if (read.ec == std::errc() && read.ptr == end && !octal) return std::string();
            return fmt::format("expected a number in [0, {}], got {}", UINT64_MAX, text);
          },
          ""};
}

void requirePlainNumbers(CLI::App& program) {
  const auto finite = [](const std::string& text) {
    const std::optional<double> value = parseNumber(text);
    return !value || std::isfinite(*value)  // no number at all is refused where it is read
               ? std::string()
               : fmt::format("expected a finite number, got {}", text);
  };
  const auto decimal = [](const std::string& text) {
    const size_t digits = text.find_first_not_of("+-");
    const bool octal = digits != std::string::npos && text[digits] == '0' &&
                       std::isdigit(static_cast<unsigned char>(text.c_str()[digits + 1]));
    return octal ? fmt::format("expected a number without zeros before it, got {}", text)
                 : std::string();
  };
  for (CLI::Option* option : program.get_options()) {
    const std::string type = option->get_type_name();
    if (type.starts_with("FLOAT")) option->check(CLI::Validator(finite, ""));
    if (type.starts_with("INT") || type.starts_with("UINT")) {
      option->check(CLI::Validator(decimal, ""));
    }
  }
  for (CLI::App* verb : program.get_subcommands({})) requirePlainNumbers(*verb);
}

}  // namespace traceur::cli
