// Pictures in memory and as PNG files.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace traceur::render {

using Eigen::Vector2d;

/// sRGB, 0 to 255.
struct Color {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  bool operator==(const Color&) const = default;
};

inline constexpr Color kWhite{255, 255, 255};
inline constexpr Color kInk{38, 38, 38};  ///< text and outlines [ours]

/// Pixels from the top left, x to the right, y down; pixel (x, y) covers [x, x+1) x [y, y+1).
struct Image {
  int width = 0;                  ///< [px]
  int height = 0;                 ///< [px]
  std::vector<std::uint8_t> rgb;  ///< (3·width·height), rows from the top

  Image() = default;
  Image(int columns, int rows, Color fill = kWhite);

  Color at(int x, int y) const;
  /// Mixes a colour in, 0 ≤ alpha ≤ 1; outside the picture nothing happens.
  void blend(int x, int y, Color color, double alpha);
};

/// Copies a picture with its top left corner at (x, y); what falls outside is cut.
void paste(Image& onto, const Image& picture, int x, int y);

/// Pictures of one size in rows of `columns`, from the top left, `gap` [px] of `between` among
/// them.
/// @throws InputError for no pictures, pictures of different sizes or columns < 1
Image tile(std::span<const Image> pictures, int columns, int gap = 0, Color between = kWhite);

/// Fills a simple polygon (corners in pixels, either direction) with smooth edges.
void fillPolygon(Image& image, std::span<const Vector2d> corners, Color color);
/// Fills a disc with smooth edges; centre and radius [px].
void fillDisc(Image& image, const Vector2d& centre, double radius, Color color);

/// Writes a PNG. The file appears whole or not at all.
/// @throws SystemError naming the path when it cannot be written
void writePng(const Image& image, const std::filesystem::path& path);

}  // namespace traceur::render
