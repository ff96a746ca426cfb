#include "traceur/practice/withstands.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>

#include "traceur/core/random.h"
#include "traceur/core/thread_pool.h"

namespace traceur::practice {
namespace {

using skill::Disturbance;

/// How far from the model a robot may be. Noise: one step of a small servo's encoder, 0.29°, and
/// what a cheap inertial unit makes of a velocity [ours].
constexpr double kMass = 0.1;
constexpr double kLeastFriction = 0.6;
constexpr double kMostFriction = 1.2;
constexpr double kDelay = 0.010;         // [s]
constexpr double kEncoderNoise = 0.005;  // [rad]
constexpr double kVelocityNoise = 0.05;  // [m/s]
constexpr int kLevels = 5;
constexpr int kDrawn = 20;

std::vector<Withstood> disturbances(std::uint64_t seed, double time_step) {
  const auto whole = [&](double delay) { return time_step * std::round(delay / time_step); };
  std::vector<Withstood> all;
  for (int i = 0; i < kLevels; ++i) {
    const double part = i / (kLevels - 1.0);
    Disturbance d;
    d.mass = 1 - kMass + 2 * kMass * part;
    all.push_back({"mass", d.mass, d});
    d = {};
    d.friction = kLeastFriction + (kMostFriction - kLeastFriction) * part;
    all.push_back({"friction", *d.friction, d});
    d = {};
    d.delay = whole(kDelay * part);
    all.push_back({"delay", 1e3 * d.delay, d});
    d = {};
    d.encoder_noise = part * kEncoderNoise;
    d.velocity_noise = part * kVelocityNoise;
    d.seed = seed + i;
    all.push_back({"noise", part, d});
  }
  for (int i = 0; i < kDrawn; ++i) {
    Random random(seed, 0, i);
    Disturbance d;
    d.mass = random.uniform(1 - kMass, 1 + kMass);
    d.friction = random.uniform(kLeastFriction, kMostFriction);
    d.delay = whole(random.uniform(0, kDelay));
    const double noise = random.uniform();
    d.encoder_noise = noise * kEncoderNoise;
    d.velocity_noise = noise * kVelocityNoise;
    d.seed = random.bits();
    all.push_back({"drawn", static_cast<double>(i + 1), d});
  }
  return all;
}

}  // namespace

const std::vector<DisturbanceKind>& disturbanceKinds() {
  static const std::vector<DisturbanceKind> kKinds = {
      {"mass", "mass [of the model's]"},
      {"friction", "ground friction"},
      {"delay", "control delay [ms]"},
      {"noise", fmt::format("sensor noise [{} rad, {} m/s]", kEncoderNoise, kVelocityNoise)},
      {"drawn", "all at random, number"}};
  return kKinds;
}

std::vector<Withstood> withstands(std::span<const LearnedSkill> what,
                                  const WithstandOptions& options) {
  const skill::Skill& skill = *what.front().skill;
  std::vector<Withstood> all = disturbances(options.seed, skill.model->timeStep());
  if (options.on_done) options.on_done(0, static_cast<int>(all.size()));
  std::mutex mutex;
  int done = 0;
  ThreadPool pool(options.threads);
  pool.forEach(static_cast<int>(all.size()), [&](int i) {
    if (options.stop.stop_requested()) return;
    // A robot of its own for each: masses and friction are part of the model.
    skill::Runner runner(skill::Skill::fromText(skill.text, skill.file, all[i].disturbance));
    for (const LearnedSkill& one : what) {
      if (options.stop.stop_requested()) return;
      all[i].rollouts.push_back(runner.run(one.parameters, one.task));
    }
    const std::scoped_lock lock(mutex);
    if (options.on_done) options.on_done(++done, static_cast<int>(all.size()));
  });
  return all;
}

}  // namespace traceur::practice
