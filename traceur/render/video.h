// Pictures, and a motion, as an MP4 file, by ffmpeg.
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "traceur/core/pending_file.h"
#include "traceur/core/process.h"
#include "traceur/render/image.h"
#include "traceur/render/offscreen.h"

namespace traceur::render {

/// H.264 in MP4 of pictures one after the other, which browsers and office programs play. Life:
/// add() for each picture, then finish(), without which no file is left.
class VideoFile {
 public:
  /// @param width, height  [px], even
  /// @param fps            pictures per second, 1 to 240
  /// @throws InputError for sizes or fps out of range; SystemError naming the path when it cannot
  ///         be written, or when ffmpeg is missing
  VideoFile(const std::filesystem::path& path, int width, int height, int fps);

  /// From now on Process::GivenUp ends what waits for ffmpeg, soon after the request.
  void heed(std::stop_token stop);
  /// @param image  of the video's size
  /// @throws InputError for one of another size; SystemError in ffmpeg's words when that fails
  void add(const Image& image);
  /// The file appears whole or not at all.
  /// @throws SystemError in ffmpeg's words when that fails, or wrote less than all
  void finish();

 private:
  int width_, height_;
  std::filesystem::path path_;
  PendingFile file_;
  Process ffmpeg_;
};

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
  /// Asked to end while ffmpeg keeps us waiting: Process::GivenUp, and no file is left.
  std::stop_token stop = {};
  /// Called with the part done, from 0 to 1. What it throws ends the work, leaving no file.
  std::function<void(double)> progress = {};
};

/// Writes a VideoFile. The file appears whole or not at all; between the recording's frames
/// positions are interpolated.
/// @throws InputError for an empty recording or options out of range; SystemError naming the path
/// when it cannot be written, in ffmpeg's words when that fails, or when it is missing
void writeVideo(const sim::Recording& recording, const std::filesystem::path& path,
                const VideoOptions& options = {});

}  // namespace traceur::render
