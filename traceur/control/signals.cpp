#include "traceur/control/signals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "traceur/control/expression.h"
#include "traceur/core/error.h"
#include "traceur/sim/turn.h"

namespace traceur::control {
namespace {

using sim::BodyId;
using sim::Snapshot;
using sim::Vector2d;
using sim::Vector3d;

constexpr const char* kRobot = "robot";
constexpr const char* kImpulse = "impulse.";
constexpr const char* kJointForce = "joint_force.";
constexpr const char* kSomersault = "somersault.";
constexpr const char* kTilt = "tilt.";
constexpr const char* kHeading = "heading.";
constexpr const char* kAngles[] = {".roll", ".pitch", ".yaw"};
/// Long enough that the contact's softness hardly matters, as falls measure it [s].
constexpr double kImpulseWindow = 0.01;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// "com.x" → {"com", 0}.
struct Component {
  std::string name;
  int axis = 0;
};

std::optional<Component> component(const std::string& text) {
  if (text.size() < 3 || text[text.size() - 2] != '.') return std::nullopt;
  const int axis = text.back() - 'x';
  if (axis < 0 || axis > 2) return std::nullopt;
  return Component{text.substr(0, text.size() - 2), axis};
}

std::optional<std::string> after(const std::string& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return std::nullopt;
  return text.substr(prefix.size());
}

std::optional<std::string> before(const std::string& text, std::string_view suffix) {
  if (!text.ends_with(suffix)) return std::nullopt;
  return text.substr(0, text.size() - suffix.size());
}

bool mayBe(const auto& read) {
  try {
    read();
    return true;
  } catch (const InputError&) {
    return false;
  }
}

struct Turning {
  const char* prefix;
  double sim::Turn::*angle;
};
constexpr Turning kTurnings[] = {{kSomersault, &sim::Turn::somersault},
                                 {kTilt, &sim::Turn::tilt},
                                 {kHeading, &sim::Turn::heading}};

/// 1 or -1 when side b or a of a contact, and not the other, is in bodies; 0 for neither, for both
/// and inside the robot.
int sideIn(const sim::Model& model, const std::vector<bool>& bodies, const sim::Contact& c) {
  const bool a = bodies[c.body_a.value];
  if (a == bodies[c.body_b.value]) return 0;
  if (model.isRobot(c.body_a) && model.isRobot(c.body_b)) return 0;
  return a ? -1 : 1;
}

Vector2d supportMiddle(const Snapshot& s) {
  const std::vector<Vector2d> corners = s.supportPolygon();
  if (corners.empty()) return Vector2d::Constant(kNan);
  Vector2d sum = Vector2d::Zero();
  for (const Vector2d& c : corners) sum += c;
  return sum / static_cast<double>(corners.size());
}

double supportMargin(const Snapshot& s) {
  const std::vector<Vector2d> corners = s.supportPolygon();
  if (corners.empty()) return kNan;
  const Vector2d com = s.com().head<2>();
  bool inside = corners.size() > 2;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& a = corners[i];
    const Vector2d edge = corners[(i + 1) % corners.size()] - a;
    const Vector2d way = com - a;
    inside = inside && edge.x() * way.y() - edge.y() * way.x() >= 0;  // counter-clockwise
    const double length = edge.squaredNorm();
    const double along = length > 0 ? std::clamp(way.dot(edge) / length, 0.0, 1.0) : 0;
    nearest = std::min(nearest, (way - along * edge).norm());
  }
  return inside ? nearest : -nearest;
}

}  // namespace

Signals::Signals(std::shared_ptr<const sim::Model> model) : model_(std::move(model)) {}

const double* Signals::find(const std::string& name) {
  for (const auto& e : entries_) {
    if (e->name == name) return &e->value;
  }
  auto read = reader(name);
  if (!read) return nullptr;
  auto entry = std::make_unique<Entry>();
  entry->name = name;
  entry->read = std::move(read);
  entry->windowed = name.starts_with(kImpulse);
  entry->turns = name.starts_with(kSomersault) || name.starts_with(kHeading);
  entries_.push_back(std::move(entry));
  return &entries_.back()->value;
}

