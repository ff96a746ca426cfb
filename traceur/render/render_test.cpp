#include <gtest/gtest.h>
#include <png.h>
#include <stdlib.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <sstream>
#include <tuple>

#include "traceur/core/error.h"
#include "traceur/core/test_folder.h"
#include "traceur/render/figure.h"
#include "traceur/render/film_strip.h"
#include "traceur/render/font.h"
#include "traceur/render/image.h"
#include "traceur/render/motion.h"
#include "traceur/render/offscreen.h"
#include "traceur/render/standard_figures.h"
#include "traceur/render/video.h"
#include "traceur/render/whole_file.h"

namespace traceur::render {
namespace {

namespace fs = std::filesystem;

// A "robot" 0.4 m tall: red in front, blue behind, green on its left.
constexpr const char* kMjcf = R"(<mujoco>
  <visual>
    <headlight ambient="0.4 0.4 0.4" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
    <rgba fog="0.95 0.955 0.96 1"/>
  </visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0.95 0.955 0.96" width="64" height="384"/>
    <texture name="grid" type="2d" builtin="checker" rgb1="0.96 0.965 0.97" rgb2="0.8 0.805 0.81" width="256" height="256"/>
    <material name="ground" texture="grid" texrepeat="10 10" texuniform="true" specular="0"/>
  </asset>
  <worldbody>
    <light directional="true" pos="0 0 4" dir="-0.25 0.45 -1" diffuse="0.48 0.48 0.48"/>
    <geom name="ground" type="plane" size="5 5 0.1" material="ground"/>
    <body name="trunk" pos="0 0 0.2">
      <freejoint/>
      <geom type="box" size="0.05 0.08 0.2" pos="0.05 0 0" rgba="1 0 0 1"/>
      <geom type="box" size="0.05 0.08 0.2" pos="-0.05 0 0" rgba="0 0 1 1"/>
      <body name="l_arm" pos="0 0.1 0">
        <joint name="l_swing" axis="0 1 0"/>
        <geom type="box" size="0.03 0.02 0.1" rgba="0 1 0 1"/>
      </body>
      <body name="r_arm" pos="0 -0.1 0">
        <joint name="r_swing" axis="0 1 0"/>
        <geom type="box" size="0.01 0.01 0.01" rgba="0.5 0.5 0.5 1"/>
      </body>
    </body>
  </worldbody>
</mujoco>)";

constexpr double kFlightStart = 0.3;  // [s]
constexpr double kFlightEnd = 0.7;
constexpr double kLift = 0.2;  // apex above standing [m]

std::shared_ptr<const sim::Model> testModel() {
  static const auto kModel = sim::Model::fromMjcf(kMjcf);
  return kModel;
}

/// One for the tests that need nothing special: making one takes a fifth of a second.
Offscreen& testOffscreen() {
  static Offscreen offscreen(testModel());
  return offscreen;
}

/// A contact of two bodies at the origin, with this force on b.
sim::Contact touching(sim::BodyId a, sim::BodyId b, const Vector3d& force = Vector3d::Zero()) {
  return {a, b, Vector3d::Zero(), Vector3d::UnitZ(), force};
}

const Font& testFont() {
  static const Font kFont;
  return kFont;
}

/// Stands, flies a parabola forward, stands: 1 s in steps of 0.01 s.
sim::Recording jump() {
  sim::Recording r;
  r.mjcf = kMjcf;
  r.phases = {"stand", "flight", "land"};
  const auto model = testModel();
  for (int i = 0; i <= 100; ++i) {
    sim::Frame f;
    f.state = model->initialState();
    const double t = f.state.time = i * 0.01;
    const double s = std::clamp((t - kFlightStart) / (kFlightEnd - kFlightStart), 0.0, 1.0);
    f.state.q[0] = 0.5 * s;
    f.state.q[2] += 4 * kLift * s * (1 - s);
    f.state.q[model->joint("l_swing").q] = s;
    f.com = f.state.q.head<3>();
    f.com_velocity = {s > 0 && s < 1 ? 1.25 : 0, 0, 0};
    f.torque = sim::VectorXd::Zero(model->nu());
    f.phase = s <= 0 ? 0 : s < 1 ? 1 : 2;
    if (s <= 0 || s >= 1) {
      sim::Contact c;
      c.body_a = {0};
      c.body_b = model->body("trunk");
      c.p_WC = {f.state.q[0], 0, 0};
      c.normal = {0, 0, 1};
      c.f_WC = {0, 0, model->mass() * 9.81};
      f.contacts.push_back(c);
    }
    r.frames.push_back(f);
  }
  return r;
}

/// The largest difference of two pictures of one size, of 255.
int unlike(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) return 256;
  int most = 0;
  for (size_t i = 0; i < a.rgb.size(); ++i) most = std::max(most, std::abs(a.rgb[i] - b.rgb[i]));
  return most;
}

/// A folder of this test's own.
class Folder : public TestFolder {
 public:
  int files() const {
    return static_cast<int>(
        std::distance(fs::directory_iterator(path()), fs::directory_iterator()));
  }
};

/// Another PATH while it lives.
class Path {
 public:
  explicit Path(const std::string& value) : old_(getenv("PATH")) {
    setenv("PATH", value.c_str(), 1);
  }
  ~Path() { setenv("PATH", old_.c_str(), 1); }

 private:
  std::string old_;
};

/// A program that says something, reads nothing and fails.
void fakeProgram(const fs::path& file, const std::string& says) {
  std::ofstream(file) << "#!/bin/sh\necho \"" << says << "\" >&2\nexit 3\n";
  fs::permissions(file, fs::perms::owner_all);
}

template <class Error, class Call>
std::string messageOf(Call call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  ADD_FAILURE() << "nothing of the expected type was thrown";
  return "";
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Image readPng(const fs::path& path) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_file(&png, path.c_str())) << png.message;
  png.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  EXPECT_TRUE(png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr)) << png.message;
  return image;
}

std::string textOf(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

enum class Hue { kRed, kGreen, kBlue };

bool isHue(const Color& c, Hue hue) {
  const std::array<int, 3> v = {c.r, c.g, c.b};
  const auto k = static_cast<size_t>(hue);
  return v[k] > 90 && v[k] > 2 * v[(k + 1) % 3] && v[k] > 2 * v[(k + 2) % 3];
}

/// Where a hue is in a picture.
struct Patch {
  int pixels = 0;
  double x = 0;  // mean column
  double y = 0;  // mean row
  int left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};

Patch find(const Image& image, Hue hue) {
  Patch p;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!isHue(image.at(x, y), hue)) continue;
      ++p.pixels;
      p.x += x;
      p.y += y;
      p.left = std::min(p.left, x);
      p.right = std::max(p.right, x);
      p.top = std::min(p.top, y);
      p.bottom = std::max(p.bottom, y);
    }
  }
  p.x /= std::max(1, p.pixels);
  p.y /= std::max(1, p.pixels);
  return p;
}

// ---------------------------------------------------------------------------------------- images

TEST(Image, PngRoundTrip) {
  const Folder folder;
  Image image(7, 5, {1, 2, 3});
  for (int i = 0; i < 7 * 5 * 3; ++i) image.rgb[i] = static_cast<std::uint8_t>(i * 37);
  writePng(image, folder / "a.png");
  const Image back = readPng(folder / "a.png");
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.rgb, image.rgb);
  EXPECT_EQ(folder.files(), 1);
}

TEST(Image, PngToAPlaceThatCannotBeWrittenNamesIt) {
  const Folder folder;
  const Image image(4, 4);
  const std::string missing = (folder / "no/where/a.png").string();
  EXPECT_TRUE(has(messageOf<SystemError>([&] { writePng(image, missing); }), missing));
  fs::create_directory(folder / "d.png");
  const std::string message = messageOf<SystemError>([&] { writePng(image, folder / "d.png"); });
  EXPECT_TRUE(has(message, (folder / "d.png").string())) << message;
  EXPECT_TRUE(has(message, "directory")) << message;
  messageOf<SystemError>([&] { writePng(image, ""); });
  EXPECT_EQ(folder.files(), 1);  // the folder d.png alone
}

TEST(Image, TileAndPasteKeepEveryPixel) {
  std::vector<Image> pictures;
  pictures.reserve(4);
  for (int i = 0; i < 3; ++i) {
    pictures.emplace_back(2, 2, Color{static_cast<std::uint8_t>(i), 0, 0});
  }
  const Image whole = tile(pictures, 2, 1, {9, 9, 9});
  EXPECT_EQ(whole.width, 5);
  EXPECT_EQ(whole.height, 5);
  EXPECT_EQ(whole.at(0, 0), (Color{0, 0, 0}));
  EXPECT_EQ(whole.at(2, 0), (Color{9, 9, 9}));
  EXPECT_EQ(whole.at(4, 1), (Color{1, 0, 0}));
  EXPECT_EQ(whole.at(1, 4), (Color{2, 0, 0}));
  EXPECT_EQ(whole.at(4, 4), (Color{9, 9, 9}));

  Image small(3, 3);
  paste(small, Image(2, 2, {5, 5, 5}), -1, 2);
  EXPECT_EQ(small.at(0, 2), (Color{5, 5, 5}));
  EXPECT_EQ(small.at(1, 2), kWhite);
  paste(small, Image(2, 2), 7, 7);  // all outside

  EXPECT_THROW(tile({}, 1), InputError);
  EXPECT_THROW(tile(pictures, 0), InputError);
  pictures.emplace_back(3, 2);
  EXPECT_THROW(tile(pictures, 2), InputError);
}

TEST(Image, APixelHasItsColourAndNoOther) {
  Image image(4, 3, {10, 20, 30});
  ASSERT_EQ(image.rgb.size(), 3U * 4 * 3);
  image.blend(2, 1, {110, 220, 130}, 0.5);
  image.blend(0, 0, {1, 2, 3}, 1);
  image.blend(3, 2, {4, 5, 6}, 1);
  image.blend(1, 1, {7, 8, 9}, 0);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      const Color expected = x == 2 && y == 1   ? Color{60, 120, 80}
                             : x == 0 && y == 0 ? Color{1, 2, 3}
                             : x == 3 && y == 2 ? Color{4, 5, 6}
                                                : Color{10, 20, 30};
      EXPECT_EQ(image.at(x, y), expected) << x << " " << y;
    }
  }
}

TEST(Image, OutsideThePictureNothingIsDrawn) {
  Image image(4, 4, kInk);
  image.height = 3;  // the last row is now behind it
  const Image before = image;
  for (const int x : {-1, 0, 3, 4, 5}) {
    for (const int y : {-1, 0, 2, 3}) {
      if (x < 0 || x > 3 || y < 0 || y > 2) image.blend(x, y, kWhite, 1);
    }
  }
  EXPECT_EQ(image.rgb, before.rgb);
}

TEST(Image, WhatIsPastedIsThereAndCutAtTheEdges) {
  Image picture(3, 2);
  for (size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] = static_cast<std::uint8_t>(i);
  for (int y = -3; y <= 6; ++y) {
    for (int x = -4; x <= 6; ++x) {
      Image onto(5, 5, kWhite);
      onto.height = 4;  // the last row is now behind it
      paste(onto, picture, x, y);
      for (int v = 0; v < 5; ++v) {
        for (int u = 0; u < 5; ++u) {
          const bool inside = u >= x && u < x + 3 && v >= y && v < std::min(4, y + 2);
          EXPECT_EQ(onto.at(u, v), inside ? picture.at(u - x, v - y) : kWhite) << x << " " << y;
        }
      }
    }
  }
}

TEST(Image, TilesStandInRowsWithTheirGaps) {
  std::vector<Image> pictures;
  for (int n = 1; n <= 7; ++n) {
    pictures.emplace_back(2, 3, Color{static_cast<std::uint8_t>(n - 1), 7, 0});
    for (const int columns : {1, 2, 3, 4, 9}) {
      for (const int gap : {0, 2}) {
        const int most = std::min(columns, n);
        const int rows = n / most + (n % most > 0 ? 1 : 0);
        const Color between = {50, 60, 70};
        const Image whole = tile(pictures, columns, gap, between);
        ASSERT_EQ(whole.width, 2 * most + gap * (most - 1));
        ASSERT_EQ(whole.height, 3 * rows + gap * (rows - 1));
        for (int y = 0; y < whole.height; ++y) {
          for (int x = 0; x < whole.width; ++x) {
            const int i = y / (3 + gap) * most + x / (2 + gap);
            const bool inside = x % (2 + gap) < 2 && y % (3 + gap) < 3 && i < n;
            const Color expected = {static_cast<std::uint8_t>(i), 7, 0};
            EXPECT_EQ(whole.at(x, y), inside ? expected : between);
          }
        }
      }
    }
  }
  EXPECT_EQ(tile(pictures, 3).rgb, tile(pictures, 3, 0).rgb);
  pictures.back() = Image(2, 4);
  EXPECT_THROW(tile(pictures, 2), InputError);
}

/// How much of each pixel is covered by what was drawn in white on black, in sixteenths.
std::vector<int> sixteenths(const Image& image) {
  std::vector<int> all;
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    const double part = image.rgb[i] / 255.0 * 16;
    all.push_back(static_cast<int>(std::lround(part)));
    EXPECT_NEAR(part, all.back(), 0.04);
  }
  return all;
}

TEST(Image, AShapeCoversAPixelByItsShareOfIt) {
  // Edges between the samples, of which each pixel has 4 x 4.
  std::vector<Vector2d> corners = {{1.25, 2.5}, {4.75, 2.5}, {4.75, 6}, {1.25, 6}};
  for (int direction = 0; direction < 2; ++direction) {
    Image image(8, 8, {0, 0, 0});
    fillPolygon(image, corners, kWhite);
    const std::vector<int> cover = sixteenths(image);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        const double wide = std::max(0.0, std::min(x + 1.0, 4.75) - std::max(x + 0.0, 1.25));
        const double high = std::max(0.0, std::min(y + 1.0, 6.0) - std::max(y + 0.0, 2.5));
        EXPECT_EQ(cover[y * 8 + x], 16 * wide * high) << x << " " << y;
      }
    }
    std::reverse(corners.begin(), corners.end());
  }
  Image image(8, 8, {0, 0, 0});
  fillPolygon(image, {}, kWhite);
  fillPolygon(image, std::vector<Vector2d>{{1, 1}, {7, 6}}, kWhite);
  EXPECT_EQ(image.rgb, Image(8, 8, {0, 0, 0}).rgb);
  fillDisc(image, {4.125, 4.125}, 0.25, kWhite);  // the sample in the middle, and four on the rim
  std::vector<int> cover = sixteenths(image);
  EXPECT_EQ(std::accumulate(cover.begin(), cover.end(), 0), 5);
}

TEST(Image, ShapesThatShareAnEdgeCoverNothingTwice) {
  // Corners and edges on samples: a square, and its quarters about the middle.
  const std::vector<Vector2d> square = {
      {1.125, 1.125}, {6.125, 1.125}, {6.125, 6.125}, {1.125, 6.125}};
  const auto cover = [](const std::vector<Vector2d>& corners) {
    Image image(8, 8, {0, 0, 0});
    fillPolygon(image, corners, kWhite);
    return sixteenths(image);
  };
  std::vector<int> sum(64);
  for (size_t i = 0; i < 4; ++i) {
    const auto quarter = cover({square[i], square[(i + 1) % 4], {3.625, 3.625}});
    for (size_t k = 0; k < 64; ++k) sum[k] += quarter[k];
  }
  EXPECT_EQ(sum, cover(square));
  EXPECT_EQ(std::accumulate(sum.begin(), sum.end(), 0), 16 * 25);
}

TEST(Image, ShapesFarLargerThanThePictureTakeNoTime) {
  for (const bool disc : {false, true}) {
    Image image(6, 4, kWhite);
    const std::vector<Vector2d> corners = {{-1e7, -1e7}, {1e7, -1e7}, {1e7, 1e7}, {-1e7, 1e7}};
    if (disc) {
      fillDisc(image, {3, 3}, 1e7, {1, 2, 3});
    } else {
      fillPolygon(image, corners, {1, 2, 3});
    }
    EXPECT_EQ(image.rgb, Image(6, 4, {1, 2, 3}).rgb);
  }
}

TEST(Image, PolygonCoversItsArea) {
  Image image(40, 40, {0, 0, 0});
  const Vector2d corners[] = {{5, 5}, {30.5, 8}, {20, 33}};
  fillPolygon(image, corners, kWhite);
  double area = 0;
  for (const std::uint8_t v : image.rgb) area += v / 255.0 / 3;
  EXPECT_NEAR(area, std::abs(25.5 * 28 - 3 * 15) / 2, 1.5);
  fillDisc(image, {-3, -3}, 100, kWhite);  // reaches out on all sides
  EXPECT_EQ(image.at(39, 39), kWhite);
}

TEST(Font, WritesSmoothLettersInsideTheirCells) {
  const Font& font = testFont();
  Image image(200, 40);
  const int end = font.draw(image, 10, 8, 20, "0.70 s  thrust");
  EXPECT_EQ(end - 10, font.width("0.70 s  thrust", 20));
  int grey = 0;
  int ink = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int v = image.at(x, y).r;
      if (v == 255) continue;
      EXPECT_TRUE(x >= 10 && x < end && y >= 8 && y < 28);
      ++(v < 60 ? ink : grey);
    }
  }
  EXPECT_GT(ink, 50);
  EXPECT_GT(grey, 50);  // smooth edges
  EXPECT_LT(ink + grey, (end - 10) * 20 / 2);
  EXPECT_LT(font.width("i", 20), font.width("M", 20));
  EXPECT_EQ(font.width("ü", 20), font.width("?", 20));
  font.draw(image, -20, 35, 30, "cut off on every side, and much longer than the picture is wide");
}

/// A text alone, in black, as wide and high as it is.
Image written(const Font& font, std::string_view text, int height) {
  Image image(font.width(text, height), height);
  EXPECT_EQ(font.draw(image, 0, 0, height, text, {0, 0, 0}), image.width);
  return image;
}

TEST(Font, AHeightIsAScale) {
  const Font& font = testFont();
  // The height at which it is stored is the lowest without grey.
  const auto is_pure = [&](int height) {
    const Image image = written(font, "Wg&8", height);
    return std::all_of(image.rgb.begin(), image.rgb.end(), [](int v) { return v % 255 == 0; });
  };
  int stored = 10;
  while (stored < 200 && !is_pure(stored)) ++stored;
  ASSERT_LT(stored, 200);
  for (char c = '!'; c <= '~'; ++c) {
    SCOPED_TRACE(c);
    const std::string text(1, c);
    const Image one = written(font, text, stored);
    const auto ink = [&](int x, int y) { return x < one.width && one.at(x, y).r == 0 ? 1 : 0; };
    const Image twice = written(font, text, 2 * stored);
    ASSERT_EQ(twice.width, 2 * (one.width - 1) + 1);
    for (int y = 0; y < twice.height; ++y) {
      for (int x = 0; x < twice.width; ++x) EXPECT_EQ(twice.at(x, y).r == 0, ink(x / 2, y / 2));
    }
    const int part = stored % 2 == 0 ? 2 : 3;
    ASSERT_EQ(stored % part, 0);
    const Image small = written(font, text, stored / part);
    for (int y = 0; y < small.height; ++y) {
      for (int x = 0; x < small.width; ++x) {
        double sum = 0;
        for (int v = 0; v < part; ++v) {
          for (int u = 0; u < part; ++u) sum += ink(part * x + u, part * y + v);
        }
        EXPECT_NEAR(small.at(x, y).r, 255 * (1 - sum / (part * part)), 1);
      }
    }
  }
  EXPECT_EQ(font.width("Wi", stored), font.width("W", stored) + font.width("i", stored) - 1);
  EXPECT_EQ(font.width("", stored), 1);
}

