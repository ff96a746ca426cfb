#include "traceur/render/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/printable.h"
#include "traceur/core/process.h"
#include "traceur/render/whole_file.h"

namespace traceur::render {
namespace {

// Okabe and Ito's colours without the yellow, which is lost on white.
constexpr std::array kPalette = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                 "#E69F00", "#56B4E9", "#333333"};
constexpr const char* kGreyColor = "#8A8A8A";
constexpr int kCrowded = 4;  // more labels than this go beside the panel [ours]

// Sizes in pixels [ours].
constexpr double kLeft = 80;
constexpr double kRight = 18;
constexpr double kTicks = 26;   // numbers under a panel
constexpr double kXLabel = 22;  // a label under them
constexpr double kTop = 12;
constexpr double kTitleRow = 22;  // a panel's title and legend
constexpr double kMarkRow = 15;   // labels of marks
constexpr double kHeading = 34;   // the figure's title
constexpr double kLetter = 7.2;   // mean width of a letter
constexpr double kLegendSample = 48;
constexpr double kTickDistance = 25;
constexpr double kScale = 62;  // the scale of colours beside squares

/// A gnuplot string: in one line, and nothing in single quotes means anything but the quote itself.
std::string verbatim(std::string_view text) {
  std::string q = "'";
  for (const char c : printable(text)) {
    if (c == '\'') q += '\'';
    q += c;
  }
  return q + "'";
}

std::string number(double x) {
  return std::isfinite(x) ? fmt::format("{:.10g}", x) : "NaN";
}

/// Characters of UTF-8 text.
size_t letters(std::string_view text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
}

void check(const Figure& figure) {
  if (figure.panels.empty()) throw InputError("a figure without panels");
  if (figure.columns < 1 || figure.width < 100 || figure.width > 8000 ||
      figure.panel_height < 100 || figure.panel_height > 4000) {
    throw InputError(fmt::format(
        "figure: columns {}, width {}, panel_height {}: expected at least 1, in [100, 8000], in "
        "[100, 4000]",
        figure.columns, figure.width, figure.panel_height));
  }
  for (const Panel& p : figure.panels) {
    for (const Series& s : p.series) {
      if (s.y.size() != s.x.size() || s.low.size() != s.high.size() ||
          (!s.low.empty() && s.low.size() != s.x.size())) {
        throw InputError(fmt::format(
            "figure: series \"{}\" has {} x, {} y, {} low and {} high; expected as many", s.label,
            s.x.size(), s.y.size(), s.low.size(), s.high.size()));
      }
      const size_t arrows = s.style == Style::kArrows ? s.x.size() : 0;
      const size_t squares = s.style == Style::kSquares ? s.x.size() : 0;
      if (s.dx.size() != arrows || s.dy.size() != arrows || s.share.size() != squares ||
          (squares > 0 && !(s.side > 0))) {
        throw InputError(fmt::format(
            "figure: series \"{}\" of {} x has {} dx, {} dy, {} shares and a side of {}; arrows "
            "need as many dx and dy, squares as many shares and a side",
            s.label, s.x.size(), s.dx.size(), s.dy.size(), s.share.size(), s.side));
      }
    }
  }
}

/// The range of what a panel shows; empty (low > high) when that is nothing.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  void include(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  bool empty() const { return low > high; }
};

/// 1, 2 or 5 times a power of ten, at least `least`.
double niceStep(double least) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

/// Writes one figure in gnuplot's language. Layout is ours, in pixels from the top left: gnuplot's
/// own would leave panels with longer numbers narrower than their neighbours.
class Script {
 public:
  Script(const Figure& figure, bool svg) : figure_(figure), svg_(svg) {}

  std::string make(const std::filesystem::path& output) {
    const int n = static_cast<int>(figure_.panels.size());
    columns_ = std::min(figure_.columns, n);
    const int rows = (n + columns_ - 1) / columns_;
    shares_x_ = std::all_of(figure_.panels.begin(), figure_.panels.end(),
                            [&](const Panel& p) { return p.xlabel == figure_.panels[0].xlabel; });
    for (const Panel& p : figure_.panels) measure(p);
    heading_ = figure_.title.empty() ? 0 : kHeading;
    height_ = heading_ + rows * figure_.panel_height + (shares_x_ ? kXLabel : 0);

    line("set terminal {} size {},{:.0f} font 'DejaVu Sans,{}' background '#ffffff'",
         svg_ ? "svg" : "pngcairo", figure_.width, height_, fontSize(12));
    line("set output {}", verbatim(output.string()));
    line("set encoding utf8");
    line("set multiplot");
    line("set border 3 linecolor rgb '#555555' linewidth 1");
    line("set tics nomirror out scale 0.5 textcolor rgb '#333333'");
    line("set grid xtics ytics linetype 1 linewidth 0.7 linecolor rgb '#E4E4E4'");
    line("set key noenhanced samplen 2.2 spacing 1.15 textcolor rgb '#262626' nobox");
    for (int i = 0; i < n; ++i) panel(i);
    line("unset multiplot");
    line("set output");  // closes the file
    return std::move(script_);
  }

