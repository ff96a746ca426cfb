// Runs of a plant as files, so that a person can carry a policy to a machine, record, and come
// back.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "traceur/bias/dynamics_bias.h"

namespace traceur::bias {

/// What a plant's log holds.
struct LogFormat {
  std::string plant;  ///< "bongo board"
  struct Column {
    std::string name;  ///< "wheel"
    std::string unit;  ///< "rad"
  };
  std::vector<Column> states;
  std::vector<Column> inputs;
};

/// Of BongoBoard.
LogFormat bongoLogFormat();

/// Writes
///
///     # {"format": "traceur log", "version": 1, "plant": "bongo board", "time_step": 0.001,
///        "units": {"time": "s", "wheel": "rad", …}}
///     time,wheel,board,leg,wheel_rate,board_rate,leg_rate,torque
///     0,0,0.0044,0,0,0,0,12.5
///     …
///
/// (the first line in one), a row for each reading; an input stands beside the reading it answers,
/// and the last reading has none. The file appears whole or not at all.
void writeLog(const std::filesystem::path& file, const RunLog& log, const LogFormat& format);

/// Reads what writeLog writes; columns may come in any order, and others beside them are ignored.
/// A byte order mark before the first line and carriage returns at the ends of lines are no part of
/// them.
/// @throws InputError naming file, line and column: for another format, version or plant, a column
///         that is missing, there twice or in another unit, more than 1000 columns, a row of more
///         cells than columns, what is not a finite number, rows that do not follow
///         each other by time_step (to a hundredth of it), and fewer than two of them
RunLog readLog(const std::filesystem::path& file, const LogFormat& format);

}  // namespace traceur::bias