TEST(Font, LettersStandUprightAndTheUnknownIsAQuestion) {
  const Font& font = testFont();
  const auto middle = [&](const char* text) {  // of the ink, in parts of the cell
    const Image image = written(font, text, 24);
    Vector2d sum(0, 0);
    double weight = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const double ink = 255 - image.at(x, y).r;
        weight += ink;
        sum += ink * Vector2d((x + 0.5) / image.width, (y + 0.5) / image.height);
      }
    }
    EXPECT_GT(weight, 0) << text;
    return Vector2d(sum / weight);
  };
  EXPECT_GT(middle("_").y(), 0.7);
  EXPECT_LT(middle("'").y(), 0.45);
  EXPECT_GT(middle("L").y(), middle("F").y() + 0.05);
  EXPECT_LT(middle("L").x(), middle("J").x() - 0.1);
  EXPECT_LT(middle("[").x(), middle("]").x() - 0.05);
  EXPECT_EQ(written(font, " ", 24).rgb, Image(font.width(" ", 24), 24).rgb);
  const Image unknown = written(font, "?", 24);
  EXPECT_NE(written(font, "~", 24).rgb, unknown.rgb);
  for (const char* text : {"\x7f", "\x1f", "é", "ü", "→", "🤖"}) {
    EXPECT_EQ(written(font, text, 24).rgb, unknown.rgb) << text;
  }
}

TEST(Font, WhatIsOutsideThePictureIsCut) {
  const Font& font = testFont();
  Image whole(160, 60, kWhite);
  font.draw(whole, 20, 10, 23, "Wagen &8", {200, 0, 0});
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(30, 14), std::pair(45, 28)}) {
    Image part(50, 20);
    font.draw(part, 20 - x, 10 - y, 23, "Wagen &8", {200, 0, 0});
    Image expected(50, 20);
    paste(expected, whole, -x, -y);
    EXPECT_EQ(part.rgb, expected.rgb) << x;
    EXPECT_NE(part.rgb, Image(50, 20).rgb);
  }
}

// ------------------------------------------------------------------------------------- off-screen

TEST(Offscreen, RedBoxIsRedInTheMiddleOnAPaleGround) {
  Offscreen& offscreen = testOffscreen();
  sim::Frame frame;
  frame.state = testModel()->initialState();
  const Image image = offscreen.draw(frame, {.view = View::kFront});
  EXPECT_EQ(image.width, 320);
  EXPECT_EQ(image.height, 240);
  EXPECT_TRUE(isHue(image.at(160, 120), Hue::kRed));
  // The sky is pale, the ground has squares of two shades.
  EXPECT_GT(image.at(5, 5).g, 220);
  int lightest = 0;
  int darkest = 255;
  for (int x = 0; x < 320; ++x) {
    lightest = std::max<int>(lightest, image.at(x, 225).g);
    darkest = std::min<int>(darkest, image.at(x, 225).g);
  }
  EXPECT_GT(darkest, 120);
  EXPECT_GT(lightest - darkest, 15);
  // The plane's size in the model ends neither the ground nor the light.
  EXPECT_LT(image.at(5, 180).g, image.at(5, 5).g);
}

TEST(Offscreen, ViewsShowWhatTheyPromise) {
  Offscreen& offscreen = testOffscreen();
  sim::Frame frame;
  frame.state = testModel()->initialState();
  const Image side = offscreen.draw(frame, {.view = View::kSide});
  EXPECT_GT(find(side, Hue::kRed).x, find(side, Hue::kBlue).x + 10);
  const Image front = offscreen.draw(frame, {.view = View::kFront});
  EXPECT_GT(find(front, Hue::kGreen).x, find(front, Hue::kRed).x + 10);
  const Image between = offscreen.draw(frame, {.view = View::kThreeQuarter});
  EXPECT_GT(find(between, Hue::kRed).x, find(between, Hue::kBlue).x + 10);
  for (const Image* image : {&side, &front, &between}) {
    const Patch red = find(*image, Hue::kRed);
    EXPECT_GT(red.pixels, 1000);
    EXPECT_GT(red.top, 4);
    EXPECT_LT(red.bottom, 236);
    EXPECT_GT(red.bottom - red.top, 120);  // and not lost in the distance
  }
}

TEST(Offscreen, EqualFramesGiveEqualPicturesAndQualitiesAgree) {
  sim::Frame frame;
  frame.state = testModel()->initialState();
  Offscreen fine(testModel(), {.width = 160, .height = 120});
  const Image a = fine.draw(frame);
  Offscreen fast(testModel(), {.width = 160, .height = 120, .quality = Quality::kFast});
  const Image b = fast.draw(frame);
  EXPECT_EQ(a.rgb, fine.draw(frame).rgb);  // while two contexts live
  double difference = 0;
  for (size_t i = 0; i < a.rgb.size(); ++i) difference += std::abs(a.rgb[i] - b.rgb[i]);
  EXPECT_LT(difference / double(a.rgb.size()), 3);
}

TEST(Offscreen, ForcesAndCentreOfMassAreDrawnWhenAsked) {
  const sim::Recording r = jump();
  Offscreen& offscreen = testOffscreen();
  const Camera camera = {.view = View::kFront};
  const Image plain = offscreen.draw(r.frames[0], camera);
  const Image forces = offscreen.draw(r.frames[0], camera, {.contact_forces = true});
  const Image com = offscreen.draw(r.frames[0], camera, {.com = true});
  EXPECT_NE(plain.rgb, forces.rgb);
  EXPECT_NE(plain.rgb, com.rgb);
  // A disc in quarters: within its dark rim as much is light as dark.
  int light = 0;
  int dark = 0;
  int left = 320, right = 0, above = 240, below = 0;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (plain.at(x, y) == com.at(x, y)) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      above = std::min(above, y);
      below = std::max(below, y);
    }
  }
  const int half = (right - left) / 4;  // of a square within the disc
  for (int y = (above + below) / 2 - half; y <= (above + below) / 2 + half; ++y) {
    for (int x = (left + right) / 2 - half; x <= (left + right) / 2 + half; ++x) {
      ++(com.at(x, y).r > 128 ? light : dark);
    }
  }
  EXPECT_GT(right - left, 6);
  EXPECT_NEAR(light, dark, 0.35 * (light + dark));
  // The weight's arrow points up from the sole by kArrowPerWeight of the robot's size.
  EXPECT_NEAR(offscreen.robotSize(), 0.4, 1e-6);
  int top = 240;
  int bottom = 0;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (plain.at(x, y) == forces.at(x, y)) continue;
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  }
  const Patch red = find(plain, Hue::kRed);
  const double part = double(bottom - top) / (red.bottom - red.top);
  EXPECT_NEAR(part, kArrowPerWeight, 0.12);
  EXPECT_NEAR(bottom, red.bottom, 16);  // which is nearer to the viewer
  // In flight there is nothing to draw.
  EXPECT_EQ(offscreen.draw(r.frames[50], camera).rgb,
            offscreen.draw(r.frames[50], camera, {.contact_forces = true}).rgb);
}

/// A camera's directions to the right, up and forward, from its azimuth and elevation [deg].
struct Eye {
  double azimuth;
  double elevation;
  std::array<Vector3d, 3> axes() const {
    const double degree = std::numbers::pi / 180;
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(azimuth * degree, Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(-elevation * degree, Vector3d::UnitY()))
                                     .toRotationMatrix();
    return {-turn.col(1), turn.col(2), turn.col(0)};
  }
};

/// The views as camera.h describes them; their small angles are ours.
const std::pair<View, Eye> kEyes[] = {
    {View::kSide, {90, -8}}, {View::kThreeQuarter, {130, -14}}, {View::kFront, {180, -10}}};

/// Half the picture's height over its distance: of 30 degrees from edge to edge.
const double kSlope = std::tan(15 * std::numbers::pi / 180);

TEST(Offscreen, AShapeOfAnyKindFillsThePictureAndStaysInIt) {
  // Each with the farthest of its points in a direction n of its own axes.
  const auto box = [](double x, double y, double z) {
    return [=](const Vector3d& n) {
      return Vector3d(std::copysign(x, n.x()), std::copysign(y, n.y()), std::copysign(z, n.z()));
    };
  };
  const auto round = [](double r, double h, bool flat) {
    return [=](const Vector3d& n) {
      const Vector3d out = flat ? Vector3d(n.x(), n.y(), 0).normalized() : n;
      return Vector3d(r * out + std::copysign(h, n.z()) * Vector3d::UnitZ());
    };
  };
  const auto ellipsoid = [](const Vector3d& n) {
    const Vector3d axes(0.1, 0.2, 0.3);
    return Vector3d(axes.cwiseProduct(axes.cwiseProduct(n).normalized()));
  };
  const std::pair<const char*, std::function<Vector3d(const Vector3d&)>> shapes[] = {
      {"type='sphere' size='.3'", round(0.3, 0, false)},
      {"type='box' size='.1 .2 .3'", box(0.1, 0.2, 0.3)},
      {"type='box' size='.3 .05 .1'", box(0.3, 0.05, 0.1)},
      {"type='capsule' size='.1 .3'", round(0.1, 0.3, false)},
      {"type='cylinder' size='.1 .3'", round(0.1, 0.3, true)},
      {"type='cylinder' size='.3 .1'", round(0.3, 0.1, true)},
      {"type='ellipsoid' size='.1 .2 .3'", ellipsoid}};
  for (const auto& [shape, farthest] : shapes) {
    SCOPED_TRACE(shape);
    const auto model = sim::Model::fromMjcf(
        "<mujoco><visual><headlight ambient='1 1 1' diffuse='0 0 0'/></visual><worldbody>"
        "<body pos='0 0 1'><freejoint/><geom rgba='1 0 0 1' euler='30 20 40' " +
        std::string(shape) + "/></body></worldbody></mujoco>");
    Offscreen offscreen(model, {.width = 200, .height = 200, .quality = Quality::kFast});
    sim::Frame frame;
    frame.state = model->initialState();
    const double degree = std::numbers::pi / 180;
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(30 * degree, Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(20 * degree, Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(40 * degree, Vector3d::UnitZ()))
                                     .toRotationMatrix();
    const auto half = [&, &point = farthest](const Vector3d& d) {  // its extent along d
      return d.dot(turn * point(turn.transpose() * d));
    };
    const double size =
        2 * std::max({half(Vector3d::UnitX()), half(Vector3d::UnitY()), half(Vector3d::UnitZ())});
    EXPECT_NEAR(offscreen.robotSize(), size, 1e-9);
    for (const auto& [view, eye] : kEyes) {
      const auto [right, up, forward] = eye.axes();
      EXPECT_NEAR(offscreen.aim({&frame, 1}, {.view = view})[0].distance,
                  std::max(half(right), half(up)) / (0.8 * kSlope) + half(forward), 1e-9);
      const Patch red = find(offscreen.draw(frame, {.view = view}), Hue::kRed);
      // It fills 0.8 at the depth of its nearest point, and is widest behind that.
      const double part = std::max(red.right - red.left + 1, red.bottom - red.top + 1) / 200.0;
      EXPECT_GT(part, 0.63);
      EXPECT_LT(part, 0.8);
      // Its middle is the picture's.
      EXPECT_NEAR((red.left + red.right) / 2.0, 100, 10);
      EXPECT_NEAR((red.top + red.bottom) / 2.0, 100, 10);
    }
  }
}

/// Where a lens shows a point [px].
Vector2d seenAt(const Eye& eye, const Camera& camera, int width, int height, const Vector3d& p) {
  const auto [right, up, forward] = eye.axes();
  const Vector3d d = p - *camera.look_at;
  const double scale = height / 2.0 / kSlope / (camera.distance + forward.dot(d));
  return {width / 2.0 + scale * right.dot(d), height / 2.0 - scale * up.dot(d)};
}

/// A red ball of 10 cm that floats, lit from everywhere alike, in a grey world.
constexpr const char* kBall = R"(<mujoco><visual>
  <headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
  <worldbody><body name="ball" pos="0 0 1"><freejoint/><geom size="0.05" rgba="1 0 0 1"/></body>
  </worldbody></mujoco>)";

/// The middle of what differs between two pictures, and the least box around it [px].
struct Difference {
  Vector2d middle = {0, 0};
  int pixels = 0;
  int left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};

Difference between(const Image& a, const Image& b) {
  Difference d;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      if (a.at(x, y) == b.at(x, y)) continue;
      ++d.pixels;
      d.middle += Vector2d(x + 0.5, y + 0.5);
      d.left = std::min(d.left, x);
      d.right = std::max(d.right, x);
      d.top = std::min(d.top, y);
      d.bottom = std::max(d.bottom, y);
    }
  }
  d.middle /= std::max(1, d.pixels);
  return d;
}

TEST(Offscreen, APointIsSeenWhereTheLensPutsIt) {
  const auto model = sim::Model::fromMjcf(kBall);
  Offscreen fast(model, {.width = 340, .height = 300, .quality = Quality::kFast});
  Offscreen fine(model, {.width = 90, .height = 110});
  sim::Frame frame;
  frame.state = model->initialState();
  const Vector3d look_at(0.3, -0.2, 0.9);
  for (const auto& [view, eye] : kEyes) {
    const Camera camera = {.view = view, .look_at = look_at, .distance = 2};
    for (const Vector3d& d : {Vector3d(0.3, 0.25, 0.2), Vector3d(-0.35, -0.2, -0.1)}) {
      frame.state.q.head<3>() = look_at + d;
      const Image image = fast.draw(frame, camera);
      const Patch ball = find(image, Hue::kRed);
      const Vector2d expected = seenAt(eye, camera, 340, 300, look_at + d);
      EXPECT_LT((Vector2d(ball.x + 0.5, ball.y + 0.5) - expected).norm(), 0.5);
      // The mark of its centre of mass is in its middle.
      const Image marked = fast.draw(frame, camera, {.com = true});
      EXPECT_LT((between(image, marked).middle - expected).norm(), 0.3);
    }
    // Moving the raster by parts of a pixel, as fine pictures do, moves nothing in the mean.
    frame.state.q.head<3>() = look_at + Vector3d(0.05, 0.1, 0.1);
    const Image image = fine.draw(frame, camera);
    const Patch ball = find(image, Hue::kRed);
    const Vector2d expected = seenAt(eye, camera, 90, 110, frame.state.q.head<3>());
    EXPECT_LT((Vector2d(ball.x + 0.5, ball.y + 0.5) - expected).norm(), 0.2);
    // Of one colour it stays that: the mean of equals.
    const auto x = static_cast<int>(expected.x());
    const auto y = static_cast<int>(expected.y());
    EXPECT_EQ(image.at(x, y), (Color{255, 0, 0}));
    // Its edge is smooth.
    EXPECT_GT(std::set<int>(image.rgb.begin(), image.rgb.end()).size(), 6U);
  }
}

TEST(Offscreen, TheCameraIsAsNearAsShowsTheWholeBall) {
  // 0.8 of the picture's shorter side at the depth of the ball's nearest point.
  const auto model = sim::Model::fromMjcf(kBall);
  sim::Frame frame;
  frame.state = model->initialState();
  frame.state.q.head<3>() << 3, 4, 5;
  for (const auto& [width, height] : {std::pair(32, 64), std::pair(64, 32)}) {
    Offscreen offscreen(model, {.width = width, .height = height, .quality = Quality::kFast});
    EXPECT_NEAR(offscreen.robotSize(), 0.1, 1e-9);
    for (const auto& [view, eye] : kEyes) {
      const Camera camera = offscreen.aim({&frame, 1}, {.view = view})[0];
      EXPECT_LT((*camera.look_at - Vector3d(3, 4, 5)).norm(), 1e-9);
      const double narrowest = std::min(1.0, double(width) / height);
      EXPECT_NEAR(camera.distance, 0.05 / (0.8 * kSlope * narrowest) + 0.05, 1e-9);
    }
  }
}

TEST(Offscreen, AFollowingCameraSmoothsByAGaussian) {
  Offscreen& offscreen = testOffscreen();
  const auto at = [](double time, const Vector3d& p) {
    sim::Frame f;
    f.state = testModel()->initialState();
    f.state.time = time;
    f.state.q.head<3>() += p;
    return f;
  };
  const Vector3d start = *offscreen.aim(std::vector{at(0, {0, 0, 0})}, {})[0].look_at;
  // It keeps up with a steady motion, at the ends, too, and where frames are not evenly spaced.
  std::vector<sim::Frame> steady;
  for (const double t : {0.5, 0.52, 0.6, 0.61, 0.8, 1.0, 1.05, 1.4}) {
    steady.push_back(at(t, {2 * t, -t, 0}));
  }
  const auto kept = offscreen.aim(steady, {});
  for (size_t i = 0; i < steady.size(); ++i) {
    const double t = steady[i].state.time;
    EXPECT_LT((*kept[i].look_at - start - Vector3d(2 * t, -t, 0)).norm(), 1e-9) << i;
  }
  // One frame aside moves it by that frame's share of the weights: standard deviation 0.15 s, or
  // the time in which the fastest motion covers the robot's size; cut off at three of them.
  for (const double step : {0.02, 0.17}) {
    const double dt = 0.011;
    std::vector<sim::Frame> kicked;
    for (int i = 0; i <= 200; ++i) kicked.push_back(at(dt * i, {0, i == 100 ? step : 0, 0}));
    const auto cameras = offscreen.aim(kicked, {});
    // The test model weighs evenly, so its centre of mass goes with it.
    const double sigma = std::min(0.15, 0.4 / (step / dt));
    double sum = 0;
    for (int i = -100; i <= 100; ++i) {
      if (std::abs(dt * i) <= 3 * sigma) sum += std::exp(-std::pow(dt * i / sigma, 2) / 2);
    }
    for (const int k : {0, 1, -1, 2, -2, 7, -7, 8, -8, 40, -40, 41, -41, 55, -55}) {
      const double t = dt * k / sigma;
      const double share = std::abs(t) <= 3 ? std::exp(-t * t / 2) / sum : 0;
      EXPECT_NEAR(cameras[100 + k].look_at->y() - start.y(), step * share, 1e-9) << k;
    }
  }
  // It rises with a robot that rises by more than its size, and two frames of one time do no harm.
  for (const double rise : {0.39, 0.41}) {
    const auto up = offscreen.aim(std::vector{at(0, {0, 0, 0}), at(0.5, {0, 0, rise / 2}),
                                              at(0.5, {0, 0, rise / 2}), at(1, {0, 0, rise})},
                                  {});
    const double low = up.front().look_at->z() - start.z();
    const double high = up.back().look_at->z() - start.z();
    EXPECT_NEAR(low, rise > 0.4 ? 0 : rise / 2, 1e-6);
    EXPECT_NEAR(high, rise > 0.4 ? rise : rise / 2, 1e-6);
  }
  // Standing still it looks at the middle of all that happens.
  const auto still = offscreen.aim(
      std::vector{at(0, {0, 0, 0}), at(0.5, {2, 0, 1}), at(1, {1, -4, 0})}, {.follow = false});
  // The arms stick out by 0.12 m to the left and 0.11 m to the right.
  for (const Camera& c : still) {
    EXPECT_LT((*c.look_at - Vector3d(1, -2 + 0.005, 0.7)).norm(), 1e-9) << c.look_at->transpose();
  }
}

TEST(Offscreen, AnArrowIsAShaftWithATriangleForAHead) {
  sim::Recording r = jump();
  sim::Frame frame = r.frames[50];  // in flight: only this force
  Offscreen offscreen(testModel(), {.width = 400, .height = 400, .quality = Quality::kFast});
  const Camera camera = offscreen.aim({&frame, 1}, {.view = View::kFront})[0];
  const Image plain = offscreen.draw(frame, camera);
  sim::Contact c;
  c.body_a = {0};
  c.body_b = testModel()->body("trunk");
  c.p_WC = frame.state.q.head<3>();
  c.normal = {0, 0, 1};
  c.f_WC = {0, 0, testModel()->mass() * 9.81};
  frame.contacts = {c};
  const Image drawn = offscreen.draw(frame, camera, {.contact_forces = true});
  // Widths of the arrow, row by row, and of its rim.
  std::vector<int> blue;
  std::vector<int> rim;
  for (int y = 0; y < 400; ++y) {
    int ink = 0;
    int changed = 0;
    for (int x = 0; x < 400; ++x) {
      ink += drawn.at(x, y) == Color{0, 90, 181};
      changed += !(drawn.at(x, y) == plain.at(x, y));
    }
    if (changed == 0) continue;
    blue.push_back(ink);
    rim.push_back(changed);
  }
  ASSERT_GT(blue.size(), 60U);
  const double half = 400 / 130.0;
  const int shaft = blue[blue.size() - 15];
  const int head = *std::max_element(blue.begin(), blue.end());
  EXPECT_NEAR(shaft, 2 * half, 1.5);
  EXPECT_NEAR(head, 2 * 2.6 * half, 3.5);
  EXPECT_NEAR(rim[rim.size() - 15], 2 * 1.5 * half, 2.5);
  EXPECT_NEAR(*std::max_element(rim.begin(), rim.end()), 2 * (2.6 + 0.8) * half, 3.5);
  const auto widest = std::max_element(blue.begin(), blue.end()) - blue.begin();
  EXPECT_NEAR(static_cast<double>(widest), 5 * half, 6);  // from the tip
}

