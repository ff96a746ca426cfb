#include "traceur/render/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/render/font.h"
#include "traceur/render/motion.h"
#include "traceur/render/whole_file.h"

namespace traceur::render {
namespace {

constexpr int kMostPictures = 200000;
/// Asked to end, we wait so long [s] for ffmpeg [ours].
constexpr double kGrace = 0.5;

void check(bool ok, const std::string& message) {
  if (!ok) throw InputError("video: " + message);
}

std::vector<std::string> command(const std::string& output, int width, int height, int fps) {
  check(width >= 2 && height >= 2 && width % 2 == 0 && height % 2 == 0,
        fmt::format("{} x {} px, expected even numbers", width, height));
  check(fps >= 1 && fps <= 240, fmt::format("fps = {} is outside [1, 240]", fps));
  return {"ffmpeg",
          "-hide_banner",
          "-loglevel",
          "error",
          "-y",
          "-f",
          "rawvideo",
          "-pixel_format",
          "rgb24",
          "-video_size",
          fmt::format("{}x{}", width, height),
          "-framerate",
          std::to_string(fps),
          "-i",
          "pipe:0",
          "-an",
          "-c:v",
          "libx264",
          "-preset",
          "veryfast",
          "-crf",
          "20",
          "-pix_fmt",
          "yuv420p",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          "file:" + output};
}

}  // namespace

VideoFile::VideoFile(const std::filesystem::path& path, int width, int height, int fps)
    : width_(width),
      height_(height),
      path_(path),
      file_(path),
      ffmpeg_(command(file_.beside().string(), width, height, fps)) {}

void VideoFile::heed(std::stop_token stop) {
  ffmpeg_.heed(std::move(stop), kGrace);
}

void VideoFile::add(const Image& image) {
  check(image.width == width_ && image.height == height_,
        fmt::format("a picture of {} x {} px, expected {} x {}", image.width, image.height, width_,
                    height_));
  ffmpeg_.write({reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()});
}

void VideoFile::finish() {
  const std::string said = ffmpeg_.finish();
  // On a full disk ffmpeg complains, and says that it succeeded.
  if (!isWholeMp4(file_.beside())) {
    throw SystemError(fmt::format("cannot write {}: it was cut short{}{}", path_.string(),
                                  said.empty() ? "" : ": ", said));
  }
  file_.commit();
}

void writeVideo(const sim::Recording& recording, const std::filesystem::path& path,
                const VideoOptions& options) {
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  checkRecording(*model, recording);
  check(options.fps >= 1 && options.fps <= 240,
        fmt::format("fps = {} is outside [1, 240]", options.fps));
  check(options.speed >= 0.001 && options.speed <= 1000,
        fmt::format("speed = {} is outside [0.001, 1000]", options.speed));
  check(options.hold >= 0 && options.hold <= 60,
        fmt::format("hold = {} s is outside [0, 60]", options.hold));
  const double start = std::max(options.start, recording.frames.front().state.time);
  const double end = std::min(options.end, recording.frames.back().state.time);
  check(start <= end, fmt::format("[{}, {}] s holds nothing of the recording, [{}, {}] s",
                                  options.start, options.end, recording.frames.front().state.time,
                                  recording.frames.back().state.time));

  // Watching time k / fps shows the motion's time start + k·speed / fps.
  const double pictures = std::floor((end - start) * options.fps / options.speed + 1e-6) + 1;
  check(pictures <= kMostPictures,
        fmt::format("{} pictures, expected at most {}", pictures, kMostPictures));
  std::vector<sim::Frame> frames;
  frames.reserve(static_cast<size_t>(pictures));
  for (int k = 0; k < static_cast<int>(pictures); ++k) {
    frames.push_back(frameAt(*model, recording, start + k * options.speed / options.fps));
  }
  const int width = options.width + options.width % 2;
  const int height = options.height + options.height % 2;

  Offscreen offscreen(model, {.width = width, .height = height, .quality = Quality::kFast});
  const std::vector<Camera> cameras = offscreen.aim(frames, options.camera);
  const Font font;
  const int letters = std::max(13, height / 20);
  const std::string speed = options.speed == 1 ? "" : fmt::format("  ({:.3g}x)", options.speed);

  VideoFile video(path, width, height, options.fps);
  video.heed(options.stop);
  Image image;
  for (size_t k = 0; k < frames.size(); ++k) {
    image = offscreen.draw(frames[k], cameras[k], options.draw);
    if (options.labels) {
      font.draw(image, letters / 2, letters / 3, letters,
                fmt::format("{:.2f} s  {}{}", frames[k].state.time + 0.0,
                            phaseName(recording, frames[k]), speed));
    }
    video.add(image);
    if (options.progress) options.progress(double(k + 1) / double(frames.size()));
  }
  for (int k = 0; k < std::lround(options.hold * options.fps); ++k) video.add(image);
  video.finish();
}

}  // namespace traceur::render
