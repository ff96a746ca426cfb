// What several verbs read from a command line, or say of it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace traceur::cli {

/// What --optimiser may be, a line each, for the end of a verb's help.
std::string optimisersHelp();

/// Refuses all but digits that are a 64-bit number: "-1", " -1" and 2^64 would be read as 2^64 - 1.
CLI::Validator isSeed();

/// Has all options of this program and its verbs that are numbers refuse "nan", "inf", what is too
/// large for a number and, where whole ones are asked for, "010": CLI11 would take it for 8.
void requirePlainNumbers(CLI::App& program);

}  // namespace traceur::cli