/// How deep a point is inside a simple polygon, negative outside [px].
double depthIn(const std::vector<Vector2d>& corners, const Vector2d& p) {
  bool inside = false;
  double nearest = 1e9;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector2d a = corners[i] - p;
    const Vector2d edge = corners[(i + 1) % corners.size()] - p - a;
    const double along = std::clamp(-a.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (a + along * edge).norm());
    if ((a.y() > 0) != (a.y() + edge.y() > 0) && a.x() - edge.x() * a.y() / edge.y() > 0) {
      inside = !inside;
    }
  }
  return inside ? nearest : -nearest;
}

/// An arrow's corners; the head is 5 half widths long and 2.6 wide to either side.
std::vector<Vector2d> arrow(const Vector2d& from, const Vector2d& to, double half, double rim) {
  const Vector2d along = (to - from).normalized();
  const Vector2d across(-along.y(), along.x());
  const auto at = [&](double x, double y) { return Vector2d(x * along + y * across); };
  const double w = half + rim;
  const double h = 2.6 * half + 1.6 * rim;
  return {from + at(-rim, w),  to + at(-5 * half, w),        to + at(-5 * half - rim, h),
          to + at(2 * rim, 0), to + at(-5 * half - rim, -h), to + at(-5 * half, -w),
          from + at(-rim, -w)};
}

TEST(Offscreen, ArrowsAndMarksHaveTheirPixels) {
  const auto model = sim::Model::fromMjcf(kBall);
  const sim::BodyId ball = model->body("ball");
  const double weight = model->mass() * 9.81;
  const int width = 300;
  const int height = 650;
  Offscreen offscreen(model, {.width = width, .height = height, .quality = Quality::kFast});
  sim::Frame frame;
  frame.state = model->initialState();
  const Vector3d centre = frame.state.q.head<3>();
  const Eye eye = {180, -10};
  Camera camera = {.view = View::kFront, .look_at = centre, .distance = 0.5};
  const Image plain = offscreen.draw(frame, camera);
  const auto draw = [&](const std::vector<sim::Contact>& contacts) {
    frame.contacts = contacts;
    return offscreen.draw(frame, camera, {.contact_forces = true});
  };
  const auto contact = [&](const Vector3d& p, const Vector3d& force) {
    sim::Contact c = touching({0}, ball, force);
    c.p_WC = centre + p;
    return c;
  };
  const Color blue = {0, 90, 181};
  // A force of one weight is half the robot's size long, of more at most 0.8 of it.
  for (const Vector3d& force : {Vector3d(0, 0, 1), Vector3d(0, 0.3, -0.4), Vector3d(0, -9, 12)}) {
    const Vector3d p(0, 0.004, -0.01);
    const Image drawn = draw({contact(p, weight * force)});
    const double length = 0.1 * std::min(0.5 * force.norm(), 0.8);
    const Vector2d from = seenAt(eye, camera, width, height, centre + p);
    const Vector2d to =
        seenAt(eye, camera, width, height, centre + p + length * force.normalized());
    const auto body = arrow(from, to, height / 130.0, 0);
    const auto rim = arrow(from, to, height / 130.0, 0.5 * height / 130.0);
    std::array<int, 3> pixels = {};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Vector2d at(x + 0.5, y + 0.5);
        const double inside = depthIn(body, at);
        const double in_rim = depthIn(rim, at);
        if (std::abs(inside) < 0.8 || std::abs(in_rim) < 0.8) continue;
        const int what = inside > 0 ? 0 : in_rim > 0 ? 1 : 2;
        ++pixels[what];
        EXPECT_EQ(drawn.at(x, y), what == 0   ? blue
                                  : what == 1 ? kWhite
                                              : plain.at(x, y))
            << x << " " << y;
      }
    }
    EXPECT_GT(pixels[0], 300);
    EXPECT_GT(pixels[1], 60);
  }
  // Forces on one body are drawn as their sum, where they are in the mean; what it does to another
  // turned round.
  const Vector3d up(0, 0, weight);
  const Image one = draw({contact({0, 0.01, 0}, up)});
  EXPECT_LT(unlike(one, draw({contact({0, -0.02, 0}, up / 4), contact({0, 0.02, 0}, 3 * up / 4)})),
            5);
  sim::Contact turned = contact({0, 0.01, 0}, -up);
  std::swap(turned.body_a, turned.body_b);
  EXPECT_LT(unlike(one, draw({turned})), 5);
  // Too small: of a hundredth of the weight, or of a pixel.
  EXPECT_GT(between(plain, draw({contact({0, 0, 0}, 0.0105 * up)})).pixels, 0);
  EXPECT_EQ(between(plain, draw({contact({0, 0, 0}, 0.0095 * up)})).pixels, 0);
  EXPECT_EQ(between(plain, draw({contact({0, 0, 0}, {0, 0, NAN})})).pixels, 0);
  // Of bodies that the model does not have nothing is known.
  EXPECT_EQ(between(plain, draw({touching({2}, ball, up), touching(ball, {2}, up)})).pixels, 0);
  camera.distance = 1;
  const Image far = draw({});
  EXPECT_EQ(between(far, draw({contact({0, 0, 0}, 0.0105 * up)})).pixels, 0);
  camera.distance = 0.5;
  // The centre of mass: a disc of dark and light quarters in a dark rim.
  const Image marked = offscreen.draw(frame, camera, {.com = true});
  const double radius = height / 50.0;
  std::array<int, 4> pixels = {};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d d(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0);
      const double r = d.norm();
      if (std::abs(r - radius) < 0.8 || std::abs(r - 1.2 * radius) < 0.8) continue;
      if (r < radius && (std::abs(d.x()) < 0.8 || std::abs(d.y()) < 0.8)) continue;
      const int what = r > 1.2 * radius ? 0 : r > radius ? 1 : d.x() * d.y() > 0 ? 2 : 3;
      ++pixels[what];
      EXPECT_EQ(marked.at(x, y), what == 0   ? plain.at(x, y)
                                 : what == 3 ? kWhite
                                             : kInk)
          << x << " " << y;
    }
  }
  for (const int n : pixels) EXPECT_GT(n, 20);
}

TEST(Offscreen, SmallPicturesHaveRimsOfAPixel) {
  sim::Frame frame = jump().frames[50];
  Offscreen& offscreen = testOffscreen();
  const Camera camera = offscreen.aim({&frame, 1}, {.view = View::kFront})[0];
  const Image plain = offscreen.draw(frame, camera);
  const Difference mark = between(plain, offscreen.draw(frame, camera, {.com = true}));
  EXPECT_NEAR(mark.right - mark.left + 1, 2 * (240 / 50.0 + 1), 1);
  sim::Contact c = touching({0}, testModel()->body("trunk"), {0, 0, testModel()->mass() * 9.81});
  c.p_WC = frame.state.q.head<3>();
  frame.contacts = {c};
  const Image forces = offscreen.draw(frame, camera, {.contact_forces = true});
  const int low = between(plain, forces).bottom - 6;  // across the shaft
  int wide = 0;
  int white = 0;
  for (int x = 0; x < 320; ++x) {
    wide += !(plain.at(x, low) == forces.at(x, low));
    white += forces.at(x, low).g > 110 && plain.at(x, low).g < 60;
  }
  EXPECT_GE(white, 2);
  EXPECT_NEAR(wide, 2 * (240 / 130.0 + 1), 1.5);
  // What the robot does to itself is not drawn; each body that touches another has its arrow.
  frame.contacts = {touching(testModel()->body("l_arm"), testModel()->body("trunk"), c.f_WC)};
  EXPECT_EQ(between(plain, offscreen.draw(frame, camera, {.contact_forces = true})).pixels, 0);
  sim::Contact arm = c;
  arm.body_b = testModel()->body("l_arm");
  arm.p_WC.y() += 0.15;
  frame.contacts = {c, arm};
  const Difference two = between(plain, offscreen.draw(frame, camera, {.contact_forces = true}));
  const Difference first = between(plain, forces);
  EXPECT_NEAR(two.pixels, 2 * first.pixels, 0.1 * first.pixels);
  EXPECT_EQ(two.left, first.left);
}

TEST(Offscreen, WithoutWeightAnArrowIsHalfTheRobotLong) {
  std::string mjcf = kBall;
  mjcf.insert(mjcf.find("<worldbody>"), "<option gravity='0 0 0'/>");
  const auto model = sim::Model::fromMjcf(mjcf);
  Offscreen offscreen(model, {.width = 64, .height = 64, .quality = Quality::kFast});
  sim::Frame frame;
  frame.state = model->initialState();
  sim::Contact c = touching({0}, model->body("ball"), {0, 0, 1e-3});
  c.p_WC = frame.state.q.head<3>();
  frame.contacts = {c};
  const Camera camera = offscreen.aim({&frame, 1}, {.view = View::kFront})[0];
  const Difference drawn = between(offscreen.draw(frame, camera),
                                   offscreen.draw(frame, camera, {.contact_forces = true}));
  const Vector2d tip = seenAt({180, -10}, camera, 64, 64, c.p_WC + Vector3d(0, 0, 0.05));
  EXPECT_NEAR(drawn.bottom + 1, 32 + 1, 1);  // of the rim
  EXPECT_NEAR(drawn.top, tip.y() - 2, 1);
}

TEST(Offscreen, WhatIsNotSeenHasNoSize) {
  std::string mjcf = kBall;
  mjcf.insert(mjcf.find("</body>"),
              "<geom size='1' group='3'/><geom size='2' group='6'/><geom size='3' group='7'/>");
  EXPECT_NEAR(Offscreen(sim::Model::fromMjcf(mjcf), {.width = 16, .height = 16}).robotSize(), 0.1,
              1e-9);
  // Where no robot is seen it is all that stands around, but the ground.
  const auto statue = sim::Model::fromMjcf(
      "<mujoco><worldbody><geom type='plane' size='9 9 1'/><geom size='.3' pos='1 2 3'/>"
      "</worldbody></mujoco>");
  EXPECT_NEAR(Offscreen(statue, {.width = 16, .height = 16}).robotSize(), 0.6, 1e-9);
  const auto nothing = sim::Model::fromMjcf("<mujoco/>");
  Offscreen offscreen(nothing, {.width = 16, .height = 32});
  sim::Frame frame;
  frame.state = nothing->initialState();
  const double size = offscreen.robotSize();
  for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(3, 0, 0), Vector3d(0, 2, 5)}) {
    const double distance = offscreen.aim({&frame, 1}, {.look_at = p})[0].distance;
    EXPECT_NEAR(distance,
                std::max({2 * p.x() / (0.8 * kSlope), p.y() / (0.8 * kSlope), size / 2}) + p.z(),
                1e-9);
  }
}

TEST(Offscreen, FogTakesTheGroundFromFiveSizesToEighteen) {
  for (const char* fog : {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}) {
    SCOPED_TRACE(fog);
    std::string mjcf = kBall;
    mjcf.insert(mjcf.find("</visual>"), "<rgba fog='" + std::string(fog) + " 1'/>");
    mjcf.insert(mjcf.find("<body"), "<geom type='plane' size='1 1 1' rgba='.8 .8 .8 1'/>");
    const auto model = sim::Model::fromMjcf(mjcf);
    Offscreen offscreen(model, {.width = 16, .height = 240, .quality = Quality::kFast});
    sim::Frame frame;
    frame.state = model->initialState();
    frame.state.q[1] = -50;  // out of the way
    const Camera camera = {.view = View::kSide, .look_at = Vector3d(0, 0, 0.1), .distance = 0.6};
    const Image image = offscreen.draw(frame, camera);
    const auto [right, up, forward] = Eye{90, -8}.axes();
    const double eye = 0.1 - 0.6 * forward.z();  // above the ground
    int near = 0;
    int fading = 0;
    int gone = 0;
    for (int y = 0; y < 240; ++y) {
      const double fall = -(forward + (1 - (y + 0.5) / 120) * kSlope * up).z();
      const double depth = fall > 0 ? eye / fall / 0.1 : INFINITY;  // in sizes
      if (depth > 180) continue;
      const bool is_fog = fog != std::string("0 0 0");
      const double clear = is_fog ? std::clamp((18 - depth) / (18 - 5), 0.0, 1.0) : 1;
      ++(clear == 1 ? near : clear > 0 ? fading : gone);
      const Color c = image.at(8, y);
      const int seen[] = {c.r, c.g, c.b};
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(seen[k], 204 * clear + (fog[2 * k] == '1' ? 255 * (1 - clear) : 0), 3)
            << y << " " << depth;
      }
    }
    EXPECT_GT(near, 5);
    if (fog != std::string("0 0 0")) {
      EXPECT_GT(fading, 20);
      EXPECT_GT(gone, 10);
    }
  }
}

/// A ball half a metre above the ground, in a sun that shines along +y or against it.
std::string sunlit(double y) {
  return R"(<mujoco><visual><headlight ambient=".4 .4 .4" diffuse="0 0 0" specular="0 0 0"/>
    </visual><worldbody><light directional="true" dir="0 )" +
         std::to_string(y) + R"( -1" pos="0 0 4" diffuse=".5 .5 .5" specular="0 0 0"/>
    <geom type="plane" size="1 1 1" rgba=".8 .8 .8 1"/>
    <body pos="0 0 0.5"><freejoint/><geom size="0.1" rgba="1 0 0 1"/></body>
    </worldbody></mujoco>)";
}

TEST(Offscreen, AShadowLiesWhereTheSunThrowsIt) {
  const auto model = sim::Model::fromMjcf(sunlit(0.5));
  sim::Frame frame;
  frame.state = model->initialState();
  Camera camera = {.view = View::kFront, .look_at = Vector3d(0, 0, 0.2), .distance = 2.5};
  const Eye eye = {180, -10};
  Image fine;
  for (const Quality quality : {Quality::kFast, Quality::kFine}) {
    Offscreen offscreen(model, {.width = 240, .height = 160, .quality = quality});
    const Image image = offscreen.draw(frame, camera);
    const auto level = [&](const Image& picture, double y) {
      const Vector2d at = seenAt(eye, camera, 240, 160, {0, y, 0});
      return int(picture.at(static_cast<int>(at.x()), static_cast<int>(at.y())).r);
    };
    const int lit = level(image, -0.25);
    const int dark = level(image, 0.25);
    EXPECT_LT(dark, lit - 60);
    EXPECT_NEAR(level(image, 0.25 + 0.22), lit, 4);
    EXPECT_NEAR(level(image, 0.25 - 0.22), lit, 4);
    // From dark to lit it takes the sun's width, of 0.07 rad, over the way of 0.56 m; fast
    // pictures show a sun without width.
    int between = 0;
    for (int x = 120; x < 240; ++x) {
      const int row = static_cast<int>(seenAt(eye, camera, 240, 160, {0, 0.25, 0}).y());
      const int r = image.at(x, row).r;
      between += r > dark + 10 && r < lit - 10;
    }
    // Far from the world's origin nothing is different.
    const Vector3d away(40, -60, 0);
    sim::Frame there = frame;
    there.state.q.head<3>() += away;
    Camera moved = camera;
    *moved.look_at += away;
    const Image other = offscreen.draw(there, moved);
    int different = 0;
    for (size_t i = 0; i < image.rgb.size(); ++i) {
      different += std::abs(image.rgb[i] - other.rgb[i]) > 12;
    }
    EXPECT_LT(different, 60);
    // A picture does not depend on those drawn before.
    EXPECT_EQ(offscreen.draw(frame, camera).rgb, image.rgb);
    if (quality == Quality::kFast) {
      EXPECT_LT(between, 3);
    } else {
      EXPECT_GT(between, 3);
      EXPECT_LT(between, 9);
    }
    fine = image;
  }
  // The mirrored scene gives the mirrored picture.
  const auto mirrored = sim::Model::fromMjcf(sunlit(-0.5));
  Offscreen offscreen(mirrored, {.width = 240, .height = 160});
  const Image image = offscreen.draw(frame, camera);
  int different = 0;
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 240; ++x) {
      different += std::abs(image.at(x, y).r - fine.at(239 - x, y).r) > 25;
    }
  }
  EXPECT_LT(different, 60);
}

TEST(Offscreen, CameraFollowsSmoothlyOrStandsStill) {
  sim::Recording r = jump();
  for (size_t i = 0; i < r.frames.size(); ++i) r.frames[i].state.q[0] += i % 2 ? 0.01 : -0.01;
  Offscreen& offscreen = testOffscreen();
  const auto follow = offscreen.aim(r.frames, {});
  ASSERT_EQ(follow.size(), r.frames.size());
  for (size_t i = 1; i < follow.size(); ++i) {
    EXPECT_LT((*follow[i].look_at - *follow[i - 1].look_at).norm(), 0.02);  // 1.25 m/s · 0.01 s + …
    EXPECT_EQ(follow[i].distance, follow[0].distance);
    EXPECT_EQ(follow[i].look_at->z(), follow[0].look_at->z());  // a jump does not move the ground
  }
  EXPECT_NEAR(follow.back().look_at->x() - follow.front().look_at->x(), 0.5, 0.02);

  const auto still = offscreen.aim(r.frames, {.follow = false});
  EXPECT_EQ(*still.front().look_at, *still.back().look_at);
  for (const size_t i : {size_t{0}, size_t{50}, size_t{100}}) {
    const Image image = offscreen.draw(r.frames[i], still[i]);
    const Patch red = find(image, Hue::kRed);
    EXPECT_GT(red.pixels, 300);
    EXPECT_TRUE(red.left > 2 && red.right < 317 && red.top > 2 && red.bottom < 237);
  }

  // A fall from 20 sizes is followed downwards too.
  for (size_t i = 0; i < r.frames.size(); ++i) r.frames[i].state.q[2] = 8 - 0.078 * double(i);
  const auto down = offscreen.aim(r.frames, {});
  EXPECT_NEAR(down.front().look_at->z() - down.back().look_at->z(), 7.8, 0.5);
  EXPECT_LT(down.front().distance, follow.front().distance);

  const auto given = offscreen.aim(r.frames, {.look_at = Vector3d(1, 2, 3), .distance = 4});
  EXPECT_EQ(*given[7].look_at, Vector3d(1, 2, 3));
  EXPECT_EQ(given[7].distance, 4);
}

TEST(Offscreen, CameraKeepsARollingBallInThePictureWhileItIsNear) {
  std::string mjcf = kMjcf;
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"1 0 0 1", "0.5 0.5 0.5 1"},
                                 {"</worldbody>",
                                  R"(<body name="ball" pos="0.2 0 0.04"><freejoint/>
                                     <geom type="sphere" size="0.04" rgba="1 0 0 1"/></body>
                                     </worldbody>)"}}) {
    mjcf.replace(mjcf.find(from), from.size(), to);
  }
  const auto model = sim::Model::fromMjcf(mjcf);
  ASSERT_TRUE(model->isRobot(model->body("trunk")));
  Offscreen offscreen(model);
  const auto roll = [&](double x) {
    std::vector<sim::Frame> frames(51);
    for (size_t i = 0; i < frames.size(); ++i) {
      frames[i].state = model->initialState();
      frames[i].state.time = 0.01 * static_cast<double>(i);
      frames[i].state.q[9] = 0.2 + (x - 0.2) * static_cast<double>(i) / 50;
    }
    return frames;
  };
  const std::vector<sim::Frame> near = roll(0.9);
  for (const bool follow : {true, false}) {
    const auto cameras = offscreen.aim(near, {.view = View::kSide, .follow = follow});
    for (const size_t i : {size_t{0}, size_t{25}, size_t{50}}) {
      const Image image = offscreen.draw(near[i], cameras[i]);
      const Patch red = find(image, Hue::kRed);
      EXPECT_GT(red.pixels, 50);
      EXPECT_GT(find(image, Hue::kBlue).pixels, 300);
      EXPECT_TRUE(red.left > 2 && red.right < 317) << follow << i << " " << red.right;
    }
  }
  // It counts while its middle is within three sizes, of 0.4 m, of the robot's: the camera looks
  // as far beside the robot's centre of mass as the middle of both is beside the robot's own.
  for (const auto& [x, counts] : {std::pair(1.16, true), std::pair(1.22, false)}) {
    sim::Frame frame = near[0];
    frame.state.q[9] = x;
    const Camera camera = offscreen.aim({&frame, 1}, {.view = View::kSide})[0];
    const double middle = counts ? (x + 0.04 - 0.1) / 2 : 0;
    EXPECT_NEAR(camera.look_at->x(), middle, 1e-4) << x;
  }
  // Three sizes away it is left behind, and the robot in the middle again.
  const std::vector<sim::Frame> far = roll(10);
  EXPECT_NEAR(offscreen.aim(far, {.view = View::kSide}).back().look_at->x(), 0, 0.01);
}

