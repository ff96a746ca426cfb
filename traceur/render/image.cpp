#include "traceur/render/image.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>

#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"

namespace traceur::render {
namespace {

constexpr int kSubpixels = 4;  // along each axis: 17 levels of coverage [ours]

/// Blends a shape given by its inside test into the pixels of a rectangle.
template <class Inside>
void fillShape(Image& image, Vector2d low, Vector2d high, Color color, Inside inside) {
  low = low.cwiseMax(Vector2d::Zero());
  high = high.cwiseMin(Vector2d(image.width, image.height));
  for (int y = static_cast<int>(low.y()); y < high.y(); ++y) {
    for (int x = static_cast<int>(low.x()); x < high.x(); ++x) {
      int covered = 0;
      for (int j = 0; j < kSubpixels; ++j) {
        for (int i = 0; i < kSubpixels; ++i) {
          covered += inside(Vector2d(x + (i + 0.5) / kSubpixels, y + (j + 0.5) / kSubpixels));
        }
      }
      if (covered > 0) image.blend(x, y, color, covered / double(kSubpixels * kSubpixels));
    }
  }
}

}  // namespace

Image::Image(int columns, int rows, Color fill)
    : width(columns), height(rows), rgb(size_t{3} * columns * rows) {
  for (size_t i = 0; i < rgb.size(); i += 3) {
    rgb[i] = fill.r;
    rgb[i + 1] = fill.g;
    rgb[i + 2] = fill.b;
  }
}

Color Image::at(int x, int y) const {
  const std::uint8_t* p = &rgb[3 * (size_t{1} * y * width + x)];
  return {p[0], p[1], p[2]};
}

void Image::blend(int x, int y, Color color, double alpha) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  std::uint8_t* p = &rgb[3 * (size_t{1} * y * width + x)];
  const std::uint8_t with[3] = {color.r, color.g, color.b};
  for (int c = 0; c < 3; ++c) {
    p[c] = static_cast<std::uint8_t>(std::lround(p[c] + alpha * (with[c] - p[c])));
  }
}

void paste(Image& onto, const Image& picture, int x, int y) {
  const int left = std::max(0, -x);
  const int right = std::min(picture.width, onto.width - x);
  if (left >= right) return;
  for (int row = std::max(0, -y); row < std::min(picture.height, onto.height - y); ++row) {
    const auto* from = &picture.rgb[3 * (size_t{1} * row * picture.width + left)];
    std::copy_n(from, 3 * (right - left),
                &onto.rgb[3 * (size_t{1} * (y + row) * onto.width + x + left)]);
  }
}

Image tile(std::span<const Image> pictures, int columns, int gap, Color between) {
  if (pictures.empty()) throw InputError("tile: there are no pictures");
  if (columns < 1)
    throw InputError(fmt::format("tile: columns = {}, expected at least 1", columns));
  const int width = pictures[0].width;
  const int height = pictures[0].height;
  const int n = static_cast<int>(pictures.size());
  columns = std::min(columns, n);
  const int rows = (n + columns - 1) / columns;
  Image whole(columns * width + (columns - 1) * gap, rows * height + (rows - 1) * gap, between);
  for (int i = 0; i < n; ++i) {
    if (pictures[i].width != width || pictures[i].height != height) {
      throw InputError(fmt::format("tile: picture {} is {}x{}, the first {}x{}", i,
                                   pictures[i].width, pictures[i].height, width, height));
    }
    paste(whole, pictures[i], i % columns * (width + gap), i / columns * (height + gap));
  }
  return whole;
}

void fillPolygon(Image& image, std::span<const Vector2d> corners, Color color) {
  if (corners.size() < 3) return;
  Vector2d low = corners[0];
  Vector2d high = corners[0];
  for (const Vector2d& c : corners) {
    low = low.cwiseMin(c);
    high = high.cwiseMax(c);
  }
  fillShape(image, low, high, color, [&](const Vector2d& p) {
    bool inside = false;  // crossings of the ray to the right
    for (size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
      const Vector2d& a = corners[i];
      const Vector2d& b = corners[j];
      if ((a.y() > p.y()) != (b.y() > p.y()) &&
          p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) {
        inside = !inside;
      }
    }
    return inside;
  });
}

void fillDisc(Image& image, const Vector2d& centre, double radius, Color color) {
  const Vector2d r = Vector2d::Constant(radius);
  fillShape(image, centre - r, centre + r, color,
            [&](const Vector2d& p) { return (p - centre).squaredNorm() <= radius * radius; });
}

void writePng(const Image& image, const std::filesystem::path& path) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  std::vector<char> bytes;
  // Asked twice: for the size, then for the bytes.
  for (int pass = 0; pass < 2; ++pass) {
    bytes.resize(size);
    if (!png_image_write_to_memory(&png, pass ? bytes.data() : nullptr, &size, 0, image.rgb.data(),
                                   0, nullptr)) {
      throw SystemError(fmt::format("cannot write {}: {}", path.string(), png.message));
    }
  }
  PendingFile file(path);
  file.write({bytes.data(), size});
  file.commit();
}

}  // namespace traceur::render
