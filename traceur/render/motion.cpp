#include "traceur/render/motion.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "traceur/core/error.h"

namespace traceur::render {
namespace {

constexpr double kLeastFlight = 0.03;  // [s] [ours]

/// Touches something fixed to the world.
bool isGrounded(const sim::Model& model, const sim::Frame& frame) {
  return std::any_of(frame.contacts.begin(), frame.contacts.end(), [&](const sim::Contact& c) {
    return model.isRobot(c.body_a) != model.isRobot(c.body_b) &&
           (model.isStatic(c.body_a) || model.isStatic(c.body_b));
  });
}

/// A stretch without contact: frames [begin, end), with contact before and after.
struct Flight {
  size_t begin = 0;
  size_t end = 0;
};

std::vector<Flight> flightsOf(const sim::Model& model, const std::vector<sim::Frame>& frames) {
  std::vector<Flight> flights;
  const auto duration = [&](const Flight& f) {
    return frames[f.end].state.time - frames[f.begin].state.time;
  };
  bool was_grounded = false;
  size_t begin = 0;
  for (size_t i = 0; i < frames.size(); ++i) {
    const bool grounded = isGrounded(model, frames[i]);
    if (!grounded && was_grounded) begin = i;
    if (grounded && !was_grounded) {
      const Flight flight = {begin, i};
      if (duration(flight) >= kLeastFlight) flights.push_back(flight);
    }
    was_grounded = grounded;
  }
  std::stable_sort(flights.begin(), flights.end(),
                   [&](const Flight& a, const Flight& b) { return duration(a) > duration(b); });
  return flights;
}

}  // namespace

void checkRecording(const sim::Model& model, const sim::Recording& recording) {
  if (recording.frames.empty()) throw InputError("the recording has no frames");
  double last = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    const sim::State& s = recording.frames[i].state;
    if (s.q.size() != model.nq() || s.v.size() != model.nv()) {
      throw InputError(
          fmt::format("the recording's frame {} has q({}), v({}), its model q({}), v({})", i,
                      s.q.size(), s.v.size(), model.nq(), model.nv()));
    }
    if (!s.q.allFinite()) throw InputError(fmt::format("the recording's frame {} holds NaN", i));
    for (const sim::Contact& c : recording.frames[i].contacts) {
      for (const sim::BodyId b : {c.body_a, c.body_b}) {
        if (b.value >= 0 && b.value < model.bodies()) continue;
        throw InputError(
            fmt::format("the recording's frame {} has a contact of body {}, its model "
                        "{} bodies",
                        i, b.value, model.bodies()));
      }
    }
    const auto forces = recording.frames[i].joint_forces.size();
    if (forces != 0 && forces != model.bodies()) {
      throw InputError(
          fmt::format("the recording's frame {} has joint forces of {} bodies, its "
                      "model {}",
                      i, forces, model.bodies()));
    }
    if (!(s.time > last && std::isfinite(s.time))) {
      throw InputError(fmt::format("the recording's frame {} is at {} s, the one before at {} s", i,
                                   s.time, last));
    }
    last = s.time;
  }
}

sim::Frame frameAt(const sim::Model& model, const sim::Recording& recording, double time) {
  const std::vector<sim::Frame>& frames = recording.frames;
  const auto after =
      std::upper_bound(frames.begin(), frames.end(), time,
                       [](double t, const sim::Frame& f) { return t < f.state.time; });
  if (after == frames.begin()) return frames.front();
  if (after == frames.end()) return frames.back();
  const sim::Frame& a = *(after - 1);
  const sim::Frame& b = *after;
  const double span = b.state.time - a.state.time;
  const double part = (time - a.state.time) / span;

  sim::Frame frame = a;
  frame.state.time = time;
  sim::VectorXd rate(model.nv());
  mj_differentiatePos(model.raw(), rate.data(), span, a.state.q.data(), b.state.q.data());
  mj_integratePos(model.raw(), frame.state.q.data(), rate.data(), part * span);
  frame.state.v += part * (b.state.v - a.state.v);
  frame.com += part * (b.com - a.com);
  frame.com_velocity += part * (b.com_velocity - a.com_velocity);
  return frame;
}

std::string phaseName(const sim::Recording& recording, const sim::Frame& frame) {
  const size_t phase = static_cast<size_t>(frame.phase);  // -1 becomes more than there are
  return phase < recording.phases.size() ? recording.phases[phase] : "";
}

std::vector<PhaseStart> phaseStarts(const sim::Recording& recording) {
  std::vector<PhaseStart> starts;
  int last = -1;
  for (const sim::Frame& frame : recording.frames) {
    const std::string name = phaseName(recording, frame);
    if (!name.empty() && frame.phase != last) starts.push_back({frame.state.time, name});
    last = frame.phase;
  }
  return starts;
}

std::vector<double> tellingTimes(const sim::Model& model, const sim::Recording& recording,
                                 int count) {
  if (count < 1) throw InputError(fmt::format("{} pictures: expected at least 1", count));
  const std::vector<sim::Frame>& frames = recording.frames;
  const double start = frames.front().state.time;
  const double end = frames.back().state.time;

  std::vector<double> moments = {start, end};
  for (const Flight& f : flightsOf(model, frames)) {
    const auto apex = std::max_element(
        frames.begin() + static_cast<std::ptrdiff_t>(f.begin),
        frames.begin() + static_cast<std::ptrdiff_t>(f.end),
        [](const sim::Frame& a, const sim::Frame& b) { return a.com.z() < b.com.z(); });
    moments.push_back(apex->state.time);
    moments.push_back(frames[f.end].state.time);
    moments.push_back(frames[f.begin].state.time);
  }

  const double nearly = (end - start) / (4.0 * count);
  std::vector<double> times;
  const auto has_room = [&] { return static_cast<int>(times.size()) < count; };
  const auto distance = [&](double t) {
    double least = std::numeric_limits<double>::infinity();
    for (const double s : times) least = std::min(least, std::abs(s - t));
    return least;
  };
  for (const double t : moments) {
    if (has_room() && distance(t) > nearly) times.push_back(t);
  }
  const std::vector<PhaseStart> phases = phaseStarts(recording);
  while (has_room() && !phases.empty()) {
    const auto farthest = std::max_element(phases.begin(), phases.end(),
                                           [&](const PhaseStart& a, const PhaseStart& b) {
                                             return distance(a.time) < distance(b.time);
                                           });
    if (distance(farthest->time) <= nearly) break;
    times.push_back(farthest->time);
  }
  std::sort(times.begin(), times.end());
  while (static_cast<int>(times.size()) < count && end > start) {
    size_t widest = 1;
    for (size_t i = 2; i < times.size(); ++i) {
      if (times[i] - times[i - 1] > times[widest] - times[widest - 1] + 1e-9) widest = i;
    }
    const double middle = (times[widest - 1] + times[widest]) / 2;
    times.insert(times.begin() + static_cast<std::ptrdiff_t>(widest), middle);
  }
  return times;
}

}  // namespace traceur::render
