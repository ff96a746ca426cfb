// The bongo board on paper and in motion: runs side by side, from where a policy balances, and how
// a learning went.
#pragma once

#include <filesystem>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "traceur/bias/bongo_learning.h"

namespace traceur::cli {

/// A run to be shown.
struct BalanceRun {
  std::string label;
  bias::RunLog log;
  std::string failure;  ///< what ended it, "" for nothing
};

/// The policy on the model and on the machine, from one start.
std::vector<BalanceRun> modelAndMachine(const bias::BongoMachine& machine,
                                        const Eigen::VectorXd& parameters,
                                        const Eigen::VectorXd& x0);

/// A row of panels for each run; one that fails stays as it ended.
void writeBalanceStrip(const std::filesystem::path& file, std::span<const BalanceRun> runs);

/// The same in motion, side by side, in real time for 5 s (MP4).
/// @throws as render::VideoFile
void writeBalanceVideo(const std::filesystem::path& file, std::span<const BalanceRun> runs);

/// Runs the machine from a grid of wheel and board angles, `count` each way within ±`angle` [rad],
/// `tries` times from each, draws it, and writes the numbers beside it as CSV.
/// Stopped, it writes nothing.
void writeBalanceMap(const std::filesystem::path& file, const bias::BongoMachine& machine,
                     const Eigen::VectorXd& parameters, double angle, int count, int tries,
                     std::uint64_t seed, const std::stop_token& stop);

/// What an iteration of a learning came to.
struct LearningStep {
  std::vector<double> costs;  ///< of the machine's runs
  /// R² of the bias it was searched with over the runs of this iteration, which that bias had not
  /// seen: (3) of the rates of wheel, board and legs, or (1) of the torque, which alone is learned
  /// through strong noise. Empty where no bias was learned.
  Eigen::VectorXd explained;
};

/// Costs of the runs and R² of the bias over the iterations, counted from 1.
void writeLearning(const std::filesystem::path& file, std::span<const LearningStep> steps);

}  // namespace traceur::cli
