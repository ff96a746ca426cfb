#include "apps/cli/mishaps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "apps/cli/arguments.h"
#include "traceur/core/error.h"
#include "traceur/core/gravity.h"
#include "traceur/core/text.h"
#include "traceur/flight/planner.h"
#include "traceur/sim/surface.h"

namespace traceur::cli {
namespace {

const std::string kBall = "cannon_ball";

/// What is told by several NAME=VALUE.
class Told {
 public:
  Told(const char* option, ParamSpecs rows, const std::vector<std::string>& texts)
      : rows_(std::move(rows)), given_(!texts.empty()), values_(initialOf(rows_)) {
    const std::string name = option;
    for (const std::string& text : texts) assign(values_, {rows_, "number", name}, text, option);
  }
  /// Whether the option was there.
  explicit operator bool() const { return given_; }
  double operator[](std::string_view name) const {
    const auto row = std::find_if(rows_.begin(), rows_.end(),
                                  [&](const ParamSpec& p) { return p.name == name; });
    assert(row != rows_.end());
    return values_[row - rows_.begin()];
  }
  sim::Vector3d vector() const { return {(*this)["forward"], (*this)["left"], (*this)["up"]}; }
  /// "time=0.2 [s], mass=5 [kg]"
  static std::string help(const ParamSpecs& rows) {
    std::vector<std::string> words;
    words.reserve(rows.size());
    for (const ParamSpec& p : rows) {
      words.push_back(fmt::format("{}={:g}{}", p.name, p.initial,
                                  p.unit == "1" ? "" : fmt::format(" [{}]", p.unit)));
    }
    return join(words);
  }

