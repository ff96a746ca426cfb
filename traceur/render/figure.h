// Figures for papers and screens: what to draw is data, gnuplot draws it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace traceur::render {

enum class Style {
  kLine,
  kDashed,
  kStep,    ///< constant until the next point
  kPoints,  ///< dots
  kCrosses,
  kArrows,  ///< from (x, y) to (x + dx, y + dy)
  kSquares  ///< filled, about (x, y), from white for a share of 0 to the palette's blue for 1
};

struct Series {
  std::string label;      ///< in the legend; "" for none
  std::vector<double> x;  ///< in the unit of Panel::xlabel
  std::vector<double> y;  ///< as many, in the unit of Panel::ylabel; NaN leaves a gap
  Style style = Style::kLine;
  /// A filled band behind the line, from low to high; both empty or as many as x.
  std::vector<double> low = {};
  std::vector<double> high = {};
  /// Index in the palette, which colour-blind people can tell apart; -1: the next one; kGrey.
  int color = -1;
  std::vector<double> dx = {}, dy = {};  ///< of kArrows, as many as x
  std::vector<double> share = {};        ///< of kSquares, 0 to 1, as many as x
  double side = 0;                       ///< of kSquares, in the unit of both axes
};

inline constexpr int kGrey = -2;

/// A thin vertical line across a panel.
struct Mark {
  double x = 0;       ///< in the unit of Panel::xlabel
  std::string label;  ///< at its top; "" for none
};

struct Panel {
  std::string title;
  std::string xlabel;  ///< with the unit: "time [s]"
  std::string ylabel;
  bool log_y = false;     ///< values that are not positive become gaps
  double least_span = 0;  ///< the y axis covers at least this, so that noise looks like noise
  std::vector<Series> series;
  std::vector<Mark> marks;
};

/// Panels in rows, aligned with one another; an xlabel they all share stands under the lowest only.
/// Panels of squares have a scale of their colours beside them.
/// Up to four labels make a legend in a line over the panel, more a column beside it. All text is
/// drawn as it stands, in UTF-8.
struct Figure {
  std::string title;
  std::vector<Panel> panels;
  int columns = 1;
  int width = 900;         ///< [px]
  int panel_height = 260;  ///< [px], labels of the axes included
};

/// Refuses a name that is no figure's, before what it shows is computed.
/// @throws InputError unless it ends in .png or .svg
void requireFigureName(const std::filesystem::path& path);

/// Writes a figure; the file appears whole or not at all.
/// @param path  ending in .png or .svg
/// @throws InputError for another ending, no panels, series of unequal lengths; SystemError naming
/// the path when it cannot be written, in gnuplot's words when that fails, or when it is missing
void writeFigure(const Figure& figure, const std::filesystem::path& path);

}  // namespace traceur::render
