// A motion as an MP4 file, by ffmpeg.
#pragma once

#include <filesystem>
#include <functional>

#include "traceur/render/offscreen.h"

namespace traceur::render {

struct VideoOptions {
  int width = 480;        ///< [px]; one is added to an odd number, which the format does not know
  int height = 360;       ///< [px]; likewise
  int fps = 50;           ///< pictures per second of watching, 1 to 240
  double speed = 1;       ///< 0.25: four times slower than it was
  double start = -1e300;  ///< from this time on [s, the recording's clock]
  double end = 1e300;     ///< up to this time [s]
  Camera camera = {.view = View::kThreeQuarter};
  DrawOptions draw = {};
  bool labels = true;  ///< time, phase and speed in the corner
  double hold = 0.5;   ///< how long the last picture stays [s of watching]
  /// Called with the part done, from 0 to 1. What it throws ends the work, leaving no file.
  std::function<void(double)> progress = {};
};

/// Writes H.264 in MP4, which browsers and office programs play. The file appears whole or not at
/// all; between the recording's frames positions are interpolated.
/// @throws InputError for an empty recording or options out of range; SystemError naming the path
/// when it cannot be written, in ffmpeg's words when that fails, or when it is missing
void writeVideo(const sim::Recording& recording, const std::filesystem::path& path,
                const VideoOptions& options = {});

}  // namespace traceur::render