 private:
  ParamSpecs rows_;
  bool given_;
  Eigen::VectorXd values_;
};

const ParamSpecs kPushes = {{"time", "s", 0, 60, 0.2, ""},
                            {"forward", "N·s", -1000, 1000, 0, ""},
                            {"left", "N·s", -1000, 1000, 0, ""},
                            {"up", "N·s", -1000, 1000, 0, ""}};
const ParamSpecs kCannons = {
    {"time", "s", 0, 60, 0.2, ""},      {"mass", "kg", 0.1, 100, 5, ""},
    {"forward", "m/s", -30, 30, 0, ""}, {"left", "m/s", -30, 30, 0, ""},
    {"up", "m/s", -30, 30, 0, ""},      {"distance", "m", 0.8, 20, 1.5, ""}};
const ParamSpecs kDrags = {
    {"time", "s", 0, 60, 0.2, ""},       {"forward", "m", -20, 20, 0, ""},
    {"left", "m", -20, 20, 0, ""},       {"up", "m", -20, 20, 0, ""},
    {"roll", "rad", -3.15, 3.15, 0, ""}, {"pitch", "rad", -3.15, 3.15, 0, ""},
    {"yaw", "rad", -3.15, 3.15, 0, ""}};
const ParamSpecs kBoxes = {{"height", "m", 0.1, 10, 1.4, ""},
                           {"length", "m", 0.2, 20, 2.5, ""},
                           {"width", "m", 0.5, 20, 2, ""},
                           {"ahead", "m", -2, 2, 0, ""}};
const ParamSpecs kPerturbations = {{"mass", "1", 0.5, 2, 1, ""},
                                   {"friction", "1", 0, 10, 1, ""},
                                   {"delay", "s", 0, 0.1, 0, ""},
                                   {"noise", "1", 0, 10, 0, ""}};
/// Noise of 1, as perform --perturb has it.
constexpr double kEncoderNoise = 0.005;  // [rad]
constexpr double kVelocityNoise = 0.05;  // [m/s]

sim::Prop propOf(const Mishaps::Box& box) {
  sim::Prop prop;
  prop.name = Mishaps::kBox;
  prop.material = sim::findSurface("floor").material;
  prop.size = {box.length / 2, box.width / 2, box.height / 2};
  prop.position = {box.aim + box.front - box.length / 2, 0, box.height / 2};
  return prop;
}

}  // namespace

std::optional<Mishaps::Box> Mishaps::box(const Starting& start) const {
  const Told onto("--onto", kBoxes, onto_);
  if (!onto) return {};
  static constexpr double kFront = 0.3;  // to leap off, but not to step off [ours]
  Box box{.height = onto["height"], .length = onto["length"], .width = onto["width"]};
  const double time = flight::fallTime(start.height - box.height - 0.9, start.up, kGravity);
  box.aim = start.forward * time + onto["ahead"];
  box.front = std::min(box.length / 2, kFront);
  return box;
}

skill::Disturbance Mishaps::changes(const Starting& start) const {
  skill::Disturbance changed;
  if (!surface_.empty()) {
    const sim::Material& ground = sim::findSurface(surface_).material;
    changed.friction = ground.friction;
    changed.compliance = ground.compliance;
    changed.damping_ratio = ground.damping_ratio;
  }
  if (const Told how("--perturb", kPerturbations, perturb_); how) {
    changed.mass = how["mass"];
    if (how["friction"] != 1) changed.friction = how["friction"];
    changed.delay = how["delay"];
    changed.encoder_noise = how["noise"] * kEncoderNoise;
    changed.velocity_noise = how["noise"] * kVelocityNoise;
    changed.seed = start.seed;
  }
  changed.time_step = time_step_;
  if (compliance_) changed.compliance = compliance_;
  if (friction_) changed.friction = friction_;
  if (const Told how("--cannon", kCannons, cannon_); how) {
    static constexpr double kLead = 11340;  // [kg/m³]
    sim::Prop ball;
    ball.name = kBall;
    ball.material = sim::findSurface("floor").material;
    ball.shape = sim::Prop::Shape::kBall;
    ball.mass = how["mass"];
    ball.size[0] = std::cbrt(3 * ball.mass / (4 * std::numbers::pi * kLead));
    ball.position = {-50, 0, ball.size[0]};  // until it is shot: out of the way
    changed.props.push_back(ball);
  }
  if (const auto onto = box(start)) changed.props.push_back(propOf(*onto));
  return changed;
}

skill::Meddling Mishaps::meddling(const sim::Model& model) const {
  skill::Meddling happens;
  if (const Told how("--push", kPushes, push_); how) {
    static constexpr double kTime = 0.1;  // [s]
    happens.pushes.push_back({.body = model.root(),
                              .force = how.vector() / kTime,
                              .start = how["time"],
                              .duration = kTime});
  }
  if (const Told how("--cannon", kCannons, cannon_); how) {
    if (how.vector().norm() == 0) throw InputError("--cannon: expected a velocity, as left=10");
    happens.shots.push_back({.body = model.body(kBall),
                             .start = how["time"],
                             .velocity = how.vector(),
                             .distance = how["distance"]});
  }
  if (const Told how("--drag", kDrags, drag_); how) {
    happens.drags.push_back(
        {.start = how["time"],
         .by = how.vector(),
         .turn = sim::rotationOf({how["roll"], how["pitch"], how["yaw"]}).toRotationMatrix()});
  }
  return happens;
}

void Mishaps::addTo(CLI::App& verb) {
  verb.add_option("--time-step", time_step_, "Of the simulation [s]; default: the skill's")
      ->check(CLI::Range(1e-5, 0.005));
  verb.add_option("--compliance", compliance_, "Of the ground [s]; default: the skill's")
      ->check(CLI::Range(1e-4, 0.2));
  verb.add_option("--friction", friction_, "Of the ground; default: the skill's")
      ->check(CLI::Range(0.0, 10.0));
  std::vector<std::string> grounds;
  for (const sim::Surface& s : sim::surfaces()) {
    grounds.push_back(fmt::format("{} ({})", s.name, s.help));
  }
  verb.add_option("--surface", surface_,
                  fmt::format("What it falls on: {}; default: the skill's", join(grounds)));
  const auto told = [&](const char* option, std::vector<std::string>& to, const char* what,
                        const ParamSpecs& rows) {
    verb.add_option(option, to, fmt::format("{}. NAME=VALUE of: {}", what, Told::help(rows)))
        ->type_name("NAME=VALUE")
        ->expected(1, static_cast<int>(rows.size()));
  };
  told("--push", push_, "A push on the root for 0.1 s", kPushes);
  told("--cannon", cannon_, "A ball of lead is shot at it", kCannons);
  told("--drag", drag_, "It is put elsewhere, and turned, on its way", kDrags);
  told("--onto", onto_, "A box that it comes down on before the ground, and so far ahead", kBoxes);
  told("--perturb", perturb_, "Another body than the controller knows", kPerturbations);
}

}  // namespace traceur::cli