TEST(Offscreen, RefusesWhatItCannotDraw) {
  EXPECT_THROW(Offscreen(testModel(), {.width = 0}), InputError);
  EXPECT_THROW(Offscreen(testModel(), {.height = 100000}), InputError);
  Offscreen offscreen(testModel(), {.width = 32, .height = 32});
  sim::Frame frame;
  EXPECT_THROW(offscreen.draw(frame), InputError);
  frame.state = testModel()->initialState();
  frame.state.q[3] = NAN;
  EXPECT_THROW(offscreen.draw(frame), InputError);
}

TEST(Offscreen, DrawsAWorldWithoutRobotLightOrSky) {
  const auto model =
      sim::Model::fromMjcf("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>");
  Offscreen offscreen(model, {.width = 64, .height = 48});
  sim::Frame frame;
  frame.state = model->initialState();
  EXPECT_GT(offscreen.draw(frame).at(32, 24).r, 20);
}

// ----------------------------------------------------------------------------------------- motion

TEST(Motion, FramesBetweenFrames) {
  const sim::Recording r = jump();
  const auto model = testModel();
  const sim::Frame f = frameAt(*model, r, 0.505);
  EXPECT_DOUBLE_EQ(f.state.time, 0.505);
  EXPECT_NEAR(f.state.q[0], (r.frames[50].state.q[0] + r.frames[51].state.q[0]) / 2, 1e-12);
  EXPECT_NEAR(f.state.q.segment<4>(3).norm(), 1, 1e-12);
  EXPECT_EQ(phaseName(r, f), "flight");
  EXPECT_EQ(frameAt(*model, r, -1).state.time, 0);
  EXPECT_EQ(frameAt(*model, r, 99).state.time, r.frames.back().state.time);
  const auto starts = phaseStarts(r);
  ASSERT_EQ(starts.size(), 3u);
  EXPECT_EQ(starts[1].name, "flight");
  EXPECT_NEAR(starts[1].time, 0.31, 1e-9);
}

TEST(Motion, SteadyMotionIsMetExactlyBetweenFrames) {
  // Everything linear in time, the trunk turning at a constant rate; frames not evenly spaced.
  const auto model = testModel();
  const sim::VectorXd v0 = sim::VectorXd::LinSpaced(model->nv(), -1, 2);
  const sim::VectorXd a = sim::VectorXd::LinSpaced(model->nv(), 3, -0.5);
  const sim::Vector3d c(0.1, -0.2, 0.3);
  const sim::Vector3d slope(1, -2, 3);
  const auto at = [&](double t) {
    sim::Frame f;
    f.state = model->initialState();
    f.state.time = t;
    f.state.q.head<3>() += t * slope;
    f.state.q.segment<4>(3) << std::cos(t), 0, std::sin(t), 0;
    f.state.q[model->joint("l_swing").q] = 1 - 2 * t;
    f.state.v = v0 + t * a;
    f.com = c + t * slope;
    f.com_velocity = slope - t * c;
    return f;
  };
  sim::Recording r;
  r.mjcf = kMjcf;
  const double times[] = {0.1, 0.14, 0.2, 0.5};
  for (const double t : times) {
    r.frames.push_back(at(t));
    r.frames.back().phase = static_cast<int>(r.frames.size());
    r.frames.back().torque = sim::VectorXd::Constant(model->nu(), t);
  }
  for (const double t : {0.1, 0.11, 0.1399, 0.14, 0.17, 0.2, 0.26, 0.4, 0.5}) {
    SCOPED_TRACE(t);
    const sim::Frame f = frameAt(*model, r, t);
    const sim::Frame expected = at(t);
    EXPECT_EQ(f.state.time, t);
    EXPECT_LT((f.state.q - expected.state.q).norm(), 1e-12);
    EXPECT_LT((f.state.v - expected.state.v).norm(), 1e-12);
    EXPECT_LT((f.com - expected.com).norm(), 1e-12);
    EXPECT_LT((f.com_velocity - expected.com_velocity).norm(), 1e-12);
    const auto up_to = std::upper_bound(std::begin(times), std::end(times), t) - std::begin(times);
    EXPECT_EQ(f.phase, up_to);
  }
  EXPECT_EQ(frameAt(*model, r, 0.05).state.v, r.frames.front().state.v);
  EXPECT_EQ(frameAt(*model, r, 0.6).state.v, r.frames.back().state.v);
}

TEST(Motion, TellingTimes) {
  const sim::Recording r = jump();
  const auto near = [](const std::vector<double>& times, double t) {
    return std::any_of(times.begin(), times.end(),
                       [&](double s) { return std::abs(s - t) < 0.011; });
  };
  for (const int count : {1, 2, 3, 4, 5, 8, 40}) {
    const auto times = tellingTimes(*testModel(), r, count);
    ASSERT_EQ(static_cast<int>(times.size()), count);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    EXPECT_EQ(times.front(), 0);
    if (count >= 2) {
      EXPECT_EQ(times.back(), r.frames.back().state.time);
    }
    if (count >= 3) {
      EXPECT_TRUE(near(times, 0.5));  // apex
    }
    if (count >= 4) {
      EXPECT_TRUE(near(times, kFlightEnd));  // touchdown
    }
    if (count >= 5) {
      EXPECT_TRUE(near(times, kFlightStart));
    }
  }
  EXPECT_THROW(tellingTimes(*testModel(), r, 0), InputError);
  // A gait of more phases than pictures is shown to its end.
  sim::Recording gait = r;
  for (size_t i = 0; i < gait.frames.size(); ++i) {
    gait.frames[i].phase = static_cast<int>(i / 4) % 3;
    gait.frames[i].contacts = r.frames.front().contacts;
  }
  const auto steps = tellingTimes(*testModel(), gait, 6);
  ASSERT_EQ(steps.size(), 6u);
  for (size_t i = 1; i < steps.size(); ++i) EXPECT_LT(steps[i] - steps[i - 1], 0.3);
  // Of two moments as far from what is taken, the earlier.
  sim::Recording even = gait;
  for (size_t i = 0; i < even.frames.size(); ++i) {
    even.frames[i].phase = i < 25 ? 0 : i < 75 ? 1 : 2;
  }
  EXPECT_NEAR(tellingTimes(*testModel(), even, 3)[1], 0.25, 1e-9);
  sim::Recording one = r;
  one.frames.resize(1);
  EXPECT_EQ(tellingTimes(*testModel(), one, 8).size(), 1u);
}

/// A recording of the test model that stands on the ground but in these stretches [s], at times so
/// far apart; what rises is com.
sim::Recording withFlights(double start, double end, double step,
                           const std::vector<std::pair<double, double>>& flights) {
  sim::Recording r;
  r.mjcf = kMjcf;
  const sim::Contact ground = touching({0}, testModel()->body("trunk"));
  for (int i = 0; start + i * step <= end + 1e-9; ++i) {
    sim::Frame& f = r.frames.emplace_back();
    f.state = testModel()->initialState();
    f.state.time = start + i * step;
    f.phase = -1;
    const auto in = std::find_if(flights.begin(), flights.end(), [&](const auto& flight) {
      return f.state.time > flight.first - 1e-9 && f.state.time < flight.second - 1e-9;
    });
    if (in == flights.end()) {
      f.contacts = {ground};
    } else {
      f.com.z() = (f.state.time - in->first) * (in->second - f.state.time);
    }
  }
  return r;
}

void expectTimes(const std::vector<double>& times, const std::vector<double>& expected) {
  ASSERT_EQ(times.size(), expected.size());
  for (size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], 1e-9) << i;
}

TEST(Motion, WithoutEventsTheLongestGapIsHalved) {
  const sim::Recording r = withFlights(2, 3, 0.125, {});
  expectTimes(tellingTimes(*testModel(), r, 1), {2});
  expectTimes(tellingTimes(*testModel(), r, 2), {2, 3});
  expectTimes(tellingTimes(*testModel(), r, 3), {2, 2.5, 3});
  expectTimes(tellingTimes(*testModel(), r, 4), {2, 2.25, 2.5, 3});
  expectTimes(tellingTimes(*testModel(), r, 5), {2, 2.25, 2.5, 2.75, 3});
  expectTimes(tellingTimes(*testModel(), r, 6), {2, 2.125, 2.25, 2.5, 2.75, 3});
}

TEST(Motion, LongerFlightsAreToldFirst) {
  const sim::Recording r = withFlights(0, 2, 0.01, {{0.2, 0.4}, {0.8, 1.6}});
  expectTimes(tellingTimes(*testModel(), r, 3), {0, 1.2, 2});
  expectTimes(tellingTimes(*testModel(), r, 4), {0, 1.2, 1.6, 2});
  expectTimes(tellingTimes(*testModel(), r, 5), {0, 0.8, 1.2, 1.6, 2});
  expectTimes(tellingTimes(*testModel(), r, 6), {0, 0.3, 0.8, 1.2, 1.6, 2});
  expectTimes(tellingTimes(*testModel(), r, 8), {0, 0.2, 0.3, 0.4, 0.8, 1.2, 1.6, 2});
}

TEST(Motion, AFlightLastsAtLeastThirtyMilliseconds) {
  // From 0 s on, where the numbers are exact.
  const auto third = [](double end) {
    return tellingTimes(*testModel(), withFlights(-0.03, 0.09, 0.01, {{0, end}}), 3)[1];
  };
  EXPECT_NEAR(third(0.02), 0.03, 1e-9);  // none: the middle
  EXPECT_NEAR(third(0.03), 0.01, 1e-9);
  EXPECT_NEAR(third(0.04), 0.02, 1e-9);
  // One in progress at the start counts, one that does not end does not.
  expectTimes(tellingTimes(*testModel(), withFlights(0, 1, 0.01, {{0, 0.4}}), 4), {0, 0.2, 0.4, 1});
  expectTimes(tellingTimes(*testModel(), withFlights(0, 1, 0.25, {{0, 0.25}}), 3), {0, 0.25, 1});
  expectTimes(tellingTimes(*testModel(), withFlights(0, 1, 0.01, {{0.6, 2}}), 3), {0, 0.5, 1});
}

TEST(Motion, AMomentThatNearlyRepeatsAnotherIsLeftOut) {
  // Nearly: a quarter of the even spacing, of 1/5 s.
  const auto times = [](double begin) {
    return tellingTimes(*testModel(), withFlights(0, 1, 0.01, {{begin, begin + 0.6}}), 5);
  };
  expectTimes(times(0.06), {0, 0.06, 0.36, 0.66, 1});
  expectTimes(times(0.04), {0, 0.34, 0.64, 0.82, 1});
  // The same of the beginnings of phases.
  const auto phases = [](int begin) {
    sim::Recording r = withFlights(0, 1, 0.01, {});
    r.phases = {"", "a", "b"};
    for (int i = 0; i <= 100; ++i) r.frames[i].phase = i < begin ? 0 : i < 50 ? 1 : 2;
    return tellingTimes(*testModel(), r, 5);
  };
  expectTimes(phases(6), {0, 0.06, 0.5, 0.75, 1});
  expectTimes(phases(4), {0, 0.25, 0.5, 0.75, 1});
}

TEST(Motion, OnlyTheGroundUnderTheRobotEndsAFlight) {
  const auto model = sim::Model::fromMjcf(R"(<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
    <body name="robot"><freejoint/><geom size=".1"/><body name="arm"><joint/><geom size=".1"/>
    </body></body><body name="ball"><freejoint/><geom size=".01"/></body></worldbody></mujoco>)");
  const sim::BodyId robot = model->body("robot");
  const sim::BodyId arm = model->body("arm");
  const sim::BodyId ball = model->body("ball");
  const sim::BodyId ground = {0};
  ASSERT_TRUE(model->isRobot(arm));
  ASSERT_FALSE(model->isRobot(ball));
  const auto ends = [&](sim::BodyId a, sim::BodyId b) {
    sim::Recording r;
    for (int i = 0; i <= 10; ++i) {
      sim::Frame& f = r.frames.emplace_back();
      f.state.time = 0.1 * i;
      f.com.z() = i == 3 ? 1 : 0;
      if (i == 1 || i == 8) f.contacts = {touching(ground, robot)};
      if (i == 6) f.contacts = {touching(a, b)};
    }
    const auto times = tellingTimes(*model, r, 4);
    return std::abs(times[2] - 0.6) < 1e-9;
  };
  EXPECT_TRUE(ends(ground, robot));
  EXPECT_TRUE(ends(arm, ground));
  EXPECT_FALSE(ends(arm, robot));
  EXPECT_FALSE(ends(ball, arm));
  EXPECT_FALSE(ends(ground, ball));
  EXPECT_FALSE(ends(ball, ground));
}

TEST(Motion, APhaseHasANameOrNone) {
  sim::Recording r = withFlights(0, 0.9, 0.1, {});
  r.phases = {"zero", "one", ""};
  sim::Frame frame;
  const std::pair<int, std::string> names[] = {{-2, ""},   {-1, ""}, {0, "zero"},
                                               {1, "one"}, {2, ""},  {3, ""}};
  for (const auto& [phase, name] : names) {
    frame.phase = phase;
    EXPECT_EQ(phaseName(r, frame), name) << phase;
  }
  const int entered[] = {1, 1, 2, 1, 0, 0, -1, 0, 3, 3};
  for (int i = 0; i < 10; ++i) r.frames[i].phase = entered[i];
  std::vector<std::string> starts;
  for (const PhaseStart& p : phaseStarts(r)) {
    starts.push_back(p.name + std::to_string(std::lround(10 * p.time)));
  }
  EXPECT_EQ(starts, std::vector<std::string>({"one0", "one3", "zero4", "zero7"}));
}

TEST(Motion, RecordingsThatCannotBeRead) {
  sim::Recording r = jump();
  std::swap(r.frames[3], r.frames[4]);
  EXPECT_THROW(checkRecording(*testModel(), r), InputError);
  r = jump();
  r.frames[9].state.q[1] = NAN;
  EXPECT_TRUE(has(messageOf<InputError>([&] { checkRecording(*testModel(), r); }), "frame 9"));
  r = jump();
  r.frames[2].state.q.resize(3);
  EXPECT_THROW(checkRecording(*testModel(), r), InputError);
  for (const double time : {double(INFINITY), double(NAN), 0.99, 0.5}) {
    r = jump();
    r.frames.back().state.time = time;
    EXPECT_THROW(checkRecording(*testModel(), r), InputError) << time;
  }
  r = jump();
  r.frames[0].state.time = -double(INFINITY);
  EXPECT_TRUE(has(messageOf<InputError>([&] { checkRecording(*testModel(), r); }), "frame 0"));
  r = jump();
  r.frames[0].state.v.resize(3);
  EXPECT_TRUE(has(messageOf<InputError>([&] { checkRecording(*testModel(), r); }), "frame 0"));
  const int bodies = testModel()->bodies();
  for (const auto& [a, b] :
       {std::pair(0, -1), std::pair(0, bodies), std::pair(-1, 0), std::pair(bodies, 0)}) {
    r = jump();
    r.frames[5].contacts = {touching({a}, {b})};
    EXPECT_TRUE(has(messageOf<InputError>([&] { checkRecording(*testModel(), r); }), "frame 5"));
  }
  r = jump();
  r.frames[5].contacts = {touching({bodies - 1}, {0})};
  EXPECT_NO_THROW(checkRecording(*testModel(), r));
  r.frames.clear();
  EXPECT_THROW(filmStrip(r), InputError);
}

// --------------------------------------------------------------------------- film strip and video

TEST(FilmStrip, PanelsSideBySideAndChosenTimes) {
  const sim::Recording r = jump();
  const Image strip = filmStrip(r, {.count = 6,
                                    .even = true,
                                    .panel_width = 120,
                                    .panel_height = 90,
                                    .columns = 3,
                                    .labels = false});
  EXPECT_EQ(strip.width, 3 * 120 + 2 * 2);
  EXPECT_EQ(strip.height, 2 * 90 + 2);
  EXPECT_GT(find(strip, Hue::kRed).pixels, 6 * 200);

  FilmStripOptions chosen = {.times = {0, 0.5}, .panel_width = 120, .panel_height = 90};
  chosen.camera = {.view = View::kSide, .follow = false};
  const Image two = filmStrip(r, chosen);
  EXPECT_EQ(two.width, 2 * 120 + 2);
  EXPECT_GT(two.height, 90);  // labels
  chosen.labels = false;
  const Image bare = filmStrip(r, chosen);
  // In the second panel the robot is higher and further to the right.
  Image left(120, 90);
  paste(left, bare, 0, 0);
  Image right(120, 90);
  paste(right, bare, -122, 0);
  EXPECT_LT(find(right, Hue::kRed).y, find(left, Hue::kRed).y - 5);
  EXPECT_GT(find(right, Hue::kRed).x, find(left, Hue::kRed).x + 5);

  EXPECT_TRUE(has(messageOf<InputError>([&] { filmStrip(r, {.times = {0.2, 1.5}}); }), "1.5"));
  EXPECT_THROW(filmStrip(r, {.times = {NAN}}), InputError);
  EXPECT_THROW(filmStrip(r, {.count = 0}), InputError);
  EXPECT_THROW(filmStrip(r, {.count = 100000}), InputError);
  EXPECT_THROW(filmStrip(r, {.columns = -1}), InputError);
  EXPECT_THROW(filmStrip(r, {.panel_width = 3}), InputError);
}

TEST(FilmStrip, APanelIsTheMomentUnderItsName) {
  const sim::Recording r = jump();
  const std::vector<double> times = {-1e-7, 0.005, 0.0072, 0.503};
  const int w = 240;
  const int h = 182;
  const Image strip = filmStrip(
      r,
      {.times = times, .even = true, .panel_width = w, .panel_height = h, .draw = {.com = true}});
  // Letters of a thirteenth of the panel in a row of 5/4 of that; a gap of 1/80 of the width.
  ASSERT_EQ(strip.width, 4 * w + 3 * 3);
  ASSERT_EQ(strip.height, h + 17);
  Offscreen offscreen(testModel(), {.width = w, .height = h});
  const auto cameras = offscreen.aim(r.frames, {.view = View::kSide});
  const Font& font = testFont();
  const char* const names[] = {"0.00 s  stand", "0.01 s  stand", "0.01 s  stand", "0.50 s  flight"};
  const size_t nearest[] = {0, 0, 1, 50};
  for (size_t i = 0; i < 4; ++i) {
    Image panel(w, h + 17);
    font.draw(panel, 3, 0, 14, names[i]);
    const sim::Frame frame = frameAt(*testModel(), r, times[i]);
    paste(panel, offscreen.draw(frame, cameras[nearest[i]], {.com = true}), 0, 17);
    Image drawn(w, h + 17);
    paste(drawn, strip, -static_cast<int>(i) * (w + 3), 0);
    EXPECT_EQ(unlike(drawn, panel), 0) << i;
  }
}

TEST(FilmStrip, RowsAreOfAtMostFiveAndAsEqualAsPossible) {
  const auto strip = [](FilmStripOptions options) {
    options.panel_width = options.panel_height = 16;
    return filmStrip(jump(), options);
  };
  const auto size = [](const Image& image) {
    return std::pair((image.width + 2) / 18, (image.height + 2) / (16 + 16 + 2));
  };
  const Image five = strip({.count = 5, .even = true});
  EXPECT_EQ(size(five), std::pair(5, 1));
  EXPECT_EQ(unlike(five, strip({.times = {0, 0.25, 0.5, 0.75, 1}})), 0);
  EXPECT_EQ(size(strip({.count = 6})), std::pair(3, 2));
}

