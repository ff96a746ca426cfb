#include <gtest/gtest.h>
#include <png.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

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
  const Font font;
  Image image(200, 40);
  const int end = font.draw(image, 10, 8, 20, "0.70 s  thrust");
  EXPECT_NEAR(end - 10, font.width("0.70 s  thrust", 20), 1);
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

TEST(Offscreen, AShapeOfAnyKindFillsThePictureAndStaysInIt) {
  for (const char* shape :
       {"type='sphere' size='.3'", "type='box' size='.1 .2 .3'", "type='box' size='.3 .05 .1'",
        "type='capsule' size='.1 .3'", "type='cylinder' size='.1 .3'",
        "type='cylinder' size='.3 .1'", "type='ellipsoid' size='.1 .2 .3'"}) {
    SCOPED_TRACE(shape);
    const auto model = sim::Model::fromMjcf(
        "<mujoco><visual><headlight ambient='1 1 1' diffuse='0 0 0'/></visual><worldbody>"
        "<body pos='0 0 1'><freejoint/><geom rgba='1 0 0 1' euler='30 20 40' " +
        std::string(shape) + "/></body></worldbody></mujoco>");
    Offscreen offscreen(model, {.width = 200, .height = 200, .quality = Quality::kFast});
    sim::Frame frame;
    frame.state = model->initialState();
    for (const View view : {View::kSide, View::kFront, View::kThreeQuarter}) {
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
  r = jump();
  r.frames.back().state.time = INFINITY;
  EXPECT_THROW(checkRecording(*testModel(), r), InputError);
  for (const int body : {-1, testModel()->bodies()}) {
    r = jump();
    r.frames[5].contacts.emplace_back().body_b = {body};
    EXPECT_TRUE(has(messageOf<InputError>([&] { checkRecording(*testModel(), r); }), "frame 5"));
  }
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

/// The lines that gnuplot is told for a figure.
std::vector<std::string> scriptOf(const Figure& figure) {
  const Folder bin;
  const fs::path script = bin / "script";
  std::ofstream(bin / "gnuplot") << "#!/bin/sh\ncat > " << script << "\n"
                                 << "sed -n \"s/^set output '\\(.*\\)'$/\\1/p\" " << script
                                 << " | while read -r file; do echo '</svg>' > \"$file\"; done\n";
  fs::permissions(bin / "gnuplot", fs::perms::owner_all);
  const Path path(bin.path().string() + ":" + getenv("PATH"));
  writeFigure(figure, bin / "a.svg");
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

TEST(CostHistory, NeverRisesAndFollowsTrialsThatViolateNothing) {
  const CostHistory h =
      costHistory({{5, true}, {1, true}, {9}, {0.5, true}, {3}, {0, false, true}, {4}});
  EXPECT_EQ(h.evaluations, std::vector<double>({3, 4, 5, 6, 7}));
  EXPECT_EQ(h.best, std::vector<double>({9, 9, 3, 3, 3}));
  EXPECT_EQ(h.costs, std::vector<double>({5, 1, 9, 0.5, 3, 4}));
  EXPECT_EQ(h.failed, std::vector<double>({6}));
  EXPECT_EQ(costHistory({{5, true}, {1, true}, {2, true}}).best, std::vector<double>({5, 1, 1}));
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
  history.best = {10, -1, -2};
  EXPECT_FALSE(costFigure(history).panels[0].log_y);
  writeFigure(costFigure({}), folder / "none.png");
}

}  // namespace
}  // namespace traceur::render