 private:
  template <class... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(script_), format, std::forward<Args>(args)...);
    script_ += '\n';
  }

  // pngcairo's points are 4/3 pixels, the SVG terminal's one.
  double fontSize(double pixels) const { return svg_ ? pixels : 0.75 * pixels; }
  std::string x(double pixels) const {
    return fmt::format("screen {:.5f}", pixels / figure_.width);
  }
  std::string y(double pixels) const { return fmt::format("screen {:.5f}", 1 - pixels / height_); }

  void label(const std::string& text, const std::string& where, double pixels,
             const char* color = "#262626") {
    line("set label {} {} at {} noenhanced font ',{}' textcolor rgb '{}'", ++labels_,
         verbatim(text), where, fontSize(pixels), color);
  }

  static bool crowded(const Panel& p) { return labelled(p) > kCrowded; }
  static bool hasSquares(const Panel& p) {
    return std::any_of(p.series.begin(), p.series.end(),
                       [](const Series& s) { return s.style == Style::kSquares; });
  }
  static std::ptrdiff_t labelled(const Panel& p) {
    return std::count_if(p.series.begin(), p.series.end(),
                         [](const Series& s) { return !s.label.empty(); });
  }

  /// Room that all panels need alike, so that their axes stand under one another.
  void measure(const Panel& p) {
    if (!p.title.empty() || (labelled(p) > 0 && !crowded(p))) title_row_ = kTitleRow;
    for (const Mark& m : p.marks) {
      if (!m.label.empty()) mark_row_ = kMarkRow;
    }
    if (hasSquares(p)) legend_ = std::max(legend_, kScale);
    if (!crowded(p)) return;
    for (const Series& s : p.series) {
      legend_ = std::max(
          legend_, kLegendSample + kLetter * static_cast<double>(letters(printable(s.label))));
    }
  }

  void panel(int index) {
    const Panel& p = figure_.panels[index];
    const double cell = double(figure_.width) / columns_;
    const double left = index % columns_ * cell + kLeft;
    const int row = index / columns_;
    const double top = heading_ + row * figure_.panel_height + kTop;
    const double frame = top + title_row_ + mark_row_;
    width_ = std::max(cell - kLeft - kRight - legend_, 40.0);
    const double bottom =
        heading_ + (row + 1) * figure_.panel_height - kTicks - (shares_x_ ? 0 : kXLabel);
    const double plot_height = std::max(bottom - frame, 30.0);

    line("unset arrow");
    while (labels_ > 0) line("unset label {}", labels_--);
    line("set lmargin at {}", x(left));
    line("set rmargin at {}", x(left + width_));
    line("set tmargin at {}", y(frame));
    line("set bmargin at {}", y(frame + plot_height));
    if (index == 0 && heading_ > 0) {
      label(figure_.title, x(figure_.width / 2.0) + ", " + y(kHeading * 0.55) + " center", 15);
    }
    if (!p.title.empty()) label(p.title, x(left) + ", " + y(top + 0.4 * title_row_) + " left", 12);
    const bool lowest = index + columns_ >= static_cast<int>(figure_.panels.size());
    if (lowest || !shares_x_) {
      label(
          p.xlabel,
          x(left + width_ / 2) + ", " + y(frame + plot_height + kTicks + 0.5 * kXLabel) + " center",
          12);
    }
    label(p.ylabel, x(left - kLeft + 14) + ", " + y(frame + plot_height / 2) + " center rotate",
          12);
    axes(p, plot_height);
    marks(p);
    if (hasSquares(p)) {
      line("set palette defined (0 '#FFFFFF', 1 '{}')", kPalette[0]);
      line("set cbrange [0:1]");
      line("set cbtics 0.25 textcolor rgb '#333333'");
      line("set colorbox user origin {}, {} size screen {:.5f}, screen {:.5f}",
           x(left + width_ + 12), y(frame + plot_height), 12.0 / figure_.width,
           plot_height / height_);
    }
    if (crowded(p)) {
      line("set key at {}, {} left top vertical Left reverse", x(left + width_ + 6), y(frame));
    } else {
      line("set key at {}, {} right center horizontal Left reverse", x(left + width_),
           y(top + 0.4 * title_row_));
    }
    plot(p, index);
  }

  void axes(const Panel& p, double plot_height) {
    Range x;
    Range y;
    Range positive;
    bool counts = true;
    for (const Series& s : p.series) {
      for (size_t i = 0; i < s.x.size(); ++i) {
        if (std::isfinite(s.x[i])) x.include(s.x[i]);
        counts = counts && s.x[i] == std::round(s.x[i]);
        if (s.style == Style::kArrows && std::isfinite(s.dx[i]) && std::isfinite(s.dy[i])) {
          x.include(s.x[i] + s.dx[i]);
          y.include(s.y[i] + s.dy[i]);
        }
        if (s.style == Style::kSquares) {
          for (const double half : {-0.5 * s.side, 0.5 * s.side}) {
            x.include(s.x[i] + half);
            y.include(s.y[i] + half);
          }
        }
        for (const std::vector<double>* v : {&s.y, &s.low, &s.high}) {
          if (v->empty() || !std::isfinite((*v)[i])) continue;
          y.include((*v)[i]);
          if ((*v)[i] > 0) positive.include((*v)[i]);
        }
      }
    }
    log_ = p.log_y && !positive.empty();
    if (log_) y = positive;
    empty_ = x.empty() || y.empty();
    if (empty_) {
      x = {0, 1};
      y = {0, 1};
    }
    for (const Mark& m : p.marks) {
      if (std::isfinite(m.x)) x.include(m.x);
    }
    if (x.low == x.high) x = {x.low - 0.5, x.high + 0.5};
    if (log_) {
      y = {y.low / 1.3, y.high * 1.3};
    } else {
      const double lacking = std::max(0.0, p.least_span - (y.high - y.low)) / 2;
      double room = hasSquares(p) ? 0 : lacking + 0.06 * (y.high - y.low + 2 * lacking);
      if (room == 0 && !hasSquares(p)) room = y.low == 0 ? 1 : 0.1 * std::abs(y.low);
      y = {y.low - room, y.high + room};
    }
    x_ = x;
    line("unset logscale y");
    line("set xrange [{}:{}]", number(x.low), number(x.high));
    line("set yrange [{}:{}]", number(y.low), number(y.high));
    if (log_) {
      line("set logscale y");
      const double decades = std::log10(y.high / y.low);
      // Fewer than two powers of ten to show: write the numbers out.
      line("set format y {}", decades < 2 ? "'%g'" : "'10^{%T}'");
      line("set ytics autofreq");
    } else {
      line("set format y '%g'");
      line("set ytics {}", number(niceStep((y.high - y.low) * kTickDistance / plot_height)));
    }
    line("set format x '%g'");
    // Counts have no fractions.
    const bool few = counts && x.high - x.low <= 12;
    line("set xtics {}", few ? "1" : "autofreq");
  }

  void marks(const Panel& p) {
    double free = -1e300;  // from here on there is room for a label [px]
    for (const Mark& m : p.marks) {
      if (!std::isfinite(m.x)) continue;
      line(
          "set arrow from first {0}, graph 0 to first {0}, graph 1 nohead back linecolor rgb "
          "'#B8B8B8' linewidth 1 dashtype (6,4)",
          number(m.x));
      if (m.label.empty()) continue;
      // A label that would run into the one before is left out; its line stays.
      const double at = (m.x - x_.low) / (x_.high - x_.low) * width_;
      const double end = at + 0.85 * kLetter * static_cast<double>(letters(printable(m.label)));
      if (at < free || end > width_ + kRight) continue;
      free = end + 0.5 * kLetter;
      label(m.label, "first " + number(m.x) + ", graph 1 left offset 0,0.5", 11, "#666666");
    }
  }

  void plot(const Panel& p, int index) {
    std::string curves;
    std::string bands;
    int next_color = 0;
    for (size_t k = 0; k < p.series.size(); ++k) {
      const Series& s = p.series[k];
      const int chosen = s.color >= 0 ? s.color : next_color++;
      const char* color = s.color == kGrey ? kGreyColor : kPalette[chosen % kPalette.size()];
      if (s.color == kGrey) --next_color;
      if (s.x.empty()) continue;
      const std::string data = fmt::format("$d{}_{}", index, k);
      line("{} << EOD", data);
      for (size_t i = 0; i < s.x.size(); ++i) {
        const auto value = [&](const std::vector<double>& v) {
          return v.empty() || (log_ && !(v[i] > 0)) ? std::string("NaN") : number(v[i]);
        };
        line("{} {} {} {}{}", number(s.x[i]), value(s.y), value(s.low), value(s.high),
             s.style == Style::kArrows ? fmt::format(" {} {}", number(s.dx[i]), number(s.dy[i]))
             : s.style == Style::kSquares
                 ? fmt::format(" {} {}", number(s.side / 2), number(s.share[i]))
                 : "");
      }
      line("EOD");
      if (!s.low.empty()) {
        bands += fmt::format(
            "{} using 1:3:4 with filledcurves notitle fillcolor rgb '{}' fillstyle transparent "
            "solid 0.18 noborder, ",
            data, color);
      }
      // A colour used twice differs in its dashes.
      const bool dashed =
          s.style == Style::kDashed || (s.color < 0 && chosen >= static_cast<int>(kPalette.size()));
      std::string style;
      switch (s.style) {
        case Style::kLine:
        case Style::kDashed:
          style = fmt::format("lines linewidth 1.8 dashtype {}", dashed ? "(8,5)" : "1");
          break;
        case Style::kStep:
          style = fmt::format("steps linewidth 1.8 dashtype {}", dashed ? "(8,5)" : "1");
          break;
        case Style::kPoints:
          style = "points pointtype 7 pointsize 0.35";
          break;
        case Style::kCrosses:
          style = "points pointtype 2 pointsize 0.6";
          break;
        case Style::kArrows:
          style = "vectors head size screen 0.008,18,60 filled linewidth 1.3";
          break;
        case Style::kSquares:
          curves += fmt::format(
              "{} using 1:2:5:5:6 with boxxyerror fillstyle solid noborder linecolor palette {}, ",
              data, s.label.empty() ? "notitle" : "title " + verbatim(s.label));
          continue;
      }
      curves += fmt::format("{} using {} with {} linecolor rgb '{}' {}, ", data,
                            s.style == Style::kArrows ? "1:2:5:6" : "1:2", style, color,
                            s.label.empty() ? "notitle" : "title " + verbatim(s.label));
    }
    if (empty_) {
      label("no data", "graph 0.5, graph 0.5 center", 12, "#888888");
      curves = bands = "";
    }
    if (curves.empty()) curves = "NaN notitle, ";
    std::string all = bands + curves;
    all.resize(all.size() - 2);
    line("plot {}", all);
  }

  const Figure& figure_;
  bool svg_;
  std::string script_;
  int columns_ = 1;
  bool shares_x_ = false;
  double height_ = 0;     // of the whole figure [px]
  double heading_ = 0;    // [px]
  double title_row_ = 0;  // [px]
  double mark_row_ = 0;   // [px]
  double legend_ = 0;     // width of the column beside the panels [px]
  // Of the panel being written:
  double width_ = 0;  // of its plot [px]
  int labels_ = 0;
  bool log_ = false;
  bool empty_ = false;
  Range x_;
};

}  // namespace