TEST(FilmStrip, RefusesWhatIsJustTooMuch) {
  const sim::Recording r = jump();
  // What passes one check fails at the next.
  const auto refusal = [&](FilmStripOptions options) {
    options.columns = -1;
    return messageOf<InputError>([&] { filmStrip(r, options); });
  };
  for (const double t : {-0.9e-6, 1 + 0.9e-6}) {
    EXPECT_TRUE(has(refusal({.times = {t}}), "columns = -1")) << t;
  }
  for (const double t : {-1.1e-6, 1 + 1.1e-6}) {
    EXPECT_TRUE(has(refusal({.times = {t}}), "outside the recording, [0, 1] s")) << t;
  }
  for (const int n : {1, 200}) EXPECT_TRUE(has(refusal({.count = n}), "columns = -1"));
  for (const int n : {0, 201}) EXPECT_TRUE(has(refusal({.count = n}), "expected 1 to 200"));
  const std::vector<double> many(201, 0.5);
  EXPECT_TRUE(has(refusal({.times = many}), "201 panels"));
}

TEST(FilmStrip, WhatDoesNotFitIsCutOff) {
  sim::Recording r = jump();
  r.phases[0] = "a phase of a very long name";
  FilmStripOptions options = {.times = {0}, .panel_width = 100, .panel_height = 64};
  options.camera.distance = 9;
  const std::vector<TitledRecording> one = {{"a title of many, many words", r}};
  const Image strip = filmStrips(one, options);
  const Font& font = testFont();
  // Letters of 13 px, 3 px from either side; the title's row is 19 px high.
  ASSERT_EQ(strip.height, 19 + 16 + 64);
  std::string title = one[0].title;
  while (font.width(title, 13) > 100 - 2 * 3) title.pop_back();
  std::string label = "0.00 s  " + r.phases[0];
  while (font.width(label, 13) > 100 - 2 * 3) label.pop_back();
  Image expected(100, 19 + 16);
  font.draw(expected, 3, 3, 13, title);
  font.draw(expected, 3, 19, 13, label);
  Image top(100, 19 + 16);
  paste(top, strip, 0, 0);
  EXPECT_EQ(top.rgb, expected.rgb);
  // The picture is that of the strip alone, from as far as was asked for.
  Image below(100, 16 + 64);
  paste(below, strip, 0, -19);
  EXPECT_EQ(unlike(below, filmStrip(r, options)), 0);
}

TEST(FilmStrip, StripsUnderEachOtherAreOfOneScale) {
  const sim::Recording upright = jump();
  sim::Recording leaping = jump();  // needs more distance to be seen whole
  for (sim::Frame& f : leaping.frames) f.state.q[0] *= 3;
  const FilmStripOptions options = {.times = {0},
                                    .panel_width = 120,
                                    .panel_height = 90,
                                    .camera = {.view = View::kSide, .follow = false},
                                    .labels = false};
  const auto size = [](const Image& image) {
    const Patch red = find(image, Hue::kRed);
    return red.bottom - red.top;
  };
  const int alone = size(filmStrip(upright, options));
  const int far = size(filmStrip(leaping, options));
  ASSERT_LT(far, 0.8 * alone);
  const std::vector<TitledRecording> recordings = {{"upright", upright}, {"leaping", leaping}};
  const Image both = filmStrips(recordings, options);
  const int heading = (both.height - 2) / 2 - 90;
  EXPECT_GT(heading, 13);
  EXPECT_EQ(both.height, 2 * (90 + heading) + 2);
  Image top(120, 90), bottom(120, 90);
  paste(top, both, 0, -heading);
  paste(bottom, both, 0, -(90 + 2 * heading + 2));
  EXPECT_NEAR(size(top), far, 1);
  EXPECT_NEAR(size(bottom), far, 1);
  EXPECT_THROW(filmStrips({}), InputError);
}

std::string probe(const fs::path& video) {
  const std::string command =
      "ffprobe -v error -show_entries stream=width,height,nb_frames,pix_fmt,codec_name "
      "-of csv=p=0 '" +
      video.string() + "'";
  FILE* pipe = popen(command.c_str(), "r");
  char line[200] = "";
  EXPECT_TRUE(fgets(line, sizeof line, pipe));
  pclose(pipe);
  return line;
}

TEST(Video, OddSizesBecomeEvenAndSlowMotionIsLonger) {
  const Folder folder;
  VideoOptions options = {.width = 81, .height = 61, .fps = 10, .hold = 0};
  double done = 0;
  options.progress = [&](double part) { done = part; };
  writeVideo(jump(), folder / "a.mp4", options);
  EXPECT_EQ(probe(folder / "a.mp4"), "h264,82,62,yuv420p,11\n");
  EXPECT_EQ(done, 1);
  options.speed = 0.5;
  options.hold = 0.3;
  options.start = 0.5;
  writeVideo(jump(), folder / "a.mp4", options);  // replaces
  EXPECT_EQ(probe(folder / "a.mp4"), "h264,82,62,yuv420p,14\n");
  EXPECT_EQ(folder.files(), 1);
}

TEST(Video, OfPicturesAsTheyAre) {
  const Folder folder;
  {
    VideoFile video(folder / "a.mp4", 64, 48, 10);
    for (int i = 0; i < 5; ++i) video.add(Image(64, 48));
    EXPECT_THROW(video.add(Image(64, 50)), InputError);
    video.finish();
  }
  EXPECT_EQ(probe(folder / "a.mp4"), "h264,64,48,yuv420p,5\n");
  { VideoFile(folder / "b.mp4", 64, 48, 10).add(Image(64, 48)); }  // not finished
  EXPECT_EQ(folder.files(), 1);
  EXPECT_THROW(VideoFile(folder / "b.mp4", 63, 48, 10), InputError);
  EXPECT_THROW(VideoFile(folder / "b.mp4", 64, 48, 0), InputError);
  EXPECT_EQ(folder.files(), 1);
}

/// Names in which gnuplot, ffmpeg or a shell find a meaning, for a folder and for a file.
const std::vector<std::string>& oddNames() {
  static const std::vector<std::string> kNames = {"|touch PWNED;#",
                                                  "-y",
                                                  "`touch PWNED`",
                                                  "$(touch PWNED)",
                                                  "it's \"quoted\"",
                                                  "a\nb'; !touch PWNED\n",
                                                  "%03d",
                                                  "pipe:1",
                                                  "concat:a|b",
                                                  "< date",
                                                  "back\\",
                                                  "~",
                                                  "\x1b[31m",
                                                  "\xff"};
  return kNames;
}

/// The folder to work in, for as long as it lives.
class WorkIn {
 public:
  explicit WorkIn(const std::filesystem::path& folder) { std::filesystem::current_path(folder); }
  ~WorkIn() { std::filesystem::current_path(was_); }
  WorkIn(const WorkIn&) = delete;
  WorkIn& operator=(const WorkIn&) = delete;

 private:
  std::filesystem::path was_ = std::filesystem::current_path();
};

TEST(Video, AnyNameIsOnlyAName) {
  const Folder folder;
  const WorkIn here(folder.path());
  for (const std::string& name : oddNames()) {
    SCOPED_TRACE(name);
    std::filesystem::create_directory(name);
    const fs::path file = fs::path(name) / (name + ".mp4");
    VideoFile video(file, 64, 48, 10);
    video.add(Image(64, 48));
    video.finish();
    EXPECT_GT(fs::file_size(file), 0);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(name), {}), 1);
  }
  EXPECT_EQ(folder.files(), static_cast<int>(oddNames().size()));
}

/// What ffmpeg is given: its arguments, and the pictures' bytes one after the other.
struct Given {
  std::string arguments;
  std::string bytes;
};

Given givenToFfmpeg(const sim::Recording& recording, const VideoOptions& options) {
  const Folder bin;
  const std::string to = bin.path().string();
  std::ofstream(bin / "ffmpeg")
      << "#!/bin/sh\nPATH=/usr/bin:/bin\necho \"$@\" >'" << to << "/arguments'\ncat >'" << to
      << "/bytes'\nfor last; do :; done\nfor part in ftyp moov mdat; do printf "
      << "'\\000\\000\\000\\010%s' $part; done >\"${last#file:}\"\n";
  fs::permissions(bin / "ffmpeg", fs::perms::owner_all);
  const Path path(to);
  writeVideo(recording, bin / "a.mp4", options);
  return {textOf(bin / "arguments"), textOf(bin / "bytes")};
}

TEST(Video, EachPictureIsTheMomentThatIsWatched) {
  const sim::Recording r = jump();
  std::vector<double> parts;
  const VideoOptions options = {.width = 81,
                                .height = 281,
                                .fps = 4,
                                .speed = 0.5,
                                .start = 0.25,
                                .end = 0.75,
                                .draw = {.com = true},
                                .hold = 0.6,
                                .progress = [&](double part) { parts.push_back(part); }};
  const Given given = givenToFfmpeg(r, options);
  EXPECT_TRUE(has(given.arguments, "-video_size 82x282 -framerate 4 -i")) << given.arguments;
  EXPECT_EQ(parts, std::vector<double>({0.2, 0.4, 0.6, 0.8, 1}));
  ASSERT_EQ(given.bytes.size(), size_t{3} * 82 * 282 * (5 + 2));
  const auto picture = [](const std::string& bytes, size_t i) {
    Image image(82, 282);
    std::copy_n(bytes.begin() + i * image.rgb.size(), image.rgb.size(), image.rgb.begin());
    return image;
  };
  std::vector<sim::Frame> frames;
  frames.reserve(5);
  for (int i = 0; i < 5; ++i) frames.push_back(frameAt(*testModel(), r, 0.25 + 0.125 * i));
  Offscreen offscreen(testModel(), {.width = 82, .height = 282, .quality = Quality::kFast});
  const auto cameras = offscreen.aim(frames, options.camera);
  const Font& font = testFont();
  const char* const names[] = {"0.25 s  stand  (0.5x)", "0.38 s  flight  (0.5x)",
                               "0.50 s  flight  (0.5x)", "0.62 s  flight  (0.5x)",
                               "0.75 s  land  (0.5x)"};
  for (size_t i = 0; i < 5; ++i) {
    Image image = offscreen.draw(frames[i], cameras[i], options.draw);
    font.draw(image, 7, 4, 14, names[i]);  // letters of a twentieth of the height
    EXPECT_EQ(unlike(image, picture(given.bytes, i)), 0) << i;
  }
  for (const size_t held : {5, 6}) {
    EXPECT_EQ(picture(given.bytes, held).rgb, picture(given.bytes, 4).rgb);
  }
  // At full speed nothing is said of it; letters have at least 13 px.
  VideoOptions plain = {.width = 64, .height = 48, .fps = 1, .end = 0, .hold = 0};
  const std::string labelled = givenToFfmpeg(r, plain).bytes;
  plain.labels = false;
  const std::string bare = givenToFfmpeg(r, plain).bytes;
  ASSERT_EQ(bare.size(), size_t{3} * 64 * 48);
  Image image(64, 48);
  std::copy(bare.begin(), bare.end(), image.rgb.begin());
  font.draw(image, 6, 4, 13, "0.00 s  stand");
  EXPECT_TRUE(labelled == std::string(image.rgb.begin(), image.rgb.end()));
}

TEST(Video, AskedToEndItDoesNotWaitForFfmpeg) {
  const Folder folder;
  const Folder bin;
  std::ofstream(bin / "ffmpeg") << "#!/bin/sh\nexec /bin/sleep 1000\n";
  fs::permissions(bin / "ffmpeg", fs::perms::owner_all);
  const Path path(bin.path().string());
  std::stop_source source;
  source.request_stop();
  const VideoOptions options = {.width = 320, .height = 240, .stop = source.get_token()};
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW(writeVideo(jump(), folder / "a.mp4", options), Process::GivenUp);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(15));
  EXPECT_EQ(folder.files(), 0);
}

TEST(Video, RefusesWhatIsJustTooMuch) {
  const Folder folder;
  // What passes one check fails at the next.
  const auto refusal = [&](const VideoOptions& options) {
    return messageOf<InputError>([&] { writeVideo(jump(), folder / "a.mp4", options); });
  };
  for (const int fps : {1, 240}) {
    EXPECT_TRUE(has(refusal({.fps = fps, .start = 5}), "holds nothing")) << fps;
  }
  for (const int fps : {0, 241}) {
    EXPECT_TRUE(has(refusal({.fps = fps, .start = 5}), "outside [1, 240]")) << fps;
  }
  for (const double speed : {0.001, 1000.0}) {
    EXPECT_TRUE(has(refusal({.speed = speed, .start = 5}), "holds nothing")) << speed;
  }
  for (const double speed : {0.00099, 1001.0}) {
    EXPECT_TRUE(has(refusal({.speed = speed, .start = 5}), "outside [0.001, 1000]")) << speed;
  }
  for (const double hold : {0.0, 60.0}) {
    EXPECT_TRUE(has(refusal({.start = 5, .hold = hold}), "holds nothing")) << hold;
  }
  for (const double hold : {-0.001, 60.001}) {
    EXPECT_TRUE(has(refusal({.start = 5, .hold = hold}), "outside [0, 60]")) << hold;
  }
  EXPECT_TRUE(has(refusal({.end = -1}), "holds nothing"));
  EXPECT_TRUE(has(refusal({.fps = 200, .speed = 0.001}), "200001 pictures"));
  EXPECT_EQ(folder.files(), 0);
}

TEST(Video, SizesAreEvenAndOfEachPicture) {
  const Folder folder;
  const std::pair<int, int> bad[] = {{0, 48}, {64, 0}, {-2, 48}, {64, -2}, {63, 48}, {64, 49}};
  for (const auto& [width, height] : bad) {
    EXPECT_THROW(VideoFile(folder / "a.mp4", width, height, 10), InputError) << width;
  }
  EXPECT_THROW(VideoFile(folder / "a.mp4", 64, 48, 241), InputError);
  EXPECT_NO_THROW(VideoFile(folder / "a.mp4", 2, 2, 1));
  VideoFile video(folder / "a.mp4", 64, 48, 240);
  EXPECT_THROW(video.add(Image(66, 48)), InputError);
  EXPECT_THROW(video.add(Image(64, 46)), InputError);
  EXPECT_NO_THROW(video.add(Image(64, 48)));
}

TEST(WholeFile, NoPartMayBeMissingOrCut) {
  const Folder folder;
  const auto put = [&](const std::string& bytes) {
    std::ofstream(folder / "a", std::ios::binary | std::ios::trunc) << bytes;
    return folder / "a";
  };
  writePng(Image(3, 2), folder / "whole.png");
  const std::string png = textOf(folder / "whole.png");
  EXPECT_TRUE(isWholePng(put(png)));
  for (size_t n = 0; n < png.size(); ++n) EXPECT_FALSE(isWholePng(put(png.substr(0, n)))) << n;
  EXPECT_FALSE(isWholePng(put(png + "x")));
  EXPECT_FALSE(isWholePng(put("x" + png.substr(1))));

  const auto part = [](const std::string& type, const std::string& content = "") {
    const auto length = static_cast<char>(8 + content.size());
    return std::string("\0\0\0", 3) + length + type + content;
  };
  const std::string first = part("ftyp", "abc") + part("moov");
  const std::string mp4 = first + part("mdat", "12345");
  EXPECT_TRUE(isWholeMp4(put(mp4)));
  for (size_t n = 0; n < mp4.size(); ++n) EXPECT_FALSE(isWholeMp4(put(mp4.substr(0, n)))) << n;
  EXPECT_FALSE(isWholeMp4(put(part("ftyp") + part("mdat"))));
  EXPECT_FALSE(isWholeMp4(put(part("moov") + part("mdat"))));
  // Lengths of eight bytes, for parts of more than 4 GB; none is shorter than what says it.
  const auto wide = [](char length) {
    return std::string("\0\0\0\1mdat\0\0\0\0\0\0\0", 15) + length;
  };
  EXPECT_TRUE(isWholeMp4(put(first + wide(16))));
  EXPECT_TRUE(isWholeMp4(put(first + wide(18) + "ab")));
  EXPECT_FALSE(isWholeMp4(put(first + wide(15))));
  EXPECT_FALSE(isWholeMp4(put(first + wide(18) + "a")));
  EXPECT_FALSE(isWholeMp4(put(mp4 + std::string("\0\0\0\7free", 8))));
  EXPECT_FALSE(isWholeMp4(put(mp4 + std::string("\0\0\0\0free", 8))));
  const std::string long_one(300, 'x');  // its length fills two bytes
  EXPECT_TRUE(isWholeMp4(put(first + std::string("\0\0\1\064mdat", 8) + long_one)));

  EXPECT_TRUE(isWholeSvg(put("<svg></svg>")));
  EXPECT_TRUE(isWholeSvg(put("<svg>" + long_one + "</svg>\n \n" + std::string(55, ' '))));
  for (const char* text : {"", " ", "\n", "<svg>", "</svg", "</svg> x", "</svg>x"}) {
    EXPECT_FALSE(isWholeSvg(put(text))) << text;
  }
  for (const auto& is_whole : {isWholePng, isWholeMp4, isWholeSvg}) {
    EXPECT_FALSE(is_whole(folder / "none"));
  }
}

TEST(Video, CutShortIsAnErrorWhateverFfmpegSays) {
  const Folder folder;
  const VideoOptions small = {.width = 64, .height = 48, .fps = 5};
  writeVideo(jump(), folder / "whole.mp4", small);
  EXPECT_TRUE(isWholeMp4(folder / "whole.mp4"));
  const std::string all = textOf(folder / "whole.mp4");
  for (const size_t n : {size_t{0}, size_t{7}, size_t{32}, all.size() / 2, all.size() - 1}) {
    std::ofstream(folder / "cut") << all.substr(0, n);
    EXPECT_FALSE(isWholeMp4(folder / "cut")) << n;
  }
  std::ofstream(folder / "cut") << all << "x";
  EXPECT_FALSE(isWholeMp4(folder / "cut"));
  // A part whose length is said in eight bytes, as more than 4 GB would need: "free", of 20 bytes.
  const std::string wide("\0\0\0\1free\0\0\0\0\0\0\0\24aaaa", 20);
  std::ofstream(folder / "wide") << all << wide;
  EXPECT_TRUE(isWholeMp4(folder / "wide"));
  std::ofstream(folder / "wide") << all << wide.substr(0, 19);
  EXPECT_FALSE(isWholeMp4(folder / "wide"));
  fs::remove(folder / "wide");
  const Folder bin;
  // As on a full disk: complains, ends with 0.
  std::ofstream(bin / "ffmpeg") << "#!/bin/sh\nPATH=/usr/bin:/bin\ncat >/dev/null\n"
                                   "for last; do :; done\nhead -c 500 '"
                                << (folder / "whole.mp4").string()
                                << "' >\"${last#file:}\"\necho No space left >&2\n";
  fs::permissions(bin / "ffmpeg", fs::perms::owner_all);
  const Path path(bin.path().string());
  const std::string message =
      messageOf<SystemError>([&] { writeVideo(jump(), folder / "a.mp4", small); });
  EXPECT_TRUE(has(message, "a.mp4: it was cut short: No space left")) << message;
  EXPECT_EQ(folder.files(), 2);
}

TEST(Video, SaysWhatIsWrongAndLeavesNothing) {
  const Folder folder;
  const VideoOptions small = {.width = 64, .height = 48, .fps = 5};
  {
    const Path path("/nowhere");
    const std::string message =
        messageOf<SystemError>([&] { writeVideo(jump(), folder / "a.mp4", small); });
    EXPECT_TRUE(has(message, "ffmpeg")) << message;
    EXPECT_TRUE(has(message, "PATH")) << message;
  }
  EXPECT_EQ(folder.files(), 0);
  const std::string missing = (folder / "no/a.mp4").string();
  EXPECT_TRUE(has(messageOf<SystemError>([&] { writeVideo(jump(), missing, small); }), missing));
  {
    const Folder bin;
    fakeProgram(bin / "ffmpeg", "Unknown encoder libx264");
    const Path path(bin.path().string());
    const std::string message =
        messageOf<SystemError>([&] { writeVideo(jump(), folder / "a.mp4", small); });
    EXPECT_TRUE(has(message, "ffmpeg failed (exit 3): Unknown encoder libx264")) << message;
  }
  EXPECT_EQ(folder.files(), 0);
  const auto refuses = [&](const VideoOptions& options) {
    EXPECT_THROW(writeVideo(jump(), folder / "a.mp4", options), InputError);
  };
  refuses({.fps = 0});
  refuses({.speed = 0});
  refuses({.speed = NAN});
  refuses({.start = 5});
  refuses({.hold = -1});
  refuses({.speed = 1e-3, .hold = 1e9});
  EXPECT_EQ(folder.files(), 0);
}

