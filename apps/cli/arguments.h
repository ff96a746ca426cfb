// Words of a command line that stand for more than one number.
#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <string>

namespace traceur::cli {

/// @param where  begins the message: "--var x=0:one"
/// @throws InputError unless the whole text is one number, which may be infinite but not NaN
double toNumber(const std::string& text, const std::string& where);

/// "FIRST:LAST:COUNT" as COUNT ≥ 2 values, evenly spaced and rising.
/// @throws InputError for anything else
Eigen::VectorXd toTasks(const std::string& text, const std::string& where);

/// The same as text in one spelling, so that --resume compares tasks and not their words.
std::string tasksText(const Eigen::VectorXd& tasks);

/// How many control points --curve "linear" or "cubic" has: 2 or 4.
/// @throws InputError for a curve with more of them than there are tasks
int controlPointsOf(const std::string& curve, int tasks);

/// What --optimiser may be, a line each, for the end of a verb's help.
std::string optimisersHelp();

/// Refuses all but digits that are a 64-bit number: "-1", " -1" and 2^64 would be read as 2^64 - 1.
CLI::Validator isSeed();

/// Has all options of this program and its verbs that are numbers refuse "nan", "inf", what is too
/// large for a number and, where whole ones are asked for, "010": CLI11 would take it for 8.
void requirePlainNumbers(CLI::App& program);

}  // namespace traceur::cli