void requireFigureName(const std::filesystem::path& path) {
  const std::string ending = path.extension();
  if (ending != ".png" && ending != ".svg") {
    throw InputError(fmt::format("{}: a figure's file ends in .png or .svg", path.string()));
  }
}

void writeFigure(const Figure& figure, const std::filesystem::path& path) {
  check(figure);
  requireFigureName(path);
  PendingFile file(path);
  // A personal start-up file, or GNUTERM, must not change our figures. And gnuplot runs what a name
  // says that begins with "|": it never gets to see the person's.
  Process gnuplot({"gnuplot", "--default-settings"}, Process::Output::kDropped, "GNU");
  const bool svg = path.extension() == ".svg";
  gnuplot.write(Script(figure, svg).make(file.plainName()));
  const std::string said = gnuplot.finish();
  if (std::filesystem::file_size(file.beside()) == 0) {
    throw SystemError(fmt::format("cannot write {}: gnuplot drew nothing{}{}", path.string(),
                                  said.empty() ? "" : ": ", said));
  }
  // On a full disk gnuplot says that it succeeded.
  if (svg ? !isWholeSvg(file.beside()) : !isWholePng(file.beside())) {
    throw SystemError(fmt::format("cannot write {}: it was cut short: is the disk full?{}{}",
                                  path.string(), said.empty() ? "" : " ", said));
  }
  file.commit();
}

}  // namespace traceur::render
