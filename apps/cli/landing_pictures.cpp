#include "apps/cli/landing_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/interrupt.h"
#include "apps/cli/pictures.h"
#include "traceur/core/error.h"
#include "traceur/render/figure.h"
#include "traceur/reproduce/landing.h"
#include "traceur/sim/world.h"

namespace traceur::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using landing::Plane;
using landing::Verdict;

Json planeJson(const Plane& p) {
  return {{"up", p.up}, {"forward", p.forward}, {"spin", p.spin}, {"constant", p.constant}};
}

/// Of the three speeds that a plane is over, one is drawn and two are their means.
struct Axis {
  const char* label;
  double Verdict::*speed;
};

render::Panel panelOf(const reproduce::TouchDowns& t, const Axis& axis) {
  render::Panel panel;
  panel.xlabel = axis.label;
  panel.ylabel = "somersault [rad]";
  render::Series good{"stands", {}, {}, render::Style::kPoints};
  render::Series bad{"does not", {}, {}, render::Style::kCrosses};
  bad.color = render::kGrey;
  Verdict mean;
  double low = t.all[0].*axis.speed;
  double high = low;
  for (const Verdict& v : t.all) {
    render::Series& s = v.stands() ? good : bad;
    s.x.push_back(v.*axis.speed);
    s.y.push_back(v.touch_down_somersault);
    low = std::min(low, v.*axis.speed);
    high = std::max(high, v.*axis.speed);
    const double share = 1.0 / static_cast<double>(t.all.size());
    mean.touch_down_speed += share * v.touch_down_speed;
    mean.touch_down_forward += share * v.touch_down_forward;
    mean.touch_down_spin += share * v.touch_down_spin;
  }
  panel.series = {bad, good};
  const auto line = [&](const char* label, const Plane& plane, render::Style style) {
    render::Series s{label, {}, {}, style};
    s.color = 1;
    for (const double x : {low, high}) {
      Verdict at = mean;
      at.*axis.speed = x;
      s.x.push_back(x);
      s.y.push_back(plane.at(-at.touch_down_speed, at.touch_down_forward, at.touch_down_spin));
    }
    panel.series.push_back(std::move(s));
  };
  line("least and most", t.condition.least, render::Style::kDashed);
  line("", t.condition.most, render::Style::kDashed);
  line("wanted", t.condition.wanted(), render::Style::kLine);
  return panel;
}

}  // namespace

Json drawLandingCondition(bool hands, std::uint64_t seed, const fs::path& file) {
  const reproduce::TouchDowns t = reproduce::touchDowns(hands, seed);
  render::Figure figure;
  figure.title = fmt::format("Touch-downs {} first, and the landing condition learned from them",
                             hands ? "hands" : "feet");
  figure.columns = 2;
  figure.width = 1240;
  figure.panel_height = 480;
  figure.panels = {panelOf(t, {"forward [m/s]", &Verdict::touch_down_forward}),
                   panelOf(t, {"down [m/s]", &Verdict::touch_down_speed})};
  render::writeFigure(figure, file);
  const auto stand =
      std::count_if(t.all.begin(), t.all.end(), [](const Verdict& v) { return v.stands(); });
  const Plane wanted = t.condition.wanted();
  return {
      {"touch_downs", t.all.size()},
      {"stand", stand},
      {"least", planeJson(t.condition.least)},
      {"wanted", planeJson(wanted)},
      {"most", planeJson(t.condition.most)},
      {"summary",
       fmt::format("{} of {} touch-downs stand; wanted: {:+.3f} v_up {:+.3f} v_forward {:+.3f} "
                   "spin {:+.3f}",
                   stand, t.all.size(), wanted.up, wanted.forward, wanted.spin, wanted.constant)}};
}

Json drawAirPoses(std::uint64_t seed, const fs::path& file) {
  static constexpr int kColumns = 8;
  static constexpr double kRise = 0.3;  // [m]: none of them touches the ground
  Interrupt interrupt;
  const reproduce::AirPoses air = reproduce::airPoses(seed);
  sim::Recording recording;
  recording.mjcf = air.model->mjcf();
  sim::World world(air.model);
  DrawArguments how{.view = "side", .count = static_cast<int>(air.poses.size())};
  how.columns = kColumns;
  for (size_t k = 0; k < air.poses.size(); ++k) {
    sim::State s = air.poses[k];
    s.q[2] += kRise;
    s.time = static_cast<double>(k);
    world.reset(s);
    recording.phases.push_back(fmt::format("pose {}, chosen {}", k + 1, air.chosen[k]));
    recording.frames.push_back(
        sim::frameOf(world.snapshot(), static_cast<int>(k), Eigen::VectorXd()));
    how.times.push_back(s.time);
  }
  if (!draw(recording, file, how, interrupt, true)) {
    throw SystemError(fmt::format("{}: stopped before it was drawn", file.string()));
  }
  return {{"chosen", air.chosen}, {"none", air.none}};
}

}  // namespace traceur::cli
