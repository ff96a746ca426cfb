// The bare engine that loops are compared with, and how benches measure.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "traceur/sim/recording.h"

namespace traceur::bench {

inline double cpuSeconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double wallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

inline double median(std::vector<double> x) {
  std::sort(x.begin(), x.end());
  return x[x.size() / 2];
}

inline void print(const char* what, const std::vector<double>& numbers) {
  const auto [low, high] = std::minmax_element(numbers.begin(), numbers.end());
  std::printf("%-58s median %.3f  (%.3f to %.3f, %zu pairs)\n", what, median(numbers), *low, *high,
              numbers.size());
}

/// CPU seconds of a bare mj_step along a recorded trial. Torques held over the time between frames
/// make another motion, so each frame's state is set afresh and the loop sees the trial's contacts.
inline double bareStep(const mjModel* m, mjData* d, const sim::Recording& recording,
                       double interval) {
  const auto per_frame = static_cast<size_t>(std::lround(interval / m->opt.timestep));
  size_t steps = 0;
  const double begun = cpuSeconds();
  for (size_t f = 0; f + 1 < recording.frames.size(); ++f) {
    const sim::State& s = recording.frames[f].state;
    std::copy(s.q.data(), s.q.data() + m->nq, d->qpos);
    std::copy(s.v.data(), s.v.data() + m->nv, d->qvel);
    for (size_t k = 0; k < per_frame; ++k, ++steps) {
      std::copy_n(recording.frames[f].torque.data(), m->nu, d->ctrl);
      mj_step(m, d);
    }
  }
  return (cpuSeconds() - begun) / static_cast<double>(steps);
}

}  // namespace traceur::bench
