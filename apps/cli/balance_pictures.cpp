#include "apps/cli/balance_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "traceur/core/pending_file.h"
#include "traceur/core/random.h"
#include "traceur/render/figure.h"
#include "traceur/render/font.h"
#include "traceur/render/image.h"
#include "traceur/render/video.h"

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

constexpr int kWidth = 210, kHeight = 302;  // of a panel [px]
constexpr int kGap = 4;                     // between panels [px]
constexpr int kLetters = 16;                // [px]
constexpr double kSeconds = 5;              // of a run
constexpr double kScale = 200;              // [px/m]

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
    return {0.5 * kWidth + kScale * p.x(), kHeight - 16 - kScale * p.y()};
  }

  Image image_;
};

Image draw(const bias::BongoBoard::State& x, const std::string& label, const std::string& below,
           const render::Font& font) {
  const bias::BongoParameters board;
  const bias::BongoPose pose = bias::poseOf(board, x);
  const double f = x[0] + x[1];
  const Vector2d along(std::cos(f), std::sin(f));
  Scene s;
  s.bar({-2, -0.5}, {2, -0.5}, 1, kGround);
  s.disc(pose.wheel, board.wheel_radius, kWheel);
  const Vector2d spoke = board.wheel_radius * Vector2d(-std::sin(x[0]), std::cos(x[0]));
  s.bar(pose.wheel - 0.9 * spoke, pose.wheel + 0.9 * spoke, 0.012, kSpoke);
  const double half = board.board_length / 2;
  s.bar(pose.board - half * along, pose.board + half * along, 0.02, kBoard);
  s.bar(pose.left_foot, pose.left_hip, 0.05, kLeg);
  s.bar(pose.right_foot, pose.right_hip, 0.05, kLeg);
  s.bar(pose.left_hip - 0.05 * along, pose.right_hip + 0.05 * along, 0.08, kPelvis);
  font.draw(s.image(), 6, 4, kLetters, label);
  font.draw(s.image(), 6, 4 + kLetters, kLetters, below);
  return s.image();
}

/// A run after so many seconds, or as it ended before.
Image drawAt(const BalanceRun& run, double time, const render::Font& font) {
  const int last = run.log.steps();
  const int step = std::min(static_cast<int>(std::lround(time / run.log.time_step)), last);
  const bool over = !run.failure.empty() && step == last;
  const double shown = step * run.log.time_step;
  return draw(
      run.log.x.col(step), run.label,
      over ? fmt::format("{:.2f} s: {}", shown, run.failure) : fmt::format("{:.1f} s", shown),
      font);
}

}  // namespace

std::vector<BalanceRun> modelAndMachine(const bias::BongoMachine& machine,
                                        const Eigen::VectorXd& parameters,
                                        const Eigen::VectorXd& x0) {
  const bias::BongoParameters board;
  const auto policy = bias::BalancePolicy::of(parameters);
  bias::BongoBoard model(board);
  bias::BongoHardware hardware(board, machine.faults);
  std::vector<BalanceRun> runs = {{"model", {}, {}}, {"machine", {}, {}}};
  runs[0].failure = bias::balance(model, board, policy, x0, {}, {}, &runs[0].log).failure;
  runs[1].failure = bias::balance(hardware, board, policy, x0, {}, {}, &runs[1].log).failure;
  return runs;
}

void writeBalanceStrip(const std::filesystem::path& file, std::span<const BalanceRun> runs) {
  const render::Font font;
  std::vector<Image> panels;
  const std::array<double, 6> times = {0, 0.2, 0.5, 1, 2.5, 5};
  for (const BalanceRun& run : runs) {
    for (const double time : times) panels.push_back(drawAt(run, time, font));
  }
  render::writePng(render::tile(panels, static_cast<int>(times.size()), kGap, kGround), file);
}

void writeBalanceVideo(const std::filesystem::path& file, std::span<const BalanceRun> runs) {
  static constexpr int kFps = 50;
  const render::Font font;
  std::optional<render::VideoFile> video;
  for (int k = 0; k <= static_cast<int>(kFps * kSeconds); ++k) {
    std::vector<Image> panels;
    for (const BalanceRun& run : runs) {
      panels.push_back(drawAt(run, static_cast<double>(k) / kFps, font));
    }
    const Image picture = render::tile(panels, static_cast<int>(panels.size()), kGap, kGround);
    if (!video) video.emplace(file, picture.width, picture.height, kFps);
    video->add(picture);
  }
  video->finish();
}

