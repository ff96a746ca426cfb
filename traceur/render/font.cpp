#include "traceur/render/font.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/render/gl_context.h"
#include "traceur/sim/model.h"

namespace traceur::render {
namespace {

constexpr std::uint8_t kPaper = 255;

}  // namespace

Font::Font() {
  GlContext gl;
  mjrContext context;
  mjr_defaultContext(&context);
  // Any model will do; an empty one's framebuffer has 640 x 480 pixels.
  const auto model = sim::Model::fromMjcf(
      "<mujoco><visual><quality shadowsize='0' offsamples='0'/></visual></mujoco>");
  mjr_makeContext(model->raw(), &context, mjFONTSCALE_300);
  mjr_setBuffer(mjFB_OFFSCREEN, &context);
  const mjrRect all = mjr_maxViewport(&context);
  height_ = context.charHeightBig;
  if (context.currentBuffer != mjFB_OFFSCREEN || all.height < height_ || height_ <= 0) {
    mjr_freeContext(&context);
    throw SystemError("cannot draw off-screen: OSMesa gives no framebuffer for text");
  }
  for (int i = 0; i < kCount; ++i) {
    Glyph& g = glyphs_[i];
    g.width = context.charWidthBig[kFirst + i];
    const mjrRect cell = {0, 0, g.width, height_};
    mjr_rectangle(cell, 1, 1, 1, 1);
    const char text[] = {static_cast<char>(kFirst + i), '\0'};
    mjr_text(mjFONT_BIG, text, &context, 0, 0, 0, 0, 0);
    std::vector<std::uint8_t> rgb(size_t{3} * g.width * height_);
    mjr_readPixels(rgb.data(), nullptr, cell, &context);
    g.cover.resize(rgb.size() / 3);
    for (int y = 0; y < height_; ++y) {  // OpenGL's rows come from the bottom
      for (int x = 0; x < g.width; ++x) {
        g.cover[size_t{1} * y * g.width + x] =
            rgb[3 * (size_t{1} * (height_ - 1 - y) * g.width + x)] < kPaper / 2;
      }
    }
  }
  mjr_freeContext(&context);
}

const Font::Glyph& Font::glyph(char c) const {
  const int i = static_cast<unsigned char>(c) - kFirst;
  return glyphs_[i >= 0 && i < kCount ? i : '?' - kFirst];
}

int Font::width(std::string_view text, int height) const {
  Image nowhere;
  return draw(nowhere, 0, 0, height, text);
}

int Font::draw(Image& image, int x, int y, int height, std::string_view text, Color color) const {
  const double scale = double(height_) / height;  // stored pixels in one of the picture's
  double pen = x;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0) == 0x80) continue;  // rest of a UTF-8 character
    const Glyph& g = glyph(c);
    const double end = pen + g.width / scale;
    // Each pixel takes the mean of the stored pixels under it.
    for (int py = std::max(0, y); py < std::min(y + height, image.height); ++py) {
      const int top = static_cast<int>((py - y) * scale);
      const int bottom = std::clamp(static_cast<int>((py - y + 1) * scale), top + 1, height_);
      for (int px = std::max(0, static_cast<int>(pen)); px < std::min<double>(end, image.width);
           ++px) {
        const int left = static_cast<int>(std::floor((px - pen) * scale));
        const int right = std::max(static_cast<int>(std::floor((px - pen + 1) * scale)), left + 1);
        int ink = 0;
        for (int sy = top; sy < bottom; ++sy) {
          for (int sx = std::max(left, 0); sx < std::min(right, g.width); ++sx) {
            ink += g.cover[size_t{1} * sy * g.width + sx];
          }
        }
        if (ink > 0) image.blend(px, py, color, double(ink) / ((bottom - top) * (right - left)));
      }
    }
    pen = end;
  }
  return static_cast<int>(pen) + 1;
}

}  // namespace traceur::render