bool Signals::readsJointForces() const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [](const auto& e) { return e->name.starts_with(kJointForce); });
}

void Signals::begin() {
  for (const auto& e : entries_) {
    e->window.clear();
    e->read_before = false;
  }
}

void Signals::update(const Snapshot& s) {
  for (const auto& e : entries_) {
    if (!e->windowed) {
      const double read = e->read(s);
      e->value = e->turns && e->read_before
                     ? e->value + std::remainder(read - e->value, 2 * std::numbers::pi)
                     : read;
      e->read_before = true;
      continue;
    }
    const auto steps =
        static_cast<size_t>(std::max(1L, std::lround(kImpulseWindow / model_->timeStep())));
    e->window.push_back(model_->timeStep() * e->read(s));
    if (e->window.size() > steps) e->window.pop_front();
    e->value = std::accumulate(e->window.begin(), e->window.end(), 0.0);
  }
}

std::vector<bool> Signals::bodiesNamed(const std::string& name) const {
  const sim::Model& m = *model_;
  std::vector<bool> in(m.bodies(), false);
  const sim::Robot* robot = m.robot().get();
  if (name == kRobot) {
    for (int b = 1; b < m.bodies(); ++b) in[b] = m.isRobot({b});
  } else if (robot && robot->bodies.contains(name)) {
    for (const std::string& body : robot->bodies.at(name)) in[m.body(body).value] = true;
  } else {
    in[m.body(name).value] = true;
  }
  return in;
}

std::vector<BodyId> Signals::bodyOrGroup(const std::string& name) const {
  const sim::Robot* robot = model_->robot().get();
  const bool body = mayBe([&] { return model_->body(name); });
  if (body || !robot || !robot->bodies.contains(name)) return {model_->body(name)};
  std::vector<BodyId> all;
  for (const std::string& one : robot->bodies.at(name)) all.push_back(model_->body(one));
  return all;
}

std::vector<std::pair<sim::Joint, double>> Signals::jointOrPair(const std::string& name) const {
  const sim::Robot* robot = model_->robot().get();
  const bool joint = mayBe([&] { return model_->joint(name); });
  if (joint || !robot || !robot->mirrored.contains(name)) return {{model_->joint(name), 1}};
  std::vector<std::pair<sim::Joint, double>> both;
  for (const sim::SignedJoint& j : robot->jointsNamed(name)) {
    both.emplace_back(model_->joint(j.joint), j.sign);
  }
  return both;
}

Signals::Reader Signals::contactReader(const std::string& name) const {
  if (const auto group = after(name, "contact.")) {
    return [m = model_.get(), in = bodiesNamed(*group)](const Snapshot& s) {
      int n = 0;
      for (const sim::Contact& c : s.contacts()) n += sideIn(*m, in, c) != 0;
      return static_cast<double>(n);
    };
  }
  auto group = after(name, "contact_force.");
  if (!group) group = after(name, kImpulse);
  if (!group) return {};
  return [m = model_.get(), in = bodiesNamed(*group)](const Snapshot& s) {
    double f = 0;
    for (const sim::Contact& c : s.contacts()) f += sideIn(*m, in, c) * c.f_WC.z();
    return f;
  };
}

Signals::Reader Signals::jointReader(const std::string& name) const {
  const auto mean = [](auto both, auto read) {
    return [both = std::move(both), read](const Snapshot& s) {
      double sum = 0;
      for (const auto& [joint, sign] : both) sum += sign * read(s, joint);
      return both.size() == 1 ? sum : sum / static_cast<double>(both.size());
    };
  };
  if (const auto joint = after(name, "joint.")) {
    return mean(jointOrPair(*joint),
                [](const Snapshot& s, const sim::Joint& j) { return s.q()[j.q]; });
  }
  if (const auto joint = after(name, "joint_velocity.")) {
    return mean(jointOrPair(*joint),
                [](const Snapshot& s, const sim::Joint& j) { return s.v()[j.v]; });
  }
  if (const auto joint = after(name, kJointForce)) {
    return [body = model_->joint(*joint).body](const Snapshot& s) {
      return s.jointForces().col(body.value).norm();
    };
  }
  const auto torque = [](const Snapshot& s, const sim::Joint& j) {
    return j.motor < 0 ? 0 : s.torque()[j.motor];
  };
  if (const auto joint = after(name, "torque.")) {
    return [torque, j = model_->joint(*joint)](const Snapshot& s) { return torque(s, j); };
  }
  if (name == "power.robot") {
    return [torque, m = model_.get()](const Snapshot& s) {
      double sum = 0;
      for (const sim::Joint& j : m->joints()) sum += std::abs(torque(s, j) * s.v()[j.v]);
      return sum;
    };
  }
  if (const auto joint = after(name, "power.")) {
    return [torque, j = model_->joint(*joint)](const Snapshot& s) {
      return torque(s, j) * s.v()[j.v];
    };
  }
  return {};
}

