// A motion on paper: panels side by side with their times.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "traceur/render/offscreen.h"

namespace traceur::render {

struct FilmStripOptions {
  /// Which moments [s, the recording's clock]; empty: `count` of tellingTimes().
  std::vector<double> times = {};
  int count = 8;
  bool even = false;       ///< `count` times at equal distances instead of telling ones
  int panel_width = 320;   ///< [px]
  int panel_height = 240;  ///< [px], without the label
  int columns = 0;         ///< 0: rows of at most 5, as equal as possible
  Camera camera = {.view = View::kSide};
  DrawOptions draw = {};
  bool labels = true;  ///< "0.70 s  thrust" over each panel
};

/// Draws the panels in rows. All are taken from equally far, so that sizes compare.
/// @throws InputError for an empty recording, a time outside it, sizes out of range; SystemError
/// when there is no off-screen context
Image filmStrip(const sim::Recording& recording, const FilmStripOptions& options = {});

struct TitledRecording {
  std::string title;  ///< over its strip; what does not fit is cut off
  sim::Recording recording;
};

/// One film strip for each recording, under each other, all taken from equally far.
/// @throws as filmStrip; InputError for no recording
Image filmStrips(std::span<const TitledRecording> recordings, FilmStripOptions options = {});

}  // namespace traceur::render