void writeBalanceMap(const std::filesystem::path& file, const bias::BongoMachine& machine,
                     const Eigen::VectorXd& parameters, double angle, int count, int tries,
                     std::uint64_t seed, const std::stop_token& stop) {
  const bias::BongoParameters board;
  const auto policy = bias::BalancePolicy::of(parameters);
  render::Panel panel;
  panel.xlabel = "wheel [deg]";
  panel.ylabel = "board relative to it [deg]";
  render::Series squares{"", {}, {}, render::Style::kSquares};
  static constexpr double kDegrees = 180 / std::numbers::pi;
  squares.side = kDegrees * 2 * angle / count;
  std::string csv = "wheel_rad,board_rad,success\n";
  int good = 0;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      if (stop.stop_requested()) return;
      const auto place = [&](int k) { return angle * (2.0 * (k + 0.5) / count - 1); };
      int here = 0;
      for (int t = 0; t < tries; ++t) {
        Random random(seed, 10, static_cast<std::uint64_t>((i * count + j) * tries + t));
        bias::BongoHardware hardware(board, machine.faults, random.bits());
        const auto x0 = bias::bongoStart(place(i), place(j));
        if (!bias::balance(hardware, board, policy, x0).failed()) ++here;
      }
      good += here;
      squares.x.push_back(kDegrees * place(i));
      squares.y.push_back(kDegrees * place(j));
      squares.share.push_back(static_cast<double>(here) / tries);
      csv +=
          fmt::format("{:.5f},{:.5f},{}\n", place(i), place(j), static_cast<double>(here) / tries);
    }
  }
  panel.title = fmt::format("up for 5 s from {} of {}", good, count * count * tries);
  panel.series.push_back(std::move(squares));
  render::Figure figure;
  figure.title = "How often the policy balances";
  figure.panels = {panel};
  figure.width = 640;
  figure.panel_height = 560;
  render::writeFigure(figure, file);
  PendingFile numbers(std::filesystem::path(file).replace_extension(".csv"));
  numbers.write(csv);
  numbers.commit();
}

void writeLearning(const std::filesystem::path& file, std::span<const LearningStep> steps) {
  render::Panel costs;
  costs.xlabel = "iteration";
  costs.ylabel = "cost";
  costs.log_y = true;
  // A line alone does not show where only one point is.
  const auto pair = [](const char* label, int color) {
    std::array<render::Series, 2> s = {render::Series{label, {}, {}},
                                       render::Series{"", {}, {}, render::Style::kCrosses}};
    s[0].color = s[1].color = color;
    return s;
  };
  const auto add = [](render::Series& s, double x, double y) {
    s.x.push_back(x);
    s.y.push_back(y);
  };
  auto worst = pair("the worst run", 0);
  auto success = pair("success is below", render::kGrey);
  std::array rates = {pair("wheel's rate", 0), pair("board's rate", 1), pair("legs' rate", 2)};
  auto torque = pair("torque", 3);
  bool of_rates = false;
  bool of_torque = false;
  for (size_t i = 0; i < steps.size(); ++i) {
    const auto at = static_cast<double>(i + 1);
    const std::vector<double>& of_runs = steps[i].costs;
    for (const double cost : of_runs) add(worst[1], at, cost);
    add(worst[0], at, *std::max_element(of_runs.begin(), of_runs.end()));
    add(success[0], at, bias::BalanceCost().failure);
    const Eigen::VectorXd& r2 = steps[i].explained;
    of_rates = of_rates || r2.size() == 3;
    of_torque = of_torque || r2.size() == 1;
    for (size_t k = 0; k < rates.size(); ++k) {
      for (render::Series& s : rates[k]) add(s, at, r2.size() == 3 ? r2[k] : std::nan(""));
    }
    for (render::Series& s : torque) add(s, at, r2.size() == 1 ? r2[0] : std::nan(""));
  }
  worst[1].label = "every run";
  costs.series = {worst[0], worst[1], success[0]};
  render::Figure figure;
  figure.title = "Learning to balance";
  figure.panels = {costs};
  if (of_rates || of_torque) {
    render::Panel bias;
    bias.xlabel = "iteration";
    bias.ylabel = "R² of the bias, unseen runs";
    bias.least_span = 0.1;
    if (of_rates) {
      for (const auto& rate : rates) {
        bias.series.insert(bias.series.end(), rate.begin(), rate.end());
      }
    }
    if (of_torque) bias.series.insert(bias.series.end(), torque.begin(), torque.end());
    figure.panels.push_back(std::move(bias));
  }
  render::writeFigure(figure, file);
}

}  // namespace traceur::cli
