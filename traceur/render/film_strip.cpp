#include "traceur/render/film_strip.h"

#include <fmt/format.h>

#include <algorithm>

#include "traceur/core/error.h"
#include "traceur/render/font.h"
#include "traceur/render/motion.h"

namespace traceur::render {
namespace {

constexpr int kMostPanels = 200;
constexpr int kMostColumns = 5;

/// As much of the text as is `width` wide.
std::string fitting(const Font& font, std::string text, int width, int height) {
  while (!text.empty() && font.width(text, height) > width) text.pop_back();
  return text;
}

/// Height of a label [px].
int lettersOf(const FilmStripOptions& options) {
  return std::max(13, options.panel_height / 13);
}

int gapOf(const FilmStripOptions& options) {
  return std::max(2, options.panel_width / 80);
}

}  // namespace

Image filmStrip(const sim::Recording& recording, const FilmStripOptions& options) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  checkRecording(*model, recording);
  const double start = recording.frames.front().state.time;
  const double end = recording.frames.back().state.time;
  for (const double t : options.times) {
    // A hair's breadth outside is a rounded number, not a mistake.
    if (!(t >= start - 1e-6 && t <= end + 1e-6)) {
      throw InputError(
          fmt::format("film strip: time {} s is outside the recording, [{}, {}] s", t, start, end));
    }
  }
  const int n = options.times.empty() ? options.count : static_cast<int>(options.times.size());
  if (n < 1 || n > kMostPanels) {
    throw InputError(fmt::format("film strip: {} panels, expected 1 to {}", n, kMostPanels));
  }
  if (options.columns < 0) {
    throw InputError(
        fmt::format("film strip: columns = {}, expected at least 0 (0: chosen)", options.columns));
  }
  std::vector<double> times = options.times;
  for (int i = 0; options.even && options.times.empty() && i < n; ++i) {
    times.push_back(n > 1 ? start + (end - start) * i / (n - 1) : start);
  }
  if (times.empty()) times = tellingTimes(*model, recording, n);
  const int rows = (n + kMostColumns - 1) / kMostColumns;
  const int columns = options.columns > 0 ? options.columns : (n + rows - 1) / rows;

  Offscreen offscreen(model, {.width = options.panel_width, .height = options.panel_height});
  const std::vector<Camera> cameras = offscreen.aim(recording.frames, options.camera);
  const Font font;
  const int letters = lettersOf(options);
  const int label = options.labels ? letters * 5 / 4 : 0;
  std::vector<Image> panels;
  for (const double t : times) {
    const sim::Frame frame = frameAt(*model, recording, t);
    const auto at =
        std::min_element(recording.frames.begin(), recording.frames.end(),
                         [&](const sim::Frame& a, const sim::Frame& b) {
                           return std::abs(a.state.time - t) < std::abs(b.state.time - t);
                         });
    const Image picture =
        offscreen.draw(frame, cameras[at - recording.frames.begin()], options.draw);
    Image& panel = panels.emplace_back(picture.width, picture.height + label);
    paste(panel, picture, 0, label);
    if (options.labels) {
      const std::string text =
          fmt::format("{:.2f} s  {}", std::abs(t) < 0.005 ? 0.0 : t, phaseName(recording, frame));
      const int margin = letters / 4;
      font.draw(panel, margin, 0, letters, fitting(font, text, panel.width - 2 * margin, letters));
    }
  }
  return tile(panels, columns, gapOf(options));
}

Image filmStrips(std::span<const TitledRecording> recordings, FilmStripOptions options) {
  if (options.camera.distance <= 0) {
    double distance = 0;
    for (const auto& [title, r] : recordings) {
      Offscreen offscreen(sim::Model::fromMjcf(r.mjcf),
                          {.width = options.panel_width, .height = options.panel_height});
      for (const Camera& camera : offscreen.aim(r.frames, options.camera)) {
        distance = std::max(distance, camera.distance);
      }
    }
    options.camera.distance = distance;
  }
  std::vector<Image> strips;
  const Font font;
  const int letters = lettersOf(options);
  for (const auto& [title, recording] : recordings) {
    const Image panels = filmStrip(recording, options);
    const int heading = letters * 3 / 2;
    Image& strip = strips.emplace_back(panels.width, panels.height + heading);
    paste(strip, panels, 0, heading);
    const int margin = letters / 4;
    font.draw(strip, margin, margin, letters,
              fitting(font, title, strip.width - 2 * margin, letters));
  }
  return tile(strips, 1, gapOf(options));
}

}  // namespace traceur::render
