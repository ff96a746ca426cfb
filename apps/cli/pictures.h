// Film strips and videos of what was recorded.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/cli/interrupt.h"
#include "traceur/sim/recording.h"

namespace traceur::cli {

struct DrawArguments {
  std::string view = "";           ///< "": a strip from the side, a video in between
  std::vector<double> times = {};  ///< of a strip [s]; empty: count telling ones
  std::vector<int> size = {};      ///< width and height [px]; empty: the default
  int count = 8;
  int columns = 0;
  double speed = 1;  ///< of a video
  bool still = false;
  bool forces = false;
  bool com = false;
};

/// @throws InputError for a name that ends in none of .png, .mp4, .glb, .bvh
void requirePicture(const std::filesystem::path& file);

/// Writes a film strip, a video, a 3D scene or a skeleton, by the file's name.
/// @return whether it is there: false when asked to stop before
bool draw(const sim::Recording& recording, const std::filesystem::path& file,
          const DrawArguments& how, Interrupt& interrupt, bool quiet);

}  // namespace traceur::cli
