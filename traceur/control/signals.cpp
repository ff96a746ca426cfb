#include "traceur/control/signals.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "traceur/control/expression.h"
#include "traceur/core/error.h"

namespace traceur::control {
namespace {

using sim::BodyId;
using sim::Snapshot;
using sim::Vector3d;

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

/// Roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll).
double attitude(const Eigen::Matrix3d& R, int axis) {
  switch (axis) {
    case 0:
      return std::atan2(R(2, 1), R(2, 2));
    case 1:
      return std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)));
    default:
      return std::atan2(R(1, 0), R(0, 0));
  }
}

/// 1 or -1 when side b or a of a contact, and not the other, is in bodies; 0 for neither, for both
/// and inside the robot.
int sideIn(const sim::Model& model, const std::vector<bool>& bodies, const sim::Contact& c) {
  const bool a = bodies[c.body_a.value];
  if (a == bodies[c.body_b.value]) return 0;
  if (model.isRobot(c.body_a) && model.isRobot(c.body_b)) return 0;
  return a ? -1 : 1;
}

}  // namespace

Signals::Signals(std::shared_ptr<const sim::Model> model) : model_(std::move(model)) {}

const double* Signals::find(const std::string& name) {
  for (const auto& e : entries_) {
    if (e->name == name) return &e->value;
  }
  auto read = reader(name);
  if (!read) return nullptr;
  entries_.push_back(std::make_unique<Entry>(Entry{name, std::move(read)}));
  return &entries_.back()->value;
}

void Signals::update(const Snapshot& s) {
  for (const auto& e : entries_) e->value = e->read(s);
}

std::vector<bool> Signals::bodiesNamed(const std::string& name) const {
  const sim::Model& m = *model_;
  std::vector<bool> in(m.bodies(), false);
  const sim::Robot* robot = m.robot().get();
  if (name == "robot") {
    for (int b = 1; b < m.bodies(); ++b) in[b] = m.isRobot({b});
  } else if (robot && robot->bodies.contains(name)) {
    for (const std::string& body : robot->bodies.at(name)) in[m.body(body).value] = true;
  } else {
    in[m.body(name).value] = true;
  }
  return in;
}

std::function<double(const Snapshot&)> Signals::reader(const std::string& name) const {
  try {
    if (name == "time") return [](const Snapshot& s) { return s.time(); };
    if (const auto group = after(name, "contact.")) {
      return [m = model_.get(), in = bodiesNamed(*group)](const Snapshot& s) {
        int n = 0;
        for (const sim::Contact& c : s.contacts()) n += sideIn(*m, in, c) != 0;
        return static_cast<double>(n);
      };
    }
    if (const auto group = after(name, "contact_force.")) {
      return [m = model_.get(), in = bodiesNamed(*group)](const Snapshot& s) {
        double f = 0;
        for (const sim::Contact& c : s.contacts()) f += sideIn(*m, in, c) * c.f_WC.z();
        return f;
      };
    }
    if (const auto joint = after(name, "joint.")) {
      return [i = model_->joint(*joint).q](const Snapshot& s) { return s.q()[i]; };
    }
    if (const auto joint = after(name, "joint_velocity.")) {
      return [i = model_->joint(*joint).v](const Snapshot& s) { return s.v()[i]; };
    }
    for (int axis = 0; axis < 3; ++axis) {
      static constexpr const char* kAngles[] = {"root.roll", "root.pitch", "root.yaw"};
      if (name == kAngles[axis]) {
        return [axis, root = model_->root()](const Snapshot& s) {
          return attitude(s.bodyRotation(root), axis);
        };
      }
    }
    const auto part = component(name);
    if (!part) return {};
    const int i = part->axis;
    if (part->name == "com") return [i](const Snapshot& s) { return s.com()[i]; };
    if (part->name == "com_velocity") return [i](const Snapshot& s) { return s.comVelocity()[i]; };
    if (part->name == "angular_momentum") {
      return [i](const Snapshot& s) { return s.angularMomentum()[i]; };
    }
    if (part->name == "cop") {
      return [i](const Snapshot& s) {
        const auto p = s.cop();
        return p ? (*p)[i] : kNan;
      };
    }
    if (const auto body = after(part->name, "body.")) {
      return [i, id = model_->body(*body)](const Snapshot& s) { return s.bodyPosition(id)[i]; };
    }
    if (const auto body = after(part->name, "body_velocity.")) {
      return [i, id = model_->body(*body)](const Snapshot& s) { return s.bodyVelocity(id)[i]; };
    }
  } catch (const InputError&) {
    // a body or joint the model lacks: no such signal
  }
  return {};
}

std::vector<std::string> Signals::names() const {
  std::vector<std::string> out = {"time", "root.roll", "root.pitch", "root.yaw"};
  const auto vector = [&](const std::string& name) {
    for (const char* axis : {".x", ".y", ".z"}) out.push_back(name + axis);
  };
  for (const char* name : {"com", "com_velocity", "angular_momentum", "cop"}) vector(name);
  const auto group = [&](const std::string& name) {
    out.push_back("contact." + name);
    out.push_back("contact_force." + name);
  };
  group("robot");
  if (const sim::Robot* robot = model_->robot().get()) {
    for (const auto& [name, unused] : robot->bodies) group(name);
  }
  for (int b = 1; b < model_->bodies(); ++b) {
    const std::string body = model_->bodyName({b});
    group(body);
    vector("body." + body);
    vector("body_velocity." + body);
  }
  for (const sim::Joint& j : model_->joints()) {
    out.push_back("joint." + j.name);
    out.push_back("joint_velocity." + j.name);
  }
  std::erase_if(out, [](const std::string& name) { return !Expression::isName(name); });
  return out;
}

std::string Signals::unitOf(const std::string& name) const {
  static constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"time", "s"},
      {"com.", "m"},
      {"com_velocity.", "m/s"},
      {"angular_momentum.", "kg·m²/s"},
      {"cop.", "m"},
      {"root.", "rad"},
      {"body.", "m"},
      {"body_velocity.", "m/s"},
      {"contact_force.", "N"}};
  if (!reader(name)) return "";
  if (const auto joint = after(name, "joint.")) return model_->joint(*joint).slides ? "m" : "rad";
  if (const auto joint = after(name, "joint_velocity.")) {
    return model_->joint(*joint).slides ? "m/s" : "rad/s";
  }
  for (const auto& [prefix, unit] : kUnits) {
    if (name.starts_with(prefix)) return std::string(unit);
  }
  return "";
}

}  // namespace traceur::control
