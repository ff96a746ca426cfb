// Lettering for pictures: MuJoCo's own font, so that no font file is needed.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "traceur/render/image.h"

namespace traceur::render {

/// The printable ASCII characters, smooth at any height; anything else is drawn as "?", one for
/// each UTF-8 character. Immutable after construction (50 ms), so threads may share it.
class Font {
 public:
  /// @throws SystemError when there is no off-screen context
  Font();

  /// Width of a line of text whose cells (ascent and descent) are `height` high [px].
  int width(std::string_view text, int height) const;
  /// Draws a line of text with the top left corner of its first cell at (x, y).
  /// @return the x after the last cell
  int draw(Image& image, int x, int y, int height, std::string_view text, Color color = kInk) const;

 private:
  static constexpr int kFirst = 32;
  static constexpr int kCount = 95;
  struct Glyph {
    int width = 0;                    ///< [px]
    std::vector<std::uint8_t> cover;  ///< (width·height_): 0 or 1, rows from the top
  };
  const Glyph& glyph(char c) const;

  int height_ = 0;  ///< of the stored glyphs [px]
  std::array<Glyph, kCount> glyphs_;
};

}  // namespace traceur::render