// ---------------------------------------------------------------------------------------- figures

Figure example() {
  Figure figure;
  figure.title = "It's `date` \"quoted\" under_score, m/s², \\n";
  figure.width = 500;
  Panel a;
  a.title = "a";
  a.xlabel = "time [s]";
  a.ylabel = "height [m]";
  a.series.push_back({.label = "l_foot", .x = {0, 1, 2, 3}, .y = {1, 2, NAN, 4}});
  a.series.push_back({.label = "mean",
                      .x = {0, 1, 2, 3},
                      .y = {1, 1, 1, 1},
                      .style = Style::kDashed,
                      .low = {0, 0, 0, 0},
                      .high = {2, 2, 2, 3}});
  a.marks = {{0.5, "thrust"}, {0.6, "flight"}, {NAN, "never"}, {2.9, "landing on the ground"}};
  Panel b = a;
  b.log_y = true;
  b.series[0].y = {0, -1, 1e-3, 1e3};
  for (int i = 0; i < 9; ++i) {
    b.series.push_back({.label = "s" + std::to_string(i), .x = {0, 3}, .y = {double(i), 2.0}});
  }
  Panel none;
  none.series.push_back({.label = "x", .x = {}, .y = {}});
  Panel flat;
  flat.log_y = true;
  flat.series.push_back({.label = "", .x = {1}, .y = {0}, .style = Style::kPoints});
  figure.panels = {a, b, none, flat};
  figure.columns = 2;
  return figure;
}

TEST(Figure, PngAndSvgHaveTheirSizeAndTheTextAsItStands) {
  const Folder folder;
  const Figure figure = example();
  writeFigure(figure, folder / "a.png");
  const Image png = readPng(folder / "a.png");
  EXPECT_EQ(png.width, 500);
  EXPECT_GT(png.height, 2 * figure.panel_height);
  EXPECT_EQ(png.at(0, 0), kWhite);
  EXPECT_NE(png.rgb, Image(png.width, png.height).rgb);

  writeFigure(figure, folder / "a.svg");
  const std::string svg = textOf(folder / "a.svg");
  EXPECT_TRUE(has(svg, "width=\"500\""));
  EXPECT_TRUE(has(svg, "</svg>"));
  EXPECT_TRUE(has(svg, "It's `date` \"quoted\" under_score, m/s², \\n"));
  EXPECT_TRUE(has(svg, "l_foot"));
  EXPECT_TRUE(has(svg, "no data"));
  EXPECT_EQ(folder.files(), 2);
}

TEST(Figure, DrawsArrowsAndSquares) {
  const Folder folder;
  Figure figure;
  figure.width = 300;
  Panel squares;
  squares.series.push_back({.label = "",
                            .x = {0, 1, 0, 1},
                            .y = {0, 0, 1, 1},
                            .style = Style::kSquares,
                            .share = {0, 1, 0.5, 1},
                            .side = 1});
  Panel arrows;
  arrows.series.push_back({.label = "bias",
                           .x = {0, 1},
                           .y = {0, 1},
                           .style = Style::kArrows,
                           .dx = {1, -0.5},
                           .dy = {0.5, 1}});
  figure.panels = {squares, arrows};
  writeFigure(figure, folder / "a.png");
  const Image png = readPng(folder / "a.png");
  const auto count = [&](Color c) {
    int n = 0;
    for (int y = 0; y < png.height; ++y) {
      for (int x = 0; x < png.width; ++x) n += png.at(x, y) == c;
    }
    return n;
  };
  // Half of the squares' panel is of the palette's blue, a quarter between it and white.
  EXPECT_GT(count({0, 0x72, 0xB2}), 8000);
  EXPECT_GT(count({0x80, 0xB9, 0xD9}) + count({0x7F, 0xB9, 0xD9}) + count({0x80, 0xB8, 0xD8}) +
                count({0x7F, 0xB8, 0xD8}) + count({0x80, 0xB8, 0xD9}) + count({0x7F, 0xB8, 0xD9}),
            4000);
  writeFigure(figure, folder / "a.svg");
  EXPECT_TRUE(has(textOf(folder / "a.svg"), "bias"));

  figure.panels[1].series[0].dx.pop_back();
  EXPECT_TRUE(has(messageOf<InputError>([&] { writeFigure(figure, folder / "a.png"); }), "1 dx"));
  figure.panels = {squares};
  figure.panels[0].series[0].side = 0;
  EXPECT_THROW(writeFigure(figure, folder / "a.png"), InputError);
}

TEST(Figure, AnyNameIsOnlyAName) {
  const Folder folder;
  const WorkIn here(folder.path());
  Figure figure;
  figure.width = 200;
  figure.panels = {Panel()};
  for (const std::string& name : oddNames()) {
    SCOPED_TRACE(name);
    std::filesystem::create_directory(name);
    const fs::path png = fs::path(name) / (name + ".png");
    const fs::path svg = fs::path(name) / (name + ".svg");
    writeFigure(figure, png);
    writeFigure(figure, svg);
    EXPECT_EQ(readPng(png).width, 200);
    EXPECT_TRUE(has(textOf(svg), "</svg>"));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(name), {}), 2);
  }
  EXPECT_EQ(folder.files(), static_cast<int>(oddNames().size()));
}

TEST(Figure, AnyLabelIsOnlyText) {
  const Folder folder;
  const WorkIn here(folder.path());
  Figure figure;
  for (const std::string& name : oddNames()) {
    Panel panel;
    panel.title = panel.xlabel = panel.ylabel = name;
    panel.marks = {{0.5, name}};
    panel.series.push_back({.label = name, .x = {0, 1}, .y = {0, 1}});
    figure.panels.push_back(panel);
  }
  figure.title = "a\x1b[31m\nset output '|touch PWNED'\\";
  writeFigure(figure, "a.svg");
  const std::string svg = textOf("a.svg");
  EXPECT_TRUE(has(svg, "a\\x1b[31m\\nset output '|touch PWNED'\\"));
  EXPECT_EQ(svg.find('\x1b'), std::string::npos);
  EXPECT_EQ(svg.find('\xff'), std::string::npos);
  EXPECT_EQ(folder.files(), 1);
}

TEST(Figure, DrawsWhateverTerminalThePersonPrefers) {
  const Folder folder;
  for (const char* terminal : {"qt", "nonsense"}) {
    setenv("GNUTERM", terminal, 1);
    EXPECT_NO_THROW(writeFigure(example(), folder / "a.png")) << terminal;
  }
  unsetenv("GNUTERM");
}

/// The lines that gnuplot is told for a figure: an SVG, or a PNG if a whole one is given.
std::vector<std::string> scriptOf(const Figure& figure, const fs::path& png = {}) {
  const Folder bin;
  const fs::path script = bin / "script";
  std::ofstream(bin / "gnuplot") << "#!/bin/sh\ncat > " << script << "\n"
                                 << "sed -n \"s/^set output '\\(.*\\)'$/\\1/p\" " << script
                                 << " | while read -r file; do "
                                 << (png.empty() ? "echo '</svg>'" : "cat '" + png.string() + "'")
                                 << " > \"$file\"; done\n";
  fs::permissions(bin / "gnuplot", fs::perms::owner_all);
  const Path path(bin.path().string() + ":" + getenv("PATH"));
  writeFigure(figure, bin / (png.empty() ? "a.svg" : "a.png"));
  std::ifstream in(script);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// What follows `start` in each of the lines that begin with it.
std::vector<std::string> after(const std::vector<std::string>& lines, const std::string& start) {
  std::vector<std::string> rest;
  for (const std::string& line : lines) {
    if (line.starts_with(start)) rest.push_back(line.substr(start.size()));
  }
  return rest;
}

Figure figureOf(const Series& series) {
  Figure figure;
  figure.panels.emplace_back().series.push_back(series);
  return figure;
}

TEST(Figure, AxesHoldWhatIsDrawnWithALittleRoom) {
  const auto axes = [](const Figure& figure) {
    const auto script = scriptOf(figure);
    return std::array{after(script, "set xrange ").at(0), after(script, "set yrange ").at(0),
                      after(script, "set xtics ").at(0), after(script, "set ytics ").at(0)};
  };
  using Axes = std::array<std::string, 4>;
  // 0.06 of the span above and below; counts have ticks at whole numbers.
  EXPECT_EQ(axes(figureOf({.label = "", .x = {1, 12}, .y = {-10, 10}})),
            (Axes{"[1:12]", "[-11.2:11.2]", "1", "5"}));
  EXPECT_EQ(axes(figureOf({.label = "", .x = {1, 14}, .y = {0, 1}})),
            (Axes{"[1:14]", "[-0.06:1.06]", "autofreq", "0.2"}));
  EXPECT_EQ(axes(figureOf({.label = "", .x = {0, 1.5, 3}, .y = {5, NAN, 7}}))[2], "autofreq");
  // What is not finite is nowhere; bands and arrows are drawn, too.
  EXPECT_EQ(axes(figureOf({.label = "", .x = {0, 1, INFINITY}, .y = {2, INFINITY, 3}}))[0],
            "[0:1]");
  EXPECT_EQ(
      axes(figureOf({.label = "", .x = {0, 1}, .y = {2, 3}, .low = {1, -7}, .high = {2, 13}}))[1],
      "[-8.2:14.2]");
  const Axes arrow = axes(figureOf({.label = "",
                                    .x = {0, 1},
                                    .y = {0, 1},
                                    .style = Style::kArrows,
                                    .dx = {-2, 3},
                                    .dy = {-4, 5}}));
  EXPECT_EQ(arrow[0], "[-2:4]");
  EXPECT_EQ(arrow[1], "[-4.6:6.6]");
  const Axes squares = axes(figureOf({.label = "",
                                      .x = {0, 4},
                                      .y = {0, 2},
                                      .style = Style::kSquares,
                                      .share = {0, 1},
                                      .side = 2}));
  EXPECT_EQ(squares[0], "[-1:5]");
  EXPECT_EQ(squares[1], "[-1:3]");
  EXPECT_EQ(axes(figureOf({.label = "", .x = {1, 13}, .y = {0, 1}}))[2], "1");
  // An arrow that has no end is not drawn.
  for (const auto& [dx, dy] : {std::pair(double(NAN), 100.0), std::pair(100.0, double(INFINITY))}) {
    const Axes pointless = axes(figureOf({.label = "",
                                          .x = {0, 1},
                                          .y = {0, 10},
                                          .style = Style::kArrows,
                                          .dx = {dx, 0},
                                          .dy = {dy, 0}}));
    EXPECT_EQ(pointless[0], "[0:1]");
    EXPECT_EQ(pointless[1], "[-0.6:10.6]");
  }
  // One value, of x or y, and zero.
  EXPECT_EQ(axes(figureOf({.label = "", .x = {3}, .y = {10}}))[0], "[2.5:3.5]");
  EXPECT_EQ(axes(figureOf({.label = "", .x = {3}, .y = {-10}}))[1], "[-11:-9]");
  EXPECT_EQ(axes(figureOf({.label = "", .x = {3}, .y = {0}}))[1], "[-1:1]");
  EXPECT_EQ(axes(figureOf({.label = "", .x = {}, .y = {}}))[0], "[0:1]");

  Figure figure = figureOf({.label = "", .x = {0, 1}, .y = {2, 3}});
  figure.panels[0].least_span = 9;  // 4 more on either side, and 0.06 of 9
  EXPECT_EQ(axes(figure)[1], "[-2.54:7.54]");
  figure.panels[0].least_span = 1;
  figure.panels[0].marks = {{-3, "before"}, {7, "after"}, {NAN, "never"}};
  EXPECT_EQ(axes(figure)[0], "[-3:7]");
  EXPECT_EQ(axes(figure)[1], "[1.94:3.06]");

  figure = figureOf({.label = "", .x = {0, 1, 2}, .y = {-5, 13, 0.13}});
  figure.panels[0].log_y = true;
  auto script = scriptOf(figure);
  EXPECT_EQ(after(script, "set yrange ").at(0), "[0.1:16.9]");
  EXPECT_EQ(after(script, "set format y ").at(0), "'10^{%T}'");
  EXPECT_EQ(after(script, "set logscale").size(), 1U);
  figure.panels[0].series[0].y[2] = 1.3;
  EXPECT_EQ(after(scriptOf(figure), "set format y ").at(0), "'%g'");
  figure.panels[0].series[0].y = {-1, 0, -2};  // nothing positive to show
  EXPECT_EQ(after(scriptOf(figure), "set logscale").size(), 0U);
}

TEST(Figure, PanelsStandInAGridThatFillsIt) {
  Figure figure;
  figure.title = "title";
  figure.width = 900;
  figure.panel_height = 200;
  for (int i = 0; i < 5; ++i) {
    Panel& panel = figure.panels.emplace_back();
    panel.series.push_back({.label = "one", .x = {0, 1}, .y = {0, 1}});
    panel.title = "a";
    panel.xlabel = "time [s]";
  }
  figure.columns = 2;
  const auto places = [&] {
    const auto script = scriptOf(figure);
    std::vector<std::array<double, 4>> all;
    const char* const sides[] = {"l", "r", "t", "b"};
    for (size_t i = 0; i < figure.panels.size(); ++i) {
      auto& place = all.emplace_back();
      for (size_t k = 0; k < 4; ++k) {
        const auto at = after(script, std::string("set ") + sides[k] + "margin at screen ");
        EXPECT_EQ(at.size(), figure.panels.size());
        place[k] = std::stod(at.at(i));
      }
    }
    return all;
  };
  for (const bool shared : {true, false}) {
    if (!shared) figure.panels[4].xlabel = "another";
    const auto at = places();
    // Title 34 px, panels of 200, one more label where they share it.
    const double height = 34 + 3 * 200 + (shared ? 22 : 0);
    EXPECT_EQ(after(scriptOf(figure), "set terminal svg size 900,").at(0).substr(0, 3),
              std::to_string(static_cast<int>(height)));
    for (int i = 0; i < 5; ++i) {
      SCOPED_TRACE(i);
      EXPECT_NEAR(900 * at[i][0], 450 * (i % 2) + 80, 0.1);
      EXPECT_NEAR(900 * at[i][1], 450 * (i % 2 + 1) - 18, 0.1);
      const int row = i / 2;
      const double top = 34 + 200 * row;
      EXPECT_NEAR(height * (1 - at[i][2]), top + 12 + 22, 0.1);  // a row for title and legend
      EXPECT_NEAR(height * (1 - at[i][3]), top + 200 - 26 - (shared ? 0 : 22), 0.1);
    }
  }
  // Labels of marks and a legend of more than four beside the panel need room in all of them.
  figure.panels[0].marks = {{0.5, "half"}};
  for (int i = 0; i < 4; ++i) {
    figure.panels[1].series.push_back({.label = "ten lettrs", .x = {0, 1}, .y = {0, 1}});
  }
  const double height = 34 + 3 * 200;
  for (const auto& place : places()) {
    EXPECT_NEAR(900 * (place[1] - place[0]), 450 - 80 - 18 - (48 + 72), 0.1);
    EXPECT_NEAR(std::fmod(height * (1 - place[2]) - 34, 200), 12 + 22 + 15, 0.1);
  }
  figure.panels[1].series.pop_back();
  for (const auto& place : places()) EXPECT_NEAR(900 * (place[1] - place[0]), 450 - 98, 0.1);
  // The label that all share stands once in each column; else under every panel.
  const auto labels = [&](const std::string& text) {
    int n = 0;
    for (const std::string& line : scriptOf(figure)) n += has(line, "'" + text + "'");
    return n;
  };
  EXPECT_EQ(labels("time [s]"), 4);
  figure.panels[4].xlabel = "time [s]";
  EXPECT_EQ(labels("time [s]"), 2);
}

/// What gnuplot knows when it draws a panel.
struct Told {
  std::map<std::string, std::string> labels;  // what follows each text: its place and looks
  std::map<std::string, std::string> set;     // what follows "set border", "set format x", …
  std::vector<std::string> arrows;
  std::map<std::string, std::vector<std::string>> data;
  std::string plot;
};

std::vector<Told> toldOf(const Figure& figure) {
  std::vector<Told> panels;
  Told now;
  std::map<std::string, std::string> numbered;  // labels
  const auto script = scriptOf(figure);
  for (auto line = script.begin(); line != script.end(); ++line) {
    std::istringstream words(*line);
    std::string verb, what, which, rest;
    words >> verb >> what >> which;
    std::getline(words, rest);
    if (what == "<<") {
      const auto end = std::find(line, script.end(), "EOD");
      now.data[verb].assign(line + 1, end);
      line = end;
    } else if (verb == "set" && what == "label") {
      const size_t end = rest.find("' at ");
      const std::string text = rest.substr(2, end - 2);
      EXPECT_TRUE(numbered.emplace(which, text).second) << *line;
      now.labels[text] = rest.substr(end + 5);
    } else if (verb == "unset" && what == "label") {
      EXPECT_TRUE(numbered.contains(which)) << *line;
      now.labels.erase(numbered[which]);
      numbered.erase(which);
    } else if (verb == "set" && what == "arrow") {
      now.arrows.push_back(rest);
    } else if (verb == "unset" && what == "arrow") {
      now.arrows.clear();
    } else if (verb == "set" && what == "format") {
      now.set[what + which] = rest;
    } else if (verb == "set") {
      now.set[what] = which + rest;
    } else if (verb == "unset") {
      now.set.erase(what);
    } else if (verb == "plot") {
      now.plot = line->substr(5);
      panels.push_back(now);
      now.data.clear();
    }
  }
  return panels;
}

/// The numbers in a text, of places in the window as gnuplot counts them: from its lower left.
std::vector<double> numbersIn(std::string text) {
  std::vector<double> all;
  for (char& c : text) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-') c = ' ';
  }
  std::istringstream words(text);
  for (double x = 0; words >> x;) all.push_back(x);
  return all;
}

TEST(Figure, APanelKnowsNothingOfThoseBefore) {
  Figure figure;
  for (int i = 0; i < 4; ++i) {
    Panel& panel = figure.panels.emplace_back();
    panel.title = "title" + std::to_string(i);
    panel.xlabel = "x" + std::to_string(i);
    panel.ylabel = "y" + std::to_string(i);
    panel.series.push_back({.label = "s", .x = {0.5, 1.5}, .y = {1, 2}});
  }
  figure.panels[1].marks = {{0.75, "mark"}, {1.25, "another"}};
  figure.panels[1].log_y = true;
  figure.title = "heading";
  figure.columns = 2;
  const auto told = toldOf(figure);
  ASSERT_EQ(told.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(i);
    const Told& t = told[i];
    const std::string n = std::to_string(i);
    std::vector<std::string> texts = {"title" + n, "x" + n, "y" + n};
    if (i == 0) texts.insert(texts.begin(), "heading");
    if (i == 1) texts.insert(texts.begin(), {"another", "mark"});
    std::vector<std::string> labels;
    for (const auto& [text, looks] : t.labels) labels.push_back(text);
    EXPECT_EQ(labels, texts);
    EXPECT_EQ(t.arrows.size(), i == 1 ? 2U : 0U);
    EXPECT_EQ(t.set.contains("logscale"), i == 1);
    EXPECT_EQ(has(t.set.at("ytics"), "autofreq"), i == 1);
    EXPECT_TRUE(has(t.set.at("formaty"), "%g"));
    EXPECT_TRUE(has(t.set.at("formatx"), "%g"));
    EXPECT_TRUE(t.set.contains("multiplot"));
    EXPECT_EQ(t.set.at("encoding"), "utf8");
    EXPECT_EQ(t.data.size(), 1U);
  }
  // All is on one page, and the file is closed after it.
  const auto script = scriptOf(figure);
  const auto last = std::find_if(script.rbegin(), script.rend(),
                                 [](const std::string& l) { return l.starts_with("plot"); });
  ASSERT_EQ(last - script.rbegin(), 2);
  EXPECT_EQ(script[script.size() - 2], "unset multiplot");
  EXPECT_EQ(script.back(), "set output");
}