Signals::Reader Signals::vectorReader(const std::string& name, int i) const {
  if (name == "com") return [i](const Snapshot& s) { return s.com()[i]; };
  if (name == "com_velocity") return [i](const Snapshot& s) { return s.comVelocity()[i]; };
  if (name == "linear_momentum") return [i](const Snapshot& s) { return s.linearMomentum()[i]; };
  if (name == "angular_momentum") {
    return [i](const Snapshot& s) { return s.angularMomentum()[i]; };
  }
  if (name == "spin") return [i](const Snapshot& s) { return s.spin()[i]; };
  if (name == "cop") {
    return [i](const Snapshot& s) {
      const auto p = s.cop();
      return p ? (*p)[i] : kNan;
    };
  }
  if (name == "support" && i < 2) return [i](const Snapshot& s) { return supportMiddle(s)[i]; };
  const auto mean = [i](std::vector<BodyId> bodies, auto read) {
    return [i, bodies = std::move(bodies), read](const Snapshot& s) {
      if (bodies.size() == 1) return read(s, bodies.front())[i];
      double sum = 0;
      for (const BodyId b : bodies) sum += read(s, b)[i];
      return sum / static_cast<double>(bodies.size());
    };
  };
  if (const auto body = after(name, "body.")) {
    return mean(bodyOrGroup(*body), [](const Snapshot& s, BodyId b) { return s.bodyPosition(b); });
  }
  if (const auto body = after(name, "body_velocity.")) {
    return mean(bodyOrGroup(*body), [](const Snapshot& s, BodyId b) { return s.bodyVelocity(b); });
  }
  if (const auto body = after(name, "body_com.")) {
    return mean(bodyOrGroup(*body), [](const Snapshot& s, BodyId b) { return s.bodyCom(b); });
  }
  if (const auto point = after(name, "point.")) {
    return [i, p = model_->contactPoint(*point)](const Snapshot& s) { return s.position(p)[i]; };
  }
  if (const auto point = after(name, "point_velocity.")) {
    return [i, p = model_->contactPoint(*point)](const Snapshot& s) { return s.velocity(p)[i]; };
  }
  return {};
}

Signals::Reader Signals::reader(const std::string& name) const {
  try {
    if (name == "time") return [](const Snapshot& s) { return s.time(); };
    if (name == "support.margin") return supportMargin;
    if (auto read = contactReader(name)) return read;
    if (auto read = jointReader(name)) return read;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string angle = kAngles[axis];
      const auto body = before(name, angle);
      if (!body) continue;
      const auto named = after(*body, "attitude.");
      if (*body != "root" && !named) continue;
      return [axis, id = named ? model_->body(*named) : model_->root()](const Snapshot& s) {
        return sim::rpyOf(s.bodyRotation(id))[axis];
      };
    }
    for (const Turning& turning : kTurnings) {
      const auto body = after(name, turning.prefix);
      if (!body) continue;
      const BodyId id = *body == "root" ? model_->root() : model_->body(*body);
      return [angle = turning.angle, id](const Snapshot& s) {
        return sim::Turn::of(s.bodyRotation(id)).*angle;
      };
    }
    if (const auto part = component(name)) return vectorReader(part->name, part->axis);
    for (const bool left : {false, true}) {
      const auto vector = before(name, left ? ".left" : ".forward");
      if (!vector) continue;
      auto x = vectorReader(*vector, 0);
      auto y = vectorReader(*vector, 1);
      if (!x || !y) return {};
      return [left, x = std::move(x), y = std::move(y)](const Snapshot& s) {
        const Vector3d forward = s.heading();
        return left ? x(s) * -forward.y() + y(s) * forward.x()
                    : x(s) * forward.x() + y(s) * forward.y();
      };
    }
  } catch (const InputError&) {
    // a body or joint the model lacks: no such signal
  }
  return {};
}

