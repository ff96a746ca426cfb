#include "apps/cli/balance_pictures.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "traceur/core/pending_file.h"
#include "traceur/core/random.h"
#include "traceur/render/figure.h"
#include "traceur/render/font.h"
#include "traceur/render/image.h"

namespace traceur::cli {
namespace {

using Eigen::Vector2d;
using render::Color;
using render::Image;

constexpr Color kGround{200, 200, 200};
constexpr Color kWheel{90, 90, 90};
constexpr Color kSpoke{230, 230, 230};
constexpr Color kBoard{160, 110, 60};
constexpr Color kLeg{70, 110, 180};
constexpr Color kPelvis{40, 60, 110};

constexpr int kWidth = 190, kHeight = 330;  // of a panel [px]
constexpr double kScale = 230;              // [px/m]

class Scene {
 public:
  Scene() : image_(kWidth, kHeight) {}

  Image& image() { return image_; }

  void bar(const Vector2d& a, const Vector2d& b, double thickness, Color color) {
    const Vector2d along = (b - a).normalized();
    const Vector2d across = 0.5 * thickness * Vector2d(-along.y(), along.x());
    const std::array<Vector2d, 4> corners = {at(a + across), at(b + across), at(b - across),
                                             at(a - across)};
    render::fillPolygon(image_, corners, color);
  }
  void disc(const Vector2d& centre, double radius, Color color) {
    render::fillDisc(image_, at(centre), kScale * radius, color);
  }

 private:
  static Vector2d at(const Vector2d& p) {
    return {0.5 * kWidth + kScale * p.x(), kHeight - 25 - kScale * p.y()};
  }

  Image image_;
};

Image draw(const bias::BongoBoard::State& x, const std::string& label, const render::Font& font) {
  const bias::BongoParameters board;
  const bias::BongoPose pose = bias::poseOf(board, x);
  const double f = x[0] + x[1];
  const Vector2d along(std::cos(f), std::sin(f));
  Scene s;
  s.bar({-2, -0.01}, {2, -0.01}, 0.02, kGround);
  s.disc(pose.wheel, board.wheel_radius, kWheel);
  const Vector2d spoke = board.wheel_radius * Vector2d(-std::sin(x[0]), std::cos(x[0]));
  s.bar(pose.wheel - 0.9 * spoke, pose.wheel + 0.9 * spoke, 0.012, kSpoke);
  const double half = board.board_length / 2;
  s.bar(pose.board - half * along, pose.board + half * along, 0.02, kBoard);
  s.bar(pose.left_foot, pose.left_hip, 0.05, kLeg);
  s.bar(pose.right_foot, pose.right_hip, 0.05, kLeg);
  s.bar(pose.left_hip - 0.05 * along, pose.right_hip + 0.05 * along, 0.08, kPelvis);
  font.draw(s.image(), 6, 4, 16, label);
  return s.image();
}

}  // namespace

void writeBalanceStrip(const std::filesystem::path& file, const bias::BongoMachine& machine,
                       const Eigen::VectorXd& parameters, const Eigen::VectorXd& x0) {
  const bias::BongoParameters board;
  const auto policy = bias::BalancePolicy::of(parameters);
  bias::BongoBoard model(board);
  bias::BongoHardware hardware(board, machine.faults);
  const render::Font font;
  std::vector<Image> panels;
  const std::array<double, 6> times = {0, 0.2, 0.5, 1, 2.5, 5};
  for (const bool real : {false, true}) {
    bias::RunLog log;
    Plant& plant = real ? static_cast<Plant&>(hardware) : model;
    const bias::Episode e = bias::balance(plant, board, policy, x0, {}, {}, &log);
    for (const double time : times) {
      const int step = std::min(static_cast<int>(std::lround(1000 * time)), log.steps());
      const std::string fell = e.failed() && step == log.steps()
                                   ? fmt::format("{:.2f} s: {}", 1e-3 * step, e.failure)
                                   : fmt::format("{:.1f} s", 1e-3 * step);
      panels.push_back(
          draw(log.x.col(step), fmt::format("{} {}", real ? "machine" : "model", fell), font));
    }
  }
  render::writePng(render::tile(panels, static_cast<int>(times.size()), 4, kGround), file);
}

double writeBalanceMap(const std::filesystem::path& file, const bias::BongoMachine& machine,
                       const Eigen::VectorXd& parameters, double angle, int count, int tries,
                       std::uint64_t seed) {
  const bias::BongoParameters board;
  const auto policy = bias::BalancePolicy::of(parameters);
  render::Panel panel;
  panel.xlabel = "wheel [deg]";
  panel.ylabel = "board relative to it [deg]";
  const auto series = [](const char* label, render::Style style, int color) {
    render::Series s;
    s.label = label;
    s.style = style;
    s.color = color;
    return s;
  };
  render::Series up = series("always up", render::Style::kPoints, 0);
  render::Series some = series("sometimes", render::Style::kPoints, render::kGrey);
  render::Series down = series("never", render::Style::kCrosses, 1);
  std::string csv = "wheel_rad,board_rad,success\n";
  int good = 0;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const auto place = [&](int k) { return angle * (2.0 * (k + 0.5) / count - 1); };
      int here = 0;
      for (int t = 0; t < tries; ++t) {
        Random random(seed, 10, static_cast<std::uint64_t>((i * count + j) * tries + t));
        bias::BongoHardware hardware(board, machine.faults, random.bits());
        const auto x0 = bias::bongoStart(place(i), place(j));
        if (!bias::balance(hardware, board, policy, x0).failed()) ++here;
      }
      good += here;
      render::Series& to = here == tries ? up : here == 0 ? down : some;
      static constexpr double kDegrees = 180 / std::numbers::pi;
      to.x.push_back(kDegrees * place(i));
      to.y.push_back(kDegrees * place(j));
      csv +=
          fmt::format("{:.5f},{:.5f},{}\n", place(i), place(j), static_cast<double>(here) / tries);
    }
  }
  panel.title = fmt::format("up for 5 s from {} of {}", good, count * count * tries);
  for (render::Series* s : {&up, &some, &down}) {
    if (!s->x.empty()) panel.series.push_back(std::move(*s));
  }
  render::Figure figure;
  figure.title = "What the policy balances from";
  figure.panels = {panel};
  figure.width = 640;
  figure.panel_height = 560;
  render::writeFigure(figure, file);
  PendingFile numbers(std::filesystem::path(file).replace_extension(".csv"));
  numbers.write(csv);
  numbers.commit();
  return static_cast<double>(good) / (count * count * tries);
}

}  // namespace traceur::cli
