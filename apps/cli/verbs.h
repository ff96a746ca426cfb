// The program's verbs. A new one is a file of its own and a line in verbs.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

namespace traceur::cli {

/// What the program returns to the shell.
/// kNotReached: all was done, and what was asked of the skill is not reached.
enum ExitCode { kDone = 0, kFailed = 1, kWrongUse = 2, kNotReached = 3, kInterrupted = 130 };

/// Adds a verb to the program; when it was asked for, its callback runs it and sets exit_code.
using AddVerb = void (*)(CLI::App& program, int& exit_code);

void addCoach(CLI::App& program, int& exit_code);
void addTry(CLI::App& program, int& exit_code);
void addLearn(CLI::App& program, int& exit_code);
void addPerform(CLI::App& program, int& exit_code);
void addExport(CLI::App& program, int& exit_code);
void addShow(CLI::App& program, int& exit_code);
void addRender(CLI::App& program, int& exit_code);
void addPlot(CLI::App& program, int& exit_code);
void addInspect(CLI::App& program, int& exit_code);
void addLand(CLI::App& program, int& exit_code);
void addFall(CLI::App& program, int& exit_code);
void addBalance(CLI::App& program, int& exit_code);
void addMinimise(CLI::App& program, int& exit_code);
void addReproduce(CLI::App& program, int& exit_code);

const std::vector<AddVerb>& allVerbs();

}  // namespace traceur::cli
