#include "traceur/skill/scene_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace traceur::skill {

using sim::Vector3d;

Vector3d readVector(const TomlReader& r, const char* key) {
  const std::vector<double> v = r.numbers(key, 3);
  return {v[0], v[1], v[2]};
}

namespace {

sim::Material material(const TomlReader& r, double time_step) {
  sim::Material m;
  m.friction = r.number("friction", m.friction);
  m.rolling = r.number("rolling_friction", m.rolling);
  m.compliance = r.number("compliance", m.compliance);
  for (const char* key : {"friction", "rolling_friction"}) {
    if (r.number(key, 0) < 0) r.fail(key, fmt::format("\"{}\": expected a number >= 0", key));
  }
  m.damping_ratio = r.number("damping_ratio", m.damping_ratio);
  if (!(m.damping_ratio > 0)) {
    r.fail("damping_ratio", "\"damping_ratio\": expected a number > 0");
    m.damping_ratio = 1;
  }
  m.friction = std::max(0.0, m.friction);
  m.rolling = std::max(0.0, m.rolling);
  if (!(m.compliance >= 2 * time_step)) {
    r.fail("compliance", fmt::format("\"compliance\" {} s: expected at least twice the time step, "
                                     "{} s",
                                     m.compliance, 2 * time_step));
    m.compliance = 2 * time_step;  // the rest can still be judged
  }
  return m;
}

double positive(const TomlReader& r, const char* key) {
  const double x = r.number(key);
  if (r.has(key) && !(x > 0)) r.fail(key, fmt::format("\"{}\": expected a number > 0", key));
  return x > 0 ? x : 1;
}

/// @return each prop's place in the text
std::vector<TomlReader> readProps(const TomlReader& scene, double time_step,
                                  std::vector<sim::Prop>& props) {
  std::vector<TomlReader> rows;
  const auto finish = [&](const TomlReader& r, sim::Prop prop) {
    prop.material = material(r, time_step);
    r.finish();
    props.push_back(std::move(prop));
    rows.push_back(r);
  };
  for (const TomlReader& r : scene.tables("box")) {
    finish(r, {.name = r.string("name"),
               .shape = sim::Prop::Shape::kBox,
               .size = readVector(r, "size") / 2,
               .position = readVector(r, "at"),
               .rpy = {0, 0, r.number("yaw", 0)},
               .mass = r.number("mass", 0)});
  }
  for (const TomlReader& r : scene.tables("ball")) {
    finish(r, {.name = r.string("name"),
               .shape = sim::Prop::Shape::kBall,
               .size = Vector3d::Constant(positive(r, "radius")),
               .position = readVector(r, "at"),
               .mass = positive(r, "mass"),
               .hollow = r.boolean("hollow", false)});
  }
  for (const TomlReader& r : scene.tables("wall")) {
    finish(r, sim::wall(r.string("name"), readVector(r, "at"), r.number("yaw", 0),
                        positive(r, "width"), positive(r, "height")));
  }
  for (const TomlReader& r : scene.tables("rail")) {
    finish(r, sim::rail(r.string("name"), readVector(r, "from"), readVector(r, "to"),
                        positive(r, "radius")));
  }
  return rows;
}

}  // namespace

std::vector<TomlReader> readScene(const TomlReader& s, sim::Scene& scene) {
  scene.ground = s.boolean("ground", true);
  scene.ground_material = material(s, scene.time_step);
  scene.props_sleep = s.boolean("sleep", false);
  return readProps(s, scene.time_step, scene.props);
}

}  // namespace traceur::skill