std::vector<std::string> Signals::names() const {
  std::vector<std::string> out = {"time", "support.x", "support.y", "support.margin",
                                  "power.robot"};
  const auto angles = [&](const std::string& name) {
    for (const char* angle : kAngles) out.push_back(name + angle);
  };
  const auto vector = [&](const std::string& name) {
    for (const char* axis : {".x", ".y", ".z", ".forward", ".left"}) out.push_back(name + axis);
  };
  const auto group = [&](const std::string& name) {
    for (const char* kind : {"contact.", "contact_force.", kImpulse}) out.push_back(kind + name);
  };
  const auto body = [&](const std::string& name) {
    group(name);
    for (const char* kind : {"body.", "body_velocity.", "body_com."}) vector(kind + name);
  };
  const auto turning = [&](const std::string& name) {
    for (const char* kind : {kSomersault, kTilt, kHeading}) out.push_back(kind + name);
  };
  angles("root");
  turning("root");
  for (const char* name :
       {"com", "com_velocity", "linear_momentum", "angular_momentum", "cop", "spin"}) {
    vector(name);
  }
  group(kRobot);
  for (int b = 1; b < model_->bodies(); ++b) {
    body(model_->bodyName({b}));
    angles("attitude." + model_->bodyName({b}));
    turning(model_->bodyName({b}));
  }
  const auto joint = [&](const std::string& name) {
    for (const char* kind : {"joint.", "joint_velocity."}) out.push_back(kind + name);
  };
  for (const sim::Joint& j : model_->joints()) {
    joint(j.name);
    for (const char* kind : {kJointForce, "torque.", "power."}) out.push_back(kind + j.name);
  }
  if (const sim::Robot* robot = model_->robot().get()) {
    for (const auto& [name, unused] : robot->bodies) body(name);
    for (const auto& [name, unused] : robot->mirrored) joint(name);
    for (const auto& [name, unused] : robot->contacts) {
      for (const char* kind : {"point.", "point_velocity."}) vector(kind + name);
    }
  }
  for (std::string& name : out) name = Expression::spelled(name);
  return out;
}

std::string Signals::unitOf(const std::string& name) const {
  static constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"time", "s"},
      {"com.", "m"},
      {"com_velocity.", "m/s"},
      {"linear_momentum.", "kg·m/s"},
      {"angular_momentum.", "kg·m²/s"},
      {"cop.", "m"},
      {"support.", "m"},
      {"root.", "rad"},
      {"attitude.", "rad"},
      {kSomersault, "rad"},
      {kTilt, "rad"},
      {kHeading, "rad"},
      {"spin.", "rad/s"},
      {"body.", "m"},
      {"body_velocity.", "m/s"},
      {"body_com.", "m"},
      {"point.", "m"},
      {"point_velocity.", "m/s"},
      {kJointForce, "N"},
      {"power.", "W"},
      {"contact_force.", "N"},
      {kImpulse, "N·s"}};
  if (!reader(name)) return "";
  const auto of_joint = [&](std::string_view prefix, const char* slide, const char* hinge) {
    const auto joint = after(name, prefix);
    if (!joint) return "";
    return jointOrPair(*joint).front().first.slides ? slide : hinge;
  };
  for (const std::string_view unit :
       {of_joint("joint.", "m", "rad"), of_joint("joint_velocity.", "m/s", "rad/s"),
        of_joint("torque.", "N", "N·m")}) {
    if (!unit.empty()) return std::string(unit);
  }
  for (const auto& [prefix, unit] : kUnits) {
    if (name.starts_with(prefix)) return std::string(unit);
  }
  return "";
}

}  // namespace traceur::control
