// What several verbs read from a command line, or say of it.
#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <string>

#include "traceur/core/param.h"

namespace traceur::cli {

/// What --optimiser may be, a line each, for the end of a verb's help.
std::string optimisersHelp();

/// Refuses all but digits that are a 64-bit number: "-1", " -1" and 2^64 would be read as 2^64 - 1.
CLI::Validator isSeed();

/// Numbers with names and ranges, and what a message calls one of them and whose they are:
/// "condition" of "land".
struct Numbers {
  const ParamSpecs& rows;
  const char* kind;
  const std::string& owner;
};

/// Sets the number of this name in x, (rows).
/// @param where  begins the message: "--height 3"
/// @throws InputError for a name that there is not, with a suggestion, and a value out of its range
void assign(Eigen::VectorXd& x, const Numbers& numbers, const std::string& name, double value,
            const std::string& where);
/// The same of NAME=VALUE.
/// @param option  "--set"
void assign(Eigen::VectorXd& x, const Numbers& numbers, const std::string& text,
            const char* option);

/// Has all options of this program and its verbs that are numbers refuse "nan", "inf", what is too
/// large for a number and, where whole ones are asked for, "010": CLI11 would take it for 8.
void requirePlainNumbers(CLI::App& program);

}  // namespace traceur::cli