TEST(Figure, TextStandsInTheRoomLeftForIt) {
  Figure figure;
  figure.title = "heading";
  figure.width = 500;
  figure.panel_height = 300;
  for (int i = 0; i < 2; ++i) {
    Panel& panel = figure.panels.emplace_back();
    panel.title = "title";
    panel.xlabel = i == 0 ? "across" : "across too";
    panel.ylabel = "up";
    panel.series.push_back({.label = "s", .x = {0, 1}, .y = {1, 2}});
    panel.marks = {{0.5, "mark"}};
  }
  const auto told = toldOf(figure);
  const double height = 34 + 2 * 300;  // a heading, two panels with a label of their own
  for (int i = 0; i < 2; ++i) {
    SCOPED_TRACE(i);
    // A panel from the top: 12 px, the title's and the marks' rows, the plot, numbers, label.
    const double top = 34 + 300 * i + 12;
    const double frame = top + 22 + 15;
    const double bottom = 34 + 300 * (i + 1) - 26 - 22;
    const auto expect_at = [&](const std::string& place, double x, double y) {
      const auto at = numbersIn(place);
      ASSERT_GE(at.size(), 2U) << place;
      EXPECT_NEAR(500 * at[0], x, 0.01) << place;
      EXPECT_NEAR(height * (1 - at[1]), y, 0.01) << place;
    };
    const Told& t = told.at(i);
    expect_at(t.labels.at("title"), 80, top + 0.4 * 22);
    expect_at(t.labels.at(figure.panels[i].xlabel), (80 + 482) / 2.0, bottom + 26 + 11);
    expect_at(t.labels.at("up"), 14, (frame + bottom) / 2);
    expect_at(t.set.at("key"), 482, top + 0.4 * 22);
    if (i == 0) expect_at(t.labels.at("heading"), 250, 0.55 * 34);
    EXPECT_TRUE(has(t.labels.at("up"), "center rotate"));
    EXPECT_TRUE(has(t.set.at("key"), "right center horizontal"));
    // The heading is larger, marks are smaller than the rest.
    const auto size = [&](const std::string& text) {
      const std::string looks = t.labels.at(text);
      return numbersIn(looks.substr(looks.find("font")))[0];
    };
    for (const std::string text : {"title", "up"}) EXPECT_EQ(size(text), 12) << text;
    EXPECT_EQ(size(figure.panels[i].xlabel), 12);
    EXPECT_EQ(size("mark"), 11);
    if (i == 0) {
      EXPECT_EQ(size("heading"), 15);
    }
    EXPECT_TRUE(has(t.set.at("terminal"), "font 'DejaVu Sans,12'"));
  }
  // Without a title, a legend or marks their rows are the plot's.
  figure = figureOf({.label = "", .x = {0, 1}, .y = {1, 2}});
  figure.panel_height = 300;
  const Told bare = toldOf(figure).at(0);
  EXPECT_TRUE(has(bare.set.at("terminal"), "size 900,322 "));
  EXPECT_NEAR(322 * (1 - numbersIn(bare.set.at("tmargin"))[0]), 12, 0.01);
  EXPECT_NEAR(322 * (1 - numbersIn(bare.set.at("bmargin"))[0]), 274, 0.01);
  EXPECT_NEAR(900 * numbersIn(bare.set.at("rmargin"))[0], 882, 0.01);
  // A legend alone needs the row, one beside the panel does not.
  figure.panels[0].series[0].label = "s";
  EXPECT_NEAR(322 * (1 - numbersIn(toldOf(figure)[0].set.at("tmargin"))[0]), 34, 0.01);
  for (int i = 0; i < 4; ++i) figure.panels[0].series.push_back(figure.panels[0].series[0]);
  figure.panels[0].series[3].label = "zehn Wörté";  // bytes are not letters
  const Told beside = toldOf(figure)[0];
  EXPECT_NEAR(322 * (1 - numbersIn(beside.set.at("tmargin"))[0]), 12, 0.01);
  EXPECT_NEAR(900 * numbersIn(beside.set.at("rmargin"))[0], 882 - 48 - 72, 0.01);
  EXPECT_NEAR(900 * numbersIn(beside.set.at("key"))[0], 882 - 48 - 72 + 6, 0.01);
  EXPECT_NEAR(322 * (1 - numbersIn(beside.set.at("key"))[1]), 12, 0.01);
  EXPECT_TRUE(has(beside.set.at("key"), "left top vertical"));
  // However small the figure, something of the plot is left.
  figure.width = figure.panel_height = 100;
  figure.panels.push_back(
      {.title = "t", .xlabel = "x", .ylabel = "", .series = {}, .marks = {{0, "m"}}});
  const Told small = toldOf(figure).at(1);
  EXPECT_NEAR(100 * (numbersIn(small.set.at("rmargin"))[0] - numbersIn(small.set.at("lmargin"))[0]),
              40, 0.01);
  EXPECT_NEAR(200 * (numbersIn(small.set.at("tmargin"))[0] - numbersIn(small.set.at("bmargin"))[0]),
              30, 0.01);
}

TEST(Figure, LettersOfAPngAreAsLargeAsThoseOfAnSvg) {
  // pngcairo counts them in points of 4/3 pixels.
  const Folder folder;
  writeFigure(figureOf({.label = "", .x = {0, 1}, .y = {1, 2}}), folder / "whole.png");
  Figure figure = figureOf({.label = "", .x = {0, 1}, .y = {1, 2}});
  figure.title = "heading";
  const auto sizes = [](const std::vector<std::string>& script) {
    std::vector<double> all;
    for (const std::string& line : script) {
      const size_t at = line.find("font '");
      if (at != std::string::npos) all.push_back(numbersIn(line.substr(line.find(',', at)))[0]);
    }
    return all;
  };
  const auto svg = sizes(scriptOf(figure));
  const auto png_script = scriptOf(figure, folder / "whole.png");
  EXPECT_TRUE(after(png_script, "set terminal ").at(0).starts_with("pngcairo size"));
  const auto png = sizes(png_script);
  ASSERT_GE(svg.size(), 4U);
  ASSERT_EQ(png.size(), svg.size());
  for (size_t i = 0; i < svg.size(); ++i) EXPECT_EQ(png[i], 0.75 * svg[i]);
}

TEST(Figure, ThePictureHasItsFrameGridMarksAndLinesInPlace) {
  const Folder folder;
  Figure figure = figureOf({.label = "", .x = {0, 10}, .y = {5, 5}});
  figure.width = 500;
  figure.panel_height = 300;
  figure.panels[0].marks = {{3.5, ""}};
  writeFigure(figure, folder / "a.png");
  const Image png = readPng(folder / "a.png");
  ASSERT_EQ(png.height, 322);
  // The plot: from (80, 12) to (482, 274), of x from 0 to 10 and y from 4.5 to 5.5.
  const auto x_of = [](double x) { return 80 + static_cast<int>(40.2 * x); };
  /// The darkest within two pixels across.
  const auto at = [&](int x, int y, int dx, int dy) {
    int darkest = 255;
    for (int k = -2; k <= 2; ++k)
      darkest = std::min<int>(darkest, png.at(x + k * dx, y + k * dy).r);
    return darkest;
  };
  const int row = 205;                // between two lines of the grid
  EXPECT_LT(at(80, row, 1, 0), 150);  // the axes,
  EXPECT_LT(at(x_of(2.5), 274, 0, 1), 150);
  EXPECT_EQ(at(482 + 4, row, 1, 0), 255);  // on two sides only
  EXPECT_EQ(at(x_of(2.5), 12 - 3, 0, 1), 255);
  EXPECT_NEAR(at(x_of(2), row, 1, 0), 0xE4, 12);  // the grid
  EXPECT_NEAR(at(x_of(2.5), 274 - 52, 0, 1), 0xE4, 12);
  EXPECT_EQ(at(x_of(2.5), row, 1, 0), 255);  // and nothing between
  EXPECT_LT(at(x_of(2), 275, 1, 0), 150);    // ticks outwards
  EXPECT_EQ(at(x_of(2.5), 275, 1, 0), 255);
  EXPECT_EQ(at(x_of(2) + 6, 274 - 4, 1, 0), 255);
  int dashes = 0;  // a mark
  for (int y = 20; y < 270; ++y) dashes += at(x_of(3.5), y, 1, 0) < 0xD0;
  EXPECT_GT(dashes, 100);
  EXPECT_LT(dashes, 220);
  EXPECT_LT(png.at(x_of(4.5), 143).r, 60);  // the line, in blue
  EXPECT_GT(png.at(x_of(4.5), 143).b, 150);
  EXPECT_EQ(at(x_of(4.5), 143 - 6, 0, 1), 255);
}

TEST(Figure, SquaresHaveAScaleOfTheirColours) {
  const Folder folder;
  Figure figure = figureOf(
      {.label = "", .x = {0}, .y = {0}, .style = Style::kSquares, .share = {0.5}, .side = 1});
  figure.width = 300;
  figure.panel_height = 300;
  writeFigure(figure, folder / "a.png");
  const Image png = readPng(folder / "a.png");
  // 62 px are left for it: the plot ends at 220, and 12 px from there it is 12 px wide.
  const Color blue = {0, 0x72, 0xB2};
  const auto share = [&](int x, int y) { return (255.0 - png.at(x, y).r) / (255 - blue.r); };
  EXPECT_NEAR(share(150, 100), 0.5, 0.02);  // the one square
  for (const double part : {0.1, 0.5, 0.9}) {
    const int y = 274 - static_cast<int>(part * (274 - 12));
    for (const int x : {234, 238, 242}) EXPECT_NEAR(share(x, y), part, 0.03) << x;
    EXPECT_EQ(png.at(226, y), kWhite);
  }
  const Told told = toldOf(figure).at(0);
  const auto box = numbersIn(told.set.at("colorbox"));
  ASSERT_EQ(box.size(), 4U);
  EXPECT_NEAR(300 * box[0], 220 + 12, 0.01);
  EXPECT_NEAR(322 * (1 - box[1]), 274, 0.01);
  EXPECT_NEAR(300 * box[2], 12, 0.01);
  EXPECT_NEAR(322 * box[3], 274 - 12, 0.01);
  EXPECT_TRUE(told.set.at("cbtics").starts_with("0.25 "));
  // Others have neither the scale nor the room.
  figure.panels[0].series[0] = {.label = "", .x = {0, 1}, .y = {0, 1}};
  const Told without = toldOf(figure).at(0);
  EXPECT_FALSE(without.set.contains("colorbox"));
  EXPECT_NEAR(300 * numbersIn(without.set.at("rmargin"))[0], 282, 0.01);
}

TEST(Figure, TicksAreOneTwoOrFiveAtLeastTwentyFivePixelsApart) {
  const auto ticks = [](double span) {  // of the numbers: 1.12 of it is the axis, of 222 px
    return after(scriptOf(figureOf({.label = "", .x = {0.5, 1}, .y = {0, span}})), "set ytics ")
        .at(0);
  };
  const double one = 222 / 25.0 / 1.12;  // ticks of 1 are 25 px apart
  EXPECT_EQ(ticks(0.99 * one), "1");
  EXPECT_EQ(ticks(one * (1 + 1e-10)), "1");
  EXPECT_EQ(ticks(1.01 * one), "2");
  EXPECT_EQ(ticks(1.99 * one), "2");
  EXPECT_EQ(ticks(2.01 * one), "5");
  EXPECT_EQ(ticks(4.99 * one), "5");
  EXPECT_EQ(ticks(5.01 * one), "10");
  EXPECT_EQ(ticks(0.0501 * one), "0.1");
}

TEST(Figure, EachStyleIsDrawnItsWay) {
  Figure figure = figureOf({.label = "a 'b'", .x = {0, 1}, .y = {0, 1}});
  Panel& panel = figure.panels[0];
  for (const Style style : {Style::kDashed, Style::kStep, Style::kPoints, Style::kCrosses}) {
    panel.series.push_back({.label = "", .x = {0, 1}, .y = {0, 1}, .style = style, .color = 0});
  }
  panel.series.push_back({.label = "", .x = {}, .y = {}});
  panel.series.push_back(
      {.label = "", .x = {1}, .y = {2}, .style = Style::kArrows, .color = 1, .dx = {3}, .dy = {4}});
  for (const char* label : {"", "share"}) {
    panel.series.push_back(
        {.label = label, .x = {1}, .y = {2}, .style = Style::kSquares, .share = {0.25}, .side = 3});
  }
  panel.series.push_back(
      {.label = "", .x = {0, 1}, .y = {1, 1}, .low = {0, 0}, .high = {2, 2}, .color = 2});
  const Told told = toldOf(figure).at(0);
  std::vector<std::string> parts;
  const std::string plot = told.plot + ", ";
  for (size_t from = 0; from < plot.size();) {
    const size_t to = plot.find(", ", from);
    parts.push_back(plot.substr(from, to - from));
    from = to + 2;
  }
  ASSERT_EQ(parts.size(), 10U) << plot;
  // Bands lie behind everything.
  const char* const expected[][2] = {{"$d0_9 using 1:3:4 with filledcurves", "'#009E73'"},
                                     {"$d0_0 using 1:2 with lines ", "dashtype 1 "},
                                     {"$d0_1 using 1:2 with lines ", "dashtype (8,5) "},
                                     {"$d0_2 using 1:2 with steps ", "dashtype 1 "},
                                     {"$d0_3 using 1:2 with points pointtype 7 ", "'#0072B2'"},
                                     {"$d0_4 using 1:2 with points pointtype 2 ", "'#0072B2'"},
                                     {"$d0_6 using 1:2:5:6 with vectors head ", "'#D55E00'"},
                                     {"$d0_7 using 1:2:5:5:6 with boxxyerror ", "notitle"},
                                     {"$d0_8 using 1:2:5:5:6 with boxxyerror ", "title 'share'"},
                                     {"$d0_9 using 1:2 with lines ", "'#009E73'"}};
  for (size_t i = 0; i < parts.size(); ++i) {
    EXPECT_TRUE(parts[i].starts_with(expected[i][0])) << parts[i];
    EXPECT_TRUE(has(parts[i], expected[i][1])) << parts[i];
    EXPECT_EQ(has(parts[i], "notitle"), i != 1 && i != 8) << parts[i];
  }
  EXPECT_TRUE(parts[1].ends_with("title 'a ''b'''"));
  EXPECT_FALSE(told.data.contains("$d0_5"));  // of nothing
  // Steps of a colour that comes again are dashed, too; where nothing can be drawn it says so.
  figure.panels[0].series.clear();
  for (int i = 0; i < 8; ++i) {
    figure.panels[0].series.push_back({.label = "", .x = {0}, .y = {0}, .style = Style::kStep});
  }
  const std::string steps = toldOf(figure).at(0).plot;
  EXPECT_EQ(steps.find("dashtype (8,5)"), steps.rfind("dashtype (8,5)"));
  EXPECT_GT(steps.find("dashtype (8,5)"), steps.find("$d0_7"));
  figure.panels[0].series = {
      {.label = "s", .x = {7, 8}, .y = {NAN, NAN}, .low = {NAN, NAN}, .high = {NAN, NAN}}};
  for (const bool with_x : {true, false}) {
    if (!with_x) figure.panels[0].series = {{.label = "s", .x = {NAN}, .y = {5}}};
    const Told empty = toldOf(figure).at(0);
    EXPECT_EQ(empty.plot, "NaN notitle");
    EXPECT_TRUE(empty.labels.contains("no data"));
    EXPECT_EQ(empty.set.at("xrange"), "[0:1]");
    EXPECT_EQ(empty.set.at("yrange"), "[-0.06:1.06]");
  }
  EXPECT_FALSE(told.labels.contains("no data"));
}

TEST(Figure, WhatHasNoLogarithmIsAGap) {
  Figure figure = figureOf({.label = "",
                            .x = {0, 1, 2, 3},
                            .y = {-5, 13, 0.13, 0},
                            .low = {0, 1, 0.5, 1},
                            .high = {1, 1, 1, 13}});
  figure.panels[0].log_y = true;
  const Told told = toldOf(figure).at(0);
  EXPECT_EQ(told.set.at("yrange"), "[0.1:16.9]");
  EXPECT_EQ(told.data.at("$d0_0"),
            std::vector<std::string>({"0 NaN NaN 1", "1 13 1 1", "2 0.13 0.5 1", "3 NaN 1 13"}));
}

TEST(Figure, SeriesOfUnequalLengthsAreRefused) {
  const Series line = {.label = "wrong", .x = {0, 1}, .y = {0, 1}};
  Series band = line;
  band.low = band.high = {0, 1};
  Series arrows = line;
  arrows.style = Style::kArrows;
  arrows.dx = arrows.dy = {0, 1};
  Series squares = line;
  squares.style = Style::kSquares;
  squares.share = {0, 1};
  squares.side = 1;
  Series none;
  none.style = Style::kSquares;  // of no squares, which need no side
  for (const Series& s : {line, band, arrows, squares, none}) {
    EXPECT_NO_THROW(scriptOf(figureOf(s)));
    using Vector = std::vector<double> Series::*;
    for (const Vector v : {&Series::x, &Series::y, &Series::low, &Series::high, &Series::dx,
                           &Series::dy, &Series::share}) {
      Series wrong = s;
      (wrong.*v).push_back(2);
      EXPECT_TRUE(has(messageOf<InputError>([&] { scriptOf(figureOf(wrong)); }), "figure: series"));
    }
  }
  band.low = band.high = {0};
  EXPECT_THROW(scriptOf(figureOf(band)), InputError);
  for (const double side : {0.0, -1.0, double(NAN)}) {
    squares.side = side;
    EXPECT_THROW(scriptOf(figureOf(squares)), InputError) << side;
  }
}

TEST(Figure, SeriesDifferInColourThenInDashes) {
  Figure figure;
  Panel& panel = figure.panels.emplace_back();
  for (int i = 0; i < 9; ++i) {
    panel.series.push_back({.label = "s", .x = {0, 1}, .y = {0, 1}});
    if (i == 2) panel.series.push_back({.label = "grey", .x = {0}, .y = {0}, .color = kGrey});
    if (i == 4) panel.series.push_back({.label = "own", .x = {0}, .y = {0}, .color = 1});
  }
  panel.series.push_back(
      {.label = "dashed", .x = {0}, .y = {0}, .style = Style::kDashed, .color = 0});
  const std::string plot = after(scriptOf(figure), "plot ").at(0);
  std::vector<std::string> colors;
  std::vector<bool> dashed;
  for (size_t at = 0; (at = plot.find("with lines", at)) != std::string::npos; ++at) {
    dashed.push_back(plot.compare(plot.find("dashtype ", at) + 9, 1, "(") == 0);
    colors.push_back(plot.substr(plot.find('#', at), 7));
  }
  ASSERT_EQ(colors.size(), 12U);
  const std::string grey = colors[3];
  EXPECT_EQ(colors[6], colors[1]);  // the one that chose its own
  EXPECT_EQ(colors[11], colors[0]);
  EXPECT_EQ(dashed, std::vector<bool>({0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1}));
  colors.erase(colors.begin() + 11);
  colors.erase(colors.begin() + 6);
  colors.erase(colors.begin() + 3);
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_NE(colors[i], grey);
    for (size_t k = 0; k < i; ++k) EXPECT_NE(colors[i], colors[k]);
  }
  EXPECT_EQ(colors[7], colors[0]);
  EXPECT_EQ(colors[8], colors[1]);
}

TEST(Figure, DataAreWrittenAsTheyAre) {
  Figure figure = figureOf(
      {.label = "", .x = {0.125, 2}, .y = {-1e-7, NAN}, .low = {-2, 3}, .high = {4, INFINITY}});
  figure.panels[0].series.push_back(
      {.label = "", .x = {1}, .y = {2}, .style = Style::kArrows, .dx = {3}, .dy = {-4}});
  figure.panels[0].series.push_back(
      {.label = "", .x = {1}, .y = {2}, .style = Style::kSquares, .share = {0.25}, .side = 3});
  const auto script = scriptOf(figure);
  const auto data = [&](const std::string& name) {
    const auto at = std::find(script.begin(), script.end(), name + " << EOD");
    EXPECT_NE(at, script.end());
    return std::vector<std::string>(at + 1, std::find(at, script.end(), "EOD"));
  };
  EXPECT_EQ(data("$d0_0"), std::vector<std::string>({"0.125 -1e-07 -2 4", "2 NaN 3 NaN"}));
  EXPECT_EQ(data("$d0_1"), std::vector<std::string>({"1 2 NaN NaN 3 -4"}));
  EXPECT_EQ(data("$d0_2"), std::vector<std::string>({"1 2 NaN NaN 1.5 0.25"}));
}

TEST(Figure, AMarksLabelIsLeftOutWhereItWouldRunIntoAnother) {
  Figure figure = figureOf({.label = "", .x = {0, 10}, .y = {0, 1}});
  figure.width = 598;  // 500 px of plot, 50 px a second
  figure.panels[0].marks = {{0, "ten lettrs"}, {1, "no"},  {2, "yes"},      {NAN, "no"},
                            {5, ""},           {9, "ten"}, {9.9, "nothing"}};
  const auto script = scriptOf(figure);
  std::vector<std::string> labels;
  for (const std::string& line : script) {
    if (has(line, "graph 1 left offset")) labels.push_back(line.substr(line.find('\''), 4));
  }
  EXPECT_EQ(labels, std::vector<std::string>({"'ten", "'yes", "'ten"}));
  EXPECT_EQ(after(script, "set arrow from first ").size(), 6U);
  // Ten letters of 0.85 · 7.2 px and half a letter's room are 64.8 px, wherever the axis begins; a
  // label may end where the panel does, 18 px from its plot.
  for (const double begin : {0.0, 40.0, -7.0}) {
    const auto shown = [&](double x, const std::string& label) {
      figure.panels[0].series[0].x = {begin, begin + 10};
      figure.panels[0].marks = {{begin, "zehn Wörté"}, {begin + x / 50, label}};
      const Told told = toldOf(figure).at(0);
      EXPECT_EQ(told.labels.count("zehn Wörté"), 1U);
      return told.labels.contains(label);
    };
    EXPECT_TRUE(shown(65, "next"));
    EXPECT_FALSE(shown(64.5, "next"));
    EXPECT_TRUE(shown(518 - 61.3, "ten lettrs"));
    EXPECT_FALSE(shown(518 - 61.1, "ten lettrs"));
  }
}

TEST(Figure, SizesHaveBounds) {
  const auto accepted = [](int columns, int width, int height) {
    Figure figure = figureOf({.label = "", .x = {0}, .y = {0}});
    figure.columns = columns;
    figure.width = width;
    figure.panel_height = height;
    try {
      scriptOf(figure);
    } catch (const InputError&) {
      return false;
    }
    return true;
  };
  EXPECT_TRUE(accepted(1, 100, 100));
  EXPECT_TRUE(accepted(9, 8000, 4000));
  EXPECT_FALSE(accepted(0, 500, 500));
  EXPECT_FALSE(accepted(1, 99, 500));
  EXPECT_FALSE(accepted(1, 8001, 500));
  EXPECT_FALSE(accepted(1, 500, 99));
  EXPECT_FALSE(accepted(1, 500, 4001));
}

TEST(Figure, CutShortIsAnErrorThoughGnuplotIsContent) {
  const Folder folder;
  for (const std::string ending : {".png", ".svg"}) {
    const fs::path whole = folder / ("whole" + ending);
    const auto is_whole = ending == ".png" ? isWholePng : isWholeSvg;
    writeFigure(example(), whole);
    const std::string all = textOf(whole);
    for (const size_t n : {size_t{0}, size_t{20}, all.size() / 2, all.size() - 5}) {
      std::ofstream(folder / "cut") << all.substr(0, n);
      EXPECT_FALSE(is_whole(folder / "cut")) << n;
    }
    fs::remove(folder / "cut");
    const Folder bin;
    std::ofstream(bin / "gnuplot")
        << "#!/bin/sh\nPATH=/usr/bin:/bin\nto=$(sed -n \"s/^set output '\\(.*\\)'/\\1/p\")\n"
        << "head -c 1000 '" << whole.string() << "' >\"$to\"\n";
    fs::permissions(bin / "gnuplot", fs::perms::owner_all);
    const Path path(bin.path().string());
    const std::string message =
        messageOf<SystemError>([&] { writeFigure(example(), folder / ("a" + ending)); });
    EXPECT_TRUE(has(message, "cut short")) << message;
    EXPECT_FALSE(fs::exists(folder / ("a" + ending)));
  }
  EXPECT_EQ(folder.files(), 2);
}

TEST(Figure, SaysWhatIsWrongAndLeavesNothing) {
  const Folder folder;
  Figure figure = example();
  EXPECT_TRUE(has(messageOf<InputError>([&] { writeFigure(figure, folder / "a.pdf"); }), "a.pdf"));
  const std::string missing = (folder / "no/a.png").string();
  EXPECT_TRUE(has(messageOf<SystemError>([&] { writeFigure(figure, missing); }), missing));
  {
    const Path path("/nowhere");
    const std::string message =
        messageOf<SystemError>([&] { writeFigure(figure, folder / "a.png"); });
    EXPECT_TRUE(has(message, "gnuplot")) << message;
  }
  {
    const Folder bin;
    std::ofstream(bin / "gnuplot") << "#!/bin/sh\n/bin/cat >/dev/null\necho 'it rains' >&2\n";
    fs::permissions(bin / "gnuplot", fs::perms::owner_all);
    const Path path(bin.path().string());
    const std::string message =
        messageOf<SystemError>([&] { writeFigure(figure, folder / "a.png"); });
    EXPECT_TRUE(has(message, "a.png: gnuplot drew nothing: it rains")) << message;
  }
  {
    const Folder bin;
    fakeProgram(bin / "gnuplot", "unknown or ambiguous terminal type");
    const Path path(bin.path().string());
    const std::string message =
        messageOf<SystemError>([&] { writeFigure(figure, folder / "a.png"); });
    EXPECT_TRUE(has(message, "unknown or ambiguous terminal type")) << message;
  }
  figure.panels[0].series[0].y.pop_back();
  EXPECT_TRUE(has(messageOf<InputError>([&] { writeFigure(figure, folder / "a.png"); }), "l_foot"));
  figure.panels.clear();
  EXPECT_THROW(writeFigure(figure, folder / "a.png"), InputError);
  EXPECT_EQ(folder.files(), 0);
}

TEST(StandardFigures, JointsInPairs) {
  const Figure figure = jointFigure(jump());
  ASSERT_EQ(figure.panels.size(), 1u);
  const Panel& panel = figure.panels[0];
  EXPECT_EQ(panel.title, "swing");
  ASSERT_EQ(panel.series.size(), 2u);
  EXPECT_EQ(panel.series[0].label, "left");
  EXPECT_NEAR(panel.series[0].y.back(), 1, 1e-9);
  EXPECT_NEAR(panel.series[1].y.back(), 0, 1e-9);
  ASSERT_EQ(panel.marks.size(), 3u);
  EXPECT_EQ(panel.marks[2].label, "land");
}

/// A recording of one frame of a body with these joints.
sim::Recording withJoints(const std::vector<std::string>& joints) {
  sim::Recording r;
  r.mjcf = "<mujoco><worldbody><body><freejoint/><geom size='.1'/>";
  for (const std::string& joint : joints) {
    r.mjcf += "<body><joint name='" + joint + "'/><geom size='.1'/></body>";
  }
  r.mjcf += "</body></worldbody></mujoco>";
  const auto model = sim::Model::fromMjcf(r.mjcf);
  sim::Frame& f = r.frames.emplace_back();
  f.state = model->initialState();
  for (const sim::Joint& j : model->joints()) f.state.q[j.q] = 0.01 * j.q;
  return r;
}

TEST(StandardFigures, MoreJointsStandInMoreColumns) {
  const auto figure = [](int n) {
    std::vector<std::string> joints;
    joints.reserve(n);
    for (int i = 0; i < n; ++i) joints.push_back("joint" + std::to_string(i));
    const Figure f = jointFigure(withJoints(joints));
    EXPECT_EQ(static_cast<int>(f.panels.size()), std::max(n, 1));
    return std::array{f.columns, f.width, f.panel_height};
  };
  for (const int n : {0, 1, 3}) EXPECT_EQ(figure(n), (std::array{1, 900, 240})) << n;
  for (const int n : {4, 12}) EXPECT_EQ(figure(n), (std::array{2, 900, 180})) << n;
  for (const int n : {13, 20}) EXPECT_EQ(figure(n), (std::array{3, 1350, 180})) << n;
}

TEST(StandardFigures, SidesAreToldByEveryHabit) {
  const auto panels = [](const std::vector<std::string>& joints) {
    std::vector<std::string> titles;
    for (const Panel& p : jointFigure(withJoints(joints)).panels) {
      titles.push_back(p.title + (p.series.size() == 2 ? "+" : ""));
    }
    return titles;
  };
  for (const auto& [left, right] :
       {std::pair("left_hip", "right_hip"), std::pair("Lefthip", "Righthip"),
        std::pair("left-hip", "right-hip"), std::pair("l_hip", "r_hip"),
        std::pair("L_hip", "R_hip"), std::pair("l-hip", "r-hip"),
        std::pair("hip_left", "hip_right"), std::pair("hipLeft", "hipRight"),
        std::pair("hip-left", "hip-right"), std::pair("hip_l", "hip_r"),
        std::pair("hip_L", "hip_R"), std::pair("hip-l", "hip-r")}) {
    EXPECT_EQ(panels({"neck", right, left}), std::vector<std::string>({"hip+", "neck"})) << left;
    const Panel pair = jointFigure(withJoints({right, left})).panels[0];
    EXPECT_EQ(pair.series[0].label + pair.series[1].label, "rightleft");
    EXPECT_NE(pair.series[0].color, pair.series[1].color);
    EXPECT_EQ(pair.series[0].style, Style::kDashed);
    EXPECT_EQ(pair.series[1].style, Style::kLine);
    EXPECT_NEAR(pair.series[1].y[0] - pair.series[0].y[0], 0.01, 1e-12);
  }
  EXPECT_EQ(panels({"l_hip", "l_knee"}), std::vector<std::string>({"l_hip", "l_knee"}));
  EXPECT_EQ(panels({"larm", "rarm"}), std::vector<std::string>({"larm", "rarm"}));
}

TEST(StandardFigures, CentreOfMassAndContacts) {
  const Folder folder;
  const Figure com = comFigure(jump());
  ASSERT_EQ(com.panels.size(), 2u);
  EXPECT_NEAR(com.panels[0].series[2].y[50], 0.4, 1e-9);
  EXPECT_NEAR(com.panels[1].series[0].y[50], 1.25, 1e-9);
  writeFigure(com, folder / "com.png");

  const Figure contact = contactFigure(jump());
  const auto& series = contact.panels.at(0).series;
  ASSERT_EQ(series.size(), 2u);
  const double weight = testModel()->mass() * 9.81;
  EXPECT_EQ(series[0].label, "trunk");
  EXPECT_NEAR(series[0].y[0], weight, 1e-9);
  EXPECT_EQ(series[0].y[31], 0);             // contact has just ended
  EXPECT_TRUE(std::isnan(series[0].y[50]));  // far from any contact: nothing drawn
  EXPECT_NEAR(series[1].y[0], weight, 1e-9);
}

TEST(StandardFigures, ContactForcesAreThoseOnTheRobot) {
  sim::Recording r = jump();
  const auto model = testModel();
  const sim::BodyId trunk = model->body("trunk");
  const sim::BodyId arm = model->body("l_arm");
  sim::Contact ground{{0}, trunk, {0, 0, 0}, {0, 0, 1}, {3, 4, 5}};
  sim::Contact turned{trunk, {0}, {0, 0, 0}, {0, 0, 1}, {0, 0, -7}};
  sim::Contact itself{arm, trunk, {0, 0, 0}, {0, 0, 1}, {0, 0, 11}};
  for (sim::Frame& f : r.frames) f.contacts.clear();
  r.frames[20].contacts = {ground, turned, itself};
  r.frames[21].contacts = {turned};
  const Figure figure = contactFigure(r);
  const auto& series = figure.panels.at(0).series;
  ASSERT_EQ(series.size(), 2U);  // and the weight
  EXPECT_TRUE(std::isnan(series[0].y[18]));
  EXPECT_EQ(series[0].y[19], 0);
  EXPECT_EQ(series[0].y[20], 12);
  EXPECT_EQ(series[0].y[21], 7);
  EXPECT_EQ(series[0].y[22], 0);
  EXPECT_TRUE(std::isnan(series[0].y[23]));
  r.frames[0].contacts = {ground};
  r.frames[100].contacts = {ground};
  const auto ends = contactFigure(r).panels.at(0).series[0].y;
  EXPECT_EQ(ends[0], 5);
  EXPECT_EQ(ends[1], 0);
  EXPECT_TRUE(std::isnan(ends[2]));
  EXPECT_TRUE(std::isnan(ends[98]));
  EXPECT_EQ(ends[99], 0);
  EXPECT_EQ(ends[100], 5);
}

TEST(StandardFigures, SayWhatTheyShow) {
  sim::Recording r = jump();
  for (size_t i = 0; i < r.frames.size(); ++i) {
    const double t = static_cast<double>(i);
    r.frames[i].com = {t, 10 + t, 20 - t};
    r.frames[i].com_velocity = {30 + t, 40 - t, 50 + t};
  }
  const auto marks = [](const Panel& panel) {
    std::string all;
    for (const Mark& m : panel.marks) {
      all += m.label + " " + std::to_string(std::lround(100 * m.x)) + ", ";
    }
    return all;
  };
  const Figure joints = jointFigure(r);
  const Figure com = comFigure(r);
  const Figure contact = contactFigure(r);
  EXPECT_EQ(joints.title, "Joint angles");
  EXPECT_EQ(com.title, "Centre of mass");
  EXPECT_EQ(contact.title, "Contact forces");
  EXPECT_EQ(contact.panel_height, 340);
  EXPECT_EQ(joints.panels[0].least_span, 0.2);
  for (const Figure* figure : {&joints, &com, &contact}) {
    for (const Panel& panel : figure->panels) {
      EXPECT_EQ(panel.xlabel, "time [s]");
      EXPECT_EQ(marks(panel), "stand 0, flight 31, land 70, ");
      for (const Series& s : panel.series) {
        EXPECT_EQ(s.x.front(), 0);
        EXPECT_EQ(s.x.back(), r.frames.back().state.time);
        EXPECT_EQ(s.x.size(), s.y.size());
        EXPECT_FALSE(s.label.empty());
      }
    }
  }
  EXPECT_EQ(joints.panels[0].ylabel, "angle [rad]");
  EXPECT_EQ(joints.panels[0].series[0].color, 0);  // left is blue, right vermilion and dashed
  EXPECT_EQ(joints.panels[0].series[1].color, 1);
  EXPECT_EQ(joints.panels[0].series[1].label, "right");
  ASSERT_EQ(com.panels.size(), 2U);
  EXPECT_EQ(com.panels[0].ylabel, "position [m]");
  EXPECT_EQ(com.panels[1].ylabel, "velocity [m/s]");
  for (int k = 0; k < 3; ++k) {
    const char* const axes[] = {"x (forward)", "y (left)", "z (up)"};
    for (const Panel& panel : com.panels) EXPECT_EQ(panel.series.at(k).label, axes[k]);
    for (size_t i = 0; i < r.frames.size(); ++i) {
      EXPECT_EQ(com.panels[0].series[k].y[i], r.frames[i].com[k]);
      EXPECT_EQ(com.panels[1].series[k].y[i], r.frames[i].com_velocity[k]);
      EXPECT_EQ(com.panels[0].series[k].x[i], r.frames[i].state.time);
    }
  }
  EXPECT_EQ(contact.panels[0].ylabel, "vertical force [N]");
  const Series& weight = contact.panels[0].series.back();
  EXPECT_EQ(weight.label, "weight");
  EXPECT_EQ(weight.color, kGrey);
  EXPECT_EQ(weight.style, Style::kDashed);
  EXPECT_EQ(weight.y[1], weight.y[0]);

  sim::Recording slides = withJoints({"l_a", "r_a", "neck"});
  size_t at = 0;
  while ((at = slides.mjcf.find("<joint ", at)) != std::string::npos) {
    at += 7;
    slides.mjcf.insert(at, "type='slide' ");
  }
  for (const Panel& p : jointFigure(slides).panels) EXPECT_EQ(p.ylabel, "position [m]");
  EXPECT_TRUE(has(jointFigure(withJoints({})).panels.at(0).title, "no hinges"));
  const Figure one = jointFigure(withJoints({"neck"}));
  EXPECT_EQ(one.panels[0].title, "neck");
  EXPECT_EQ(one.panels[0].series.at(0).y[0], 0.07);
  EXPECT_EQ(one.panels[0].ylabel, "angle [rad]");
  sim::Recording wrong = jump();
  wrong.frames[3].state.q[0] = NAN;
  EXPECT_THROW(jointFigure(wrong), InputError);
  EXPECT_THROW(comFigure(wrong), InputError);
  EXPECT_THROW(contactFigure(wrong), InputError);
}

TEST(CostHistory, NeverRisesAndFollowsTrialsThatViolateNothing) {
  const CostHistory h =
      costHistory({{5, true}, {1, true}, {9}, {0.5, true}, {3}, {0, false, true}, {4}});
  EXPECT_EQ(h.evaluations, std::vector<double>({3, 4, 5, 6, 7}));
  EXPECT_EQ(h.best, std::vector<double>({9, 9, 3, 3, 3}));
  EXPECT_EQ(h.costs, std::vector<double>({5, 1, 9, 0.5, 3, 4}));
  EXPECT_EQ(h.failed, std::vector<double>({6}));
  EXPECT_EQ(h.trials, std::vector<double>({1, 2, 3, 4, 5, 7}));
  EXPECT_EQ(costHistory({{5, true}, {1, true}, {2, true}}).best, std::vector<double>({5, 1, 1}));
  // One that failed keeps nothing.
  const CostHistory all = costHistory({{0, false, true}, {5, true}, {7, true}});
  EXPECT_EQ(all.best, std::vector<double>({5, 5}));
  EXPECT_EQ(all.evaluations, std::vector<double>({2, 3}));
}

TEST(StandardFigures, CostIsLogarithmicWhenItSpansDecades) {
  const Folder folder;
  CostHistory history = {.evaluations = {8, 16, 24},
                         .best = {10, 1, 0.1},
                         .trials = {1, 2, 3},
                         .costs = {10, 20, NAN},
                         .failed = {3}};
  const Figure wide = costFigure(history);
  EXPECT_TRUE(wide.panels[0].log_y);
  writeFigure(wide, folder / "cost.svg");
  EXPECT_TRUE(has(textOf(folder / "cost.svg"), "failed"));
  const Panel& panel = wide.panels[0];
  EXPECT_EQ(wide.panel_height, 420);
  EXPECT_EQ(panel.xlabel + " " + panel.ylabel, "trials cost");
  ASSERT_EQ(panel.series.size(), 3U);
  const std::tuple<const char*, Style, int, std::vector<double>, std::vector<double>> expected[] = {
      {"single trials", Style::kPoints, 5, {1, 2}, {10, 20}},
      {"failed", Style::kCrosses, 1, {3}, {20}},
      {"best so far", Style::kStep, 0, {8, 16, 24}, {10, 1, 0.1}}};
  for (size_t i = 0; i < 3; ++i) {
    const auto& [label, style, color, x, y] = expected[i];
    const Series& s = panel.series[i];
    EXPECT_EQ(s.label, label);
    EXPECT_EQ(s.style, style);
    EXPECT_EQ(s.color, color);
    EXPECT_TRUE(std::equal(x.begin(), x.end(), s.x.begin())) << label;
    EXPECT_TRUE(std::equal(y.begin(), y.end(), s.y.begin())) << label;
  }
  // Of no costs at all the crosses stand at 1.
  CostHistory none;
  none.failed = {1, 2};
  EXPECT_EQ(costFigure(none).panels[0].series[0].y, std::vector<double>({1, 1}));
  EXPECT_EQ(costFigure(none).panels[0].series.size(), 2U);
  const auto is_log = [](const std::vector<double>& best) {
    CostHistory h;
    h.evaluations = {1, 2};
    h.best = best;
    return costFigure(h).panels[0].log_y;
  };
  EXPECT_TRUE(is_log({41, 2}));
  EXPECT_FALSE(is_log({40, 2}));
  EXPECT_TRUE(is_log({1, 0.01}));
  EXPECT_FALSE(is_log({1, 0}));
  history.best = {10, -1, -2};
  EXPECT_FALSE(costFigure(history).panels[0].log_y);
  writeFigure(costFigure({}), folder / "none.png");
}

}  // namespace
}  // namespace traceur::render
